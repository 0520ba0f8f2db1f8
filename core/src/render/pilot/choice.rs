//! Which method to take by what a pilot tells.

use super::plan::REPLICATES;

/// Time over the least that is about the least.
const ABOUT: f64 = 1.1;

/// Balanced halves of the sequences: each of them is in half of these, and each two of them are alike often together.
pub(super) fn halves() -> impl Iterator<Item = Vec<usize>> {
    // Rows of a Hadamard matrix and their complements (McCarthy 1969, Pseudo-replication: half samples).
    let half = |row: usize, odd: u32| -> Vec<usize> {
        (0..REPLICATES as usize).filter(|r| (r & row).count_ones() % 2 == odd).collect()
    };
    (1..REPLICATES as usize).flat_map(move |row| [half(row, 0), half(row, 1)])
}

/// What is taken, and the time of each method over that of it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Choice {
    pub taken: usize,
    pub time_ratios: Vec<f64>,
}

/// By the work that each method needs for the same error as each of several halves of the sequences tells, and by the work of a sample.
///
/// What is to be small is the time over that of the best method, in the geometric mean: a sequence that has met a rare spike is in half
/// of the halves only, and speaks in these alone for the methods with cheap samples. Of those that are about the best, the one
/// with the cheapest samples is taken: what no pilot has met is the same for all that come to it by chance, and costs those with dear
/// samples the more.
pub(super) fn choice(costs: &[Vec<f64>], work: &[f64]) -> Choice {
    let mean = |method: usize| {
        let log = |half: &Vec<f64>| libm::log(half[method].clamp(f64::MIN_POSITIVE, f64::MAX));
        costs.iter().map(log).sum::<f64>() / costs.len() as f64
    };
    let means: Vec<f64> = (0..work.len()).map(mean).collect();
    let least = means.iter().copied().fold(f64::INFINITY, f64::min);
    let about_least = (0..work.len()).filter(|method| means[*method] <= least + libm::log(ABOUT));
    let taken = about_least.min_by(|a, b| work[*a].total_cmp(&work[*b])).expect("one has the least");
    let ratio = |mean: &f64| libm::exp(mean - means[taken]).min(f64::MAX);
    Choice { taken, time_ratios: means.iter().map(ratio).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_sequence_is_in_half_of_the_halves_and_each_two_are_alike_often_together() {
        let all: Vec<Vec<usize>> = halves().collect();
        assert!(all.iter().all(|half| half.len() == 4));
        for a in 0..8 {
            assert_eq!(all.iter().filter(|half| half.contains(&a)).count(), all.len() / 2);
            for b in 0..a {
                let both = all.iter().filter(|half| half.contains(&a) && half.contains(&b));
                assert_eq!(both.count(), 3, "{a} {b}");
            }
        }
    }

    #[test]
    fn of_methods_that_are_about_as_good_the_one_with_the_cheapest_samples_is_taken() {
        let of = |light: f64| choice(&vec![vec![1.0, 1.09, light]; 2], &[4.0, 2.0, 1.0]);
        assert_eq!(of(1.11).taken, 1);
        assert_eq!(of(1.09).taken, 2);
        assert_eq!(of(f64::INFINITY).taken, 1);
        assert_eq!(of(f64::NAN).taken, 1);
        assert!((of(1.09 * 3.0).time_ratios[2] - 3.0).abs() < 1e-9);
    }

    #[test]
    fn a_spike_that_some_halves_have_met_does_not_decide() {
        // The second is three times as good, but for a spike that makes the cheap one look better by a tenth.
        let halves = [vec![3.0, 1.0], vec![30.0, 33.0]];
        assert_eq!(choice(&halves, &[1.0, 2.0]).taken, 1);
    }

    #[test]
    fn where_nothing_is_seen_the_cheapest_is_taken() {
        let black = choice(&[vec![0.0, 0.0]], &[2.0, 1.0]);
        assert_eq!((black.taken, black.time_ratios), (1, vec![1.0, 1.0]));
    }
}

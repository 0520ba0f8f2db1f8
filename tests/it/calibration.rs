//! Certified errors hold as often as they claim.

use ovtigre_core::film::certificate::{FALSE_STOP_PROBABILITY, level};
use ovtigre_tests::calibration::{Plan, calibrate, cases};

/// Most misses of `n` that have a probability of `p` each which one in 10,000 such tests exceeds, or fewer.
fn most_misses(n: usize, p: f64) -> usize {
    let (mut term, mut tail, mut k) = ((1.0 - p).powi(n as i32), 0.0, 0);
    loop {
        tail += term;
        if 1.0 - tail < 1e-4 {
            return k;
        }
        term *= (n - k) as f64 / (k + 1) as f64 * p / (1.0 - p);
        k += 1;
    }
}

fn assert_honest(name: &str) {
    let cases = cases();
    let case = cases.iter().find(|case| case.name == name).unwrap();
    let plan = Plan { runs: 100, side: 12, looks: 4, replicates: 4, reference: 100, seed: 1_000_000 };
    let found = calibrate(case, plan);
    for look in 0..plan.looks {
        let [believed, wrong] = found.wrong(look);
        let most = most_misses(found.runs.len(), level(look + 1));
        assert!(wrong <= most, "{name}, look {look}: {wrong} of {believed} are too low");
    }
    for target in [0.5, 0.3, 0.2, 0.15] {
        let [stopped, right] = found.stopped(target);
        let most = most_misses(found.runs.len(), FALSE_STOP_PROBABILITY);
        assert!(stopped - right <= most, "{name}, {target}: {right} of {stopped}");
    }
}

#[test]
fn diffuse_rooms_by_path_have_at_most_the_certified_error() {
    assert_honest("cornell");
}

#[test]
fn light_subpaths_that_pixels_share_have_at_most_the_certified_error() {
    assert_honest("cornell-light");
}

#[test]
fn heavy_tails_have_at_most_the_certified_error_or_are_not_certified() {
    assert_honest("caustic-path");
}

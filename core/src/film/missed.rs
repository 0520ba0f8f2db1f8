//! Light that one picture shows and another one of the same has not met yet.

use super::{append::Prefix, error::EPSILON};
use std::borrow::Borrow;

/// Blocks along the longer side of a picture, in which pictures are compared: more of them would have more noise, fewer would hide what
/// is missed among what is not.
const BLOCKS: u32 = 12;

/// Mean and variance of the mean of each block's luminance.
type Blocks = Vec<(f64, f64)>;

/// Relative error of `seen` by light that is in `other` and not in it. Both are the replicates (two or more) of the same region.
///
/// Spread does not tell of light that no sample has met. Blocks of pixels that are darker than in another method's picture, by more
/// than the spread of both explains, do: √(mean over blocks of \[max(0, m' − m)² − max(v', (v + v')/2)\] / (m'² + ε Ȳ²)), m and v
/// mean and variance of a block, those of the other picture primed. It is 0 in the mean where both have met the same light.
pub fn missed<P: Borrow<Prefix>>(seen: &[P], other: &[P]) -> f64 {
    let (seen, other) = (blocks(seen), blocks(other));
    let count = other.len() as f64;
    let mean = other.iter().map(|(mean, _)| mean).sum::<f64>() / count;
    let squares = seen.iter().zip(&other).map(|((m, v), (m2, v2))| {
        let darker = (m2 - m).max(0.0);
        let weight = m2 * m2 + EPSILON * mean * mean;
        if weight > 0.0 { (darker * darker - v2.max(0.5 * (v + v2))) / weight } else { 0.0 }
    });
    (squares.sum::<f64>() / count).max(0.0).sqrt()
}

fn blocks(replicates: &[impl Borrow<Prefix>]) -> Blocks {
    let all: Vec<Vec<f64>> = replicates.iter().map(|one| means(one.borrow())).collect();
    let r = all.len() as f64;
    (0..all[0].len())
        .map(|block| {
            let mean = all.iter().map(|means| means[block]).sum::<f64>() / r;
            let squares = all.iter().map(|means| (means[block] - mean) * (means[block] - mean));
            (mean, squares.sum::<f64>() / (r * (r - 1.0)))
        })
        .collect()
}

/// Mean luminance of each block of a replicate; those at the right and lower edge may be smaller.
fn means(prefix: &Prefix) -> Vec<f64> {
    let region = prefix.region();
    let side = region.width.max(region.height).div_ceil(BLOCKS);
    let columns = region.width.div_ceil(side);
    let mut sums = vec![(0.0, 0.0); (columns * region.height.div_ceil(side)) as usize];
    for (i, pixel) in prefix.layer(0).chunks_exact(3).enumerate() {
        let (x, y) = (i as u32 % region.width, i as u32 / region.width);
        let block = &mut sums[(y / side * columns + x / side) as usize];
        block.0 += 0.2126 * pixel[0] + 0.7152 * pixel[1] + 0.0722 * pixel[2];
        block.1 += f64::from(prefix.samples());
    }
    sums.into_iter().map(|(light, samples)| light / samples).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{invalid::InvalidSamples, schedule::Schedule, size::Size, sum::Sum};

    /// Four replicates of 48×48 pixels of a radiance between `low` and `high`, and what `add` says of a pixel.
    fn picture(seed: u64, [low, high]: [f32; 2], add: impl Fn(usize, u32) -> f32) -> Vec<Prefix> {
        let size = Size { width: 48, height: 48 };
        let schedule = Schedule::new(size.frame(), 1, 4, 1);
        let mut state = seed;
        let mut noise = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f32 / 16777216.0
        };
        (0..4)
            .map(|r| {
                let mut prefix = Prefix::empty(size.frame(), r, 1);
                let plane = (0..2304).map(|i| [low + (high - low) * noise() + add(i, r); 3]).collect();
                let batch = schedule.batch(0, r, 0).unwrap();
                let sum = Sum {
                    batch,
                    planes: vec![plane],
                    invalid: InvalidSamples::default(),
                    rays: 0,
                    tile_rays: Vec::new(),
                };
                prefix.append(&sum).unwrap();
                prefix
            })
            .collect()
    }

    #[test]
    fn noise_is_not_missed_light() {
        let [a, b] = [1, 2].map(|seed| picture(seed, [0.0, 2.0], |_, _| 0.0));
        // A mean over 144 blocks, whose squared errors are 1/192 of their squared means: a few times 1/192/12.
        assert!(missed(&a, &b) < 0.06 && missed(&b, &a) < 0.06, "{} {}", missed(&a, &b), missed(&b, &a));
    }

    #[test]
    fn a_spike_of_one_replicate_is_not_light_that_the_other_picture_missed() {
        let plain = picture(1, [0.9, 1.1], |_, _| 0.0);
        let spiky = picture(2, [0.9, 1.1], |i, r| if i == 500 && r == 2 { 300.0 } else { 0.0 });
        assert!(missed(&plain, &spiky) < 0.01, "{}", missed(&plain, &spiky));
    }

    #[test]
    fn what_all_replicates_of_the_other_show_is_missed_by_the_one_that_is_darker() {
        // Every fourth row of blocks is three times as bright in the other: √(1/4 · (2/3)²) but for ε.
        let bright = |i: usize, _: u32| if (i / 48 / 4).is_multiple_of(4) { 2.0 } else { 0.0 };
        let [dark, other] = [picture(1, [0.9, 1.1], |_, _| 0.0), picture(2, [0.9, 1.1], bright)];
        assert!((missed(&dark, &other) - 1.0 / 3.0).abs() < 0.01, "{}", missed(&dark, &other));
        assert!(missed(&other, &dark) < 0.01, "{}", missed(&other, &dark));
    }
}

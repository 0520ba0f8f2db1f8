//! Errors of small pictures, over the light that one of them shows best.

use super::{
    append::Prefix,
    error::{EPSILON, window_mean},
};
use std::borrow::Borrow;

/// Squares over those of the light around: each pixel's over Y² + ε Ȳ², Y the 3×3 mean luminance of a picture, as in
/// [`estimate`](super::error::estimate).
#[derive(Clone, Debug)]
pub struct RelativeTo {
    weights: Vec<f64>,
}

impl RelativeTo {
    /// To the mean of the replicates of a picture.
    pub fn new(seen: &[impl Borrow<Prefix>]) -> Self {
        let region = seen[0].borrow().region();
        let (width, height) = (region.width as usize, region.height as usize);
        let picture = Plane::of(seen, 0);
        let mean = |i: usize| picture.mean(i);
        let luminance: Vec<f64> = (0..region.pixels())
            .map(|i| 0.2126 * mean(3 * i) + 0.7152 * mean(3 * i + 1) + 0.0722 * mean(3 * i + 2))
            .collect();
        let whole = luminance.iter().sum::<f64>() / luminance.len() as f64;
        let weight = |i: usize| {
            let local = window_mean(&luminance, width, height, i % width, i / width);
            let square = local * local + EPSILON * whole * whole;
            if square > 0.0 { 1.0 / square } else { 0.0 }
        };
        Self { weights: (0..luminance.len()).map(weight).collect() }
    }

    /// Mean square of a sample, where the plane `plane` of replicates of the same picture holds squares.
    pub fn square(&self, told: &[impl Borrow<Prefix>], plane: usize) -> f64 {
        let told = Plane::of(told, plane);
        self.mean(|i| told.mean(i))
    }

    /// Variance of a sample in the plane `plane`, by the spread of replicates of the same picture that have as many samples each.
    pub fn variance(&self, replicates: &[impl Borrow<Prefix>], plane: usize) -> f64 {
        let seen = Plane::of(replicates, plane);
        let count = replicates.len() as f64;
        let samples = seen.samples / count;
        self.mean(|i| {
            let mean = seen.mean(i);
            let deviation = |sums: &&[f64]| sums[i] / samples - mean;
            seen.sums.iter().map(|one| deviation(one).powi(2)).sum::<f64>() / (count - 1.0) * samples
        })
    }

    /// Mean over pixels and channels.
    fn mean(&self, square: impl Fn(usize) -> f64) -> f64 {
        let pixel =
            |(i, weight): (usize, &f64)| (0..3).map(|c| square(3 * i + c)).sum::<f64>() / 3.0 * weight;
        self.weights.iter().enumerate().map(pixel).sum::<f64>() / self.weights.len() as f64
    }
}

/// A plane of several replicates.
struct Plane<'a> {
    sums: Vec<&'a [f64]>,
    /// Of all replicates.
    samples: f64,
}

impl<'a> Plane<'a> {
    fn of(replicates: &'a [impl Borrow<Prefix>], plane: usize) -> Self {
        let sums = replicates.iter().map(|one| one.borrow().layer(plane)).collect();
        Self { sums, samples: replicates.iter().map(|one| f64::from(one.borrow().samples())).sum() }
    }

    /// Mean of a channel of a pixel over all samples.
    fn mean(&self, i: usize) -> f64 {
        self.sums.iter().map(|sums| sums[i]).sum::<f64>() / self.samples
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{invalid::InvalidSamples, schedule::Schedule, size::Size, sum::Sum};

    /// Two replicates of four samples in all: the left half shines with 1 in one, and with 2 in the other.
    fn replicates() -> Vec<Prefix> {
        let size = Size { width: 8, height: 8 };
        let schedule = Schedule::new(size.frame(), 2, 4, 2);
        let one = |r: u32| {
            let batch = schedule.batch(0, r, 0).unwrap();
            let count = batch.block.count as f32;
            let mut prefix = Prefix::empty(size.frame(), r, 2);
            let light = |i: usize| if i % 8 < 4 { count * (1.0 + r as f32) } else { 0.0 };
            let square = |i: usize| if i == 0 { [24.0 * count, 0.0, 12.0 * count] } else { [0.0; 3] };
            let planes = vec![(0..64).map(|i| [light(i); 3]).collect(), (0..64).map(square).collect()];
            let invalid = InvalidSamples::default();
            prefix.append(&Sum { batch, planes, invalid, rays: 0, tile_rays: Vec::new() }).unwrap();
            prefix
        };
        (0..2).map(one).collect()
    }

    #[test]
    fn squares_count_by_the_light_around_them() {
        let told = replicates();
        // Around the first pixel is a luminance of 3/2, half of that in the mean over the picture.
        let expected = (24.0 + 12.0) / 3.0 / (1.5 * 1.5 + 0.01 * 0.75 * 0.75) / 64.0;
        assert!((RelativeTo::new(&told).square(&told, 1) / expected - 1.0).abs() < 1e-7);
        assert!((RelativeTo::new(&told[..1]).square(&told, 1) / expected - 2.25).abs() < 1e-6);
    }

    #[test]
    fn the_variance_of_a_sample_is_the_spread_of_means_of_samples() {
        let all = replicates();
        // 1 and 2 are 3/2 ± √½ in half of the pixels; at the edge the light around is 1 of 3/2, and beyond it 1/2.
        let at = |light: f64| 1.0 / (light * light + 0.01 * 0.75 * 0.75);
        let expected = (3.0 * at(1.5) + at(1.0)) / 8.0 * 0.5 * f64::from(all[0].samples());
        assert!((RelativeTo::new(&all).variance(&all, 0) / expected - 1.0).abs() < 1e-7);
    }
}

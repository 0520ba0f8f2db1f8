//! A picture and its error from what the replicates have so far.

use super::{
    append::Prefix,
    size::{Region, Size},
    sum::Plane,
};

/// A picture: means, and how far off they may be.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// The whole frame.
    pub size: Size,
    /// The part of it that is here.
    pub region: Region,
    /// Means: the picture first, then each layer.
    pub planes: Vec<Plane>,
    /// Standard error of the mean of each plane; empty for a single replicate.
    pub errors: Vec<Plane>,
    /// Samples a pixel, over all replicates; the mean where pixels have different numbers.
    pub samples: f64,
}

/// The picture of `prefixes[region][replicate]`, whose regions are bands that cover `region`.
/// A pixel without samples is black.
pub fn picture(size: Size, region: Region, prefixes: &[Vec<Prefix>]) -> Picture {
    let layers = prefixes.first().and_then(|r| r.first()).map_or(1, Prefix::layers);
    let mut planes = vec![Vec::with_capacity(region.pixels()); layers];
    let replicates = prefixes.first().map_or(0, Vec::len);
    let mut errors = if replicates > 1 { planes.clone() } else { Vec::new() };
    let mut samples = 0.0;
    for replicates in prefixes {
        let counts: Vec<f64> = replicates.iter().map(|p| f64::from(p.samples())).collect();
        let count: f64 = counts.iter().sum();
        let pixels = replicates.first().map_or(0, |p| p.region().pixels());
        samples += count * pixels as f64;
        for (layer, plane) in planes.iter_mut().enumerate() {
            let sums: Vec<&[f64]> = replicates.iter().map(|p| p.layer(layer)).collect();
            plane.extend((0..pixels).map(|i| triple(|c| pooled_mean(&sums, i * 3 + c, count) as f32)));
            if let Some(error) = errors.get_mut(layer) {
                let of = |i: usize| variance_of_mean(&sums, &counts, i).sqrt() as f32;
                error.extend((0..pixels).map(|i| triple(|c| of(i * 3 + c))));
            }
        }
    }
    Picture { size, region, planes, errors, samples: samples / region.pixels() as f64 }
}

fn triple(of: impl Fn(usize) -> f32) -> [f32; 3] {
    [of(0), of(1), of(2)]
}

/// Σ sums / Σ samples: the mean of the replicates' means where they have equally many samples.
fn pooled_mean(sums: &[&[f64]], i: usize, count: f64) -> f64 {
    if count == 0.0 { 0.0 } else { sums.iter().map(|s| s[i]).sum::<f64>() / count }
}

/// Variance of the mean of the replicates' means: Σ(xᵣ−m)² / (R(R−1)), each replicate weighted by
/// its part of the samples where these differ; over those replicates that have any.
pub fn variance_of_mean(sums: &[&[f64]], counts: &[f64], i: usize) -> f64 {
    let count: f64 = counts.iter().sum();
    let with_samples = counts.iter().filter(|n| **n > 0.0).count() as f64;
    if with_samples < 2.0 {
        return 0.0;
    }
    let mean = pooled_mean(sums, i, count);
    let spread: f64 = (sums.iter().zip(counts).filter(|(_, n)| **n > 0.0))
        .map(|(s, n)| {
            let off = s[i] / n - mean;
            n / count * off * off
        })
        .sum();
    spread / (with_samples - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{batch::Batch, invalid::InvalidSamples, schedule::Schedule, sum::Sum};

    #[test]
    fn mean_and_error_are_those_of_the_replicates() {
        let size = Size { width: 2, height: 2 };
        let schedule = Schedule::new(size.frame(), 1, 3, 1);
        let values = [1.0_f32, 2.0, 6.0];
        let prefixes = (0..3).map(|r| {
            let mut prefix = Prefix::empty(size.frame(), r, 2);
            let batch: Batch = schedule.batch(0, r, 0).unwrap();
            let value = values[r as usize];
            let planes = vec![vec![[value, 0.0, 1.0]; 4], vec![[0.0, 2.0 * value, 3.0]; 4]];
            prefix
                .append(&Sum {
                    batch,
                    planes,
                    invalid: InvalidSamples::default(),
                    rays: 0,
                    tile_rays: Vec::new(),
                })
                .unwrap();
            prefix
        });
        let picture = picture(size, size.frame(), &[prefixes.collect()]);
        // Mean 3, deviations −2, −1, 3: variance of the mean 14 / (3 · 2).
        assert_eq!(picture.planes[0], vec![[3.0, 0.0, 1.0]; 4]);
        assert_eq!(picture.planes[1], vec![[0.0, 6.0, 3.0]; 4]);
        assert_eq!(picture.errors[0][3], [(14.0_f64 / 6.0).sqrt() as f32, 0.0, 0.0]);
        assert_eq!(picture.errors[1][3], [0.0, 2.0 * (14.0_f64 / 6.0).sqrt() as f32, 0.0]);
        assert!((picture.samples - 3.0).abs() < 1e-12);
    }
}

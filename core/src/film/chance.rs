//! Error by light that a picture's own samples meet too seldom to tell of it.

use super::{
    append::Prefix,
    error::{EPSILON, window_mean},
};

/// Square of the relative error of `samples` samples a pixel whose squares have their mean in the plane `squares` of `told`, replicates
/// of the same picture by a method that meets that light: mean over pixels of that mean, over `samples` (Y² + ε Ȳ²), Y the 3×3 mean
/// luminance of theirs, as in [`estimate`](super::error::estimate).
pub fn square_by_chance(told: &[Prefix], squares: usize, samples: f64) -> f64 {
    let region = told[0].region();
    let (width, height) = (region.width as usize, region.height as usize);
    let count: f64 = told.iter().map(|prefix| f64::from(prefix.samples())).sum();
    let mean = |plane: usize, i: usize| told.iter().map(|prefix| prefix.layer(plane)[i]).sum::<f64>() / count;
    let luminance: Vec<f64> = (0..region.pixels())
        .map(|i| 0.2126 * mean(0, 3 * i) + 0.7152 * mean(0, 3 * i + 1) + 0.0722 * mean(0, 3 * i + 2))
        .collect();
    let whole = luminance.iter().sum::<f64>() / luminance.len() as f64;
    let floor = EPSILON * whole * whole;
    let pixel = |i: usize| {
        let local = window_mean(&luminance, width, height, i % width, i / width);
        let square = (0..3).map(|c| mean(squares, 3 * i + c)).sum::<f64>() / 3.0;
        let weight = local * local + floor;
        if weight > 0.0 { square / weight } else { 0.0 }
    };
    (0..luminance.len()).map(pixel).sum::<f64>() / luminance.len() as f64 / samples
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{invalid::InvalidSamples, schedule::Schedule, size::Size, sum::Sum};

    #[test]
    fn squares_count_by_the_light_around_them() {
        let size = Size { width: 8, height: 8 };
        let schedule = Schedule::new(size.frame(), 2, 2, 1);
        let told: Vec<Prefix> = (0..2)
            .map(|r| {
                let mut prefix = Prefix::empty(size.frame(), r, 2);
                let light = |i: usize| if i % 8 < 4 { 1.0 + r as f32 } else { 0.0 };
                let square = |i: usize| if i == 0 { [24.0, 0.0, 12.0] } else { [0.0; 3] };
                let planes = vec![(0..64).map(|i| [light(i); 3]).collect(), (0..64).map(square).collect()];
                let (batch, invalid) = (schedule.batch(0, r, 0).unwrap(), InvalidSamples::default());
                prefix.append(&Sum { batch, planes, invalid, rays: 0, tile_rays: Vec::new() }).unwrap();
                prefix
            })
            .collect();
        // Around the first pixel is a luminance of 3/2, half of that in the mean over the picture.
        let expected = (24.0 + 12.0) / 3.0 / (1.5 * 1.5 + 0.01 * 0.75 * 0.75) / 64.0 / 5.0;
        assert!((square_by_chance(&told, 1, 5.0) / expected - 1.0).abs() < 1e-7);
    }
}

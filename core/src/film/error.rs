//! The error of a whole picture from the spread between its replicates.

use super::{
    append::Prefix,
    certificate::{Doubt, Look, certificate},
    size::Region,
};

/// Share of the picture's mean luminance that keeps black pixels from counting without bound.
pub(super) const EPSILON: f64 = 0.01;

/// Errors of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// √(mean over pixels and channels of the variance of the mean).
    pub rms: f64,
    /// √(mean over pixels of `[Σ_c v / 3]` / (Y² + ε Ȳ²)), Y the 3×3 mean luminance.
    pub relative: f64,
    /// What the relative error is at most; needs three replicates.
    pub relative_upper: Option<f64>,
    /// Why that may not be believed.
    pub doubt: Option<Doubt>,
}

/// The error of `prefixes[region][replicate]`, whose regions are bands that cover `region`; `None`
/// for a single replicate or where a replicate has no samples. What the error is at
/// most is looked up with the probability that this look may spend ([`super::certificate::level`]).
pub fn estimate(region: Region, prefixes: &[Vec<Prefix>], look: Look) -> Option<ErrorEstimate> {
    let replicates = replicate_means(prefixes, 0)?;
    let all: Vec<&[f64]> = replicates.iter().map(Vec::as_slice).collect();
    let (rms, relative) = mean_squares(region, &all);
    let of_region = |replicates: &Vec<Prefix>| replicates.iter().map(|p| f64::from(p.samples())).sum::<f64>();
    let samples = prefixes.iter().map(of_region).fold(f64::INFINITY, f64::min);
    let certificate = certificate(region, &all, relative, samples, look);
    Some(ErrorEstimate {
        rms: rms.sqrt(),
        relative: relative.sqrt(),
        relative_upper: certificate.as_ref().map(|c| c.upper),
        doubt: certificate.and_then(|c| c.doubt),
    })
}

/// One plane of a picture, as a whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneSummary {
    /// Mean luminance over the pixels.
    pub mean_luminance: f64,
    /// As in [`ErrorEstimate`]; `None` for a single replicate or where a replicate has no samples.
    pub rms: Option<f64>,
    /// As in [`ErrorEstimate`], by the plane's own luminance.
    pub relative: Option<f64>,
}

/// One plane of `prefixes[region][replicate]`, whose regions are bands that cover `region`.
pub fn summarise(region: Region, prefixes: &[Vec<Prefix>], plane: usize) -> PlaneSummary {
    let (mut light, mut samples) = (0.0, 0.0);
    for prefix in prefixes.iter().flatten() {
        let pixels = prefix.layer(plane).chunks_exact(3);
        light += pixels.map(|p| 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]).sum::<f64>();
        samples += f64::from(prefix.samples()) * prefix.region().pixels() as f64;
    }
    let errors = replicate_means(prefixes, plane).map(|means| {
        let all: Vec<&[f64]> = means.iter().map(Vec::as_slice).collect();
        mean_squares(region, &all)
    });
    PlaneSummary {
        mean_luminance: if samples > 0.0 { light / samples } else { 0.0 },
        rms: errors.map(|(rms, _)| rms.sqrt()),
        relative: errors.map(|(_, relative)| relative.sqrt()),
    }
}

/// Means of a plane of each replicate over all regions, three channels a pixel; `None` where there is only
/// one replicate, or one without samples.
fn replicate_means(prefixes: &[Vec<Prefix>], plane: usize) -> Option<Vec<Vec<f64>>> {
    let count = prefixes.first().map_or(0, Vec::len);
    if count < 2 || prefixes.iter().flatten().any(|p| p.samples() == 0) {
        return None;
    }
    let mean = |prefix: &Prefix| -> Vec<f64> {
        let scale = 1.0 / f64::from(prefix.samples());
        prefix.layer(plane).iter().map(|s| s * scale).collect()
    };
    Some((0..count).map(|r| prefixes.iter().flat_map(|region| mean(&region[r])).collect()).collect())
}

/// Mean square error and mean relative square error of the mean of `replicates`.
fn mean_squares(region: Region, replicates: &[&[f64]]) -> (f64, f64) {
    let (width, height) = (region.width as usize, region.height as usize);
    let r = replicates.len() as f64;
    let pixels = region.pixels();
    let mut luminance = Vec::with_capacity(pixels);
    let mut variance = Vec::with_capacity(pixels);
    for pixel in 0..pixels {
        let mut y = 0.0;
        let mut v = 0.0;
        for (c, weight) in [0.2126, 0.7152, 0.0722].into_iter().enumerate() {
            let i = pixel * 3 + c;
            let mean = replicates.iter().map(|x| x[i]).sum::<f64>() / r;
            v += replicates.iter().map(|x| (x[i] - mean) * (x[i] - mean)).sum::<f64>() / (r * (r - 1.0));
            y += weight * mean;
        }
        luminance.push(y);
        variance.push(v / 3.0);
    }
    let mean_luminance = luminance.iter().sum::<f64>() / pixels as f64;
    let floor = EPSILON * mean_luminance * mean_luminance;
    let mut relative = 0.0;
    for y in 0..height {
        for x in 0..width {
            let local = window_mean(&luminance, width, height, x, y);
            let square = local * local + floor;
            if square > 0.0 {
                relative += variance[y * width + x] / square;
            }
        }
    }
    (variance.iter().sum::<f64>() / pixels as f64, relative / pixels as f64)
}

/// Mean over the pixels of a 3×3 window that lie in the picture.
pub(super) fn window_mean(values: &[f64], width: usize, height: usize, x: usize, y: usize) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for v in y.saturating_sub(1)..(y + 2).min(height) {
        for u in x.saturating_sub(1)..(x + 2).min(width) {
            sum += values[v * width + u];
            n += 1.0;
        }
    }
    sum / n
}

/// Slope of the line of least squares through (log seconds, log error); `None` for fewer than two
/// distinct points.
pub fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let logs: Vec<(f64, f64)> = (points.iter().filter(|(t, e)| *t > 0.0 && *e > 0.0))
        .map(|&(t, e)| (libm::log(t), libm::log(e)))
        .collect();
    let n = logs.len() as f64;
    let (mx, my) = logs.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let sxx: f64 = logs.iter().map(|(x, _)| (x - mx) * (x - mx)).sum();
    let sxy: f64 = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    (logs.len() >= 2 && sxx > 1e-9).then(|| sxy / sxx)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{invalid::InvalidSamples, schedule::Schedule, size::Size, sum::Sum};

    /// Uniform numbers in 0..1 from a counter (PCG output of an LCG).
    fn noise(state: &mut u64) -> f32 {
        *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let x = (((*state >> 18) ^ *state) >> 27) as u32;
        x.rotate_right((*state >> 59) as u32) as f32 / 4294967296.0
    }

    fn prefixes(size: Size, replicates: u32, state: &mut u64) -> Vec<Vec<Prefix>> {
        let schedule = Schedule::new(size.frame(), 1, replicates, 1);
        let one = (0..replicates).map(|r| {
            let mut prefix = Prefix::empty(size.frame(), r, 1);
            // Mean 1/2, variance 1/12.
            let plane = (0..size.frame().pixels()).map(|_| [noise(state), noise(state), noise(state)]);
            let (batch, planes) = (schedule.batch(0, r, 0).unwrap(), vec![plane.collect()]);
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
        vec![one.collect()]
    }

    #[test]
    fn the_rms_error_of_uniform_noise_is_known_and_does_not_change_with_exposure() {
        let size = Size { width: 64, height: 64 };
        let e = estimate(size.frame(), &prefixes(size, 4, &mut 7), Look::at(1)).unwrap();
        // σ² of the mean of 4: 1/48. 12288 estimates with 3 degrees of freedom: 0.74 % of σ² a standard deviation.
        let expected = (1.0_f64 / 48.0).sqrt();
        assert!((e.rms / expected - 1.0).abs() < 0.012, "{e:?}");
        assert!(e.relative_upper.unwrap() > e.relative);
    }

    #[test]
    fn each_plane_is_summarised_by_itself() {
        let size = Size { width: 32, height: 32 };
        let schedule = Schedule::new(size.frame(), 2, 4, 1);
        let mut state = 5;
        let one = (0..4).map(|r| {
            let mut prefix = Prefix::empty(size.frame(), r, 2);
            let grey: Vec<f32> = (0..size.frame().pixels()).map(|_| noise(&mut state)).collect();
            let plane = |scale: f32| grey.iter().map(|v| [scale * v; 3]).collect();
            let (batch, planes) = (schedule.batch(0, r, 0).unwrap(), vec![plane(1.0), plane(0.125)]);
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
        let prefixes = vec![one.collect()];
        let [whole, layer] = [0, 1].map(|plane| summarise(size.frame(), &prefixes, plane));
        let all = estimate(size.frame(), &prefixes, Look::at(1)).unwrap();
        assert_eq!((whole.rms, whole.relative), (Some(all.rms), Some(all.relative)));
        // A power of two changes no bit.
        assert_eq!(layer.mean_luminance, 0.125 * whole.mean_luminance);
        assert_eq!((layer.rms, layer.relative), (Some(0.125 * all.rms), Some(all.relative)));
        // Mean 1/2, σ² 1/12 of 4096 samples.
        assert!((whole.mean_luminance - 0.5).abs() < 3.0 / (12.0 * 4096.0_f64).sqrt(), "{whole:?}");
    }

    #[test]
    fn one_replicate_has_no_error_and_two_have_no_interval() {
        let size = Size { width: 4, height: 4 };
        assert_eq!(estimate(size.frame(), &prefixes(size, 1, &mut 3), Look::at(1)), None);
        assert_eq!(
            estimate(size.frame(), &prefixes(size, 2, &mut 3), Look::at(1)).unwrap().relative_upper,
            None
        );
    }

    #[test]
    fn the_slope_of_a_power_law_is_its_exponent() {
        let points: Vec<(f64, f64)> = (1..6).map(|i| (f64::from(i), 3.0 / f64::from(i).sqrt())).collect();
        assert!((slope(&points).unwrap() + 0.5).abs() < 1e-12);
        assert_eq!(slope(&points[..1]), None);
    }
}

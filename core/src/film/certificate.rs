//! What the error of a picture is at most, and why that may not be believed.

use super::{
    error::{EPSILON, window_mean},
    size::Region,
};
use crate::math::quantile::student_t_upper;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Probability that a job is ever stopped too early, over all its checkpoints together.
pub const FALSE_STOP_PROBABILITY: f64 = 0.05;
/// Pixels that the error must be spread over, counted as (Σq)² / Σq²; an eighth of the pixels in pictures of fewer than
/// 128. Below, the largest of a few numbers decides, and a larger one may be still to come.
const EFFECTIVE_PIXELS: f64 = 16.0;
/// Share of the error that may come from pixels whose light one replicate brought alone. A spike that is met by one of
/// R replicates only says that others like it are not met yet. Of normal noise in four replicates it is 0.07.
const LONE_SHARE: f64 = 0.9;
/// Part of a pixel's squared deviations, of the (R−1)/R that are possible, from which on one replicate has them alone.
const LONE: f64 = 0.93;
/// Pixels that a doubt names, at most.
const CULPRITS: usize = 8;

/// A look at a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Its number, from 1.
    pub number: u32,
    /// The brightest that a sample can be which meets a light by chance only, such as through glass after a diffuse
    /// scattering; `None` where every light is looked for.
    pub by_chance: Option<f64>,
}

impl Look {
    /// A look where nothing is met by chance only.
    pub fn at(number: u32) -> Self {
        Self { number, by_chance: None }
    }
}

/// What is known of the error, beside its estimate.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    /// What the relative error of this picture is at most, with the probability that the look has.
    pub upper: f64,
    /// Why this may not be believed.
    pub doubt: Option<Doubt>,
}

/// Why an error is not certified, whatever its upper end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Doubt {
    /// What is wrong.
    pub cause: Cause,
    /// Number of pixels that the error is as good as spread over: (Σq)² / Σq², q a pixel's part of the squared error.
    pub effective_pixels: f64,
    /// Share of the squared error in pixels whose light came with one replicate alone.
    pub lone_share: f64,
    /// The pixels with the largest parts, the largest first.
    pub pixels: Vec<Culprit>,
}

impl fmt::Display for Doubt {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.cause {
            Cause::FewPixels => write!(f, "the error is as good as in {:.1} pixels", self.effective_pixels)?,
            Cause::LoneSamples => {
                write!(
                    f,
                    "{:.0} % of the error is of light that one replicate found alone",
                    100.0 * self.lone_share
                )?;
            }
        }
        let Some(worst) = self.pixels.first() else { return Ok(()) };
        write!(f, ", {:.0} % of it at {},{}", 100.0 * worst.share, worst.x, worst.y)
    }
}

/// What is wrong with an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// Nearly all of it is in a few pixels.
    FewPixels,
    /// Nearly all of it comes from light that a single replicate found.
    LoneSamples,
}

impl Cause {
    /// As in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::FewPixels => "few_pixels",
            Self::LoneSamples => "lone_samples",
        }
    }
}

/// A pixel that much of the error is in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Culprit {
    /// From the left of the frame.
    pub x: u32,
    /// From the top of the frame.
    pub y: u32,
    /// Its part of the squared error.
    pub share: f64,
}

/// The certificate of `replicates`, each the means of `region`'s pixels, three channels a pixel; `square` is the squared
/// relative error as it is reported, `samples` how many a pixel has. Needs three replicates.
///
/// Replicate r is compared with the mean o of the others: `q_r = (R−1)/R² · mean over p of [Σ_c (x_r − o)² / 3] / (Y² + ε Ȳ²)`,
/// Y and Ȳ of the others, too. What r alone has found is thus not hidden by the brightness that it brings itself. The mean C of the
/// q_r estimates the squared error. The error of this very picture differs from C as m and v of normal numbers do:
/// their squares' variance is R · Var(C), and Var(C) is (R−1)/(R−2) · s²/R, s the standard deviation of the q_r. On the
/// logarithm, as squares are not symmetric, `upper² = C · exp(t · s/C · √((R−1)/(R−2)))`, t Student's with R − 1 degrees
/// of freedom at 6α/(π²k²) for the k-th look.
///
/// Light that is met by chance only may not have been met at all, and then no replicate knows of it. What has not happened in n
/// samples of each of P pixels has, but for a probability a, an expectation of at most ln(1/a) times. The light that
/// this leaves out is M = ln(1/a) S/n, S the brightest that a sample can be. All in one pixel of the mean weight it is a
/// squared error of M² · mean of 1 / (Y² + ε Ȳ²) / P. But it is part of Y, too: over K pixels it is K (M/K)² / ((M/K)² + ε Ȳ²) / P,
/// M / (2 √ε Ȳ P) at most, and 81/P in one pixel, as that is a ninth of its Y. Both bounds then have half of the
/// look's probability each.
pub(super) fn certificate(
    region: Region,
    replicates: &[&[f64]],
    square: f64,
    samples: f64,
    look: Look,
) -> Option<Certificate> {
    if replicates.len() < 3 {
        return None;
    }
    let crossed = Crossed::new(region, replicates);
    let r = replicates.len() as f64;
    let centre = crossed.of_replicates.iter().sum::<f64>() / r;
    let parts = if look.by_chance.is_some() { 0.5 } else { 1.0 };
    let alpha = parts * level(look.number);
    let unseen = look.by_chance.map_or(0.0, |brightest| {
        let light = -libm::log(alpha) / samples * brightest;
        let most = (light / (2.0 * EPSILON.sqrt() * crossed.mean)).max(81.0);
        (light * light * crossed.weight).min(most) / region.pixels() as f64
    });
    if centre == 0.0 {
        return Some(Certificate { upper: (square + unseen).sqrt(), doubt: None });
    }
    let spread = crossed.of_replicates.iter().map(|q| (q - centre) * (q - centre)).sum::<f64>() / (r - 1.0);
    let deviation = (spread * (r - 1.0) / (r - 2.0)).sqrt() / centre;
    let t = student_t_upper(alpha, replicates.len() as u32 - 1);
    let upper = (square.max(centre) * libm::exp(t * deviation) + unseen).sqrt();
    Some(Certificate { upper, doubt: crossed.doubt(region, replicates.len()) })
}

/// Probability of a false stop that the k-th look may spend: 6α/(π²k²), as Σ 1/k² is π²/6.
pub fn level(look: u32) -> f64 {
    let k = f64::from(look.max(1));
    6.0 * FALSE_STOP_PROBABILITY / (core::f64::consts::PI * core::f64::consts::PI * k * k)
}

/// Each replicate against the others.
struct Crossed {
    /// q_r.
    of_replicates: Vec<f64>,
    /// Each pixel's part of their mean.
    of_pixels: Vec<f64>,
    /// Whether one replicate has a pixel's deviations alone, upwards.
    lone: Vec<bool>,
    /// Mean over the pixels of 1 / (Y² + ε Ȳ²), of all replicates together.
    weight: f64,
    /// Ȳ of all replicates together.
    mean: f64,
}

impl Crossed {
    fn new(region: Region, replicates: &[&[f64]]) -> Self {
        let r = replicates.len() as f64;
        let pixels = region.pixels();
        let total: Vec<f64> = (0..3 * pixels).map(|i| replicates.iter().map(|x| x[i]).sum::<f64>()).collect();
        let all = Luminance::new(region, &total);
        let mut of_pixels = vec![0.0; pixels];
        let scale = (r - 1.0) / (r * r) / 3.0;
        let one = |own: &&[f64]| {
            let luminance = Luminance::new(region, own);
            let mean = (all.mean - luminance.mean) / (r - 1.0);
            let floor = EPSILON * mean * mean;
            let mut sum = 0.0;
            for (pixel, part) in of_pixels.iter_mut().enumerate() {
                let local = (all.local[pixel] - luminance.local[pixel]) / (r - 1.0);
                let off = |i: usize| own[i] - (total[i] - own[i]) / (r - 1.0);
                let square = scale * (3 * pixel..3 * pixel + 3).map(|i| off(i) * off(i)).sum::<f64>();
                if square > 0.0 {
                    let q = square / (local * local + floor);
                    *part += q / r;
                    sum += q;
                }
            }
            sum / pixels as f64
        };
        let of_replicates = replicates.iter().map(one).collect();
        let lone = (0..pixels).map(|pixel| is_lone(replicates, &total, pixel)).collect();
        let mean = all.mean / r;
        let floor = EPSILON * mean * mean;
        let weights = all.local.iter().map(|sum| 1.0 / ((sum / r).powi(2) + floor));
        let weight = weights.sum::<f64>() / pixels as f64;
        Self { of_replicates, of_pixels, lone, weight, mean }
    }

    fn doubt(&self, region: Region, replicates: usize) -> Option<Doubt> {
        let sum: f64 = self.of_pixels.iter().sum();
        let squares: f64 = self.of_pixels.iter().map(|q| q * q).sum();
        let lone: f64 =
            self.of_pixels.iter().zip(&self.lone).filter(|(_, lone)| **lone).map(|(q, _)| q).sum();
        let effective_pixels = if sum.is_finite() { sum * sum / squares } else { 1.0 };
        let lone_share = if sum.is_finite() { lone / sum } else { 1.0 };
        let cause =
            if effective_pixels < EFFECTIVE_PIXELS.min(region.pixels() as f64 / 8.0) || !sum.is_finite() {
                Cause::FewPixels
            } else if replicates > 3 && lone_share > LONE_SHARE {
                Cause::LoneSamples
            } else {
                return None;
            };
        let mut order: Vec<usize> = (0..self.of_pixels.len()).collect();
        order.sort_by(|a, b| self.of_pixels[*b].total_cmp(&self.of_pixels[*a]).then(a.cmp(b)));
        let pixels = (order.into_iter().take(CULPRITS))
            .map(|pixel| Culprit {
                x: region.x + pixel as u32 % region.width,
                y: region.y + pixel as u32 / region.width,
                share: if sum.is_finite() { self.of_pixels[pixel] / sum } else { 1.0 },
            })
            .filter(|culprit| culprit.share > 0.0);
        Some(Doubt { cause, effective_pixels, lone_share, pixels: pixels.collect() })
    }
}

/// Whether one replicate has nearly all that a pixel's squared deviations can have of one, and is brighter than the mean.
fn is_lone(replicates: &[&[f64]], total: &[f64], pixel: usize) -> bool {
    let r = replicates.len() as f64;
    let (mut sum, mut largest, mut above) = (0.0, 0.0, 0.0);
    for own in replicates {
        let offs: [f64; 3] = std::array::from_fn(|c| own[3 * pixel + c] - total[3 * pixel + c] / r);
        let square = offs.iter().map(|d| d * d).sum::<f64>();
        sum += square;
        if square > largest {
            (largest, above) = (square, offs.iter().sum());
        }
    }
    above > 0.0 && largest > LONE * (r - 1.0) / r * sum
}

/// Luminance of a plane.
struct Luminance {
    /// 3×3 means around each pixel.
    local: Vec<f64>,
    /// Of all pixels.
    mean: f64,
}

impl Luminance {
    fn new(region: Region, plane: &[f64]) -> Self {
        let luminance: Vec<f64> =
            plane.chunks_exact(3).map(|p| 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2]).collect();
        let (width, height) = (region.width as usize, region.height as usize);
        let at = |i: usize| window_mean(&luminance, width, height, i % width, i / width);
        let local = (0..luminance.len()).map(at).collect();
        Self { local, mean: luminance.iter().sum::<f64>() / luminance.len() as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    const SIDE: u32 = 16;
    const REGION: Region = Region { x: 100, y: 50, width: SIDE, height: SIDE };
    const PIXELS: usize = (SIDE * SIDE) as usize;
    /// Trials of a coverage.
    const TRIALS: u32 = 400;

    /// Random numbers from a counter (PCG output of an LCG).
    struct Noise(u64);

    impl Noise {
        fn uniform(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let x = (((self.0 >> 18) ^ self.0) >> 27) as u32;
            (f64::from(x.rotate_right((self.0 >> 59) as u32)) + 0.5) / 4294967296.0
        }

        fn normal(&mut self) -> f64 {
            (-2.0 * self.uniform().ln()).sqrt() * (TAU * self.uniform()).cos()
        }

        /// Number of successes of probability `p` in `n` trials, by the gaps between them.
        fn binomial(&mut self, n: u32, p: f64) -> u32 {
            let (mut count, mut at) = (0, 0.0);
            loop {
                at += (self.uniform().ln() / (1.0 - p).ln()).ceil();
                if at > f64::from(n) {
                    return count;
                }
                count += 1;
            }
        }
    }

    /// Pictures of grey pixels whose means are 1.
    fn grey(replicates: usize, mut pixels: impl FnMut() -> Vec<f64>) -> Vec<Vec<f64>> {
        (0..replicates).map(|_| pixels().into_iter().flat_map(|y| [y; 3]).collect()).collect()
    }

    fn of(replicates: &[Vec<f64>]) -> Certificate {
        let all: Vec<&[f64]> = replicates.iter().map(Vec::as_slice).collect();
        certificate(REGION, &all, 0.0, 1.0, Look::at(1)).unwrap()
    }

    /// Relative error against the true picture, which is 1 everywhere.
    fn truth(replicates: &[Vec<f64>]) -> f64 {
        let r = replicates.len() as f64;
        let off = |i: usize| replicates.iter().map(|x| x[i]).sum::<f64>() / r - 1.0;
        ((0..3 * PIXELS).map(|i| off(i) * off(i)).sum::<f64>() / (3 * PIXELS) as f64 / (1.0 + EPSILON)).sqrt()
    }

    /// Shares of trials whose error is at most what is said, or whose error is in doubt; and of those in doubt.
    fn honest(mut trial: impl FnMut() -> Vec<Vec<f64>>) -> [f64; 2] {
        let (mut honest, mut doubted) = (0, 0);
        for _ in 0..TRIALS {
            let replicates = trial();
            let certificate = of(&replicates);
            doubted += u32::from(certificate.doubt.is_some());
            honest += u32::from(certificate.doubt.is_some() || truth(&replicates) <= certificate.upper);
        }
        [honest, doubted].map(|n| f64::from(n) / f64::from(TRIALS))
    }

    /// The first look claims 1 − 6·0.05/π² = 0.9696; the binomial σ of 400 trials is 0.0086.
    fn assert_honest(what: &str, share: f64) {
        assert!(share > 1.0 - level(1) - 3.0 * 0.0086, "{what}: {share}");
    }

    #[test]
    fn the_levels_of_all_looks_add_up_to_the_probability_of_a_false_stop() {
        let sum: f64 = (1..100_000).map(level).sum();
        assert!((sum - FALSE_STOP_PROBABILITY).abs() < 1e-6, "{sum}");
    }

    #[test]
    fn normal_noise_is_covered_as_often_as_claimed_and_not_doubted() {
        for replicates in [3, 4, 8, 16] {
            let mut noise = Noise(u64::from(replicates as u32));
            let [share, doubted] =
                honest(|| grey(replicates, || (0..PIXELS).map(|_| 1.0 + 0.1 * noise.normal()).collect()));
            assert_honest(&format!("{replicates} replicates"), share);
            assert_eq!(doubted, 0.0, "{replicates} replicates");
        }
    }

    #[test]
    fn pixels_that_err_together_are_covered_as_often_as_claimed() {
        for modes in [1, 3, 10, 30] {
            let mut noise = Noise(11);
            let shapes: Vec<f64> = (0..modes * PIXELS).map(|_| 0.02 * noise.normal()).collect();
            let mut picture = || {
                let heights: Vec<f64> = (0..modes).map(|_| noise.normal()).collect();
                let at = |p| heights.iter().enumerate().map(|(m, h)| h * shapes[m * PIXELS + p]).sum::<f64>();
                (0..PIXELS).map(|p| 1.0 + at(p)).collect()
            };
            let [share, _] = honest(|| grey(4, &mut picture));
            assert_honest(&format!("{modes} modes"), share);
        }
    }

    #[test]
    fn rare_spikes_are_covered_or_doubted() {
        // Half of the light comes in spikes, each of n samples with probability p: n p is 0.03 to 50.
        for (p, samples) in [(0.05, 1024), (0.01, 16), (0.01, 256), (0.002, 16), (0.002, 64), (0.002, 1024)] {
            let mut noise = Noise(samples.into());
            let mean = f64::from(samples) * p;
            let mut picture = || {
                let one = |_| 0.5 + 0.5 * f64::from(noise.binomial(samples, p)) / mean;
                (0..PIXELS).map(one).collect()
            };
            let [share, doubted] = honest(|| grey(4, &mut picture));
            assert_honest(&format!("spikes of {p} in {samples}"), share);
            assert!(mean < 1.0 || doubted < 0.05, "{p} in {samples}: {doubted} are doubted");
            assert!(mean > 0.05 || doubted > 0.9, "{p} in {samples}: {doubted} are doubted");
        }
    }

    #[test]
    fn tails_without_a_variance_are_doubted() {
        // Pareto numbers of exponent 1.2: the mean is 6, the variance infinite.
        let mut noise = Noise(5);
        let mut picture = || {
            let mut one = || (0..16).map(|_| noise.uniform().powf(-1.0 / 1.2)).sum::<f64>() / 16.0 / 6.0;
            (0..PIXELS).map(|_| one()).collect()
        };
        let [share, doubted] = honest(|| grey(4, &mut picture));
        assert_honest("Pareto", share);
        assert!(doubted > 0.9, "{doubted}");
    }

    #[test]
    fn the_pixel_that_the_error_is_in_is_named() {
        let mut noise = Noise(3);
        let mut replicates = grey(4, || (0..PIXELS).map(|_| 1.0 + 1e-3 * noise.normal()).collect());
        let pixel = 5 * SIDE as usize + 9;
        replicates[2][3 * pixel..3 * pixel + 3].fill(7.0);
        let doubt = of(&replicates).doubt.unwrap();
        assert_eq!(doubt.cause, Cause::FewPixels);
        assert_eq!((doubt.pixels[0].x, doubt.pixels[0].y), (109, 55));
        assert!(doubt.pixels[0].share > 0.99 && doubt.pixels.len() == CULPRITS, "{doubt:?}");
    }

    #[test]
    fn light_that_may_not_have_been_met_counts() {
        // No replicate differs: all that is left is what was not met in 64 samples of each pixel, of 8 each.
        let replicates = grey(4, || vec![1.0; PIXELS]);
        let all: Vec<&[f64]> = replicates.iter().map(Vec::as_slice).collect();
        let upper = |brightest| {
            let look = Look { number: 1, by_chance: Some(brightest) };
            certificate(REGION, &all, 0.0, 64.0, look).unwrap().upper
        };
        let light = (2.0 / level(1)).ln() / 64.0;
        let alone = 8.0 * light / 16.0 / 1.01_f64.sqrt();
        assert!((upper(8.0) / alone - 1.0).abs() < 1e-12, "{alone}");
        // Brighter light would be seen in the local mean, too.
        assert!((upper(200.0) - 9.0 / 16.0).abs() < 1e-12);
        let spread = (1e6 * light * 5.0).sqrt() / 16.0;
        assert!((upper(1e6) / spread - 1.0).abs() < 1e-12, "{spread}");
        assert_eq!(of(&replicates).upper, 0.0);
    }

    #[test]
    fn the_bound_is_what_its_formula_says() {
        let mut noise = Noise(17);
        let replicates: Vec<Vec<f64>> =
            (0..5).map(|_| (0..3 * PIXELS).map(|_| 0.2 + noise.uniform()).collect()).collect();
        let (r, n) = (5.0, PIXELS as f64);
        let side = SIDE as i32;
        let luminance =
            |x: &[f64], p: usize| 0.2126 * x[3 * p] + 0.7152 * x[3 * p + 1] + 0.0722 * x[3 * p + 2];
        let q: Vec<f64> = (0..5)
            .map(|own| {
                let mean: Vec<f64> = (0..3 * PIXELS)
                    .map(|i| (0..5).filter(|s| *s != own).map(|s| replicates[s][i]).sum::<f64>() / 4.0)
                    .collect();
                let whole = (0..PIXELS).map(|p| luminance(&mean, p)).sum::<f64>() / n;
                let part = |p: usize| {
                    let (x, y) = (p as i32 % side, p as i32 / side);
                    let near: Vec<f64> = (-1..=1)
                        .flat_map(|v| (-1..=1).map(move |u| (x + u, y + v)))
                        .filter(|(x, y)| (0..side).contains(x) && (0..side).contains(y))
                        .map(|(x, y)| luminance(&mean, (y * side + x) as usize))
                        .collect();
                    let local = near.iter().sum::<f64>() / near.len() as f64;
                    let square: f64 =
                        (0..3).map(|c| (replicates[own][3 * p + c] - mean[3 * p + c]).powi(2)).sum();
                    square / 3.0 / (local * local + 0.01 * whole * whole)
                };
                4.0 / 25.0 * (0..PIXELS).map(part).sum::<f64>() / n
            })
            .collect();
        let centre = q.iter().sum::<f64>() / r;
        let s = (q.iter().map(|q| (q - centre).powi(2)).sum::<f64>() / 4.0).sqrt();
        // Four degrees of freedom at 0.030396.
        let t = student_t_upper(6.0 * 0.05 / std::f64::consts::PI.powi(2), 4);
        let expected = (centre * (t * s / centre * (4.0_f64 / 3.0).sqrt()).exp()).sqrt();
        assert!((of(&replicates).upper / expected - 1.0).abs() < 1e-12);
    }
}

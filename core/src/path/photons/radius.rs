//! How far photons are gathered from.

use crate::scene::Scene;

/// Radii of pass i go as (i + 1)^((α − 1) / 2): the variance of the mean of n passes falls as n^−α and its bias as n^(α − 1),
/// whose square falls as fast at α = 2/3 (Kaplanyan and Dachsbacher 2013, "Adaptive Progressive Photon Mapping", §4).
const EXPONENT: f64 = (2.0 / 3.0 - 1.0) / 2.0;
/// Radius of the first pass in pixels, as wide as they are where they cover the scene.
const FIRST: f64 = 2.0;

/// Radius of a pass in scene units, for a picture of `pixels` pixels.
pub fn radius(scene: &Scene, pixels: usize, pass: u32) -> f32 {
    let pixel = 2.0 * scene.data.bounds.radius() / (pixels as f64).sqrt();
    (FIRST * pixel * libm::pow(f64::from(pass) + 1.0, EXPONENT)) as f32
}

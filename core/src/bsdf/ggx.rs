//! The GGX distribution of microfacet normals with Smith's height-correlated masking (Walter et al.
//! 2007; Heitz 2014).
//!
//! Everything is written with the stretched length σ(w) = √(cos² θ + α² sin² θ), which is
//! |cos θ| (1 + 2 Λ(w)): no tangent that overflows and no difference that cancels. Squared sines are sums of
//! x² + y², never 1 − z², which at α = 1e-3 would make the distribution wrong by percents.

use crate::math::warp;
use core::f32::consts::FRAC_1_PI;
use glam::{Vec2, Vec3};

/// A roughness α below this is ideally specular, for reflection and refraction alike.
pub const SPECULAR_BELOW: f32 = 1e-3;

/// An isotropic distribution of microfacet normals.
#[derive(Clone, Copy, Debug)]
pub struct Ggx {
    /// α, within 1e-3..=1.
    pub alpha: f32,
    /// α².
    pub alpha2: f32,
}

/// How far down the sphere of stretched mirror directions a sampled normal may send its reflection.
#[derive(Clone, Copy, Debug)]
pub enum Reach {
    /// As far as microfacets do (Dupuy and Benyoub 2023): for refraction.
    Full,
    /// Not where every reflection is below the horizon (Eto and Tokuyoshi 2023): for reflection.
    Bounded,
}

impl Ggx {
    /// `None` below [`SPECULAR_BELOW`].
    pub fn new(alpha: f32) -> Option<Self> {
        let alpha = alpha.min(1.0);
        (alpha >= SPECULAR_BELOW).then_some(Self { alpha, alpha2: alpha * alpha })
    }

    /// σ(w) of the head of this file.
    #[inline]
    pub fn stretched(self, w: Vec3) -> f32 {
        (w.z * w.z + self.alpha2 * (w.x * w.x + w.y * w.y)).sqrt()
    }

    /// D(h), density of microfacet normals over area and solid angle, for a half vector of any length
    /// and its squared length.
    #[inline]
    pub fn density(self, half: Vec3, length2: f32) -> f32 {
        let across = half.x * half.x + half.y * half.y;
        let ratio = length2 / (across + self.alpha2 * half.z * half.z);
        FRAC_1_PI * self.alpha2 * ratio * ratio
    }

    /// G₂ / (4 |cos θₒ cos θᵢ|) of the absolute cosines and stretched lengths of two directions,
    /// G₂ = 1 / (1 + Λₒ + Λᵢ).
    #[inline]
    pub fn visibility(cos_o: f32, stretched_o: f32, cos_i: f32, stretched_i: f32) -> f32 {
        0.5 / (cos_o * stretched_i + cos_i * stretched_o)
    }

    /// Of two directions above the surface and their stretched lengths: D G₂ / (4 cos θₒ), which is
    /// f · cos θᵢ for reflectance 1; the density of the mirror direction over solid angle when normals
    /// are sampled with `Reach::Bounded`; and the cosine between each direction and the half vector.
    #[inline]
    pub fn reflected(self, wo: Vec3, stretched_o: f32, wi: Vec3, stretched_i: f32) -> (f32, f32, f32) {
        let half = wo + wi;
        let length2 = half.length_squared();
        if length2 < f32::MIN_POSITIVE {
            return (0.0, 0.0, 0.0);
        }
        let density = self.density(half, length2);
        let value = density * wi.z * Self::visibility(wo.z, stretched_o, wi.z, stretched_i);
        // |wo + wi|² = 2 (1 + wo·wi) = 4 (wo·h)².
        (value, density * self.bounded(wo, stretched_o), 0.5 * length2.sqrt())
    }

    /// The density of visible normals is D(h) |w·h| times this (G₁ / |cos θ|), for `Reach::Full`.
    #[inline]
    pub fn visible(cos: f32, stretched: f32) -> f32 {
        2.0 / (cos + stretched)
    }

    /// The density over solid angle of the mirror direction of a normal sampled with `Reach::Bounded`
    /// is D(h) times this.
    #[inline]
    pub fn bounded(self, wo: Vec3, stretched: f32) -> f32 {
        0.5 / (self.bound(wo) * wo.z + stretched)
    }

    /// Eto and Tokuyoshi's k.
    #[inline]
    fn bound(self, wo: Vec3) -> f32 {
        let s = 1.0 + (wo.x * wo.x + wo.y * wo.y).sqrt();
        let s2 = s * s;
        (1.0 - self.alpha2) * s2 / (s2 + self.alpha2 * wo.z * wo.z)
    }

    /// A normal that is visible from `wo`, `wo.z` > 0.
    #[inline]
    pub fn sample_visible(self, wo: Vec3, u: Vec2, reach: Reach) -> Vec3 {
        let standard = Vec3::new(self.alpha * wo.x, self.alpha * wo.y, wo.z) / self.stretched(wo);
        let lowest = match reach {
            Reach::Full => -standard.z,
            Reach::Bounded => -self.bound(wo) * standard.z,
        };
        let half = standard + warp::cap(u, lowest);
        Vec3::new(self.alpha * half.x, self.alpha * half.y, half.z).normalize_or(Vec3::Z)
    }
}

/// The mirror direction of `w` about the unit vector `half`.
#[inline]
pub fn reflect(w: Vec3, half: Vec3) -> Vec3 {
    half * (2.0 * w.dot(half)) - w
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use std::f64::consts::PI;

    /// D, Λ and the values built from them, from their textbook definitions in f64.
    fn oracle(alpha: f64, wo: DVec3, wi: DVec3) -> (f64, f64) {
        let half = (wo + wi).normalize();
        let tan2 = (half.x * half.x + half.y * half.y) / (half.z * half.z);
        let density = 1.0 / (PI * alpha * alpha * half.z.powi(4) * (1.0 + tan2 / (alpha * alpha)).powi(2));
        let lambda =
            |w: DVec3| ((1.0 + alpha * alpha * (w.x * w.x + w.y * w.y) / (w.z * w.z)).sqrt() - 1.0) / 2.0;
        let value = density / (1.0 + lambda(wo) + lambda(wi)) / (4.0 * wo.z);
        (value, density / (1.0 + lambda(wo)) / (4.0 * wo.z))
    }

    #[test]
    fn single_precision_is_enough_down_to_the_least_roughness() {
        for alpha in [1e-3_f32, 1e-2, 0.1, 1.0] {
            let ggx = Ggx::new(alpha).unwrap();
            for cos in [1.7e-4_f32, 0.01, 0.3, 0.8, 1.0] {
                let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
                let mut errors = Vec::new();
                for i in 0..1000 {
                    let u = Vec2::new((i as f32 * 0.618_034).fract(), (i as f32 + 0.5) / 1000.0);
                    let wi = reflect(wo, ggx.sample_visible(wo, u, Reach::Full));
                    if wi.z <= 0.0 {
                        continue;
                    }
                    let (so, si) = (ggx.stretched(wo), ggx.stretched(wi));
                    let (value, _, _) = ggx.reflected(wo, so, wi, si);
                    let half = wo + wi;
                    let visible = 0.25 * ggx.density(half, half.length_squared()) * Ggx::visible(wo.z, so);
                    let expected = oracle(f64::from(alpha), wo.as_dvec3(), wi.as_dvec3());
                    errors.push((f64::from(value) / expected.0 - 1.0).abs());
                    errors.push((f64::from(visible) / expected.1 - 1.0).abs());
                }
                errors.sort_by(f64::total_cmp);
                // The half vector of the rounded directions is itself only known to 1e-7 / (α cos).
                let worst = errors[errors.len() * 99 / 100];
                assert!(worst < 1e-5, "α {alpha} cos {cos}: {worst}");
            }
        }
    }

    #[test]
    fn smoothness_begins_at_the_threshold() {
        assert!(Ggx::new(SPECULAR_BELOW).is_some());
        assert!(Ggx::new(SPECULAR_BELOW.next_down()).is_none());
    }
}

//! How much an interface reflects.

use crate::math::colour::Rgb;

/// Cosine-weighted mean of (1 − cos θ)⁵ over the hemisphere.
pub const GRAZING_MEAN: f32 = 1.0 / 21.0;

/// Schlick's approximation (1994) with a reflectance for grazing incidence, as in glTF.
#[derive(Clone, Copy, Debug)]
pub struct Schlick {
    /// Reflectance at normal incidence.
    pub f0: Rgb,
    /// Reflectance at grazing incidence, of every channel.
    pub f90: f32,
}

impl Schlick {
    /// Of a colour that reflects `even` with weight one, and of which the share `grazing` was weighted
    /// with (1 − cos θ)⁵: f0 (even − grazing) + f90 grazing. With `even` = 1 this is the reflectance.
    #[inline]
    pub fn split(self, even: f32, grazing: f32) -> Rgb {
        self.f0 * (even - grazing) + Rgb::splat(self.f90 * grazing)
    }

    /// The reflectance for the cosine between direction and (micro)normal.
    #[inline]
    pub fn at(self, cos: f32) -> Rgb {
        self.split(1.0, fifth_power(1.0 - cos))
    }

    /// Cosine-weighted mean over the hemisphere.
    #[inline]
    pub fn mean(self) -> Rgb {
        self.split(1.0, GRAZING_MEAN)
    }
}

/// x⁵.
#[inline]
pub fn fifth_power(x: f32) -> f32 {
    let squared = x * x;
    squared * squared * x
}

/// Squared cosine on the far side of an interface, for the cosine on this side and `eta`, the
/// refractive index of the far side over that of this one. Not positive: total internal reflection.
#[inline]
pub fn refracted_cos_squared(cos: f32, eta: f32) -> f32 {
    // 1 − (1 − cos²) / η² without a difference of numbers near one: η − 1 has no rounding error where that matters.
    ((eta - 1.0) * (eta + 1.0) + (cos * cos).min(1.0)) / (eta * eta)
}

/// Unpolarised reflectance of a dielectric (Fresnel), exact; arguments as in
/// [`refracted_cos_squared`], `cos` not negative. One where nothing is refracted.
#[inline]
pub fn dielectric(cos: f32, eta: f32) -> f32 {
    let squared = refracted_cos_squared(cos, eta);
    if squared <= 0.0 {
        return 1.0;
    }
    dielectric_between(cos, squared.sqrt(), eta)
}

/// [`dielectric`] of both cosines: alike from either side, where one of them alone is ill-conditioned.
#[inline]
pub fn dielectric_between(cos: f32, refracted: f32, eta: f32) -> f32 {
    let parallel = (eta * cos - refracted) / (eta * cos + refracted);
    let perpendicular = (cos - eta * refracted) / (cos + eta * refracted);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// Cosine-weighted mean of [`dielectric`] over the hemisphere, for `eta` of at least one, within 0.008:
/// a rational fit to the integral.
#[inline]
pub fn dielectric_mean(eta: f32) -> f32 {
    (eta - 1.0) / (eta + 4.1)
}

/// [`dielectric`] at normal incidence.
#[inline]
pub fn dielectric_at_normal(eta: f32) -> f32 {
    let ratio = (eta - 1.0) / (eta + 1.0);
    ratio * ratio
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schlick_goes_from_f0_to_f90() {
        let f = Schlick { f0: Rgb::new(0.1, 0.5, 0.9), f90: 0.95 };
        assert_eq!(f.at(1.0), f.f0);
        assert!((f.at(0.0) - Rgb::splat(0.95)).length() < 1e-6);
        let n = 1000;
        let mean: Rgb = (0..n).map(|i| f.at(((i as f32 + 0.5) / n as f32).sqrt()) / n as f32).sum();
        assert!((mean - f.mean()).abs().max_element() < 1e-5);
    }

    #[test]
    fn dielectric_obeys_brewster_reversal_and_total_reflection() {
        let eta = 1.5_f32;
        assert!((dielectric(1.0, eta) - 0.04).abs() < 1e-7);
        assert!((dielectric(0.0, eta) - 1.0).abs() < 1e-6);
        let brewster = 1.0 / (1.0 + eta * eta).sqrt();
        let perpendicular = (1.0 - eta * eta) / (1.0 + eta * eta);
        assert!((dielectric(brewster, eta) - 0.5 * perpendicular * perpendicular).abs() < 1e-6);
        for i in 1..100 {
            let cos = i as f32 / 100.0;
            // The cosine inside determines the one outside only up to the rounding error over `cos`.
            let inside = refracted_cos_squared(cos, eta).sqrt();
            assert!((dielectric(cos, eta) - dielectric(inside, 1.0 / eta)).abs() < 1e-6 / cos, "{cos}");
        }
        let critical = (1.0 - 1.0 / (eta * eta)).sqrt();
        assert!((dielectric(critical - 1e-3, 1.0 / eta) - 1.0).abs() < f32::EPSILON);
        assert!(dielectric(critical + 1e-3, 1.0 / eta) < 0.9);
    }
}

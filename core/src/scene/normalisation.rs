//! From the file's space to the scene's: centred, and scaled by a power of two.

use crate::scene::bounds::Bounds;
use glam::{DAffine3, DVec3, Vec3};

/// Binary exponent of the scene's radius: it lies in 2¹³..2¹⁴ of the scene's units.
const RADIUS_EXPONENT: i32 = 14;

/// A shift and a scaling by a power of two: `scene = (file − centre) · 2^exponent`. A file whose lengths
/// are all multiplied by a power of two gives the same scene, bit for bit, and another exponent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normalisation {
    /// The file's point at the scene's origin.
    pub centre: DVec3,
    /// Binary logarithm of the scaling.
    pub exponent: i32,
}

impl Normalisation {
    /// Leaves everything as it is.
    pub const IDENTITY: Self = Self { centre: DVec3::ZERO, exponent: 0 };

    /// Brings the middle of `bounds` to the origin and its radius into 2¹³..2¹⁴; one of no extent is
    /// only centred, an empty one left alone.
    pub fn around(bounds: &Bounds) -> Self {
        if bounds.is_empty() {
            return Self::IDENTITY;
        }
        let radius = bounds.radius();
        let exponent = if radius > 0.0 { RADIUS_EXPONENT - libm::frexp(radius).1 } else { 0 };
        Self { centre: bounds.centre(), exponent }
    }

    /// 2^exponent: scene units a metre.
    pub fn scale(&self) -> f64 {
        libm::ldexp(1.0, self.exponent)
    }

    /// A point of the file in the scene.
    #[inline]
    pub fn point(&self, file: DVec3) -> Vec3 {
        ((file - self.centre) * self.scale()).as_vec3()
    }

    /// A point of the scene in the file.
    pub fn restore(&self, scene: Vec3) -> DVec3 {
        scene.as_dvec3() / self.scale() + self.centre
    }

    /// Metres to scene units.
    pub fn distance(&self, metres: f64) -> f64 {
        metres * self.scale()
    }

    /// Scene units to metres.
    pub fn metres(&self, distance: f64) -> f64 {
        distance / self.scale()
    }

    /// Appends the normalisation to a transform into the file's space.
    pub fn apply(&self, to_file: &DAffine3) -> DAffine3 {
        let scale = self.scale();
        DAffine3 {
            matrix3: to_file.matrix3 * scale,
            translation: (to_file.translation - self.centre) * scale,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radius_lands_between_two_powers_of_two_and_scaling_changes_only_the_exponent() {
        let lower = DVec3::new(-0.3, 7.0, 2.5);
        let upper = DVec3::new(1.7, 7.5, 11.0);
        let base = Normalisation::around(&Bounds { lower, upper });
        for k in [-60, -20, -1, 0, 1, 20, 60] {
            let s = libm::ldexp(1.0, k);
            let scaled = Normalisation::around(&Bounds { lower: lower * s, upper: upper * s });
            assert_eq!(scaled.exponent, base.exponent - k);
            assert_eq!(scaled.point(upper * s), base.point(upper));
            let radius = scaled.distance(Bounds { lower: lower * s, upper: upper * s }.radius());
            assert!((8192.0..16384.0).contains(&radius), "{radius}");
            assert!((scaled.restore(scaled.point(lower * s)) - lower * s).length() < 1e-6 * s);
        }
    }

    #[test]
    fn nothing_is_left_alone() {
        assert_eq!(Normalisation::around(&Bounds::EMPTY), Normalisation::IDENTITY);
    }
}

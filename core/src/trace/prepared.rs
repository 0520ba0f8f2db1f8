//! A ray made ready for boxes and triangles.

use glam::Vec3;

/// Origins farther from zero than this on any axis hit nothing: products with `inverse` would leave the range of f32.
const FARTHEST_ORIGIN: f32 = (1u64 << 62) as f32;

/// Components of a direction smaller than this beside a largest one in 1..2 count as this when boxes are tested: across a
/// scene such a ray moves by less than the padding of any box that matters, and no box meets 0 · ∞.
const LEAST_SLOPE: f32 = 1.0 / (1u64 << 63) as f32;

/// A ray whose direction was scaled by a power of two so that its largest component is in 1..2. That changes no bit of
/// the result and keeps all that follows in range.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prepared {
    pub(super) origin: [f32; 3],
    /// Scaled: the largest component is in 1..2.
    pub(super) direction: [f32; 3],
    /// 1 / direction, finite.
    pub(super) inverse: [f32; 3],
    /// origin / direction.
    pub(super) offset: [f32; 3],
    /// An axis is 1 where the direction is negative: index of the plane of a box that is met first.
    pub(super) nearer: [usize; 3],
    /// Axes in the order x, y, z of Woop's sheared space; the last one is the direction's longest.
    pub(super) axes: [usize; 3],
    /// Shear of x and y, and scale of z.
    pub(super) shear: [f32; 3],
    /// `t` in units of the direction given is `t` here times this power of two.
    pub(super) scale: f64,
}

impl Prepared {
    /// `None` where the ray cannot hit anything (see [`super::ray::Ray`]).
    #[inline]
    pub(super) fn new(origin: Vec3, direction: Vec3) -> Option<Self> {
        let longest = direction.abs().max_element();
        // NaN fails both comparisons, in whatever component: `max_element` may drop it, the sum does not.
        let sum = origin.abs().element_sum() + direction.abs().element_sum();
        if !(longest > 0.0 && longest.is_finite() && origin.abs().max_element() <= FARTHEST_ORIGIN) || sum.is_nan() {
            return None;
        }
        let (direction, scale) = unit_exponent(direction, longest);
        let d = direction.to_array();
        let z = if direction.x.abs() >= direction.y.abs() && direction.x.abs() >= direction.z.abs() {
            0
        } else if direction.y.abs() >= direction.z.abs() {
            1
        } else {
            2
        };
        let axes = [[1, 2, 0], [2, 0, 1], [0, 1, 2]][z];
        let steep = d.map(|c| if c.abs() < LEAST_SLOPE { LEAST_SLOPE.copysign(c) } else { c });
        let inverse = steep.map(|c| 1.0 / c);
        let o = origin.to_array();
        Some(Self {
            origin: o,
            direction: d,
            inverse,
            offset: [o[0] * inverse[0], o[1] * inverse[1], o[2] * inverse[2]],
            nearer: d.map(|c| usize::from(c.is_sign_negative())),
            axes,
            shear: [d[axes[0]] / d[z], d[axes[1]] / d[z], 1.0 / d[z]],
            scale,
        })
    }

    /// A limit on `t` in the caller's units, in the units used here.
    #[inline]
    pub(super) fn inward(&self, t: f32) -> f32 {
        if self.scale == 1.0 { t } else { (f64::from(t) / self.scale) as f32 }
    }

    /// A `t` found here in the caller's units.
    #[inline]
    pub(super) fn outward(&self, t: f32) -> f32 {
        if self.scale == 1.0 { t } else { (f64::from(t) * self.scale) as f32 }
    }
}

/// The direction times a power of two that brings its longest component into 1..2, and that power.
#[inline]
fn unit_exponent(direction: Vec3, longest: f32) -> (Vec3, f64) {
    let exponent = longest.to_bits() >> 23;
    if exponent == 127 {
        return (direction, 1.0);
    }
    if (1..=253).contains(&exponent) {
        let power = f32::from_bits((254 - exponent) << 23);
        return (direction * power, f64::from(power));
    }
    extreme_exponent(direction)
}

/// [`unit_exponent`] for denormal directions and those of 2¹²⁷ and more.
#[cold]
fn extreme_exponent(direction: Vec3) -> (Vec3, f64) {
    let shift = if direction.abs().max_element() < 1.0 { (1u128 << 100) as f32 } else { 0.25 };
    let shifted = direction * shift;
    let power = f32::from_bits((254 - (shifted.abs().max_element().to_bits() >> 23)) << 23);
    (shifted * power, f64::from(shift) * f64::from(power))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_scaled_by_powers_of_two() {
        for exponent in [-149, -140, -126, -100, -1, 0, 1, 50, 126, 127] {
            let length = 2.0_f64.powi(exponent) as f32;
            let ray = Prepared::new(Vec3::ZERO, Vec3::new(0.0, -length, 0.0)).unwrap();
            assert_eq!(ray.shear, [0.0, 0.0, -1.0], "2^{exponent}");
            assert_eq!(ray.scale, 2.0_f64.powi(-exponent));
            assert_eq!(ray.axes[2], 1);
        }
    }

    #[test]
    fn refuses_what_is_not_a_ray() {
        let good = Vec3::new(1.0, 2.0, 3.0);
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            for axis in 0..3 {
                let mut v = good;
                v[axis] = bad;
                assert!(Prepared::new(v, good).is_none());
                assert!(Prepared::new(good, v).is_none());
            }
        }
        assert!(Prepared::new(good, Vec3::ZERO).is_none());
        assert!(Prepared::new(good, Vec3::new(-0.0, -0.0, -0.0)).is_none());
        assert!(Prepared::new(Vec3::splat(1e30), good).is_none());
        assert!(Prepared::new(good, Vec3::MAX).is_some());
    }
}

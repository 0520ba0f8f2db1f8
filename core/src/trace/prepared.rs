//! A ray made ready for boxes and triangles.

use glam::Vec3;

/// Origins whose coordinates add up to more than this hit nothing: products with `inverse` would leave the range of f32.
const FARTHEST_ORIGIN: f32 = (1u64 << 62) as f32;

/// Components of a direction smaller than this beside a largest one in 1..2 count as this when boxes are tested: across a
/// scene such a ray moves by less than the padding of any box that matters, and no box meets 0 · ∞.
const LEAST_SLOPE: f32 = 1.0 / (1u64 << 63) as f32;

/// A ray whose direction was scaled by a power of two so that its largest component is in 1..2, as far as floats
/// reach. That changes no bit of
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
    /// `t` in units of the direction given is `t` here times this power of two,
    pub(super) outward: f32,
    /// and this is its inverse.
    pub(super) inward: f32,
    /// Where the ray ends, in units of `t` here.
    pub(super) end: f32,
}

impl Prepared {
    /// `None` where the ray cannot hit anything (see [`super::ray::Ray`]).
    #[inline(always)]
    pub(super) fn new(origin: Vec3, direction: Vec3, t_max: f32) -> Option<Self> {
        let longest = direction.x.abs().max(direction.y.abs()).max(direction.z.abs());
        // The exponents of the smallest and largest normal floats bring any other direction close to 1..2.
        let exponent = (longest.to_bits() >> 23).clamp(1, 253);
        let (outward, inward) = (f32::from_bits((254 - exponent) << 23), f32::from_bits(exponent << 23));
        let (x, y, z) = (direction.x * outward, direction.y * outward, direction.z * outward);
        // One sum finds every NaN and infinity.
        let sum = x.abs() + y.abs() + z.abs() + origin.x.abs() + origin.y.abs() + origin.z.abs();
        if !(sum <= FARTHEST_ORIGIN && longest > 0.0) {
            return None;
        }
        let inverse = [inverse(x), inverse(y), inverse(z)];
        let longest = longest * outward;
        let axes = if x.abs() >= longest {
            [1, 2, 0]
        } else if y.abs() >= longest {
            [2, 0, 1]
        } else {
            [0, 1, 2]
        };
        let (origin, direction) = ([origin.x, origin.y, origin.z], [x, y, z]);
        let depth = inverse[axes[2]];
        Some(Self {
            origin,
            direction,
            inverse,
            offset: [origin[0] * inverse[0], origin[1] * inverse[1], origin[2] * inverse[2]],
            nearer: [sign(x), sign(y), sign(z)],
            axes,
            shear: [direction[axes[0]] * depth, direction[axes[1]] * depth, depth],
            outward,
            inward,
            end: t_max * inward,
        })
    }

    /// A limit on `t` in the caller's units, in the units used here.
    #[inline]
    pub(super) fn inward(&self, t: f32) -> f32 {
        t * self.inward
    }

    /// A `t` found here in the caller's units.
    #[inline]
    pub(super) fn outward(&self, t: f32) -> f32 {
        t * self.outward
    }
}

/// 1 / component, finite.
#[inline(always)]
fn inverse(component: f32) -> f32 {
    let steep = if component.abs() < LEAST_SLOPE { LEAST_SLOPE.copysign(component) } else { component };
    1.0 / steep
}

#[inline(always)]
fn sign(component: f32) -> usize {
    (component.to_bits() >> 31) as usize
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "these values are exact")]
mod tests {
    use super::*;

    #[test]
    fn directions_are_scaled_by_powers_of_two() {
        for exponent in [-149, -140, -126, -100, -1, 0, 1, 50, 126, 127] {
            let length = 2.0_f64.powi(exponent) as f32;
            let ray = Prepared::new(Vec3::ZERO, Vec3::new(0.0, -length, 0.0), f32::INFINITY).unwrap();
            let rest = 2.0_f32.powi((exponent + 126).min(0) + (exponent - 126).max(0));
            assert_eq!(ray.direction, [0.0, -rest, 0.0], "2^{exponent}");
            assert_eq!((ray.outward * length, ray.outward * ray.inward), (rest, 1.0));
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
                assert!(Prepared::new(v, good, f32::INFINITY).is_none());
                assert!(Prepared::new(good, v, f32::INFINITY).is_none());
            }
        }
        assert!(Prepared::new(good, Vec3::ZERO, f32::INFINITY).is_none());
        assert!(Prepared::new(good, Vec3::new(-0.0, -0.0, -0.0), f32::INFINITY).is_none());
        assert!(Prepared::new(Vec3::splat(1e30), good, f32::INFINITY).is_none());
        assert!(Prepared::new(good, Vec3::MAX, f32::INFINITY).is_some());
    }
}

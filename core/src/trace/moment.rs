//! A moment of the shutter, and what moves at that moment.

use glam::{Affine3A, Mat3A, Vec3};

/// When a ray is on its way: a piece of the motion, and the share of that piece which has passed.
///
/// Motion is cut at knots, the same for a whole scene. Between two knots every vertex and every entry of a transform
/// goes along a straight line at a constant rate, so that every point does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moment {
    /// Index of the knot before: the piece goes from there to the next.
    pub piece: u32,
    /// Share of the piece that has passed, in [0, 1).
    pub passed: f32,
}

impl Moment {
    /// The only moment of a scene in which nothing moves, and the first of any other.
    pub const STILL: Self = Self { piece: 0, passed: 0.0 };

    /// A number on its way from `a` to `b`; `a` itself where both are the same. Rounded like
    /// the blocks of triangles, to the bit.
    #[inline]
    pub fn number(self, a: f32, b: f32) -> f32 {
        (b - a).mul_add(self.passed, a)
    }

    /// A vector on its way from `a` to `b`.
    #[inline]
    pub fn vector(self, a: Vec3, b: Vec3) -> Vec3 {
        Vec3::new(self.number(a.x, b.x), self.number(a.y, b.y), self.number(a.z, b.z))
    }

    /// The values at the knots before and after, which are the same where there is but one.
    #[inline]
    pub fn ends<T>(self, knots: &[T]) -> [&T; 2] {
        let last = knots.len() - 1;
        let before = (self.piece as usize).min(last);
        [&knots[before], &knots[(before + 1).min(last)]]
    }

    /// The transform between those at the knots (at least one), entry by entry.
    #[inline]
    pub fn transform(self, knots: &[Affine3A]) -> Affine3A {
        let [a, b] = self.ends(knots);
        let column = |a: glam::Vec3A, b: glam::Vec3A| self.vector(a.into(), b.into()).into();
        Affine3A {
            matrix3: Mat3A::from_cols(
                column(a.matrix3.x_axis, b.matrix3.x_axis),
                column(a.matrix3.y_axis, b.matrix3.y_axis),
                column(a.matrix3.z_axis, b.matrix3.z_axis),
            ),
            translation: column(a.translation, b.translation),
        }
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "these values are exact")]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_move_keeps_its_bits() {
        let moment = Moment { piece: 3, passed: 0.377_123 };
        for value in [0.1, -7.3e20, 1e-30, 0.0] {
            assert_eq!(moment.number(value, value), value);
        }
        let still = [Affine3A::from_translation(Vec3::new(0.1, 0.2, 0.3))];
        assert_eq!(moment.transform(&still), still[0]);
    }

    #[test]
    fn pieces_lie_between_their_knots() {
        let knots = [0.0, 1.0, 5.0].map(|x| Affine3A::from_translation(Vec3::X * x));
        let at = |piece, passed| Moment { piece, passed }.transform(&knots).translation.x;
        assert_eq!([at(0, 0.0), at(0, 0.5), at(1, 0.0), at(1, 0.25), at(2, 0.5)], [0.0, 0.5, 1.0, 2.0, 5.0]);
    }
}

//! A ray and what it hits.

use super::moment::Moment;
use glam::{Vec2, Vec3};
use std::cmp::Ordering;

/// The points `origin + t · direction` with 0 < t < `t_max`.
///
/// A ray hits nothing where its origin is not finite or its coordinates add up to more than 2⁶², where its direction is
/// zero or not finite, or where `t_max` is NaN or not positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where the ray starts, in world space.
    pub origin: Vec3,
    /// Where it goes; any length above zero, which is the unit of `t`.
    pub direction: Vec3,
    /// End of the ray in lengths of `direction`; may be infinite.
    pub t_max: f32,
    /// When it is on its way: what moves is met where it is then.
    pub moment: Moment,
}

impl Ray {
    /// The ray without an end, at the first moment: the only one of a scene in which nothing moves.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_max: f32::INFINITY, moment: Moment::STILL }
    }

    /// The same ray at another moment.
    #[must_use]
    pub fn at(self, moment: Moment) -> Self {
        Self { moment, ..self }
    }
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// Index of the placement.
    pub instance: u32,
    /// Index of the triangle in its mesh.
    pub triangle: u32,
    /// Weights of the triangle's second and third vertex; the first has the rest.
    pub barycentric: Vec2,
}

impl Hit {
    /// Whether this hit is in front of `other`: nearer, or as near and of a smaller instance, then a smaller
    /// triangle. This is a total order on the hits of one ray, so the nearest does not depend on the order in
    /// which they are found.
    #[inline]
    pub(super) fn precedes(&self, other: &Hit) -> bool {
        match self.t.partial_cmp(&other.t) {
            Some(Ordering::Less) => true,
            Some(Ordering::Equal) => (self.instance, self.triangle) < (other.instance, other.triangle),
            _ => false,
        }
    }
}

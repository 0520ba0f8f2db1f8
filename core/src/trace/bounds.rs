//! Axis-aligned boxes.

use glam::Vec3;

/// Padding of a box that a ray is tested against, relative to the box's largest coordinate: 2⁻²¹, eight times the
/// rounding error of a coordinate. Woop's triangle test moves an edge by a few rounding errors of the coordinates
/// at most; a box that much larger never hides a triangle which that test would hit.
const PADDING: f32 = 1.0 / (1 << 21) as f32;

/// An axis-aligned box; empty where `min` is above `max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Least coordinates.
    pub min: Vec3,
    /// Greatest coordinates.
    pub max: Vec3,
}

impl Bounds {
    /// The box around nothing.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The least box around some points.
    pub fn around(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |bounds, p| bounds.union(Self { min: p, max: p }))
    }

    /// The least box around two.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether the box holds no point.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// The middle of the box; zero where it is empty.
    pub fn centre(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { self.min * 0.5 + self.max * 0.5 }
    }

    /// Lengths of the edges; zero where the box is empty.
    pub fn size(&self) -> Vec3 {
        if self.is_empty() { Vec3::ZERO } else { self.max - self.min }
    }

    /// Half the surface of the box, in f64 because areas of very small boxes leave the range of f32.
    pub(super) fn half_area(&self) -> f64 {
        let size = self.size().as_dvec3();
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    /// Largest absolute coordinate of a box that is not empty.
    pub(super) fn reach(&self) -> f32 {
        self.min.abs().max(self.max.abs()).max_element()
    }

    /// The box grown by [`PADDING`] on every side.
    pub(super) fn padded(self) -> Self {
        let padding = Vec3::splat(self.reach() * PADDING);
        Self { min: self.min - padding, max: self.max + padding }
    }
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "these values are exact")]
mod tests {
    use super::*;

    #[test]
    fn union_and_emptiness() {
        assert!(Bounds::EMPTY.is_empty());
        assert_eq!(Bounds::EMPTY.half_area(), 0.0);
        let bounds = Bounds::around([Vec3::new(1.0, 2.0, 3.0), Vec3::new(-1.0, 4.0, 3.0)]);
        assert_eq!(bounds.size(), Vec3::new(2.0, 2.0, 0.0));
        assert_eq!(bounds.half_area(), 4.0);
        assert_eq!(bounds.union(Bounds::EMPTY), bounds);
        assert_eq!(bounds.reach(), 4.0);
        assert!(bounds.padded().min.z < 3.0 && bounds.padded().max.z > 3.0);
    }
}

//! An axis-aligned box around points.

use glam::{DAffine3, DVec3};

/// An axis-aligned box; `lower > upper` while it is empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Least coordinates.
    pub lower: DVec3,
    /// Greatest coordinates.
    pub upper: DVec3,
}

impl Bounds {
    /// A box around nothing.
    pub const EMPTY: Self = Self { lower: DVec3::INFINITY, upper: DVec3::NEG_INFINITY };

    /// Makes room for a point.
    pub fn include(&mut self, point: DVec3) {
        self.lower = self.lower.min(point);
        self.upper = self.upper.max(point);
    }

    /// The box around both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { lower: self.lower.min(other.lower), upper: self.upper.max(other.upper) }
    }

    /// The box around the eight corners moved by `transform`: it may be larger than what it holds.
    #[must_use]
    pub fn transformed(self, transform: &DAffine3) -> Self {
        let mut moved = Self::EMPTY;
        if self.is_empty() {
            return moved;
        }
        for corner in 0..8 {
            let pick =
                |axis: usize| if corner >> axis & 1 == 0 { self.lower[axis] } else { self.upper[axis] };
            moved.include(transform.transform_point3(DVec3::new(pick(0), pick(1), pick(2))));
        }
        moved
    }

    /// Whether nothing was included.
    pub fn is_empty(&self) -> bool {
        !(self.lower.cmple(self.upper).all())
    }

    /// Whether every coordinate is a number; an empty box is not finite.
    pub fn is_finite(&self) -> bool {
        self.lower.is_finite() && self.upper.is_finite()
    }

    /// The middle.
    pub fn centre(&self) -> DVec3 {
        self.lower * 0.5 + self.upper * 0.5
    }

    /// Half the diagonal: the radius of the sphere around the box.
    pub fn radius(&self) -> f64 {
        (self.upper * 0.5 - self.lower * 0.5).length()
    }
}

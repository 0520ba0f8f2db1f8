//! Samples that were dropped, by cause.

use serde::{Deserialize, Serialize};

/// Samples that were not finite or were negative, by cause. They count as samples of value zero;
/// a clean scene has none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct InvalidSamples {
    /// Not a number.
    pub nan: u64,
    /// Positive or negative infinity.
    pub infinite: u64,
    /// A negative component.
    pub negative: u64,
}

impl InvalidSamples {
    /// All of them.
    pub fn total(self) -> u64 {
        self.nan + self.infinite + self.negative
    }

    /// Adds those of another batch.
    pub fn add(&mut self, other: Self) {
        self.nan += other.nan;
        self.infinite += other.infinite;
        self.negative += other.negative;
    }

    /// `value` where it may be added to a film, else zero, counted.
    #[inline]
    pub fn checked(&mut self, value: glam::Vec3) -> glam::Vec3 {
        if value.is_finite() && value.min_element() >= 0.0 {
            return value;
        }
        if value.is_nan() {
            self.nan += 1;
        } else if !value.is_finite() {
            self.infinite += 1;
        } else {
            self.negative += 1;
        }
        glam::Vec3::ZERO
    }
}

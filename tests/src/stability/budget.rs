//! How much work a trial may do.

/// How much work a trial may do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// Share of the full work: 1 for the page.
    pub share: f64,
}

/// Rays of a picture at the full budget, at most: about half a minute of one core, but for bidirectional, whose joins are not
/// all worth a ray.
const RAYS: f64 = 5e7;

impl Budget {
    /// That of the page.
    pub const FULL: Self = Self { share: 1.0 };

    /// Most rays of one picture.
    pub fn rays(self) -> f64 {
        RAYS * self.share
    }

    /// A number of repetitions that is `full` at the full budget, at least `least`.
    pub fn of(self, full: u64, least: u64) -> u64 {
        ((full as f64 * self.share) as u64).clamp(least.min(full), full)
    }
}

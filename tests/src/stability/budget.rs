//! How much work a trial may do.

/// How much work a trial may do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// Share of the full work of pictures.
    pub share: f64,
    /// Share of numbers of repetitions.
    pub counts: f64,
}

/// Rays of a picture at the full budget, at most: about half a minute of one core, but for bidirectional, whose joins are not
/// all worth a ray.
const RAYS: f64 = 5e7;

impl Budget {
    /// That of the page.
    pub const FULL: Self = Self::even(1.0);

    /// The same share of all work.
    pub const fn even(share: f64) -> Self {
        Self { share, counts: share }
    }

    /// Most rays of one picture.
    pub fn rays(self) -> f64 {
        RAYS * self.share
    }

    /// A number of repetitions that is `full` at the full budget, at least `least`.
    pub fn of(self, full: u64, least: u64) -> u64 {
        ((full as f64 * self.counts) as u64).clamp(least.min(full), full)
    }
}

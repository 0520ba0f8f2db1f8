//! How densities of several techniques become weights.

/// Weights in proportion to a power of what each technique would sample (Veach 1997, §9.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Heuristic {
    /// The densities themselves.
    Balance,
    /// Their squares.
    Power,
}

impl Heuristic {
    /// What a ratio of densities counts.
    #[inline]
    pub fn of(self, ratio: f64) -> f64 {
        match self {
            Self::Balance => ratio,
            Self::Power => ratio * ratio,
        }
    }
}

//! A point that light is looked for from, as the choice among lights sees it.

use glam::Vec3;

/// A point that light is looked for from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lit {
    /// Where.
    pub point: Vec3,
    /// Unit normal of the surface there; of no meaning in empty space.
    pub normal: Vec3,
    /// Which lights count there.
    pub from: LitFrom,
}

/// Which lights count at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LitFrom {
    /// Those on the side of the normal, by their cosine to it.
    Above,
    /// Those on both sides of a surface that lets light through, by their cosine to its normal.
    BothSides,
    /// All, alike in every direction: there is no surface.
    Everywhere,
}

impl Lit {
    /// A point that is on no surface.
    pub fn in_space(point: Vec3) -> Self {
        Self { point, normal: Vec3::ZERO, from: LitFrom::Everywhere }
    }
}

//! A side of a patch.

use crate::radiosity::patch::PatchId;
use crate::scene::interaction::Side;

/// A side of a patch: the finite element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Element(pub u32);

impl Element {
    /// A side of a patch.
    #[inline]
    pub fn new(patch: PatchId, side: Side) -> Self {
        Self(2 * patch.0 + u32::from(side == Side::Back))
    }

    /// As an index.
    #[inline]
    pub fn index(self) -> usize {
        self.0 as usize
    }

    /// Its patch.
    #[inline]
    pub fn patch(self) -> PatchId {
        PatchId(self.0 / 2)
    }

    /// Its side.
    #[inline]
    pub fn side(self) -> Side {
        if self.0.is_multiple_of(2) { Side::Front } else { Side::Back }
    }

    /// 1 on the front, −1 on the back.
    #[inline]
    pub fn sign(self) -> f32 {
        if self.0.is_multiple_of(2) { 1.0 } else { -1.0 }
    }
}

//! What the lobes of a surface hand to each other.

use crate::bsdf::event::{Letter, Scattered};
use crate::math::colour::Rgb;
use glam::Vec3;

/// Values and densities of all smooth lobes of a pair of directions.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Evaluated {
    /// f · |cos θᵢ|.
    pub(super) value: Scattered,
    /// Density over solid angle, with the probabilities of the lobes.
    pub(super) pdf: f32,
}

/// A direction that one lobe drew.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn {
    pub(super) wi: Vec3,
    /// As in `BsdfSample`.
    pub(super) eta: f32,
    /// `None`: a smooth lobe; what it is worth is asked of all of them afterwards.
    pub(super) delta: Option<Delta>,
}

/// The choice of an ideally specular lobe.
#[derive(Clone, Copy, Debug)]
pub(super) struct Delta {
    /// f · |cos θᵢ|, the coefficient of the Dirac delta.
    pub(super) value: Rgb,
    pub(super) probability: f32,
    pub(super) letter: Letter,
}

impl Drawn {
    /// From a smooth lobe on the same side or through a thin wall.
    pub(super) fn smooth(wi: Vec3) -> Self {
        Self { wi, eta: 1.0, delta: None }
    }
}

/// `Some(u)`, uniform in 0..1 again, with probability `p`; else `Err` of the same.
#[inline]
pub(super) fn split(u: f32, p: f32) -> Result<f32, f32> {
    let top = 1.0_f32.next_down();
    if u < p { Ok((u / p).min(top)) } else { Err(((u - p) / (1.0 - p)).min(top)) }
}

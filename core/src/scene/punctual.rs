//! Lights without extent, as `KHR_lights_punctual` has them.

use crate::math::colour::Rgb;
use glam::Vec3;

/// A light without extent.
#[derive(Clone, Debug)]
pub struct Punctual {
    /// Name of its node, or its own where the node has none.
    pub name: String,
    /// Where and how it shines.
    pub kind: PunctualKind,
}

/// Where and how a light without extent shines, in the scene's space. Radiant intensities are per
/// scene unit: W/sr times the square of [`scale`](crate::scene::normalisation::Normalisation::scale),
/// so that intensity / distance² is W/m² with distances in scene units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PunctualKind {
    /// The same in every direction.
    Point {
        /// Where.
        position: Vec3,
        /// Radiant intensity.
        intensity: Rgb,
    },
    /// A cone.
    Spot {
        /// Where.
        position: Vec3,
        /// The cone's axis, away from the light, unit length.
        direction: Vec3,
        /// Radiant intensity along the axis.
        intensity: Rgb,
        /// Cosine of the angle up to which the intensity is that of the axis.
        inner_cos: f32,
        /// Cosine of the angle from which on it is zero; less than `inner_cos`.
        outer_cos: f32,
    },
    /// From infinitely far.
    Directional {
        /// Where the light goes, unit length.
        direction: Vec3,
        /// Irradiance of a surface at right angles, W/m².
        irradiance: Rgb,
    },
}

impl PunctualKind {
    /// Share of a spot's intensity at an angle of this cosine to its axis, as `KHR_lights_punctual`
    /// recommends: the square of a linear ramp in the cosine.
    pub fn cone(inner_cos: f32, outer_cos: f32, cos: f32) -> f32 {
        let ramp = ((cos - outer_cos) / (inner_cos - outer_cos).max(1e-4)).clamp(0.0, 1.0);
        ramp * ramp
    }
}

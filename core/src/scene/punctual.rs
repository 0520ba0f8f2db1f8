//! Lights without extent, as `KHR_lights_punctual` has them.

use crate::math::colour::Rgb;
use crate::trace::moment::Moment;
use glam::Vec3;

/// A light without extent.
#[derive(Clone, Debug)]
pub struct Punctual {
    /// Name of its node, or its own where the node has none.
    pub name: String,
    /// Where and how it shines; of one that moves, at the first knot.
    pub kind: PunctualKind,
    /// Where it is and which way it shines at each knot; empty of one that stands.
    pub knots: Vec<(Vec3, Vec3)>,
}

impl Punctual {
    /// Where and how it shines at a moment. Between knots its place goes straight, its direction along the chord.
    pub fn at(&self, moment: Moment) -> PunctualKind {
        if self.knots.is_empty() {
            return self.kind;
        }
        let [a, b] = moment.ends(&self.knots);
        let position = moment.vector(a.0, b.0);
        let direction = moment.vector(a.1, b.1).try_normalize().unwrap_or(a.1);
        self.kind.moved(position, direction)
    }
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
    /// The same light elsewhere; `direction` has unit length.
    #[must_use]
    fn moved(self, to: Vec3, direction: Vec3) -> Self {
        match self {
            Self::Point { intensity, .. } => Self::Point { position: to, intensity },
            Self::Spot { intensity, inner_cos, outer_cos, .. } => {
                Self::Spot { position: to, direction, intensity, inner_cos, outer_cos }
            }
            Self::Directional { irradiance, .. } => Self::Directional { direction, irradiance },
        }
    }

    /// Share of a spot's intensity at an angle of this cosine to its axis, as `KHR_lights_punctual`
    /// recommends: the square of a linear ramp in the cosine.
    pub fn cone(inner_cos: f32, outer_cos: f32, cos: f32) -> f32 {
        let ramp = ((cos - outer_cos) / (inner_cos - outer_cos).max(1e-4)).clamp(0.0, 1.0);
        ramp * ramp
    }
}

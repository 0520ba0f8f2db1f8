//! The solids that a walk is inside of.

use crate::math::colour::Rgb;
use crate::scene::interaction::Interaction;
use glam::Vec3;

/// Deepest nesting of solids that is kept; what is entered below is taken for the last.
const DEPTH_MAX: usize = 16;

/// The solids that a walk is inside of, innermost last. A walk that starts inside learns of it when it leaves.
#[derive(Clone, Copy, Debug)]
pub struct Media {
    absorptions: [Rgb; DEPTH_MAX],
    depth: usize,
}

impl Media {
    /// In vacuum.
    pub const VACUUM: Self = Self { absorptions: [Vec3::ZERO; DEPTH_MAX], depth: 0 };

    /// Share of light left after `distance` (scene units) that ends at `end`, whose front may be on the other side:
    /// then the way was inside of its solid.
    pub fn transmittance_to(&self, distance: f32, end: &Interaction<'_>, back: Vec3) -> Rgb {
        if self.depth == 0 {
            let inside = back.dot(end.ng) < 0.0;
            return match end.material.volume {
                Some(volume) if inside => fade(volume.absorption, distance),
                _ => Vec3::ONE,
            };
        }
        self.transmittance(distance)
    }

    /// Share of light left after `distance` (scene units) in the innermost solid.
    pub fn transmittance(&self, distance: f32) -> Rgb {
        match self.depth.checked_sub(1) {
            Some(innermost) => fade(self.absorptions[innermost], distance),
            None => Vec3::ONE,
        }
    }

    /// Follows a transmission through `at` towards `direction`.
    pub fn cross(&mut self, at: &Interaction<'_>, direction: Vec3) {
        let Some(volume) = at.material.volume else { return };
        if direction.dot(at.ng) < 0.0 {
            self.absorptions[self.depth.min(DEPTH_MAX - 1)] = volume.absorption;
            self.depth = (self.depth + 1).min(DEPTH_MAX);
        } else {
            self.depth = self.depth.saturating_sub(1);
        }
    }
}

/// Beer and Lambert: exp(−σ d).
fn fade(absorption: Rgb, distance: f32) -> Rgb {
    if absorption == Vec3::ZERO {
        return Vec3::ONE;
    }
    let channel = |sigma: f32| if sigma == 0.0 { 1.0 } else { libm::expf(-sigma * distance) };
    Vec3::new(channel(absorption.x), channel(absorption.y), channel(absorption.z))
}

//! The ideal diffuse reflector.

use crate::bsdf::event::Scattered;
use crate::bsdf::lobe::{Drawn, Evaluated};
use crate::math::colour::Rgb;
use crate::math::warp;
use core::f32::consts::FRAC_1_PI;
use glam::{Vec2, Vec3};

/// Reflects ρ / π on either side, transmits nothing. Letter `D`.
#[derive(Clone, Copy, Debug)]
pub struct Lambert {
    /// ρ.
    pub reflectance: Rgb,
}

impl Lambert {
    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluated {
        let cos = wi.z.abs();
        if wo.z * wi.z <= 0.0 {
            return Evaluated::default();
        }
        let value = Scattered { diffuse: self.reflectance * (cos * FRAC_1_PI), glossy: Rgb::ZERO };
        Evaluated { value, pdf: cos * FRAC_1_PI }
    }

    pub(super) fn draw(wo: Vec3, u: Vec2) -> Drawn {
        let wi = warp::cosine_hemisphere(u);
        Drawn::smooth(wi.with_z(wi.z.copysign(wo.z)))
    }
}

//! Whole surfaces: densities, energy, reciprocity.

#![expect(clippy::float_cmp, reason = "a sample must carry the very bits of eval and pdf")]

mod chart;
mod chi_square;
mod energy;
mod finite;
mod kept;
pub(in crate::bsdf) mod oracle;
mod reciprocity;
pub(in crate::bsdf) mod rings;

use crate::bsdf::Bsdf;
use crate::bsdf::surface::{Finishing, Layers, SurfaceParameters, Walls};
use crate::math::colour::Rgb;
use glam::{Vec2, Vec3};

/// White plastic of index 1.5.
pub(crate) const PLASTIC: SurfaceParameters = SurfaceParameters {
    base_color: Rgb::ONE,
    metallic: 0.0,
    roughness: 0.5,
    specular: 1.0,
    specular_color: Rgb::ONE,
    ior: 1.5,
    transmission: 0.0,
    walls: Walls::Thin,
    layers: None,
};
pub(crate) const LAMBERT: SurfaceParameters = SurfaceParameters { specular: 0.0, ..PLASTIC };
pub(crate) const METAL: SurfaceParameters = SurfaceParameters { metallic: 1.0, ..PLASTIC };
pub(crate) const SHEET: SurfaceParameters = SurfaceParameters { transmission: 1.0, ..PLASTIC };
pub(crate) const SOLID: SurfaceParameters = SurfaceParameters { walls: Walls::Solid, ..SHEET };

pub(crate) const NO_LAYERS: Layers = Layers {
    coat: 0.0,
    coat_roughness: 0.0,
    coat_normal: Vec3::Z,
    sheen: Rgb::ZERO,
    sheen_roughness: 0.0,
    through: 0.0,
    through_color: Rgb::ONE,
    dispersion: 0.0,
    finish: Finishing::NONE,
};

/// With a roughness such that α is `alpha`.
pub(crate) fn rough(alpha: f32, surface: SurfaceParameters) -> Bsdf {
    Bsdf::from_surface(&SurfaceParameters { roughness: alpha.sqrt().next_up(), ..surface })
}

/// A direction at an angle to +z in degrees.
pub(crate) fn tilted(degrees: f64, azimuth: f64) -> Vec3 {
    let ((sin, cos), (s, c)) = (libm::sincos(degrees.to_radians()), libm::sincos(azimuth));
    Vec3::new((sin * c) as f32, (sin * s) as f32, cos as f32)
}

/// A small generator of uniform numbers (`SplitMix64`).
pub(crate) struct Uniform(pub(crate) u64);

impl Uniform {
    pub(crate) fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1 << 24) as f32
    }

    pub(crate) fn pair(&mut self) -> Vec2 {
        Vec2::new(self.next(), self.next())
    }

    /// Uniform on the sphere.
    pub(crate) fn direction(&mut self) -> Vec3 {
        crate::math::warp::sphere(self.pair())
    }

    /// Any surface; α is at least 1e-3.
    pub(crate) fn surface(&mut self) -> SurfaceParameters {
        let pick = |u: f32| {
            if u < 0.3 {
                0.0
            } else if u < 0.6 {
                1.0
            } else {
                (u - 0.6) / 0.4
            }
        };
        SurfaceParameters {
            base_color: Rgb::new(self.next(), self.next(), self.next()),
            metallic: pick(self.next()),
            roughness: 0.032 + 0.968 * self.next(),
            specular: pick(self.next()),
            specular_color: 2.0 * Rgb::new(self.next(), self.next(), self.next()),
            ior: 1.05 + 1.5 * self.next(),
            transmission: pick(self.next()),
            walls: if self.next() < 0.5 { Walls::Thin } else { Walls::Solid },
            layers: None,
        }
    }

    /// Any surface under any layers, the coat's normal along that of the surface.
    pub(crate) fn layered(&mut self) -> SurfaceParameters {
        let some = |u: f32| if u < 0.3 { 0.0 } else { (u - 0.3) / 0.7 };
        let layers = Layers {
            coat: some(self.next()),
            coat_roughness: 0.032 + 0.968 * self.next(),
            coat_normal: Vec3::Z,
            sheen: Rgb::new(self.next(), self.next(), self.next()) * some(self.next()),
            sheen_roughness: self.next(),
            through: some(self.next()),
            through_color: Rgb::new(self.next(), self.next(), self.next()),
            dispersion: 0.0,
            finish: Finishing::NONE,
        };
        SurfaceParameters { layers: Some(layers), ..self.surface() }
    }

    /// Any surface with a finish, half of them below other layers.
    pub(crate) fn finished(&mut self) -> SurfaceParameters {
        let some = |u: f32| if u < 0.3 { 0.0 } else { (u - 0.3) / 0.7 };
        let turn = std::f32::consts::TAU * self.next();
        let finish = Finishing {
            strength: some(self.next()),
            along: Vec2::from_angle(turn),
            film: some(self.next()),
            film_ior: 1.0 + 1.5 * self.next(),
            film_thickness: 1200.0 * self.next(),
        };
        let mut surface = self.layered();
        let layers = if self.next() < 0.5 { surface.layers.unwrap_or(NO_LAYERS) } else { NO_LAYERS };
        surface.layers = Some(Layers { finish, ..layers });
        surface
    }
}

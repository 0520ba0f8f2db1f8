//! What a glTF material says at one point.

use crate::math::colour::Rgb;
use glam::{Vec2, Vec3};

/// What is behind a transmitting surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Walls {
    /// A sheet without thickness: light passes without being bent.
    Thin,
    /// A solid: the side of −z is inside, and light is refracted.
    Solid,
}

/// What lies on a surface, and other things that few surfaces have; textures applied.
#[derive(Clone, Copy, Debug)]
pub struct Layers {
    /// `clearcoatFactor`, in 0..=1.
    pub coat: f32,
    /// Perceptual roughness of the coat.
    pub coat_roughness: f32,
    /// The coat's normal in the shading frame; of unit length, z > 0.
    pub coat_normal: Vec3,
    /// `sheenColorFactor`, in 0..=1.
    pub sheen: Rgb,
    /// Perceptual roughness of the sheen.
    pub sheen_roughness: f32,
    /// `diffuseTransmissionFactor`, in 0..=1: share of the diffuse base that scatters to the other side. Solids have none.
    pub through: f32,
    /// `diffuseTransmissionColorFactor`, in 0..=1.
    pub through_color: Rgb,
    /// 20 over the Abbe number of a solid's glass, not negative; 0 for one index of all colours.
    pub dispersion: f32,
    /// What is done to the interfaces of metal and plastic.
    pub finish: Finishing,
}

/// How an interface differs from an even one without a film (`KHR_materials_anisotropy`, `KHR_materials_iridescence`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finishing {
    /// `anisotropyStrength`, in 0..=1: along the direction α becomes α + (1 − α) strength².
    pub strength: f32,
    /// The direction in which the surface is rougher, in the shading frame's x and y; of unit length.
    pub along: Vec2,
    /// `iridescenceFactor`, in 0..=1.
    pub film: f32,
    /// Refractive index of the film, at least 1.
    pub film_ior: f32,
    /// Its thickness in nm, not negative.
    pub film_thickness: f32,
}

impl Finishing {
    /// Even and without a film.
    pub const NONE: Self =
        Self { strength: 0.0, along: Vec2::X, film: 0.0, film_ior: 1.3, film_thickness: 400.0 };

    /// Whether it changes anything.
    pub fn is_none(&self) -> bool {
        self.strength <= 0.0 && self.film <= 0.0
    }
}

impl Layers {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.coat <= 0.0
            && self.sheen == Rgb::ZERO
            && self.through <= 0.0
            && self.dispersion <= 0.0
            && self.finish.is_none()
    }
}

/// A glTF metallic-roughness surface with `KHR_materials_specular`, `_ior`, `_transmission` and
/// `_volume`, all textures applied. Numbers outside their range are clamped when a BSDF is built.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceParameters {
    /// Linear Rec.709, in 0..=1.
    pub base_color: Rgb,
    /// 0 dielectric, 1 metal.
    pub metallic: f32,
    /// Perceptual: α is its square.
    pub roughness: f32,
    /// `specularFactor`, in 0..=1.
    pub specular: f32,
    /// `specularColorFactor`, not negative.
    pub specular_color: Rgb,
    /// Refractive index of the inside over that of the outside; 0 means infinite, as in glTF.
    pub ior: f32,
    /// `transmissionFactor`, in 0..=1.
    pub transmission: f32,
    /// What transmitted light enters.
    pub walls: Walls,
    /// What lies on it.
    pub layers: Option<Layers>,
}

//! What the glTF surface model is made of at one point.

use crate::math::colour::Rgb;

/// Whether a transmitting surface is a wall without thickness or the border of a solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Walls {
    /// Light passes straight through.
    Thin,
    /// Light refracts into or out of a solid.
    Solid,
}

/// The parameters of the glTF surface model at one point, textures and vertex colours applied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceParameters {
    /// Reflectance of the base, 0..1.
    pub base_color: Rgb,
    /// 0 dielectric, 1 metal.
    pub metallic: f32,
    /// Perceptual roughness, 0..1; α is its square.
    pub roughness: f32,
    /// Strength of the dielectric reflection, 0..1.
    pub specular: f32,
    /// Colour of the dielectric reflection at normal incidence.
    pub specular_color: Rgb,
    /// Refractive index, at least 1.
    pub ior: f32,
    /// Share of the base that transmits, 0..1.
    pub transmission: f32,
    /// Thin or solid.
    pub walls: Walls,
}

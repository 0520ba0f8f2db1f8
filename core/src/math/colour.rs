//! Linear Rec.709 triples.

use glam::Vec3;

/// Radiance, reflectance or any other spectral quantity in linear Rec.709.
pub type Rgb = Vec3;

/// Luminance of linear Rec.709.
#[inline]
pub fn luminance(c: Rgb) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// Decodes one sRGB-encoded value in 0..1 (IEC 61966-2-1).
pub fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.04045 { v / 12.92 } else { libm::powf((v + 0.055) / 1.055, 2.4) }
}

/// Encodes one linear value in 0..1 as sRGB (IEC 61966-2-1).
pub fn linear_to_srgb(v: f32) -> f32 {
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * libm::powf(v, 1.0 / 2.4) - 0.055 }
}

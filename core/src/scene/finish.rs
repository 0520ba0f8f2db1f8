//! Brushed surfaces and thin films, as a material has them.

use crate::bsdf::surface::Finishing;
use crate::scene::material::{SurfaceCoordinates, TextureSlot, Textured};
use crate::scene::texture::Texture;
use glam::{Vec2, Vec4};

/// What is done to the interfaces of a material.
#[derive(Clone, Debug, PartialEq)]
pub struct FinishMaterial {
    /// `anisotropyStrength`, and a texture of directions (red and green) and strengths (blue).
    pub brush: Textured<f32>,
    /// Cosine and sine of `anisotropyRotation`: counter-clockwise from the tangent towards the bitangent.
    pub rotation: Vec2,
    /// `iridescenceFactor`; its texture's red.
    pub film: Textured<f32>,
    /// Refractive index of the film.
    pub film_ior: f32,
    /// Thickness of the film in nm where its texture is 0, and where it is 1 or there is none.
    pub thickness: [f32; 2],
    /// Its texture's green.
    pub thickness_map: Option<TextureSlot>,
}

impl FinishMaterial {
    /// Even and without a film.
    pub const NONE: Self = Self {
        brush: Textured::constant(0.0),
        rotation: Vec2::X,
        film: Textured::constant(0.0),
        film_ior: 1.3,
        thickness: [100.0, 400.0],
        thickness_map: None,
    };

    /// By its factors alone.
    pub fn without_textures(&self) -> Finishing {
        Finishing {
            strength: self.brush.factor,
            along: self.rotation,
            film: self.film.factor,
            film_ior: self.film_ior,
            film_thickness: self.thickness[1],
        }
    }

    /// At a point, for the sign of the bitangent in the shading frame, whose x is the tangent; 0 where the mesh has no
    /// tangents, and nothing is brushed.
    pub fn at(&self, textures: &[Texture], at: &SurfaceCoordinates, bitangent: f32) -> Finishing {
        let texel = |slot: Option<TextureSlot>| slot.map_or(Vec4::ONE, |slot| slot.sample(textures, at));
        let mut finish = self.without_textures();
        if let Some(slot) = self.brush.texture {
            let texel = slot.sample(textures, at);
            finish.strength *= texel.z;
            let direction = texel.truncate().truncate() * 2.0 - Vec2::ONE;
            finish.along = self.rotation.rotate(direction.normalize_or(Vec2::X));
        }
        finish.along.y *= bitangent;
        if bitangent == 0.0 {
            (finish.strength, finish.along) = (0.0, Vec2::X);
        }
        finish.film *= texel(self.film.texture).x;
        let share = texel(self.thickness_map).y;
        finish.film_thickness = self.thickness[0] + (self.thickness[1] - self.thickness[0]) * share;
        finish
    }
}

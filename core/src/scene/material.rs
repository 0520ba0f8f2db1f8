//! What surfaces are made of.

use crate::bsdf::surface::{Layers, SurfaceParameters, Walls};
use crate::math::colour::Rgb;
use crate::scene::finish::FinishMaterial;
use crate::scene::texture::{Texture, TextureId};
use glam::{Affine2, Vec2, Vec3, Vec4};

/// Index of a material of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct MaterialId(pub u16);

impl MaterialId {
    /// As an index.
    #[inline]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Which of a mesh's two lists of texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum UvSet {
    /// The first list.
    First,
    /// The second list.
    Second,
}

/// A texture and where on it a surface lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureSlot {
    /// The texture.
    pub texture: TextureId,
    /// The coordinates it is laid out by.
    pub set: UvSet,
    /// Applied to them first (`KHR_texture_transform`).
    pub transform: Affine2,
}

/// How a surface covers what is behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Coverage {
    /// Wholly.
    Opaque,
    /// Where alpha is at least `cutoff`.
    Mask {
        /// Alpha from which on the surface is there.
        cutoff: f32,
    },
    /// To the share that alpha says.
    Blend,
}

/// Which sides emit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// The front only.
    Front,
    /// Both.
    Both,
}

/// A factor and a texture to multiply it with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Textured<T> {
    /// The factor.
    pub factor: T,
    /// The texture.
    pub texture: Option<TextureSlot>,
}

impl<T> Textured<T> {
    /// Without a texture.
    pub const fn constant(factor: T) -> Self {
        Self { factor, texture: None }
    }
}

/// What a surface is made of: glTF's core model with its specular, ior, transmission, volume and
/// emissive-strength extensions. `KHR_materials_pbrSpecularGlossiness` is a dielectric with a coloured reflection
/// in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Its name; may be empty.
    pub name: String,
    /// Reflectance and alpha.
    pub base_color: Textured<Vec4>,
    /// 0 dielectric, 1 metal.
    pub metallic: f32,
    /// Perceptual roughness.
    pub roughness: f32,
    /// What varies roughness and metallic.
    pub roughness_map: Option<RoughnessMap>,
    /// A normal map and the scale of its x and y.
    pub normal: Option<(TextureSlot, f32)>,
    /// Radiance, W/(sr·m²) a channel.
    pub emission: Textured<Rgb>,
    /// Base colour of an unlit surface, whose other colours are black: the eye sees it as radiance, on both sides, straight
    /// or by ideally specular lobes. It lights nothing.
    pub unlit: Option<Rgb>,
    /// Which sides emit.
    pub sides: Sides,
    /// Strength of the dielectric reflection; its texture's alpha.
    pub specular: Textured<f32>,
    /// Colour of the dielectric reflection at normal incidence.
    pub specular_color: Textured<Rgb>,
    /// Refractive index, at least 1.
    pub ior: f32,
    /// Share of the base that transmits; its texture's red.
    pub transmission: Textured<f32>,
    /// What it encloses; `None` for thin walls.
    pub volume: Option<Volume>,
    /// What lies on it.
    pub layers: Option<Box<LayerMaterial>>,
    /// How it covers what is behind it.
    pub coverage: Coverage,
}

/// A clear coat over cloth, and what shines through.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerMaterial {
    /// Share of the surface that is coated; its texture's red.
    pub coat: Textured<f32>,
    /// Perceptual roughness of the coat; its texture's green.
    pub coat_roughness: Textured<f32>,
    /// A normal map of the coat and the scale of its x and y.
    pub coat_normal: Option<(TextureSlot, f32)>,
    /// Colour of the fibres.
    pub sheen: Textured<Rgb>,
    /// Perceptual roughness of the fibres; its texture's alpha.
    pub sheen_roughness: Textured<f32>,
    /// Share of the diffuse base that scatters to the other side; its texture's alpha.
    pub through: Textured<f32>,
    /// Its colour.
    pub through_color: Textured<Rgb>,
    /// 20 over the Abbe number of its glass.
    pub dispersion: f32,
    /// What is done to the interfaces of metal and plastic.
    pub finish: FinishMaterial,
}

impl LayerMaterial {
    /// No layers.
    pub const NONE: Self = Self {
        coat: Textured::constant(0.0),
        coat_roughness: Textured::constant(0.0),
        coat_normal: None,
        sheen: Textured::constant(Vec3::ZERO),
        sheen_roughness: Textured::constant(0.0),
        through: Textured::constant(0.0),
        through_color: Textured::constant(Vec3::ONE),
        dispersion: 0.0,
        finish: FinishMaterial::NONE,
    };

    /// All texture slots.
    fn slots(&self) -> [Option<&TextureSlot>; 10] {
        [
            self.coat.texture.as_ref(),
            self.coat_roughness.texture.as_ref(),
            self.coat_normal.as_ref().map(|(slot, _)| slot),
            self.sheen.texture.as_ref(),
            self.sheen_roughness.texture.as_ref(),
            self.through.texture.as_ref(),
            self.through_color.texture.as_ref(),
            self.finish.brush.texture.as_ref(),
            self.finish.film.texture.as_ref(),
            self.finish.thickness_map.as_ref(),
        ]
    }

    /// The layers by their factors alone.
    pub fn without_textures(&self) -> Layers {
        Layers {
            coat: self.coat.factor,
            coat_roughness: self.coat_roughness.factor,
            coat_normal: Vec3::Z,
            sheen: self.sheen.factor,
            sheen_roughness: self.sheen_roughness.factor,
            through: self.through.factor,
            through_color: self.through_color.factor,
            dispersion: self.dispersion,
            finish: self.finish.without_textures(),
        }
    }

    /// The layers at a point, for the coat's normal in the shading frame and the sign of its bitangent.
    pub fn at(
        &self,
        textures: &[Texture],
        at: &SurfaceCoordinates,
        coat_normal: Vec3,
        bitangent: f32,
    ) -> Layers {
        let texel = |slot: Option<TextureSlot>| slot.map_or(Vec4::ONE, |slot| slot.sample(textures, at));
        Layers {
            coat: self.coat.factor * texel(self.coat.texture).x,
            coat_roughness: self.coat_roughness.factor * texel(self.coat_roughness.texture).y,
            coat_normal,
            sheen: self.sheen.factor * texel(self.sheen.texture).truncate(),
            sheen_roughness: self.sheen_roughness.factor * texel(self.sheen_roughness.texture).w,
            through: self.through.factor * texel(self.through.texture).w,
            through_color: self.through_color.factor * texel(self.through_color.texture).truncate(),
            dispersion: self.dispersion,
            finish: self.finish.at(textures, at, bitangent),
        }
    }
}

/// A texture that varies how rough a surface is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RoughnessMap {
    /// Factors of roughness (green) and metallic (blue).
    MetallicRoughness(TextureSlot),
    /// A factor of glossiness (alpha), which is 1 − roughness.
    Glossiness(TextureSlot),
}

impl RoughnessMap {
    /// The texture.
    pub fn slot(&self) -> &TextureSlot {
        match self {
            Self::MetallicRoughness(slot) | Self::Glossiness(slot) => slot,
        }
    }
}

/// A solid's inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Absorption coefficient, per scene unit: light fades with exp(−absorption · distance).
    pub absorption: Rgb,
}

impl Default for Material {
    /// glTF's default material: white, metallic, rough.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Textured::constant(Vec4::ONE),
            metallic: 1.0,
            roughness: 1.0,
            roughness_map: None,
            normal: None,
            emission: Textured::constant(Vec3::ZERO),
            unlit: None,
            sides: Sides::Front,
            specular: Textured::constant(1.0),
            specular_color: Textured::constant(Vec3::ONE),
            ior: 1.5,
            transmission: Textured::constant(0.0),
            volume: None,
            layers: None,
            coverage: Coverage::Opaque,
        }
    }
}

/// Where on its textures a point lies, and the colour of the mesh there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceCoordinates {
    /// Both sets of texture coordinates.
    pub uvs: [Vec2; 2],
    /// Vertex colour and alpha, linear.
    pub colour: Vec4,
}

impl TextureSlot {
    /// The texture's value at a point.
    #[inline]
    pub fn sample(&self, textures: &[Texture], at: &SurfaceCoordinates) -> Vec4 {
        let uv = at.uvs[self.set as usize];
        textures[self.texture.index()].sample(self.transform.transform_point2(uv))
    }
}

impl Material {
    /// Thin-walled, or the surface of a solid.
    pub fn walls(&self) -> Walls {
        if self.volume.is_some() { Walls::Solid } else { Walls::Thin }
    }

    /// Whether any of it scatters light to its other side.
    pub fn transmits(&self) -> bool {
        self.transmission.factor > 0.0 || self.layers.as_ref().is_some_and(|l| l.through.factor > 0.0)
    }

    /// Whether it emits anywhere.
    pub fn emits(&self) -> bool {
        self.emission.factor.max_element() > 0.0
    }

    /// Whether all of its surface emits alike.
    pub fn emits_evenly(&self) -> bool {
        self.emission.texture.is_none() && self.coverage == Coverage::Opaque
    }

    /// Whether it emits by a texture, and nowhere more than a radiance of one.
    pub fn only_glows(&self) -> bool {
        self.emission.texture.is_some() && self.emission.factor.max_element() <= 1.0
    }

    /// All texture slots that are in use.
    pub fn slots(&self) -> impl Iterator<Item = &TextureSlot> {
        [
            self.base_color.texture.as_ref(),
            self.roughness_map.as_ref().map(RoughnessMap::slot),
            self.normal.as_ref().map(|(slot, _)| slot),
            self.emission.texture.as_ref(),
            self.specular.texture.as_ref(),
            self.specular_color.texture.as_ref(),
            self.transmission.texture.as_ref(),
        ]
        .into_iter()
        .chain(self.layers.iter().flat_map(|layers| layers.slots()))
        .flatten()
    }

    /// Base colour and alpha before the coverage rule.
    pub fn base(&self, textures: &[Texture], at: &SurfaceCoordinates) -> Vec4 {
        let texel = self.base_color.texture.map_or(Vec4::ONE, |slot| slot.sample(textures, at));
        self.base_color.factor * at.colour * texel
    }

    /// Share of what is behind that the surface covers, 0..1: 1 for opaque ones, 0 or 1 for masks.
    pub fn alpha(&self, textures: &[Texture], at: &SurfaceCoordinates) -> f32 {
        match self.coverage {
            Coverage::Opaque => 1.0,
            Coverage::Mask { cutoff } => f32::from(self.base(textures, at).w >= cutoff),
            Coverage::Blend => self.base(textures, at).w.clamp(0.0, 1.0),
        }
    }

    /// Radiance emitted where a side emits.
    pub fn radiance(&self, textures: &[Texture], at: &SurfaceCoordinates) -> Rgb {
        match self.emission.texture {
            Some(slot) if self.emits() => {
                self.emission.factor * slot.sample(textures, at).truncate().max(Vec3::ZERO)
            }
            _ => self.emission.factor,
        }
    }

    /// What the eye sees of it where it is unlit.
    pub fn shown(&self, textures: &[Texture], at: &SurfaceCoordinates) -> Option<Rgb> {
        let texel = || self.base_color.texture.map_or(Vec4::ONE, |slot| slot.sample(textures, at));
        self.unlit.map(|factor| factor * (at.colour * texel()).truncate().max(Vec3::ZERO))
    }

    /// Roughness and metallic.
    pub fn roughness_and_metallic(&self, textures: &[Texture], at: &SurfaceCoordinates) -> (f32, f32) {
        let (roughness, metallic) = match self.roughness_map {
            None => (self.roughness, self.metallic),
            Some(RoughnessMap::MetallicRoughness(slot)) => {
                let texel = slot.sample(textures, at);
                (self.roughness * texel.y, self.metallic * texel.z)
            }
            Some(RoughnessMap::Glossiness(slot)) => {
                (1.0 - (1.0 - self.roughness) * slot.sample(textures, at).w, self.metallic)
            }
        };
        (roughness.clamp(0.0, 1.0), metallic.clamp(0.0, 1.0))
    }

    /// Strength and colour of the dielectric reflection.
    pub fn dielectric(&self, textures: &[Texture], at: &SurfaceCoordinates) -> (f32, Rgb) {
        let strength = self.specular.texture.map_or(1.0, |slot| slot.sample(textures, at).w);
        let colour =
            self.specular_color.texture.map_or(Vec3::ONE, |slot| slot.sample(textures, at).truncate());
        ((self.specular.factor * strength).clamp(0.0, 1.0), self.specular_color.factor * colour)
    }

    /// Share of the base that transmits.
    pub fn transmitted(&self, textures: &[Texture], at: &SurfaceCoordinates) -> f32 {
        let texel = self.transmission.texture.map_or(1.0, |slot| slot.sample(textures, at).x);
        (self.transmission.factor * texel).clamp(0.0, 1.0)
    }

    /// What the surface is made of at a point, below its layers.
    pub fn surface(&self, textures: &[Texture], at: &SurfaceCoordinates) -> SurfaceParameters {
        let (roughness, metallic) = self.roughness_and_metallic(textures, at);
        let (specular, specular_color) = self.dielectric(textures, at);
        SurfaceParameters {
            base_color: self.base(textures, at).truncate().clamp(Vec3::ZERO, Vec3::ONE),
            metallic,
            roughness,
            specular,
            specular_color,
            ior: self.ior,
            transmission: self.transmitted(textures, at),
            walls: self.walls(),
            layers: None,
        }
    }

    /// What the surface is made of wherever the mesh has no colours; `None` where textures tell, and of layers.
    pub fn even_surface(&self) -> Option<SurfaceParameters> {
        let textures = [self.base_color.texture, self.specular.texture, self.specular_color.texture];
        let even = textures.iter().all(Option::is_none)
            && self.transmission.texture.is_none()
            && self.roughness_map.is_none()
            && self.layers.is_none();
        even.then(|| self.surface(&[], &SurfaceCoordinates { uvs: [Vec2::ZERO; 2], colour: Vec4::ONE }))
    }

    /// The normal that the map says, in the frame of tangent, bitangent and normal; not of unit length.
    pub fn mapped_normal(&self, textures: &[Texture], at: &SurfaceCoordinates) -> Option<Vec3> {
        self.normal.map(|map| mapped(map, textures, at))
    }

    /// The same of its coat.
    pub fn mapped_coat_normal(&self, textures: &[Texture], at: &SurfaceCoordinates) -> Option<Vec3> {
        self.layers.as_ref()?.coat_normal.map(|map| mapped(map, textures, at))
    }
}

fn mapped((slot, scale): (TextureSlot, f32), textures: &[Texture], at: &SurfaceCoordinates) -> Vec3 {
    let n = slot.sample(textures, at).truncate() * 2.0 - Vec3::ONE;
    Vec3::new(n.x * scale, n.y * scale, n.z)
}

//! Materials of a document.

use crate::gltf::document::{At, Document};
use crate::gltf::error::{LoadError, Problems};
use crate::gltf::textures::{TextureTable, UvSets};
use crate::scene::finish::FinishMaterial;
use crate::scene::material::{
    Coverage, LayerMaterial, Material, RoughnessMap, Sides, TextureSlot, Textured, Volume,
};
use crate::scene::texture::Encoding;
use glam::{Vec2, Vec3, Vec4};

/// A material and the sets of texture coordinates that its two stand for. The absorption of its volume is
/// still per metre.
pub(crate) struct Read {
    pub(crate) material: Material,
    pub(crate) sets: UvSets,
    /// JSON pointer; empty for the default material.
    pub(crate) pointer: String,
}

const UNLIT: &str = "KHR_materials_unlit";
const SPECULAR_GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";

/// Collects what a material refers to.
struct Reader<'a> {
    document: &'a Document,
    table: &'a mut TextureTable,
    problems: &'a mut Problems,
    sets: UvSets,
}

/// Reads a material; `None` is the default one.
pub(crate) fn read(
    document: &Document,
    index: Option<usize>,
    table: &mut TextureTable,
    problems: &mut Problems,
) -> Result<Read, LoadError> {
    let Some(index) = index else {
        return Ok(Read { material: Material::default(), sets: UvSets::default(), pointer: String::new() });
    };
    let item = document.item("materials", index)?;
    let mut reader = Reader { document, table, problems, sets: UvSets::default() };
    let mut material = Material { name: item.name(), ..Material::default() };
    coverage(&item, &mut material)?;
    if item.extension(UNLIT)?.is_some() {
        reader.unlit(&item, &mut material)?;
        return Ok(Read { material, sets: reader.sets, pointer: item.pointer });
    }
    reader.core(&item, &mut material)?;
    reader.emission(&item, &mut material)?;
    reader.dielectric(&item, &mut material)?;
    reader.transmission(&item, &mut material)?;
    reader.layers(&item, &mut material)?;
    Ok(Read { material, sets: reader.sets, pointer: item.pointer })
}

/// Three numbers that are not negative.
fn colour(at: &At<'_>, key: &str) -> Result<Option<Vec3>, LoadError> {
    let Some(numbers) = at.numbers::<3>(key)? else {
        return Ok(None);
    };
    let colour = Vec3::from(numbers.map(|v| v as f32));
    if colour.is_finite() && colour.min_element() >= 0.0 {
        Ok(Some(colour))
    } else {
        Err(at.error(format!("\"{key}\" holds a number that is negative or too large")))
    }
}

/// Which sides emit, and what is seen through it.
fn coverage(item: &At<'_>, material: &mut Material) -> Result<(), LoadError> {
    material.sides = if item.flag("doubleSided")?.unwrap_or(false) { Sides::Both } else { Sides::Front };
    material.coverage = match item.text("alphaMode")? {
        None | Some("OPAQUE") => Coverage::Opaque,
        Some("BLEND") => Coverage::Blend,
        Some("MASK") => Coverage::Mask { cutoff: item.number("alphaCutoff")?.unwrap_or(0.5) as f32 },
        Some(_) => return Err(item.error("\"alphaMode\" must be OPAQUE, MASK or BLEND")),
    };
    Ok(())
}

impl Reader<'_> {
    fn slot(&mut self, at: &At<'_>, key: &str, encoding: Encoding) -> Result<Option<TextureSlot>, LoadError> {
        self.table.slot(self.document, at, key, encoding, &mut self.sets, self.problems)
    }

    fn core(&mut self, item: &At<'_>, material: &mut Material) -> Result<(), LoadError> {
        if let Some(extension) = item.extension(SPECULAR_GLOSSINESS)? {
            self.specular_glossiness(&extension, material)?;
        } else if let Some(pbr) = item.object("pbrMetallicRoughness")? {
            self.base(&pbr, material)?;
            material.metallic = pbr.share("metallicFactor")?.unwrap_or(1.0);
            material.roughness = pbr.share("roughnessFactor")?.unwrap_or(1.0);
            if material.metallic > 0.0 || material.roughness > 0.0 {
                let slot = self.slot(&pbr, "metallicRoughnessTexture", Encoding::Linear)?;
                material.roughness_map = slot.map(RoughnessMap::MetallicRoughness);
            }
        }
        material.normal = self.normal_map(item, "normalTexture")?;
        Ok(())
    }

    fn base(&mut self, pbr: &At<'_>, material: &mut Material) -> Result<(), LoadError> {
        if let Some(factor) = pbr.numbers::<4>("baseColorFactor")? {
            material.base_color.factor = Vec4::from(factor.map(|v| v.clamp(0.0, 1.0) as f32));
        }
        material.base_color.texture = self.slot(pbr, "baseColorTexture", Encoding::Srgb)?;
        Ok(())
    }

    /// Black to light, its colour for the eye only.
    fn unlit(&mut self, item: &At<'_>, material: &mut Material) -> Result<(), LoadError> {
        if let Some(pbr) = item.object("pbrMetallicRoughness")? {
            self.base(&pbr, material)?;
        }
        let shown = material.base_color.factor;
        material.unlit = Some(shown.truncate());
        material.base_color.factor = Vec4::new(0.0, 0.0, 0.0, shown.w);
        material.metallic = 0.0;
        material.specular.factor = 0.0;
        Ok(())
    }

    /// The archived model: a diffuse colour under a reflection of any colour. Over 0.04, what a refractive index
    /// of 1.5 reflects, that colour is `specularColorFactor`; both models limit the reflection to 1.
    fn specular_glossiness(&mut self, at: &At<'_>, material: &mut Material) -> Result<(), LoadError> {
        if let Some(factor) = at.numbers::<4>("diffuseFactor")? {
            material.base_color.factor = Vec4::from(factor.map(|v| v.clamp(0.0, 1.0) as f32));
        }
        material.base_color.texture = self.slot(at, "diffuseTexture", Encoding::Srgb)?;
        material.metallic = 0.0;
        material.roughness = 1.0 - at.share("glossinessFactor")?.unwrap_or(1.0);
        material.specular_color.factor = colour(at, "specularFactor")?.unwrap_or(Vec3::ONE) / 0.04;
        let texture = self.slot(at, "specularGlossinessTexture", Encoding::Srgb)?;
        material.specular_color.texture = texture;
        material.roughness_map = texture.map(RoughnessMap::Glossiness);
        Ok(())
    }

    fn emission(&mut self, item: &At<'_>, material: &mut Material) -> Result<(), LoadError> {
        let factor = colour(item, "emissiveFactor")?.unwrap_or(Vec3::ZERO);
        let strength = match item.extension("KHR_materials_emissive_strength")? {
            Some(extension) => extension.number_from("emissiveStrength", 0.0)?.unwrap_or(1.0) as f32,
            None => 1.0,
        };
        let radiance = factor * strength;
        if !radiance.is_finite() {
            return Err(item.error("its emission exceeds the range of numbers"));
        }
        material.emission = Textured::constant(radiance);
        if material.emits() {
            material.emission.texture = self.slot(item, "emissiveTexture", Encoding::Srgb)?;
        }
        Ok(())
    }

    fn dielectric(&mut self, item: &At<'_>, material: &mut Material) -> Result<(), LoadError> {
        if let Some(extension) = item.extension("KHR_materials_ior")? {
            material.ior = match extension.number("ior")?.unwrap_or(1.5) {
                // The extension's way to say that everything is reflected.
                0.0 => 1000.0,
                ior if (1.0..=1000.0).contains(&ior) => ior as f32,
                ior => return Err(extension.error(format!("\"ior\" is {ior}, but must be 0 or 1 to 1000"))),
            };
        }
        if let Some(extension) = item.extension("KHR_materials_specular")? {
            material.specular.factor = extension.share("specularFactor")?.unwrap_or(1.0);
            material.specular_color.factor = colour(&extension, "specularColorFactor")?.unwrap_or(Vec3::ONE);
            if material.specular.factor > 0.0 {
                material.specular.texture = self.slot(&extension, "specularTexture", Encoding::Linear)?;
                if material.specular_color.factor != Vec3::ZERO {
                    material.specular_color.texture =
                        self.slot(&extension, "specularColorTexture", Encoding::Srgb)?;
                }
            }
        }
        Ok(())
    }

    fn layers(&mut self, item: &At<'_>, material: &mut Material) -> Result<(), LoadError> {
        let mut layers = LayerMaterial::NONE;
        if let Some(coat) = item.extension("KHR_materials_clearcoat")? {
            layers.coat.factor = coat.share("clearcoatFactor")?.unwrap_or(0.0);
            if layers.coat.factor > 0.0 {
                layers.coat.texture = self.slot(&coat, "clearcoatTexture", Encoding::Linear)?;
                layers.coat_roughness.factor = coat.share("clearcoatRoughnessFactor")?.unwrap_or(0.0);
                if layers.coat_roughness.factor > 0.0 {
                    let slot = self.slot(&coat, "clearcoatRoughnessTexture", Encoding::Linear)?;
                    layers.coat_roughness.texture = slot;
                }
                layers.coat_normal = self.normal_map(&coat, "clearcoatNormalTexture")?;
            }
        }
        if let Some(sheen) = item.extension("KHR_materials_sheen")? {
            layers.sheen.factor = colour(&sheen, "sheenColorFactor")?.unwrap_or(Vec3::ZERO).min(Vec3::ONE);
            if layers.sheen.factor != Vec3::ZERO {
                layers.sheen.texture = self.slot(&sheen, "sheenColorTexture", Encoding::Srgb)?;
                layers.sheen_roughness.factor = sheen.share("sheenRoughnessFactor")?.unwrap_or(0.0);
                let slot = self.slot(&sheen, "sheenRoughnessTexture", Encoding::Linear)?;
                layers.sheen_roughness.texture = slot;
            }
        }
        if let Some(through) = item.extension("KHR_materials_diffuse_transmission")? {
            layers.through.factor = through.share("diffuseTransmissionFactor")?.unwrap_or(0.0);
            if layers.through.factor > 0.0 {
                let color = colour(&through, "diffuseTransmissionColorFactor")?;
                layers.through_color.factor = color.unwrap_or(Vec3::ONE).min(Vec3::ONE);
                layers.through.texture =
                    self.slot(&through, "diffuseTransmissionTexture", Encoding::Linear)?;
                layers.through_color.texture =
                    self.slot(&through, "diffuseTransmissionColorTexture", Encoding::Srgb)?;
                if item.extension("KHR_materials_volume")?.is_some() {
                    let detail = "diffuse transmission into a volume is that through a thin wall: what it encloses \
                                  does not scatter";
                    self.problems.add(&through.pointer, detail);
                }
            }
        }
        if let Some(dispersion) = item.extension("KHR_materials_dispersion")?
            && material.volume.is_some()
        {
            layers.dispersion = dispersion.number_from("dispersion", 0.0)?.unwrap_or(0.0) as f32;
        }
        layers.finish = self.finish(item, material)?;
        if layers != LayerMaterial::NONE {
            material.layers = Some(Box::new(layers));
        }
        Ok(())
    }

    /// Brushed facets and a thin film.
    fn finish(&mut self, item: &At<'_>, material: &Material) -> Result<FinishMaterial, LoadError> {
        let mut finish = FinishMaterial::NONE;
        let mut pointers = Vec::new();
        if let Some(brush) = item.extension("KHR_materials_anisotropy")? {
            finish.brush.factor = brush.share("anisotropyStrength")?.unwrap_or(0.0);
            if finish.brush.factor > 0.0 {
                let (sin, cos) = libm::sincos(brush.number("anisotropyRotation")?.unwrap_or(0.0));
                finish.rotation = Vec2::new(cos as f32, sin as f32);
                finish.brush.texture = self.slot(&brush, "anisotropyTexture", Encoding::Linear)?;
                pointers.push(brush.pointer);
            }
        }
        if let Some(film) = item.extension("KHR_materials_iridescence")? {
            finish.film.factor = film.share("iridescenceFactor")?.unwrap_or(0.0);
            if finish.film.factor > 0.0 {
                finish.film.texture = self.slot(&film, "iridescenceTexture", Encoding::Linear)?;
                finish.film_ior = film.number_from("iridescenceIor", 1.0)?.unwrap_or(1.3) as f32;
                let thickness = |key, default: f64| {
                    film.number_from(key, 0.0).map(|number| number.unwrap_or(default) as f32)
                };
                finish.thickness = [
                    thickness("iridescenceThicknessMinimum", 100.0)?,
                    thickness("iridescenceThicknessMaximum", 400.0)?,
                ];
                let key = "iridescenceThicknessTexture";
                finish.thickness_map = self.slot(&film, key, Encoding::Linear)?;
                pointers.push(film.pointer);
            }
        }
        if material.transmission.factor > 0.0 && material.metallic < 1.0 {
            for pointer in pointers {
                self.problems
                    .add(&pointer, "of glass it is left out: what transmits is even and has no film");
            }
        }
        Ok(finish)
    }

    /// A normal map and its scale, unless that flattens it.
    fn normal_map(&mut self, at: &At<'_>, key: &str) -> Result<Option<(TextureSlot, f32)>, LoadError> {
        let Some(info) = at.object(key)? else {
            return Ok(None);
        };
        let scale = info.number("scale")?.unwrap_or(1.0) as f32;
        if scale == 0.0 || !scale.is_finite() {
            return Ok(None);
        }
        Ok(self.slot(at, key, Encoding::Linear)?.map(|slot| (slot, scale)))
    }

    fn transmission(&mut self, item: &At<'_>, material: &mut Material) -> Result<(), LoadError> {
        let Some(extension) = item.extension("KHR_materials_transmission")? else {
            return Ok(());
        };
        material.transmission.factor = extension.share("transmissionFactor")?.unwrap_or(0.0);
        if material.transmission.factor == 0.0 {
            return Ok(());
        }
        material.transmission.texture = self.slot(&extension, "transmissionTexture", Encoding::Linear)?;
        let Some(volume) = item.extension("KHR_materials_volume")? else {
            return Ok(());
        };
        if volume.number_from("thicknessFactor", 0.0)?.unwrap_or(0.0) > 0.0 {
            material.volume = Some(Volume { absorption: absorption(&volume)? });
        }
        Ok(())
    }
}

/// −ln(colour) / distance, per metre. Black would absorb infinitely; it is taken as the smallest float.
fn absorption(volume: &At<'_>) -> Result<Vec3, LoadError> {
    let colour = colour(volume, "attenuationColor")?.unwrap_or(Vec3::ONE).min(Vec3::ONE);
    let Some(distance) = volume.number("attenuationDistance")? else {
        return Ok(Vec3::ZERO);
    };
    if distance <= 0.0 {
        return Err(volume.error(format!("\"attenuationDistance\" is {distance}, but must be positive")));
    }
    let one = |c: f32| (-libm::log(f64::from(c.max(f32::MIN_POSITIVE))) / distance) as f32;
    let absorption = Vec3::new(one(colour.x), one(colour.y), one(colour.z)).max(Vec3::ZERO);
    if absorption.is_finite() {
        Ok(absorption)
    } else {
        Err(volume.error("absorbs beyond the range of numbers"))
    }
}

/// Leaves out a coverage rule that changes nothing.
pub(crate) fn simplify(material: &mut Material, least_vertex_alpha: f32, texture_is_opaque: bool) {
    if !texture_is_opaque {
        return;
    }
    let alpha = material.base_color.factor.w * least_vertex_alpha;
    let covers = match material.coverage {
        Coverage::Opaque => true,
        Coverage::Mask { cutoff } => alpha >= cutoff,
        Coverage::Blend => alpha >= 1.0,
    };
    if covers {
        material.coverage = Coverage::Opaque;
    }
}

//! Textures that materials look at: which picture, laid out by which coordinates, looked up how.

use crate::gltf::document::{At, Document};
use crate::gltf::error::{LoadError, Problems};
use crate::scene::material::{TextureSlot, UvSet};
use crate::scene::texture::{Encoding, Filter, Picture, Texture, TextureId, Wrap};
use glam::{Affine2, Mat2, Vec2};
use std::collections::BTreeMap;
use std::sync::Arc;

/// What makes two textures the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Look {
    image: usize,
    encoding: Encoding,
    wrap: [Wrap; 2],
    filter: Filter,
}

/// Textures asked for so far, each once.
#[derive(Default)]
pub(crate) struct TextureTable {
    known: BTreeMap<Look, TextureId>,
    list: Vec<Look>,
}

/// The sets of texture coordinates that a material uses, by number; a mesh keeps two.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct UvSets(pub(crate) [Option<u64>; 2]);

impl UvSets {
    fn slot(&mut self, number: u64) -> Option<UvSet> {
        for (place, set) in self.0.iter_mut().zip([UvSet::First, UvSet::Second]) {
            if *place.get_or_insert(number) == number {
                return Some(set);
            }
        }
        None
    }
}

impl TextureTable {
    /// The texture that `key` of `parent` refers to, if there is one.
    pub(crate) fn slot(
        &mut self,
        document: &Document,
        parent: &At<'_>,
        key: &str,
        encoding: Encoding,
        sets: &mut UvSets,
        problems: &mut Problems,
    ) -> Result<Option<TextureSlot>, LoadError> {
        let Some(info) = parent.object(key)? else {
            return Ok(None);
        };
        let index = info.need("index")?.as_index("textures", document.count("textures"))?;
        let item = document.item("textures", index)?;
        let Some(image) = picture_of(document, &item)? else {
            problems
                .add(&item.pointer, "the texture has no picture that can be read: its material goes without");
            return Ok(None);
        };
        let (wrap, filter) = sampler(document, &item)?;
        let mut number = info.whole("texCoord")?.unwrap_or(0);
        let mut transform = Affine2::IDENTITY;
        if let Some(extension) = info.extension("KHR_texture_transform")? {
            number = extension.whole("texCoord")?.unwrap_or(number);
            transform = uv_transform(&extension)?;
        }
        let Some(set) = sets.slot(number) else {
            problems.add(
                &info.pointer,
                "the material uses more than two sets of texture coordinates: this texture is left out",
            );
            return Ok(None);
        };
        let look = Look { image, encoding, wrap, filter };
        let next = TextureId(self.list.len() as u32);
        let texture = *self.known.entry(look).or_insert(next);
        if texture == next {
            self.list.push(look);
        }
        Ok(Some(TextureSlot { texture, set, transform }))
    }

    /// Indices of the pictures that are looked at, in rising order.
    pub(crate) fn images(&self) -> Vec<usize> {
        let mut images: Vec<usize> = self.list.iter().map(|look| look.image).collect();
        images.sort_unstable();
        images.dedup();
        images
    }

    /// The textures; `pictures` are those of [`images`](Self::images).
    pub(crate) fn finish(self, pictures: &[Arc<Picture>]) -> Vec<Texture> {
        let images = self.images();
        let texture = |look: &Look| Texture {
            picture: pictures[images.partition_point(|&image| image < look.image)].clone(),
            encoding: look.encoding,
            wrap: look.wrap,
            filter: look.filter,
        };
        self.list.iter().map(texture).collect()
    }
}

/// The picture of a texture: that of an extension that is understood before the core one.
fn picture_of(document: &Document, item: &At<'_>) -> Result<Option<usize>, LoadError> {
    let images = document.count("images");
    if let Some(extension) = item.extension("EXT_texture_webp")?
        && let Some(image) = extension.index("source", "images", images)?
    {
        return Ok(Some(image));
    }
    item.index("source", "images", images)
}

fn sampler(document: &Document, texture: &At<'_>) -> Result<([Wrap; 2], Filter), LoadError> {
    let Some(index) = texture.index("sampler", "samplers", document.count("samplers"))? else {
        return Ok(([Wrap::Repeat; 2], Filter::Linear));
    };
    let item = document.item("samplers", index)?;
    let wrap = |key: &str| match item.whole(key)? {
        None | Some(10497) => Ok(Wrap::Repeat),
        Some(33071) => Ok(Wrap::Clamp),
        Some(33648) => Ok(Wrap::Mirror),
        Some(other) => Err(item.error(format!("\"{key}\" is {other}, which is no wrap mode"))),
    };
    // A path tracer sees no pixel grid to minify for: how a texture is magnified decides.
    let filter = match item.whole("magFilter")? {
        Some(9728) => Filter::Nearest,
        None | Some(9729) => Filter::Linear,
        Some(other) => return Err(item.error(format!("\"magFilter\" is {other}, which is no filter"))),
    };
    Ok(([wrap("wrapS")?, wrap("wrapT")?], filter))
}

/// Scale, then rotation (counter-clockwise with v pointing down, as viewers have it), then offset.
fn uv_transform(extension: &At<'_>) -> Result<Affine2, LoadError> {
    let pair = |numbers: Option<[f64; 2]>, default: Vec2| {
        numbers.map_or(default, |[x, y]| Vec2::new(x as f32, y as f32))
    };
    let offset = pair(extension.numbers("offset")?, Vec2::ZERO);
    let scale = pair(extension.numbers("scale")?, Vec2::ONE);
    let (sin, cos) = libm::sincos(extension.number("rotation")?.unwrap_or(0.0));
    let (sin, cos) = (sin as f32, cos as f32);
    let matrix2 = Mat2::from_cols(Vec2::new(cos, -sin) * scale.x, Vec2::new(sin, cos) * scale.y);
    let transform = Affine2 { matrix2, translation: offset };
    if transform.is_finite() { Ok(transform) } else { Err(extension.error("exceeds the range of numbers")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gltf::limits::Limits;

    #[test]
    fn the_transform_scales_then_turns_then_moves() {
        let json = r#"{"t": {"offset": [0.5, -1], "rotation": 1.5707963267948966, "scale": [2, 3]}}"#;
        let document = Document::parse("t", json.as_bytes(), &Limits::default()).unwrap();
        let transform = uv_transform(&document.root().need("t").unwrap()).unwrap();
        // (1, 1) → (2, 3) → a quarter turn that takes u to −v and v to u: (3, −2) → (3.5, −3).
        let moved = transform.transform_point2(Vec2::ONE);
        assert!((moved - Vec2::new(3.5, -3.0)).length() < 1e-6, "{moved}");
    }

    #[test]
    fn a_material_has_two_sets_of_any_number() {
        let mut sets = UvSets::default();
        assert_eq!(sets.slot(3), Some(UvSet::First));
        assert_eq!(sets.slot(0), Some(UvSet::Second));
        assert_eq!(sets.slot(3), Some(UvSet::First));
        assert_eq!(sets.slot(1), None);
    }
}

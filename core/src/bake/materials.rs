//! Materials that show baked light: unlit, as `KHR_materials_unlit` has it.

use crate::bake::writer::Writer;
use crate::scene::data::SceneData;
use crate::scene::material::{Coverage, Material, MaterialId};
use crate::scene::texture::{Filter, Picture, Texels, Wrap};
use image::ImageEncoder as _;
use image::codecs::png::PngEncoder;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The extension that all baked materials use. None requires it: what ignores it still shows the colours, lit.
pub const UNLIT: &str = "KHR_materials_unlit";

/// Materials and textures that are written when they are first asked for.
#[derive(Debug, Default)]
pub struct Materials {
    written: BTreeMap<u16, usize>,
    textures: BTreeMap<u32, usize>,
}

/// Whether vertices of a material hold all of its colour: it emits, so that its light is no multiple of its base colour.
pub fn colour_is_whole(material: &Material) -> bool {
    material.emits() && material.coverage == Coverage::Opaque
}

impl Materials {
    /// The index of a material whose base colour is multiplied with that of vertices.
    pub fn unlit(&mut self, writer: &mut Writer, data: &SceneData, id: MaterialId) -> usize {
        if let Some(index) = self.written.get(&id.0) {
            return *index;
        }
        let material = &data.materials[id.index()];
        let base = if colour_is_whole(material) {
            json!({"baseColorFactor": [1.0, 1.0, 1.0, 1.0]})
        } else {
            let factor = material.base_color.factor;
            let factor = material.unlit.map_or(factor, |shown| shown.extend(factor.w));
            let factor = factor.clamp(glam::Vec4::ZERO, glam::Vec4::ONE);
            let mut base = json!({"baseColorFactor": factor.to_array()});
            if let Some(slot) = &material.base_color.texture {
                base["baseColorTexture"] = json!({"index": self.texture(writer, data, slot.texture.0)});
            }
            base
        };
        let index = writer.push("materials", describe(material, base));
        self.written.insert(id.0, index);
        index
    }

    fn texture(&mut self, writer: &mut Writer, data: &SceneData, id: u32) -> usize {
        if let Some(index) = self.textures.get(&id) {
            return *index;
        }
        let texture = &data.textures[id as usize];
        let wrap = |wrap: Wrap| match wrap {
            Wrap::Repeat => 10497,
            Wrap::Mirror => 33648,
            Wrap::Clamp => 33071,
        };
        let filter = match texture.filter {
            Filter::Nearest => 9728,
            Filter::Linear => 9729,
        };
        let sampler = json!({"magFilter": filter, "minFilter": filter,
            "wrapS": wrap(texture.wrap[0]), "wrapT": wrap(texture.wrap[1])});
        let index = writer.texture(&png(&texture.picture), sampler);
        self.textures.insert(id, index);
        index
    }
}

/// A material with an unlit base. Both sides are written as triangles of their own.
pub fn describe(material: &Material, base: Value) -> Value {
    let mut base = base;
    base["metallicFactor"] = json!(0.0);
    let mut described =
        json!({"name": material.name, "pbrMetallicRoughness": base, "extensions": {UNLIT: {}}});
    match material.coverage {
        Coverage::Opaque => {}
        Coverage::Mask { cutoff } => {
            described["alphaMode"] = json!("MASK");
            described["alphaCutoff"] = json!(cutoff);
        }
        Coverage::Blend => described["alphaMode"] = json!("BLEND"),
    }
    described
}

/// A picture's pixels as they are.
fn png(picture: &Picture) -> Vec<u8> {
    let (bytes, colour): (Vec<u8>, _) = match &picture.texels {
        Texels::Bytes(texels) => (texels.as_flattened().to_vec(), image::ExtendedColorType::Rgba8),
        Texels::Words(texels) => {
            let bytes = texels.iter().flatten().flat_map(|word| word.to_ne_bytes()).collect();
            (bytes, image::ExtendedColorType::Rgba16)
        }
    };
    let mut file = Vec::new();
    PngEncoder::new(&mut file)
        .write_image(&bytes, picture.width, picture.height, colour)
        .expect("the texels fill the picture, and memory takes what is written");
    file
}

//! Light of `EXT_lights_image_based`: six pictures around the scene.

use crate::gltf::accessor::Source;
use crate::gltf::bundle::Bundle;
use crate::gltf::document::{At, Document};
use crate::gltf::error::{LoadError, Problems};
use crate::gltf::pictures;
use crate::math::colour::Rgb;
use crate::scene::environment::Environment;
use crate::scene::texture::{Encoding, Picture};
use glam::{DQuat, Quat, Vec3};
use std::sync::Arc;

const NAME: &str = "EXT_lights_image_based";
/// Most pixels along the edge of a face: an environment of four by two faces is made of them.
const SIDE_MAX: u32 = 2048;

/// What was read.
pub(crate) struct ImageBased {
    /// The light.
    pub environment: Arc<Environment>,
    /// Indices of the pictures that it was read from.
    pub pictures: Vec<usize>,
}

/// The light that the scene names. Its sharpest pictures are the light itself; those made for rough surfaces, and
/// the coefficients of irradiance, are what a render finds by itself. Pictures are `RGBD`: sRGB over alpha.
pub(crate) fn read(
    bundle: &Bundle,
    source: Source<'_>,
    problems: &mut Problems,
) -> Result<Option<ImageBased>, LoadError> {
    let Some(light) = named(source.document)? else { return Ok(None) };
    let mut faces = Vec::new();
    let images = source.document.count("images");
    let levels = light.elements("specularImages")?;
    let first = levels.first().ok_or_else(|| light.error("\"specularImages\" is missing"))?;
    let list = first.value.as_array().map_or(0, Vec::len);
    if list != 6 {
        return Err(first.error(format!("should hold the 6 faces of a cube, but holds {list}")));
    }
    for i in 0..6 {
        let at = first.element(i)?;
        faces.push(at.as_index("images", images)?);
    }
    let indices = faces;
    let faces = pictures::read(bundle, source, &indices, problems)?;
    let side = faces[0].width;
    if let Some(odd) = faces.iter().position(|face| (face.width, face.height) != (side, side)) {
        let Picture { width, height, .. } = *faces[odd];
        let at = first.element(odd)?;
        return Err(at.error(format!("is {width}×{height} pixels, but all faces must be {side}×{side}")));
    }
    if side > SIDE_MAX {
        return Err(first.error(format!("faces have {side} pixels a side; at most {SIDE_MAX} are read")));
    }
    let intensity = light.number_from("intensity", 0.0)?.unwrap_or(1.0) as f32;
    let turn = turn(&light)?;
    let cube = Cube::new(&faces);
    let radiance = |direction: Vec3| cube.radiance(turn * direction) * intensity;
    let environment = Environment::of(4 * side as usize, 2 * side as usize, radiance);
    Ok(Some(ImageBased { environment: Arc::new(environment), pictures: indices }))
}

/// The light of the scene that is shown.
fn named(document: &Document) -> Result<Option<At<'_>>, LoadError> {
    let scenes = document.list("scenes")?;
    let chosen = document.root().index("scene", "scenes", scenes.len())?.unwrap_or(0);
    let Some(scene) = scenes.get(chosen) else { return Ok(None) };
    let Some(extension) = scene.extension(NAME)? else { return Ok(None) };
    let lights = match document.root().extension(NAME)? {
        Some(extension) => extension.items("lights")?,
        None => Vec::new(),
    };
    let light = extension.need("light")?.as_index("lights", lights.len())?;
    Ok(lights.into_iter().nth(light))
}

/// From the scene's directions to those of the pictures.
fn turn(light: &At<'_>) -> Result<Quat, LoadError> {
    let Some(rotation) = light.numbers::<4>("rotation")? else { return Ok(Quat::IDENTITY) };
    let rotation = DQuat::from_array(rotation);
    if !(rotation.length_squared() > 0.0 && rotation.length_squared().is_finite()) {
        return Err(light.error("\"rotation\" is no rotation"));
    }
    Ok(rotation.normalize().inverse().as_quat())
}

/// Six faces: +x, −x, +y, −y, +z, −z, each as it is seen from the middle.
struct Cube {
    side: usize,
    /// Radiance, face by face, row by row from the top.
    texels: Vec<Rgb>,
}

impl Cube {
    fn new(faces: &[Arc<Picture>]) -> Self {
        let side = faces[0].width;
        let texel = |face: &Picture, i: u32| {
            let texel = face.texel(Encoding::Srgb, i % side, i / side);
            if texel.w > 0.0 { texel.truncate() / texel.w } else { Rgb::ZERO }
        };
        let texels = faces.iter().flat_map(|face| (0..side * side).map(move |i| texel(face, i))).collect();
        Self { side: side as usize, texels }
    }

    /// From a direction, bilinear within its face.
    fn radiance(&self, d: Vec3) -> Rgb {
        // Where on the face: to the right and downwards, −1 to 1, for one who looks there from the middle with +y up; at
        // +y itself with −z up, at −y with +z up.
        let a = d.abs();
        let (face, right, down, depth) = if a.x >= a.y && a.x >= a.z {
            if d.x > 0.0 { (0, d.z, -d.y, a.x) } else { (1, -d.z, -d.y, a.x) }
        } else if a.y >= a.z {
            if d.y > 0.0 { (2, -d.x, d.z, a.y) } else { (3, -d.x, -d.z, a.y) }
        } else if d.z > 0.0 {
            (4, -d.x, -d.y, a.z)
        } else {
            (5, d.x, -d.y, a.z)
        };
        let place =
            |v: f32| ((v / depth + 1.0) * 0.5 * self.side as f32 - 0.5).clamp(0.0, self.side as f32 - 1.0);
        let (x, y) = (place(right), place(down));
        let at = |x: usize, y: usize| {
            let last = self.side - 1;
            self.texels[(face * self.side + y.min(last)) * self.side + x.min(last)]
        };
        let (column, row) = (x as usize, y as usize);
        let top = at(column, row).lerp(at(column + 1, row), x.fract());
        let bottom = at(column, row + 1).lerp(at(column + 1, row + 1), x.fract());
        top.lerp(bottom, y.fract())
    }
}

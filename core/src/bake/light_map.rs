//! Light as a texture: the mesh as it is, with a second set of texture coordinates.

use crate::bake::appearance::Appearance;
use crate::bake::atlas::{Chart, pack};
use crate::bake::materials::describe;
use crate::bake::scale;
use crate::bake::writer::Writer;
use crate::math::colour::{Rgb, linear_to_srgb};
use crate::radiosity::element::Element;
use crate::radiosity::patch::PatchId;
use crate::radiosity::solution::Solution;
use crate::scene::data::SceneData;
use crate::scene::instance::Handedness;
use crate::scene::interaction::Side;
use crate::scene::material::MaterialId;
use crate::trace::moment::Moment;
use glam::{Vec2, Vec3};
use image::ImageEncoder as _;
use image::codecs::png::PngEncoder;
use rayon::prelude::*;
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};

/// A light map: radiance of every texel, row by row from the top, W/(sr·m²).
#[derive(Clone, Debug)]
pub struct LightMap {
    /// Texels a row, and rows.
    pub side: u32,
    /// Radiance and alpha.
    pub texels: Vec<(Rgb, f32)>,
}

/// A side of a triangle that is written.
#[derive(Clone, Copy)]
struct Face {
    instance: u32,
    triangle: u32,
    side: Side,
}

#[derive(Default)]
struct Primitive {
    positions: Vec<Vec3>,
    first: Vec<Vec2>,
    second: Vec<Vec2>,
    indices: Vec<u32>,
}

/// Adds a node for each part of the scene, and returns them, the map, and the radiance that white stands for. `None`
/// where the triangles do not fit into a map of that side.
pub fn write(
    writer: &mut Writer,
    data: &SceneData,
    solution: &Solution,
    side: u32,
    white: Option<f32>,
) -> Option<(Vec<usize>, LightMap, f32)> {
    let faces = faces(data, solution);
    let longest = |face: &Face| {
        let [a, b, c] = data.corners(face.instance, face.triangle, Moment::STILL);
        f64::from(a.distance(b).max(b.distance(c)).max(c.distance(a)))
    };
    let sizes: Vec<f64> = faces.iter().map(longest).collect();
    let charts = pack(&sizes, side)?;
    let drawn: Vec<Vec<_>> =
        faces.par_iter().zip(&charts).map(|(face, chart)| draw(data, solution, face, chart)).collect();
    let mut map = LightMap { side, texels: vec![(Rgb::ZERO, 1.0); side as usize * side as usize] };
    let mut brightness = Vec::new();
    for (face, texels) in faces.iter().zip(drawn) {
        let emits = data.material(face.instance, face.triangle).emits();
        let [a, b, c] = data.corners(face.instance, face.triangle, Moment::STILL);
        let area = f64::from((b - a).cross(c - a).length()) / texels.len() as f64;
        for ([x, y], radiance, alpha) in texels {
            map.texels[y as usize * side as usize + x as usize] = (radiance, alpha);
            if !emits {
                brightness.push((radiance.max_element(), area));
            }
        }
    }
    let white = white.unwrap_or_else(|| scale::white(brightness));
    let sampler = json!({"magFilter": 9729, "minFilter": 9729, "wrapS": 33071, "wrapT": 33071});
    let texture = writer.texture(&map.png(white), sampler);
    Some((nodes(writer, data, &faces, &charts, side, texture), map, white))
}

/// All fronts, and the backs that light reaches.
fn faces(data: &SceneData, solution: &Solution) -> Vec<Face> {
    let mut lit_backs = BTreeSet::new();
    for (p, patch) in solution.patches().all().iter().enumerate() {
        let element = Element::new(PatchId(p as u32), Side::Back);
        let shines = [Vec2::ZERO, Vec2::X, Vec2::Y]
            .into_iter()
            .any(|local| Appearance::at(data, solution, element, local).radiance != Rgb::ZERO);
        if shines {
            lit_backs.insert((patch.instance, patch.triangle));
        }
    }
    let mut faces = Vec::new();
    for (i, placed) in data.instances.iter().enumerate() {
        for triangle in 0..data.meshes[placed.mesh.index()].triangles.len() as u32 {
            let face = |side| Face { instance: i as u32, triangle, side };
            faces.push(face(Side::Front));
            if lit_backs.contains(&(i as u32, triangle)) {
                faces.push(face(Side::Back));
            }
        }
    }
    faces
}

fn draw(data: &SceneData, solution: &Solution, face: &Face, chart: &Chart) -> Vec<([u32; 2], Rgb, f32)> {
    let texel = |(place, weights)| {
        let (patch, local) = solution.patches().at(face.instance, face.triangle, weights);
        let seen = Appearance::at(data, solution, Element::new(patch, face.side), local);
        (place, seen.radiance, seen.alpha)
    };
    chart.texels().map(texel).collect()
}

fn nodes(
    writer: &mut Writer,
    data: &SceneData,
    faces: &[Face],
    charts: &[Chart],
    side: u32,
    texture: usize,
) -> Vec<usize> {
    let mut parts: BTreeMap<_, BTreeMap<MaterialId, Primitive>> = BTreeMap::new();
    let mut names = BTreeMap::new();
    for (face, chart) in faces.iter().zip(charts) {
        let mesh = &data.meshes[data.instances[face.instance as usize].mesh.index()];
        let key = (face.instance, mesh.parts.partition_point(|part| part.first <= face.triangle));
        names.entry(key).or_insert_with(|| data.node_name(face.instance, face.triangle));
        let material = mesh.materials[face.triangle as usize];
        parts.entry(key).or_default().entry(material).or_default().add(data, face, chart, side);
    }
    let mut materials: BTreeMap<u16, usize> = BTreeMap::new();
    let mut nodes = Vec::new();
    for (key, primitives) in parts {
        let mut written = Vec::new();
        for (id, primitive) in primitives {
            let material = *materials.entry(id.0).or_insert_with(|| {
                let base = json!({"baseColorTexture": {"index": texture, "texCoord": 1}});
                writer.push("materials", describe(&data.materials[id.index()], base))
            });
            written.push(json!({"attributes": {"POSITION": writer.positions(&primitive.positions),
                    "TEXCOORD_0": writer.coordinates(&primitive.first), "TEXCOORD_1": writer.coordinates(&primitive.second)},
                "indices": writer.indices(&primitive.indices), "material": material}));
        }
        let mesh = writer.push("meshes", json!({"name": names[&key], "primitives": written}));
        nodes.push(writer.push("nodes", json!({"name": names[&key], "mesh": mesh})));
    }
    nodes
}

impl Primitive {
    fn add(&mut self, data: &SceneData, face: &Face, chart: &Chart, side: u32) {
        let instance = &data.instances[face.instance as usize];
        let mesh = &data.meshes[instance.mesh.index()];
        let vertices = mesh.triangles[face.triangle as usize].map(|v| v as usize);
        let weights = [Vec2::ZERO, Vec2::X, Vec2::Y];
        let metres = 1.0 / data.normalisation.scale();
        let first = self.positions.len() as u32;
        for (vertex, weights) in vertices.into_iter().zip(weights) {
            let position = instance.placement.point(mesh.positions[vertex]);
            self.positions.push((position.as_dvec3() * metres).as_vec3());
            self.first.push(mesh.uvs[0].get(vertex).copied().unwrap_or(Vec2::ZERO));
            self.second.push(chart.place(weights) / side as f32);
        }
        let mirrored = instance.placement.handedness() == Handedness::Mirrored;
        let turned = mirrored != (face.side == Side::Back);
        self.indices.extend(if turned {
            [first, first + 2, first + 1]
        } else {
            [first, first + 1, first + 2]
        });
    }
}

impl LightMap {
    /// As a PNG of eight bits, sRGB, `white` and what is brighter as white.
    pub fn png(&self, white: f32) -> Vec<u8> {
        let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
        let texel = |(radiance, alpha): &(Rgb, f32)| {
            let [r, g, b] = (*radiance / white).to_array().map(|v| byte(linear_to_srgb(v.clamp(0.0, 1.0))));
            [r, g, b, byte(*alpha)]
        };
        let bytes: Vec<u8> = self.texels.iter().flat_map(texel).collect();
        let mut file = Vec::new();
        PngEncoder::new(&mut file)
            .write_image(&bytes, self.side, self.side, image::ExtendedColorType::Rgba8)
            .expect("the texels fill the picture, and memory takes what is written");
        file
    }

    /// As an EXR of 32-bit floats, radiance as it is.
    pub fn exr(&self) -> Vec<u8> {
        use exr::prelude::{Image, SpecificChannels, Vec2, WritableImage as _};
        let side = self.side as usize;
        let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
            let [r, g, b] = self.texels[at.y() * side + at.x()].0.to_array();
            (r, g, b)
        });
        let mut file = std::io::Cursor::new(Vec::new());
        Image::from_channels((side, side), channels)
            .write()
            .to_buffered(&mut file)
            .expect("memory takes what is written");
        file.into_inner()
    }
}

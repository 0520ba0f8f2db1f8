//! Light as colours of vertices: the mesh as finely cut as the solution.

use crate::bake::appearance::Appearance;
use crate::bake::materials::{Materials, colour_is_whole};
use crate::bake::scale;
use crate::bake::writer::Writer;
use crate::radiosity::element::Element;
use crate::radiosity::patch::PatchId;
use crate::radiosity::solution::Solution;
use crate::scene::data::SceneData;
use crate::scene::instance::Handedness;
use crate::scene::interaction::Side;
use crate::scene::material::MaterialId;
use glam::{Vec2, Vec3, Vec4};
use serde_json::json;
use std::collections::BTreeMap;

/// Corners of an element's polygon: vertices of the solution, in order around it on its side.
struct Facet {
    element: Element,
    material: MaterialId,
    corners: Vec<Corner>,
}

#[derive(Clone, Copy)]
struct Corner {
    position: Vec3,
    uv: Vec2,
    colour: Vec4,
}

/// What vertices are told apart by: bits of position and coordinates, colour.
type Known = ([u32; 3], [u32; 2], [u16; 4]);

/// Triangles of one material, with each vertex once.
#[derive(Default)]
struct Primitive {
    known: BTreeMap<Known, u32>,
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    colours: Vec<[u16; 4]>,
    indices: Vec<u32>,
}

/// Adds a node for each part of the scene, and returns them and the radiance that white stands for.
pub fn write(
    writer: &mut Writer,
    data: &SceneData,
    solution: &Solution,
    white: Option<f32>,
) -> (Vec<usize>, f32) {
    let facets = facets(data, solution);
    let white = white.unwrap_or_else(|| scale::white(brightness(data, solution, &facets)));
    let mut materials = Materials::default();
    let mut nodes = Vec::new();
    let part = |facet: &Facet| {
        let patch = &solution.patches().all()[facet.element.patch().index()];
        let mesh = &data.meshes[data.instances[patch.instance as usize].mesh.index()];
        (patch.instance, mesh.parts.partition_point(|part| part.first <= patch.triangle))
    };
    let mut parts: BTreeMap<_, BTreeMap<MaterialId, Primitive>> = BTreeMap::new();
    let mut names = BTreeMap::new();
    for facet in &facets {
        let key = part(facet);
        let patch = &solution.patches().all()[facet.element.patch().index()];
        names.entry(key).or_insert_with(|| data.node_name(patch.instance, patch.triangle));
        parts.entry(key).or_default().entry(facet.material).or_default().add(facet, white);
    }
    for (key, primitives) in parts {
        let primitives: Vec<_> = (primitives.into_iter())
            .map(|(id, primitive)| {
                let textured = data.materials[id.index()].base_color.texture.is_some();
                let mut attributes = json!({"POSITION": writer.positions(&primitive.positions),
                    "COLOR_0": writer.colours(&primitive.colours)});
                if textured && !colour_is_whole(&data.materials[id.index()]) {
                    attributes["TEXCOORD_0"] = json!(writer.coordinates(&primitive.uvs));
                }
                json!({"attributes": attributes, "indices": writer.indices(&primitive.indices),
                    "material": materials.unlit(writer, data, id)})
            })
            .collect();
        let mesh = writer.push("meshes", json!({"name": names[&key], "primitives": primitives}));
        nodes.push(writer.push("nodes", json!({"name": names[&key], "mesh": mesh})));
    }
    (nodes, white)
}

/// All fronts, and the backs that light reaches.
fn facets(data: &SceneData, solution: &Solution) -> Vec<Facet> {
    let mut facets = Vec::new();
    for patch in 0..solution.patches().all().len() as u32 {
        for side in [Side::Front, Side::Back] {
            let facet = facet(data, solution, Element::new(PatchId(patch), side));
            let lit = facet.corners.iter().any(|c| c.colour.truncate().max_element() > 0.0);
            if side == Side::Front || lit {
                facets.push(facet);
            }
        }
    }
    facets
}

fn facet(data: &SceneData, solution: &Solution, element: Element) -> Facet {
    let patch = &solution.patches().all()[element.patch().index()];
    let instance = &data.instances[patch.instance as usize];
    let mesh = &data.meshes[instance.mesh.index()];
    let material_id = mesh.materials[patch.triangle as usize];
    let material = &data.materials[material_id.index()];
    let around = solution.vertices().around(data, solution.patches(), element);
    let [a, b, c] = patch.corners;
    let metres = 1.0 / data.normalisation.scale();
    let corner = |local: Vec2| {
        let seen = Appearance::at(data, solution, element, local);
        let colour = if colour_is_whole(material) { seen.radiance.extend(1.0) } else { seen.over_base };
        let position = a + (b - a) * local.x + (c - a) * local.y;
        let uv = material
            .base_color
            .texture
            .map_or(Vec2::ZERO, |slot| slot.transform.transform_point2(seen.at.uvs[slot.set as usize]));
        Corner { position: (position.as_dvec3() * metres).as_vec3(), uv, colour }
    };
    let mut corners: Vec<Corner> = around.into_iter().map(|(_, local)| corner(local)).collect();
    let mirrored = instance.placement.handedness() == Handedness::Mirrored;
    if mirrored != (element.side() == Side::Back) {
        corners.reverse();
    }
    Facet { element, material: material_id, corners }
}

/// Values to choose the white from, with the areas that have them.
fn brightness(data: &SceneData, solution: &Solution, facets: &[Facet]) -> Vec<(f32, f64)> {
    let dark = facets.iter().filter(|facet| !data.materials[facet.material.index()].emits());
    dark.flat_map(|facet| {
        let area = solution.patches().all()[facet.element.patch().index()].area();
        facet
            .corners
            .iter()
            .map(move |corner| (corner.colour.truncate().max_element(), area / facet.corners.len() as f64))
    })
    .collect()
}

impl Primitive {
    fn add(&mut self, facet: &Facet, white: f32) {
        let corners: Vec<u32> = facet.corners.iter().map(|corner| self.vertex(corner, white)).collect();
        if let [a, b, c] = corners[..] {
            self.indices.extend([a, b, c]);
            return;
        }
        // Finer neighbours' vertices lie on its edges: a fan around the middle, so that nothing gapes.
        let share = 1.0 / facet.corners.len() as f32;
        let sum = |of: fn(&Corner) -> Vec4| facet.corners.iter().map(of).sum::<Vec4>() * share;
        let middle = Corner {
            position: sum(|c| c.position.extend(0.0)).truncate(),
            uv: sum(|c| c.uv.extend(0.0).extend(0.0)).truncate().truncate(),
            colour: sum(|c| c.colour),
        };
        let middle = self.vertex(&middle, white);
        for i in 0..corners.len() {
            self.indices.extend([middle, corners[i], corners[(i + 1) % corners.len()]]);
        }
    }

    fn vertex(&mut self, corner: &Corner, white: f32) -> u32 {
        let rgb = (corner.colour.truncate() / white).extend(corner.colour.w);
        let colour = rgb.to_array().map(|v| (v.clamp(0.0, 1.0) * 65535.0).round() as u16);
        let key =
            (corner.position.to_array().map(f32::to_bits), corner.uv.to_array().map(f32::to_bits), colour);
        *self.known.entry(key).or_insert_with(|| {
            self.positions.push(corner.position);
            self.uvs.push(corner.uv);
            self.colours.push(colour);
            self.positions.len() as u32 - 1
        })
    }
}

//! A room open towards its camera, and bodies to put into it.

use crate::{
    glb::Glb,
    scenes::{flipped, floor, lambert, quad, sphere},
};
use glam::Vec3;
use serde_json::{Value, json};

/// A room of side 2, open towards where a camera would stand, with a lamp under its ceiling.
fn walls(lamp: f32) -> Glb {
    let mut glb = Glb::new();
    let at = Vec3::new;
    glb.body(lambert(0.7, 0.0), floor(-1.0, 2.0, 0.0, 0.0));
    glb.body(lambert(0.7, 0.0), flipped(floor(1.0, 2.0, 0.0, 0.0)));
    let back = quad([at(-1., -1., -1.), at(1., -1., -1.), at(1., 1., -1.), at(-1., 1., -1.)]);
    glb.body(lambert(0.5, 0.0), back);
    let left = quad([at(-1., -1., 1.), at(-1., -1., -1.), at(-1., 1., -1.), at(-1., 1., 1.)]);
    glb.body(lambert(0.3, 0.0), left);
    let right = quad([at(1., -1., -1.), at(1., -1., 1.), at(1., 1., 1.), at(1., 1., -1.)]);
    glb.body(lambert(0.6, 0.0), right);
    if lamp > 0.0 {
        let lamp = glb.body(lambert(0.0, lamp), flipped(floor(0.9, 0.7, 0.0, 0.0)));
        glb.document()["nodes"][lamp]["name"] = json!("lamp");
    }
    glb
}

/// The room with what `contents` puts in, seen in perspective.
pub fn room<T>(lamp: f32, contents: impl FnOnce(&mut Glb) -> T) -> Vec<u8> {
    let mut glb = walls(lamp);
    contents(&mut glb);
    glb.perspective(Vec3::new(0.0, 0.0, 3.4), Vec3::ZERO, 40.0);
    glb.finish()
}

/// The same, seen by parallel rays.
pub fn room_in_parallel<T>(lamp: f32, contents: impl FnOnce(&mut Glb) -> T) -> Vec<u8> {
    let mut glb = walls(lamp);
    contents(&mut glb);
    glb.orthographic(Vec3::new(0.6, 0.8, 3.0), Vec3::new(0.0, -0.1, 0.0), 2.2, 2.2);
    glb.finish()
}

/// A coloured dielectric.
pub fn plastic(roughness: f32) -> Value {
    json!({"pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.5, 0.3, 1.0], "metallicFactor": 0.0, "roughnessFactor": roughness}})
}

/// A coloured metal.
pub fn metal(roughness: f32) -> Value {
    json!({"pbrMetallicRoughness": {"baseColorFactor": [0.9, 0.8, 0.6, 1.0], "roughnessFactor": roughness}})
}

/// A sphere of few facets whose normals are smooth.
pub fn smooth_sphere(glb: &mut Glb, material: Value, centre: Vec3, radius: f32) {
    let (positions, triangles) = sphere(centre, radius, 8);
    let normals: Vec<f32> = positions.iter().flat_map(|p| ((*p - centre) / radius).to_array()).collect();
    let material = glb.material(material);
    let mesh = glb.mesh_with(&positions, &triangles, material, &[("NORMAL", &normals, 3)]);
    glb.place(mesh);
}

//! The scene that comes with the program: a room with glass, metal, plastic and a tiled floor.

use crate::{
    glb::Glb,
    scenes::{cuboid, flipped, floor, glass, lambert, quad, sphere},
};
use glam::Vec3;
use serde_json::{Value, json};

/// A mesh with a normal for each vertex.
struct Smooth {
    positions: Vec<Vec3>,
    normals: Vec<f32>,
    triangles: Vec<[u32; 3]>,
}

/// The room as a binary glTF.
pub fn room() -> Vec<u8> {
    let mut glb = Glb::new();
    walls(&mut glb);
    tiles(&mut glb);
    furniture(&mut glb);
    lamp(&mut glb);
    glb.perspective(Vec3::new(0.0, 1.45, 5.6), Vec3::new(0.0, 1.05, 0.0), 33.0);
    // 16:9, so that a picture is 1280×720 where nothing else is said.
    glb.document()["cameras"][0]["perspective"]["aspectRatio"] = json!(16.0 / 9.0);
    glb.finish()
}

fn coloured(rgb: [f32; 3]) -> Value {
    let mut material = lambert(0.0, 0.0);
    material["pbrMetallicRoughness"]["baseColorFactor"] = json!([rgb[0], rgb[1], rgb[2], 1.0]);
    material
}

fn add(glb: &mut Glb, name: &str, mut material: Value, (positions, triangles): (Vec<Vec3>, Vec<[u32; 3]>)) {
    material["name"] = json!(name);
    let material = glb.material(material);
    let mesh = glb.mesh(&positions, &triangles, material);
    glb.node(json!({"mesh": mesh, "name": name}));
}

fn walls(glb: &mut Glb) {
    let (w, h, d) = (2.4, 2.5, 1.8);
    let at = Vec3::new;
    let sides: [(&str, [f32; 3], [Vec3; 4]); 4] = [
        ("left wall", [0.60, 0.18, 0.12], [at(-w, 0.0, d), at(-w, 0.0, -d), at(-w, h, -d), at(-w, h, d)]),
        ("right wall", [0.12, 0.32, 0.42], [at(w, 0.0, -d), at(w, 0.0, d), at(w, h, d), at(w, h, -d)]),
        ("back wall", [0.72, 0.70, 0.66], [at(-w, 0.0, -d), at(w, 0.0, -d), at(w, h, -d), at(-w, h, -d)]),
        ("ceiling", [0.74, 0.73, 0.70], [at(-w, h, -d), at(w, h, -d), at(w, h, d), at(-w, h, d)]),
    ];
    for (name, colour, corners) in sides {
        add(glb, name, coloured(colour), quad(corners));
    }
}

/// A floor of glossy tiles: colour and roughness from textures.
fn tiles(glb: &mut Glb) {
    let side = 64;
    let (mut colour, mut gloss) = (Vec::new(), Vec::new());
    for y in 0..side {
        for x in 0..side {
            let joint = x % 32 == 0 || y % 32 == 0;
            let dark = (x / 32 + y / 32) % 2 == 0;
            let (level, rough) = match (joint, dark) {
                (true, _) => (95, 235),
                (false, true) => (110, 70),
                (false, false) => (205, 100),
            };
            let grain = (x * 7 + y * 13 + (x * y) % 5) % 9;
            colour.push([level + grain as u8, level + grain as u8 / 2, level - 12, 255]);
            gloss.push([0, rough, 0, 255]);
        }
    }
    let sampler = json!({"magFilter": 9729, "minFilter": 9729});
    let colour = glb.texture(&png(side, &colour), sampler.clone());
    let gloss = glb.texture(&png(side, &gloss), sampler);
    let material = glb.material(json!({"name": "tiles", "pbrMetallicRoughness": {
        "baseColorTexture": {"index": colour}, "metallicRoughnessTexture": {"index": gloss}, "metallicFactor": 0.0}}));
    let (positions, triangles) = floor(0.0, 4.8, 0.0, 0.0);
    let uvs: Vec<f32> = positions.iter().flat_map(|p| [p.x / 1.2, p.z / 1.2]).collect();
    let mesh = glb.mesh_with(&positions, &triangles, material, &[("TEXCOORD_0", &uvs, 2)]);
    glb.node(json!({"mesh": mesh, "name": "floor"}));
}

fn furniture(glb: &mut Glb) {
    add(
        glb,
        "plinth",
        coloured([0.68, 0.66, 0.62]),
        cuboid(Vec3::new(-1.55, 0.001, -0.9), Vec3::new(-0.65, 0.6, 0.0)),
    );
    let brass = json!({"name": "brass", "pbrMetallicRoughness":
        {"baseColorFactor": [0.91, 0.71, 0.38, 1.0], "metallicFactor": 1.0, "roughnessFactor": 0.28}});
    place(glb, "ring", brass, &torus(Vec3::new(-1.1, 1.03, -0.45), 0.33, 0.1, [72, 32]));
    let mut clear = glass(1.5);
    clear["extensions"]["KHR_materials_volume"]["attenuationColor"] = json!([0.80, 0.95, 0.88]);
    clear["extensions"]["KHR_materials_volume"]["attenuationDistance"] = json!(0.8);
    place(glb, "glass ball", clear, &ball(Vec3::new(0.15, 0.501, 0.55), 0.5));
    let teal = json!({"name": "plastic", "pbrMetallicRoughness":
        {"baseColorFactor": [0.02, 0.36, 0.34, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.18}});
    place(glb, "plastic ball", teal, &ball(Vec3::new(1.3, 0.451, -0.35), 0.45));
    let steel = json!({"name": "steel", "pbrMetallicRoughness":
        {"baseColorFactor": [0.62, 0.64, 0.66, 1.0], "metallicFactor": 1.0, "roughnessFactor": 0.0}});
    place(glb, "steel ball", steel, &ball(Vec3::new(1.15, 0.221, 0.8), 0.22));
}

fn lamp(glb: &mut Glb) {
    let mut light = lambert(0.0, 17.0);
    light["emissiveFactor"] = json!([1.0, 0.92, 0.8]);
    add(glb, "lamp", light, flipped(floor(2.49, 0.9, 0.2, 0.1)));
}

fn place(glb: &mut Glb, name: &str, mut material: Value, mesh: &Smooth) {
    material["name"] = json!(name);
    let material = glb.material(material);
    let mesh = glb.mesh_with(&mesh.positions, &mesh.triangles, material, &[("NORMAL", &mesh.normals, 3)]);
    glb.node(json!({"mesh": mesh, "name": name}));
}

fn ball(centre: Vec3, radius: f32) -> Smooth {
    let (positions, triangles) = sphere(centre, radius, 48);
    let normals = positions.iter().flat_map(|p| (*p - centre).normalize().to_array()).collect();
    Smooth { positions, normals, triangles }
}

/// A ring that stands upright, `counts` vertices around and across.
fn torus(centre: Vec3, major: f32, minor: f32, counts: [u32; 2]) -> Smooth {
    let [around, across] = counts;
    let (mut positions, mut normals, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..around {
        for j in 0..across {
            let u = f64::from(i) / f64::from(around) * std::f64::consts::TAU;
            let v = f64::from(j) / f64::from(across) * std::f64::consts::TAU;
            let out = glam::DVec3::new(u.cos(), u.sin(), 0.0);
            let normal = (out * v.cos() + glam::DVec3::Z * v.sin()).as_vec3();
            positions.push(centre + out.as_vec3() * major + normal * minor);
            normals.extend(normal.normalize().to_array());
            let at = |i: u32, j: u32| (i % around) * across + j % across;
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    Smooth { positions, normals, triangles }
}

fn png(side: u32, texels: &[[u8; 4]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, side, side);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().expect("writing to memory cannot fail");
    writer.write_image_data(texels.as_flattened()).expect("the texels fill the picture");
    writer.finish().expect("writing to memory cannot fail");
    bytes
}

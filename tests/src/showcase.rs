//! Scenes that show what a method is good at.

use crate::{
    glb::Glb,
    scenes::{add, coloured_lambert, cuboid, flipped, floor, glass, lambert, sphere},
};
use glam::Vec3;

/// A sphere with smooth normals.
fn ball(glb: &mut Glb, material: serde_json::Value, centre: Vec3, radius: f32) {
    let (positions, triangles) = sphere(centre, radius, 24);
    let normals: Vec<f32> = positions.iter().flat_map(|p| ((*p - centre) / radius).to_array()).collect();
    let material = glb.material(material);
    let mesh = glb.mesh_with(&positions, &triangles, material, &[("NORMAL", &normals, 3)]);
    glb.place(mesh);
}

/// A glass ball over a floor under a small lamp: a caustic.
pub fn caustic() -> Vec<u8> {
    let mut glb = Glb::new();
    add(&mut glb, "floor", coloured_lambert([0.7, 0.65, 0.6]), floor(0.0, 8.0, 0.0, 0.0));
    ball(&mut glb, glass(1.5), Vec3::new(0.0, 0.6, 0.0), 0.5);
    add(&mut glb, "lamp", lambert(0.0, 400.0), flipped(floor(3.0, 0.12, -1.2, 0.0)));
    glb.perspective(Vec3::new(0.0, 2.2, 3.6), Vec3::new(0.3, 0.2, 0.0), 36.0);
    glb.finish()
}

/// A closed room whose lamp is in a box of glass: no next event reaches it.
pub fn lamp_behind_glass() -> Vec<u8> {
    let mut glb = Glb::new();
    let (low, high) = (Vec3::new(-1.5, 0.0, -1.5), Vec3::new(1.5, 2.0, 1.5));
    add(&mut glb, "room", lambert(0.6, 0.0), flipped(cuboid(low, high)));
    add(
        &mut glb,
        "block",
        coloured_lambert([0.7, 0.3, 0.2]),
        cuboid(Vec3::new(0.3, 0.0, -0.8), Vec3::new(0.8, 0.8, -0.3)),
    );
    add(&mut glb, "lamp", lambert(0.0, 40.0), flipped(floor(1.7, 0.3, 0.0, -0.3)));
    add(&mut glb, "shade", glass(1.5), cuboid(Vec3::new(-0.25, 1.55, -0.55), Vec3::new(0.25, 1.85, -0.05)));
    glb.perspective(Vec3::new(0.0, 1.0, 1.45), Vec3::new(0.0, 0.8, -1.0), 60.0);
    glb.finish()
}

//! Floors with any number of lamps.

use crate::{
    glb::Glb,
    scenes::{add, cuboid, floor, lambert},
};
use glam::{Vec2, Vec3};
use ovtigre_core::sampler::{Dimension, Sampler};
use serde_json::json;

/// Of the floor, in metres.
const SIDE: f32 = 20.0;
/// Radiances of lamps, one as many as another, whatever their place: two decades.
const RADIANCES: [f32; 5] = [0.1, 0.32, 1.0, 3.2, 10.0];

/// What stands on the floor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hall {
    /// Blocks.
    Open,
    /// Blocks, in 16 rooms without ceilings.
    Rooms,
    /// Blocks, and all lamps are parts of one, 1 m wide and 5 m up: nothing to choose.
    OneLamp,
}

/// A floor of 20 × 20 m, seen whole from above, with `n` lamps that shine down on it: triangles, as far apart as they find
/// room, and half that far from the floor, 1 m at most. Their brightness has two decades.
pub fn lamps(n: u32, hall: Hall) -> Vec<u8> {
    let mut glb = Glb::new();
    add(&mut glb, "floor", lambert(0.6, 0.0), floor(0.0, SIDE, 0.0, 0.0));
    let across = (1..=n).find(|across| across * across >= n).unwrap_or(1);
    let width = if hall == Hall::OneLamp { 1.0 } else { SIDE };
    let apart = width / across as f32;
    let height = if hall == Hall::OneLamp { 5.0 } else { (0.5 * apart).min(1.0) };
    let place = |i: u32, by: Vec2| {
        let at = |cell: u32, by: f32| (cell as f32 + 0.2 + 0.6 * by) * apart - width / 2.0;
        Vec3::new(at(i % across, by.x), height, at(i / across, by.y))
    };
    let mut lamps: [(Vec<Vec3>, Vec<[u32; 3]>); RADIANCES.len()] = Default::default();
    // Cells that stay dark are spread like the others.
    for i in 0..n {
        let cell = (u64::from(i) * u64::from(across * across) / u64::from(n)) as u32;
        let sampler = Sampler::new(5, 0, [i, 0], 0);
        let at = place(cell, sampler.pair(Dimension::Film));
        let kind = (sampler.pair(Dimension::Lens).x * RADIANCES.len() as f32) as usize;
        let (positions, triangles) = &mut lamps[kind];
        let first = positions.len() as u32;
        let side = 0.1 * apart.min(2.0);
        positions.extend([at, at + Vec3::X * side, at + Vec3::Z * side]);
        triangles.push([first, first + 1, first + 2]);
    }
    for (radiance, body) in RADIANCES.into_iter().zip(lamps).filter(|(_, body)| !body.1.is_empty()) {
        add(&mut glb, "lamps", lambert(0.0, radiance), body);
    }
    for i in 0..36 {
        let at = |i: i32| (i as f32 - 2.5) * 3.3;
        let low = Vec3::new(at(i % 6), 0.0, at(i / 6));
        add(&mut glb, "block", lambert(0.5, 0.0), cuboid(low, low + Vec3::new(0.8, 0.7, 0.8)));
    }
    if hall == Hall::Rooms {
        for i in 0..5 {
            let (far, at) = (SIDE / 2.0, (i - 2) as f32 * SIDE / 4.0);
            let thick = 0.05;
            let along = |x: f32, z: f32| Vec3::new(x, 0.0, z);
            let wall = |low: Vec3, high: Vec3| cuboid(low, high + Vec3::Y * 2.5);
            add(&mut glb, "wall", lambert(0.7, 0.0), wall(along(at - thick, -far), along(at + thick, far)));
            add(&mut glb, "wall", lambert(0.7, 0.0), wall(along(-far, at - thick), along(far, at + thick)));
        }
    }
    glb.perspective(Vec3::new(0.0, 16.0, 14.0), Vec3::new(0.0, 0.0, 1.0), 52.0);
    glb.finish()
}

/// Lamps of every kind over a floor: triangles that shine on one side and on both, by a texture, points and spots, one of
/// each kind moving, and a glass pane in between.
pub fn lamps_of_every_kind(texture: &[u8]) -> Vec<u8> {
    let mut glb = Glb::new();
    add(&mut glb, "floor", lambert(0.6, 0.0), floor(0.0, 8.0, 0.0, 0.0));
    add(&mut glb, "block", lambert(0.5, 0.0), cuboid(Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 1.2, 0.5)));
    let shining = glb.texture(texture, json!({}));
    let mut moving = Vec::new();
    for i in 0..40_u32 {
        let sampler = Sampler::new(6, 0, [i, 0], 0);
        let (place, turn) = (sampler.pair(Dimension::Film), sampler.pair(Dimension::Lens));
        let at = Vec3::new(8.0 * place.x - 4.0, 0.6 + 1.5 * turn.x, 8.0 * place.y - 4.0);
        let down = json!({"translation": at.to_array(), "rotation": [-0.6, 0.2 * turn.y, 0.0, 0.7]});
        let node = match i % 5 {
            0 => glb.light(json!({"type": "point", "intensity": 0.2 + turn.y}), down),
            1 => {
                let spot = json!({"innerConeAngle": 0.2, "outerConeAngle": 0.3 + turn.y});
                glb.light(json!({"type": "spot", "intensity": 0.5, "spot": spot}), down)
            }
            kind => {
                let mut material = lambert(0.0, 4.0);
                if kind == 3 {
                    material["doubleSided"] = json!(true);
                }
                if kind == 4 {
                    material["emissiveTexture"] = json!({"index": shining});
                }
                let across = Vec3::new(0.3 * turn.x, 0.3 * turn.y - 0.15, 0.1);
                let corners = [at, at + Vec3::X * 0.3, at + across + Vec3::Z * 0.2];
                let material = glb.material(material);
                let uvs = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
                let mesh = glb.mesh_with(&corners, &[[0, 1, 2]], material, &[("TEXCOORD_0", &uvs, 2)]);
                glb.place(mesh)
            }
        };
        if i < 5 {
            moving.push(node);
        }
    }
    for node in moving {
        let half = std::f32::consts::FRAC_1_SQRT_2;
        glb.animate(node, "rotation", "LINEAR", &[0.0, 1.0], &[-0.6, 0.0, 0.0, 0.8, 0.0, half, 0.0, half]);
    }
    let pane = json!({"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.4},
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.8}}});
    add(&mut glb, "pane", pane, floor(0.5, 3.0, 1.5, 1.5));
    glb.perspective(Vec3::new(0.0, 5.0, 7.0), Vec3::ZERO, 50.0);
    glb.finish()
}

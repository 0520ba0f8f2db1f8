//! Scenes far too small, far too large, and far away.

use super::{
    case::Case,
    picture_trial::{ALL, by, mean_is_by},
};
use crate::{
    glb::Glb,
    irradiance,
    scenes::{cuboid, flipped, floor, lambert, quad},
};
use glam::{DVec3, Vec3};
use ovtigre_core::settings::Method;
use serde_json::{Value, json};
use std::f64::consts::PI;

const GROUP: &str = "Scale and place";
/// Corners of a lamp over the floor, seen from below.
const LAMP: [Vec3; 4] =
    [Vec3::new(0.3, 1.0, 0.3), Vec3::new(1.0, 1.0, 0.3), Vec3::new(1.0, 1.0, 1.0), Vec3::new(0.3, 1.0, 1.0)];
const RADIANCE: f32 = 3.0;
const REFLECTANCE: f32 = 0.5;
/// Side of the square of the floor that is seen.
const SEEN: f64 = 0.5;

/// All of them.
pub fn cases() -> Vec<Case> {
    let mut all = Vec::new();
    let places = [
        (1.0, 0.0),
        (1e-6, 0.0),
        (1e-3, 0.0),
        (1e3, 0.0),
        (1e6, 0.0),
        (1.0, 1e6),
        (1e-3, 1e6),
        (1e-6, 1e6),
        (1e6, 1e6),
    ];
    for (scale, offset) in places {
        all.push(lit(scale, offset));
        all.push(room(scale, offset));
    }
    all.extend([tiny_at_the_middle(), tiny_at_the_side()]);
    all
}

/// A scale and an offset as a node has them.
fn node(scale: f64, offset: f64) -> Value {
    json!({"scale": [scale, scale, scale], "translation": [offset, -offset, 0.5 * offset]})
}

/// Mean radiance of the part of the floor that is seen, by the midpoint rule over Lambert's formula in f64.
fn mean_under(corners: [Vec3; 4]) -> f64 {
    const N: u32 = 64;
    let at = |i: u32| SEEN * ((f64::from(i) + 0.5) / f64::from(N) - 0.5);
    let one = |x: f64, z: f64| irradiance::of_polygon(&corners.map(|c| c.as_dvec3() - DVec3::new(x, 0.0, z)));
    let sum: f64 = (0..N * N).map(|i| one(at(i % N), at(i / N))).sum();
    f64::from(RADIANCE * REFLECTANCE) / PI * sum / f64::from(N * N)
}

/// A floor and a lamp, seen aslant from above by parallel rays that cover the square [`SEEN`] of the floor.
fn stage() -> Glb {
    let mut glb = Glb::new();
    glb.body(lambert(REFLECTANCE, 0.0), floor(0.0, 4.0, 0.0, 0.0));
    glb.body(lambert(0.0, RADIANCE), quad(LAMP));
    glb.orthographic(Vec3::new(0.0, 1.5, 0.0), Vec3::ZERO, SEEN as f32, SEEN as f32);
    glb
}

fn lit(scale: f64, offset: f64) -> Case {
    let truth = mean_under(LAMP);
    Case {
        group: GROUP,
        name: format!("a lamp over a floor, × {scale:e}, moved by {offset:e}"),
        stresses: "coordinates: radiance does not depend on scale and place",
        known: format!("Lambert's polygon formula in f64, mean over what is seen: {truth:.6}"),
        note: "",
        trials: mean_is_by(
            &ALL,
            move || stage().finish_under(node(scale, offset)),
            &by(Method::Path, 4),
            truth,
        ),
    }
}

fn room(scale: f64, offset: f64) -> Case {
    let glb = move || {
        let mut glb = Glb::new();
        let turned = json!({"rotation": [0.1, 0.2, 0.3, 0.927_361_849_549_570_3]});
        let body = flipped(cuboid(Vec3::splat(-1.0), Vec3::ONE));
        let material = glb.material(lambert(0.8, 1.0));
        let mesh = glb.mesh(&body.0, &body.1, material);
        let mut node_of_room = turned;
        node_of_room["mesh"] = json!(mesh);
        glb.node(node_of_room);
        glb.perspective(Vec3::new(0.3, -0.2, 0.5), Vec3::new(-1.0, 0.4, -0.7), 70.0);
        glb.finish_under(node(scale, offset))
    };
    Case {
        group: GROUP,
        name: format!("a closed room, × {scale:e}, moved by {offset:e}"),
        stresses: "leaks: what gets out of the room is black",
        known: "Lₑ / (1 − ρ) = 5, everywhere".to_owned(),
        note: "",
        trials: mean_is_by(&ALL, glb, &by(Method::Path, 4), 1.0 / (1.0 - f64::from(0.8_f32))),
    }
}

/// The stage, 10⁻⁵ m large, in a black room of 10⁵ m around it.
fn among_large(offset: f64) -> impl Fn() -> Vec<u8> + Clone + Send + Sync + 'static {
    move || {
        let mut glb = stage();
        let nodes: Vec<usize> = (0..3).collect();
        let small = glb.carry(&nodes);
        let scaled = json!({"scale": [1e-5, 1e-5, 1e-5], "translation": [offset, 0.0, 0.0]});
        for key in ["scale", "translation"] {
            glb.document()["nodes"][small][key] = scaled[key].clone();
        }
        glb.body(lambert(0.0, 0.0), flipped(cuboid(Vec3::splat(-5e4), Vec3::splat(5e4))));
        glb.finish()
    }
}

fn tiny_at_the_middle() -> Case {
    let truth = mean_under(LAMP);
    Case {
        group: GROUP,
        name: "10⁻⁵ m in the middle of 10⁵ m".to_owned(),
        stresses: "ten orders of size in one scene",
        known: format!("the same lamp over the same floor: {truth:.6}"),
        note: "",
        trials: mean_is_by(&ALL, among_large(0.0), &by(Method::Path, 4), truth),
    }
}

fn tiny_at_the_side() -> Case {
    let truth = mean_under(LAMP);
    Case {
        group: GROUP,
        name: "10⁻⁵ m at the side of 10⁵ m".to_owned(),
        stresses: "ten orders of size, away from the scene's middle",
        known: format!("the same lamp over the same floor: {truth:.6}"),
        note: "Positions are f32 around the scene's middle: 30 km away from it they are multiples of 2 mm, and what is smaller has no shape.",
        trials: mean_is_by(&ALL, among_large(3e4), &by(Method::Path, 4), truth),
    }
}

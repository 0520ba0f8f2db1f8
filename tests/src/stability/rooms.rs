//! Closed rooms: light that hardly goes out.

use super::{
    case::{Case, Trial},
    finding::Finding,
    picture_trial::{ALL, by, mean_is_by, measured},
};
use crate::{
    glb::Glb,
    picture::scene,
    scenes::{flipped, floor, furnace, lambert, mirror, walls},
};
use glam::Vec3;
use ovtigre_core::settings::Method;
use serde_json::{Value, json};

const GROUP: &str = "Closed rooms";
/// Radiance that walls emit.
const EMISSION: f32 = 1.5;

/// All of them.
pub fn cases() -> Vec<Case> {
    let mut all: Vec<Case> = [0.9, 0.99, 0.999, 0.9999].into_iter().map(diffuse).collect();
    all.push(cost());
    let lossless = [
        ("ideal mirrors", mirror()),
        ("metal of α = 0.001", metal(0.001_f32.sqrt().next_up())),
        ("metal of roughness 0.3", metal(0.3)),
        ("metal of roughness 0.8", metal(0.8)),
        ("plastic of roughness 0.2", plastic(0.2)),
        ("plastic of roughness 0.5", plastic(0.5)),
        ("plastic of roughness 1", plastic(1.0)),
    ];
    all.extend(lossless.iter().cloned().map(|(name, material)| mixed(name, material)));
    all.extend(lossless[2..].iter().cloned().map(|(name, material)| lossless_around_a_lamp(name, material)));
    all
}

/// A metal that loses nothing.
fn metal(roughness: f32) -> Value {
    json!({"pbrMetallicRoughness": {"metallicFactor": 1.0, "roughnessFactor": roughness}})
}

/// What is to be known of a material.
fn note(name: &str) -> &'static str {
    if name.ends_with("0.8") {
        "The weight of a sample is 1 in the mean and varies a little; where hardly anything is absorbed its square grows from reflection to reflection."
    } else {
        ""
    }
}

/// The white default material of glTF: an interface of index 1.5 over a white base.
fn plastic(roughness: f32) -> Value {
    json!({"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": roughness}})
}

fn neumann(reflectance: f32) -> f64 {
    f64::from(EMISSION) / (1.0 - f64::from(reflectance))
}

fn diffuse(reflectance: f32) -> Case {
    // Joins of two walks of n vertices are n²: 10⁴ a sample where ρ = 0.99.
    let methods = if reflectance > 0.99 { &ALL[..2] } else { &ALL[..] };
    let side = if reflectance > 0.9 { 2 } else { 4 };
    Case {
        group: GROUP,
        name: format!("walls of reflectance {reflectance}"),
        stresses: "a Neumann series of spectral radius close to one; roulette; no limit on lengths",
        known: format!("Lₑ / (1 − ρ) = {:.0}, everywhere", neumann(reflectance)),
        note: "",
        trials: mean_is_by(
            methods,
            move || furnace(reflectance, EMISSION),
            &by(Method::Path, side),
            neumann(reflectance),
        ),
    }
}

/// What a path of a room costs, and how much it may be off by, does not grow but in proportion to its length.
fn cost() -> Case {
    let room = |reflectance: f32, budget| {
        let settings = by(Method::Path, 2);
        let scene = scene(&furnace(reflectance, EMISSION), &settings);
        measured(&scene, &settings, budget, neumann(reflectance))
    };
    let mut trials = Vec::new();
    for reflectance in [0.9, 0.99, 0.999, 0.9999] {
        trials.push(Trial::new(format!("rays a path · (1 − ρ), ρ = {reflectance}"), move |budget| {
            let picture = room(reflectance, budget);
            let rays = picture.rays() as f64 / picture.samples() as f64;
            Finding::bound(2.5, rays * (1.0 - f64::from(reflectance)), picture.samples())
        }));
        trials.push(Trial::new(format!("relative error of one path, ρ = {reflectance}"), move |budget| {
            let picture = room(reflectance, budget);
            let (mean, error) = picture.mean();
            Finding::bound(1.3, error / mean * (picture.samples() as f64).sqrt(), picture.samples())
        }));
    }
    Case {
        group: GROUP,
        name: "cost and second moment".to_owned(),
        stresses: "roulette that must not multiply the second moment: a cap of 0.95 on survival has none from ρ = 0.975 on",
        known: "two rays a scattering and 1 / (1 − ρ) scatterings a path: 2; the number of scatterings is geometric: an error of 1, and 1.2 where paths have more than 2¹⁵"
            .to_owned(),
        note: "",
        trials,
    }
}

/// Five walls that lose nothing, and a floor that emits and reflects 0.9: the radiance of the floor alone is a solution.
fn mixed(name: &str, material: Value) -> Case {
    const REFLECTANCE: f32 = 0.9;
    let glb = move || {
        let mut glb = Glb::new();
        for (i, side) in walls(Vec3::splat(-1.0), Vec3::ONE).into_iter().enumerate() {
            let emits = i == 2;
            glb.body(if emits { lambert(REFLECTANCE, EMISSION) } else { material.clone() }, side);
        }
        // Sees nothing but the floor, so that light from the lamps that meets the lens can make every path.
        glb.perspective(Vec3::new(0.1, 0.6, 0.05), Vec3::new(0.05, -1.0, 0.0), 40.0);
        glb.finish()
    };
    Case {
        group: GROUP,
        name: format!("a diffuse floor among {name}"),
        stresses: "walls that must neither gain nor lose: a defect of δ a reflection shows some 50 times",
        known: "Lₑ / (1 − ρ) = 15, as the other walls lose nothing".to_owned(),
        note: note(name),
        trials: mean_is_by(&ALL, glb, &by(Method::Path, 2), neumann(REFLECTANCE)),
    }
}

/// A room that loses nothing around a black lamp: what the lamp emits is what it sees.
fn lossless_around_a_lamp(name: &str, material: Value) -> Case {
    let glb = move || {
        let mut glb = Glb::new();
        for side in walls(Vec3::splat(-1.0), Vec3::ONE) {
            glb.body(material.clone(), side);
        }
        let mut lamp = lambert(0.0, EMISSION);
        lamp["doubleSided"] = json!(true);
        glb.body(lamp, flipped(floor(0.95, 0.7, 0.1, -0.1)));
        glb.perspective(Vec3::new(0.1, 0.6, 0.05), Vec3::new(0.05, -1.0, 0.0), 40.0);
        glb.finish()
    };
    Case {
        group: GROUP,
        name: format!("a lamp in a white room of {name}"),
        stresses: "glossy white walls: with the mix of glTF's appendix B the series diverges; one part in 25 of what is seen absorbs",
        known: "the radiance of the black lamp, 1.5, everywhere".to_owned(),
        note: note(name),
        trials: mean_is_by(&ALL[..2], glb, &by(Method::Path, 4), f64::from(EMISSION)),
    }
}

//! Scenes without light, textures that are all 0 or all 1, alpha in layers, shells in shells.

use super::{
    case::{Case, Trial},
    finding::Finding,
    geometry::sheet,
    picture_trial::{ALL, by, mean_is_by},
};
use crate::{
    glb::Glb,
    picture::{in_environment, rendered, settings},
    scenes::{cuboid, flipped, floor, furnace, glass, lambert, sphere},
    textures::{UVS, png},
};
use glam::Vec3;
use ovtigre_core::settings::{Method, Settings};
use serde_json::json;
use std::f64::consts::PI;

const GROUP: &str = "Nothing, all, and very many";

/// All of them.
pub fn cases() -> Vec<Case> {
    let mut all = vec![
        black("black walls and no light", "products of zeros; choices among nothing", || furnace(0.0, 0.0)),
        black("walls of reflectance 0.8 and no light", "a table of no lights", || furnace(0.8, 0.0)),
        black("lamps of no power", "point, spot, sun and lamp, each of power 0", powerless),
        black("a texture that is black", "emission and base colour times 0", || textured([0, 0, 0, 255])),
    ];
    all.extend([
        white_texture(),
        one_lamp_of_power(),
        opacity(0.0),
        opacity(1.0),
        layers(),
        shells(),
        nested(100),
        nested(16),
    ]);
    all
}

fn black(name: &str, stresses: &'static str, glb: fn() -> Vec<u8>) -> Case {
    let trial = |method: Method| {
        Trial::new(method.name(), move |budget| {
            let settings = Settings { method, ..in_environment(settings(4, 4, 2), 0.0) };
            let picture = rendered(&glb(), &settings, budget.of(4096, 64) as u32);
            let mut finding = Finding::bound(0.0, picture.mean().0, picture.samples());
            finding.invalid = picture.invalid();
            finding
        })
    };
    Case {
        group: GROUP,
        name: name.to_owned(),
        stresses,
        known: "black: exactly 0".to_owned(),
        note: "",
        trials: ALL.map(trial).into(),
    }
}

/// Adds a lamp of every kind, each of a power.
fn lamps(glb: &mut Glb, power: f64) {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let down = || json!({"translation": [0.3, 0.5, 0.2], "rotation": [-half, 0.0, 0.0, half]});
    glb.light(json!({"type": "point", "intensity": power}), down());
    glb.light(json!({"type": "spot", "intensity": power, "spot": {"outerConeAngle": 0.4}}), down());
    glb.light(json!({"type": "directional", "intensity": power}), down());
    let mut lamp = lambert(0.5, 1.0);
    lamp["extensions"]["KHR_materials_emissive_strength"] = json!({"emissiveStrength": power});
    glb.body(lamp, flipped(floor(0.8, 0.3, 0.4, 0.4)));
}

fn powerless() -> Vec<u8> {
    let mut glb = Glb::new();
    glb.body(lambert(0.8, 0.0), flipped(cuboid(Vec3::splat(-1.0), Vec3::ONE)));
    lamps(&mut glb, 0.0);
    glb.perspective(Vec3::new(0.3, -0.2, 0.5), Vec3::new(-1.0, 0.4, -0.7), 70.0);
    glb.finish()
}

/// Lamps without power beside a point light.
fn one_lamp_of_power() -> Case {
    let glb = || {
        let mut glb = Glb::new();
        glb.body(lambert(0.5, 0.0), floor(0.0, 4.0, 0.0, 0.0));
        lamps(&mut glb, 0.0);
        let half = std::f64::consts::FRAC_1_SQRT_2;
        glb.light(
            json!({"type": "directional", "intensity": 2.0}),
            json!({"rotation": [-half, 0.0, 0.0, half]}),
        );
        glb.orthographic(Vec3::new(-0.5, 0.5, -0.5), Vec3::new(-0.5, 0.0, -0.5), 0.5, 0.5);
        glb.finish()
    };
    Case {
        group: GROUP,
        name: "lamps of no power beside a sun".to_owned(),
        stresses: "choices of probability zero among others",
        known: "ρ E / π of the sun alone".to_owned(),
        note: "",
        trials: mean_is_by(&ALL, glb, &by(Method::Path, 4), 0.5 * 2.0 / PI),
    }
}

/// A room whose walls have a texture of one colour, for base colour and emission.
fn textured(texel: [u8; 4]) -> Vec<u8> {
    let mut glb = Glb::new();
    let texture = glb.texture(&png(2, &[texel; 4]), json!({}));
    let mut material = lambert(0.8, 1.0);
    material["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": texture});
    material["emissiveTexture"] = json!({"index": texture});
    let material = glb.material(material);
    for (positions, triangles) in crate::scenes::walls(Vec3::splat(-1.0), Vec3::ONE) {
        let mesh = glb.mesh_with(&positions, &triangles, material, &[("TEXCOORD_0", &UVS, 2)]);
        glb.place(mesh);
    }
    glb.perspective(Vec3::new(0.3, -0.2, 0.5), Vec3::new(-1.0, 0.4, -0.7), 70.0);
    glb.finish()
}

fn white_texture() -> Case {
    Case {
        group: GROUP,
        name: "a texture that is white".to_owned(),
        stresses: "emission and base colour times 1",
        known: "a closed room: Lₑ / (1 − ρ) = 5, everywhere".to_owned(),
        note: "",
        trials: mean_is_by(
            &ALL,
            || textured([255; 4]),
            &by(Method::Path, 4),
            1.0 / (1.0 - f64::from(0.8_f32)),
        ),
    }
}

/// Floor and sun with black sheets of an alpha between, `gap` apart, seen from above.
fn under_sheets(alpha: f32, sheets: u32, gap: f32) -> Vec<u8> {
    let mut glb = Glb::new();
    glb.body(lambert(0.5, 0.0), floor(0.0, 4.0, 0.0, 0.0));
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for i in 1..=sheets {
        let (corners, _) = floor(gap * i as f32, 4.0, 0.1, 0.2);
        let first = positions.len() as u32;
        positions.extend(corners);
        triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    glb.body(sheet(alpha), (positions, triangles));
    let half = std::f64::consts::FRAC_1_SQRT_2;
    glb.light(json!({"type": "directional", "intensity": 2.0}), json!({"rotation": [-half, 0.0, 0.0, half]}));
    glb.orthographic(Vec3::Y * 2.0, Vec3::ZERO, 1.0, 1.0);
    glb.finish()
}

fn opacity(alpha: f32) -> Case {
    let truth = 0.5 * 2.0 / PI * (1.0 - f64::from(alpha)).powi(2);
    let mut trials = mean_is_by(&ALL, move || under_sheets(alpha, 1, 0.1), &by(Method::Path, 4), truth);
    if truth == 0.0 {
        trials = ALL
            .map(|method| {
                Trial::new(method.name(), move |budget| {
                    let settings = Settings { method, ..settings(4, 4, 2) };
                    let picture =
                        rendered(&under_sheets(alpha, 1, 0.1), &settings, budget.of(4096, 64) as u32);
                    Finding::bound(0.0, picture.mean().0, picture.samples())
                })
            })
            .into();
    }
    Case {
        group: GROUP,
        name: format!("opacity {alpha}"),
        stresses: "alpha at its ends, in BLEND",
        known: format!("ρ E / π (1 − α)² = {truth:.6}"),
        note: "",
        trials,
    }
}

fn layers() -> Case {
    let (alpha, sheets) = (5e-5_f32, 10_000);
    let truth = 0.5 * 2.0 / PI * (1.0 - f64::from(alpha)).powi(2 * sheets);
    Case {
        group: GROUP,
        name: "10,000 sheets of alpha 5 · 10⁻⁵".to_owned(),
        stresses: "products of 10,000 factors; a decision a sheet and ray",
        known: format!("ρ E / π (1 − α)²⁰⁰⁰⁰ = {truth:.6}"),
        note: "",
        trials: mean_is_by(
            &ALL,
            move || under_sheets(alpha, sheets as u32, 1e-4),
            &by(Method::Path, 4),
            truth,
        )
        .into_iter()
        .map(|trial| trial.dearer(50.0))
        .collect(),
    }
}

fn in_sky(
    name: String,
    stresses: &'static str,
    note: &'static str,
    glb: impl Fn() -> Vec<u8> + Clone + Send + Sync + 'static,
) -> Case {
    Case {
        group: GROUP,
        name,
        stresses,
        known: "clear glass cannot be seen in a uniform sky: 0.7".to_owned(),
        note,
        trials: mean_is_by(
            &[Method::Path],
            glb,
            &in_environment(by(Method::Path, 4), 0.7),
            f64::from(0.7_f32),
        ),
    }
}

/// Spheres of glass whose inside is hollow, each in the next.
fn shells() -> Case {
    let glb = || {
        let mut glb = Glb::new();
        for i in 0..100 {
            let radius = 1.0 - 0.008 * i as f32;
            glb.body(glass(1.5), sphere(Vec3::ZERO, radius, 24));
            glb.body(glass(1.5), flipped(sphere(Vec3::ZERO, radius - 0.003, 24)));
        }
        glb.perspective(Vec3::new(0.5, 1.0, 4.0), Vec3::ZERO, 20.0);
        glb.finish()
    };
    in_sky(
        "100 shells of glass in each other".to_owned(),
        "hundreds of crossings and reflections a path",
        "",
        glb,
    )
}

/// Solid spheres of glass, each in the next: every one is entered before any is left.
fn nested(count: u32) -> Case {
    let note = if count > 50 {
        "The radiance of what is let in is multiplied by 1.1²⁰⁰, and facets that are not quite a sphere trap it: with roulette against trapped walks from the 2²⁰th reflection on, and not from the 2048th, a walk is still on its way after minutes. Few paths get out and count for very many."
    } else {
        ""
    };
    let glb = move || {
        let mut glb = Glb::new();
        for i in 0..count {
            glb.body(glass(1.1), sphere(Vec3::ZERO, 1.0 - 0.8 * i as f32 / count as f32, 24));
        }
        glb.perspective(Vec3::new(0.5, 1.0, 4.0), Vec3::ZERO, 20.0);
        glb.finish()
    };
    in_sky(
        format!("{count} solids of glass in each other"),
        "η² of every solid that is entered before one is left",
        note,
        glb,
    )
}

//! Weights by recursion are those of all densities written out, over whole pictures.

use glam::Vec3;
use ovtigre_core::settings::{Lens, Method, Settings, Strategy, Weights};
use ovtigre_tests::{
    glb::Glb,
    picture::{Rendered, in_environment, rendered, settings},
    scenes::{cuboid, flipped, floor, glass, lambert, mirror},
    stage::{metal, plastic, room, room_in_parallel, smooth_sphere},
};
use serde_json::{Value, json};

/// Every technique of paths with up to 8 vertices, but those that hit the lens.
fn techniques() -> Vec<Strategy> {
    (2..=8).flat_map(|n| (1..=n).map(move |t| Strategy { s: n - t, t })).collect()
}

/// Asserts that every pixel is the same whether weights come from recursion or from all densities: the samples are the
/// same, so only rounding differs.
fn assert_same_weights(glb: &[u8], settings: &Settings, what: &str) {
    let mut recursive = settings.clone();
    (recursive.method, recursive.bounces) = (Method::Bidirectional, Some(5));
    for weights in [Weights::Balance, Weights::Power] {
        recursive.weights = weights;
        let written_out = Settings { strategies: techniques(), ..recursive.clone() };
        let both = [&recursive, &written_out].map(|s| rendered(glb, s, 16));
        assert_same_values(both, &format!("{what}, {weights:?}"));
    }
}

fn assert_same_values([a, b]: [Rendered; 2], what: &str) {
    let mean = a.mean().0;
    assert!(mean > 0.01, "{what}: there is nothing to compare");
    let [a, b] = [a, b].map(|r| r.picture().planes.remove(0));
    for (i, (a, b)) in a.iter().flatten().zip(b.iter().flatten()).enumerate() {
        let (a, b) = (f64::from(*a), f64::from(*b));
        let off = (a - b).abs();
        assert!(off <= 1e-4 * a + 1e-6 * mean, "{what}, value {i}: {a} and {b}");
    }
}

/// Bodies of every kind of letter.
fn bodies(glb: &mut Glb) {
    smooth_sphere(glb, plastic(0.3), Vec3::new(-0.5, -0.6, 0.3), 0.35);
    smooth_sphere(glb, metal(0.2), Vec3::new(0.5, -0.6, -0.4), 0.35);
    smooth_sphere(glb, glass(1.5), Vec3::new(0.45, -0.2, 0.4), 0.3);
    glb.body(mirror(), cuboid(Vec3::new(-0.8, -0.9, -0.8), Vec3::new(-0.3, 0.4, -0.5)));
    let mut rough = glass(1.3);
    rough["pbrMetallicRoughness"]["roughnessFactor"] = json!(0.4);
    glb.body(rough, cuboid(Vec3::new(-0.1, -0.9, -0.1), Vec3::new(0.2, -0.4, 0.2)));
    let mut mixed = plastic(0.0);
    mixed["pbrMetallicRoughness"]["metallicFactor"] = json!(0.4);
    mixed["extensions"] = json!({"KHR_materials_transmission": {"transmissionFactor": 0.5}});
    glb.body(mixed, cuboid(Vec3::new(-0.2, 0.1, -0.6), Vec3::new(0.3, 0.5, -0.5)));
}

const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;

fn downwards() -> Value {
    json!({"translation": [0.2, 0.8, 0.1], "rotation": [-HALF, 0.0, 0.0, HALF]})
}

fn sun(glb: &mut Glb) {
    let along = json!({"rotation": [-0.3, 0.2, 0.0, 0.93]});
    glb.light(json!({"type": "directional", "intensity": 3.0}), along);
}

fn small() -> Settings {
    settings(12, 10, 2)
}

#[test]
fn of_an_area_light() {
    assert_same_weights(&room(10.0, bodies), &small(), "lamp");
    assert_same_weights(
        &room(10.0, |glb| glb.body(lambert(0.8, 1.0), cuboid(Vec3::splat(-0.4), Vec3::splat(0.2)))),
        &small(),
        "lamps",
    );
}

#[test]
fn of_lights_without_extent() {
    let point = |glb: &mut Glb| {
        bodies(glb);
        glb.light(json!({"type": "point", "intensity": 2.0}), downwards())
    };
    assert_same_weights(&room(0.0, point), &small(), "point");
    let cone =
        json!({"type": "spot", "intensity": 4.0, "spot": {"innerConeAngle": 0.3, "outerConeAngle": 0.8}});
    let spot = |glb: &mut Glb| {
        bodies(glb);
        glb.light(cone, downwards())
    };
    assert_same_weights(&room(0.0, spot), &small(), "spot");
    let shining = |glb: &mut Glb| {
        bodies(glb);
        sun(glb);
    };
    assert_same_weights(&room(0.0, shining), &small(), "sun");
}

#[test]
fn of_a_sky() {
    assert_same_weights(&room(0.0, bodies), &in_environment(small(), 1.0), "sky");
}

/// All lights at once.
fn everything(glb: &mut Glb) {
    bodies(glb);
    sun(glb);
    glb.light(json!({"type": "point", "intensity": 1.0}), downwards());
}

#[test]
fn through_a_lens() {
    let mut settings = in_environment(small(), 0.5);
    settings.lens = Some(Lens { radius: 0.2, focus_distance: 3.0 });
    assert_same_weights(&room(5.0, everything), &settings, "lens");
}

#[test]
fn of_parallel_rays() {
    assert_same_weights(&room_in_parallel(5.0, everything), &in_environment(small(), 0.5), "parallel rays");
}

/// Where every surface is more than diffuse, `caustics` is what is left of `bidirectional` without joints between surfaces: the samples
/// are the same, so only rounding differs.
#[test]
fn of_caustics_are_those_of_its_techniques() {
    let all = glossy_room();
    let mut caustics = Settings { method: Method::Caustics, ..in_environment(small(), 0.5) };
    caustics.bounces = Some(5);
    let mut written_out = Settings { method: Method::Bidirectional, ..caustics.clone() };
    written_out.strategies =
        techniques().into_iter().filter(|one| one.s <= 1 && one.t >= 2 || one.s >= 2 && one.t == 1).collect();
    assert_same_values([&caustics, &written_out].map(|s| rendered(&all, s, 16)), "caustics");
    // And the lens is joined to: without that there is less.
    let from_eye = |one: &Strategy| one.t >= 2;
    written_out.strategies.retain(from_eye);
    written_out.weights = Weights::Balance;
    let less = rendered(&all, &written_out, 16).picture().planes.remove(0);
    assert!(less != rendered(&all, &caustics, 16).picture().planes[0]);
}

/// A closed room of plastic with bodies of every kind, lamps of plastic, a point and a sun.
fn glossy_room() -> Vec<u8> {
    let mut glb = Glb::new();
    glb.body(plastic(0.5), flipped(cuboid(Vec3::splat(-1.0), Vec3::splat(1.0))));
    bodies(&mut glb);
    let mut lamp = plastic(0.4);
    lamp["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
    glb.body(lamp, flipped(floor(0.9, 0.6, 0.1, 0.0)));
    glb.light(json!({"type": "point", "intensity": 1.0}), downwards());
    glb.perspective(Vec3::new(0.0, 0.0, 0.95), Vec3::ZERO, 70.0);
    glb.finish()
}

#[test]
fn of_light_of_every_kind_that_meets_the_lens() {
    let mut settings = in_environment(settings(16, 16, 16), 0.5);
    settings.lens = Some(Lens { radius: 0.6, focus_distance: 3.0 });
    settings.bounces = Some(3);
    let glb = room(5.0, |glb| {
        sun(glb);
        glb.light(json!({"type": "point", "intensity": 1.0}), downwards());
        smooth_sphere(glb, metal(0.4), Vec3::new(0.45, -0.2, 0.4), 0.3);
    });
    let path = rendered(&glb, &settings, 64);
    let to_the_lens = (2..=5).map(|s| Strategy { s, t: 0 });
    settings.method = Method::Bidirectional;
    settings.strategies = techniques().into_iter().chain(to_the_lens).collect();
    for weights in [Weights::Balance, Weights::Power] {
        settings.weights = weights;
        path.assert_same(&rendered(&glb, &settings, 32), 0.005, &format!("{weights:?}"));
    }
}

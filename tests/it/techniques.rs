//! Every technique of a path by itself, their weights, and the terms of the Neumann series.

use glam::Vec3;
use ovtigre_core::settings::{Layer, Lens, Method, Settings, Shows, Strategy, Weights};
use ovtigre_tests::{
    glb::Glb,
    picture::{Rendered, rendered, settings},
    scenes::{flipped, furnace, lambert, sphere},
};

/// A layer for each technique of paths with up to `scatterings`, those that hit the lens included where `first` is 0.
fn techniques(scatterings: u32, first: u32) -> Vec<Strategy> {
    (0..=scatterings).flat_map(|k| (first..=k + 2).map(move |t| Strategy { s: k + 2 - t, t })).collect()
}

fn layer(strategy: Strategy) -> Layer {
    let Strategy { s, t } = strategy;
    Layer { name: format!("s{s}t{t}"), shows: Shows::Strategy(strategy) }
}

fn bounce(k: u32) -> Layer {
    Layer { name: format!("b{k}"), shows: Shows::Paths(format!("L.{{{k}}}E")) }
}

fn with_lens(replicates: u32) -> Settings {
    let mut settings = settings(8, 8, replicates);
    settings.lens = Some(Lens { radius: 0.3, focus_distance: 1.0 });
    settings
}

/// Asserts that the mean of a plane is `truth` within 5 standard errors (16 replicates; some 20 planes are looked at), which
/// must be at most `power` of it.
fn assert_plane(rendered: &Rendered, plane: usize, truth: f64, power: f64, what: &str) {
    let (mean, error) = rendered.mean_of(plane);
    assert!(error <= power * truth, "{what}: the error {error} of {mean} is too large to find a bias");
    assert!((mean - truth).abs() <= 5.0 * error + 1e-5 * truth, "{what}: {mean} ± {error}, not {truth}");
}

/// A closed sphere around the origin whose inside reflects and emits.
fn round_furnace(reflectance: f32, emission: f32) -> Vec<u8> {
    let mut glb = Glb::new();
    let material = glb.material(lambert(reflectance, emission));
    let (positions, triangles) = flipped(sphere(Vec3::ZERO, 1.0, 24));
    let mesh = glb.mesh(&positions, &triangles, material);
    glb.place(mesh);
    glb.perspective(Vec3::new(0.3, -0.2, 0.1), Vec3::new(-1.0, 0.4, -0.7), 70.0);
    glb.finish()
}

#[test]
fn each_technique_alone_makes_its_term_of_the_neumann_series() {
    // A closed room: every path of k scatterings carries Le ρᵏ, whichever way it is made. It is a sphere, where the density
    // of joins is nearly constant: in a corner their squares have no mean.
    let (reflectance, emission) = (0.5, 1.0);
    let strategies = techniques(4, 0);
    let mut settings = with_lens(16);
    settings.method = Method::Bidirectional;
    settings.weights = Weights::Single;
    settings.layers = strategies.iter().copied().map(layer).collect();
    settings.strategies.clone_from(&strategies);
    let picture = rendered(&round_furnace(reflectance, emission), &settings, 256);
    for (i, Strategy { s, t }) in strategies.iter().enumerate() {
        let truth = f64::from(emission) * f64::from(reflectance).powi((s + t - 2) as i32);
        // Light meets the lens by chance: its disk is a small part of the room.
        let power = if *t == 0 { 0.05 } else { 0.02 };
        assert_plane(&picture, i + 1, truth, power, &format!("s = {s}, t = {t}"));
    }
}

#[test]
fn weighted_techniques_add_up_to_the_terms_of_path_tracing() {
    let strategies = techniques(4, 1);
    let glb = furnace(0.6, 1.0);
    for weights in [Weights::Balance, Weights::Power, Weights::Uniform] {
        let mut settings = with_lens(16);
        settings.method = Method::Bidirectional;
        settings.weights = weights;
        settings.layers = strategies.iter().copied().map(layer).chain((0..5).map(bounce)).collect();
        let both = rendered(&glb, &settings, 32);
        for k in 0..5 {
            let of_length = |(_, one): &(usize, &Strategy)| one.s + one.t == k + 2;
            let sum: f64 =
                strategies.iter().enumerate().filter(of_length).map(|(i, _)| both.mean_of(i + 1).0).sum();
            let layer = strategies.len() + 1 + k as usize;
            let (mean, _) = both.mean_of(layer);
            assert!((sum / mean - 1.0).abs() < 1e-5, "{weights:?}, {k} scatterings: {sum} and {mean}");
            assert_plane(
                &both,
                layer,
                0.6_f64.powi(k as i32),
                0.02,
                &format!("{weights:?}, {k} scatterings"),
            );
        }
    }
    let mut settings = with_lens(16);
    settings.layers = (0..5).map(bounce).collect();
    let path = rendered(&glb, &settings, 32);
    for k in 0..5 {
        assert_plane(&path, k + 1, 0.6_f64.powi(k as i32), 0.01, &format!("path, {k} scatterings"));
    }
}

#[test]
fn light_that_meets_the_lens_can_be_weighed_with_the_rest() {
    let strategies = techniques(3, 0);
    let glb = round_furnace(0.6, 1.0);
    for weights in [Weights::Balance, Weights::Power, Weights::Uniform] {
        let mut settings = with_lens(16);
        settings.method = Method::Bidirectional;
        (settings.weights, settings.bounces) = (weights, Some(3));
        settings.strategies.clone_from(&strategies);
        settings.layers = strategies.iter().copied().map(layer).chain((0..4).map(bounce)).collect();
        let picture = rendered(&glb, &settings, 64);
        for k in 0..4 {
            let plane = strategies.len() + 1 + k;
            let what = format!("{weights:?}, {k} scatterings");
            assert_plane(&picture, plane, 0.6_f64.powi(k as i32), 0.015, &what);
        }
        for (i, Strategy { s, t }) in strategies.iter().enumerate() {
            assert!(picture.mean_of(i + 1).0 > 0.0, "{weights:?}: s = {s}, t = {t} is not used");
        }
    }
}

#[test]
fn photons_in_a_closed_sphere_make_the_neumann_series() {
    // A ball around a point of a sphere cuts out a cap of exactly π r², so that gathering has no bias there.
    let mut settings = settings(32, 32, 16);
    settings.method = Method::Photon;
    settings.layers = (0..5).map(bounce).collect();
    let picture = rendered(&round_furnace(0.5, 1.0), &settings, 24);
    assert_plane(&picture, 0, 2.0, 0.002, "all of it");
    for k in 0..5 {
        assert_plane(&picture, k + 1, 0.5_f64.powi(k as i32), 0.005, &format!("{k} scatterings"));
    }
}

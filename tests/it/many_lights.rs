//! The tree over many lights changes which lights are looked for, not the picture.

use ovtigre_core::{
    film::batch::{Batch, Block},
    render::{batch::render, progress::Progress},
    settings::{Method, Settings, Shutter, Strategy, Weights},
};
use ovtigre_tests::{
    lamps::{Hall, lamps, lamps_of_every_kind},
    picture::{Rendered, in_environment, rendered_of, scene, settings},
    textures::png,
};

/// The picture as it is by power, and by a tree.
fn both(glb: &[u8], settings: &Settings, samples: u32) -> [Rendered; 2] {
    let mut prepared = scene(glb, settings);
    prepared.scene.lights = prepared.scene.lights.by_power();
    let by_power = rendered_of(&prepared, settings, samples);
    prepared.scene.lights = prepared.scene.lights.by_tree(&prepared.scene.data);
    [by_power, rendered_of(&prepared, settings, samples)]
}

fn every_kind() -> Vec<u8> {
    // Half of it is dark.
    lamps_of_every_kind(&png(2, &[[255; 4], [0, 0, 0, 255]]))
}

#[test]
fn pictures_by_tree_and_by_power_agree() {
    let glb = lamps(300, Hall::Rooms);
    for (method, samples) in [(Method::Path, 128), (Method::Bidirectional, 32)] {
        let settings = Settings { method, ..settings(32, 18, 16) };
        let [by_power, by_tree] = both(&glb, &settings, samples);
        by_power.assert_same(&by_tree, 0.02, method.name());
    }
}

#[test]
fn of_lamps_of_every_kind_that_move_under_a_sky() {
    let moving = Shutter { open: 0.0, close: 1.0 };
    let sky = Settings { shutter: moving, ..in_environment(settings(32, 18, 16), 0.02) };
    for (method, samples) in [(Method::Path, 128), (Method::Bidirectional, 32)] {
        let settings = Settings { method, ..sky.clone() };
        let [by_power, by_tree] = both(&every_kind(), &settings, samples);
        by_power.assert_same(&by_tree, 0.02, method.name());
    }
}

#[test]
fn weights_by_recursion_are_those_written_out() {
    let techniques = (2..=6).flat_map(|n| (1..=n).map(move |t| Strategy { s: n - t, t })).collect::<Vec<_>>();
    for weights in [Weights::Balance, Weights::Power] {
        let sky = in_environment(settings(32, 18, 4), 0.02);
        let recursive = Settings { method: Method::Bidirectional, weights, bounces: Some(4), ..sky };
        let written_out = Settings { strategies: techniques.clone(), ..recursive.clone() };
        let [[_, a], [_, b]] = [&recursive, &written_out].map(|settings| both(&every_kind(), settings, 4));
        let mean = a.mean().0;
        let [a, b] = [a, b].map(|rendered| rendered.picture().planes.remove(0));
        for (a, b) in a.iter().flatten().zip(b.iter().flatten()) {
            let (a, b) = (f64::from(*a), f64::from(*b));
            assert!((a - b).abs() <= 1e-4 * a + 1e-6 * mean, "{weights:?}: {a} and {b}");
        }
    }
}

#[test]
fn faint_lamps_are_found_beside_bright_ones() {
    let glb = lamps(1000, Hall::Open);
    let settings = settings(32, 18, 16);
    let [by_power, by_tree] = both(&glb, &settings, 16);
    let [power, tree] = [by_power.error().relative, by_tree.error().relative];
    assert!(tree < 0.6 * power, "{tree} by tree, {power} by power");
    assert_eq!(by_tree.invalid(), 0);
}

#[test]
fn threads_do_not_matter() {
    let settings = Settings { method: Method::Bidirectional, ..settings(32, 18, 1) };
    let prepare = || {
        let mut prepared = scene(&lamps(6000, Hall::Rooms), &settings);
        assert!(prepared.scene.lights.are_by_tree());
        prepared.scene.lights = prepared.scene.lights.by_tree(&prepared.scene.data);
        let batch = Batch {
            region: settings.size.frame(),
            replicate: 0,
            block: Block { index: 0, start: 0, count: 2 },
        };
        render(&prepared, &settings, batch, &Progress::new()).expect("not stopped")
    };
    let on = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(prepare);
    assert_eq!(on(1).hash(), on(3).hash());
}

#[test]
fn few_lights_and_parts_of_one_have_no_tree() {
    let settings = settings(4, 4, 1);
    let has_tree = |n, hall, settings: &Settings| scene(&lamps(n, hall), settings).scene.lights.are_by_tree();
    assert!(!has_tree(3, Hall::Open, &settings));
    assert!(!has_tree(300, Hall::OneLamp, &settings));
    assert!(has_tree(300, Hall::Open, &settings));
    let light = Settings { method: Method::Light, ..settings };
    assert!(!has_tree(300, Hall::Open, &light), "there are no next events");
}

//! Path expressions over whole pictures: the lecture's presets, the terms of the series, lights by name.

use glam::{DVec3, Vec3};
use ovtigre_core::{
    gltf::limits::Limits,
    path::expression::presets::preset,
    render::inspect::inspect,
    settings::{FULL, Layer, Method, Settings, Shadows, Shows},
};
use ovtigre_tests::{
    glb::Glb,
    irradiance,
    picture::{Rendered, rendered, settings},
    scenes::{cuboid, floor, glass, lambert, over_floor},
    stage::{metal, room, smooth_sphere},
};
use serde_json::json;
use std::f64::consts::PI;

/// A room with a matt block, a rough metal, clear glass, a lamp and a point light.
fn lecture() -> Vec<u8> {
    room(6.0, |glb| {
        glb.body(lambert(0.8, 0.0), cuboid(Vec3::new(-0.8, -0.99, -0.7), Vec3::new(-0.3, 0.1, -0.2)));
        smooth_sphere(glb, metal(0.3), Vec3::new(0.4, -0.6, -0.4), 0.35);
        smooth_sphere(glb, glass(1.5), Vec3::new(0.1, -0.5, 0.5), 0.3);
        point(glb, DVec3::new(0.6, 0.5, 0.3));
    })
}

fn point(glb: &mut Glb, at: DVec3) {
    let node = json!({"name": "point", "translation": at.to_array()});
    glb.light(json!({"type": "point", "intensity": 2.0}), node);
}

fn small(method: Method, paths: &str, layers: &[String]) -> Settings {
    let mut settings = settings(12, 12, 2);
    (settings.method, settings.paths) = (method, paths.to_owned());
    let layer =
        |(i, paths): (usize, &String)| Layer { name: format!("w{i}"), shows: Shows::Paths(paths.clone()) };
    settings.layers = layers.iter().enumerate().map(layer).collect();
    settings
}

/// Asserts that all layers together are the picture, pixel by pixel: they are made of the same samples, so only rounding
/// differs.
fn assert_sum(rendered: &Rendered, what: &str) {
    let planes = rendered.picture().planes;
    assert!(rendered.mean().0 > 0.01, "{what}: there is nothing to compare");
    for i in 0..planes[0].len() {
        for c in 0..3 {
            let whole = f64::from(planes[0][i][c]);
            let sum: f64 = planes[1..].iter().map(|plane| f64::from(plane[i][c])).sum();
            assert!((sum - whole).abs() <= 1e-4 * whole, "{what}, pixel {i}: {sum}, not {whole}");
        }
    }
    let lit = (1..planes.len()).filter(|plane| rendered.mean_of(*plane).0 > 0.0).count();
    assert!(lit > 1, "{what}: no more than {lit} of the layers shows anything");
}

#[test]
fn all_bounces_together_are_the_picture() {
    let glb = lecture();
    let bounces: Vec<String> =
        (0..=12).map(|k| format!("L.{{{k}}}E")).chain(["L.{13,}E".to_owned()]).collect();
    let caustics = (Method::Caustics, 32);
    for (method, samples) in [(Method::Path, 64), (Method::Light, 64), (Method::Bidirectional, 16), caustics]
    {
        assert_sum(&rendered(&glb, &small(method, FULL, &bounces), samples), &format!("{method:?}"));
    }
}

/// The words of each preset, with up to `long` letters that repeat, and all longer ones.
fn words(name: &str, long: u32) -> Vec<String> {
    let rows = |start: &str, letter: &str| -> Vec<String> {
        let counts = (0..long).map(|k| format!("{{{k}}}")).chain([format!("{{{long},}}")]);
        counts.map(|count| format!("L{start}({letter}){count}E")).collect()
    };
    match name {
        "phong" => vec!["LDE".to_owned(), "LSE".to_owned()],
        "whitted" => [vec!["LE".to_owned()], rows("D", "S_M|S_T"), rows("S", "S_M|S_T")].concat(),
        "cook" => [rows("", "S"), rows("D", "S")].concat(),
        "radiosity" => rows("", "D"),
        "full" => rows("", "D|S"),
        other => panic!("{other}"),
    }
}

#[test]
fn presets_are_the_sums_of_their_words() {
    let glb = lecture();
    for name in ["phong", "whitted", "cook", "radiosity", "full"] {
        let preset = preset(name).unwrap();
        let mut settings = small(Method::Path, preset.paths, &words(name, 4));
        settings.gloss = preset.gloss;
        assert_sum(&rendered(&glb, &settings, 128), name);
    }
}

#[test]
fn a_preset_alone_is_its_layer_of_the_full_picture() {
    let glb = lecture();
    let names = ["phong", "cook", "radiosity"];
    let layers = names.map(|name| preset(name).unwrap().paths.to_owned());
    let both = [(Method::Path, [64, 64]), (Method::Bidirectional, [32, 32]), (Method::Caustics, [64, 64])];
    for (method, samples) in both {
        let full = Settings { replicates: 16, ..small(method, FULL, &layers) };
        let full = rendered(&glb, &full, samples[0]);
        for (i, paths) in layers.iter().enumerate() {
            let alone = Settings { replicates: 16, ..small(method, paths, &[]) };
            let ((a, da), (b, db)) = (rendered(&glb, &alone, samples[1]).mean(), full.mean_of(i + 1));
            let error = da.hypot(db);
            assert!(
                error <= 0.005 * a,
                "{method:?}, {paths}: the error {error} of {a} is too large to find a bias"
            );
            assert!(
                (a - b).abs() <= 4.5 * error,
                "{method:?}, {paths}: {a} alone, {b} as a layer, ± {error}"
            );
        }
    }
}

fn phong(shadows: Shadows) -> Settings {
    Settings { paths: preset("phong").unwrap().paths.to_owned(), shadows, ..settings(4, 4, 16) }
}

#[test]
fn without_shadows_direct_light_is_that_of_lights_that_nothing_blocks() {
    // Right above what is seen, and too high to hide it.
    let screen = floor(0.5, 4.0, 0.0, 0.0);
    let light = DVec3::new(1.0, 2.0, 0.0);
    let (lamp, triangles) = ovtigre_tests::scenes::flipped(floor(2.0, 1.0, 1.0, 0.0));
    let corners: Vec<DVec3> = lamp.iter().map(|p| p.as_dvec3()).collect();
    let scene = |blocked: bool, is_point: bool| {
        over_floor(0.5, |glb| {
            if blocked {
                glb.body(lambert(0.0, 0.0), screen.clone());
            }
            if is_point {
                point(glb, light);
            } else {
                glb.body(lambert(0.0, 3.0), (lamp.clone(), triangles.clone()));
            }
        })
    };
    let of_point = 0.5 / PI * 2.0 * irradiance::of_point(light);
    let of_lamp = 0.5 / PI * 3.0 * irradiance::of_polygon(&corners);
    for (is_point, truth) in [(true, of_point), (false, of_lamp)] {
        for (blocked, shadows) in [(false, Shadows::On), (false, Shadows::Off), (true, Shadows::Off)] {
            let picture = rendered(&scene(blocked, is_point), &phong(shadows), 64);
            picture.assert_mean(truth, 0.002, &format!("{shadows:?}, blocked: {blocked}, point: {is_point}"));
        }
        let (mean, _) = rendered(&scene(true, is_point), &phong(Shadows::On), 64).mean();
        assert_eq!(mean, 0.0, "in the shadow, point: {is_point}");
    }
}

#[test]
fn no_pixel_is_darker_without_shadows() {
    let glb = lecture();
    let [on, off] = [Shadows::On, Shadows::Off].map(|shadows| {
        rendered(&glb, &Settings { size: small(Method::Path, FULL, &[]).size, ..phong(shadows) }, 64)
    });
    let ((dark, a), (bright, b)) = (on.mean(), off.mean());
    assert!(bright - dark > 20.0 * a.hypot(b), "{dark} ± {a} with shadows and {bright} ± {b} without");
    let [on, off] = [on, off].map(|r| r.picture());
    for i in 0..on.planes[0].len() {
        let [dark, bright] = [&on, &off].map(|p| f64::from(p.planes[0][i][0]));
        let error = f64::from(on.errors[0][i][0]).hypot(f64::from(off.errors[0][i][0]));
        assert!(
            bright >= dark - 5.0 * error - 1e-5 * dark,
            "pixel {i}: {dark} with shadows, {bright} without ± {error}"
        );
    }
}

#[test]
fn lights_by_their_names_make_up_the_picture() {
    let glb = lecture();
    let names = inspect(&glb[..], &Limits::default()).unwrap().light_names;
    assert_eq!(names.groups.iter().collect::<Vec<_>>(), ["lamp", "point"]);
    assert!(names.all.is_superset(&names.groups));
    let layers: Vec<String> = names.groups.iter().map(|name| format!("L'{name}'DE")).collect();
    let eye = [(Method::Path, 16), (Method::Caustics, 16), (Method::Photon, 2)];
    for (method, samples) in [(Method::Light, 64), (Method::Bidirectional, 16)].into_iter().chain(eye) {
        let picture = rendered(&glb, &small(method, "LDE", &layers), samples);
        assert_sum(&picture, &format!("{method:?}"));
    }
}

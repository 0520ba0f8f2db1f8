//! Which method is chosen where none is asked for.

use glam::Vec3;
use ovtigre_core::{
    film::batch::{Batch, Block},
    render::{
        batch::render,
        pilot::{
            plan::{Chance, NoPilot, Plan},
            report::Pilot,
            trying::pilot,
        },
        progress::Progress,
    },
    settings::{Layer, Method, Settings, Shows},
};
use ovtigre_tests::{
    glb::Glb,
    picture::{scene, settings},
    program::{Farm, run},
    scenes::{add, cornell, flipped, floor, glass, lambert, sphere, two_rooms},
    showcase::{caustic, lamp_behind_glass},
};
use rayon::prelude::*;
use serde_json::Value;
use std::{fs, path::Path};

fn plan(methods: &[Method], samples: u32) -> Plan {
    plan_of([192, 108], methods, samples)
}

fn plan_of([width, height]: [u32; 2], methods: &[Method], samples: u32) -> Plan {
    let settings = settings(width, height, 4);
    let region = settings.size.frame();
    let (methods, chance) = (methods.to_vec(), Chance::Sometimes);
    Plan {
        settings,
        region,
        samples,
        error_target: None,
        seconds: None,
        triangles: 5000,
        pixels: 0,
        chance,
        methods,
    }
}

fn tried(glb: &[u8], plan: &Plan, threads: usize) -> Pilot {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| pilot(glb, None, plan)).unwrap().0
}

const ALL: [Method; 3] = [Method::Path, Method::Bidirectional, Method::Light];
const THREE: [Method; 3] = [Method::Path, Method::Bidirectional, Method::Caustics];

#[test]
fn each_scene_gets_the_method_that_is_good_at_it() {
    // Jobs of the tables in docs/PERFORMANCE.md.
    let small = Plan { chance: Chance::Never, triangles: 50, ..plan_of([128, 72], &ALL, 64) };
    let found = tried(&two_rooms(), &small, 2);
    assert_eq!(found.method, Method::Bidirectional, "{found:?}");
    let job = |methods: &[Method]| plan_of([480, 270], methods, 256);
    let diffuse = Plan { chance: Chance::Never, ..job(&ALL) };
    let found = tried(&cornell(), &diffuse, 2);
    assert_eq!(found.method, Method::Path, "{found:?}");
    let found = tried(&two_rooms(), &diffuse, 2);
    assert_eq!(found.method, Method::Bidirectional, "{found:?}");
    for (glb, best) in [(caustic(), Method::Caustics), (lamp_behind_glass(), Method::Bidirectional)] {
        let found = tried(&glb, &job(&THREE), 2);
        assert_eq!(found.method, best, "{found:?}");
        assert!(found.share <= 0.02, "{found:?}");
    }
}

#[test]
fn what_is_not_tried_looks_for_light_that_is_met_by_chance() {
    let small = |chance: Chance, methods: &[Method]| Plan { chance, ..plan(methods, 8) };
    assert_eq!(small(Chance::Sometimes, &THREE).untried(), Method::Caustics);
    assert_eq!(small(Chance::Sometimes, &THREE[..2]).untried(), Method::Path);
    assert_eq!(small(Chance::Never, &ALL).untried(), Method::Path);
}

/// A glass ball between a floor and a lamp so large that eye subpaths meet it by chance now and then.
fn under_a_large_lamp() -> Vec<u8> {
    let mut glb = Glb::new();
    add(&mut glb, "floor", lambert(0.7, 0.0), floor(0.0, 4.0, 0.0, 0.0));
    add(&mut glb, "ball", glass(1.5), sphere(Vec3::new(0.0, 0.7, 0.0), 0.5, 24));
    add(&mut glb, "lamp", lambert(0.0, 2.0), flipped(floor(2.5, 1.6, -0.5, 0.0)));
    glb.perspective(Vec3::new(0.0, 2.2, 3.6), Vec3::new(0.3, 0.2, 0.0), 36.0);
    glb.finish()
}

/// Means over the picture of squares of what `of` adds to a pixel, as `by` tells, for each of many samples.
fn squares(glb: &[u8], of: Method, by: Method, bounces: Option<u32>) -> Vec<f64> {
    const ROUNDS: u32 = 2000;
    let layers = vec![Layer { name: "squares".to_owned(), shows: Shows::Squares(of) }];
    let settings = Settings { method: by, layers, bounces, ..settings(24, 16, ROUNDS) };
    let scene = scene(glb, &settings);
    let mean = |replicate: u32| {
        let block = Block { index: 0, start: 0, count: 1 };
        let batch = Batch { region: settings.size.frame(), replicate, block };
        let planes = render(&scene, &settings, batch, &Progress::new()).unwrap().planes;
        let squares = planes[1].iter().flatten();
        squares.map(|square| f64::from(*square)).sum::<f64>() / planes[1].len() as f64
    };
    (0..ROUNDS).into_par_iter().map(mean).collect()
}

#[test]
fn light_that_is_scattered_is_the_picture_without_lamps_that_are_seen_directly() {
    let (glb, both) = (cornell(), [Shows::Paths("L(D|S)+E".to_owned()), Shows::Scattered]);
    for method in [Method::Path, Method::Bidirectional, Method::Light] {
        let layers = both.clone().map(|shows| Layer { name: shows.to_string(), shows }).to_vec();
        let settings = Settings { method, layers, ..settings(32, 32, 1) };
        let block = Block { index: 0, start: 0, count: 4 };
        let batch = Batch { region: settings.size.frame(), replicate: 0, block };
        let planes = render(&scene(&glb, &settings), &settings, batch, &Progress::new()).unwrap().planes;
        assert_eq!(planes[1], planes[2], "{method:?}");
        assert_ne!(planes[0], planes[2], "{method:?}: the lamp is in the picture");
    }
}

/// Its mean, and the standard error of that.
fn mean(of: &[f64]) -> (f64, f64) {
    let count = of.len() as f64;
    let mean = of.iter().sum::<f64>() / count;
    let variance = of.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (count - 1.0);
    (mean, (variance / count).sqrt())
}

/// Two rooms have long paths, so that roulette ends many; of walks from the lights nothing is told of it.
#[test]
fn bidirectional_tells_the_squares_of_what_other_methods_add() {
    let lamp = under_a_large_lamp();
    for (name, glb, of, bounces) in [
        ("two-rooms", &two_rooms(), Method::Path, None),
        ("two-rooms", &two_rooms(), Method::Light, Some(4)),
        ("lamp", &lamp, Method::Path, None),
        ("lamp", &lamp, Method::Caustics, None),
    ] {
        let [(own, e), (told, f)] =
            [of, Method::Bidirectional].map(|by| mean(&squares(glb, of, by, bounces)));
        let sigma = e.hypot(f);
        assert!(sigma < 0.02 * own, "{name} {of:?}: {own} {told} ± {sigma}");
        assert!((own - told).abs() < 4.0 * sigma, "{name} {of:?}: {own} {told} ± {sigma}");
    }
}

#[test]
fn a_pilot_is_the_same_on_any_number_of_threads() {
    let (glb, plan) = (caustic(), plan(&THREE, 64));
    assert_eq!(tried(&glb, &plan, 1), tried(&glb, &plan, 3));
}

#[test]
fn a_pilot_takes_little_of_what_is_asked_for() {
    let (glb, more) = (cornell(), plan(&ALL, 4096));
    let few = Plan { error_target: Some(0.5), ..more.clone() };
    let [few, more] = [few, more].map(|plan| tried(&glb, &plan, 2));
    assert!(few.trials[0].samples < more.trials[0].samples, "a rough picture needs few samples");
    assert!(more.share < 0.02, "{more:?}");
    for (change, why) in [
        (Plan { samples: 4, ..plan(&ALL, 1) }, "too small"),
        (Plan { seconds: Some(0.1), ..plan(&ALL, 4096) }, "too small"),
        (Plan { triangles: 1 << 21, ..plan(&ALL, 1 << 20) }, "reading the scene once more"),
        (Plan { pixels: 1 << 26, ..plan(&ALL, 32) }, "reading the scene once more"),
    ] {
        let refused: NoPilot = pilot(&glb[..], None, &change).unwrap_err();
        assert!(refused.to_string().contains(why), "{refused}");
    }
}

/// The report of a render of 96×54 pixels.
fn report(folder: &Path, name: &str, flags: &[&str]) -> Value {
    let path = |end: &str| folder.join(format!("{name}.{end}")).to_str().unwrap().to_owned();
    let scene = folder.join("scene.glb").to_str().unwrap().to_owned();
    let (picture, report) = (path("exr"), path("json"));
    let common =
        ["--size", "96x54", "--samples", "256", "--workers", "1", "-o", &picture, "--report", &report];
    let done = run([&["render", &scene], &common[..], flags].concat());
    let said = String::from_utf8(done.stderr).unwrap();
    assert!(done.status.success(), "{said}");
    let report: Value = serde_json::from_slice(&fs::read(report).unwrap()).unwrap();
    let line = format!("method: {}, ", report["job"]["method"].as_str().unwrap());
    assert!(said.contains(&line), "{said}");
    report
}

#[test]
fn what_is_chosen_is_what_asking_for_it_gives() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.glb"), caustic()).unwrap();
    let chosen = report(folder.path(), "chosen", &[]);
    let job = &chosen["job"];
    assert_eq!(job["method"], "caustics", "{}", job["pilot"]);
    assert_eq!(job["pilot"]["trials"].as_array().unwrap().len(), 3, "light leaves out paths here");
    assert!(job["method_reason"].as_str().unwrap().contains("path"), "{}", job["method_reason"]);
    let asked = report(folder.path(), "asked", &["--method", "caustics"]);
    assert_eq!((&asked["job"]["method_reason"], &asked["job"]["pilot"]), (&"asked for".into(), &Value::Null));
    let [a, b] = ["chosen.exr", "asked.exr"].map(|name| folder.path().join(name));
    let compared =
        run(["compare".as_ref(), a.as_os_str(), b.as_os_str(), "--tolerance".as_ref(), "0".as_ref()]);
    assert!(compared.status.success(), "{}", String::from_utf8_lossy(&compared.stdout));
}

/// What a job's picture is now: the status of the answer, the size that a preview was made in, and the PNG.
async fn seen(farm: &Farm, id: &str, query: &str) -> (u16, Option<String>, Vec<u8>) {
    let answer = reqwest::get(format!("{}/v1/jobs/{id}/{query}", farm.url)).await.unwrap();
    let preview = answer.headers().get("ovtigre-preview").map(|size| size.to_str().unwrap().to_owned());
    (answer.status().as_u16(), preview, answer.bytes().await.unwrap().to_vec())
}

#[tokio::test(flavor = "multi_thread")]
async fn the_pilot_is_seen_before_the_first_samples() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.glb");
    fs::write(&scene, cornell()).unwrap();
    let farm = Farm::start(&folder.path().join("data"));
    let asked = ["submit", scene.to_str().unwrap(), "--size", "96x96", "--samples", "128"];
    let id = tokio::task::block_in_place(|| farm.client(&asked)).trim().to_owned();
    let job = tokio::task::block_in_place(|| farm.job(&id));
    let size = &job["pilot"]["size"];
    let size = format!("{}x{}", size["width"], size["height"]);
    let (status, preview, png) = seen(&farm, &id, "image.png").await;
    assert_eq!((status, preview.as_deref()), (200, Some(&*size)));
    let preview = image::load_from_memory(&png).unwrap().to_rgb8();
    assert_eq!(preview.dimensions(), (96, 96));
    // A thumbnail of it is as large as one of the picture will be.
    let (_, again, png) = seen(&farm, &id, "image.png?width=40").await;
    assert_eq!(again.as_deref(), Some(&*size));
    let small = image::load_from_memory(&png).unwrap().to_rgb8();
    assert_eq!(small.dimensions(), (32, 32));
    assert_eq!(seen(&farm, &id, "image.exr").await.0, 404, "a preview is no result");
    assert_eq!(seen(&farm, &id, "image.png?layer=error").await.0, 404, "its error is not that of the job");

    let worker = tokio::task::block_in_place(|| farm.worker());
    tokio::task::block_in_place(|| farm.wait(&id, |job| job["state"] == "done"));
    drop(worker);
    let (status, none, png) = seen(&farm, &id, "image.png").await;
    assert_eq!((status, none), (200, None));
    let picture = image::load_from_memory(&png).unwrap().to_rgb8();
    // Both show the same: in blocks of 24 pixels, which are four of the preview's, what is red on the left is red, and green is on the right.
    let block = |image: &image::RgbImage, x: u32| {
        let all = (0..24 * 24).map(|i| image.get_pixel(x + i % 24, 36 + i / 24).0);
        all.fold([0_u32; 3], |sum, pixel| [0, 1, 2].map(|c| sum[c] + u32::from(pixel[c])))
            .map(|sum| sum / 576)
    };
    for x in [0, 36, 72] {
        let (a, b) = (block(&preview, x), block(&picture, x));
        assert!(a.iter().zip(b).all(|(a, b)| a.abs_diff(b) < 12), "at {x}: {a:?} and {b:?}");
        let thumb = (0..64).map(|i| small.get_pixel(x / 3 + i % 8, 12 + i / 8).0);
        let thumb = thumb.fold([0_u32; 3], |sum, pixel| [0, 1, 2].map(|c| sum[c] + u32::from(pixel[c])));
        let thumb = thumb.map(|sum| sum / 64);
        assert!(a.iter().zip(thumb).all(|(a, b)| a.abs_diff(b) < 12), "at {x}: {a:?} and {thumb:?}");
    }
}

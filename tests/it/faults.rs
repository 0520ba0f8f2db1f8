//! Processes die; the picture does not change.

use ovtigre_core::{
    film::exr::{Layers, read_layers},
    settings::{Layer, Method, Settings, Shows, Strategy},
};
use ovtigre_tests::{
    picture::{rendered, scene, settings},
    program::Farm,
    room::room,
    scenes::furnace,
    services::Shared,
};
use std::{fs, path::Path};

/// Samples a pixel, all four replicates together.
const SAMPLES: u32 = 256;
/// Said, as a method would else be chosen.
const BY_PATH: [&str; 2] = ["--method", "path"];

fn plain() -> Settings {
    settings(96, 54, 4)
}

/// What `core` alone says of a scene: the channels of the picture, of its layers and of their errors.
pub(crate) fn undisturbed(glb: &[u8], settings: &Settings, samples: u32) -> Layers {
    let picture = rendered(glb, settings, samples / 4).picture();
    let [width, height] = [picture.size.width, picture.size.height].map(|side| side as usize);
    let mut layers = Layers { width, height, ..Layers::default() };
    let prefixes = [String::new()].into_iter().chain(settings.layers.iter().map(|l| format!("{}.", l.name)));
    for (plane, prefix) in prefixes.enumerate() {
        for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
            let channel = |of: &[[f32; 3]]| of.iter().map(|p| p[c]).collect();
            layers.channels.insert(format!("{prefix}{name}"), channel(&picture.planes[plane]));
            layers.channels.insert(format!("{prefix}error.{name}"), channel(&picture.errors[plane]));
        }
    }
    layers
}

pub(crate) fn submit(
    farm: &Farm,
    folder: &Path,
    glb: &[u8],
    settings: &Settings,
    samples: u32,
    further: &[&str],
) -> String {
    let scene = folder.join("room.glb");
    fs::write(&scene, glb).unwrap();
    let size = format!("{}x{}", settings.size.width, settings.size.height);
    let (path, samples) = (scene.to_str().unwrap(), samples.to_string());
    let arguments = ["submit", path, "--size", &size, "--samples", &samples];
    farm.client(&[&arguments, further].concat()).trim().to_owned()
}

pub(crate) fn fetch(farm: &Farm, job: &str, folder: &Path) -> Layers {
    let file = folder.join("picture.exr");
    farm.client(&["fetch", job, "-o", file.to_str().unwrap()]);
    read_layers(&fs::read(file).unwrap()).unwrap()
}

fn batches(job: &serde_json::Value) -> u64 {
    job["batches_done"].as_u64().unwrap()
}

/// Kills a worker in the middle of a job, lets two others finish it, and asserts that its picture is that of core alone. The
/// job when it is done.
pub(crate) fn assert_worker_may_die(
    glb: &[u8],
    settings: &Settings,
    samples: u32,
    further: &[&str],
) -> serde_json::Value {
    let folder = tempfile::tempdir().unwrap();
    let farm = Farm::start(&folder.path().join("farm"));
    let job = submit(&farm, folder.path(), glb, settings, samples, further);
    let first = farm.worker();
    let then = farm.wait(&job, |j| batches(j) > 0);
    assert_eq!(then["state"], "running", "the job was over before anything could go wrong: {then}");
    first.kill();
    let (_second, _third) = (farm.worker(), farm.worker());
    let done = farm.wait(&job, |j| j["state"] == "done");
    assert_eq!(done["invalid_samples"], 0);
    let picture = fetch(&farm, &job, folder.path());
    assert!(
        picture.channels == undisturbed(glb, settings, samples).channels,
        "the picture differs from that of core alone"
    );
    assert_eq!(picture.attributes["ovtigre.job"], job);
    done
}

#[test]
fn a_killed_worker_and_a_late_one_change_no_byte() {
    assert_worker_may_die(&room(), &plain(), SAMPLES, &BY_PATH);
}

#[test]
fn a_killed_worker_changes_no_byte_of_light_that_any_sample_can_add_to() {
    let mut settings = settings(48, 27, 4);
    settings.method = Method::Bidirectional;
    settings.layers = vec![
        Layer { name: "b2".to_owned(), shows: Shows::Paths("L.{2}E".to_owned()) },
        Layer { name: "C21".to_owned(), shows: Shows::Strategy(Strategy { s: 2, t: 1 }) },
    ];
    let further = ["--method", "bidirectional", "--layer", "b2=L.{2}E", "--layer", "C21=(2,1)"];
    assert_worker_may_die(&room(), &settings, 128, &further);
}

#[test]
fn a_killed_worker_changes_no_byte_of_light_from_the_lights() {
    let settings = Settings { method: Method::Light, ..plain() };
    assert_worker_may_die(&room(), &settings, 2 * SAMPLES, &["--method", "light"]);
}

#[test]
fn a_killed_worker_changes_no_byte_of_photons() {
    let mut settings = settings(48, 27, 4);
    settings.method = Method::Photon;
    settings.layers = vec![Layer { name: "narrow".to_owned(), shows: Shows::Narrow }];
    assert_worker_may_die(&room(), &settings, 2 * SAMPLES, &["--method", "photon"]);
}

#[test]
fn a_killed_worker_changes_no_byte_of_radiosity_nor_its_residuals() {
    // Every worker solves the scene for itself: it is one that needs no more patches where light varies.
    let glb = furnace(0.5, 1.0);
    let mut settings = plain();
    (settings.method, settings.paths) = (Method::Radiosity, "LD*E".to_owned());
    let further = ["--preset", "radiosity", "--method", "radiosity"];
    let done = assert_worker_may_die(&glb, &settings, 2 * SAMPLES, &further);
    let alone = scene(&glb, &settings);
    let report = alone.radiosity.as_ref().unwrap().report();
    assert!(report.residuals.len() > 2 && report.residuals.is_sorted_by(|a, b| a > b), "{report:?}");
    assert_eq!(done["radiosity"], serde_json::to_value(report).unwrap());
}

#[test]
fn a_killed_farm_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("farm");
    let farm = Farm::start(&data);
    let job = submit(&farm, folder.path(), &room(), &plain(), SAMPLES, &BY_PATH);
    let worker = farm.worker();
    let before = farm.wait(&job, |j| batches(j) > 1);
    farm.kill();
    drop(worker);
    let farm = Farm::start(&data);
    // Nobody works yet: what is there comes from the farm's memory.
    farm.wait(&job, |j| batches(j) >= batches(&before));
    let _worker = farm.worker();
    farm.wait(&job, |j| j["state"] == "done");
    let picture = fetch(&farm, &job, folder.path());
    assert!(
        picture.channels == undisturbed(&room(), &plain(), SAMPLES).channels,
        "the picture differs from that of core alone"
    );
}

/// Two farms over one database and one bucket: workers and one of the farms are killed, another comes, and the picture is
/// that of core alone. `dies` is the number of the farm that is killed.
fn assert_a_server_may_die(name: &str, dies: usize) {
    let Some(shared) = Shared::place(name) else { return };
    let folder = tempfile::tempdir().unwrap();
    let server = |n: usize| Farm::start_with(&folder.path().join(format!("farm-{n}")), &shared.flags());
    let mut farms = vec![server(0), server(1)];
    let job = submit(&farms[0], folder.path(), &room(), &plain(), SAMPLES, &BY_PATH);
    let (first, _second) = (farms[0].worker(), farms[1].worker());
    let then = farms[1].wait(&job, |j| batches(j) > 0);
    first.kill();
    assert_eq!(then["state"], "running", "the job was over before anything could go wrong: {then}");
    farms.remove(dies).kill();
    farms.push(server(2));
    let (_third, _fourth) = (farms[0].worker(), farms[1].worker());
    let expected = undisturbed(&room(), &plain(), SAMPLES).channels;
    for farm in &farms {
        let done = farm.wait(&job, |j| j["state"] == "done");
        assert_eq!((&done["invalid_samples"], &done["batches_done"]), (&0.into(), &done["batches_asked"]));
        let picture = fetch(farm, &job, folder.path());
        assert!(picture.channels == expected, "the picture differs from that of core alone");
    }
}

#[test]
fn a_killed_server_that_took_the_job_changes_no_byte() {
    assert_a_server_may_die("took", 0);
}

#[test]
fn a_killed_server_that_others_worked_for_changes_no_byte() {
    assert_a_server_may_die("other", 1);
}

//! Processes die; the picture does not change.

use ovtigre_core::film::exr::{Layers, read_layers};
use ovtigre_tests::{
    picture::{rendered, settings},
    program::Farm,
    room::room,
};
use std::{fs, path::Path};

const SAMPLES: u32 = 256;

/// What `core` alone says of the room at 96×54: the picture's channels and its error's.
fn undisturbed() -> Layers {
    let picture = rendered(&room(), &settings(96, 54, 4), SAMPLES / 4).picture();
    let error = picture.errors.first().expect("four replicates");
    let mut layers = Layers { width: 96, height: 54, ..Layers::default() };
    for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
        layers.channels.insert(name.to_owned(), picture.planes[0].iter().map(|p| p[c]).collect());
        layers.channels.insert(format!("error.{name}"), error.iter().map(|p| p[c]).collect());
    }
    layers
}

fn submit(farm: &Farm, folder: &Path) -> String {
    let scene = folder.join("room.glb");
    fs::write(&scene, room()).unwrap();
    let samples = SAMPLES.to_string();
    let path = scene.to_str().unwrap();
    farm.client(&["submit", path, "--size", "96x54", "--samples", &samples]).trim().to_owned()
}

fn fetch(farm: &Farm, job: &str, folder: &Path) -> Layers {
    let file = folder.join("picture.exr");
    farm.client(&["fetch", job, "-o", file.to_str().unwrap()]);
    read_layers(&fs::read(file).unwrap()).unwrap()
}

fn batches(job: &serde_json::Value) -> u64 {
    job["batches_done"].as_u64().unwrap()
}

#[test]
fn a_killed_worker_and_a_late_one_change_no_byte() {
    let folder = tempfile::tempdir().unwrap();
    let farm = Farm::start(&folder.path().join("farm"));
    let job = submit(&farm, folder.path());
    let first = farm.worker();
    let then = farm.wait(&job, |j| batches(j) > 0);
    assert_eq!(then["state"], "running", "the job was over before anything could go wrong: {then}");
    first.kill();
    let (_second, _third) = (farm.worker(), farm.worker());
    let done = farm.wait(&job, |j| j["state"] == "done");
    assert_eq!(done["invalid_samples"], 0);
    let picture = fetch(&farm, &job, folder.path());
    assert!(picture.channels == undisturbed().channels, "the picture differs from that of core alone");
    assert_eq!(picture.attributes["ovtigre.job"], job);
}

#[test]
fn a_killed_farm_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("farm");
    let farm = Farm::start(&data);
    let job = submit(&farm, folder.path());
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
    assert!(picture.channels == undisturbed().channels, "the picture differs from that of core alone");
}

//! Samples go where they lessen the error more: the picture is the same in the mean, and the same to the bit whoever renders it.

use crate::faults::{assert_worker_may_die, fetch, submit, undisturbed};
use ovtigre::fail_point::FailPoint;
use ovtigre_core::settings::{Distribution, Settings};
use ovtigre_proto::{client::farm::Client, job::JobPatch};
use ovtigre_tests::{
    picture::{rendered_of, scene, settings},
    program::Farm,
    room::room,
    scenes::cornell,
    services::Shared,
    tended::Tended,
};
use serde_json::Value;
use sqlx::{Connection as _, SqliteConnection};
use std::{fs, path::Path, thread::sleep, time::Duration};

/// Samples a pixel, all four replicates together: a quarter of them are drawn before it is decided where the others go.
const SAMPLES: u32 = 256;
const FLAGS: [&str; 4] = ["--method", "path", "--sampling", "adaptive"];

fn adaptive() -> Settings {
    Settings { sampling: Distribution::Adaptive, ..settings(64, 36, 4) }
}

#[test]
fn adaptive_pictures_have_the_means_of_uniform_ones_and_less_error() {
    for (name, glb) in [("room", room()), ("cornell", cornell())] {
        let uniform = settings(64, 64, 16);
        let scene = scene(&glb, &uniform);
        let plain = rendered_of(&scene, &uniform, 64);
        let seed = 1;
        let adaptive = Settings { sampling: Distribution::Adaptive, seed, ..uniform };
        let adaptive = rendered_of(&scene, &adaptive, 64);
        adaptive.assert_same(&plain, 0.01, name);
        let [a, b] = [&adaptive, &plain].map(|done| done.error().relative);
        assert!(a < b, "{name}: {a} is no less than {b}");
        let [a, b] = [adaptive.samples(), plain.samples()];
        assert_eq!(a, b, "{name}");
    }
}

#[test]
fn a_killed_worker_changes_no_byte_of_an_adaptive_picture() {
    let done = assert_worker_may_die(&room(), &adaptive(), SAMPLES, &FLAGS);
    let shares = |half: usize| done["allocations"][half]["shares"].as_str().unwrap().to_owned();
    assert_eq!(shares(0).len(), 4 * 3, "tiles of 16x16 pixels");
    assert_ne!(shares(0), "H".repeat(12), "all tiles are alike");
    assert_ne!(shares(0), shares(1), "each half decides for the other");
}

/// Blocks are of 16, 16, 32 … samples of each replicate: it is decided at the first checkpoint.
#[test]
fn a_server_may_die_before_and_after_it_has_decided() {
    let settings = adaptive();
    let expected = undisturbed(&room(), &settings, SAMPLES);
    for point in [
        FailPoint::CheckpointBeforeRow,
        FailPoint::CheckpointAfterRow,
        FailPoint::PrefixAfterRow,
        FailPoint::EndBeforeResult,
        FailPoint::EndAfterResult,
    ] {
        let place = format!("{}:1", point.name());
        let folder = tempfile::tempdir().unwrap();
        let flags = ["--partials-kept", "2", "--reserve", "0"];
        let farm = Tended::start(&folder.path().join("farm"), &flags, &[], Some(&place));
        let _worker = farm.worker();
        let file = folder.path().join("scene.glb");
        fs::write(&file, room()).unwrap();
        let samples = SAMPLES.to_string();
        let job = ["submit", file.to_str().unwrap(), "--size", "64x36", "--samples", &samples];
        let job = farm.client(&[&job[..], &FLAGS].concat()).trim().to_owned();
        farm.settle(&place);
        assert_eq!(farm.deaths(), 1, "{place}: the server never got there");
        let picture = folder.path().join("picture.exr");
        farm.client(&["fetch", &job, "-o", picture.to_str().unwrap()]);
        let picture = ovtigre_core::film::exr::read_layers(&fs::read(picture).unwrap()).unwrap();
        assert!(
            picture.channels == expected.channels,
            "{place}: the picture differs from that of core alone"
        );
    }
}

#[test]
fn two_servers_render_an_adaptive_picture_together() {
    let Some(shared) = Shared::place("adaptive") else { return };
    let folder = tempfile::tempdir().unwrap();
    let server = |n: usize| Farm::start_with(&folder.path().join(format!("farm-{n}")), &shared.flags());
    let farms = [server(0), server(1)];
    let job = submit(&farms[0], folder.path(), &room(), &adaptive(), SAMPLES, &FLAGS);
    let _workers = [farms[0].worker(), farms[1].worker()];
    let expected = undisturbed(&room(), &adaptive(), SAMPLES).channels;
    for farm in &farms {
        farm.wait(&job, |j| j["state"] == "done");
        assert!(fetch(farm, &job, folder.path()).channels == expected, "it differs from that of core alone");
    }
}

#[test]
fn more_samples_for_an_adaptive_picture_keep_its_allocations() {
    let folder = tempfile::tempdir().unwrap();
    let farm = Farm::start(&folder.path().join("farm"));
    let job = submit(&farm, folder.path(), &room(), &adaptive(), SAMPLES, &FLAGS);
    let _worker = farm.worker();
    let before = farm.wait(&job, |j| j["state"] == "done")["allocations"].clone();
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let more = JobPatch { samples: Some(2 * SAMPLES), ..JobPatch::default() };
    runtime.block_on(Client::new(&farm.url, 1).unwrap().change(&job.parse().unwrap(), &more)).unwrap();
    let after =
        farm.wait(&job, |j| j["state"] == "done" && j["samples_done"] == 512.0)["allocations"].clone();
    assert!(before.is_array() && before == after);
    let picture = fetch(&farm, &job, folder.path());
    let at_once = undisturbed(&room(), &adaptive(), 2 * SAMPLES);
    assert!(picture.channels == at_once.channels, "it differs from one with all samples asked for at once");
}

/// Makes the one job of a farm that is not there an hour older.
fn age(data: &Path) {
    let runtime = tokio::runtime::Runtime::new().unwrap();
    runtime.block_on(async {
        let database = data.join("farm.sqlite");
        let mut database = SqliteConnection::connect(database.to_str().unwrap()).await.unwrap();
        let jobs = "UPDATE job SET started_ms = started_ms - 3600000";
        assert_eq!(sqlx::query(jobs).execute(&mut database).await.unwrap().rows_affected(), 1);
        database.close().await.unwrap();
    });
}

/// The server dies before it has written how samples are allocated, and comes back after the job's time is over: the job ends
/// with a row of the curve that is like that of a decision, but nothing was decided.
#[test]
fn a_job_that_ended_before_it_was_decided_is_decided_when_it_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("farm");
    let place = format!("{}:1", FailPoint::CheckpointBeforeRow.name());
    let farm = Farm::start_among(&[("OVTIGRE_FAIL_POINT", &place)], &data, &[]);
    let worker = farm.worker();
    let flags = [&FLAGS[..], &["--seconds", "3600"]].concat();
    let job = submit(&farm, folder.path(), &room(), &adaptive(), SAMPLES, &flags);
    farm.died();
    drop(worker);
    age(&data);
    let farm = Farm::start(&data);
    let done = farm.wait(&job, |job| job["state"] == "done");
    assert_eq!((&done["samples_done"], &done["allocations"]), (&64.0.into(), &Value::Null), "{done}");
    // It asks at once.
    let _worker = farm.worker();
    while farm.client(&["workers"]).lines().count() < 3 {
        sleep(Duration::from_millis(20));
    }
    let runtime = tokio::runtime::Runtime::new().unwrap();
    let more = JobPatch { samples: Some(2 * SAMPLES), ..JobPatch::default() };
    runtime.block_on(Client::new(&farm.url, 1).unwrap().change(&job.parse().unwrap(), &more)).unwrap();
    let done = farm.wait(&job, |job| job["state"] == "done");
    assert_eq!(done["samples_done"], 512.0, "{done}");
    assert!(done["allocations"].is_array(), "{done}");
    let workers = farm.client(&["workers", "--json"]);
    assert_eq!(workers.matches("\"failures\":").count(), 2, "{workers}");
    assert_eq!(
        workers.replace(' ', "").matches("\"failures\":0").count(),
        2,
        "a worker is blamed: {workers}"
    );
    let expected = undisturbed(&room(), &adaptive(), 2 * SAMPLES).channels;
    assert!(fetch(&farm, &job, folder.path()).channels == expected, "it differs from that of core alone");
}

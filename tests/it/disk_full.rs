//! The disk fills, and has room again; the picture does not change.

use crate::faults::undisturbed;
use ovtigre_core::{
    film::exr::read_layers,
    settings::{Distribution, Settings},
};
use ovtigre_tests::{
    picture::settings,
    program::{Farm, run},
    room::room,
};
use std::{
    fs::{self, File},
    io::Write as _,
    path::Path,
    time::Duration,
};

/// Writes a file until `left` bytes or fewer are free on its disk.
fn fill(file: &Path, left: u64) {
    let mut filler = File::create(file).unwrap();
    let free = || ovtigre::serve::free_bytes(file.parent().unwrap()).unwrap();
    while free() > left {
        let piece = vec![1; (free() - left).clamp(1, 1 << 16) as usize];
        if filler.write_all(&piece).is_err() {
            return;
        }
    }
}

/// Fills a disk of 8 MiB to the last byte while a job is rendered, makes room again, and asserts that its picture is that of
/// core alone. What the farm does while it is full is told by `reserve` GiB.
#[expect(clippy::print_stderr, reason = "says what is skipped")]
fn assert_survives_a_full_disk(reserve: &str, side: u32, samples: u32, sampling: Distribution) {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("farm");
    let Some(farm) = Farm::start_on_a_disk(&data, 8, &["--reserve", reserve]) else {
        eprintln!(
            "==== SKIPPED: tests with a full disk (needs a user that may mount one with `unshare -rm`)"
        );
        return;
    };
    let inside = farm.root().join(data.strip_prefix("/").unwrap());
    let (scene, filler) = (folder.path().join("scene.glb"), inside.join("filler"));
    fs::write(&scene, room()).unwrap();
    let (size, count) = (format!("{side}x{side}"), samples.to_string());
    let sampled = if sampling.is_uniform() { "uniform" } else { "adaptive" };
    let what = ["--size", &size, "--samples", &count, "--sampling", sampled];
    let how = ["--bounces", "2", "--method", "path"];
    let submit = [&["submit", scene.to_str().unwrap()], &what[..], &how[..]].concat();
    let job = farm.client(&submit).trim().to_owned();
    let worker = farm.worker();
    let then = farm.wait(&job, |job| job["batches_done"].as_u64().unwrap() > 0);
    assert_eq!(then["state"], "running", "the job was over before the disk was full: {then}");
    fill(&filler, 0);
    std::thread::sleep(Duration::from_secs(2));
    // Nobody is lied to while it is full.
    let refused = run(submit.iter().copied().chain(["--server", &farm.url]));
    assert!(!refused.status.success(), "{}", String::from_utf8_lossy(&refused.stdout));
    let during = farm.job(&job);
    assert!(during["state"] == "running", "{during}");
    worker.kill();
    fs::remove_file(&filler).unwrap();
    let _worker = farm.worker();
    let done = farm.wait(&job, |job| job["state"] == "done");
    assert_eq!((&done["invalid_samples"], &done["batches_done"]), (&0.into(), &done["batches_asked"]));
    let file = folder.path().join("picture.exr");
    farm.client(&["fetch", &job, "-o", file.to_str().unwrap()]);
    let picture = read_layers(&fs::read(file).unwrap()).unwrap();
    let wish = Settings { bounces: Some(2), sampling, ..settings(side, side, 4) };
    let expected = undisturbed(&room(), &wish, samples);
    assert!(picture.channels == expected.channels, "the picture differs from that of core alone");
}

#[test]
fn a_full_disk_without_a_reserve_changes_no_byte() {
    assert_survives_a_full_disk("0", 8, 4 * 2048, Distribution::Uniform);
}

#[test]
fn a_full_disk_with_a_reserve_changes_no_byte() {
    assert_survives_a_full_disk("0.002", 8, 4 * 2048, Distribution::Uniform);
}

#[test]
fn a_full_disk_changes_no_byte_of_an_adaptive_picture() {
    assert_survives_a_full_disk("0", 24, 4 * 256, Distribution::Adaptive);
}

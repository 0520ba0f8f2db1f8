//! A farm is copied while it works: the copy goes on, and its pictures are the same.

use crate::faults::undisturbed;
use ovtigre_core::film::exr::read_layers;
use ovtigre_tests::{
    picture::settings,
    program::{Farm, run},
    room::room,
};
use sqlx::{AssertSqlSafe, Connection as _, SqliteConnection};
use std::{fs, io, path::Path};

/// Samples a pixel, all four replicates together.
const SAMPLES: u32 = 256;

/// The database as it is at one moment, as `docs/OPERATING.md` says.
fn copy_database(from: &Path, to: &Path) {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
    runtime.block_on(async {
        let mut database = SqliteConnection::connect(from.to_str().unwrap()).await.unwrap();
        let copy = AssertSqlSafe(format!("VACUUM INTO '{}'", to.display()));
        sqlx::query(copy).execute(&mut database).await.unwrap();
        database.close().await.unwrap();
    });
}

/// Copies a folder whose files come and go.
fn copy_files(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).into_iter().flatten().flatten() {
        let (path, copy) = (entry.path(), to.join(entry.file_name()));
        if path.is_dir() {
            copy_files(&path, &copy);
        } else if let Err(error) = fs::copy(&path, &copy) {
            assert_eq!(error.kind(), io::ErrorKind::NotFound, "{}: {error}", path.display());
        }
    }
}

#[test]
fn a_copy_that_was_made_while_the_farm_worked_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let (data, copy) = (folder.path().join("farm"), folder.path().join("copy"));
    let farm = Farm::start(&data);
    let scene = folder.path().join("room.glb");
    fs::write(&scene, room()).unwrap();
    let submit = |samples: u32| {
        let samples = samples.to_string();
        let flags = ["--size", "96x54", "--samples", &samples, "--method", "path"];
        farm.client(&[&["submit", scene.to_str().unwrap()], &flags[..]].concat()).trim().to_owned()
    };
    let worker = farm.worker();
    let first = submit(16);
    farm.wait(&first, |job| job["state"] == "done");
    let second = submit(SAMPLES);
    let then = farm.wait(&second, |job| job["batches_done"].as_u64().unwrap() > 2);
    assert_eq!(then["state"], "running", "the job was over before it was copied: {then}");
    fs::create_dir(&copy).unwrap();
    copy_database(&data.join("farm.sqlite"), &copy.join("farm.sqlite"));
    copy_files(&data.join("blobs"), &copy.join("blobs"));
    worker.kill();
    farm.kill();

    let check = |data: &Path| run(["serve", "--check", "--data", data.to_str().unwrap()]);
    let said = check(&copy);
    assert!(said.status.success(), "{said:?}");
    let farm = Farm::start(&copy);
    let worker = farm.worker();
    farm.wait(&second, |job| job["state"] == "done");
    for (job, samples) in [(&first, 16), (&second, SAMPLES)] {
        let file = folder.path().join("picture.exr");
        farm.client(&["fetch", job, "-o", file.to_str().unwrap()]);
        let picture = read_layers(&fs::read(&file).unwrap()).unwrap();
        let expected = undisturbed(&room(), &settings(96, 54, 4), samples);
        assert!(picture.channels == expected.channels, "the picture differs from that of core alone");
    }
    worker.kill();
    farm.kill();

    let picture = fs::read_dir(copy.join("blobs/jobs").join(&first)).unwrap().flatten();
    let picture = picture.map(|entry| entry.path()).find(|path| path.extension().is_some_and(|e| e == "exr"));
    fs::write(picture.unwrap(), "no picture").unwrap();
    let said = check(&copy);
    let lines = String::from_utf8_lossy(&said.stdout).into_owned();
    assert_eq!(said.status.code(), Some(4), "{lines}");
    assert!(
        lines.starts_with(&format!("lost: job {first}: its picture")) && lines.lines().count() == 1,
        "{lines}"
    );
}

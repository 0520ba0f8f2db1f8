//! The server dies between any two steps that have to be one; the picture does not change.

use crate::faults::undisturbed;
use ovtigre::fail_point::FailPoint;
use ovtigre_core::{
    film::exr::{Layers, read_layers},
    settings::Settings,
};
use ovtigre_proto::status::JobState;
use ovtigre_tests::{picture::settings, room::room, services::Shared, tended::Tended};
use std::{
    fs,
    sync::atomic::{AtomicUsize, Ordering},
    time::{Duration, Instant},
};

/// Samples a pixel, all four replicates together: three blocks of each, and as many checkpoints, the last at the end.
const SAMPLES: u32 = 4 * 1024;
/// Longest wait for a server to get where it dies.
const PATIENCE: Duration = Duration::from_mins(1);
/// Deaths at a time.
const AT_A_TIME: usize = 4;

/// A place, and at which of the times that the server gets there it dies.
type Death = (FailPoint, u32);

/// Where batches come by again and again, a later time is tried, too.
fn later(point: FailPoint) -> Option<Death> {
    let time = match point {
        FailPoint::GroupBeforeCommit | FailPoint::GroupAfterCommit => 7,
        FailPoint::SumAfterBlob | FailPoint::SumAfterRow => 11,
        FailPoint::PrefixAfterBlob
        | FailPoint::PrefixAfterRow
        | FailPoint::CheckpointBeforeRow
        | FailPoint::CheckpointAfterRow => 3,
        FailPoint::PartialsBetween => 5,
        _ => return None,
    };
    Some((point, time))
}

fn wish() -> Settings {
    Settings { bounces: Some(2), ..settings(4, 4, 4) }
}

/// Lets the server die once, lets it go on, and asserts that nothing can be seen of it.
fn assert_survived((point, time): Death, flags: &[&str], expected: &Layers) {
    let place = format!("{}:{time}", point.name());
    let folder = tempfile::tempdir().unwrap();
    let flags: Vec<&str> = [flags, &["--partials-kept", "2", "--reserve", "0"]].concat();
    let farm = Tended::start(&folder.path().join("farm"), &flags, &[], Some(&place));
    let _worker = farm.worker();
    let file = folder.path().join("scene.glb");
    fs::write(&file, room()).unwrap();
    let samples = SAMPLES.to_string();
    farm.client(&[
        "submit",
        file.to_str().unwrap(),
        "--size",
        "4x4",
        "--method",
        "path",
        "--bounces",
        "2",
        "--samples",
        &samples,
    ]);
    // What is left over is removed after the last row is written.
    let begun = Instant::now();
    while farm.deaths() == 0 && begun.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(20));
    }
    assert_eq!(farm.deaths(), 1, "{place}: the server never got there");
    let jobs = farm.settle(&place);
    assert!(!jobs.is_empty(), "{place}");
    for job in jobs {
        assert_eq!(job.state, JobState::Done, "{place}: {job:?}");
        assert_eq!((job.batches_done, job.invalid_samples), (job.batches_asked, 0), "{place}");
        assert_eq!(job.samples_done, f64::from(SAMPLES), "{place}");
        let picture = folder.path().join("picture.exr");
        farm.client(&["fetch", job.id.as_str(), "-o", picture.to_str().unwrap()]);
        let picture = read_layers(&fs::read(picture).unwrap()).unwrap();
        assert!(
            picture.channels == expected.channels,
            "{place}: the picture differs from that of core alone"
        );
    }
    assert_eq!(farm.deaths(), 1, "{place}: the server died again");
}

/// All of `deaths`, some at a time.
fn assert_all_survived(deaths: &[Death], flags: &(dyn Fn(usize) -> Vec<String> + Sync)) {
    let expected = undisturbed(&room(), &wish(), SAMPLES);
    let next = AtomicUsize::new(0);
    std::thread::scope(|threads| {
        for _ in 0..AT_A_TIME {
            threads.spawn(|| {
                while let n = next.fetch_add(1, Ordering::Relaxed)
                    && let Some(death) = deaths.get(n)
                {
                    let flags = flags(n);
                    let flags: Vec<&str> = flags.iter().map(String::as_str).collect();
                    assert_survived(*death, &flags, &expected);
                }
            });
        }
    });
}

#[test]
fn a_server_may_die_at_any_step_over_files() {
    let points = FailPoint::ALL.iter().copied().filter(|point| *point != FailPoint::SumHanded);
    let deaths: Vec<Death> = points.flat_map(|point| [Some((point, 1)), later(point)]).flatten().collect();
    assert_all_survived(&deaths, &|_| Vec::new());
}

#[test]
fn a_server_may_die_at_any_step_over_a_database_and_a_bucket() {
    if Shared::place("die").is_none() {
        return;
    }
    let deaths: Vec<Death> = FailPoint::ALL.iter().map(|point| (*point, 1)).collect();
    assert_all_survived(&deaths, &|n| {
        let shared = Shared::place(&format!("die_{n}")).expect("it was there before");
        shared.flags().map(str::to_owned).to_vec()
    });
}

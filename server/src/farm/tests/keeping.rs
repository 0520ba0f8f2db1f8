//! What goes when it is not needed any more, and what never does.

use super::bench::{Bench, Spread, inspect, rules};
use crate::{
    blobs::{BlobError, BlobName, Blobs},
    farm::{
        Farm,
        error::FarmError,
        keep::{Kept, Left},
        rules::Rules,
    },
    store::{
        row::BatchKey,
        sql::{Sql, schema::schema},
    },
};
use bytes::Bytes;
use ovtigre_proto::{
    id::{BlobId, JobId},
    job::{JobPatch, JobRequest},
    pair::EnvironmentRequest,
    status::JobState,
    telemetry::traces::Traces,
};
use std::{
    fs,
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU32, Ordering},
    },
    time::{Duration, SystemTime},
};

async fn done(bench: &Bench) -> JobId {
    let job = bench.job(4, |_| ()).await;
    bench.work(&bench.worker().await, Spread::Noisy).await;
    bench.until_settled(&job, JobState::Done).await;
    tokio::time::sleep(Duration::from_millis(3)).await;
    job
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_that_take_up_too_much_go_the_longest_over_first() {
    let bench = Bench::new(rules()).await;
    let waiting = bench.job(4, |r| r.priority = Some(-9)).await;
    let pause = JobPatch { state: Some(JobState::Paused), ..JobPatch::default() };
    bench.farm.patch(&waiting, &pause, None).await.unwrap();
    let mut jobs = Vec::new();
    for _ in 0..4 {
        jobs.push(done(&bench).await);
    }
    let mut sizes = Vec::new();
    for job in &jobs {
        sizes.push(bench.farm.blobs.bytes_of(job).await.unwrap());
    }
    assert!(sizes.iter().all(|bytes| *bytes > 1000), "{sizes:?}");
    let there = async |bench: &Bench| {
        let mut there = Vec::new();
        for job in jobs.iter().chain([&waiting]) {
            let is_there = bench.farm.status(job).await.is_ok();
            assert!(is_there || bench.files(job).is_empty(), "{job}");
            there.push(is_there);
        }
        there
    };
    let mut bench = bench;
    for (bytes, expected) in [
        (sizes.iter().sum::<u64>(), [true, true, true, true, true]),
        (sizes[2] + sizes[3], [false, false, true, true, true]),
        (sizes[3] * 2 - 1, [false, false, false, true, true]),
        (0, [false, false, false, false, true]),
    ] {
        bench.rules.kept = Kept { time: None, bytes: Some(bytes) };
        bench = bench.crash().await;
        // The farm itself, and other servers, may look at the same moment: what fits stays all the same.
        let looks = (0..8).map(|_| bench.farm.forget_old());
        for left in futures::future::join_all(looks).await {
            assert_eq!(left.unwrap(), Left::Nothing);
        }
        assert_eq!(there(&bench).await, expected, "{bytes} of {sizes:?}");
        let kept = bench.farm.store.kept_jobs(1).await.unwrap();
        assert!(kept.first().map_or(0, |job| job.with_later) <= bytes);
    }
}

async fn has(farm: &Farm, id: &BlobId) -> bool {
    let bytes = match farm.blobs.size(&BlobName::Scene(id.clone())).await {
        Err(BlobError::Missing(_)) => false,
        there => there.map(|_| true).unwrap(),
    };
    let row = farm.store.scene(id).await.unwrap().is_some();
    assert_eq!(bytes, row, "{id}: bytes and row go together");
    row
}

#[tokio::test(flavor = "multi_thread")]
async fn files_go_when_the_last_job_that_needs_them_does() {
    let mut bench = Bench::new(Rules { unused: Duration::from_hours(1), ..rules() }).await;
    let (scene, sky) = (bench.scene().await, bench.upload(b"sky").await);
    let (just_sent, copy) = (bench.upload(b"just sent").await, bench.upload(b"a copy").await);
    let environment = Some(EnvironmentRequest::Image(sky.clone()));
    let first = bench.job(4, |_| ()).await;
    let second = bench.job(4, |r| r.environment = environment).await;
    let third = bench.job(4, |_| ()).await;
    // As `strip` leaves it: the third job's workers fetch a copy.
    bench.farm.store.file(vec![(third.clone(), vec![copy.clone()])]).await.unwrap();
    let is_there = async |bench: &Bench| {
        let mut there = Vec::new();
        for file in [&scene, &sky, &just_sent, &copy] {
            there.push(has(&bench.farm, file).await);
        }
        there
    };
    bench.farm.forget_old().await.unwrap();
    assert_eq!(is_there(&bench).await, [true; 4], "who sent the third is about to send a job");
    bench.rules.unused = Duration::ZERO;
    bench = bench.crash().await;
    let tidy = async |bench: &Bench| {
        tokio::time::sleep(Duration::from_millis(3)).await;
        bench.farm.forget_old().await.unwrap();
        is_there(bench).await
    };
    assert_eq!(tidy(&bench).await, [true, true, false, true]);
    bench.farm.purge(&third).await.unwrap();
    assert_eq!(tidy(&bench).await, [true, true, false, false]);
    bench.farm.purge(&first).await.unwrap();
    assert_eq!(tidy(&bench).await, [true, true, false, false], "the second needs the scene, too");
    bench.farm.purge(&second).await.unwrap();
    assert_eq!(tidy(&bench).await, [false; 4]);
    let request = JobRequest { scene: Some(scene.clone()), ..JobRequest::default() };
    let refused = bench.farm.submit(request, None, None).await.unwrap_err();
    assert!(refused.to_string().contains("PUT its bytes"), "{refused}");
    assert_eq!(bench.scene().await, scene, "it can be sent again");
    assert!(has(&bench.farm, &scene).await);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_file_that_was_being_removed_at_a_crash_is_removed_and_can_be_sent_again() {
    let mut bench = Bench::new(rules()).await;
    let scene = bench.scene().await;
    tokio::time::sleep(Duration::from_millis(3)).await;
    assert!(bench.farm.store.drop_scene(&scene, Duration::ZERO).await.unwrap());
    let blob = BlobName::Scene(scene.clone());
    assert!(bench.farm.blobs.size(&blob).await.is_ok(), "its bytes are still there");
    bench = bench.crash().await;
    assert!(!has(&bench.farm, &scene).await);

    assert!(bench.farm.store.drop_scene(&scene, Duration::ZERO).await.unwrap());
    let sends = async {
        let sent = bench.scene().await;
        assert!(!bench.farm.store.is_dropped(&sent).await.unwrap(), "it waited");
    };
    let removes = async {
        tokio::time::sleep(Duration::from_millis(100)).await;
        bench.farm.blobs.delete(&blob).await.unwrap();
        bench.farm.store.end_drop(&scene).await.unwrap();
    };
    tokio::join!(sends, removes);
    assert!(has(&bench.farm, &scene).await);
}

/// Sends files, and jobs of them, which are then purged; how many jobs were taken, and how many came too late for their file.
async fn send_and_submit(farm: Arc<Farm>, n: usize) -> (u32, u32) {
    let (mut taken, mut refused) = (0, 0);
    for round in 0..25 {
        // Two send the same file.
        let mut incoming = farm.receive().await.unwrap();
        incoming.write(Bytes::from(format!("scene {} {round}", n / 2))).await.unwrap();
        let scene = match farm.take_in(incoming, None).await {
            Ok((report, _)) => report.id,
            Err(FarmError::BeingRemoved(_)) => {
                refused += 1;
                continue;
            }
            Err(error) => panic!("{error}"),
        };
        let request = JobRequest {
            scene: Some(scene.clone()),
            size: Some("8x8".parse().unwrap()),
            samples: Some(4),
            ..JobRequest::default()
        };
        match farm.submit(request, None, None).await {
            Ok(job) => {
                for _ in 0..3 {
                    assert!(has(&farm, &scene).await, "the job's scene is gone");
                    tokio::task::yield_now().await;
                }
                farm.purge(&job.id).await.unwrap();
                taken += 1;
            }
            Err(FarmError::Request(faults)) => {
                assert!(faults[0].detail.contains("was not uploaded"), "{faults:?}");
                refused += 1;
            }
            Err(error) => panic!("{error}"),
        }
    }
    (taken, refused)
}

/// Files are sent, jobs of them taken and purged, and what is unused removed, all at the same time and by all farms.
async fn a_job_always_has_its_files(farms: Vec<Arc<Farm>>) {
    let over = Arc::new(AtomicBool::new(false));
    let removed = Arc::new(AtomicU32::new(0));
    let sweeps: Vec<_> = farms
        .iter()
        .cloned()
        .map(|farm| {
            let (over, removed) = (Arc::clone(&over), Arc::clone(&removed));
            tokio::spawn(async move {
                while !over.load(Ordering::Relaxed) {
                    for id in farm.store.unused_scenes(Duration::ZERO, 9).await.unwrap() {
                        removed.fetch_add(
                            u32::from(farm.drop_file(&id, Duration::ZERO).await.unwrap()),
                            Ordering::Relaxed,
                        );
                    }
                    tokio::time::sleep(Duration::from_millis(1)).await;
                }
            })
        })
        .collect();
    let sends = (0..8usize).map(|n| tokio::spawn(send_and_submit(Arc::clone(&farms[n % farms.len()]), n)));
    let mut all = (0, 0);
    for (taken, refused) in futures::future::join_all(sends).await.into_iter().map(Result::unwrap) {
        all = (all.0 + taken, all.1 + refused);
    }
    over.store(true, Ordering::Relaxed);
    for sweep in sweeps {
        sweep.await.unwrap();
    }
    let removed = removed.load(Ordering::Relaxed);
    assert_eq!(all.0 + all.1, 200);
    assert!(all.0 > 20 && removed > 20, "{all:?}, {removed} removed: nothing met anything");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn no_job_loses_its_scene_to_a_sweep_on_one_server() {
    let bench = Bench::new(Rules { unused: Duration::ZERO, ..rules() }).await;
    a_job_always_has_its_files(vec![Arc::clone(&bench.farm)]).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn no_job_loses_its_scene_to_a_sweep_on_another_server() {
    let Some(database) = schema("unused").await else { return };
    let folder = tempfile::tempdir().unwrap();
    let rules = Rules { unused: Duration::ZERO, ..rules() };
    let one = Bench::replica(&database, folder.path(), rules.clone()).await;
    let other = Bench::replica(&database, folder.path(), rules).await;
    a_job_always_has_its_files(vec![Arc::clone(&one.farm), Arc::clone(&other.farm)]).await;
}

/// Gives a file an age.
fn age(path: &Path, age: Duration) {
    let file = fs::File::options().write(true).open(path).unwrap();
    file.set_modified(SystemTime::now() - age).unwrap();
}

/// Puts what farms that died leave behind, and a part of an upload that may go on; the names of the former.
async fn litter(blobs: &Blobs) -> Vec<BlobName> {
    let nobody: JobId = "nobody".parse().unwrap();
    let at = BatchKey { block: 0, replicate: 0, region: 0 };
    let hash = BlobId::of([9; 32]);
    let orphans = vec![
        BlobName::Incoming("cut-off".to_owned()),
        BlobName::Handed("lease".parse().unwrap()),
        BlobName::Scene(BlobId::of([8; 32])),
        BlobName::Partial(nobody.clone(), at, hash.clone()),
        BlobName::Prefix(nobody.clone(), at.lane(), 3),
        BlobName::Result(nobody, "m".repeat(64)),
    ];
    for name in &orphans {
        blobs.put(name, Bytes::from_static(b"litter")).await.unwrap();
    }
    blobs.put(&BlobName::Part(hash, 0, 6), Bytes::from_static(b"a part")).await.unwrap();
    orphans
}

async fn is_there(blobs: &Blobs, name: &BlobName) -> bool {
    blobs.size(name).await.is_ok()
}

#[tokio::test(flavor = "multi_thread")]
async fn orphans_are_swept_at_start_and_what_is_in_use_stays() {
    let mut bench = Bench::new(rules()).await;
    let over = done(&bench).await;
    let going = bench.job(1 << 16, |_| ()).await;
    for lease in bench.take(&bench.worker().await, 3).await {
        bench.bring(&lease, Spread::Noisy).await;
    }
    bench.until(&going, |status| status.batches_done == 3).await;
    let scene = bench.scene().await;
    let orphans = litter(&bench.farm.blobs).await;
    // Leftovers of one that is over, and files that were being written.
    let at = BatchKey { block: 0, replicate: 1, region: 0 };
    let left = BlobName::Partial(over.clone(), at, BlobId::of([9; 32]));
    bench.farm.blobs.put(&left, Bytes::from_static(b"leftover")).await.unwrap();
    let staged = ["incoming/upload#1", "scenes/xy#12", "jobs/nobody/result-0.exr#3"]
        .map(|name| bench.blobs().join(name));
    let fresh = bench.blobs().join("incoming/fresh#2");
    for path in staged.iter().chain([&fresh]) {
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "half").unwrap();
    }
    for path in &staged {
        age(path, Duration::from_mins(1));
    }
    let kept = (bench.paths(&going), bench.files(&over));
    assert!(!kept.0.is_empty());

    bench = bench.crash().await;
    for name in orphans.iter().chain([&left]) {
        assert!(!is_there(&bench.farm.blobs, name).await, "{name}");
    }
    for _ in 0..200 {
        if staged.iter().all(|path| !path.exists()) {
            break;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    assert!(staged.iter().all(|path| !path.exists()), "what was never whole");
    assert!(fresh.exists(), "it may be this farm's own");
    assert!(is_there(&bench.farm.blobs, &BlobName::Part(BlobId::of([9; 32]), 0, 6)).await);
    assert!(has(&bench.farm, &scene).await);
    assert_eq!(bench.paths(&going), kept.0);
    bench.assert_only_a_picture(&over);
    bench.work(&bench.worker().await, Spread::Noisy).await;
    bench.until_settled(&going, JobState::Done).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn orphans_in_a_bucket_are_swept_at_start_and_what_is_in_use_stays() {
    let Ok(bucket) = std::env::var("OVTIGRE_TEST_BUCKET") else {
        eprintln!("SKIPPED: OVTIGRE_TEST_BUCKET is not set: nothing was tested with S3");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap().as_nanos();
    let blobs = Blobs::bucket(&format!("{bucket}/sweep/{now}")).unwrap();
    let open = async || {
        let store = Sql::file(&folder.path().join("farm.sqlite")).await.unwrap();
        Farm::open(Arc::new(store), blobs.clone(), inspect(), rules(), Traces::default()).await.unwrap()
    };
    let farm = open().await;
    let mut incoming = farm.receive().await.unwrap();
    incoming.write(Bytes::from_static(b"a scene")).await.unwrap();
    let scene = farm.take_in(incoming, None).await.unwrap().0.id;
    let request = JobRequest { scene: Some(scene.clone()), samples: Some(4), ..JobRequest::default() };
    let job = farm.submit(request, None, None).await.unwrap().id;
    let at = BatchKey { block: 0, replicate: 0, region: 0 };
    let its = BlobName::Partial(job, at, BlobId::of([7; 32]));
    blobs.put(&its, Bytes::from_static(b"a sum that waits")).await.unwrap();
    let orphans = litter(&blobs).await;
    farm.close().await;
    let farm = open().await;
    for name in &orphans {
        assert!(!is_there(&blobs, name).await, "{name}");
    }
    assert!(is_there(&blobs, &its).await && has(&farm, &scene).await);
    assert!(is_there(&blobs, &BlobName::Part(BlobId::of([9; 32]), 0, 6)).await);
    farm.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn one_of_several_servers_sweeps_only_what_nobody_can_be_writing() {
    let Some(database) = schema("sweep").await else { return };
    let folder = tempfile::tempdir().unwrap();
    let one = Bench::replica(&database, folder.path(), rules()).await;
    let scene = one.scene().await;
    let orphans = litter(&one.farm.blobs).await;
    let is_young =
        |name: &BlobName| matches!(name, BlobName::Incoming(_) | BlobName::Handed(_) | BlobName::Scene(_));
    let other = Bench::replica(&database, folder.path(), rules()).await;
    let until_gone = async |names: Vec<&BlobName>| {
        for _ in 0..500 {
            let mut left = 0;
            for name in &names {
                left += u32::from(is_there(&one.farm.blobs, name).await);
            }
            if left == 0 {
                return;
            }
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        panic!("{names:?} stay");
    };
    until_gone(orphans.iter().filter(|name| !is_young(name)).collect()).await;
    let young: Vec<&BlobName> = orphans.iter().filter(|name| is_young(name)).collect();
    for name in &young {
        assert!(is_there(&one.farm.blobs, name).await, "{name} may be on its way");
        age(&folder.path().join(name.to_string()), Duration::from_hours(25));
    }
    age(&folder.path().join(BlobName::Scene(scene.clone()).to_string()), Duration::from_hours(25));
    other.die().await;
    let _again = Bench::replica(&database, folder.path(), rules()).await;
    until_gone(young).await;
    assert!(has(&one.farm, &scene).await, "it has a row");
}

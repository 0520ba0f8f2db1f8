//! What every store does with uploaded files, and with what jobs that are over take up.

use super::contract::{LONG, NOW, hash, id, new_job, with_job};
use super::{
    Store,
    row::{Added, JobChange, NewJob, Progress, Settlement},
};
use ovtigre_proto::{
    id::JobId,
    scene::{SceneContent, SceneReport},
    status::JobState,
};
use std::{sync::Arc, time::Duration};

fn report(n: u8) -> SceneReport {
    let content = SceneContent::Environment { width: 4, height: 2, brightest: 2.5 };
    SceneReport { id: hash(n), bytes: 77, content }
}

fn needing(name: &str, files: &[u8]) -> NewJob {
    NewJob { files: files.iter().copied().map(hash).collect(), ..new_job(name) }
}

/// Beyond the millisecond that the store's clock tells.
async fn a_moment() {
    tokio::time::sleep(Duration::from_millis(3)).await;
}

pub(super) async fn a_file_that_no_job_needs_is_dropped(store: &dyn Store) {
    for n in 1..=3 {
        assert!(store.add_scene(report(n)).await.unwrap());
    }
    assert_eq!(store.add_job(needing("a", &[1, 2]), None).await.unwrap(), Added::New);
    assert_eq!(store.add_job(needing("b", &[1, 9]), None).await.unwrap(), Added::Lacks(hash(9)));
    assert!(store.job(&id("b")).await.unwrap().is_none());
    assert_eq!(store.add_job(needing("b", &[2]), None).await.unwrap(), Added::New);
    a_moment().await;
    assert_eq!(store.unused_scenes(LONG, 9).await.unwrap(), []);
    assert_eq!(store.unused_scenes(NOW, 9).await.unwrap(), [hash(3)]);
    assert!(!store.drop_scene(&hash(3), LONG).await.unwrap(), "it may be that somebody is about to need it");
    assert!(!store.drop_scene(&hash(1), NOW).await.unwrap(), "a job needs it");
    assert!(store.use_scene(&hash(3)).await.unwrap() && !store.use_scene(&hash(9)).await.unwrap());
    assert!(store.scene(&hash(3)).await.unwrap().unwrap().unused < LONG);

    assert!(store.drop_scene(&hash(3), NOW).await.unwrap());
    assert!(store.scene(&hash(3)).await.unwrap().is_none());
    assert!(store.is_dropped(&hash(3)).await.unwrap() && !store.is_dropped(&hash(1)).await.unwrap());
    assert!(!store.drop_scene(&hash(3), NOW).await.unwrap(), "another does that");
    assert!(!store.add_scene(report(3)).await.unwrap(), "its bytes may vanish now");
    assert_eq!(store.add_job(needing("c", &[3]), None).await.unwrap(), Added::Lacks(hash(3)));
    a_moment().await;
    assert_eq!(store.dropped_before(LONG).await.unwrap(), []);
    assert_eq!(store.dropped_before(NOW).await.unwrap(), [hash(3)]);
    store.end_drop(&hash(3)).await.unwrap();
    store.end_drop(&hash(1)).await.unwrap();
    assert!(store.add_scene(report(3)).await.unwrap());
    assert_eq!(store.add_job(needing("c", &[3]), None).await.unwrap(), Added::New);

    assert!(store.remove_job(&id("a")).await.unwrap());
    assert_eq!(store.unused_scenes(LONG, 9).await.unwrap(), [], "it was used until now");
    a_moment().await;
    assert_eq!(store.unused_scenes(NOW, 9).await.unwrap(), [hash(1)], "another job needs the other");
    assert!(store.drop_scene(&hash(8), NOW).await.unwrap(), "bytes that have no row");
    assert!(!store.add_scene(report(8)).await.unwrap());
}

pub(super) async fn files_of_jobs_of_earlier_versions_are_found(store: &dyn Store) {
    for n in 1..=3 {
        store.add_scene(report(n)).await.unwrap();
    }
    // As an earlier version adds them: without what they need.
    for name in ["a", "b", "c"] {
        with_job(store, name).await;
    }
    a_moment().await;
    assert!(!store.drop_scene(&hash(3), NOW).await.unwrap(), "who knows what they need?");
    let found = store.unfiled(2).await.unwrap();
    assert_eq!(found.iter().map(|job| job.id.as_str()).collect::<String>(), "ab");
    assert_eq!((&found[0].scene, &*found[0].spec), (&hash(1), "{}"));
    let files = |jobs: &[&str]| jobs.iter().map(|job| (id::<JobId>(job), vec![hash(1), hash(2)])).collect();
    store.file(files(&["a", "b", "gone"])).await.unwrap();
    assert!(!store.drop_scene(&hash(3), NOW).await.unwrap(), "of one it is not known");
    store.file(files(&["c"])).await.unwrap();
    assert_eq!(store.unfiled(2).await.unwrap(), []);
    assert!(!store.drop_scene(&hash(2), NOW).await.unwrap());
    assert!(store.drop_scene(&hash(3), NOW).await.unwrap());
    // One that an earlier version adds beside this one.
    with_job(store, "d").await;
    assert_eq!(store.unfiled(2).await.unwrap().len(), 1);
    store.add_scene(report(4)).await.unwrap();
    a_moment().await;
    assert!(!store.drop_scene(&hash(4), NOW).await.unwrap());
    assert!(
        store.drop_scene(&hash(8), NOW).await.unwrap(),
        "without a row no job was ever taken that needs it"
    );
}

/// Many jobs and many removals at once, each of which wins somewhere.
pub(super) async fn a_job_and_the_removal_of_its_scene_are_never_both_done(store: Arc<dyn Store>) {
    for n in 0..40 {
        store.add_scene(report(n)).await.unwrap();
    }
    a_moment().await;
    let race = |n: u8| {
        let (adding, dropping) = (Arc::clone(&store), Arc::clone(&store));
        let add = tokio::spawn(async move { adding.add_job(needing(&format!("j{n}"), &[n]), None).await });
        let drop = tokio::spawn(async move { dropping.drop_scene(&hash(n), NOW).await });
        async move { (n, add.await.unwrap().unwrap(), drop.await.unwrap().unwrap()) }
    };
    for (n, added, dropped) in futures::future::join_all((0..40).map(race)).await {
        let expected = if dropped { Added::Lacks(hash(n)) } else { Added::New };
        assert_eq!(added, expected);
        assert_eq!(store.scene(&hash(n)).await.unwrap().is_some(), added == Added::New);
        assert_eq!(store.job(&id(&format!("j{n}"))).await.unwrap().is_some(), added == Added::New);
    }
}

async fn settled(store: &dyn Store, name: &str) -> JobId {
    let job = with_job(store, name).await;
    let mandate = store.take_merge(&job, "m", LONG).await.unwrap().unwrap();
    let settlement =
        Settlement { mandate, progress: Progress::default(), part: 0.0, manifest: None, certified: false };
    let over =
        JobChange { state: Some(JobState::Done), settlement: Some(settlement), ..JobChange::default() };
    assert!(store.change_job(&job, 1, over).await.unwrap());
    job
}

pub(super) async fn jobs_that_are_settled_are_counted_the_longest_over_first(store: &dyn Store) {
    let late = with_job(store, "late").await;
    let mut jobs = Vec::new();
    for name in ["a", "b", "c"] {
        jobs.push(settled(store, name).await);
        a_moment().await;
    }
    let kept = store.kept_jobs(9).await.unwrap();
    let names = |kept: &[super::kept::KeptJob]| kept.iter().map(|job| job.id.to_string()).collect::<String>();
    assert_eq!(names(&kept), "abc", "one that is not over is not among them");
    assert!(kept[0].over > kept[2].over && kept[0].over < LONG, "{kept:?}");
    assert_eq!(names(&store.kept_jobs(2).await.unwrap()), "ab");
    let with_later = async |most| {
        let kept = store.kept_jobs(most).await.unwrap();
        kept.iter().map(|job| job.with_later).collect::<Vec<_>>()
    };
    assert_eq!((with_later(9).await, store.uncounted_jobs(2).await.unwrap().len()), (vec![0; 3], 2));
    let count = |n: usize, version, bytes| (jobs[n].clone(), version, bytes);
    store
        .count_jobs(vec![count(0, 2, 5 << 40), count(1, 2, 7), count(2, 1, 9), (late, 1, 11)])
        .await
        .unwrap();
    assert_eq!(with_later(9).await, [(5 << 40) + 7, 7, 0], "the last has changed since");
    assert_eq!(store.uncounted_jobs(9).await.unwrap(), [(jobs[2].clone(), 2)]);
    store.count_jobs(vec![count(1, 2, 8)]).await.unwrap();
    assert_eq!(with_later(9).await, [(5 << 40) + 8, 8, 0]);
    assert_eq!(with_later(1).await, [(5 << 40) + 8], "also where the later ones are not listed");
    assert!(store.remove_settled(&jobs[0], 2).await.unwrap());
    assert_eq!(with_later(9).await, [8, 0]);
}

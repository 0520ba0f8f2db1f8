//! What every store does: one suite, run on each.

use super::{
    Store, contract_changes as changes, contract_kept as kept, contract_lists as lists,
    error::StoreError,
    row::{
        Added, BatchKey, Claim, CommitOutcome, CommitRow, IdempotencyKey, JobChange, Lane, Mandate,
        NewCheckpoint, NewCommit, NewJob, Progress, Settlement,
    },
};
use ovtigre_core::film::{
    allocation::{Allocation, Allocations},
    certificate::{Cause, Culprit, Doubt},
    size::Size,
};
use ovtigre_proto::{
    curve::{CurveRow, LayerError},
    id::{BlobId, JobId, LeaseId, WorkerId},
    lease::WorkerJoin,
    scene::{SceneContent, SceneReport},
    status::{JobState, WorkerState},
};
use std::{sync::Arc, time::Duration};

pub(super) const LONG: Duration = Duration::from_mins(1);
pub(super) const NOW: Duration = Duration::ZERO;

pub(super) fn id<T: std::str::FromStr<Err: std::fmt::Debug>>(text: &str) -> T {
    text.parse().unwrap()
}

pub(super) fn hash(n: u8) -> BlobId {
    BlobId::of([n; 32])
}

pub(super) fn batch(region: u32, replicate: u32, block: u32) -> BatchKey {
    BatchKey { block, replicate, region }
}

pub(super) fn new_job(name: &str) -> NewJob {
    NewJob {
        id: id(name),
        name: format!("job {name}"),
        scene: hash(1),
        files: Vec::new(),
        priority: 0,
        spec: "{}".to_owned(),
        regions: 2,
        replicates: 2,
        webhook: None,
    }
}

pub(super) fn claim(job: &str, lease: &str, batch: BatchKey) -> Claim {
    Claim { lease: id(lease), job: id(job), batch, worker: id("w") }
}

pub(super) fn commit(job: &str, batch: BatchKey, of: u8) -> NewCommit {
    let row = CommitRow { batch, hash: hash(of), worker_micros: 1000 + u64::from(of) };
    NewCommit { job: id(job), row, worker: Some(id("w")), rays_per_second: 5.0 }
}

pub(super) fn join() -> WorkerJoin {
    WorkerJoin {
        name: "anna".to_owned(),
        threads: 3,
        build: "1".to_owned(),
        instruction_set: "any".to_owned(),
        tags: vec!["big".to_owned()],
    }
}

pub(super) async fn with_job(store: &dyn Store, name: &str) -> JobId {
    assert_eq!(store.add_job(new_job(name), None).await.unwrap(), Added::New);
    id(name)
}

/// Runs the suite; `open` gives an empty store.
pub(crate) async fn run<F: Future<Output = Arc<dyn Store>>>(open: impl Fn() -> F) {
    scenes_are_remembered_once(&*open().await).await;
    lists::jobs_are_listed_page_by_page(&*open().await).await;
    lists::jobs_are_listed_in_every_order(&*open().await).await;
    lists::what_lists_go_by_follows_a_job(&*open().await).await;
    lists::a_list_says_how_jobs_stand(&*open().await).await;
    a_key_makes_one_job(&*open().await).await;
    a_change_needs_the_version(&*open().await).await;
    a_batch_is_claimed_once(&*open().await).await;
    leases_are_renewed_released_and_run_out(&*open().await).await;
    the_first_commit_counts(&*open().await).await;
    what_is_over_is_cleared_and_what_is_removed_is_gone(&*open().await).await;
    curves_and_snapshots_are_kept(&*open().await).await;
    pauses_are_no_run_time(&*open().await).await;
    workers_are_seen_and_lost(&*open().await).await;
    what_others_do_is_seen(&*open().await).await;
    one_appends_to_a_job(&*open().await).await;
    odd_texts_are_no_error(&*open().await).await;
    changes::what_was_brought_is_taken_back(&*open().await).await;
    changes::a_job_is_extended(&*open().await).await;
    changes::changes_of_a_job_are_told_of_in_order(&*open().await).await;
    changes::tokens_and_workers_put_aside_are_remembered(&*open().await).await;
    kept::a_file_that_no_job_needs_is_dropped(&*open().await).await;
    kept::files_of_jobs_of_earlier_versions_are_found(&*open().await).await;
    kept::a_job_and_the_removal_of_its_scene_are_never_both_done(open().await).await;
    kept::jobs_that_are_settled_are_counted_the_longest_over_first(&*open().await).await;
    many_at_once_are_each_done_once(open().await).await;
}

async fn scenes_are_remembered_once(store: &dyn Store) {
    let content = SceneContent::Environment { width: 4, height: 2, brightest: 2.5 };
    let report = SceneReport { id: hash(1), bytes: 77, content };
    store.add_scene(report.clone()).await.unwrap();
    store.add_scene(SceneReport { bytes: 78, ..report.clone() }).await.unwrap();
    assert_eq!(store.scene(&hash(1)).await.unwrap().unwrap().report, report);
    assert!(store.scene(&hash(2)).await.unwrap().is_none());
}

async fn a_key_makes_one_job(store: &dyn Store) {
    let key = |text: &str| Some(IdempotencyKey { key: "k".to_owned(), fingerprint: text.to_owned() });
    assert_eq!(store.add_job(new_job("a"), key("f")).await.unwrap(), Added::New);
    assert_eq!(store.add_job(new_job("b"), key("f")).await.unwrap(), Added::Before(id("a")));
    assert_eq!(store.add_job(new_job("b"), key("g")).await.unwrap(), Added::KeyTaken);
    assert!(store.job(&id("b")).await.unwrap().is_none());
    store.forget_keys(LONG).await.unwrap();
    assert_eq!(store.add_job(new_job("b"), key("g")).await.unwrap(), Added::KeyTaken);
    tokio::time::sleep(Duration::from_millis(3)).await;
    store.forget_keys(NOW).await.unwrap();
    assert_eq!(store.add_job(new_job("b"), key("g")).await.unwrap(), Added::New);
}

async fn a_change_needs_the_version(store: &dyn Store) {
    let job = with_job(store, "a").await;
    let priority = |n| JobChange { priority: Some(n), ..JobChange::default() };
    assert!(store.change_job(&job, 1, priority(5)).await.unwrap());
    assert!(!store.change_job(&job, 1, priority(6)).await.unwrap());
    let row = store.job(&job).await.unwrap().unwrap();
    assert_eq!((row.version, row.priority, row.state), (2, 5, JobState::Queued));
    assert!(!store.change_job(&id("none"), 1, priority(6)).await.unwrap());
}

async fn a_batch_is_claimed_once(store: &dyn Store) {
    let job = with_job(store, "a").await;
    let claims = vec![
        claim("a", "l1", batch(0, 0, 0)),
        claim("a", "l2", batch(0, 0, 0)),
        claim("a", "l3", batch(1, 1, 1)),
        claim("a", "l4", batch(0, 0, 1)),
        claim("none", "l5", batch(0, 0, 0)),
    ];
    assert_eq!(store.claim(claims, LONG).await.unwrap(), [true, false, false, true, false]);
    let row = store.job(&job).await.unwrap().unwrap();
    assert_eq!((row.state, row.version), (JobState::Running, 2));
    assert!(row.started_at.is_some());
    let ledger = store.ledger(&job).await.unwrap();
    let lane = Lane { replicate: 0, region: 0 };
    assert!(ledger.cursors.contains(&(lane, 2)) && ledger.cursors.len() == 4);
    assert_eq!(ledger.leases.len(), 2);
    assert_eq!(store.workers_of(&job).await.unwrap(), 1);
    let pause = JobChange { state: Some(JobState::Paused), ..JobChange::default() };
    assert!(store.change_job(&job, 2, pause).await.unwrap());
    assert_eq!(store.claim(vec![claim("a", "l6", batch(0, 0, 2))], LONG).await.unwrap(), [false]);
}

async fn leases_are_renewed_released_and_run_out(store: &dyn Store) {
    let job = with_job(store, "a").await;
    let (w, l1, l2): (WorkerId, LeaseId, LeaseId) = (id("w"), id("l1"), id("l2"));
    store.add_worker(&w, join()).await.unwrap();
    let claims = vec![claim("a", "l1", batch(0, 0, 0)), claim("a", "l2", batch(0, 1, 0))];
    store.claim(claims, Duration::from_millis(30)).await.unwrap();
    assert_eq!(store.renew(&w, vec![l1.clone(), id("l9")], LONG).await.unwrap(), std::slice::from_ref(&l1));
    assert!(store.renew(&id("other"), vec![l1.clone()], LONG).await.unwrap().is_empty());
    assert!(store.expire().await.unwrap().iter().all(|r| r.lease.id == l2));
    tokio::time::sleep(Duration::from_millis(50)).await;
    store.expire().await.unwrap();
    let ledger = store.ledger(&job).await.unwrap();
    assert_eq!(ledger.returned, [batch(0, 1, 0)]);
    assert_eq!(ledger.leases.len(), 1, "the renewed one is still there");
    assert!(store.renew(&w, vec![l2.clone()], LONG).await.unwrap().is_empty());
    assert_eq!(store.claim(vec![claim("a", "l3", batch(0, 1, 0))], LONG).await.unwrap(), [true], "again");
    let released = store.release(&id("l3"), Some("no memory".to_owned())).await.unwrap().unwrap();
    assert_eq!((released.failures, released.workers, released.losses), (1, 1, 1));
    assert_eq!(released.lease.batch, batch(0, 1, 0));
    assert!(store.release(&id("l3"), None).await.unwrap().is_none());
    let released = store.release(&l1, None).await.unwrap().unwrap();
    assert_eq!((released.failures, released.workers), (0, 0), "handed back is no failure");
    assert_eq!(store.worker(&w).await.unwrap().unwrap().failures, 2);
}

async fn the_first_commit_counts(store: &dyn Store) {
    let job = with_job(store, "a").await;
    store.add_worker(&id("w"), join()).await.unwrap();
    store.claim(vec![claim("a", "l1", batch(0, 0, 0))], LONG).await.unwrap();
    let bring = async |new| store.commit(new).await.unwrap();
    assert_eq!(bring(commit("a", batch(0, 0, 1), 1)).await, CommitOutcome::NeverHandedOut);
    assert_eq!(bring(commit("a", batch(7, 7, 0), 1)).await, CommitOutcome::NeverHandedOut);
    assert_eq!(bring(commit("none", batch(0, 0, 0), 1)).await, CommitOutcome::NoJob);
    assert_eq!(bring(commit("a", batch(0, 0, 0), 1)).await, CommitOutcome::First);
    assert_eq!(bring(commit("a", batch(0, 0, 0), 1)).await, CommitOutcome::Same);
    assert_eq!(bring(commit("a", batch(0, 0, 0), 2)).await, CommitOutcome::Differs { kept: hash(1) });
    let ledger = store.ledger(&job).await.unwrap();
    assert_eq!((ledger.leases.len(), ledger.returned.len()), (0, 0));
    assert_eq!(ledger.commits, [commit("a", batch(0, 0, 0), 1).row]);
    let lane = Lane { replicate: 0, region: 0 };
    assert_eq!(store.commits(&job, lane, 0..9).await.unwrap(), ledger.commits);
    assert!(store.commits(&job, lane, 1..9).await.unwrap().is_empty());
    let worker = store.worker(&id("w")).await.unwrap().unwrap();
    assert_eq!((worker.batches_done, worker.rays_per_second), (1, 5.0));
    // A batch that was returned and came late is not handed out again.
    store.claim(vec![claim("a", "l2", batch(0, 1, 0))], LONG).await.unwrap();
    store.release(&id("l2"), None).await.unwrap();
    assert_eq!(bring(commit("a", batch(0, 1, 0), 3)).await, CommitOutcome::First);
    assert_eq!(store.claim(vec![claim("a", "l3", batch(0, 1, 0))], LONG).await.unwrap(), [false]);
}

async fn what_is_over_is_cleared_and_what_is_removed_is_gone(store: &dyn Store) {
    let job = with_job(store, "a").await;
    store
        .claim(vec![claim("a", "l1", batch(0, 0, 0)), claim("a", "l2", batch(0, 1, 0))], LONG)
        .await
        .unwrap();
    store.commit(commit("a", batch(0, 0, 0), 1)).await.unwrap();
    let change = JobChange {
        state: Some(JobState::Cancelled),
        reason: Some("because".to_owned()),
        ..JobChange::default()
    };
    assert!(store.change_job(&job, 2, change).await.unwrap());
    let row = store.job(&job).await.unwrap().unwrap();
    assert_eq!(
        (row.state, row.reason.as_deref(), row.settled),
        (JobState::Cancelled, Some("because"), false)
    );
    assert!(row.ended_at.is_some());
    let ledger = store.ledger(&job).await.unwrap();
    assert!(ledger.cursors.is_empty() && ledger.leases.is_empty() && ledger.commits.len() == 1);
    assert_eq!(store.commit(commit("a", batch(0, 1, 0), 1)).await.unwrap(), CommitOutcome::JobOver);
    assert_eq!(store.unsettled_jobs().await.unwrap().len(), 1);
    let progress = Progress { samples: 2.5, batches: 1, worker_micros: 7, rays: 8, invalid: 9 };
    let mandate = store.take_merge(&job, "s", LONG).await.unwrap().unwrap();
    let settlement =
        Settlement { mandate, progress, part: 1.0, manifest: Some("m".to_owned()), certified: true };
    let change = JobChange { settlement: Some(settlement), ..JobChange::default() };
    assert!(store.change_job(&job, row.version, change).await.unwrap());
    let row = store.job(&job).await.unwrap().unwrap();
    assert_eq!((row.progress, row.manifest.as_deref()), (progress, Some("m")));
    assert!(row.settled && row.certified && store.unsettled_jobs().await.unwrap().is_empty());
    assert!(store.heads().await.unwrap().is_empty());
    assert!(store.ledger(&job).await.unwrap().commits.is_empty(), "nobody asks for them any more");
    assert_eq!(store.take_merge(&job, "s", LONG).await.unwrap(), None);
    assert!(store.remove_job(&job).await.unwrap());
    assert!(!store.remove_job(&job).await.unwrap());
    assert!(store.job(&job).await.unwrap().is_none());
    assert!(store.ledger(&job).await.unwrap().commits.is_empty());
}

async fn curves_and_snapshots_are_kept(store: &dyn Store) {
    let job = with_job(store, "a").await;
    let row = CurveRow {
        samples: 4,
        wall_seconds: 1.5,
        worker_seconds: 2.5,
        rays: 99,
        rms_error: Some(0.5),
        relative_error: Some(0.25),
        relative_error_upper: None,
        target_expected_at_seconds: Some(9.5),
        doubt: None,
    };
    let progress = Progress { batches: 4, ..Progress::default() };
    let culprit = Culprit { x: 3, y: 5, share: 0.75 };
    let doubt =
        Doubt { cause: Cause::FewPixels, effective_pixels: 1.5, lone_share: 0.25, pixels: vec![culprit] };
    let second = CurveRow { samples: 8, doubt: Some(doubt), ..row.clone() };
    let layer = LayerError {
        mean_luminance: 0.5,
        rms_error: Some(0.1),
        relative_error: None,
        estimated_bias: Some(-0.01),
    };
    let checkpoint = |look, row, layers: &[LayerError]| NewCheckpoint {
        look,
        row,
        layers: layers.to_vec(),
        progress,
        allocations: None,
    };
    assert_eq!(store.layers(&job).await.unwrap(), []);
    let mandate = store.take_merge(&job, "s", LONG).await.unwrap().unwrap();
    store.add_checkpoint(&job, mandate, checkpoint(1, row.clone(), &[])).await.unwrap();
    store.add_checkpoint(&job, mandate, checkpoint(2, second.clone(), &[layer, layer])).await.unwrap();
    store.add_checkpoint(&job, mandate, checkpoint(1, second.clone(), &[layer])).await.unwrap();
    assert_eq!(store.allocations(&job).await.unwrap(), None);
    for shares in [[2, 64], [8, 8]] {
        let half = |from| Allocation::new(Size { width: 32, height: 9 }, from, shares.to_vec());
        let allocations = Some(Allocations([half(16), half(17)]));
        let decided = NewCheckpoint { allocations, ..checkpoint(2, second.clone(), &[]) };
        store.add_checkpoint(&job, mandate, decided).await.unwrap();
        let kept = store.allocations(&job).await.unwrap().unwrap();
        assert_eq!((kept.of(2).shares(), kept.of(3).from()), (&[2, 64][..], 17), "the first decision stays");
    }
    assert_eq!(store.layers(&job).await.unwrap(), [layer, layer]);
    assert_eq!(store.curve(&job).await.unwrap(), [row, second]);
    assert_eq!(store.job(&job).await.unwrap().unwrap().progress, progress);
    let lane = Lane { replicate: 1, region: 0 };
    store.set_snapshot(&job, mandate, lane, 2).await.unwrap();
    store.set_snapshot(&job, mandate, lane, 5).await.unwrap();
    let ledger = store.ledger(&job).await.unwrap();
    assert_eq!((ledger.snapshots, ledger.checkpoints), (vec![(lane, 5)], 2));
}

async fn pauses_are_no_run_time(store: &dyn Store) {
    let job = with_job(store, "a").await;
    let state = |s| JobChange { state: Some(s), ..JobChange::default() };
    let run = async || store.job(&job).await.unwrap().unwrap().run_seconds;
    assert!(run().await.abs() < 1e-9, "it has not begun");
    store.claim(vec![claim("a", "l1", batch(0, 0, 0))], LONG).await.unwrap();
    tokio::time::sleep(Duration::from_millis(40)).await;
    store.change_job(&job, 2, state(JobState::Paused)).await.unwrap();
    let paused = run().await;
    assert!(paused >= 0.035, "{paused}");
    tokio::time::sleep(Duration::from_secs(1)).await;
    assert!((run().await - paused).abs() < 1e-9);
    store.change_job(&job, 3, state(JobState::Running)).await.unwrap();
    tokio::time::sleep(Duration::from_millis(20)).await;
    let resumed = run().await;
    assert!(resumed >= paused + 0.015 && resumed < paused + 0.9, "{paused} {resumed}");
    store.change_job(&job, 4, state(JobState::Done)).await.unwrap();
    let ended = run().await;
    tokio::time::sleep(Duration::from_millis(20)).await;
    assert!((run().await - ended).abs() < 1e-9);
}

async fn workers_are_seen_and_lost(store: &dyn Store) {
    let (a, b): (WorkerId, WorkerId) = (id("a"), id("b"));
    store.add_worker(&a, join()).await.unwrap();
    store.add_worker(&b, join()).await.unwrap();
    let row = store.worker(&a).await.unwrap().unwrap();
    assert_eq!((row.join, row.state, row.leases), (join(), WorkerState::Active, 0));
    assert!(store.lose_workers(LONG).await.unwrap().is_empty());
    tokio::time::sleep(Duration::from_millis(1200)).await;
    let seen = async |id, state| store.see_worker(id, state).await.unwrap();
    assert_eq!(seen(&a, WorkerState::Active).await, Some(WorkerState::Active));
    assert_eq!(seen(&a, WorkerState::Draining).await, Some(WorkerState::Draining));
    assert_eq!(seen(&a, WorkerState::Active).await, Some(WorkerState::Draining), "it was told to leave");
    assert_eq!(store.lose_workers(Duration::from_secs(1)).await.unwrap(), std::slice::from_ref(&b));
    assert_eq!(seen(&id("none"), WorkerState::Active).await, None);
    assert!(store.set_worker_state(&a, WorkerState::Gone).await.unwrap());
    let page = store.workers(None, 1).await.unwrap();
    assert_eq!((page.len(), &page[0].1.id), (1, &b));
    let rest = store.workers(Some(page[0].0), 5).await.unwrap();
    assert_eq!((rest.len(), &rest[0].1.id, rest[0].1.state), (1, &a, WorkerState::Gone));
    assert_eq!(store.counts().await.unwrap().workers.len(), 2);
    store.ping().await.unwrap();
}

async fn what_others_do_is_seen(store: &dyn Store) {
    let job = with_job(store, "a").await;
    let claims = vec![claim("a", "l1", batch(0, 0, 0)), claim("a", "l2", batch(0, 1, 0))];
    store.claim(claims, LONG).await.unwrap();
    store.commit(commit("a", batch(0, 1, 0), 1)).await.unwrap();
    let before = store.ledger(&job).await.unwrap();
    assert_eq!(before.brought, 1);
    assert!(store.commits_after(&job, 1).await.unwrap().rows.is_empty());
    store.commit(commit("a", batch(0, 1, 0), 1)).await.unwrap();
    store.commit(commit("a", batch(0, 0, 0), 2)).await.unwrap();
    let heads = store.heads().await.unwrap();
    assert_eq!((heads.len(), &heads[0].id, heads[0].brought, heads[0].looks), (1, &job, 2, 0));
    assert_eq!((heads[0].version, heads[0].state), (2, JobState::Running));
    let since = store.commits_after(&job, 1).await.unwrap();
    assert_eq!((since.rows, since.count), (vec![commit("a", batch(0, 0, 0), 2).row], 2));
    assert_eq!(store.commits_after(&job, 0).await.unwrap().rows.len(), 2);
    store.claim(vec![claim("a", "l3", batch(1, 0, 0))], LONG).await.unwrap();
    store.release(&id("l3"), None).await.unwrap();
    assert_eq!(store.returned().await.unwrap(), [(job.clone(), batch(1, 0, 0))]);
    let left = store.unclaimed(&job).await.unwrap();
    assert_eq!(left.returned, [batch(1, 0, 0)]);
    assert!(left.cursors.contains(&(Lane { replicate: 0, region: 1 }, 1)) && left.cursors.len() == 4);
}

async fn one_appends_to_a_job(store: &dyn Store) {
    let job = with_job(store, "a").await;
    let lane = Lane { replicate: 0, region: 0 };
    let short = Duration::from_millis(800);
    let take = async |holder, time| store.take_merge(&job, holder, time).await.unwrap();
    assert_eq!(store.take_merge(&id("none"), "x", LONG).await.unwrap(), None);
    let first = take("x", short).await.unwrap();
    assert_eq!(take("y", LONG).await, None, "x has it");
    assert_eq!(store.keep_merges("x", short).await.unwrap(), [(job.clone(), first)]);
    store.set_snapshot(&job, first, lane, 1).await.unwrap();
    tokio::time::sleep(Duration::from_secs(1)).await;
    store.set_snapshot(&job, first, lane, 2).await.unwrap();
    let second = take("y", LONG).await.unwrap();
    assert_ne!(first, second);
    assert!(store.keep_merges("x", LONG).await.unwrap().is_empty());
    assert_eq!(take("x", LONG).await, None);
    // Whatever the first still does has no effect.
    let progress = Progress { batches: 9, ..Progress::default() };
    let lost =
        |done: Result<(), StoreError>| assert!(matches!(done, Err(StoreError::Superseded)), "{done:?}");
    lost(store.set_snapshot(&job, first, lane, 9).await);
    lost(store.publish(&job, first, progress).await);
    let settlement = Settlement { mandate: first, progress, part: 1.0, manifest: None, certified: false };
    let change =
        JobChange { state: Some(JobState::Done), settlement: Some(settlement), ..JobChange::default() };
    lost(store.change_job(&job, 1, change).await.map(drop));
    let row = store.job(&job).await.unwrap().unwrap();
    assert_eq!((row.version, row.state, row.progress), (1, JobState::Queued, Progress::default()));
    assert_eq!(store.ledger(&job).await.unwrap().snapshots, [(lane, 2)]);
    store.publish(&job, second, progress).await.unwrap();
    assert_eq!(store.heads().await.unwrap()[0].progress, progress);
    store.leave_merges("y").await.unwrap();
    assert_ne!(take("x", LONG).await.unwrap(), second);
    assert_ne!(take("x", LONG).await, Some(Mandate(0)), "who asks again begins anew");
}

async fn odd_texts_are_no_error(store: &dyn Store) {
    let name = "a zero \0, 'quotes', \\ and ☂";
    store.add_job(NewJob { name: name.to_owned(), ..new_job("a") }, None).await.unwrap();
    let kept = store.job(&id("a")).await.unwrap().unwrap().name;
    assert_eq!(kept.replace(['\0', '\u{fffd}'], "?"), name.replace('\0', "?"));
}

async fn many_at_once_are_each_done_once(store: Arc<dyn Store>) {
    let job = with_job(&*store, "a").await;
    let tasks = (0..40_u32).map(|n| {
        let store = Arc::clone(&store);
        tokio::spawn(async move {
            let mut mine = Vec::new();
            for block in 0..10 {
                let key = batch(0, 0, block);
                let lease = format!("l{n}-{block}");
                if store.claim(vec![claim("a", &lease, key)], LONG).await.unwrap() == [true] {
                    mine.push(block);
                    assert_eq!(store.commit(commit("a", key, 1)).await.unwrap(), CommitOutcome::First);
                }
            }
            mine
        })
    });
    let mut blocks = Vec::new();
    for mine in futures::future::join_all(tasks).await {
        blocks.extend(mine.unwrap());
    }
    blocks.sort_unstable();
    let claimed = store.ledger(&job).await.unwrap().commits.len();
    assert_eq!(blocks.len(), claimed);
    assert!(blocks.windows(2).all(|w| w[0] != w[1]) && claimed > 0, "{blocks:?}");
}

//! Several farms over one store are one farm.

use super::bench::{Bench, Spread, rules};
use crate::{farm::rules::Rules, store::sql::schema::schema};
use ovtigre_proto::{
    job::JobPatch,
    lease::{Commit, Exchange, Lease, LeaseProgress},
    status::JobState,
};
use std::{collections::BTreeSet, time::Duration};
use tempfile::TempDir;

const SAMPLES: u32 = 4000;

/// A server that dies is missed soon.
fn quick() -> Rules {
    Rules {
        mandate: Duration::from_millis(400),
        keep_mandate: Duration::from_millis(50),
        partials_kept: 2,
        ..rules()
    }
}

/// Farms over a schema of their own and one folder; `None` without a PostgreSQL server.
async fn farms<const N: usize>(name: &str) -> Option<([Bench; N], String, TempDir)> {
    let database = schema(name).await?;
    let folder = tempfile::tempdir().unwrap();
    let mut farms = Vec::new();
    for _ in 0..N {
        farms.push(Bench::replica(&database, folder.path(), quick()).await);
    }
    Some((farms.try_into().ok()?, database, folder))
}

/// The picture of one undisturbed farm over a file.
async fn undisturbed() -> Vec<(String, Vec<u32>)> {
    let bench = Bench::new(rules()).await;
    let job = bench.job(SAMPLES, |_| ()).await;
    let worker = bench.worker().await;
    bench.work(&worker, Spread::Noisy).await;
    bench.until_settled(&job, JobState::Done).await;
    bench.pixels(&job).await
}

#[tokio::test(flavor = "multi_thread")]
async fn each_call_may_go_to_any_of_them() {
    let Some((farms, _, _folder)) = farms::<3>("any").await else { return };
    let job = farms[0].job(SAMPLES, |_| ()).await;
    let worker = farms[0].worker().await;
    let (mut turn, mut taken) = (0, BTreeSet::new());
    loop {
        turn += 1;
        let of = |n: usize| &farms[(turn + n) % 3];
        let leases = of(0).take(&worker, 3).await;
        for lease in &leases {
            assert!(taken.insert((lease.batch.replicate, lease.batch.block.index)), "{lease:?} twice");
            assert!(of(1).beat(&worker, lease).await, "a lease is one wherever it is renewed");
            assert_eq!(of(2).bring(lease, Spread::Noisy).await, Commit::Accepted);
            assert_eq!(of(1).bring(lease, Spread::Noisy).await, Commit::Duplicate);
        }
        if leases.is_empty() {
            if farms[1].farm.status(&job).await.unwrap().state.is_over() {
                break;
            }
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    }
    let expected = undisturbed().await;
    for farm in &farms {
        let status = farm.until_settled(&job, JobState::Done).await;
        assert_eq!(status.batches_done, status.batches_asked);
        assert!((status.worker_seconds - 1e-3 * f64::from(SAMPLES)).abs() < 1e-9);
        assert_eq!(farm.pixels(&job).await, expected);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn whoever_is_left_goes_on_appending() {
    let Some((farms, database, folder)) = farms::<2>("left").await else { return };
    let [first, mut other] = farms;
    let job = first.job(SAMPLES, |_| ()).await;
    let worker = first.worker().await;
    let mut hands: Vec<Lease> = first.take(&worker, 12).await;
    let (mut taken, mut deaths) = (hands.len() as u64, 1);
    for lease in hands.drain(..6) {
        first.bring(&lease, Spread::Noisy).await;
    }
    first.until(&job, |status| status.batches_done > 0).await;
    first.die().await;
    loop {
        let status = other.farm.status(&job).await.unwrap();
        if status.state.is_over() {
            break;
        }
        if deaths < 4 && status.batches_done > 8 * deaths {
            deaths += 1;
            let next = Bench::replica(&database, folder.path(), quick()).await;
            std::mem::replace(&mut other, next).die().await;
        }
        // No more than seven are open, or the picture might be whole before all have died that are to.
        if taken < status.batches_done + 4 {
            let more = other.take(&worker, 4).await;
            taken += more.len() as u64;
            hands.extend(more);
        }
        if hands.is_empty() {
            tokio::time::sleep(Duration::from_millis(5)).await;
        } else {
            other.bring(&hands.remove(hands.len() / 2), Spread::Noisy).await;
        }
    }
    let status = other.until_settled(&job, JobState::Done).await;
    assert_eq!((status.batches_done, deaths), (status.batches_asked, 4));
    assert!((status.worker_seconds - 1e-3 * f64::from(SAMPLES)).abs() < 1e-9);
    assert_eq!(other.pixels(&job).await, undisturbed().await);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_picture_so_far_is_shown_by_those_who_do_not_append() {
    let Some((farms, _, _folder)) = farms::<2>("shown").await else { return };
    let [one, other] = &farms;
    let job = one.job(SAMPLES, |_| ()).await;
    let worker = one.worker().await;
    for lease in one.take(&worker, 9).await {
        one.bring(&lease, Spread::Noisy).await;
    }
    let done = one.until(&job, |status| status.batches_done == 9).await;
    other.until(&job, |status| status.batches_done == done.batches_done).await;
    let curve = one.farm.curve(&job).await.unwrap();
    assert_eq!(other.farm.curve(&job).await.unwrap().rows, curve.rows);
    assert_eq!(other.pixels(&job).await, one.pixels(&job).await);
    let manifest = one.farm.manifest(&job).await.unwrap();
    assert!(manifest.is_some());
    assert_eq!(other.farm.manifest(&job).await.unwrap(), manifest);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_one_is_told_the_others_follow() {
    let Some((farms, _, _folder)) = farms::<2>("told").await else { return };
    let [one, other] = &farms;
    let job = one.job(SAMPLES, |_| ()).await;
    let worker = one.worker().await;
    let lease = other_takes(other, &worker).await;
    let pause = JobPatch { state: Some(JobState::Paused), ..JobPatch::default() };
    one.farm.patch(&job, &pause, None).await.unwrap();
    assert!(other.take(&worker, 1).await.is_empty(), "it is paused");
    one.farm.drain(&worker).await.unwrap();
    one.farm.cancel(&job).await.unwrap();
    other.until_settled(&job, JobState::Cancelled).await;
    one.until_settled(&job, JobState::Cancelled).await;
    assert!(!other.beat(&worker, &lease).await, "its lease is to be dropped");
    assert_eq!(other.bring(&lease, Spread::Noisy).await, Commit::NotNeeded);
    one.farm.purge(&job).await.unwrap();
    assert!(other.farm.status(&job).await.is_err());
}

async fn other_takes(other: &Bench, worker: &ovtigre_proto::id::WorkerId) -> Lease {
    for _ in 0..200 {
        if let Some(lease) = other.take(worker, 1).await.pop() {
            return lease;
        }
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
    panic!("the other never heard of the job");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_batch_that_is_lost_at_one_is_handed_out_by_another() {
    let Some((farms, database, folder)) = farms::<1>("lost").await else { return };
    let [one] = &farms;
    let rules = Rules { lease: Duration::from_millis(300), ..quick() };
    let short = Bench::replica(&database, folder.path(), rules).await;
    let job = one.job(SAMPLES, |_| ()).await;
    let (dead, alive) = (one.worker().await, one.worker().await);
    other_takes(&short, &dead).await;
    // All that is left, while the lost batch is still in its worker's hands.
    loop {
        let leases = one.take(&alive, 16).await;
        if leases.is_empty() && one.farm.status(&job).await.unwrap().state.is_over() {
            break;
        }
        for lease in &leases {
            one.bring(lease, Spread::Noisy).await;
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    one.until_settled(&job, JobState::Done).await;
    assert_eq!(one.pixels(&job).await, undisturbed().await);
    let holding = vec![LeaseProgress { lease: "none".parse().unwrap(), done: 0.0 }];
    let beat = Exchange { holding, ..Exchange::default() };
    assert_eq!(one.farm.exchange(&alive, beat).await.unwrap().drop.len(), 1, "nobody knows that lease");
}

//! Workers that fail, leave, or are not heard of.

use super::bench::{Bench, Spread, rules};
use crate::farm::{error::FarmError, rules::Rules};
use ovtigre_proto::{
    lease::{Commit, Exchange, FailureKind, LeaseFailure},
    status::{JobState, WorkerState},
};
use std::time::Duration;

fn short() -> Rules {
    Rules { lease: Duration::from_millis(80), silence: Duration::from_millis(150), ..rules() }
}

async fn sleep(millis: u64) {
    tokio::time::sleep(Duration::from_millis(millis)).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lease_that_ran_out_goes_to_the_next_and_its_late_sum_is_used() {
    let bench = Bench::new(short()).await;
    let job = bench.job(1000, |_| ()).await;
    let (slow, quick) = (bench.worker().await, bench.worker().await);
    let lost = bench.take(&slow, 2).await;
    sleep(200).await;
    assert!(!bench.beat(&slow, &lost[0]).await);
    let again = bench.take(&quick, 2).await;
    assert_eq!((again[0].batch, again[1].batch), (lost[0].batch, lost[1].batch), "handed out first");
    assert_eq!(bench.bring(&lost[0], Spread::Noisy).await, Commit::Accepted, "late, and still missing");
    assert!(!bench.beat(&quick, &again[0]).await, "nobody needs it any more");
    assert!(bench.beat(&quick, &again[1]).await);
    assert_eq!(bench.bring(&again[0], Spread::Noisy).await, Commit::Duplicate);
    assert_eq!(bench.bring(&again[1], Spread::Noisy).await, Commit::Accepted);
    assert_eq!(bench.bring(&lost[1], Spread::Noisy).await, Commit::Duplicate);
    bench.work(&quick, Spread::Noisy).await;
    let status = bench.until_settled(&job, JobState::Done).await;
    assert_eq!(status.batches_done, status.batches_asked);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lease_that_is_renewed_does_not_run_out() {
    let bench = Bench::new(short()).await;
    bench.job(1000, |_| ()).await;
    let worker = bench.worker().await;
    let lease = bench.take(&worker, 1).await.remove(0);
    for _ in 0..12 {
        sleep(25).await;
        assert!(bench.beat(&worker, &lease).await);
    }
    assert_eq!(bench.bring(&lease, Spread::Noisy).await, Commit::Accepted);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_silent_worker_is_lost_and_comes_back_by_speaking() {
    let bench = Bench::new(short()).await;
    let worker = bench.worker().await;
    sleep(400).await;
    assert_eq!(bench.farm.worker(&worker).await.unwrap().state, WorkerState::Lost);
    assert_eq!(bench.farm.scaling().active_workers, 0);
    bench.take(&worker, 1).await;
    assert_eq!(bench.farm.worker(&worker).await.unwrap().state, WorkerState::Active);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_is_drained_leaves_and_is_gone() {
    let bench = Bench::new(rules()).await;
    bench.job(1000, |_| ()).await;
    let worker = bench.worker().await;
    let lease = bench.take(&worker, 1).await.remove(0);
    assert_eq!(bench.farm.drain(&worker).await.unwrap().state, WorkerState::Draining);
    let reply = bench.farm.exchange(&worker, Exchange { wants: 4, ..Exchange::default() }).await.unwrap();
    assert!(reply.drain && reply.leases.is_empty());
    let failure = LeaseFailure { reason: "leaving".to_owned(), kind: FailureKind::HandedBack };
    bench.farm.give_back(&lease.id, failure.clone()).await.unwrap();
    assert!(matches!(bench.farm.give_back(&lease.id, failure).await, Err(FarmError::NotFound { .. })));
    bench.farm.exchange(&worker, Exchange { leaving: true, ..Exchange::default() }).await.unwrap();
    let status = bench.farm.worker(&worker).await.unwrap();
    assert_eq!((status.state, status.failures), (WorkerState::Gone, 0));
    assert!(bench.farm.exchange(&worker, Exchange::default()).await.is_err(), "it has to join again");
    let next = bench.worker().await;
    assert_eq!(bench.take(&next, 1).await[0].batch, lease.batch, "handed back, handed out");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_that_cannot_be_rendered_fails_at_once_with_the_reason() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(1000, |_| ()).await;
    let worker = bench.worker().await;
    let lease = bench.take(&worker, 1).await.remove(0);
    let failure = LeaseFailure { reason: "no camera 7".to_owned(), kind: FailureKind::Job };
    bench.farm.give_back(&lease.id, failure).await.unwrap();
    let status = bench.until_settled(&job, JobState::Failed).await;
    assert_eq!(status.reason.as_deref(), Some("no camera 7"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_batch_that_fails_again_and_again_fails_its_job() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(1000, |_| ()).await;
    let worker = bench.worker().await;
    for n in 1..=5 {
        assert!(!bench.farm.status(&job).await.unwrap().state.is_over(), "before {n}");
        let lease = bench.take(&worker, 1).await.remove(0);
        let failure = LeaseFailure { reason: "out of memory".to_owned(), kind: FailureKind::Worker };
        bench.farm.give_back(&lease.id, failure).await.unwrap();
    }
    let status = bench.until_settled(&job, JobState::Failed).await;
    assert!(status.reason.unwrap().contains("out of memory"));
    assert_eq!(bench.farm.worker(&worker).await.unwrap().failures, 5);
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_of_one_priority_take_turns_and_a_higher_one_goes_first() {
    let bench = Bench::new(rules()).await;
    let jobs = [bench.job(1 << 16, |_| ()).await, bench.job(1 << 16, |_| ()).await];
    let worker = bench.worker().await;
    let mut taken = [0_u32, 0];
    for _ in 0..10 {
        for lease in bench.take(&worker, 4).await {
            taken[usize::from(lease.job == jobs[1])] += 1;
            bench.bring(&lease, Spread::Still).await;
        }
        sleep(10).await;
    }
    assert!(taken[0].abs_diff(taken[1]) <= 8 && taken[0] + taken[1] > 30, "{taken:?}");
    let urgent = bench.job(1 << 16, |r| r.priority = Some(1)).await;
    assert!(bench.take(&worker, 4).await.iter().all(|lease| lease.job == urgent));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lost_sum_fails_its_job_with_the_reason() {
    let bench = Bench::new(Rules { fresh_bytes: 0, ..rules() }).await;
    let job = bench.job(1000, |_| ()).await;
    let worker = bench.worker().await;
    let leases = bench.take(&worker, 8).await;
    // Past the checkpoint: it waits as a blob.
    let early = leases.iter().find(|lease| lease.batch.block.index == 1).unwrap();
    bench.bring(early, Spread::Noisy).await;
    sleep(50).await;
    let folder = crate::blobs::BlobFolder::Partials(job.clone());
    bench.farm.blobs.delete_all(&folder).await.unwrap();
    for lease in leases.iter().filter(|lease| lease.batch.block.index == 0) {
        bench.bring(lease, Spread::Noisy).await;
    }
    let status = bench.until_settled(&job, JobState::Failed).await;
    assert!(status.reason.unwrap().contains("is lost"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_that_fails_rests_while_others_work() {
    let bench = Bench::new(Rules { rest: Duration::from_millis(150), ..rules() }).await;
    let job = bench.job(1000, |_| ()).await;
    let (bad, good) = (bench.worker().await, bench.worker().await);
    let failure = LeaseFailure { reason: "no disk".to_owned(), kind: FailureKind::Worker };
    let lease = bench.take(&bad, 1).await.remove(0);
    bench.farm.give_back(&lease.id, failure).await.unwrap();
    assert!(bench.take(&bad, 1).await.is_empty());
    assert_eq!(bench.take(&good, 1).await[0].batch, lease.batch);
    sleep(200).await;
    let lease = bench.take(&bad, 1).await.remove(0);
    bench.bring(&lease, Spread::Noisy).await;
    assert_eq!(bench.take(&bad, 1).await.len(), 1);
    bench.farm.cancel(&job).await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_batch_that_kills_its_workers_fails_its_job_in_the_end() {
    let rules = Rules { lease: Duration::from_millis(20), losses: 4, ..rules() };
    let bench = Bench::new(rules).await;
    let job = bench.job(1000, |_| ()).await;
    for n in 1..=4 {
        assert!(!bench.farm.status(&job).await.unwrap().state.is_over(), "before {n}");
        let worker = bench.worker().await;
        bench.take(&worker, 1).await;
        sleep(100).await;
    }
    let status = bench.until_settled(&job, JobState::Failed).await;
    assert!(status.reason.unwrap().contains("lost its worker 4 times"));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_goes_on_with_its_lease_when_the_farm_is_back() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(1000, |_| ()).await;
    let worker = bench.worker().await;
    let lease = bench.take(&worker, 1).await.remove(0);
    let bench = bench.crash().await;
    assert!(bench.beat(&worker, &lease).await, "it still has it");
    assert_eq!(bench.bring(&lease, Spread::Noisy).await, Commit::Accepted);
    bench.work(&worker, Spread::Noisy).await;
    bench.until_settled(&job, JobState::Done).await;
}

//! Workers that fail, leave, or are not heard of.

use super::bench::{Bench, Spread, rules};
use crate::farm::{error::FarmError, rules::Rules};
use ovtigre_proto::{
    lease::{Commit, Exchange, FailureKind, Lease, LeaseFailure, LeaseProgress},
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
async fn a_lease_whose_answer_was_lost_is_given_out_again_at_the_next_beat() {
    let bench = Bench::new(rules()).await;
    bench.job(1000, |_| ()).await;
    let (worker, other) = (bench.worker().await, bench.worker().await);
    let beat = |beat, wants, holding: &[&Lease]| {
        let progress = |lease: &&Lease| LeaseProgress { lease: lease.id.clone(), done: 0.0 };
        let holding = holding.iter().map(progress).collect();
        bench.farm.exchange(&worker, Exchange { wants, holding, beat, ..Exchange::default() })
    };
    let lost = beat(1, 2, &[]).await.unwrap().leases;
    // The same exchange once more, as a line that repeats itself does: it says nothing of what was handed out since.
    let kept = beat(1, 1, &[]).await.unwrap().leases;
    assert!(!lost.contains(&kept[0]));
    beat(2, 0, &[&kept[0]]).await.unwrap();
    let again = bench.take(&other, 3).await;
    assert_eq!((again[0].batch, again[1].batch), (lost[0].batch, lost[1].batch));
    assert!(again.iter().all(|lease| lease.batch != kept[0].batch), "what is held stays");
    assert_eq!(bench.bring(&kept[0], Spread::Noisy).await, Commit::Accepted);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_that_misses_two_beats_loses_what_it_holds_long_before_its_leases_end() {
    let bench = Bench::new(Rules { missed: Duration::from_millis(100), ..rules() }).await;
    bench.job(1000, |_| ()).await;
    let (dead, other) = (bench.worker().await, bench.worker().await);
    let lost = bench.take(&dead, 2).await;
    let kept = bench.take(&other, 1).await;
    for _ in 0..10 {
        sleep(30).await;
        assert!(bench.beat(&other, &kept[0]).await, "who beats keeps what it holds");
    }
    let again = bench.take(&other, 2).await;
    assert_eq!((again[0].batch, again[1].batch), (lost[0].batch, lost[1].batch));
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
    assert_eq!(bench.farm.scaling().await.unwrap().active_workers, 0);
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
async fn a_job_that_cannot_be_rendered_fails_after_three_tries_with_the_workers_reason() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(1000, |_| ()).await;
    let worker = bench.worker().await;
    let failure = LeaseFailure { reason: "no camera 7".to_owned(), kind: FailureKind::Job };
    for n in 1..=3 {
        assert!(!bench.farm.status(&job).await.unwrap().state.is_over(), "before {n}");
        let lease = bench.take(&worker, 1).await.remove(0);
        bench.farm.give_back(&lease.id, failure.clone()).await.unwrap();
    }
    let status = bench.until_settled(&job, JobState::Failed).await;
    assert_eq!(status.reason.as_deref(), Some("no camera 7"));
}

#[tokio::test(flavor = "multi_thread")]
async fn one_worker_alone_among_several_fails_no_job() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(1000, |_| ()).await;
    let (bad, good) = (bench.worker().await, bench.worker().await);
    let failure = LeaseFailure { reason: "what I cannot read".to_owned(), kind: FailureKind::Job };
    let mut seen = std::collections::BTreeSet::new();
    for _ in 0..20 {
        for lease in bench.take(&bad, 1).await {
            assert!(seen.insert(format!("{:?}", lease.batch)), "a batch comes back to who failed at it");
            bench.farm.give_back(&lease.id, failure.clone()).await.unwrap();
        }
    }
    assert!(!seen.is_empty() && !bench.farm.status(&job).await.unwrap().state.is_over());
    bench.work(&good, Spread::Noisy).await;
    bench.until_settled(&job, JobState::Done).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_batch_that_fails_on_three_workers_fails_its_job() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(1000, |_| ()).await;
    let workers = [bench.worker().await, bench.worker().await, bench.worker().await, bench.worker().await];
    let failure = LeaseFailure { reason: "no such mesh".to_owned(), kind: FailureKind::Job };
    let mut batches = std::collections::BTreeSet::new();
    for worker in &workers[..3] {
        assert!(!bench.farm.status(&job).await.unwrap().state.is_over());
        let lease = bench.take(worker, 1).await.remove(0);
        batches.insert(format!("{:?}", lease.batch));
        bench.farm.give_back(&lease.id, failure.clone()).await.unwrap();
    }
    assert_eq!(batches.len(), 1, "it goes to another at once");
    let status = bench.until_settled(&job, JobState::Failed).await;
    assert_eq!(status.reason.as_deref(), Some("no such mesh"));
    assert_eq!(bench.farm.worker(&workers[0]).await.unwrap().state, WorkerState::Active, "not their fault");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_worker_that_fails_at_several_jobs_is_put_aside_and_bad_jobs_put_nobody_aside() {
    let bench = Bench::new(rules()).await;
    let (bad, good) = (bench.worker().await, bench.worker().await);
    let failure = |kind| LeaseFailure { reason: "no memory".to_owned(), kind };
    let mut jobs = Vec::new();
    for n in 0..3 {
        jobs.push(bench.job(1000, |r| r.priority = Some(n)).await);
        let held = bench.take(&bad, 2).await;
        bench.farm.give_back(&held[0].id, failure(FailureKind::Worker)).await.unwrap();
        if n < 2 {
            bench.farm.give_back(&held[1].id, failure(FailureKind::HandedBack)).await.unwrap();
        }
    }
    let status = bench.farm.worker(&bad).await.unwrap();
    assert_eq!((status.state, status.leases), (WorkerState::Aside, 0));
    assert!(status.reason.unwrap().contains("3 jobs"));
    let reply = bench.farm.exchange(&bad, Exchange { wants: 4, ..Exchange::default() }).await.unwrap();
    assert!(reply.leases.is_empty() && !reply.drain, "it stays, and gets nothing");
    let bench = bench.crash().await;
    assert!(bench.take(&bad, 4).await.is_empty(), "nor after a restart");
    bench.work(&good, Spread::Noisy).await;
    for job in &jobs {
        bench.until_settled(job, JobState::Done).await;
    }
    // Jobs that nobody can render do not cost the farm its workers.
    let third = bench.worker().await;
    for _ in 0..4 {
        let job = bench.job(1000, |_| ()).await;
        for worker in [&good, &third, &good] {
            for lease in bench.take(worker, 1).await {
                bench.farm.give_back(&lease.id, failure(FailureKind::Job)).await.unwrap();
            }
        }
        bench.farm.cancel(&job).await.unwrap();
    }
    for worker in [&good, &third] {
        assert_eq!(bench.farm.worker(worker).await.unwrap().state, WorkerState::Active);
    }
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

/// What becomes of a file.
#[derive(Clone, Copy, Debug)]
enum Harm {
    Removed,
    Cut,
    OneBitFlipped,
}

impl Harm {
    fn to(self, file: &std::path::Path) {
        let mut bytes = std::fs::read(file).unwrap();
        let middle = bytes.len() / 2;
        match self {
            Self::Removed => return std::fs::remove_file(file).unwrap(),
            Self::Cut => bytes.truncate(middle),
            Self::OneBitFlipped => bytes[middle] ^= 1,
        }
        std::fs::write(file, bytes).unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn sums_that_are_lost_or_damaged_on_the_disk_are_rendered_again() {
    let calm = Bench::new(rules()).await;
    let job = calm.job(4000, |_| ()).await;
    calm.work(&calm.worker().await, Spread::Noisy).await;
    calm.until_settled(&job, JobState::Done).await;
    let expected = calm.pixels(&job).await;
    for harm in [Harm::Removed, Harm::Cut, Harm::OneBitFlipped] {
        // Whoever comes after a crash appends when the mandate of the one before has ended.
        let (mandate, keep_mandate) = (Duration::from_millis(400), Duration::from_millis(50));
        let rules = Rules { fresh_bytes: 0, partials_kept: 2, mandate, keep_mandate, ..rules() };
        let mut bench = Bench::new(rules).await;
        let job = bench.job(4000, |_| ()).await;
        let mut harmed = 0;
        for round in 0..6 {
            let worker = bench.worker().await;
            for lease in bench.take(&worker, 7).await {
                bench.bring(&lease, Spread::Noisy).await;
            }
            sleep(30).await;
            // Files of either kind: partials, and lanes as one blob.
            let files = bench.paths(&job);
            for file in files.iter().skip(round % 2).step_by(3) {
                // A lane's sums have no check of their own but their length.
                let partial = file.extension().is_some();
                let harm = if partial { harm } else { Harm::Cut };
                harm.to(file);
                harmed += 1;
            }
            bench = bench.crash().await;
        }
        assert!(harmed > 6, "{harmed}");
        let worker = bench.worker().await;
        for _ in 0..50 {
            bench.work(&worker, Spread::Noisy).await;
            if bench.farm.live(&job).is_none() {
                break;
            }
        }
        let status = bench.until_settled(&job, JobState::Done).await;
        assert_eq!(status.batches_done, status.batches_asked, "{harm:?}");
        assert_eq!(bench.pixels(&job).await, expected, "{harm:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_refused_sum_is_a_failure_and_goes_to_another() {
    let bench = Bench::new(rules()).await;
    bench.job(1000, |_| ()).await;
    let (bad, good) = (bench.worker().await, bench.worker().await);
    let lease = bench.take(&bad, 1).await.remove(0);
    let mut wrong = super::bench::sum(lease.batch, Spread::Noisy);
    wrong.planes[0][0][0] = f32::NAN;
    let refused = bench.bring_sum(&lease, &wrong).await.unwrap_err();
    assert!(matches!(&refused, FarmError::Sum(_)), "{refused}");
    assert_eq!(bench.farm.worker(&bad).await.unwrap().failures, 1);
    assert_eq!(bench.take(&good, 1).await[0].batch, lease.batch);
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

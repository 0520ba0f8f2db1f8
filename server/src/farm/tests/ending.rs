//! How jobs end.

use super::bench::{Bench, Spread, rules};
use ovtigre_proto::{job::JobPatch, lease::Commit, status::JobState};
use std::time::Duration;

#[tokio::test(flavor = "multi_thread")]
async fn a_job_stops_at_the_first_checkpoint_that_certifies_its_error() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(1 << 20, |r| r.error = Some(0.02)).await;
    let worker = bench.worker().await;
    bench.work(&worker, Spread::Noisy).await;
    let status = bench.until_settled(&job, JobState::Done).await;
    assert!(status.certified, "{:?}", status.reason);
    assert!(status.samples_done < f64::from(status.samples_asked));
    let curve = bench.farm.curve(&job).await.unwrap();
    let upper = |row: &ovtigre_proto::curve::CurveRow| row.relative_error_upper.unwrap();
    let (last, before) = curve.rows.split_last().unwrap();
    assert!(upper(last) <= 0.02 && before.iter().all(|row| upper(row) > 0.02), "{curve:?}");
    assert_eq!(last.samples, status.samples_done.round() as u32, "all replicates are equally long");
    assert!(curve.certified);

    let again = bench.job(1 << 20, |r| r.error = Some(0.02)).await;
    bench.work(&worker, Spread::Noisy).await;
    bench.until_settled(&again, JobState::Done).await;
    assert_eq!(bench.pixels(&job).await, bench.pixels(&again).await);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_picture_that_is_black_so_far_proves_nothing_and_a_still_one_does() {
    let bench = Bench::new(rules()).await;
    let worker = bench.worker().await;
    let black = bench.job(4000, |r| r.error = Some(0.5)).await;
    bench.work(&worker, Spread::Black).await;
    let status = bench.until_settled(&black, JobState::Done).await;
    assert_eq!((status.certified, status.samples_done), (false, 4000.0));
    let still = bench.job(4000, |r| r.error = Some(0.5)).await;
    bench.work(&worker, Spread::Still).await;
    let status = bench.until_settled(&still, JobState::Done).await;
    assert!(status.certified && status.samples_done < 4000.0);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_ends_at_its_deadline_with_what_is_there() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(1 << 20, |r| r.seconds = Some(0.3)).await;
    let worker = bench.worker().await;
    for lease in bench.take(&worker, 5).await {
        bench.bring(&lease, Spread::Noisy).await;
    }
    let status = bench.until_settled(&job, JobState::Done).await;
    assert_eq!(status.reason.as_deref(), Some("the time was over"));
    assert!((0.3..1.5).contains(&status.wall_seconds), "{}", status.wall_seconds);
    assert_eq!(status.batches_done, 5, "the fifth is past the first checkpoint, and in");
    assert_eq!(status.error.unwrap().samples, status.samples_done.round() as u32, "a last row of the curve");
    assert!(bench.take(&worker, 5).await.is_empty());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_deadline_waits_for_a_first_picture() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(1 << 20, |r| r.seconds = Some(0.02)).await;
    let worker = bench.worker().await;
    let leases = bench.take(&worker, 1).await;
    tokio::time::sleep(Duration::from_millis(100)).await;
    assert_eq!(bench.farm.status(&job).await.unwrap().state, JobState::Running);
    assert_eq!(bench.bring(&leases[0], Spread::Noisy).await, Commit::Accepted);
    let status = bench.until_settled(&job, JobState::Done).await;
    assert_eq!(status.batches_done, 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cancelled_job_keeps_its_picture_and_takes_no_more() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(1 << 20, |_| ()).await;
    let worker = bench.worker().await;
    let leases = bench.take(&worker, 6).await;
    for lease in &leases[..4] {
        bench.bring(lease, Spread::Noisy).await;
    }
    bench.until(&job, |s| s.batches_done == 4).await;
    let before = bench.pixels(&job).await;
    bench.farm.cancel(&job).await.unwrap();
    let status = bench.until_settled(&job, JobState::Cancelled).await;
    assert!(status.ended_at.is_some());
    assert!(!bench.beat(&worker, &leases[4]).await, "its lease is to be dropped");
    assert_eq!(bench.bring(&leases[4], Spread::Noisy).await, Commit::NotNeeded);
    assert_eq!(bench.pixels(&job).await, before);
    bench.farm.cancel(&job).await.unwrap();
    let bench = bench.crash().await;
    assert_eq!(bench.pixels(&job).await, before);
    bench.assert_only_a_picture(&job);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_cancelled_before_its_first_batch_has_no_picture() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(100, |_| ()).await;
    bench.farm.cancel(&job).await.unwrap();
    bench.until_settled(&job, JobState::Cancelled).await;
    assert!(matches!(bench.farm.exr(&job).await, Err(crate::farm::error::FarmError::NeverPicture(_))));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_purged_job_leaves_nothing() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(1 << 20, |_| ()).await;
    let worker = bench.worker().await;
    for lease in bench.take(&worker, 6).await {
        bench.bring(&lease, Spread::Noisy).await;
    }
    bench.farm.purge(&job).await.unwrap();
    assert!(bench.farm.status(&job).await.is_err());
    tokio::time::sleep(Duration::from_millis(50)).await;
    assert_eq!(bench.files(&job), Vec::<String>::new());
    assert!(bench.farm.purge(&job).await.is_err());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_paused_job_hands_out_nothing_and_its_time_stands_still() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(4000, |_| ()).await;
    let worker = bench.worker().await;
    let patch = |state| JobPatch { state: Some(state), ..JobPatch::default() };
    let leases = bench.take(&worker, 1).await;
    let paused = bench.farm.patch(&job, &patch(JobState::Paused), None).await.unwrap();
    assert_eq!(paused.state, JobState::Paused);
    assert!(bench.take(&worker, 4).await.is_empty());
    assert!(bench.beat(&worker, &leases[0]).await, "what is in hands is finished");
    assert_eq!(bench.bring(&leases[0], Spread::Noisy).await, Commit::Accepted);
    tokio::time::sleep(Duration::from_millis(300)).await;
    let stands = bench.farm.status(&job).await.unwrap().wall_seconds;
    assert!(stands < 0.2, "{stands}");
    let bench = bench.crash().await;
    assert!(bench.take(&bench.worker().await, 4).await.is_empty(), "paused after a restart, too");
    let going = bench.farm.patch(&job, &patch(JobState::Running), None).await.unwrap();
    assert_eq!(going.state, JobState::Running);
    assert!(going.wall_seconds < 0.25, "{}", going.wall_seconds);
    bench.work(&bench.worker().await, Spread::Noisy).await;
    bench.until_settled(&job, JobState::Done).await;
    assert!(bench.farm.patch(&job, &patch(JobState::Paused), None).await.is_err(), "it is over");
}

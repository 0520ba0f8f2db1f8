//! More of a job than was asked for at first.

use super::bench::{Bench, Spread, rules};
use crate::farm::{error::FarmError, rules::Rules};
use ovtigre_proto::{
    job::JobPatch,
    status::{JobState, JobStatus},
};

fn keeping() -> Rules {
    Rules { kept_sums_bytes: 1 << 30, partials_kept: 3, ..rules() }
}

fn samples(n: u32) -> JobPatch {
    JobPatch { samples: Some(n), ..JobPatch::default() }
}

/// The picture's bits, and its curve without times.
async fn outcome(bench: &Bench, status: &JobStatus) -> (Vec<(String, Vec<u32>)>, Vec<(u32, Option<f64>)>) {
    let curve = bench.farm.curve_rows(&status.id).await.unwrap();
    let rows = curve.iter().map(|row| (row.samples, row.relative_error)).collect();
    (bench.pixels(&status.id).await, rows)
}

async fn at_once(n: u32) -> (Vec<(String, Vec<u32>)>, Vec<(u32, Option<f64>)>) {
    let bench = Bench::new(rules()).await;
    let job = bench.job(n, |_| ()).await;
    bench.work(&bench.worker().await, Spread::Noisy).await;
    outcome(&bench, &bench.until_settled(&job, JobState::Done).await).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_that_is_done_goes_on_with_the_bits_of_one_asked_for_at_once() {
    // Without a tail, with one, and with nothing but one.
    for (first, then) in [(4096, 20_000), (5_000, 9_999), (100, 3_000)] {
        let bench = Bench::new(keeping()).await;
        let job = bench.job(first, |_| ()).await;
        let worker = bench.worker().await;
        bench.work(&worker, Spread::Noisy).await;
        let short = bench.until_settled(&job, JobState::Done).await;
        assert_eq!(bench.farm.exr(&job).await.unwrap().0.len(), 64);
        let bench = bench.crash().await;
        let going = bench.farm.patch(&job, &samples(then), None).await.unwrap();
        assert_eq!((going.state, going.samples_asked), (JobState::Queued, then / 4 * 4));
        let brought = bench.work(&worker, Spread::Noisy).await as u64;
        let long = bench.until_settled(&job, JobState::Done).await;
        assert_eq!(long.batches_done, long.batches_asked);
        let kept = long.batches_asked - brought;
        assert!(first == 100 || 2 * kept >= short.batches_asked, "{kept} of {} kept", short.batches_asked);
        assert_eq!(outcome(&bench, &long).await, at_once(then).await, "{first} then {then}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_whose_sums_are_gone_is_rendered_again_from_its_beginning() {
    let bench = Bench::new(keeping()).await;
    let job = bench.job(4096, |_| ()).await;
    let worker = bench.worker().await;
    bench.work(&worker, Spread::Noisy).await;
    bench.until_settled(&job, JobState::Done).await;
    let kept: Vec<_> = bench.paths(&job).into_iter().filter(|path| path.extension().is_none()).collect();
    assert_eq!(kept.len(), 4);
    std::fs::remove_file(&kept[1]).unwrap();
    bench.farm.patch(&job, &samples(8192), None).await.unwrap();
    bench.work(&worker, Spread::Noisy).await;
    let long = bench.until_settled(&job, JobState::Done).await;
    assert_eq!(outcome(&bench, &long).await, at_once(8192).await);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_at_work_gets_more_samples_while_batches_are_in_hands() {
    let bench = Bench::new(keeping()).await;
    let job = bench.job(5_000, |_| ()).await;
    let worker = bench.worker().await;
    let mut hands = Vec::new();
    for _ in 0..100 {
        hands.extend(bench.take(&worker, 6).await);
        if hands.len() > 3 {
            let rest = hands.split_off(3);
            for lease in std::mem::replace(&mut hands, rest) {
                bench.bring(&lease, Spread::Noisy).await;
            }
        }
        if bench.farm.status(&job).await.unwrap().samples_done > 4_900.0 {
            break;
        }
        tokio::time::sleep(std::time::Duration::from_millis(3)).await;
    }
    bench.farm.patch(&job, &samples(9_000), None).await.unwrap();
    for lease in &hands {
        // Of a block that there is no more, or that is as it was.
        bench.bring_sum(lease, &super::bench::layered(lease, Spread::Noisy)).await.ok();
    }
    bench.work(&worker, Spread::Noisy).await;
    let long = bench.until_settled(&job, JobState::Done).await;
    assert_eq!(outcome(&bench, &long).await, at_once(9_000).await);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_smaller_error_goes_on_and_what_cannot_be_is_refused() {
    let bench = Bench::new(keeping()).await;
    let error = |error| JobPatch { error: Some(error), ..JobPatch::default() };
    let job = bench.job(1 << 16, |r| r.error = Some(0.1)).await;
    let worker = bench.worker().await;
    bench.work(&worker, Spread::Noisy).await;
    let first = bench.until_settled(&job, JobState::Done).await;
    assert!(first.certified);
    assert!(matches!(bench.farm.patch(&job, &error(0.2), None).await, Err(FarmError::Patch(_))));
    assert!(matches!(bench.farm.patch(&job, &samples(100), None).await, Err(FarmError::Patch(_))));
    assert!(matches!(
        bench.farm.patch(&job, &error(0.03), Some(vec![1])).await,
        Err(FarmError::Version { .. })
    ));
    let going = bench.farm.patch(&job, &error(0.03), None).await.unwrap();
    assert!(!going.certified && going.reason.is_none() && going.version > first.version);
    bench.work(&worker, Spread::Noisy).await;
    let second = bench.until_settled(&job, JobState::Done).await;
    assert!(second.certified && second.samples_done > first.samples_done);

    let once = Bench::new(rules()).await;
    let all = once.job(1 << 16, |r| r.error = Some(0.03)).await;
    once.work(&once.worker().await, Spread::Noisy).await;
    once.until_settled(&all, JobState::Done).await;
    assert_eq!(bench.pixels(&job).await, once.pixels(&all).await);

    let full = bench.job(400, |_| ()).await;
    bench.work(&worker, Spread::Noisy).await;
    bench.until_settled(&full, JobState::Done).await;
    match bench.farm.patch(&full, &error(0.001), None).await {
        Err(FarmError::Patch(faults)) => assert!(faults[0].detail.contains("all 400"), "{faults:?}"),
        other => panic!("{other:?}"),
    }
    let cancelled = bench.job(400, |_| ()).await;
    bench.farm.cancel(&cancelled).await.unwrap();
    bench.until_settled(&cancelled, JobState::Cancelled).await;
    assert!(matches!(bench.farm.patch(&cancelled, &samples(800), None).await, Err(FarmError::Over { .. })));
}

//! The same job gives the same picture, whatever happens on the way.

use super::bench::{Bench, Spread, rules, sum};
use crate::farm::rules::Rules;
use ovtigre_proto::{
    lease::{Commit, Lease},
    status::JobState,
};
use std::collections::BTreeSet;

const SAMPLES: u32 = 4000;

async fn undisturbed() -> Vec<(String, Vec<u32>)> {
    let bench = Bench::new(rules()).await;
    let job = bench.job(SAMPLES, |_| ()).await;
    let worker = bench.worker().await;
    bench.work(&worker, Spread::Noisy).await;
    bench.until_settled(&job, JobState::Done).await;
    bench.pixels(&job).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_is_done_with_all_its_samples_and_a_curve() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(SAMPLES, |_| ()).await;
    let worker = bench.worker().await;
    let status = bench.farm.status(&job).await.unwrap();
    assert_eq!((status.state, status.samples_asked), (JobState::Queued, SAMPLES));
    let brought = bench.work(&worker, Spread::Noisy).await;
    let status = bench.until_settled(&job, JobState::Done).await;
    assert_eq!(brought as u64, status.batches_asked, "every batch once");
    assert_eq!((status.batches_done, status.samples_done), (status.batches_asked, f64::from(SAMPLES)));
    assert_eq!(status.invalid_samples, status.batches_asked, "one each");
    assert!((status.worker_seconds - 1e-3 * f64::from(SAMPLES)).abs() < 1e-9);
    assert_eq!(status.rays, 1200 * u64::from(SAMPLES));
    bench.assert_only_a_picture(&job);

    let curve = bench.farm.curve(&job).await.unwrap();
    let samples: Vec<u32> = curve.rows.iter().map(|row| row.samples).collect();
    assert!(samples.windows(2).all(|w| w[1] >= 2 * w[0] || w[1] == SAMPLES), "{samples:?}");
    // σ of a sample is 1/√3; the relative error of grey 1 is σ / √(1.01 n).
    let expected = (1.0 / (3.0 * 1.01 * f64::from(SAMPLES))).sqrt();
    let error = curve.rows.last().unwrap().relative_error.unwrap();
    // Mean of 3600 variances with 3 degrees of freedom: standard deviation 1.4 % of the variance.
    assert!((error / expected - 1.0).abs() < 0.025, "{error} is not {expected}");
    assert!((curve.slope.unwrap() + 0.5).abs() < 0.05, "{:?}", curve.slope);
    assert!(!curve.certified);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_order_of_arrival_changes_no_bit() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(SAMPLES, |_| ()).await;
    let worker = bench.worker().await;
    // Always many in hands, and the last taken are brought first.
    let mut hands: Vec<Lease> = Vec::new();
    let mut taken = BTreeSet::new();
    loop {
        let leases = bench.take(&worker, 16).await;
        assert!(leases.iter().all(|l| taken.insert((l.batch.replicate, l.batch.block.index))), "twice");
        hands.extend(leases);
        let half = hands.len() / 2;
        if hands.is_empty() {
            if bench.farm.live(&job).is_none() {
                break;
            }
            tokio::time::sleep(std::time::Duration::from_millis(5)).await;
            continue;
        }
        for lease in hands.split_off(half).into_iter().rev() {
            assert_eq!(bench.bring(&lease, Spread::Noisy).await, Commit::Accepted);
        }
    }
    assert_eq!(bench.pixels(&job).await, undisturbed().await);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_farm_that_is_killed_again_and_again_counts_nothing_twice() {
    // Few partials are kept, so that blobs of sums come into it.
    let rules = Rules { partials_kept: 2, ..rules() };
    let mut bench = Bench::new(rules).await;
    let job = bench.job(SAMPLES, |_| ()).await;
    let mut hands: Vec<Lease> = Vec::new();
    let mut n = 0;
    while bench.farm.live(&job).is_some() {
        let worker = bench.worker().await;
        hands.extend(bench.take(&worker, 5).await);
        while hands.len() > 2 {
            let lease = hands.remove(hands.len() / 2);
            bench.bring(&lease, Spread::Noisy).await;
            n += 1;
            if n % 3 == 0 {
                bench = bench.crash().await;
            }
        }
        // The last ones: nothing more comes.
        if let Some(lease) = hands.pop() {
            bench.bring(&lease, Spread::Noisy).await;
        }
        tokio::time::sleep(std::time::Duration::from_millis(5)).await;
    }
    let status = bench.until_settled(&job, JobState::Done).await;
    assert_eq!(status.batches_done, status.batches_asked);
    assert!((status.worker_seconds - 1e-3 * f64::from(SAMPLES)).abs() < 1e-9);
    assert_eq!(bench.pixels(&job).await, undisturbed().await);
    bench.assert_only_a_picture(&job);
    assert!(n > 10, "the farm was hardly killed");
}

#[tokio::test(flavor = "multi_thread")]
async fn sums_that_do_not_fit_in_memory_together_are_read_again() {
    // Room for one job's sums at a time, and for no decoded sum.
    let rules = Rules { sums_bytes: 1200 * 4 * 24, fresh_bytes: 0, ..rules() };
    let bench = Bench::new(rules).await;
    let jobs = [bench.job(SAMPLES, |_| ()).await, bench.job(SAMPLES, |_| ()).await];
    let worker = bench.worker().await;
    bench.work(&worker, Spread::Noisy).await;
    for job in &jobs {
        bench.until_settled(job, JobState::Done).await;
        assert_eq!(bench.pixels(job).await, undisturbed().await);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_second_sum_is_compared_and_the_first_stays() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(SAMPLES, |_| ()).await;
    let worker = bench.worker().await;
    let leases = bench.take(&worker, 2).await;
    assert_eq!(bench.bring(&leases[0], Spread::Noisy).await, Commit::Accepted);
    assert_eq!(bench.bring(&leases[0], Spread::Noisy).await, Commit::Duplicate);
    assert_eq!(bench.bring(&leases[0], Spread::Still).await, Commit::NotNeeded);
    assert_eq!(bench.farm.counters.batches(crate::farm::counters::Fate::Disagreeing), 1);
    assert_eq!(bench.bring(&leases[1], Spread::Noisy).await, Commit::Accepted);
    bench.work(&worker, Spread::Noisy).await;
    bench.until_settled(&job, JobState::Done).await;
    assert_eq!(bench.pixels(&job).await, undisturbed().await);
    assert_eq!(bench.bring(&leases[0], Spread::Still).await, Commit::NotNeeded, "the job is over");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_sum_of_another_batch_job_or_size_is_refused() {
    let bench = Bench::new(rules()).await;
    bench.job(SAMPLES, |_| ()).await;
    bench.job(SAMPLES, |_| ()).await;
    let worker = bench.worker().await;
    let leases = bench.take(&worker, 8).await;
    let other_job = leases.iter().find(|l| l.job != leases[0].job).unwrap();
    let lease = &leases[0];
    let mine = leases.iter().rfind(|l| l.job == lease.job).unwrap();
    assert!(bench.bring_sum(lease, &sum(mine.batch, Spread::Noisy)).await.is_err(), "another batch");
    let foreign = super::bench::partial(other_job, &sum(lease.batch, Spread::Noisy));
    assert!(bench.farm.commit(&lease.id, foreign, std::time::Duration::ZERO).await.is_err(), "another job");
    let mut infinite = sum(lease.batch, Spread::Noisy);
    infinite.planes[0][3][1] = f32::INFINITY;
    assert!(bench.bring_sum(lease, &infinite).await.is_err(), "not finite");
    let mut layered = sum(lease.batch, Spread::Noisy);
    layered.planes.push(layered.planes[0].clone());
    assert!(bench.bring_sum(lease, &layered).await.is_err(), "another layer");
    assert_eq!(bench.bring(lease, Spread::Noisy).await, Commit::Accepted, "none of that was taken");
    let name = lease.id.as_str().rsplitn(3, '_').nth(2).unwrap().to_owned();
    let mut never = lease.clone();
    never.id = format!("{name}_9_0").parse().unwrap();
    assert!(bench.bring_sum(&never, &sum(lease.batch, Spread::Noisy)).await.is_err(), "never handed out");
}

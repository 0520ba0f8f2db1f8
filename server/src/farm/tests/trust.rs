//! Workers whose sums are wrong.

use super::bench::{Bench, Spread, rules};
use crate::farm::rules::Rules;
use ovtigre_proto::{
    id::WorkerId,
    lease::Commit,
    status::{JobState, WorkerState},
};

fn audited() -> Rules {
    Rules { audit: 1.0, ..rules() }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_batch_is_rendered_again_by_another_and_only_compared() {
    let bench = Bench::new(audited()).await;
    let job = bench.job(400, |_| ()).await;
    let (a, b) = (bench.worker().await, bench.worker().await);
    let first = bench.take(&a, 1).await.remove(0);
    assert_eq!(bench.bring(&first, Spread::Noisy).await, Commit::Accepted);
    assert!(bench.take(&a, 9).await.iter().all(|lease| lease.batch != first.batch), "not by the same");
    let again = bench.take(&b, 1).await.remove(0);
    assert_eq!((again.batch, again.job == job), (first.batch, true));
    assert!(bench.beat(&b, &again).await, "it is a lease like any other");
    assert_eq!(bench.bring(&again, Spread::Noisy).await, Commit::Duplicate);
    assert_eq!(bench.farm.worker(&a).await.unwrap().state, WorkerState::Active);
}

/// What each of three workers brings of one batch, and who is put aside.
async fn trial(spreads: [Spread; 3]) -> Vec<WorkerState> {
    let bench = Bench::new(audited()).await;
    let calm = Bench::new(rules()).await;
    let expected = {
        let job = calm.job(4000, |_| ()).await;
        calm.work(&calm.worker().await, Spread::Noisy).await;
        calm.until_settled(&job, JobState::Done).await;
        calm.pixels(&job).await
    };
    let job = bench.job(4000, |_| ()).await;
    let workers: [WorkerId; 3] = [bench.worker().await, bench.worker().await, bench.worker().await];
    // The first brings several batches; all of them are doubtful where one is wrong.
    for lease in bench.take(&workers[0], 6).await {
        bench.bring(&lease, spreads[0]).await;
    }
    bench.until(&job, |s| s.batches_done >= 4).await;
    let lease = bench.take(&workers[1], 1).await.remove(0);
    bench.bring(&lease, spreads[1]).await;
    // Comparisons go first: the last one that was asked for decides.
    for lease in bench.take(&workers[2], 6).await {
        bench.bring(&lease, spreads[2]).await;
    }
    let mut states = Vec::new();
    for worker in &workers {
        states.push(bench.farm.worker(worker).await.unwrap().state);
    }
    let honest = (0..3).find(|i| states[*i] == WorkerState::Active && spreads[*i] == Spread::Noisy).unwrap();
    bench.work(&workers[honest], Spread::Noisy).await;
    let status = bench.until_settled(&job, JobState::Done).await;
    assert_eq!(status.batches_done, status.batches_asked);
    assert_eq!(bench.pixels(&job).await, expected, "nothing wrong is in the picture");
    states
}

#[tokio::test(flavor = "multi_thread")]
async fn who_brings_a_wrong_sum_is_put_aside_and_its_batches_are_rendered_again() {
    let (fine, aside) = (WorkerState::Active, WorkerState::Aside);
    assert_eq!(Box::pin(trial([Spread::Still, Spread::Noisy, Spread::Noisy])).await, [aside, fine, fine]);
    assert_eq!(Box::pin(trial([Spread::Noisy, Spread::Still, Spread::Noisy])).await, [fine, aside, fine]);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_compared_is_chosen_by_chance() {
    for (share, expected) in [(0.0, 0..=0), (0.1, 5..=200), (1.0, 1000..=1000)] {
        let bench = Bench::new(Rules { audit: share, ..rules() }).await;
        let job = bench.farm.ids.job();
        let key = crate::store::row::BatchKey { block: 0, replicate: 0, region: 0 };
        let chosen = (0..1000).filter(|_| bench.farm.is_audited(&bench.farm.ids.lease(&job, key))).count();
        // Of 1000 with p = 0.1 the standard deviation is 9.5: 200 is ten of them away.
        assert!(expected.contains(&chosen), "{share}: {chosen}");
    }
}

//! Who gets which batches.

use super::bench::{Bench, Spread, rules};
use crate::farm::{error::FarmError, rules::Rules};
use ovtigre_proto::{lease::WorkerJoin, status::JobState};

#[tokio::test(flavor = "multi_thread")]
async fn jobs_of_one_priority_share_by_weight() {
    let bench = Bench::new(rules()).await;
    let jobs =
        [bench.job(1 << 18, |r| r.weight = Some(1)).await, bench.job(1 << 18, |r| r.weight = Some(3)).await];
    let worker = bench.worker().await;
    let mut taken = [0_u32; 2];
    for _ in 0..20 {
        for lease in bench.take(&worker, 4).await {
            taken[usize::from(lease.job == jobs[1])] += 1;
            bench.bring(&lease, Spread::Still).await;
        }
        tokio::time::sleep(std::time::Duration::from_millis(10)).await;
    }
    // Turns are of 4 and 12 batches: no share is off by more than a turn.
    let all = taken[0] + taken[1];
    assert!(all > 60 && taken[0].abs_diff(all / 4) <= 8, "{taken:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn tags_and_limits_of_a_job_are_kept() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(1 << 16, |r| (r.tags, r.max_workers) = (vec!["big".to_owned()], Some(2))).await;
    let plain = bench.worker().await;
    assert!(bench.take(&plain, 4).await.is_empty(), "it does not offer what the job needs");
    let mut big = Vec::new();
    for _ in 0..3 {
        big.push(bench.worker_as(|join| join.tags = vec!["big".to_owned(), "fast".to_owned()]).await);
    }
    let first = bench.take(&big[0], 2).await;
    assert_eq!((first.len(), &first[0].job), (2, &job));
    assert_eq!(bench.take(&big[1], 2).await.len(), 2);
    assert!(bench.take(&big[2], 2).await.is_empty(), "two have it");
    assert_eq!(bench.take(&big[0], 1).await.len(), 1, "those who have it may have more");
    for lease in first.iter().chain(&bench.take(&big[0], 0).await) {
        bench.bring(lease, Spread::Still).await;
    }
    let patch = ovtigre_proto::job::JobPatch { max_workers: Some(3), ..Default::default() };
    bench.farm.patch(&job, &patch, None).await.unwrap();
    assert_eq!(bench.take(&big[2], 2).await.len(), 2, "now three may");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_is_rendered_by_one_version_on_one_class_of_processors() {
    let bench = Bench::new(rules()).await;
    let job = bench.job(1 << 16, |_| ()).await;
    let class = |name: &'static str| move |join: &mut WorkerJoin| join.instruction_set = name.to_owned();
    let (a, b) = (bench.worker_as(class("v3")).await, bench.worker_as(class("v4")).await);
    assert_eq!(bench.farm.status(&job).await.unwrap().class, None);
    assert_eq!(bench.take(&a, 1).await.len(), 1);
    assert_eq!(bench.farm.status(&job).await.unwrap().class.as_deref(), Some("v3"));
    assert!(bench.take(&b, 4).await.is_empty());
    let bench = bench.crash().await;
    assert!(bench.take(&b, 4).await.is_empty(), "nor after a restart");
    let other = bench.job(1000, |_| ()).await;
    assert!(bench.take(&b, 4).await.iter().all(|lease| lease.job == other));
    // Another version is welcome only where a job of it is not over.
    let old = |join: &mut WorkerJoin| join.build = "0.0.1".to_owned();
    let mut join = join();
    old(&mut join);
    assert!(matches!(bench.farm.join(join).await, Err(FarmError::Worker(_))));
    bench.farm.cancel(&other).await.unwrap();
    bench.until_settled(&other, JobState::Cancelled).await;
    let mut bench = bench;
    bench.rules = Rules { build: "9.0", ..bench.rules };
    let bench = bench.crash().await;
    let new = bench.job(1000, |r| r.priority = Some(1)).await;
    let (now, before) =
        (bench.worker_as(|j| j.build = "9.0".to_owned()).await, bench.worker_as(class("v3")).await);
    assert!(bench.take(&now, 2).await.iter().all(|lease| lease.job == new));
    assert!(bench.take(&before, 2).await.iter().all(|lease| lease.job == job), "the old job is for the old");
}

fn join() -> WorkerJoin {
    WorkerJoin {
        name: "w".to_owned(),
        threads: 1,
        build: env!("CARGO_PKG_VERSION").to_owned(),
        instruction_set: "any".to_owned(),
        tags: Vec::new(),
    }
}

type Change<'a> = &'a dyn Fn(&mut WorkerJoin);

#[tokio::test]
async fn what_no_worker_is_does_not_join() {
    let bench = Bench::new(rules()).await;
    let cases: [(&str, Change<'_>); 7] = [
        ("/threads", &|j| j.threads = 0),
        ("/threads", &|j| j.threads = u32::MAX),
        ("/name", &|j| j.name = String::new()),
        ("/name", &|j| j.name = "a\u{1b}[31m".to_owned()),
        ("/instruction_set", &|j| j.instruction_set = String::new()),
        ("/build", &|j| j.build = "another".to_owned()),
        ("/tags/1", &|j| j.tags = vec!["a".to_owned(), "b\n".to_owned()]),
    ];
    for (pointer, change) in cases {
        let mut join = join();
        change(&mut join);
        match bench.farm.join(join).await {
            Err(FarmError::Worker(faults)) => assert_eq!(faults[0].pointer, pointer),
            other => panic!("{pointer}: {other:?}"),
        }
    }
    bench.farm.join(join()).await.unwrap();
}

//! What is kept, and whether it is there.

use super::bench::{Bench, Spread, rules};
use crate::farm::{check::check, keep::Kept, rules::Rules};
use ovtigre_proto::status::JobState;
use std::{fs, time::Duration};

#[tokio::test(flavor = "multi_thread")]
async fn jobs_that_are_over_are_kept_as_long_as_the_rules_say() {
    for (time, is_there) in
        [(None, true), (Some(Duration::from_hours(1)), true), (Some(Duration::ZERO), false)]
    {
        let kept = Kept { time, bytes: None };
        let bench = Bench::new(Rules { kept, ..rules() }).await;
        let worker = bench.worker().await;
        let done = bench.job(4, |_| ()).await;
        bench.work(&worker, Spread::Noisy).await;
        bench.until_settled(&done, JobState::Done).await;
        let waiting = bench.job(4, |_| ()).await;
        tokio::time::sleep(Duration::from_millis(5)).await;
        bench.farm.forget_old().await.unwrap();
        assert_eq!(bench.farm.status(&done).await.is_ok(), is_there, "{kept:?}");
        assert_eq!(!bench.files(&done).is_empty(), is_there, "{kept:?}");
        assert!(bench.farm.status(&waiting).await.is_ok(), "it is not over");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_lost_is_told_and_what_can_be_rendered_again() {
    let bench = Bench::new(rules()).await;
    let worker = bench.worker().await;
    let done = bench.job(4, |_| ()).await;
    bench.work(&worker, Spread::Noisy).await;
    bench.until_settled(&done, JobState::Done).await;
    let going = bench.job(1 << 20, |_| ()).await;
    for lease in bench.take(&worker, 3).await {
        bench.bring(&lease, Spread::Noisy).await;
    }
    let look = async || check(&*bench.farm.store, &bench.farm.blobs).await.unwrap();
    let all = look().await;
    assert_eq!((all.jobs, all.scenes), (2, 1));
    assert!(all.lost.is_empty() && all.again.is_empty(), "{all:?}");
    let partials = |path: &std::path::PathBuf| path.to_string_lossy().contains("partials");
    let partial = bench.paths(&going).into_iter().find(partials).expect("a partial");
    fs::remove_file(partial).unwrap();
    let some = look().await;
    assert!(some.lost.is_empty() && some.again.len() == 1 && some.again[0].contains("block"), "{some:?}");
    fs::remove_file(&bench.paths(&done)[0]).unwrap();
    let scene = bench.farm.status(&done).await.unwrap().scene;
    let name = crate::blobs::BlobName::Scene(scene);
    bench.farm.blobs.put(&name, "another".into()).await.unwrap();
    let lost = look().await.lost;
    assert_eq!(lost.len(), 3, "{lost:?}");
    assert!(lost.iter().any(|line| line.contains("its picture is missing")), "{lost:?}");
    assert_eq!(lost.iter().filter(|line| line.contains("other bytes")).count(), 2, "{lost:?}");
}

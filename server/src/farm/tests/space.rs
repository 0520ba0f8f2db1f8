//! A disk that is nearly full.

use super::bench::{Bench, Spread, rules};
use crate::farm::{error::FarmError, rules::Rules, space::Room};
use ovtigre_proto::{job::JobRequest, lease::Commit, status::JobState};
use std::{
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

#[tokio::test(flavor = "multi_thread")]
async fn a_farm_without_room_takes_nothing_new_and_goes_on_when_there_is_room() {
    let free = Arc::new(AtomicU64::new(1000));
    let seen = Arc::clone(&free);
    let room = Room::new(move || Some(seen.load(Ordering::SeqCst)));
    let bench = Bench::new(Rules { room, reserve_bytes: 100, ..rules() }).await;
    let job = bench.job(4000, |_| ()).await;
    let worker = bench.worker().await;
    let held = bench.take(&worker, 2).await;
    let set = async |bytes| {
        free.store(bytes, Ordering::SeqCst);
        tokio::time::sleep(Duration::from_millis(60)).await;
    };
    set(80).await;
    assert!(bench.take(&worker, 4).await.is_empty(), "no batches are handed out");
    assert!(matches!(bench.farm.receive().await, Err(FarmError::Full)));
    let request = JobRequest { scene: Some(ovtigre_proto::id::BlobId::of([1; 32])), ..JobRequest::default() };
    assert!(matches!(bench.farm.submit(request, None, None).await, Err(FarmError::Full)));
    assert_eq!(bench.bring(&held[0], Spread::Noisy).await, Commit::Accepted, "the reserve is for these");
    set(40).await;
    let sum = super::bench::layered(&held[1], Spread::Noisy);
    assert!(matches!(bench.bring_sum(&held[1], &sum).await, Err(FarmError::Full)));
    set(1000).await;
    assert_eq!(bench.bring(&held[1], Spread::Noisy).await, Commit::Accepted);
    bench.work(&worker, Spread::Noisy).await;
    bench.until_settled(&job, JobState::Done).await;
}

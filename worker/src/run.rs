//! A worker from its joining until it leaves.

use crate::{
    beat::Beat,
    config::Config,
    desk::Desk,
    labour::Labour,
    leave::{Bell, Leave},
    prepared::Prepared,
    renderer::{Core, Renderer},
    scenes::{SceneError, SceneFolder},
};
use ovtigre_proto::{
    client::{error::ClientError, farm::Client},
    lease::{Exchange, WorkerJoin},
};
use std::{
    sync::{Arc, Mutex, atomic::AtomicU64},
    time::Duration,
};
use tokio::sync::watch;

/// Time for the last calls of a worker that leaves at once.
const HASTE: Duration = Duration::from_secs(1);

/// Why a worker stopped working.
#[derive(Debug, thiserror::Error)]
pub enum WorkerError {
    /// The farm does not want this worker.
    #[error("{0}")]
    Refused(ClientError),
    /// The cache folder cannot be used.
    #[error(transparent)]
    Cache(#[from] SceneError),
    /// No threads to render with.
    #[error("cannot start {threads} threads: {reason}")]
    Threads {
        /// As many as were asked for.
        threads: usize,
        /// Why.
        reason: String,
    },
}

/// Works for the farm that `config` names until the bell rings.
pub async fn run(config: Config, bell: Bell) -> Result<(), WorkerError> {
    run_with(config, Core, bell).await
}

/// Works with another renderer.
pub async fn run_with<R: Renderer>(config: Config, renderer: R, bell: Bell) -> Result<(), WorkerError> {
    let client = Client::new(&config.server, config.seed).map_err(WorkerError::Refused)?;
    let client = client.with_token(config.token.as_deref());
    client.resolve().await.map_err(WorkerError::Refused)?;
    let join = WorkerJoin {
        name: config.name,
        threads: config.threads as u32,
        build: env!("CARGO_PKG_VERSION").to_owned(),
        instruction_set: renderer.instruction_set().to_owned(),
        tags: config.tags,
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(config.threads)
        .thread_name(|n| format!("render-{n}"))
        .build()
        .map_err(|e| WorkerError::Threads { threads: config.threads, reason: e.to_string() })?;
    let desk = Arc::new(Desk::default());
    let scenes = Arc::new(SceneFolder::open(config.cache, config.cache_bytes)?);
    let labour = Arc::new(Labour {
        client: client.clone(),
        desk: desk.clone(),
        scenes: scenes.clone(),
        traces: config.traces.clone(),
        prepared: Mutex::new(Prepared::default()),
        renderer,
        pool,
    });
    let id = watch::Sender::new(None);
    let (bell, desk, beats) = (&bell, &desk, AtomicU64::new(0));
    let beat = Beat { client: &client, join: &join, desk, scenes: &scenes, bell, id: &id, beats };
    tokio::select! {
        refused = beat.run() => return Err(refused),
        () = labour.run(bell) => {}
        () = too_late(bell) => {}
    }
    let id = id.borrow().clone();
    if let Some(id) = &id {
        let farewell = Exchange { leaving: true, ..Exchange::default() };
        tokio::time::timeout(HASTE, client.exchange(id, &farewell)).await.ok();
    }
    tracing::info!(worker = id.as_ref().map(ToString::to_string), "left");
    config.traces.stop().await;
    Ok(())
}

/// Returns when a worker that is told to leave at once has had time enough for its last calls.
async fn too_late(bell: &Bell) {
    bell.wait(Leave::Now).await;
    tokio::time::sleep(HASTE).await;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mock::{Conduct, Drain, MockFarm, MockRenderer, lease};
    use ovtigre_proto::lease::FailureKind;
    use tokio::task::JoinHandle;

    /// A worker of `farm`, the bell it hears, and the folder that must live as long.
    fn start(
        farm: &MockFarm,
        conduct: Conduct,
    ) -> (JoinHandle<Result<(), WorkerError>>, Bell, tempfile::TempDir) {
        let cache = tempfile::tempdir().unwrap();
        let bell = Bell::default();
        let config = farm.config(cache.path().to_owned());
        (tokio::spawn(run_with(config, MockRenderer(conduct), bell.clone())), bell, cache)
    }

    async fn ends(worker: JoinHandle<Result<(), WorkerError>>) {
        tokio::time::timeout(Duration::from_secs(20), worker).await.expect("it leaves").unwrap().unwrap();
    }

    #[tokio::test]
    async fn every_batch_is_brought_once_and_the_worker_leaves() {
        let farm = MockFarm::with_batches(9, 60.0).await;
        let (worker, bell, _cache) = start(&farm, Conduct::Render);
        farm.until("all batches are brought", |book| book.brought.len() == 9).await;
        bell.ring(Leave::AfterBatch);
        ends(worker).await;
        let book = farm.book();
        for (i, (id, sum)) in book.brought.iter().enumerate() {
            assert_eq!(*id, lease(sum.batch.block.index, 60.0).id);
            assert!(book.brought[..i].iter().all(|(other, _)| other != id));
        }
        assert_eq!((book.fetches, book.given_back.len()), (1, 0));
        assert!(book.exchanges.last().is_some_and(|last| last.leaving && last.holding.is_empty()));
        let asks =
            |exchange: &Exchange| exchange.leaving || exchange.wants as usize + exchange.holding.len() >= 2;
        assert!(book.exchanges.iter().all(asks), "the pool never idles");
    }

    #[tokio::test]
    async fn a_dropped_batch_stops_and_the_next_begins() {
        let farm = MockFarm::with_batches(3, 60.0).await;
        let (worker, bell, _cache) = start(&farm, Conduct::Endless);
        farm.until("two are held", |book| book.exchanges.last().is_some_and(|last| last.holding.len() == 2))
            .await;
        farm.book().drop = vec![lease(0, 0.0).id];
        let third = lease(2, 0.0).id;
        farm.until("the third is held", |book| {
            book.exchanges.last().is_some_and(|last| last.holding.iter().any(|held| held.lease == third))
        })
        .await;
        bell.ring(Leave::Now);
        ends(worker).await;
        let book = farm.book();
        assert!(book.brought.is_empty());
        let mut given: Vec<_> =
            book.given_back.iter().map(|(id, failure)| (id.as_str(), failure.kind)).collect();
        given.sort_by_key(|(id, _)| *id);
        assert_eq!(given, [("lease-1", FailureKind::HandedBack), ("lease-2", FailureKind::HandedBack)]);
    }

    #[tokio::test]
    async fn told_once_a_worker_finishes_its_batch_and_hands_back_the_other() {
        let farm = MockFarm::with_batches(5, 60.0).await;
        let (worker, bell, _cache) = start(&farm, Conduct::Slow(300));
        farm.until("two are held", |book| book.exchanges.last().is_some_and(|last| last.holding.len() == 2))
            .await;
        bell.ring(Leave::AfterBatch);
        ends(worker).await;
        let book = farm.book();
        assert_eq!(book.brought.iter().map(|(id, _)| id.as_str()).collect::<Vec<_>>(), ["lease-0"]);
        assert_eq!(book.given_back.len(), 1);
        assert_eq!(book.given_back[0].0.as_str(), "lease-1");
        assert_eq!(book.given_back[0].1.kind, FailureKind::HandedBack);
    }

    #[tokio::test]
    async fn told_twice_a_worker_hands_everything_back_at_once() {
        let farm = MockFarm::with_batches(5, 60.0).await;
        let (worker, bell, _cache) = start(&farm, Conduct::Endless);
        farm.until("two are held", |book| book.exchanges.last().is_some_and(|last| last.holding.len() == 2))
            .await;
        bell.ring(Leave::AfterBatch);
        tokio::time::sleep(Duration::from_millis(100)).await;
        assert!(farm.book().brought.is_empty(), "what it renders never ends");
        bell.ring(Leave::Now);
        ends(worker).await;
        let book = farm.book();
        let mut back: Vec<_> = book.given_back.iter().map(|(id, why)| (id.as_str(), why.kind)).collect();
        back.sort_by_key(|(id, _)| *id);
        assert_eq!(back, [("lease-0", FailureKind::HandedBack), ("lease-1", FailureKind::HandedBack)]);
    }

    #[tokio::test]
    async fn a_farm_that_restarts_finds_its_worker_at_work() {
        let farm = MockFarm::with_batches(20, 60.0).await;
        let (worker, bell, _cache) = start(&farm, Conduct::Slow(30));
        farm.until("some are brought", |book| book.brought.len() > 3).await;
        let farm = farm.restart(Duration::from_millis(700)).await;
        farm.until("all are brought", |book| book.brought.len() == 20).await;
        assert_eq!(farm.book().joins.len(), 1);
        bell.ring(Leave::AfterBatch);
        ends(worker).await;
    }

    #[tokio::test]
    async fn a_worker_that_is_not_known_any_more_joins_again() {
        let farm = MockFarm::with_batches(2, 60.0).await;
        let (worker, bell, _cache) = start(&farm, Conduct::Endless);
        farm.until("two are held", |book| book.exchanges.last().is_some_and(|last| last.holding.len() == 2))
            .await;
        farm.book().known = None;
        farm.until("it joined again, with nothing", |book| {
            book.joins.len() == 2 && book.exchanges.last().is_some_and(|last| last.holding.is_empty())
        })
        .await;
        bell.ring(Leave::Now);
        ends(worker).await;
        assert!(farm.book().given_back.is_empty(), "what it held ended with its name");
    }

    #[tokio::test]
    async fn batches_that_cannot_be_rendered_are_given_back_with_the_reason() {
        for (conduct, reason) in
            [(Conduct::Unreadable, "mesh 7 has no end"), (Conduct::Panic, "a panic that a test asked for")]
        {
            let farm = MockFarm::with_batches(2, 60.0).await;
            let (worker, bell, _cache) = start(&farm, conduct);
            farm.until("both are given back", |book| book.given_back.len() == 2).await;
            bell.ring(Leave::AfterBatch);
            ends(worker).await;
            for (_, failure) in &farm.book().given_back {
                assert_eq!(failure.kind, FailureKind::Job);
                assert!(failure.reason.contains(reason), "{failure:?}");
            }
        }
    }

    #[tokio::test]
    async fn a_scene_that_cannot_be_had_is_not_the_jobs_fault() {
        let farm = MockFarm::with_batches(1, 60.0).await;
        farm.damage_fetches(1000);
        let (worker, bell, _cache) = start(&farm, Conduct::Render);
        farm.until("it is given back", |book| book.given_back.len() == 1).await;
        assert_eq!(farm.book().given_back[0].1.kind, FailureKind::Worker);
        bell.ring(Leave::AfterBatch);
        ends(worker).await;
    }

    #[tokio::test]
    async fn a_worker_that_is_sent_away_leaves() {
        let farm = MockFarm::with_batches(1, 60.0).await;
        let (worker, _bell, _cache) = start(&farm, Conduct::Render);
        farm.until("it is brought", |book| book.brought.len() == 1).await;
        farm.book().drain = Drain::Yes;
        ends(worker).await;
    }

    #[tokio::test]
    async fn batches_that_cannot_be_renewed_are_dropped() {
        let farm = MockFarm::with_batches(2, 0.3).await;
        let (worker, bell, _cache) = start(&farm, Conduct::Endless);
        farm.until("two are held", |book| book.exchanges.last().is_some_and(|last| last.holding.len() == 2))
            .await;
        let farm = farm.restart(Duration::from_secs(1)).await;
        let before = farm.book().exchanges.len();
        farm.until("it is heard of again", |book| book.exchanges.len() > before).await;
        assert!(farm.book().exchanges[before].holding.is_empty());
        bell.ring(Leave::Now);
        ends(worker).await;
    }
}

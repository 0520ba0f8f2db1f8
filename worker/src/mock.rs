//! A farm of a few lines and a renderer of fewer, for tests.

use crate::{config::Config, renderer::Renderer};
use axum::{
    Json, Router,
    body::Bytes,
    extract::{Path, State},
    http::StatusCode,
    routing::{get, post, put},
};
use ovtigre_core::{
    film::{
        batch::{Batch, Block},
        exr::read_partial,
        invalid::InvalidSamples,
        size::{Region, Size},
        sum::Sum,
    },
    render::progress::Progress,
    settings::{CameraChoice, Distribution, FULL, Gloss, Method, Settings, Shadows, Shutter, Weights},
};
use ovtigre_proto::{
    client::farm::Client,
    id::{BlobId, LeaseId, WorkerId},
    lease::{Commit, Committed, Exchange, ExchangeReply, Lease, LeaseFailure, WorkerJoin, WorkerJoined},
    telemetry::traces::Traces,
};
use std::{
    collections::BTreeMap,
    net::SocketAddr,
    path::PathBuf,
    sync::{Arc, Mutex, MutexGuard},
    time::Duration,
};
use tokio::{net::TcpListener, task::JoinHandle};

/// Settings of a tiny picture.
pub(crate) fn settings() -> Settings {
    Settings {
        size: Size { width: 2, height: 1 },
        camera: CameraChoice::Framed,
        variant: None,
        method: Method::Path,
        paths: FULL.to_owned(),
        layers: Vec::new(),
        gloss: Gloss::AsItIs,
        strategies: Vec::new(),
        weights: Weights::Balance,
        bounces: None,
        lens: None,
        shutter: Shutter::default(),
        environment: None,
        shadows: Shadows::On,
        seed: 0,
        replicates: 1,
        sampling: Distribution::Uniform,
    }
}

/// The n-th batch.
pub(crate) fn lease(n: u32, seconds: f64) -> Lease {
    Lease {
        id: format!("lease-{n}").parse().unwrap(),
        job: "job".parse().unwrap(),
        scene: BlobId::of(*blake3::hash(b"scene").as_bytes()),
        settings: settings(),
        batch: Batch {
            region: Region { x: 0, y: 0, width: 2, height: 1 },
            replicate: 0,
            block: Block { index: n, start: n, count: 1 },
        },
        seconds,
        upload: None,
        allocation: None,
    }
}

/// What the farm knows.
#[derive(Default)]
pub(crate) struct Book {
    pub(crate) joins: Vec<WorkerJoin>,
    pub(crate) known: Option<WorkerId>,
    pub(crate) exchanges: Vec<Exchange>,
    pub(crate) queue: Vec<Lease>,
    pub(crate) drop: Vec<LeaseId>,
    pub(crate) drain: Drain,
    pub(crate) brought: Vec<(LeaseId, Sum)>,
    pub(crate) given_back: Vec<(LeaseId, LeaseFailure)>,
    scenes: BTreeMap<String, Bytes>,
    pub(crate) fetches: u32,
    damaged: u32,
}

/// Whether the farm sends its worker away.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum Drain {
    #[default]
    No,
    Yes,
}

type Shared = Arc<Mutex<Book>>;

/// A farm of a few lines.
pub(crate) struct MockFarm {
    book: Shared,
    address: SocketAddr,
    server: JoinHandle<()>,
}

impl MockFarm {
    pub(crate) async fn start() -> Self {
        Self::start_at("127.0.0.1:0".parse().unwrap(), Shared::default()).await
    }

    async fn start_at(address: SocketAddr, book: Shared) -> Self {
        let listener = TcpListener::bind(address).await.unwrap();
        let address = listener.local_addr().unwrap();
        let router = Router::new()
            .route("/v1/scenes/{id}/bytes", get(scene))
            .route("/v1/workers", post(join))
            .route("/v1/workers/{id}/exchange", post(exchange))
            .route("/v1/leases/{id}/sum", put(sum))
            .route("/v1/leases/{id}/failure", post(failure))
            .with_state(book.clone());
        let server = tokio::spawn(async move { axum::serve(listener, router).await.unwrap() });
        Self { book, address, server }
    }

    /// A farm with these batches of a scene of a few bytes.
    pub(crate) async fn with_batches(count: u32, lease_seconds: f64) -> Self {
        let farm = Self::start().await;
        farm.add_scene(b"scene");
        farm.book().queue = (0..count).rev().map(|n| lease(n, lease_seconds)).collect();
        farm
    }

    /// Cuts every connection, stays away for `pause`, and comes back at the same address.
    pub(crate) async fn restart(self, pause: Duration) -> Self {
        self.server.abort();
        tokio::time::sleep(pause).await;
        Self::start_at(self.address, self.book.clone()).await
    }

    pub(crate) fn book(&self) -> MutexGuard<'_, Book> {
        self.book.lock().unwrap()
    }

    pub(crate) fn client(&self) -> Client {
        Client::new(&self.address.to_string(), 1).unwrap()
    }

    /// Returns once `holds` says so of the book; fails the test after a while.
    pub(crate) async fn until(&self, what: &str, holds: impl Fn(&Book) -> bool) {
        for _ in 0..2000 {
            if holds(&self.book()) {
                return;
            }
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        panic!("never: {what}");
    }

    pub(crate) fn add_scene(&self, bytes: &[u8]) -> BlobId {
        let id = BlobId::of(*blake3::hash(bytes).as_bytes());
        self.book().scenes.insert(id.to_string(), Bytes::copy_from_slice(bytes));
        id
    }

    pub(crate) fn fetches(&self) -> u32 {
        self.book().fetches
    }

    /// The next `count` fetches bring damaged bytes.
    pub(crate) fn damage_fetches(&self, count: u32) {
        self.book().damaged = count;
    }

    /// For a worker of this farm that keeps its scenes in `cache`.
    pub(crate) fn config(&self, cache: PathBuf) -> Config {
        Config {
            server: self.address.to_string(),
            token: None,
            name: "test".to_owned(),
            threads: 2,
            tags: Vec::new(),
            cache,
            cache_bytes: 1 << 20,
            seed: 1,
            traces: Traces::default(),
        }
    }
}

async fn scene(State(book): State<Shared>, Path(id): Path<String>) -> Result<Bytes, StatusCode> {
    let mut book = book.lock().unwrap();
    book.fetches += 1;
    let bytes = book.scenes.get(&id).cloned().ok_or(StatusCode::NOT_FOUND)?;
    if book.damaged > 0 {
        book.damaged -= 1;
        return Ok(bytes.slice(1..));
    }
    Ok(bytes)
}

async fn join(State(book): State<Shared>, Json(join): Json<WorkerJoin>) -> Json<WorkerJoined> {
    let mut book = book.lock().unwrap();
    book.joins.push(join);
    let id: WorkerId = format!("worker-{}", book.joins.len()).parse().unwrap();
    book.known = Some(id.clone());
    Json(WorkerJoined { id, interval_seconds: 0.05 })
}

async fn exchange(
    State(book): State<Shared>,
    Path(id): Path<WorkerId>,
    Json(exchange): Json<Exchange>,
) -> Result<Json<ExchangeReply>, StatusCode> {
    let mut book = book.lock().unwrap();
    if book.known.as_ref() != Some(&id) {
        return Err(StatusCode::NOT_FOUND);
    }
    let left = book.queue.len().saturating_sub(exchange.wants as usize);
    let mut leases = book.queue.split_off(left);
    leases.reverse();
    book.exchanges.push(exchange);
    let drain = book.drain == Drain::Yes;
    Ok(Json(ExchangeReply { leases, drop: book.drop.clone(), interval_seconds: 0.05, drain }))
}

async fn sum(State(book): State<Shared>, Path(id): Path<LeaseId>, body: Bytes) -> Json<Committed> {
    let (sum, _) = read_partial(&body, 100).unwrap();
    book.lock().unwrap().brought.push((id, sum));
    Json(Committed { commit: Commit::Accepted })
}

async fn failure(State(book): State<Shared>, Path(id): Path<LeaseId>, Json(failure): Json<LeaseFailure>) {
    book.lock().unwrap().given_back.push((id, failure));
}

/// What a batch does, by the number of its block.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Conduct {
    /// It is rendered in no time.
    Render,
    /// It goes on until it is stopped.
    Endless,
    /// It panics.
    Panic,
    /// Its scene cannot be prepared.
    Unreadable,
    /// It takes some milliseconds.
    Slow(u64),
}

/// Renders nothing, as it is told.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MockRenderer(pub(crate) Conduct);

impl Renderer for MockRenderer {
    type Scene = ();

    fn instruction_set(&self) -> &'static str {
        "mock"
    }

    fn prepare(&self, scene: Arc<[u8]>, _: Option<&[u8]>, _: &Settings) -> Result<(), String> {
        assert_eq!(&*scene, b"scene");
        if matches!(self.0, Conduct::Unreadable) { Err("mesh 7 has no end".to_owned()) } else { Ok(()) }
    }

    fn render(&self, (): &(), lease: &Lease, progress: &Progress) -> Option<Sum> {
        let batch = lease.batch;
        match self.0 {
            Conduct::Panic => panic!("a panic that a test asked for"),
            Conduct::Endless => {
                while !progress.is_stopped() {
                    std::thread::sleep(Duration::from_millis(1));
                }
                return None;
            }
            Conduct::Slow(milliseconds) => std::thread::sleep(Duration::from_millis(milliseconds)),
            Conduct::Render | Conduct::Unreadable => {}
        }
        let planes = vec![vec![[batch.block.index as f32; 3]; batch.region.pixels()]];
        Some(Sum { batch, planes, invalid: InvalidSamples::default(), rays: 1, tile_rays: Vec::new() })
    }
}

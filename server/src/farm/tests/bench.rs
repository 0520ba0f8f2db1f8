//! A farm in a temporary folder, and a worker that makes its sums up.

use crate::{
    blobs::Blobs,
    farm::{Farm, picture::ExrFile, rules::Rules, scene::Inspect},
    store::sql::Sql,
};
use bytes::Bytes;
use ovtigre_core::film::{
    allocation::Allocation,
    batch::Batch,
    exr::{PartialAttributes, read_layers, write_partial},
    invalid::InvalidSamples,
    sum::Sum,
};
use ovtigre_proto::{
    id::{BlobId, JobId, WorkerId},
    job::JobRequest,
    lease::{Commit, Exchange, Lease, LeaseProgress, WorkerJoin},
    scene::{SceneContent, SceneContents},
    status::{JobState, JobStatus},
    telemetry::traces::Traces,
};
use std::{path::Path, sync::Arc, time::Duration};
use tempfile::TempDir;

/// Spread of the made-up samples around 1.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Spread {
    /// Each pixel's samples are uniform in 0..2.
    Noisy,
    /// All are 1.
    Still,
    /// All are 0.
    Black,
}

/// A farm in a folder that can be opened again.
pub(crate) struct Bench {
    pub(crate) farm: Arc<Farm>,
    pub(crate) rules: Rules,
    folder: TempDir,
}

/// Fast enough for tests, else as always.
pub(crate) fn rules() -> Rules {
    let (tick, beat) = (Duration::from_millis(10), Duration::from_millis(1));
    Rules { tick, beat, rest: Duration::ZERO, kept_sums_bytes: 0, ..Rules::default() }
}

async fn open(folder: &TempDir, rules: Rules) -> Arc<Farm> {
    let store = Arc::new(Sql::file(&folder.path().join("farm.sqlite")).await.unwrap());
    let blobs = Blobs::folder(&folder.path().join("blobs")).unwrap();
    Farm::open(store, blobs, inspect(), rules, Traces::default()).await.unwrap()
}

pub(crate) fn inspect() -> Inspect {
    Inspect::new(|bytes| {
        if bytes.starts_with(b"bad") {
            return Err(crate::farm::error::fault("/meshes/0", "the mesh is bad"));
        }
        if bytes.starts_with(b"sky") {
            return Ok(SceneContent::Environment { width: 2, height: 1, brightest: 1.0 });
        }
        let cameras = vec!["front".to_owned(), "side".to_owned()];
        let camera_aspect_ratios = vec![Some(2.0), None];
        Ok(SceneContent::Scene(SceneContents { cameras, camera_aspect_ratios, ..SceneContents::default() }))
    })
}

impl Bench {
    pub(crate) async fn new(rules: Rules) -> Self {
        let folder = tempfile::tempdir().unwrap();
        Self { farm: open(&folder, rules.clone()).await, rules, folder }
    }

    /// One of several farms over a database and a folder.
    pub(crate) async fn replica(database: &str, folder: &Path, rules: Rules) -> Self {
        let store = Arc::new(Sql::server(database).await.unwrap());
        let blobs = Blobs::folder(folder).unwrap();
        let farm = Farm::open(store, blobs, inspect(), rules.clone(), Traces::default()).await.unwrap();
        Self { farm, rules, folder: tempfile::tempdir().unwrap() }
    }

    /// As if the process was killed: nothing is waited for, and nothing given up.
    pub(crate) async fn die(self) {
        self.farm.stopping.cancel();
        self.farm.store.close().await;
    }

    /// As after the process was killed: nothing is waited for.
    pub(crate) async fn crash(self) -> Self {
        self.farm.stopping.cancel();
        self.farm.store.close().await;
        let farm = open(&self.folder, self.rules.clone()).await;
        Self { farm, ..self }
    }

    pub(crate) async fn scene(&self) -> BlobId {
        self.upload(b"a scene").await
    }

    pub(crate) async fn upload(&self, bytes: &'static [u8]) -> BlobId {
        let mut incoming = self.farm.receive().await.unwrap();
        incoming.write(Bytes::from_static(bytes)).await.unwrap();
        self.farm.take_in(incoming, None).await.unwrap().0.id
    }

    /// A small job: 40 × 30 pixels, 4 replicates.
    pub(crate) async fn job(&self, samples: u32, change: impl FnOnce(&mut JobRequest)) -> JobId {
        let mut request = JobRequest {
            scene: Some(self.scene().await),
            size: Some("40x30".parse().unwrap()),
            samples: Some(samples),
            ..JobRequest::default()
        };
        change(&mut request);
        self.farm.submit(request, None, None).await.unwrap().id
    }

    pub(crate) async fn worker(&self) -> WorkerId {
        self.worker_as(|_| ()).await
    }

    pub(crate) async fn worker_as(&self, change: impl FnOnce(&mut WorkerJoin)) -> WorkerId {
        let mut join = WorkerJoin {
            name: "test".to_owned(),
            threads: 1,
            build: env!("CARGO_PKG_VERSION").to_owned(),
            instruction_set: "any".to_owned(),
            tags: Vec::new(),
        };
        change(&mut join);
        self.farm.join(join).await.unwrap().id
    }

    pub(crate) async fn take(&self, worker: &WorkerId, wants: u32) -> Vec<Lease> {
        self.farm.exchange(worker, Exchange { wants, ..Exchange::default() }).await.unwrap().leases
    }

    /// The worker says that it holds this lease; whether it still has it.
    pub(crate) async fn beat(&self, worker: &WorkerId, lease: &Lease) -> bool {
        let holding = vec![LeaseProgress { lease: lease.id.clone(), done: 0.5 }];
        let reply = self.farm.exchange(worker, Exchange { holding, ..Exchange::default() }).await.unwrap();
        reply.drop.is_empty()
    }

    /// Brings a batch that took a millisecond a sample.
    pub(crate) async fn bring(&self, lease: &Lease, spread: Spread) -> Commit {
        self.bring_sum(lease, &layered(lease, spread)).await.unwrap()
    }

    pub(crate) async fn bring_sum(&self, lease: &Lease, sum: &Sum) -> crate::farm::error::Result<Commit> {
        let time = Duration::from_millis(u64::from(lease.batch.block.count));
        self.farm.commit(&lease.id, partial(lease, sum), time).await
    }

    /// Takes and brings until there is nothing to take; how many were brought.
    pub(crate) async fn work(&self, worker: &WorkerId, spread: Spread) -> usize {
        let mut brought = 0;
        let mut idle = 0;
        while idle < 50 {
            let leases = self.take(worker, 8).await;
            for lease in &leases {
                self.bring(lease, spread).await;
            }
            brought += leases.len();
            idle = if leases.is_empty() { idle + 1 } else { 0 };
            if leases.is_empty() {
                tokio::time::sleep(Duration::from_millis(4)).await;
            }
        }
        brought
    }

    /// Waits until the job is as `seen` says.
    pub(crate) async fn until(&self, job: &JobId, seen: impl Fn(&JobStatus) -> bool) -> JobStatus {
        for _ in 0..1000 {
            let status = self.farm.status(job).await.unwrap();
            if seen(&status) {
                return status;
            }
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        panic!("the job does not get there: {:?}", self.farm.status(job).await.unwrap());
    }

    pub(crate) async fn until_settled(&self, job: &JobId, state: JobState) -> JobStatus {
        self.until(job, |status| status.state == state).await;
        for _ in 0..1000 {
            if self.farm.live(job).is_none() {
                return self.farm.status(job).await.unwrap();
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
        panic!("the job is not settled");
    }

    pub(crate) async fn exr(&self, job: &JobId) -> Bytes {
        let (_, file) = self.farm.exr(job).await.unwrap();
        match file {
            ExrFile::Memory(bytes) => bytes,
            ExrFile::Kept { name, .. } => self.farm.blobs.get(&name).await.unwrap(),
        }
    }

    /// All channels, bit by bit.
    pub(crate) async fn pixels(&self, job: &JobId) -> Vec<(String, Vec<u32>)> {
        let layers = read_layers(&self.exr(job).await).unwrap();
        let bits = |values: Vec<f32>| values.into_iter().map(f32::to_bits).collect();
        layers.channels.into_iter().map(|(name, values)| (name, bits(values))).collect()
    }

    /// Asserts that nothing is kept of the job but its picture.
    pub(crate) fn assert_only_a_picture(&self, job: &JobId) {
        let files = self.files(job);
        assert!(files.len() == 1 && files[0].starts_with("result-"), "{files:?}");
    }

    /// Where files are.
    pub(crate) fn blobs(&self) -> std::path::PathBuf {
        self.folder.path().join("blobs")
    }

    /// Files under `jobs/`.
    pub(crate) fn paths(&self, job: &JobId) -> Vec<std::path::PathBuf> {
        let mut folders = vec![self.folder.path().join("blobs/jobs").join(job.as_str())];
        let mut files = Vec::new();
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).into_iter().flatten() {
                let path = entry.unwrap().path();
                if path.is_dir() { folders.push(path) } else { files.push(path) }
            }
        }
        files.sort();
        files
    }

    /// Files under `jobs/`, by the end of their names.
    pub(crate) fn files(&self, job: &JobId) -> Vec<String> {
        let name = |path: &std::path::PathBuf| path.file_name().unwrap().to_str().unwrap().to_owned();
        self.paths(job).iter().map(name).collect()
    }
}

/// A partial EXR of a lease.
pub(crate) fn partial(lease: &Lease, sum: &Sum) -> Bytes {
    let attributes = PartialAttributes {
        job: lease.job.to_string(),
        scene: lease.scene.to_string(),
        method: lease.settings.method.name().to_owned(),
        solution: None,
        allocation: lease.allocation.as_ref().map(Allocation::hash),
    };
    write_partial(sum, lease.settings.size, &attributes).into()
}

/// The sum of a lease: each plane is half of the one before.
pub(crate) fn layered(lease: &Lease, spread: Spread) -> Sum {
    let mut sum = sum(lease.batch, spread);
    for _ in 1..lease.settings.planes() {
        let half = |pixel: &[f32; 3]| pixel.map(|value| 0.5 * value);
        let next = sum.planes.last().expect("a picture").iter().map(half).collect();
        sum.planes.push(next);
    }
    sum
}

/// A sum that follows from its batch alone.
pub(crate) fn sum(batch: Batch, spread: Spread) -> Sum {
    let mut state =
        u64::from(batch.replicate) << 40 ^ u64::from(batch.block.index) << 20 ^ u64::from(batch.region.y) ^ 7;
    let mut uniform = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let x = (((state >> 18) ^ state) >> 27) as u32;
        f64::from(x.rotate_right((state >> 59) as u32)) / 4294967296.0
    };
    let mut value = || {
        let samples = 0..batch.block.count;
        let sum: f64 = match spread {
            Spread::Noisy => samples.map(|_| 2.0 * uniform()).sum(),
            Spread::Still => f64::from(batch.block.count),
            Spread::Black => 0.0,
        };
        sum as f32
    };
    let plane = (0..batch.region.pixels()).map(|_| [value(), value(), value()]).collect();
    let rays = u64::from(batch.block.count) * batch.region.pixels() as u64;
    Sum {
        batch,
        planes: vec![plane],
        invalid: InvalidSamples { negative: 1, ..InvalidSamples::default() },
        rays,
        tile_rays: Vec::new(),
    }
}

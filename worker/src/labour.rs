//! One batch after another, on the worker's threads.

use crate::{
    bring::{Rendered, bring, give_back},
    desk::{BRINGING_MAX, Desk, Work},
    errand::{Errand, note},
    leave::{Bell, Leave},
    prepared::{Key, Prepared},
    renderer::Renderer,
    scenes::{SceneError, SceneFolder},
};
use ovtigre_core::{
    film::{allocation::Allocation, exr::PartialAttributes},
    settings::{EnvironmentSource, Settings},
};
use ovtigre_proto::{
    client::farm::Client,
    id::BlobId,
    lease::{FailureKind, Lease},
    telemetry::{span::Span, traces::Traces},
};
use rayon::ThreadPool;
use std::{
    any::Any,
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant},
};
use tokio::task::JoinSet;

/// Time for the last sums of a worker that leaves; a farm may be lost for good.
const FAREWELL: Duration = Duration::from_mins(1);

/// A batch that brought no sum.
struct Failed {
    kind: FailureKind,
    reason: String,
}

/// The bytes that a scene is made of.
struct Files {
    scene: Arc<[u8]>,
    environment: Option<Arc<[u8]>>,
}

/// All that rendering needs.
pub struct Labour<R: Renderer> {
    /// The farm.
    pub client: Client,
    /// What is held.
    pub desk: Arc<Desk>,
    /// Files on disk.
    pub scenes: Arc<SceneFolder>,
    /// Where spans go.
    pub traces: Traces,
    /// Scenes in memory.
    pub prepared: Mutex<Prepared<R::Scene>>,
    /// Turns batches into sums.
    pub renderer: R,
    /// The threads that all work at one batch.
    pub pool: ThreadPool,
}

impl<R: Renderer> Labour<R> {
    /// Renders until the bell rings; returns when what was rendered is brought, and the rest is
    /// handed back.
    pub async fn run(self: Arc<Self>, bell: &Bell) {
        let mut bringing = JoinSet::new();
        loop {
            let work = tokio::select! {
                biased;
                () = bell.wait(Leave::AfterBatch) => break,
                work = self.desk.next() => work,
            };
            tokio::select! {
                biased;
                () = bell.wait(Leave::Now) => break,
                rendered = self.clone().render(work) => if let Some(rendered) = rendered {
                    bringing.spawn(bring(self.client.clone(), self.desk.clone(), self.traces.clone(), rendered));
                }
            }
            while bringing.len() >= BRINGING_MAX && bell.heard() < Leave::Now {
                tokio::select! {
                    _ = bringing.join_next() => {}
                    () = bell.wait(Leave::Now) => {}
                }
            }
            while bringing.try_join_next().is_some() {}
        }
        self.hand_back(self.desk.take_waiting()).await;
        tokio::select! {
            () = async { while bringing.join_next().await.is_some() {} } => {}
            () = bell.wait(Leave::Now) => {}
            () = tokio::time::sleep(FAREWELL) => {}
        }
        self.hand_back(self.desk.take_all()).await;
    }

    async fn hand_back(&self, errands: Vec<Errand>) {
        for errand in errands {
            give_back(&self.client, &errand, FailureKind::HandedBack, "the worker leaves".to_owned()).await;
        }
    }

    /// Renders a batch, or gives it back with the reason.
    async fn render(self: Arc<Self>, work: Work) -> Option<Rendered> {
        let errand = work.errand.clone();
        let mut span = errand.span(&self.traces).since(work.came);
        let fetching = errand.part(&self.traces, "fetch");
        let files = self.files(&work.lease).await;
        drop(fetching);
        let result = match files {
            Ok(files) => {
                let labour = self.clone();
                let batch = tokio::task::spawn_blocking(move || labour.batch(&work, files)).await;
                batch.unwrap_or_else(|e| Err(panicked(e.into_panic().as_ref())))
            }
            Err(e) => Err(Failed { kind: FailureKind::Worker, reason: e.to_string() }),
        };
        match result {
            Ok(Some(rendered)) => {
                self.desk.bringing(&errand.lease);
                Some(Rendered { span, ..rendered })
            }
            Ok(None) => {
                span.add("ovtigre.dropped", true);
                None
            }
            Err(Failed { kind, reason }) => {
                span.fail(&reason);
                // Held until the farm knows why: what a worker does not hold any more is anybody's.
                if self.desk.holds(&errand.lease) {
                    give_back(&self.client, &errand, kind, reason).await;
                    self.desk.remove(&errand.lease);
                }
                None
            }
        }
    }

    async fn files(&self, lease: &Lease) -> Result<Option<Files>, SceneError> {
        if self.find(&key(lease)).is_some() {
            return Ok(None);
        }
        let scene = self.scenes.bytes(&self.client, &lease.scene).await?;
        let environment = match environment(&lease.settings) {
            Some(id) => Some(self.scenes.bytes(&self.client, &id).await?),
            None => None,
        };
        Ok(Some(Files { scene, environment }))
    }

    fn find(&self, key: &Key) -> Option<Arc<R::Scene>> {
        self.prepared.lock().unwrap_or_else(PoisonError::into_inner).find(key)
    }

    /// On a thread that may be blocked. `Ok(None)` where the batch was stopped.
    fn batch(&self, work: &Work, files: Option<Files>) -> Result<Option<Rendered>, Failed> {
        let Lease { job, scene: scene_id, settings, .. } = &work.lease;
        let scene = self.scene(&work.lease, files)?;
        let _rendering = work.errand.part(&self.traces, "render");
        note!(debug, work.errand, "renders");
        let start = Instant::now();
        let sum = self.pool.install(|| self.renderer.render(&scene, &work.lease, &work.progress));
        let Some(sum) = sum else { return Ok(None) };
        let attributes = PartialAttributes {
            job: job.to_string(),
            scene: scene_id.to_string(),
            method: settings.method.name().to_owned(),
            solution: self.renderer.solution(&scene),
            allocation: work.lease.allocation.as_ref().map(Allocation::hash),
        };
        let seconds = start.elapsed().as_secs_f64();
        let (errand, size, upload) = (work.errand.clone(), settings.size, work.lease.upload.clone());
        Ok(Some(Rendered { errand, span: Span::default(), sum, size, attributes, seconds, upload }))
    }

    fn scene(&self, lease: &Lease, files: Option<Files>) -> Result<Arc<R::Scene>, Failed> {
        let key = key(lease);
        if let Some(scene) = self.find(&key) {
            return Ok(scene);
        }
        let files = files
            .expect("files are fetched for a scene that is not prepared, and only this thread drops one");
        self.prepared.lock().unwrap_or_else(PoisonError::into_inner).make_room();
        let scene = self
            .pool
            .install(|| self.renderer.prepare(files.scene, files.environment.as_deref(), &lease.settings))
            .map_err(|reason| Failed { kind: FailureKind::Job, reason })?;
        let scene = Arc::new(scene);
        self.prepared.lock().unwrap_or_else(PoisonError::into_inner).keep(key, scene.clone());
        Ok(scene)
    }
}

fn key(lease: &Lease) -> Key {
    Key::new(lease.scene.clone(), &lease.settings)
}

fn environment(settings: &Settings) -> Option<BlobId> {
    match &settings.environment.as_ref()?.source {
        EnvironmentSource::Image(hash) => hash.parse().ok(),
        EnvironmentSource::Uniform(_) => None,
    }
}

fn panicked(panic: &(dyn Any + Send)) -> Failed {
    let text = (panic.downcast_ref::<String>().map(String::as_str))
        .or_else(|| panic.downcast_ref::<&str>().copied())
        .unwrap_or("no reason given");
    Failed { kind: FailureKind::Job, reason: format!("rendering panicked: {text}") }
}

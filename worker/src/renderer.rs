//! What a worker needs of a renderer: a border at which tests put a simpler one.

use ovtigre_core::{
    film::sum::Sum,
    render::{
        batch::render_allocated,
        prepare::{Prepared, prepare},
        profile::NUMERIC_PROFILE,
        progress::Progress,
    },
    settings::Settings,
};
use ovtigre_proto::lease::Lease;
use std::sync::Arc;

/// Turns scenes and batches into sums. Called on the threads of the worker's pool.
pub trait Renderer: Send + Sync + 'static {
    /// A scene that is ready to be rendered.
    type Scene: Send + Sync + 'static;

    /// Class of processor whose bits its sums have.
    fn instruction_set(&self) -> &'static str;

    /// Reads an uploaded file and makes it ready. The error is one line for the job's owner.
    fn prepare(
        &self,
        scene: Arc<[u8]>,
        environment: Option<&[u8]>,
        settings: &Settings,
    ) -> Result<Self::Scene, String>;

    /// How the scene was solved before the first sample, as JSON, where it was: the same from every worker.
    fn solution(&self, _: &Self::Scene) -> Option<String> {
        None
    }

    /// The sum of a lease's batch; `None` where it was stopped.
    fn render(&self, scene: &Self::Scene, lease: &Lease, progress: &Progress) -> Option<Sum>;
}

/// The renderer of this build.
#[derive(Clone, Copy, Debug, Default)]
pub struct Core;

impl Renderer for Core {
    type Scene = Prepared;

    fn instruction_set(&self) -> &'static str {
        NUMERIC_PROFILE
    }

    fn prepare(
        &self,
        scene: Arc<[u8]>,
        environment: Option<&[u8]>,
        settings: &Settings,
    ) -> Result<Prepared, String> {
        prepare(scene, environment, settings).map_err(|e| e.to_string())
    }

    fn solution(&self, scene: &Prepared) -> Option<String> {
        scene.solution()
    }

    fn render(&self, scene: &Prepared, lease: &Lease, progress: &Progress) -> Option<Sum> {
        let allocation = lease.allocation.as_ref();
        render_allocated(scene, &lease.settings, lease.batch, allocation, progress).ok()
    }
}

//! How jobs and workers stand.

use crate::{
    curve::{CurveRow, LayerError},
    id::{BlobId, JobId, WorkerId},
    job::JobRequest,
    needs::Needs,
};
use jiff::Timestamp;
use ovtigre_core::{
    film::{allocation::Allocations, size::Region},
    path::reach::Unreachable,
    radiosity::report::RadiosityReport,
    render::pilot::report::Pilot,
    settings::Settings,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where a job is in its life.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobState {
    /// No batch was handed out yet.
    Queued,
    /// Batches are handed out.
    Running,
    /// No batch is handed out until it is resumed.
    Paused,
    /// The picture is complete: every sample asked for, or the error reached, or the time over.
    Done,
    /// It cannot go on.
    Failed,
    /// It was stopped by a user; the picture so far is kept.
    Cancelled,
}

impl JobState {
    /// Whether no more batches will be handed out.
    pub fn is_over(self) -> bool {
        matches!(self, Self::Done | Self::Failed | Self::Cancelled)
    }

    /// As in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Paused => "paused",
            Self::Done => "done",
            Self::Failed => "failed",
            Self::Cancelled => "cancelled",
        }
    }
}

/// A job, seen from outside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JobStatus {
    /// Its name on this farm.
    pub id: JobId,
    /// A name for people.
    pub name: String,
    /// Its scene.
    pub scene: BlobId,
    /// Where it is in its life.
    pub state: JobState,
    /// Why it failed, or what stopped it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Changes with every change of the job.
    pub version: u64,
    /// Higher goes first.
    pub priority: i32,
    /// When it came.
    pub created_at: Timestamp,
    /// When the first batch was handed out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub started_at: Option<Timestamp>,
    /// When it was over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended_at: Option<Timestamp>,
    /// Samples a pixel in the picture so far, over all replicates.
    pub samples_done: f64,
    /// Samples a pixel at most, over all replicates.
    pub samples_asked: u32,
    /// Batches appended.
    pub batches_done: u64,
    /// Batches at most.
    pub batches_asked: u64,
    /// Run time so far: from the first batch handed out.
    pub wall_seconds: f64,
    /// Time workers spent on what is appended, summed.
    pub worker_seconds: f64,
    /// Rays traced for what is appended.
    pub rays: u64,
    /// Samples dropped because they were not finite or negative.
    pub invalid_samples: u64,
    /// Workers that hold one of its batches.
    pub workers: u32,
    /// The latest checkpoint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<CurveRow>,
    /// Relative error to stop at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error_target: Option<f64>,
    /// Whether the error target was reached and certified.
    pub certified: bool,
    /// Seconds until it is expected to be done.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub eta_seconds: Option<f64>,
    /// How light is estimated.
    pub method: String,
    /// Why that way.
    pub method_reason: String,
    /// What was tried to choose it, where it was left open and trying paid.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pilot: Option<Pilot>,
    /// The path expression.
    pub paths: String,
    /// The class of processors whose bits its sums have, once its first batch was handed out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub class: Option<String>,
    /// Paths that are asked for and that no technique of the method makes.
    #[serde(default)]
    pub unreachable: Vec<Unreachable>,
    /// Where the method is `radiosity` and a sum has come: how the scene was solved, with the residual of every iteration. Not in lists.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radiosity: Option<RadiosityReport>,
    /// Where samples are adaptive, once that is decided: how they are allocated, for replicates of even number and of odd
    /// number. Not in lists.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub allocations: Option<Allocations>,
    /// What it needs of the scene and the program, and what it leaves out.
    #[serde(default)]
    pub needs: Needs,
    /// Its layers in order.
    #[serde(default)]
    pub layers: Vec<LayerStatus>,
    /// What is rendered, resolved.
    pub settings: Settings,
    /// Pixels that are rendered.
    pub region: Region,
    /// What was asked for.
    pub request: JobRequest,
    /// What the scene lacked or could not be read, and what was done about it.
    pub warnings: Vec<String>,
}

/// A layer of a job, seen from outside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LayerStatus {
    /// Its name.
    pub name: String,
    /// What it shows: a path expression, or a technique `(s,t)`.
    pub shows: String,
    /// At the latest checkpoint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<LayerError>,
}

/// A worker, seen from outside.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WorkerStatus {
    /// Its name on this farm.
    pub id: WorkerId,
    /// A name for people.
    pub name: String,
    /// Threads it renders with.
    pub threads: u32,
    /// Version of the program.
    pub build: String,
    /// Class of processor.
    pub instruction_set: String,
    /// What it offers.
    pub tags: Vec<String>,
    /// How it stands.
    pub state: WorkerState,
    /// When it joined.
    pub joined_at: Timestamp,
    /// When it was last heard of.
    pub seen_at: Timestamp,
    /// Batches that it holds.
    pub leases: u32,
    /// The job it works at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub job: Option<JobId>,
    /// Batches it brought.
    pub batches_done: u64,
    /// Batches it gave back with a reason.
    pub failures: u64,
    /// Rays a second, over its last batch.
    pub rays_per_second: f64,
    /// Why it was put aside.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// How a worker stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum WorkerState {
    /// Heard of lately.
    Active,
    /// Gets no more batches.
    Draining,
    /// Not heard of for a while.
    Lost,
    /// Took its leave.
    Gone,
    /// Gets no batches: it failed at several jobs, or its sums were wrong.
    Aside,
}

/// One page of a list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "{T}Page")]
pub struct Page<T> {
    /// The items.
    pub items: Vec<T>,
    /// Where the next page begins.
    #[serde(default)]
    pub next: Option<String>,
}

/// How many workers the queue could use now.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Scaling {
    /// Workers that would have something to do.
    pub desired_workers: u32,
    /// Workers heard of lately.
    pub active_workers: u32,
    /// Batches that could be handed out now.
    pub batches_waiting: u64,
}

/// A server-sent event's data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum JobEvent {
    /// The job changed.
    Status(Box<JobStatus>),
    /// A checkpoint was taken.
    Checkpoint(CurveRow),
}

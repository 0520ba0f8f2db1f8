//! What workers and the farm say to each other.

use crate::id::{BlobId, JobId, LeaseId, WorkerId};
use ovtigre_core::{
    film::{allocation::Allocation, batch::Batch},
    settings::Settings,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A worker joins.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WorkerJoin {
    /// A name for people.
    pub name: String,
    /// Threads it renders with.
    pub threads: u32,
    /// Version of the program.
    pub build: String,
    /// Class of processor.
    pub instruction_set: String,
    /// What it offers.
    #[serde(default)]
    pub tags: Vec<String>,
}

/// The farm's answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WorkerJoined {
    /// Its name on this farm.
    pub id: WorkerId,
    /// Seconds until the first exchange.
    pub interval_seconds: f64,
}

/// What a worker says at each beat.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Exchange {
    /// Leases that it works at: they are renewed.
    pub holding: Vec<LeaseProgress>,
    /// Batches that it would take now.
    pub wants: u32,
    /// Scenes that it has at hand.
    pub scenes: Vec<BlobId>,
    /// Whether it is about to leave.
    pub leaving: bool,
    /// Which of its exchanges this is, counted from 1. What was handed out in the answer to an earlier one and is not
    /// held now was never heard of, and goes to another at once; not so where it is 0.
    pub beat: u64,
}

/// How far a lease is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LeaseProgress {
    /// Which.
    pub lease: LeaseId,
    /// Part done, 0 to 1.
    pub done: f64,
}

/// The farm's answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ExchangeReply {
    /// New batches.
    pub leases: Vec<Lease>,
    /// Leases to drop: cancelled, lost, or no longer needed.
    pub drop: Vec<LeaseId>,
    /// Seconds until the next exchange.
    pub interval_seconds: f64,
    /// Whether to take no more and leave.
    pub drain: bool,
}

/// A batch handed to a worker for a while.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Lease {
    /// Its name.
    pub id: LeaseId,
    /// Whose batch.
    pub job: JobId,
    /// The scene's bytes.
    pub scene: BlobId,
    /// What is rendered.
    pub settings: Settings,
    /// Which samples.
    pub batch: Batch,
    /// Seconds until it ends unless it is renewed.
    pub seconds: f64,
    /// Where its sum may be put directly (HTTP PUT, without a token) before the farm is told so; `None`
    /// where it is brought to the farm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub upload: Option<String>,
    /// How many of the batch's samples each pixel gets, where they are not all alike.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub allocation: Option<Allocation>,
}

/// What became of an uploaded sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Commit {
    /// It counts.
    Accepted,
    /// The same bytes were there before.
    Duplicate,
    /// The job is over and does not need it.
    NotNeeded,
}

/// The answer to an uploaded sum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Committed {
    /// What became of it.
    pub commit: Commit,
}

/// A batch given back.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LeaseFailure {
    /// Why, for people.
    pub reason: String,
    /// Whose fault it seems.
    pub kind: FailureKind,
}

/// Whose fault a failure seems.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FailureKind {
    /// The worker is leaving; nothing is wrong.
    HandedBack,
    /// The scene or the settings cannot be rendered.
    Job,
    /// The worker cannot: memory, disk, its network.
    Worker,
}

/// Seconds a worker spent on a batch, beside its uploaded sum.
pub const SECONDS_HEADER: &str = "ovtigre-seconds";

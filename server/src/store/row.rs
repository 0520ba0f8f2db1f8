//! What the store keeps, row by row.

use super::{list::Ranks, notice::Webhook};
use jiff::Timestamp;
use ovtigre_core::film::{allocation::Allocations, batch::Batch};
use ovtigre_proto::{
    curve::{CurveRow, LayerError},
    id::{BlobId, JobId, LeaseId, WorkerId},
    lease::WorkerJoin,
    scene::SceneReport,
    status::{JobState, WorkerState},
};
use serde::{Deserialize, Serialize};
use std::{fmt, time::Duration};

/// A batch of a job by its places in the schedule. Ordered as batches are handed out: all
/// sequences of samples advance together, and one whole picture comes before the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct BatchKey {
    /// Place among the blocks.
    pub block: u32,
    /// Which sequence.
    pub replicate: u32,
    /// Place among the regions.
    pub region: u32,
}

impl BatchKey {
    /// Its sequence of samples.
    pub fn lane(self) -> Lane {
        Lane { replicate: self.replicate, region: self.region }
    }

    /// The key of `batch`, whose region is the `region`-th.
    pub fn of(batch: Batch, region: u32) -> Self {
        Self { block: batch.block.index, replicate: batch.replicate, region }
    }
}

impl fmt::Display for BatchKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "region {} replicate {} block {}", self.region, self.replicate, self.block)
    }
}

/// One sequence of samples of one region: its blocks are appended in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Lane {
    /// Which sequence.
    pub replicate: u32,
    /// Place among the regions.
    pub region: u32,
}

impl Lane {
    /// Its block at `block`.
    pub fn at(self, block: u32) -> BatchKey {
        BatchKey { block, replicate: self.replicate, region: self.region }
    }
}

/// An uploaded file.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneRow {
    /// What is in it, its name and size.
    pub report: SceneReport,
    /// When it came.
    pub created_at: Timestamp,
    /// How long nobody has used it.
    pub unused: Duration,
}

/// A job to be.
#[derive(Clone, Debug)]
pub struct NewJob {
    /// Its name on the farm.
    pub id: JobId,
    /// A name for people.
    pub name: String,
    /// Its scene.
    pub scene: BlobId,
    /// Uploaded files that it needs: they are there as long as it is.
    pub files: Vec<BlobId>,
    /// Higher goes first.
    pub priority: i32,
    /// The farm's own document.
    pub spec: String,
    /// Number of regions.
    pub regions: u32,
    /// Number of sequences of samples a region.
    pub replicates: u32,
    /// Whom to tell of its changes.
    pub webhook: Option<Webhook>,
}

/// A client's name for a request, so that repeating it changes nothing.
#[derive(Clone, Debug)]
pub struct IdempotencyKey {
    /// The name.
    pub key: String,
    /// Equal for equal requests.
    pub fingerprint: String,
}

/// What became of a new job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Added {
    /// It is there now.
    New,
    /// The same request was made before, and made this job.
    Before(JobId),
    /// Another request was made before under the same name.
    KeyTaken,
    /// A file that it needs is not there.
    Lacks(BlobId),
}

/// A job.
#[derive(Clone, Debug)]
pub struct JobRow {
    /// Its place in the order of coming.
    pub sequence: i64,
    /// Its name on the farm.
    pub id: JobId,
    /// A name for people.
    pub name: String,
    /// Its scene.
    pub scene: BlobId,
    /// Where it is in its life.
    pub state: JobState,
    /// Why it failed, or what stopped it.
    pub reason: Option<String>,
    /// Changes with every change of state, reason or priority.
    pub version: u64,
    /// Higher goes first.
    pub priority: i32,
    /// When it came.
    pub created_at: Timestamp,
    /// When its first batch was handed out.
    pub started_at: Option<Timestamp>,
    /// When it was over.
    pub ended_at: Option<Timestamp>,
    /// Seconds since its first batch was handed out until now or its end, without those paused.
    pub run_seconds: f64,
    /// The farm's own document.
    pub spec: String,
    /// How far the picture is, at the latest checkpoint or at its end.
    pub progress: Progress,
    /// Whether the error target was reached.
    pub certified: bool,
    /// The set of batches in the picture that is kept.
    pub manifest: Option<String>,
    /// Whether it is over and its files have their last form.
    pub settled: bool,
    /// The class of processors whose bits its sums have, once its first batch was handed out.
    pub class: Option<String>,
    /// What lists go by.
    pub ranks: Ranks,
}

/// What changes most of a job that is not settled.
#[derive(Clone, Debug, PartialEq)]
pub struct JobHead {
    /// Its name on the farm.
    pub id: JobId,
    /// Changes with every change of state, reason or priority.
    pub version: u64,
    /// Where it is in its life.
    pub state: JobState,
    /// Batches that were brought.
    pub brought: u64,
    /// Checkpoints taken.
    pub looks: u32,
    /// Whether nobody has the right to append to its sums now.
    pub free: bool,
    /// How far the picture is.
    pub progress: Progress,
}

/// The right to append to a job's sums: counted up when it is given to somebody else.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mandate(pub u64);

/// What is in a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Progress {
    /// Samples a pixel over all replicates, the mean over pixels.
    pub samples: f64,
    /// Batches.
    pub batches: u64,
    /// Time workers spent on them in microseconds: whole, so that their order does not matter.
    pub worker_micros: u64,
    /// Rays traced.
    pub rays: u64,
    /// Samples dropped.
    pub invalid: u64,
}

/// A change to a job; what is `None` stays.
#[derive(Clone, Debug, Default)]
pub struct JobChange {
    /// Higher goes first.
    pub priority: Option<i32>,
    /// Where it is in its life, from now on.
    pub state: Option<JobState>,
    /// Why.
    pub reason: Option<String>,
    /// Its last form.
    pub settlement: Option<Settlement>,
}

/// The last form of a job that is over.
#[derive(Clone, Debug)]
pub struct Settlement {
    /// Of whom settles it.
    pub mandate: Mandate,
    /// What is in the picture that is kept.
    pub progress: Progress,
    /// The part of what was asked for that is in it, 0 to 1.
    pub part: f64,
    /// The set of batches in it; `None` where there is no picture.
    pub manifest: Option<String>,
    /// Whether the error target was reached.
    pub certified: bool,
}

/// What a job's work looks like.
#[derive(Clone, Debug, Default)]
pub struct Ledger {
    /// The next block to hand out of each lane.
    pub cursors: Vec<(Lane, u32)>,
    /// Blocks behind the cursors that nobody holds and nobody brought.
    pub returned: Vec<BatchKey>,
    /// Work in flight.
    pub leases: Vec<LeaseRow>,
    /// What was brought.
    pub commits: Vec<CommitRow>,
    /// Blocks of each lane that are kept as one blob of sums.
    pub snapshots: Vec<(Lane, u32)>,
    /// Checkpoints taken.
    pub checkpoints: u32,
    /// How many were brought, of which some may be in the blobs of sums.
    pub brought: u64,
}

/// What of a job can be handed out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Unclaimed {
    /// The next block of each lane.
    pub cursors: Vec<(Lane, u32)>,
    /// Blocks behind the cursors that nobody holds and nobody brought.
    pub returned: Vec<BatchKey>,
}

/// What was brought of a job since some time.
#[derive(Clone, Debug, PartialEq)]
pub struct Brought {
    /// Which.
    pub rows: Vec<CommitRow>,
    /// How many were brought by then, since the job began.
    pub count: u64,
}

/// A batch to hand out.
#[derive(Clone, Debug)]
pub struct Claim {
    /// The lease's name.
    pub lease: LeaseId,
    /// Whose batch.
    pub job: JobId,
    /// Which.
    pub batch: BatchKey,
    /// To whom.
    pub worker: WorkerId,
}

/// A batch in a worker's hands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeaseRow {
    /// The lease's name.
    pub id: LeaseId,
    /// Whose batch.
    pub job: JobId,
    /// Which.
    pub batch: BatchKey,
    /// Who holds it.
    pub worker: WorkerId,
}

/// A batch that was brought.
#[derive(Clone, Debug, PartialEq)]
pub struct CommitRow {
    /// Which.
    pub batch: BatchKey,
    /// Hash of its sum.
    pub hash: BlobId,
    /// Time its worker spent, in microseconds.
    pub worker_micros: u64,
}

/// A batch that is being brought.
#[derive(Clone, Debug)]
pub struct NewCommit {
    /// Whose batch.
    pub job: JobId,
    /// What and how long it took.
    pub row: CommitRow,
    /// Who brings it, where that is known.
    pub worker: Option<WorkerId>,
    /// Rays a second of this batch.
    pub rays_per_second: f64,
}

/// What became of a batch that was brought.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CommitOutcome {
    /// It counts.
    First,
    /// The same sum was there.
    Same,
    /// Another sum was there, and stays.
    Differs {
        /// Hash of the sum that stays.
        kept: BlobId,
    },
    /// The job is over.
    JobOver,
    /// There is no such job.
    NoJob,
    /// This batch was never handed out.
    NeverHandedOut,
}

/// A batch that was given back: how it failed so far.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Released {
    /// The lease that ended.
    pub lease: LeaseRow,
    /// How often this batch was given back with a reason so far.
    pub failures: u32,
    /// Workers that did so.
    pub workers: u32,
    /// How often its worker was lost so far.
    pub losses: u32,
}

/// A worker.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkerRow {
    /// Its name on the farm.
    pub id: WorkerId,
    /// What it says of itself.
    pub join: WorkerJoin,
    /// How it stands.
    pub state: WorkerState,
    /// When it joined.
    pub joined_at: Timestamp,
    /// When it was last heard of.
    pub seen_at: Timestamp,
    /// Batches that it holds.
    pub leases: u32,
    /// The job it works at.
    pub job: Option<JobId>,
    /// Batches it brought.
    pub batches_done: u64,
    /// Batches it gave back with a reason, or lost.
    pub failures: u64,
    /// Rays a second, over its last batch.
    pub rays_per_second: f64,
    /// Why it was put aside.
    pub reason: Option<String>,
}

/// A checkpoint, and how far the picture is at it.
#[derive(Clone, Debug)]
pub struct NewCheckpoint {
    /// Its number, from 1.
    pub look: u32,
    /// Its row of the curve.
    pub row: CurveRow,
    /// The error of each layer.
    pub layers: Vec<LayerError>,
    /// What is in the picture.
    pub progress: Progress,
    /// How samples are allocated from here on, where that is decided here; what was decided before stays.
    pub allocations: Option<Allocations>,
}

/// Another specification of a job.
#[derive(Clone, Debug)]
pub struct Extension {
    /// The farm's own document.
    pub spec: String,
    /// Leading blocks that both specifications have.
    pub whole: u32,
    /// Leading checkpoints that both have and that stay.
    pub looks: u32,
    /// Number of regions.
    pub regions: u32,
    /// Number of sequences of samples a region.
    pub replicates: u32,
}

/// Who may call. The token itself is not kept.
#[derive(Clone, Debug, PartialEq)]
pub struct TokenRow {
    /// Its name on the farm.
    pub id: String,
    /// A name for people.
    pub name: String,
    /// What it may do.
    pub role: Role,
    /// Hash of the token.
    pub hash: BlobId,
    /// When it was made; `None` before it is kept.
    pub created_at: Option<Timestamp>,
}

/// What a caller may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// All of it.
    Admin,
    /// To submit jobs, to change them, and all that `Read` may.
    Submit,
    /// To look.
    Read,
    /// To join as a worker, and to work.
    Work,
}

impl Role {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Admin, Self::Submit, Self::Read, Self::Work];

    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            Self::Admin => "admin",
            Self::Submit => "submit",
            Self::Read => "read",
            Self::Work => "work",
        }
    }
}

impl std::str::FromStr for Role {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let found = Self::ALL.into_iter().find(|role| role.name() == text);
        found.ok_or_else(|| format!("'{text}' is no role: there are admin, submit, read and work"))
    }
}

/// Numbers for gauges.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Jobs by state.
    pub jobs: Vec<(JobState, u64)>,
    /// Workers by state.
    pub workers: Vec<(WorkerState, u64)>,
    /// Batches in workers' hands.
    pub leases: u64,
}

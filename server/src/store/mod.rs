//! Jobs, leases and commits, changed together or not at all.
//!
//! A store has no rules beyond atomicity and its clock. What may be done is the farm's to decide.

pub mod error;
pub mod kept;
pub mod list;
pub mod notice;
pub mod row;
pub mod sql;

#[cfg(test)]
pub mod contract;
#[cfg(test)]
mod contract_changes;
#[cfg(test)]
mod contract_kept;
#[cfg(test)]
mod contract_lists;

use error::Result;
use kept::{KeptJob, UnfiledJob};
use list::{JobFilter, Outlook, Standing};
use notice::NoticeRow;
use ovtigre_core::film::allocation::Allocations;
use ovtigre_proto::{
    curve::{CurveRow, LayerError},
    id::{BlobId, JobId, LeaseId, WorkerId},
    lease::WorkerJoin,
    scene::SceneReport,
    status::WorkerState,
};
use row::{
    Added, BatchKey, Brought, Claim, CommitOutcome, CommitRow, Counts, Extension, IdempotencyKey, JobChange,
    JobHead, JobRow, Lane, Ledger, Mandate, NewCheckpoint, NewCommit, NewJob, Progress, Released, SceneRow,
    TokenRow, Unclaimed, WorkerRow,
};
use std::{fmt, ops::Range, time::Duration};

/// Whether several farms may have the same memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sharing {
    /// Only this one.
    Alone,
    /// Any number.
    WithOthers,
}

/// The farm's memory. Each call is one transaction: durable when it returns, without effect when
/// it fails. Leases, pauses and losses are measured by the store's own clock.
#[async_trait::async_trait]
pub trait Store: Send + Sync + fmt::Debug {
    /// Whether several farms may have it.
    fn sharing(&self) -> Sharing;

    /// Remembers an uploaded file, and that it is used now; again changes nothing else. False while its bytes are being
    /// removed.
    async fn add_scene(&self, report: SceneReport) -> Result<bool>;
    /// An uploaded file.
    async fn scene(&self, id: &BlobId) -> Result<Option<SceneRow>>;
    /// An uploaded file is used now; false where there is none.
    async fn use_scene(&self, id: &BlobId) -> Result<bool>;
    /// Files that no job needs and nobody used for `unused`, `most` of them at most.
    async fn unused_scenes(&self, unused: Duration, most: u32) -> Result<Vec<BlobId>>;
    /// Forgets such a file, or one that it never knew, so that its bytes can be removed: until that is told, nobody adds
    /// it. False where it is needed or used, or known while the files of some job are not.
    async fn drop_scene(&self, id: &BlobId, unused: Duration) -> Result<bool>;
    /// Whether the bytes of a file are being removed.
    async fn is_dropped(&self, id: &BlobId) -> Result<bool>;
    /// Files whose bytes were to be removed `time` ago and are not told to be: this is done again, from now.
    async fn dropped_before(&self, time: Duration) -> Result<Vec<BlobId>>;
    /// The bytes of a file are removed: it may be added again.
    async fn end_drop(&self, id: &BlobId) -> Result<()>;
    /// Jobs of which it is not known which files they need, `most` of them at most.
    async fn unfiled(&self, most: u32) -> Result<Vec<UnfiledJob>>;
    /// Which files each of those jobs needs.
    async fn file(&self, jobs: Vec<(JobId, Vec<BlobId>)>) -> Result<()>;
    /// Jobs that are settled, the longest over first, `most` of them at most.
    async fn kept_jobs(&self, most: u32) -> Result<Vec<KeptJob>>;
    /// Those of them whose bytes were not counted, as of that version.
    async fn uncounted_jobs(&self, most: u32) -> Result<Vec<(JobId, u64)>>;
    /// The files of each of those jobs have so many bytes, as long as it keeps that version.
    async fn count_jobs(&self, jobs: Vec<(JobId, u64, u64)>) -> Result<()>;

    /// Adds a job with a cursor at block 0 of each lane, unless `key` was used before or a file is not there.
    async fn add_job(&self, job: NewJob, key: Option<IdempotencyKey>) -> Result<Added>;
    /// What became of an earlier job under that key, where there was one.
    async fn keyed(&self, key: &IdempotencyKey) -> Result<Option<Added>>;
    /// A job.
    async fn job(&self, id: &JobId) -> Result<Option<JobRow>>;
    /// Those of these jobs that are not there.
    async fn unknown_jobs(&self, jobs: Vec<JobId>) -> Result<Vec<JobId>>;
    /// A page of jobs, in the order that is asked for.
    async fn jobs(&self, filter: JobFilter) -> Result<Vec<JobRow>>;
    /// What a list says of each of those jobs beside its row, in the same order.
    async fn standings(&self, jobs: &[JobId]) -> Result<Vec<Standing>>;
    /// Seconds for which each of those jobs has run, in the same order; `None` where it does not run.
    async fn run_times(&self, jobs: &[JobId]) -> Result<Vec<Option<f64>>>;
    /// Lists go by how far those jobs are from now on, where they are not settled.
    async fn look_out(&self, outlooks: Vec<Outlook>) -> Result<()>;
    /// Lists go by how many workers hold batches of each job now.
    async fn count_workers(&self) -> Result<()>;
    /// Jobs that are not over, or whose files do not have their last form, the oldest first.
    async fn unsettled_jobs(&self) -> Result<Vec<JobRow>>;
    /// What changes most of those jobs.
    async fn heads(&self) -> Result<Vec<JobHead>>;
    /// Changes a job that still has `version`, and counts it up; false where it has not. A job that
    /// is over loses its cursors, leases and failures, one that is settled its commits too; pauses are
    /// taken off its run time.
    async fn change_job(&self, id: &JobId, version: u64, change: JobChange) -> Result<bool>;
    /// Forgets a job and all of it; false where there was none.
    async fn remove_job(&self, id: &JobId) -> Result<bool>;
    /// The same of one that is settled and still has `version`; false where it is not so.
    async fn remove_settled(&self, id: &JobId, version: u64) -> Result<bool>;

    /// What a job's work looks like.
    async fn ledger(&self, job: &JobId) -> Result<Ledger>;
    /// What of a job can be handed out.
    async fn unclaimed(&self, job: &JobId) -> Result<Unclaimed>;
    /// Batches of all jobs that came back and were not handed out again.
    async fn returned(&self) -> Result<Vec<(JobId, BatchKey)>>;
    /// Hands out each batch that is the next of its lane or was returned, of a job that is queued
    /// or running, for `time`; says which. A queued job runs from its first batch on.
    async fn claim(&self, claims: Vec<Claim>, time: Duration) -> Result<Vec<bool>>;
    /// Gives those leases `time` from now that `worker` still has; says which.
    async fn renew(&self, worker: &WorkerId, leases: Vec<LeaseId>, time: Duration) -> Result<Vec<LeaseId>>;
    /// Ends a lease and returns its batch; `failure` is counted against batch and worker. `None`
    /// where there is no such lease.
    async fn release(&self, lease: &LeaseId, failure: Option<String>) -> Result<Option<Released>>;
    /// Ends the leases whose time is over as failures, returns their batches.
    async fn expire(&self) -> Result<Vec<Released>>;
    /// Records a batch's sum if there is none, ends its lease; otherwise compares.
    async fn commit(&self, commit: NewCommit) -> Result<CommitOutcome>;
    /// What was brought of some blocks of a lane.
    async fn commits(&self, job: &JobId, lane: Lane, blocks: Range<u32>) -> Result<Vec<CommitRow>>;
    /// What was brought of a job after the `after`-th, in the order of coming.
    async fn commits_after(&self, job: &JobId, after: u64) -> Result<Brought>;

    /// Gives `holder` the right to append to a job's sums for `time`; `None` where another has it, or the
    /// job is settled. A mandate that was given before ends.
    async fn take_merge(&self, job: &JobId, holder: &str, time: Duration) -> Result<Option<Mandate>>;
    /// Gives `holder` `time` from now for each of its mandates; says which those are.
    async fn keep_merges(&self, holder: &str, time: Duration) -> Result<Vec<(JobId, Mandate)>>;
    /// Ends all mandates of `holder`.
    async fn leave_merges(&self, holder: &str) -> Result<()>;
    /// Writes down how far a job's picture is. An error without the mandate, as are the next two.
    async fn publish(&self, job: &JobId, mandate: Mandate, progress: Progress) -> Result<()>;
    /// Remembers that the first `blocks` blocks of a lane are kept as one blob.
    async fn set_snapshot(&self, job: &JobId, mandate: Mandate, lane: Lane, blocks: u32) -> Result<()>;
    /// Adds a checkpoint; again changes nothing.
    async fn add_checkpoint(&self, job: &JobId, mandate: Mandate, checkpoint: NewCheckpoint) -> Result<()>;
    /// The layers' errors at a job's latest checkpoint; nothing before the first.
    async fn layers(&self, job: &JobId) -> Result<Vec<LayerError>>;
    /// How a job's samples are allocated; `None` before that is decided.
    async fn allocations(&self, job: &JobId) -> Result<Option<Allocations>>;
    /// A job's checkpoints in order.
    async fn curve(&self, job: &JobId) -> Result<Vec<CurveRow>>;

    /// A worker joins.
    async fn add_worker(&self, id: &WorkerId, join: WorkerJoin) -> Result<()>;
    /// A worker is heard of, and stands so from now on, unless it was told to leave; says how it stands.
    async fn see_worker(&self, id: &WorkerId, state: WorkerState) -> Result<Option<WorkerState>>;
    /// A worker stands so from now on; false where there is none.
    async fn set_worker_state(&self, id: &WorkerId, state: WorkerState) -> Result<bool>;
    /// A worker.
    async fn worker(&self, id: &WorkerId) -> Result<Option<WorkerRow>>;
    /// Workers that joined before the one with sequence `before`, the newest first, with their sequences.
    async fn workers(&self, before: Option<i64>, limit: u32) -> Result<Vec<(i64, WorkerRow)>>;
    /// Marks active and draining workers as lost that were not heard of for `time`; says which.
    async fn lose_workers(&self, time: Duration) -> Result<Vec<WorkerId>>;
    /// Workers that hold a batch of the job.
    async fn workers_of(&self, job: &JobId) -> Result<u32>;

    /// Forgets what was brought of `batches`, which are handed out again unless the job is over, and that
    /// `lanes` are kept as one blob.
    async fn uncommit(&self, job: &JobId, batches: Vec<BatchKey>, lanes: Vec<Lane>) -> Result<()>;
    /// Whoever appends to the job's sums has to read them again: what was brought has changed.
    async fn free_merge(&self, job: &JobId) -> Result<()>;
    /// Batches that a worker brought of jobs that are not over.
    async fn commits_by(&self, worker: &WorkerId) -> Result<Vec<(JobId, BatchKey)>>;
    /// Pins a job to a class of processors unless it is pinned; says to which it is.
    async fn pin_job(&self, id: &JobId, class: &str) -> Result<Option<String>>;
    /// Gives a job that still has `version` another specification, and counts it up; false where it has
    /// not. One that is over goes on at what is kept of each lane as a blob; what was brought or handed out
    /// past the blocks that both specifications have is forgotten.
    async fn extend_job(&self, id: &JobId, version: u64, to: Extension) -> Result<bool>;
    /// A worker gets no more batches, and why; false where there is none.
    async fn set_aside(&self, worker: &WorkerId, reason: &str) -> Result<bool>;

    /// Adds a token.
    async fn add_token(&self, token: TokenRow) -> Result<()>;
    /// All tokens, the oldest first.
    async fn tokens(&self) -> Result<Vec<TokenRow>>;
    /// The token whose hash that is.
    async fn token(&self, hash: &BlobId) -> Result<Option<TokenRow>>;
    /// Forgets a token; false where there was none.
    async fn remove_token(&self, id: &str) -> Result<bool>;

    /// The first notice of each job, where it is due, `most` of them at most. They are due again after `time`.
    async fn due_notices(&self, most: u32, time: Duration) -> Result<Vec<NoticeRow>>;
    /// A notice was told, or never will be.
    async fn end_notice(&self, sequence: i64) -> Result<()>;
    /// A notice is due again after `time`.
    async fn put_off_notice(&self, sequence: i64, time: Duration) -> Result<()>;

    /// Forgets idempotency keys older than `age`.
    async fn forget_keys(&self, age: Duration) -> Result<()>;
    /// Numbers for gauges.
    async fn counts(&self) -> Result<Counts>;
    /// Whether it answers.
    async fn ping(&self) -> Result<()>;
    /// Finishes what is under way and lets go of the database.
    async fn close(&self);
}

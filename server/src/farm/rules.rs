//! The farm's numbers.

use super::{keep::Kept, space::Room};
use crate::webhook::Reach;
use std::time::Duration;

/// Largest partial sum that is taken, without what its file adds to it.
pub const PARTIAL_BYTES_MAX: usize = 256 << 20;

/// How long, how many, how much.
#[derive(Clone, Debug)]
pub struct Rules {
    /// A lease ends so long after it was given or renewed.
    pub lease: Duration,
    /// A worker that was not heard of for two intervals, and at least for so long, loses what it holds before its leases
    /// end, where this server is the only one.
    pub missed: Duration,
    /// A worker that was not heard of for so long is lost.
    pub silence: Duration,
    /// A worker's beat is written down at most so often.
    pub note_beat: Duration,
    /// Shortest time between a worker's beats; it grows with the number of workers.
    pub beat: Duration,
    /// Beats a second of all workers together, about at most.
    pub beats_per_second: f64,
    /// Leases that ran out, workers lost and deadlines are looked for so often.
    pub tick: Duration,
    /// Bytes of sums in memory, of all jobs together; a job that needs more is refused.
    pub sums_bytes: u64,
    /// Sums of a job that is done are kept for more samples, where they have no more bytes than this.
    pub kept_sums_bytes: u64,
    /// Bytes of decoded sums that wait for their append in memory, on their way and in each job;
    /// others wait as blobs.
    pub fresh_bytes: u64,
    /// A lane's blocks since its last blob of sums, at most: so many partials are kept.
    pub partials_kept: u32,
    /// A server that was not heard of for so long loses the jobs whose sums it appends to.
    pub mandate: Duration,
    /// Mandates are lengthened, and pictures' progress is told to other servers, so often.
    pub keep_mandate: Duration,
    /// Batches given to a worker at a time.
    pub wants_max: u32,
    /// Version of the program whose workers render new jobs.
    pub build: &'static str,
    /// Jobs under way that were sent with one token, at most.
    pub jobs_per_token: usize,
    /// Share of batches that are rendered again by another worker, to compare.
    pub audit: f64,
    /// A worker that failed at so many jobs by its own fault, and brought nothing since, is put aside.
    pub failing_jobs: usize,
    /// A batch that so many workers gave back with a reason fails its job.
    pub failing_workers: u32,
    /// A batch that was given back with a reason so often fails its job, however few the workers.
    pub failures: u32,
    /// A batch whose worker was lost so often fails its job. More than workers that are killed at
    /// random lose of one batch, so that only a batch that kills them gets there.
    pub losses: u32,
    /// A worker that gave a batch back with a reason gets none for so long; twice as long each time
    /// until it brings one.
    pub rest: Duration,
    /// Where others may be told of jobs' changes.
    pub notices_to: Reach,
    /// Who could not be told is told again after so long; four times as long each time.
    pub notice_rest: Duration,
    /// Idempotency keys are remembered so long.
    pub keys: Duration,
    /// What is kept of jobs that are over.
    pub kept: Kept,
    /// An uploaded file that no job needs is kept so long after it was used last.
    pub unused: Duration,
    /// Says how much room there is.
    pub room: Room,
    /// Bytes of it that are kept free.
    pub reserve_bytes: u64,
    /// Largest upload.
    pub scene_bytes: u64,
    /// Files from so many bytes on are stripped of what a job does not read: smaller ones are fetched sooner than they are read.
    pub strip_from: u64,
}

impl Default for Rules {
    fn default() -> Self {
        Self {
            lease: Duration::from_secs(10),
            missed: Duration::from_secs(2),
            silence: Duration::from_secs(15),
            note_beat: Duration::from_secs(3),
            beat: Duration::from_millis(200),
            beats_per_second: 200.0,
            tick: Duration::from_millis(250),
            sums_bytes: 4 << 30,
            kept_sums_bytes: 512 << 20,
            fresh_bytes: 256 << 20,
            partials_kept: 8,
            mandate: Duration::from_secs(5),
            keep_mandate: Duration::from_secs(1),
            wants_max: 64,
            build: env!("CARGO_PKG_VERSION"),
            jobs_per_token: 1000,
            audit: 0.0,
            failing_jobs: 3,
            failing_workers: 3,
            failures: 5,
            losses: 10,
            rest: Duration::from_secs(1),
            notices_to: Reach::Public,
            notice_rest: Duration::from_secs(5),
            keys: Duration::from_hours(24),
            kept: Kept::default(),
            unused: Duration::from_hours(24),
            room: Room::endless(),
            reserve_bytes: 1 << 30,
            scene_bytes: 2 << 30,
            strip_from: 1 << 20,
        }
    }
}

impl Rules {
    /// Whether sums of jobs that are done are kept at all.
    pub fn keeps_sums(&self) -> bool {
        self.kept_sums_bytes > 0
    }
}

//! Where things are, under the farm's address.

use crate::id::{BlobId, JobId, LeaseId, WorkerId};

/// All jobs.
pub const JOBS: &str = "/v1/jobs";
/// All scenes.
pub const SCENES: &str = "/v1/scenes";
/// All workers.
pub const WORKERS: &str = "/v1/workers";
/// How many workers could be used.
pub const SCALING: &str = "/v1/scaling";

/// An uploaded file: its report; with `/bytes`, its bytes.
pub fn scene(id: &BlobId) -> String {
    format!("{SCENES}/{id}")
}

/// An uploaded file's bytes.
pub fn scene_bytes(id: &BlobId) -> String {
    format!("{SCENES}/{id}/bytes")
}

/// A job.
pub fn job(id: &JobId) -> String {
    format!("{JOBS}/{id}")
}

/// Something of a job: `events`, `image.exr`, `image.png`, `error.json`, `error.csv`, `error.svg`.
pub fn job_part(id: &JobId, part: &str) -> String {
    format!("{JOBS}/{id}/{part}")
}

/// A worker.
pub fn worker(id: &WorkerId) -> String {
    format!("{WORKERS}/{id}")
}

/// A worker's beat.
pub fn exchange(id: &WorkerId) -> String {
    format!("{WORKERS}/{id}/exchange")
}

/// Where a lease's sum goes.
pub fn lease_sum(id: &LeaseId) -> String {
    format!("/v1/leases/{id}/sum")
}

/// Where a lease is given back.
pub fn lease_failure(id: &LeaseId) -> String {
    format!("/v1/leases/{id}/failure")
}

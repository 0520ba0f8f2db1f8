//! What is kept of jobs that are over, and which uploaded files jobs need.

use ovtigre_proto::id::{BlobId, JobId};
use std::time::Duration;

/// A job whose files have their last form.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeptJob {
    /// Its name on the farm.
    pub id: JobId,
    /// Changes with every change of state, reason or priority.
    pub version: u64,
    /// Since when it is over, by the store's clock.
    pub over: Duration,
    /// Bytes of its files and of those of all jobs over for less long, as far as they were counted.
    pub with_later: u64,
}

/// A job of which it is not written down which files it needs: an earlier version took it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnfiledJob {
    /// Its name on the farm.
    pub id: JobId,
    /// Its scene.
    pub scene: BlobId,
    /// The farm's own document.
    pub spec: String,
}

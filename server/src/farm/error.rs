//! Why the farm did not do what was asked.

use crate::{
    blobs::BlobError,
    store::{error::StoreError, row::JobRow},
};
use ovtigre_core::film::size::Region;
use ovtigre_proto::{
    id::{BlobId, JobId},
    problem::Fault,
    status::JobState,
};

/// A request that was not followed.
#[derive(Debug, thiserror::Error)]
pub enum FarmError {
    /// Nothing of that name.
    #[error("there is no {what} '{id}'")]
    NotFound {
        /// Which kind.
        what: &'static str,
        /// Which name.
        id: String,
    },
    /// A job that cannot be taken as it is.
    #[error("the job cannot be taken: {}", said(.0))]
    Request(Vec<Fault>),
    /// A worker that cannot join.
    #[error("the worker cannot join: {}", said(.0))]
    Worker(Vec<Fault>),
    /// A change that cannot be made.
    #[error("the change cannot be made: {}", said(.0))]
    Patch(Vec<Fault>),
    /// An uploaded file that cannot be read.
    #[error("the scene cannot be read: {}", said(.0))]
    Scene(Vec<Fault>),
    /// Bytes that are not those they are said to be.
    #[error("the bytes have the hash {got}, not {named}: send them again")]
    HashMismatch {
        /// The name they came under.
        named: BlobId,
        /// Their hash.
        got: BlobId,
    },
    /// An upload without end.
    #[error("the upload is larger than the {limit} bytes that are taken")]
    TooLarge {
        /// Bytes at most.
        limit: u64,
    },
    /// A sum that is not that of the lease.
    #[error("the sum is not that of its lease: {0}")]
    Sum(String),
    /// The job is over.
    #[error("the job '{id}' is {}: it cannot be changed", .state.name())]
    Over {
        /// Which.
        id: JobId,
        /// How it ended.
        state: JobState,
    },
    /// The job has changed.
    #[error("the job has changed since: fetch it again; its version is {current} now")]
    Version {
        /// Its version.
        current: u64,
    },
    /// An idempotency key that was used for something else.
    #[error("the idempotency key was used for another request: choose a new one")]
    KeyTaken,
    /// Nobody can be told of jobs' changes.
    #[error("webhooks cannot be called: {0}")]
    Messenger(String),
    /// No batch came yet.
    #[error("the job '{0}' has no picture yet: ask again later")]
    NoPicture(JobId),
    /// It ended before there was a picture.
    #[error("the job '{0}' ended without a picture")]
    NeverPicture(JobId),
    /// A layer that the picture has not.
    #[error("the picture has no layer '{0}'")]
    NoLayer(String),
    /// A pixel that is not rendered.
    #[error("there is no pixel {x},{y}: {region} is rendered (x,y,width,height)")]
    NoPixel {
        /// Its column.
        x: u32,
        /// Its row.
        y: u32,
        /// What is rendered.
        region: Region,
    },
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A blob was not read or written.
    #[error(transparent)]
    Blob(#[from] BlobError),
    /// What is kept of a job cannot be used.
    #[error("what is kept of the job cannot be used: {0}")]
    Damaged(String),
    /// A file that comes while its bytes are removed, as no job needed them.
    #[error("the file '{0}' is just being removed, as no job needed it: send it again")]
    BeingRemoved(BlobId),
    /// Too many jobs of one token.
    #[error("there are {most} jobs under way of this token: wait for some to end, or cancel some")]
    TooManyJobs {
        /// As many as there may be.
        most: usize,
    },
    /// The disk is nearly full.
    #[error("the farm's disk is nearly full: make room on it, or remove jobs with ?purge=true")]
    Full,
    /// The farm is stopping.
    #[error("the farm is stopping: ask again later")]
    Stopping,
}

impl FarmError {
    /// A job has no picture: not yet, or never.
    pub fn no_picture(row: &JobRow) -> Self {
        if row.settled { Self::NeverPicture(row.id.clone()) } else { Self::NoPicture(row.id.clone()) }
    }

    /// Nothing of that name.
    pub fn not_found(what: &'static str, id: &(impl ToString + ?Sized)) -> Self {
        Self::NotFound { what, id: id.to_string() }
    }
}

/// A fault at `pointer` of a document.
pub fn fault(pointer: impl Into<String>, detail: impl Into<String>) -> Fault {
    Fault { pointer: pointer.into(), detail: detail.into() }
}

fn said(faults: &[Fault]) -> String {
    faults.first().map_or_else(String::new, |fault| fault.detail.clone())
}

/// What the farm answers.
pub type Result<T> = std::result::Result<T, FarmError>;

//! What somebody is still to be told of jobs.

use jiff::Timestamp;
use ovtigre_proto::{id::JobId, status::JobState};
use std::fmt;

/// Whom to tell of a job's changes.
#[derive(Clone, PartialEq, Eq)]
pub struct Webhook {
    /// Where notices are posted.
    pub url: String,
    /// What they are signed with, as it was given.
    pub secret: String,
}

impl fmt::Debug for Webhook {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Neither is to be in a log.
        f.debug_struct("Webhook").finish_non_exhaustive()
    }
}

/// A change of a job of which somebody is to be told.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NoticeRow {
    /// Its place in the order of all.
    pub sequence: i64,
    /// Whose change.
    pub job: JobId,
    /// The job's name for people.
    pub name: String,
    /// Its state since then.
    pub state: JobState,
    /// Why.
    pub reason: Option<String>,
    /// When.
    pub changed_at: Timestamp,
    /// How often it was tried to tell, this time included.
    pub tries: u32,
    /// Whom to tell.
    pub webhook: Webhook,
}

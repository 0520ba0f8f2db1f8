//! A user's changes to a job.

use super::{
    Farm,
    book::HandOut,
    error::{FarmError, Result, fault},
    extend::changes_spec,
};
use crate::store::row::{JobChange, JobRow};
use ovtigre_proto::{
    id::JobId,
    job::JobPatch,
    status::{JobState, JobStatus},
};
use std::sync::Arc;

impl Farm {
    /// Changes a job, if it still has one of `versions` where some are given.
    pub async fn patch(
        self: &Arc<Self>,
        id: &JobId,
        patch: &JobPatch,
        versions: Option<Vec<u64>>,
    ) -> Result<JobStatus> {
        if let Some(state) = patch.state.filter(|s| !matches!(s, JobState::Paused | JobState::Running)) {
            let detail = format!("'{}' cannot be asked for: 'paused' or 'running' can", state.name());
            return Err(FarmError::Patch(vec![fault("/state", detail)]));
        }
        if changes_spec(patch) {
            let extended = self.extend(id, patch, versions.as_deref()).await?;
            let rest = JobPatch { priority: patch.priority, state: patch.state, ..JobPatch::default() };
            // A job that goes on is not paused unless that is asked for.
            let over = extended.state.is_over();
            return if over || rest == JobPatch::default() {
                Ok(extended)
            } else {
                Box::pin(self.patch(id, &rest, None)).await
            };
        }
        loop {
            let row = self.job_row(id).await?;
            if versions.as_ref().is_some_and(|versions| !versions.contains(&row.version)) {
                return Err(FarmError::Version { current: row.version });
            }
            if row.state.is_over() {
                return Err(FarmError::Over { id: id.clone(), state: row.state });
            }
            let change = JobChange {
                priority: patch.priority.filter(|p| *p != row.priority),
                state: next_state(&row, patch.state),
                ..JobChange::default()
            };
            let nothing = change.priority.is_none() && change.state.is_none();
            if nothing || self.store.change_job(id, row.version, change).await? {
                break;
            }
        }
        let row = self.job_row(id).await?;
        self.follow(&row);
        self.status_of(&row).await
    }

    /// Brings the book up to what the store says.
    pub(super) fn follow(&self, row: &JobRow) {
        let mut book = self.book();
        if row.state.is_over() {
            book.remove(&row.id);
        } else if let Some(entry) = book.job(&row.id) {
            entry.priority = row.priority;
            entry.hand_out = if row.state == JobState::Paused { HandOut::Paused } else { HandOut::Yes };
        }
        book.more().notify_waiters();
        drop(book);
        if let Some(live) = self.live(&row.id) {
            live.changed();
        }
    }
}

/// The state that the wish leads to; `None` where the job is in it.
fn next_state(row: &JobRow, wish: Option<JobState>) -> Option<JobState> {
    match (row.state, wish?) {
        (JobState::Queued | JobState::Running, JobState::Paused) => Some(JobState::Paused),
        (JobState::Paused, JobState::Running) if row.started_at.is_none() => Some(JobState::Queued),
        (JobState::Paused, JobState::Running) => Some(JobState::Running),
        _ => None,
    }
}

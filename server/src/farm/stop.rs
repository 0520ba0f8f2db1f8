//! How a job ends: by itself, by its deadline, by a user, by failing.

use super::{
    Farm,
    append::{Held, Merge},
    error::{FarmError, Result},
    live::{Ending, Live, Made, Waits},
    outlook::part,
};
use crate::{
    blobs::{BlobFolder, BlobName},
    fail_point::FailPoint,
    store::row::{JobChange, JobRow, Settlement},
};
use ovtigre_proto::{id::JobId, status::JobState, telemetry::span::Place};
use std::sync::Arc;

/// Whether the wish to end can be followed now.
pub(super) fn can_end(merge: &Merge, ending: &Ending) -> bool {
    ending.waits == Waits::Not || merge.has_picture()
}

impl Farm {
    /// Writes the picture that stays, then the job's last row, then removes what is not needed.
    pub(super) async fn finish(&self, live: &Arc<Live>, held: Held, ending: Ending) -> Result<()> {
        let mandate = Self::mandate(live)?;
        self.book().remove(&live.id);
        let held = self.last_look(live, held).await?;
        let merge = held.as_ref().expect("loaded by the caller");
        let (progress, manifest) = (merge.progress(), merge.manifest(&live.identity));
        drop(held);
        FailPoint::EndBeforeResult.pass();
        if manifest.is_some() {
            let Made { manifest, bytes } = self.make_exr(live).await?;
            self.blobs.put(&BlobName::Result(live.id.clone(), manifest), bytes).await?;
        }
        FailPoint::EndAfterResult.pass();
        match ending.state {
            JobState::Done => self.keep_sums(live).await?,
            _ => self.drop_sums(live).await?,
        }
        FailPoint::EndAfterSums.pass();
        let part = part(&live.spec, &progress, ending.state);
        let settlement = Settlement { mandate, progress, part, manifest, certified: ending.certified };
        let change = |row: &JobRow| {
            let over = row.state.is_over();
            Some(JobChange {
                priority: None,
                state: (!over).then_some(ending.state),
                reason: ending.reason.clone().filter(|_| !over),
                settlement: Some(settlement.clone()),
            })
        };
        match self.change(&live.id, change).await {
            // It was purged while its picture was written.
            Err(FarmError::NotFound { .. }) => {
                self.forget_live(&live.id);
                return Ok(self.blobs.delete_all(&BlobFolder::Job(live.id.clone())).await?);
            }
            done => self.tell_over(&done?),
        }
        FailPoint::EndAfterRow.pass();
        self.forget_live(&live.id);
        live.changed();
        self.remove_leftovers(&live.id).await
    }

    /// Fails a job whose sums are damaged: its picture cannot be made.
    pub(super) async fn settle_without_picture(&self, live: &Live, reason: String) -> Result<()> {
        self.book().remove(&live.id);
        let progress = live.view().progress;
        let part = part(&live.spec, &progress, JobState::Failed);
        let settlement =
            Settlement { mandate: Self::mandate(live)?, progress, part, manifest: None, certified: false };
        let change = |row: &JobRow| {
            let over = row.state.is_over();
            Some(JobChange {
                priority: None,
                state: (!over).then_some(JobState::Failed),
                reason: Some(reason.clone()),
                settlement: Some(settlement.clone()),
            })
        };
        self.drop_sums(live).await?;
        self.tell_over(&self.change(&live.id, change).await?);
        self.forget_live(&live.id);
        self.remove_leftovers(&live.id).await
    }

    /// A job is over, and its files have their last form.
    fn tell_over(&self, row: &JobRow) {
        let JobRow { id, state, reason, .. } = row;
        tracing::info!(job = %id, state = state.name(), reason, "job is over");
        let span = self.traces.span("job", Place::Job(id)).since(row.created_at.into());
        if span.is_told() {
            let span =
                span.note("ovtigre.name", row.name.clone()).note("ovtigre.scene", row.scene.to_string());
            let mut span =
                span.note("ovtigre.state", state.name()).note("ovtigre.samples", row.progress.samples);
            if *state == JobState::Failed {
                span.fail(reason.as_deref().unwrap_or_default());
            }
        }
    }

    /// Removes partials of a job that is over, and its sums unless they are kept.
    pub(super) async fn remove_leftovers(&self, id: &JobId) -> Result<()> {
        self.blobs.delete_all(&BlobFolder::Partials(id.clone())).await?;
        FailPoint::EndBetweenLeftovers.pass();
        if self.store.ledger(id).await?.snapshots.is_empty() {
            self.blobs.delete_all(&BlobFolder::Prefixes(id.clone())).await?;
        }
        Ok(())
    }

    /// Stops a job and keeps its picture so far; one that is over stays as it is.
    pub async fn cancel(&self, id: &JobId) -> Result<JobRow> {
        self.stop(id, JobState::Cancelled, "cancelled".to_owned()).await
    }

    /// Stops a job that cannot go on, and keeps its picture so far.
    pub(super) async fn fail(&self, id: &JobId, reason: String) -> Result<()> {
        tracing::warn!(job = %id, reason, "job failed");
        self.stop(id, JobState::Failed, reason).await.map(|_| ())
    }

    async fn stop(&self, id: &JobId, state: JobState, reason: String) -> Result<JobRow> {
        let change = |row: &JobRow| {
            let reason = Some(reason.clone());
            (!row.state.is_over()).then_some(JobChange { state: Some(state), reason, ..JobChange::default() })
        };
        let row = self.change(id, change).await?;
        self.book().remove(id);
        if let Some(live) = self.live(id) {
            live.end(Ending { state, reason: None, certified: false, waits: Waits::Not });
            live.changed();
        }
        Ok(row)
    }

    /// Stops a job and forgets it with its files.
    pub async fn purge(&self, id: &JobId) -> Result<()> {
        self.cancel(id).await?;
        if let Some(live) = self.live(id) {
            // Whoever appends or ends it holds this.
            let _held = live.merge.lock().await;
            self.forget_live(id);
        }
        if !self.store.remove_job(id).await? {
            return Err(FarmError::not_found("job", id));
        }
        self.blobs.delete_all(&BlobFolder::Job(id.clone())).await?;
        Ok(())
    }

    /// Changes a job by what `decide` makes of it, again where somebody else was faster; `None`
    /// leaves it. Returns the job as it is then.
    pub(super) async fn change(
        &self,
        id: &JobId,
        decide: impl Fn(&JobRow) -> Option<JobChange> + Send,
    ) -> Result<JobRow> {
        loop {
            let row = self.job_row(id).await?;
            let Some(change) = decide(&row) else { return Ok(row) };
            if self.store.change_job(id, row.version, change).await? {
                return self.job_row(id).await;
            }
        }
    }
}

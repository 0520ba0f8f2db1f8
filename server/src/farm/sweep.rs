//! What a farm that died has left behind, and nobody needs.

use super::{Farm, error::Result, open::UPLOAD_MAX, unused::When};
use crate::blobs::{BlobFolder, Sums};
use ovtigre_proto::id::JobId;
use std::{
    sync::Arc,
    time::{Duration, SystemTime},
};

/// Jobs that are asked for at a time.
const JOBS_AT_A_TIME: usize = 1000;
/// Files that were written to within this time before the farm began may be its own: clocks of disks are coarse.
const COARSE: Duration = Duration::from_secs(2);

impl Farm {
    /// Removes uploads that were cut off, uploaded files without a row, and files of jobs that are over or that are not there.
    pub(super) async fn sweep(&self) -> Result<()> {
        // Alone nobody uploads anything yet.
        let age = if self.is_shared() { UPLOAD_MAX } else { Duration::ZERO };
        if self.is_shared() {
            self.blobs.delete_older(&BlobFolder::Incoming, age).await?;
        } else {
            self.blobs.delete_all(&BlobFolder::Incoming).await?;
        }
        self.blobs.delete_older(&BlobFolder::AllParts, UPLOAD_MAX).await?;
        self.remove_again(When::Starting).await?;
        for id in self.blobs.scenes_older(age).await? {
            if self.store.scene(&id).await?.is_none() && self.drop_file(&id, UPLOAD_MAX).await? {
                tracing::info!(file = %id, "an uploaded file was removed that has no row");
            }
        }
        self.sweep_jobs().await
    }

    async fn sweep_jobs(&self) -> Result<()> {
        let jobs = self.blobs.jobs().await?;
        let all: Vec<JobId> = jobs.keys().cloned().collect();
        for some in all.chunks(JOBS_AT_A_TIME) {
            for id in self.store.unknown_jobs(some.to_vec()).await? {
                self.blobs.delete_all(&BlobFolder::Job(id)).await?;
            }
        }
        for id in jobs.into_iter().filter_map(|(id, sums)| (sums == Sums::Some).then_some(id)) {
            if self.store.job(&id).await?.is_some_and(|row| row.settled) {
                self.remove_leftovers(&id).await?;
            }
        }
        Ok(())
    }

    /// Removes what was being written when a farm died, the latest before `start`.
    pub(super) async fn remove_staged(self: Arc<Self>, start: SystemTime) {
        let age = if self.is_shared() { UPLOAD_MAX } else { COARSE };
        let Some(time) = start.checked_sub(age) else { return };
        match self.blobs.delete_staged(time).await {
            Ok(0) => {}
            Ok(files) => tracing::info!(files, "files removed that were never whole"),
            Err(error) => tracing::warn!(%error, "files that were never whole were not removed"),
        }
    }
}

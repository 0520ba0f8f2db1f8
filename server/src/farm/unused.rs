//! Uploaded files that no job needs any more.
//!
//! What must never be: a job whose scene is gone. A job is added, and a file is forgotten, in transactions of the store, of
//! which one at a time writes, whatever the number of servers: a job that comes first is found by the second, which then leaves
//! the file; one that comes later does not find the file, and is refused (`Added::Lacks`). A file is forgotten before its bytes
//! are removed, never after.
//!
//! The other half is a file that comes again while its bytes are being removed. Until the store is told that they are gone,
//! it does not add the file (`add_scene`), and who sends it waits. Bytes that were written before that, and removed by it, are
//! written once more when the file has its row (`remember`): from then on nobody removes them, as a file with a row is only
//! removed when it was not used for long. A server that dies in between leaves a note, which another follows after
//! `REMOVED_AGAIN`; one that was held up itself between note and removal leaves the removal to that. What is left is a process
//! that stands still for longer than that within one request for removal.

use super::{
    Farm,
    error::{FarmError, Result},
    keep::Left,
    open::read_document,
    submit::not_uploaded,
};
use crate::{
    blobs::{BlobError, BlobName},
    store::kept::UnfiledJob,
};
use bytes::Bytes;
use ovtigre_proto::{id::BlobId, scene::SceneReport};
use std::time::{Duration, Instant};

/// Files that are removed, and jobs whose files are written down, in one look at most.
const FILES_A_LOOK: u32 = 500;
/// A removal that was not done by then is done again by another server.
const REMOVED_AGAIN: Duration = Duration::from_mins(15);
/// Who sends a file that is being removed waits so long.
const PATIENCE: Duration = Duration::from_secs(10);
/// Between two looks whether it is removed.
const LOOK: Duration = Duration::from_millis(20);

/// When removals that were not done are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum When {
    Starting,
    Working,
}

impl Farm {
    /// Removes files that no job needs and nobody asked for for a while.
    pub(super) async fn drop_unused(&self) -> Result<Left> {
        self.file_jobs().await?;
        self.remove_again(When::Working).await?;
        let unused = self.rules.unused;
        let files = self.store.unused_scenes(unused, FILES_A_LOOK).await?;
        let all = files.len() < FILES_A_LOOK as usize;
        let mut dropped = 0;
        for id in files {
            if self.stopping.is_cancelled() {
                return Ok(Left::Nothing);
            }
            dropped += usize::from(self.drop_file(&id, unused).await?);
        }
        if dropped > 0 {
            tracing::info!(files = dropped, "uploaded files removed that no job needs");
        }
        // Where none could be dropped, the next look soon would not do better.
        Ok(if all || dropped == 0 { Left::Nothing } else { Left::Something })
    }

    /// Forgets a file and removes its bytes, unless it is needed or was used within `unused`; whether it did.
    pub(super) async fn drop_file(&self, id: &BlobId, unused: Duration) -> Result<bool> {
        let since = Instant::now();
        if !self.store.drop_scene(id, unused).await? {
            return Ok(false);
        }
        self.remove_file(id, since).await.map(|()| true)
    }

    async fn remove_file(&self, id: &BlobId, since: Instant) -> Result<()> {
        if since.elapsed() > REMOVED_AGAIN / 3 {
            return Ok(());
        }
        self.blobs.delete(&BlobName::Scene(id.clone())).await?;
        Ok(self.store.end_drop(id).await?)
    }

    /// Follows notes of removals that were not done; at the start of a farm that is alone, nobody can be at them.
    pub(super) async fn remove_again(&self, when: When) -> Result<()> {
        let alone = when == When::Starting && !self.is_shared();
        let time = if alone { Duration::ZERO } else { REMOVED_AGAIN };
        let since = Instant::now();
        for id in self.store.dropped_before(time).await? {
            self.remove_file(&id, since).await?;
        }
        Ok(())
    }

    /// Writes down which files jobs of earlier versions need.
    async fn file_jobs(&self) -> Result<()> {
        loop {
            let jobs = self.store.unfiled(FILES_A_LOOK).await?;
            let all = jobs.len() < FILES_A_LOOK as usize;
            let files = |job: &UnfiledJob| match read_document(&job.spec) {
                Ok(spec) => spec.files(&job.scene),
                Err(error) => {
                    tracing::warn!(job = %job.id, %error, "its document cannot be read");
                    vec![job.scene.clone()]
                }
            };
            self.store.file(jobs.iter().map(|job| (job.id.clone(), files(job))).collect()).await?;
            if all || self.stopping.is_cancelled() {
                return Ok(());
            }
        }
    }

    /// Waits until a file is not being removed.
    pub(super) async fn let_removal_end(&self, id: &BlobId) -> Result<()> {
        let since = Instant::now();
        while self.store.is_dropped(id).await? {
            if since.elapsed() > PATIENCE {
                return Err(FarmError::BeingRemoved(id.clone()));
            }
            tokio::time::sleep(LOOK).await;
        }
        Ok(())
    }

    /// The bytes of an uploaded file that `pointer` of a request names.
    pub(super) async fn upload_bytes(&self, pointer: &str, id: &BlobId) -> Result<Bytes> {
        match self.blobs.get(&BlobName::Scene(id.clone())).await {
            Err(BlobError::Missing(_)) => Err(not_uploaded(pointer, id)),
            other => Ok(other?),
        }
    }

    /// Gives a file its row, whose bytes were written since its removal ended, if it was ever removed.
    pub(super) async fn remember(&self, report: SceneReport, bytes: Bytes) -> Result<()> {
        let id = report.id.clone();
        if !self.store.add_scene(report).await? {
            return Err(FarmError::BeingRemoved(id));
        }
        let name = BlobName::Scene(id);
        match self.blobs.size(&name).await {
            Err(BlobError::Missing(_)) => Ok(self.blobs.put(&name, bytes).await?),
            there => Ok(there.map(drop)?),
        }
    }
}

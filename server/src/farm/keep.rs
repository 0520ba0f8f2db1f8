//! What is kept of jobs that are over: by how long they are over, and by how much they take up.

use super::{Farm, error::Result, open::UPLOAD_MAX};
use crate::{blobs::BlobFolder, store::kept::KeptJob};
use futures::{StreamExt as _, TryStreamExt as _};
use std::{sync::Arc, time::Duration};

/// Jobs that are removed, and jobs whose files are counted, in one look at most: the next one goes on.
const JOBS_A_LOOK: u32 = 500;
/// Jobs whose files are counted at a time.
const COUNTED_AT_A_TIME: usize = 8;
/// Between two looks.
const REST: Duration = Duration::from_hours(1);
/// Between two looks where the first left something, or failed.
const SHORT_REST: Duration = Duration::from_secs(5);

/// How long and how much of jobs that are over is kept; for ever, and all, where it is not said.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Kept {
    /// So long after they were over.
    pub time: Option<Duration>,
    /// So many bytes of files of all together: those that are over longest go first.
    pub bytes: Option<u64>,
}

/// Whether a look left something to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Left {
    Something,
    Nothing,
}

impl Farm {
    /// Tidies up now and then.
    pub(super) async fn keep_house(self: Arc<Self>) {
        loop {
            let rest = match self.forget_old().await {
                Ok(Left::Nothing) => REST,
                Ok(Left::Something) => SHORT_REST,
                Err(error) => {
                    tracing::error!(%error, "tidying up failed");
                    SHORT_REST
                }
            };
            tokio::select! {
                () = self.stopping.cancelled() => return,
                () = tokio::time::sleep(rest) => {}
            }
        }
    }

    /// Forgets idempotency keys, jobs that were kept long enough, files that no job needs, and uploads that were cut off.
    pub(super) async fn forget_old(&self) -> Result<Left> {
        let jobs = self.let_go().await?;
        let files = self.drop_unused().await?;
        self.store.forget_keys(self.rules.keys).await?;
        self.blobs.delete_older(&BlobFolder::AllParts, UPLOAD_MAX).await?;
        self.blobs.delete_older(&BlobFolder::Incoming, UPLOAD_MAX).await?;
        Ok(if jobs == Left::Nothing { files } else { jobs })
    }

    /// Removes jobs, with their files, that are over longer or take up more than the rules keep.
    async fn let_go(&self) -> Result<Left> {
        let Kept { time, bytes } = self.rules.kept;
        if time.is_none() && bytes.is_none() {
            return Ok(Left::Nothing);
        }
        let mut left = Left::Nothing;
        if bytes.is_some() {
            left = self.count_bytes().await?;
        }
        let jobs = self.store.kept_jobs(JOBS_A_LOOK).await?;
        let all = jobs.len() < JOBS_A_LOOK as usize;
        for KeptJob { id, version, over, with_later } in jobs {
            if self.stopping.is_cancelled() {
                return Ok(Left::Nothing);
            }
            let reason = match time {
                Some(time) if over > time => "it was kept as long as jobs are",
                _ if bytes.is_some_and(|most| with_later > most) => {
                    "jobs that are over take up more than is kept"
                }
                // Later ones are over for a shorter time, and fit.
                _ => return Ok(left),
            };
            if self.store.remove_settled(&id, version).await? {
                self.blobs.delete_all(&BlobFolder::Job(id.clone())).await?;
                tracing::info!(job = %id, reason, "job removed");
            }
        }
        Ok(if all { left } else { Left::Something })
    }

    /// Counts the bytes of jobs of which that is not known.
    async fn count_bytes(&self) -> Result<Left> {
        let jobs = self.store.uncounted_jobs(JOBS_A_LOOK).await?;
        let all = jobs.len() < JOBS_A_LOOK as usize;
        let counted = |(job, version)| async move {
            let bytes = self.blobs.bytes_of(&job).await?;
            Ok::<_, super::error::FarmError>((job, version, bytes))
        };
        let counted = futures::stream::iter(jobs).map(counted).buffer_unordered(COUNTED_AT_A_TIME);
        self.store.count_jobs(counted.try_collect().await?).await?;
        Ok(if all { Left::Nothing } else { Left::Something })
    }
}

//! Batches that are rendered again by somebody else, to compare.

use super::{Farm, counters::Fate, error::Result, live::Live};
use crate::{
    blobs::BlobName,
    store::row::{BatchKey, Lane},
};
use ovtigre_proto::{
    id::{BlobId, JobId, LeaseId, WorkerId},
    lease::Commit,
    status::WorkerState,
};
use std::{
    collections::{BTreeMap, BTreeSet},
    time::Instant,
};

/// Batches that wait to be compared, at most.
const WAITING_MAX: usize = 1000;

/// What a sum is held against.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Audit {
    /// Who brought the sum that counts.
    pub first: WorkerId,
    /// Who brought another one, and its hash: the third says who is right.
    pub second: Option<(WorkerId, BlobId)>,
}

/// Batches that wait to be rendered again.
#[derive(Debug, Default)]
pub struct Audits {
    waiting: Vec<(JobId, BatchKey, Audit)>,
}

impl Audits {
    /// A batch is to be rendered again; where too many wait, none more.
    pub fn ask(&mut self, job: JobId, batch: BatchKey, audit: Audit) {
        if self.waiting.len() < WAITING_MAX {
            self.waiting.push((job, batch, audit));
        }
    }

    /// One for a worker that had no part in it, of a job that `fits`.
    pub fn take(
        &mut self,
        worker: &WorkerId,
        fits: impl Fn(&JobId) -> bool,
    ) -> Option<(JobId, BatchKey, Audit)> {
        let strange = |audit: &Audit| {
            audit.first != *worker && audit.second.as_ref().is_none_or(|(second, _)| second != worker)
        };
        let found = self.waiting.iter().position(|(job, _, audit)| strange(audit) && fits(job))?;
        Some(self.waiting.remove(found))
    }

    /// A job is over.
    pub fn forget(&mut self, job: &JobId) {
        self.waiting.retain(|(of, ..)| of != job);
    }
}

impl Farm {
    /// Whether the batch of a lease is compared: by chance, which follows from the lease's random name.
    pub(super) fn is_audited(&self, lease: &LeaseId) -> bool {
        let hash = blake3::hash(lease.as_str().as_bytes());
        let number = u32::from_le_bytes(hash.as_bytes()[..4].try_into().expect("four bytes"));
        f64::from(number) < self.rules.audit * 2.0_f64.powi(32)
    }

    /// A sum for comparison came.
    pub(super) async fn compare(
        &self,
        live: &Live,
        batch: BatchKey,
        by: &WorkerId,
        audit: Audit,
        got: &BlobId,
    ) -> Result<Commit> {
        let lane = batch.lane();
        let rows = self.store.commits(&live.id, lane, batch.block..batch.block + 1).await?;
        let Some(kept) = rows.first().map(|row| &row.hash) else { return Ok(Commit::NotNeeded) };
        let job = &live.id;
        match audit.second {
            None if got == kept => {
                self.counters.count(Fate::Duplicate);
                return Ok(Commit::Duplicate);
            }
            None => {
                self.counters.count(Fate::Disagreeing);
                let first = &audit.first;
                tracing::warn!(%job, %batch, %first, second = %by, "two sums of one batch differ: a third decides");
                let second = Some((by.clone(), got.clone()));
                self.book().audits.ask(job.clone(), batch, Audit { first: audit.first, second });
            }
            Some((second, other)) => {
                let differs = format!("its sum of {batch} of job '{job}' differs from that of two others");
                if got == kept {
                    self.distrust(&second, &differs).await?;
                } else if *got == other {
                    self.distrust(&audit.first, &differs).await?;
                } else {
                    tracing::error!(%job, %batch, "three sums of one batch differ: nobody is right");
                }
            }
        }
        Ok(Commit::NotNeeded)
    }

    /// A worker brought a wrong sum: it gets no more batches, and all that it brought of jobs under way is
    /// rendered again.
    async fn distrust(&self, worker: &WorkerId, reason: &str) -> Result<()> {
        self.put_aside(worker, reason).await?;
        let mut doubtful: BTreeMap<JobId, Vec<BatchKey>> = BTreeMap::new();
        for (job, batch) in self.store.commits_by(worker).await? {
            doubtful.entry(job).or_default().push(batch);
        }
        for (job, batches) in doubtful {
            if let Some(live) = self.live(&job) {
                self.doubt(&live, batches).await?;
            }
        }
        Ok(())
    }

    /// A worker gets no more batches; those that it holds go to others.
    pub(super) async fn put_aside(&self, worker: &WorkerId, reason: &str) -> Result<()> {
        tracing::warn!(%worker, reason, "worker is put aside");
        self.store.set_aside(worker, reason).await?;
        self.crew().set_state(worker, WorkerState::Aside);
        let held = self.book().held_by(worker);
        for lease in held {
            if let Some(released) = self.store.release(&lease, None).await? {
                self.book().take_back(&released.lease);
            }
        }
        self.drop_audits(Some(worker));
        Ok(())
    }

    /// Batches for comparison come back whose leases have ended, or are a worker's.
    pub(super) fn drop_audits(&self, by: Option<&WorkerId>) {
        let mut book = self.book();
        let before = Instant::now().checked_sub(self.rules.lease);
        for lease in book.audits_held(before, by) {
            if let Some((row, audit)) = book.end_audit(&lease) {
                book.audits.ask(row.job, row.batch, audit);
            }
        }
    }

    /// Renders batches again, and with them all that is in one blob with them.
    pub(super) async fn doubt(&self, live: &Live, batches: Vec<BatchKey>) -> Result<()> {
        let mut held = live.merge.lock().await;
        let ledger = self.store.ledger(&live.id).await?;
        let spoilt: Vec<(Lane, u32)> = (ledger.snapshots.into_iter())
            .filter(|(lane, blocks)| batches.iter().any(|b| b.lane() == *lane && b.block < *blocks))
            .collect();
        let mut again: BTreeSet<BatchKey> = batches.into_iter().collect();
        for (lane, blocks) in &spoilt {
            again.extend((0..*blocks).map(|block| lane.at(block)));
        }
        self.again(live, again.into_iter().collect(), spoilt.into_iter().map(|(lane, _)| lane).collect())
            .await?;
        // What is in memory, here or at another server, has wrong sums in it: it is read again.
        self.store.free_merge(&live.id).await?;
        live.set_mandate(None);
        live.set_elsewhere(false);
        drop(live.arrivals());
        *held = None;
        live.kick.notify_one();
        Ok(())
    }

    /// Batches whose sums are lost or doubtful are handed out again.
    pub(super) async fn again(&self, live: &Live, batches: Vec<BatchKey>, lanes: Vec<Lane>) -> Result<()> {
        tracing::warn!(job = %live.id, batches = batches.len(), "batches are rendered again");
        // A blob that is there is not written again: what is damaged goes before its row does.
        let ledger = self.store.ledger(&live.id).await?;
        for row in ledger.commits.into_iter().filter(|row| batches.contains(&row.batch)) {
            self.blobs.delete(&BlobName::Partial(live.id.clone(), row.batch, row.hash)).await?;
        }
        self.store.uncommit(&live.id, batches.clone(), lanes).await?;
        let mut book = self.book();
        for batch in batches {
            book.put_back(&live.id, batch);
        }
        drop(book);
        live.changed();
        Ok(())
    }
}

//! A batch's sum is brought: checked, kept, counted once.

use super::{
    Farm, allocation,
    append::blocking,
    audit::Audit,
    counters::Fate,
    error::{FarmError, Result},
    ids::batch_of,
    live::{Arrival, Live},
    rules::PARTIAL_BYTES_MAX,
};
use crate::{
    blobs::{BlobError, BlobName},
    fail_point::FailPoint,
    store::row::{BatchKey, CommitOutcome, CommitRow, NewCommit},
};
use bytes::Bytes;
use ovtigre_core::{
    film::{allocation::Allocation, batch::Batch, exr, sum::Sum},
    settings::Method,
};
use ovtigre_proto::{
    id::{BlobId, JobId, LeaseId, WorkerId},
    lease::{Commit, FailureKind, LeaseFailure},
    telemetry::span::Place,
};
use std::{collections::BTreeSet, sync::Arc, time::Duration};

/// Longest time that is believed of one batch.
const TIME_MAX: Duration = Duration::from_hours(30 * 24);

/// How a sum came.
#[derive(Clone, Copy)]
enum Way {
    /// With the request.
    Here,
    /// It is among the blobs.
    Handed,
}

/// What a partial EXR says.
struct Decoded {
    sum: Sum,
    hash: BlobId,
    solution: Option<String>,
}

impl Farm {
    /// The partial EXR of a lease's batch, on which its worker spent `time`. The first sum of a
    /// batch counts, even after its lease has ended; a further one is compared with it.
    pub async fn commit(self: &Arc<Self>, lease: &LeaseId, partial: Bytes, time: Duration) -> Result<Commit> {
        self.take_sum(lease, partial, time, Way::Here).await
    }

    /// The same of a partial EXR that its worker has put where the lease said. An error where it is not
    /// there: it may have been taken before.
    pub async fn commit_handed(self: &Arc<Self>, lease: &LeaseId, time: Duration) -> Result<Commit> {
        let name = BlobName::Handed(lease.clone());
        let bytes = self.blobs.size(&name).await.map_err(|error| match error {
            BlobError::Missing(_) => FarmError::not_found("sum of lease", lease),
            other => other.into(),
        })?;
        let limit = 2 * PARTIAL_BYTES_MAX as u64;
        let taken = if bytes > limit {
            Err(FarmError::TooLarge { limit })
        } else {
            let partial = self.blobs.get(&name).await?;
            FailPoint::SumHanded.pass();
            self.take_sum(lease, partial, time, Way::Handed).await
        };
        self.blobs.delete(&name).await?;
        taken
    }

    async fn take_sum(
        self: &Arc<Self>,
        lease: &LeaseId,
        partial: Bytes,
        time: Duration,
        way: Way,
    ) -> Result<Commit> {
        let (job, key) = batch_of(lease).ok_or_else(|| FarmError::not_found("lease", lease))?;
        // Of a lease that has ended nobody remembers whose it was.
        let worker = self.book().lease(lease).map(|held| held.row.worker.clone());
        let mut span = self.traces.span("commit", Place::OfLease(&job, lease));
        if span.is_told() {
            span.add("ovtigre.batch", key.to_string());
            if let Some(worker) = &worker {
                span.add("ovtigre.worker", worker.to_string());
            }
        }
        let worker = worker.as_ref().map(WorkerId::as_str);
        let taken = self.take_sum_of(lease, (job.clone(), key), partial, time, way).await;
        match &taken {
            Ok(commit) => {
                tracing::debug!(%job, batch = %key, %lease, worker, ?commit, "a sum came");
                span.add("ovtigre.commit", format!("{commit:?}").to_lowercase());
            }
            Err(error) => {
                tracing::debug!(%job, batch = %key, %lease, worker, %error, "a sum was not taken");
                span.fail(&error.to_string());
            }
        }
        taken
    }

    async fn take_sum_of(
        self: &Arc<Self>,
        lease: &LeaseId,
        (job, key): (JobId, BatchKey),
        partial: Bytes,
        time: Duration,
        way: Way,
    ) -> Result<Commit> {
        self.need_room_for_sums()?;
        let Some(live) = self.wanted(lease, &job).await? else {
            self.counters.count(Fate::NotNeeded);
            return Ok(Commit::NotNeeded);
        };
        let batch = live.batch(key).ok_or_else(|| FarmError::not_found("lease", lease))?;
        let Decoded { sum, hash, solution } = match self.decode(&live, batch, partial.clone()).await {
            Ok(decoded) => decoded,
            Err(error) => return Err(self.refuse(lease, error).await),
        };
        if let Some(json) = solution.filter(|_| live.spec.settings.method == Method::Radiosity) {
            self.keep_solution(&job, &json).await?;
        }
        let audit = self.book().end_audit(lease);
        if let Some((row, audit)) = audit {
            return self.compare(&live, key, &row.worker, audit, &hash).await;
        }
        let name = BlobName::Partial(job.clone(), key, hash.clone());
        match way {
            Way::Here => self.blobs.put_once(&name, partial).await?,
            Way::Handed => self.blobs.rename(&BlobName::Handed(lease.clone()), &name).await?,
        }
        FailPoint::SumAfterBlob.pass();
        let worker = self.book().lease(lease).map(|held| held.row.worker.clone());
        let micros = time.min(TIME_MAX).as_micros() as u64;
        let row = CommitRow { batch: key, hash, worker_micros: micros };
        let new = NewCommit {
            job: job.clone(),
            row: row.clone(),
            worker: worker.clone(),
            rays_per_second: if micros == 0 { 0.0 } else { sum.rays as f64 / (micros as f64 * 1e-6) },
        };
        match self.store.commit(new).await? {
            CommitOutcome::First => {
                FailPoint::SumAfterRow.pass();
                self.counters.count(Fate::Accepted);
                let failed = self.book().brought(&job, key);
                if let Some(worker) = &worker {
                    self.honour(worker, &job, failed).await?;
                    if self.is_audited(lease) {
                        let audit = Audit { first: worker.clone(), second: None };
                        self.book().audits.ask(job.clone(), key, audit);
                    }
                }
                self.arrive(&live, row, sum);
                Ok(Commit::Accepted)
            }
            CommitOutcome::Same => {
                self.counters.count(Fate::Duplicate);
                Ok(Commit::Duplicate)
            }
            CommitOutcome::Differs { kept } => {
                self.disagree(&job, key, &row.hash, &kept, worker.as_ref());
                self.blobs.delete(&name).await?;
                Ok(Commit::NotNeeded)
            }
            CommitOutcome::JobOver | CommitOutcome::NoJob => {
                self.counters.count(Fate::NotNeeded);
                self.blobs.delete(&name).await?;
                Ok(Commit::NotNeeded)
            }
            CommitOutcome::NeverHandedOut => {
                self.blobs.delete(&name).await?;
                Err(FarmError::not_found("lease", lease))
            }
        }
    }

    /// The job of a sum, unless it is over. Of one that is in memory the store says so when the sum is taken.
    async fn wanted(self: &Arc<Self>, lease: &LeaseId, job: &JobId) -> Result<Option<Arc<Live>>> {
        if let Some(live) = self.live(job) {
            return Ok(Some(live));
        }
        let row = self.store.job(job).await?.ok_or_else(|| FarmError::not_found("lease", lease))?;
        Ok(self.meet(job).await?.filter(|_| !row.state.is_over()))
    }

    /// A worker has brought what those in `failed` could not render: that was not the job's fault.
    async fn honour(&self, worker: &WorkerId, job: &JobId, failed: BTreeSet<WorkerId>) -> Result<()> {
        self.crew().clear(worker);
        for at_fault in failed.iter().filter(|other| *other != worker) {
            self.blame(at_fault, job, "another worker could render what it could not").await?;
        }
        Ok(())
    }

    /// A sum that cannot be used is its worker's fault, and the batch goes to another.
    async fn refuse(&self, lease: &LeaseId, error: FarmError) -> FarmError {
        if let FarmError::Sum(reason) = &error {
            let failure =
                LeaseFailure { reason: format!("its sum was refused: {reason}"), kind: FailureKind::Worker };
            match self.give_back(lease, failure).await {
                Ok(()) | Err(FarmError::NotFound { .. }) => {}
                Err(error) => tracing::error!(%lease, %error, "a refused batch was not taken back"),
            }
        }
        error
    }

    async fn decode(&self, live: &Live, batch: Batch, partial: Bytes) -> Result<Decoded> {
        if live.decision().is_some_and(|decision| decision.is_awaited_by(batch)) {
            // Another server has decided, and handed it out.
            self.learn_allocations(live).await?;
        }
        let _turn = self.decoders.acquire().await.map_err(|_| FarmError::Stopping)?;
        let (job, scene) = (live.id.clone(), live.spec.fetched(&live.scene).clone());
        let method = live.spec.settings.method.name();
        let planes = live.spec.settings.planes() as usize;
        let decision = live.decision();
        let allocation = decision.as_ref().and_then(|decision| decision.of(batch)).map(Allocation::hash);
        let counted = allocation::counted(live, batch);
        let decoded = blocking(move || {
            let read = exr::read_partial(&partial, batch.region.pixels());
            let (sum, says) = read.map_err(|e| FarmError::Sum(e.to_string()))?;
            if sum.batch != batch {
                return Err(FarmError::Sum(format!("it is of {}, not of {batch}", sum.batch)));
            }
            for (what, got, expected) in [
                ("job", &*says.job, job.as_str()),
                ("scene", &*says.scene, scene.as_str()),
                ("method", &*says.method, method),
            ] {
                if got != expected {
                    return Err(FarmError::Sum(format!("its {what} is '{got}', not '{expected}'")));
                }
            }
            if sum.planes.len() != planes {
                return Err(FarmError::Sum(format!("it has {} planes, not {planes}", sum.planes.len())));
            }
            if says.allocation != allocation {
                return Err(FarmError::Sum("its samples were not allocated as its lease says".to_owned()));
            }
            if sum.tile_rays.len() != counted {
                let brings = sum.tile_rays.len();
                return Err(FarmError::Sum(format!(
                    "it counts the rays of {brings} tiles, not of {counted}"
                )));
            }
            let hash = BlobId::of(sum.hash());
            Ok(Decoded { sum, hash, solution: says.solution })
        })
        .await?;
        FailPoint::SumBeforeBlob.pass();
        decoded
    }

    /// The sum waits in memory where there is room, else as a blob.
    fn arrive(&self, live: &Live, row: CommitRow, sum: Sum) {
        let waiting: u64 = self.lives().iter().map(|live| live.fresh_bytes()).sum();
        let fits = waiting + super::live::sum_bytes(&sum) <= self.rules.fresh_bytes;
        live.arrive(Arrival { row, sum: fits.then_some(sum) });
        FailPoint::SumBeforeReply.pass();
    }

    fn disagree(&self, job: &JobId, batch: BatchKey, got: &BlobId, kept: &BlobId, worker: Option<&WorkerId>) {
        self.counters.count(Fate::Disagreeing);
        let worker = worker.map_or("not known", WorkerId::as_str);
        tracing::warn!(%job, %batch, %got, %kept, worker, "two sums of one batch differ: the first is kept");
    }
}

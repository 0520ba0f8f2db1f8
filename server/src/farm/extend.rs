//! More of a job than was asked for at first: more samples, a smaller error. The picture has the same bits
//! as if all had been asked for at once.

use super::{
    Farm,
    allocation::looks_before,
    append::{Merge, blocking},
    error::{FarmError, Result, fault},
    live::Live,
    open::read_spec,
    spec::JobSpec,
    split::lanes,
    submit::{SAMPLES_MAX, WEIGHT_MAX, fits},
};
use crate::{
    blobs::BlobName,
    store::row::{BatchKey, CommitRow, Extension, JobRow, Lane},
};
use ovtigre_core::film::{append::Prefix, exr, schedule::Schedule};
use ovtigre_proto::{
    id::JobId,
    job::JobPatch,
    problem::Fault,
    status::{JobState, JobStatus},
};
use std::{collections::BTreeMap, sync::Arc, time::Duration};

/// How long a job that has just ended is waited for.
const SETTLING: Duration = Duration::from_secs(10);
/// Between two looks at it.
const LOOK: Duration = Duration::from_millis(20);

/// Whether a change is one of what is rendered.
pub(super) fn changes_spec(patch: &JobPatch) -> bool {
    patch.samples.is_some() || patch.error.is_some() || patch.weight.is_some() || patch.max_workers.is_some()
}

impl Farm {
    /// Changes what is asked of a job. One that is done goes on.
    pub(super) async fn extend(
        self: &Arc<Self>,
        id: &JobId,
        patch: &JobPatch,
        versions: Option<&[u64]>,
    ) -> Result<JobStatus> {
        loop {
            let row = self.settled_row(id).await?;
            if versions.is_some_and(|versions| !versions.contains(&row.version)) {
                return Err(FarmError::Version { current: row.version });
            }
            if row.state.is_over() && row.state != JobState::Done {
                return Err(FarmError::Over { id: id.clone(), state: row.state });
            }
            let old = read_spec(&row)?;
            let spec = changed(&old, patch).map_err(FarmError::Patch)?;
            fits(&spec, &self.rules).map_err(FarmError::Patch)?;
            let Some(spec) = going_on(&row, &old, spec)? else { return self.status_of(&row).await };
            let (before, after) = (old.schedule(), spec.schedule());
            let extension = Extension {
                spec: serde_json::to_string(&spec).map_err(|e| FarmError::Damaged(e.to_string()))?,
                whole: common(&before, &after),
                looks: self.looks(id, &after, spec.decided_after).await?,
                regions: after.regions().len() as u32,
                replicates: after.replicates(),
            };
            if let Some(row) = self.extend_row(&row, extension).await? {
                return self.status_of(&row).await;
            }
        }
    }

    /// A job that is not between its end and its last form.
    async fn settled_row(&self, id: &JobId) -> Result<JobRow> {
        let settled = async {
            loop {
                let row = self.job_row(id).await?;
                if row.settled || !row.state.is_over() {
                    return Ok(row);
                }
                tokio::time::sleep(LOOK).await;
            }
        };
        tokio::time::timeout(SETTLING, settled).await.unwrap_or(Err(FarmError::Stopping))
    }

    /// Checkpoints taken that another schedule has, too. One at which samples were to be allocated, and at which a job ended
    /// before they were, is still to be taken.
    async fn looks(&self, id: &JobId, after: &Schedule, decided_after: Option<u32>) -> Result<u32> {
        let rows = self.curve_rows(id).await?;
        let points = after.checkpoints();
        let samples = points.iter().map(|blocks| after.samples_after(*blocks) * after.replicates());
        let taken =
            rows.iter().zip(samples).take_while(|(row, samples)| row.samples == *samples).count() as u32;
        Ok(match decided_after {
            Some(blocks) if self.store.allocations(id).await?.is_none() => {
                taken.min(looks_before(after, blocks))
            }
            _ => taken,
        })
    }

    /// The change in store and memory; `None` where somebody else was faster.
    async fn extend_row(self: &Arc<Self>, row: &JobRow, to: Extension) -> Result<Option<JobRow>> {
        let live = self.live(&row.id);
        // Whoever appends holds this; it sees that the job is another's when it gets it.
        let _held = match &live {
            Some(live) => Some(Arc::clone(&live.merge).lock_owned().await),
            None => None,
        };
        if !self.store.extend_job(&row.id, row.version, to).await? {
            return Ok(None);
        }
        self.book().remove(&row.id);
        self.forget_live(&row.id);
        if let Some(live) = live {
            live.kick.notify_one();
        }
        let row = self.job_row(&row.id).await?;
        self.take_up(&row).await?;
        tracing::info!(job = %row.id, "job was changed and goes on");
        Ok(Some(row))
    }

    /// Keeps the sums of a job that is done as far as a longer one would have them, too.
    pub(super) async fn keep_sums(&self, live: &Live) -> Result<()> {
        if !self.rules.keeps_sums() || live.spec.sums_bytes() > self.rules.kept_sums_bytes {
            return self.drop_sums(live).await;
        }
        let whole = live.schedule.whole_blocks() as u32;
        let commits = self.store.ledger(&live.id).await?.commits;
        for lane in lanes(&live.schedule) {
            let held = self.sums(live).await?;
            let merge = held.as_ref().expect("just read");
            let since = merge.snapshots().get(&lane).copied().unwrap_or(0);
            let blocks = merge.prefix(lane).blocks().min(whole);
            if blocks == since {
                continue;
            }
            let bytes = if merge.prefix(lane).blocks() == blocks {
                blocking(move || held.as_ref().expect("just read").prefix(lane).to_bytes()).await?
            } else {
                let empty = Prefix::empty(
                    live.schedule.regions()[lane.region as usize],
                    lane.replicate,
                    merge.prefix(lane).layers(),
                );
                drop(held);
                match self.rebuild(live, lane, (since, blocks), &commits, empty).await? {
                    Some(prefix) => blocking(move || prefix.to_bytes()).await?,
                    None => return self.drop_sums(live).await,
                }
            };
            self.blobs.put(&BlobName::Prefix(live.id.clone(), lane, blocks), bytes.into()).await?;
            self.store.set_snapshot(&live.id, Self::mandate(live)?, lane, blocks).await?;
            if since > 0 {
                self.blobs.delete(&BlobName::Prefix(live.id.clone(), lane, since)).await?;
            }
        }
        Ok(())
    }

    /// The first blocks of a lane from what is kept of it; `None` where something is lost.
    async fn rebuild(
        &self,
        live: &Live,
        lane: Lane,
        (since, blocks): (u32, u32),
        commits: &[CommitRow],
        empty: Prefix,
    ) -> Result<Option<Prefix>> {
        let mut prefix = match since {
            0 => empty,
            _ => match self.prefix(live, lane, since).await? {
                Some(prefix) => prefix,
                None => return Ok(None),
            },
        };
        let by_batch: BTreeMap<BatchKey, &CommitRow> = commits.iter().map(|row| (row.batch, row)).collect();
        for block in since..blocks {
            let Some(row) = by_batch.get(&lane.at(block)) else { return Ok(None) };
            let name = BlobName::Partial(live.id.clone(), row.batch, row.hash.clone());
            let Ok(bytes) = self.blobs.get(&name).await else { return Ok(None) };
            let decision = live.decision();
            let appended = blocking(move || {
                let (sum, _) = exr::read_partial(&bytes, prefix.region().pixels()).ok()?;
                let appended = match decision.as_ref().and_then(|decision| decision.of(sum.batch)) {
                    Some(allocation) => prefix.append_allocated(&sum, allocation),
                    None => prefix.append(&sum),
                };
                appended.ok().map(|()| prefix)
            });
            match appended.await? {
                Some(appended) => prefix = appended,
                None => return Ok(None),
            }
        }
        Ok(Some(prefix))
    }

    /// Keeps no sums of a job.
    pub(super) async fn drop_sums(&self, live: &Live) -> Result<()> {
        let lanes = lanes(&live.schedule).collect();
        Ok(self.store.uncommit(&live.id, Vec::new(), lanes).await?)
    }
}

impl Merge {
    /// Blocks of each lane that are kept as one blob.
    fn snapshots(&self) -> &BTreeMap<Lane, u32> {
        &self.snapshots
    }
}

/// Leading blocks that both have.
fn common(a: &Schedule, b: &Schedule) -> u32 {
    a.blocks().iter().zip(b.blocks()).take_while(|(a, b)| a == b).count() as u32
}

/// What a job is to be, or what is wrong with the wish.
fn changed(old: &JobSpec, patch: &JobPatch) -> std::result::Result<JobSpec, Vec<Fault>> {
    let mut faults = Vec::new();
    let mut spec = old.clone();
    let replicates = spec.settings.replicates;
    if let Some(samples) = patch.samples {
        let asked = old.samples_asked();
        if samples > SAMPLES_MAX {
            faults.push(fault("/samples", format!("samples are at most {SAMPLES_MAX}")));
        } else if samples / replicates < old.samples {
            faults.push(fault("/samples", format!("only more samples can be asked for: there are {asked}")));
        } else {
            spec.samples = samples / replicates;
            spec.request.samples = Some(samples);
        }
    }
    if let Some(error) = patch.error {
        if !(error.is_finite() && error > 0.0) {
            faults.push(fault("/error", "the relative error to stop at is positive, such as 0.01"));
        } else if replicates < 3 {
            faults
                .push(fault("/error", "an error target needs 3 replicates or more, and this job has fewer"));
        } else {
            spec.error_target = Some(error);
            spec.request.error = Some(error);
        }
    }
    if let Some(weight) = patch.weight {
        if (1..=WEIGHT_MAX).contains(&weight) {
            spec.request.weight = Some(weight);
        } else {
            faults.push(fault("/weight", format!("a weight is 1 to {WEIGHT_MAX}")));
        }
    }
    if let Some(workers) = patch.max_workers {
        if workers > 0 {
            spec.request.max_workers = Some(workers);
        } else {
            faults.push(fault("/max_workers", "a job needs 1 worker or more: pause it instead"));
        }
    }
    if faults.is_empty() { Ok(spec) } else { Err(faults) }
}

/// The specification with which a job goes on; `None` where there is nothing to do.
fn going_on(row: &JobRow, old: &JobSpec, mut spec: JobSpec) -> Result<Option<JobSpec>> {
    if spec == *old {
        return Ok(None);
    }
    if row.state != JobState::Done {
        return Ok(Some(spec));
    }
    let drawn = row.progress.samples.round() >= f64::from(spec.samples_asked());
    let looser = match (spec.error_target, old.error_target) {
        (Some(new), Some(before)) => new >= before,
        (None, _) => false,
        (Some(_), None) => true,
    };
    if drawn {
        let (pointer, all) = ("/samples", spec.samples_asked());
        let detail = format!("all {all} samples are drawn: ask for more samples, too");
        return Err(FarmError::Patch(vec![fault(pointer, detail)]));
    }
    if row.certified && looser {
        // More samples beyond an error that was reached are drawn only where the error is to be smaller.
        let detail = "the error asked for is reached: ask for a smaller 'error', too";
        return Err(FarmError::Patch(vec![fault("/error", detail)]));
    }
    // The time that it had is over: what is asked for now has no such limit.
    if spec.seconds.is_some_and(|seconds| row.run_seconds >= seconds) {
        (spec.seconds, spec.request.seconds) = (None, None);
    }
    Ok(Some(spec))
}

//! Workers beat, get batches and give them back.

use super::{
    Farm,
    book::{Asker, Offer},
    counters::Fate,
    crew::Member,
    error::{FarmError, Result},
    ids::batch_of,
};
use crate::{
    blobs::BlobName,
    fail_point::FailPoint,
    store::row::{Claim, LeaseRow, Released},
};
use ovtigre_proto::{
    id::{JobId, LeaseId, WorkerId},
    lease::{Exchange, ExchangeReply, FailureKind, Lease, LeaseFailure, WorkerJoin},
    status::WorkerState,
    telemetry::span::Place,
};
use std::{
    collections::{BTreeMap, BTreeSet},
    pin::pin,
    sync::Arc,
    time::{Duration, Instant, SystemTime},
};

/// Where a sum may be put directly, that is so for so long after its lease was given.
const UPLOAD: Duration = Duration::from_hours(12);

impl Farm {
    /// A worker's beat: renews what it holds, tells what to drop, hands out what it wants. A worker that
    /// holds nothing is answered when there is something for it, or else at the time of its next beat.
    pub async fn exchange(&self, worker: &WorkerId, said: Exchange) -> Result<ExchangeReply> {
        let (state, join) = self.hear(worker, &said).await?;
        let drop = self.renew(worker, &said).await?;
        self.take_unheard(worker, &said).await?;
        let more = self.book().more();
        let mut more = pin!(more.notified());
        more.as_mut().enable();
        let mut interval = self.interval();
        let mut leases = Vec::new();
        let serves = state == WorkerState::Active && !said.leaving && !self.crew().rests(worker);
        if serves && !self.is_full() {
            leases = self.hand_out(worker, &join, &said).await?;
            let idle = said.wants > 0 && said.holding.is_empty() && drop.is_empty();
            if leases.is_empty() && idle {
                tokio::select! {
                    () = more => {}
                    () = self.stopping.cancelled() => {}
                    () = tokio::time::sleep(Duration::from_secs_f64(interval)) => interval = 0.0,
                }
                leases = self.hand_out(worker, &join, &said).await?;
            }
        }
        // One that is put aside stays where people see it, and does not come back under a new name.
        let drain = !matches!(state, WorkerState::Active | WorkerState::Aside);
        Ok(ExchangeReply { leases, drop, interval_seconds: interval, drain })
    }

    /// Seconds between beats: short while there are few workers.
    pub(super) fn interval(&self) -> f64 {
        let crowd = f64::from(self.crew().active(self.rules.silence)) / self.rules.beats_per_second;
        // A lease is renewed several times before it ends.
        crowd.max(self.rules.beat.as_secs_f64()).min(self.rules.lease.as_secs_f64() / 4.0)
    }

    async fn hear(&self, id: &WorkerId, said: &Exchange) -> Result<(WorkerState, Arc<WorkerJoin>)> {
        let known = self.crew().get(id);
        let (before, join) = if let Some(member) = &known {
            (member.state, Arc::clone(&member.join))
        } else {
            let row = self.worker_row(id).await?;
            (row.state, Arc::new(row.join))
        };
        let state = match before {
            WorkerState::Gone => return Err(FarmError::not_found("worker", id)),
            _ if said.leaving && said.holding.is_empty() => WorkerState::Gone,
            WorkerState::Draining => WorkerState::Draining,
            WorkerState::Aside => WorkerState::Aside,
            WorkerState::Active | WorkerState::Lost => WorkerState::Active,
        };
        let now = Instant::now();
        let noted = known.as_ref().filter(|m| m.state == state && m.noted.elapsed() < self.rules.note_beat);
        let state = match noted {
            Some(_) => state,
            None => match self.store.see_worker(id, state).await? {
                None => return Err(FarmError::not_found("worker", id)),
                Some(told) => told,
            },
        };
        let capacity = said.wants.min(self.rules.wants_max) + said.holding.len() as u32;
        let member = Member {
            state,
            capacity,
            noted: noted.map_or(now, |m| m.noted),
            seen: now,
            ..known.clone().unwrap_or_else(|| Member::new(Arc::clone(&join), state, now))
        };
        if state == WorkerState::Gone {
            self.crew().remove(id);
        } else {
            self.crew().set(id, member);
        }
        Ok((state, join))
    }

    /// Renews leases that are due; returns those that the worker no longer has.
    async fn renew(&self, worker: &WorkerId, said: &Exchange) -> Result<Vec<LeaseId>> {
        let mut lost = Vec::new();
        let mut due = Vec::new();
        {
            let mut book = self.book();
            for progress in &said.holding {
                match book.lease(&progress.lease).filter(|held| held.row.worker == *worker) {
                    Some(held) if held.audit.is_some() => held.renewed = Instant::now(),
                    Some(held) if held.renewed.elapsed() > self.rules.lease / 4 => {
                        due.push(progress.lease.clone());
                    }
                    Some(_) => {}
                    // Another server may have handed it out.
                    None if self.is_shared() => due.push(progress.lease.clone()),
                    None => lost.push(progress.lease.clone()),
                }
            }
        }
        if !due.is_empty() {
            let renewed = self.store.renew(worker, due.clone(), self.rules.lease).await?;
            let mut book = self.book();
            for id in due {
                match book.lease(&id) {
                    Some(held) if renewed.contains(&id) => held.renewed = Instant::now(),
                    None if renewed.contains(&id)
                        && let Some((job, batch)) = batch_of(&id) =>
                    {
                        book.hold(LeaseRow { id, job, batch, worker: worker.clone() }, None, said.beat);
                    }
                    _ => lost.push(id),
                }
            }
        }
        Ok(lost)
    }

    /// Batches of whose leases the worker never heard, because an answer was lost, go to others at once.
    async fn take_unheard(&self, worker: &WorkerId, said: &Exchange) -> Result<()> {
        let unheard = self.book().unheard(worker, said);
        for lease in unheard {
            tracing::debug!(%lease, %worker, "its worker has not got it");
            let reason = "its worker has not got it".to_owned();
            match self.give_back(&lease, LeaseFailure { reason, kind: FailureKind::HandedBack }).await {
                Ok(()) => self.counters.count(Fate::Expired),
                Err(FarmError::NotFound { .. }) => self.book().forget(&lease),
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    async fn hand_out(&self, worker: &WorkerId, join: &WorkerJoin, said: &Exchange) -> Result<Vec<Lease>> {
        let active = self.crew().active(self.rules.silence) as usize;
        let wants = said.wants.min(self.rules.wants_max);
        let mut leases = Vec::new();
        // Another server may have been faster: what is left is known after the first try.
        for _ in 0..3 {
            let left = wants - leases.len() as u32;
            let asker =
                Asker { id: worker, join, scenes: &said.scenes, wants: left, active, beat: said.beat };
            let (handed_out, refused) = self.claim_offers(&asker).await?;
            leases.extend(handed_out);
            if refused.is_empty() || !self.is_shared() {
                break;
            }
            for job in &refused {
                self.refresh_plan(job).await?;
            }
        }
        Ok(leases)
    }

    /// Claims what the book offers; also returns the jobs of whose batches some were refused.
    async fn claim_offers(&self, asker: &Asker<'_>) -> Result<(Vec<Lease>, BTreeSet<JobId>)> {
        let Asker { id: worker, join, .. } = *asker;
        let asked = SystemTime::now();
        // Twice what workers hold or would take: none stands idle while a checkpoint is taken.
        let ahead = 2 * self.crew().capacity(self.rules.silence);
        let offers = self.book().offer(asker, ahead);
        let (awaiting, offers): (Vec<Offer>, Vec<Offer>) =
            offers.into_iter().partition(|offer| self.awaits_decision(offer));
        for offer in awaiting {
            self.book().withdraw(offer);
        }
        if offers.is_empty() {
            return Ok((Vec::new(), BTreeSet::new()));
        }
        let ids: Vec<LeaseId> = offers.iter().map(|offer| self.ids.lease(&offer.job, offer.batch)).collect();
        let claimed = match self.claim(worker, join, &offers, &ids).await {
            Ok(claimed) => claimed,
            Err(error) => {
                let mut book = self.book();
                for offer in offers {
                    book.withdraw(offer);
                }
                return Err(error);
            }
        };
        let mut leases = Vec::new();
        let (mut begun, mut refused) = (Vec::new(), BTreeSet::new());
        for ((offer, id), claimed) in offers.into_iter().zip(ids).zip(claimed) {
            let live = self.live(&offer.job);
            let batch = live.as_ref().and_then(|live| live.batch(offer.batch));
            let decision = live.and_then(|live| live.decision());
            // Not claimed: the job was paused or ended meanwhile, or began elsewhere on other processors.
            let (true, Some(batch)) = (claimed, batch) else {
                refused.insert(offer.job.clone());
                self.book().withdraw(offer);
                continue;
            };
            let Offer { job, batch: key, scene, settings, audit, .. } = offer;
            let upload = if audit.is_some() { None } else { self.upload_to(&id).await };
            let row = LeaseRow { id: id.clone(), job: job.clone(), batch: key, worker: worker.clone() };
            self.tell_handed_out(&row, asked);
            self.book().hold(row, audit, asker.beat);
            let seconds = self.rules.lease.as_secs_f64();
            leases.push(Lease {
                id,
                job: job.clone(),
                scene,
                settings: settings.as_ref().clone(),
                batch,
                seconds,
                upload,
                allocation: decision.and_then(|decision| decision.of(batch).cloned()),
            });
            begun.push(job);
        }
        begun.dedup();
        begun.iter().filter_map(|job| self.live(job)).for_each(|live| live.changed());
        Ok((leases, refused))
    }

    /// Whether it has to be known first how samples are allocated.
    fn awaits_decision(&self, offer: &Offer) -> bool {
        let Some(live) = self.live(&offer.job) else { return false };
        let batch = live.batch(offer.batch);
        batch.zip(live.decision()).is_some_and(|(batch, decision)| decision.is_awaited_by(batch))
    }

    fn tell_handed_out(&self, lease: &LeaseRow, asked: SystemTime) {
        let LeaseRow { id, job, batch, worker } = lease;
        tracing::debug!(%job, %batch, lease = %id, %worker, "a batch was handed out");
        let span = self.traces.span("hand out", Place::OfLease(job, id)).since(asked);
        if span.is_told() {
            drop(span.note("ovtigre.batch", batch.to_string()).note("ovtigre.worker", worker.to_string()));
        }
    }

    /// Where a lease's sum may be put directly.
    async fn upload_to(&self, lease: &LeaseId) -> Option<String> {
        let address = self.blobs.address_to_put(&BlobName::Handed(lease.clone()), UPLOAD).await;
        // Without one it is brought to the farm.
        address.inspect_err(|error| tracing::warn!(%error, "no address to put sums at")).ok().flatten()
    }

    /// Claims what is offered in the store; whether each may be handed out. Jobs that are not pinned to a
    /// class of processors are pinned to that of the first worker.
    async fn claim(
        &self,
        worker: &WorkerId,
        join: &WorkerJoin,
        offers: &[Offer],
        ids: &[LeaseId],
    ) -> Result<Vec<bool>> {
        let mut claimed = Vec::with_capacity(offers.len());
        // What was read of a job before it was pinned may be put into the book after that: the store's answer counts.
        let mut pinned: BTreeMap<&JobId, Option<String>> = BTreeMap::new();
        for job in offers.iter().filter(|offer| !offer.pinned).map(|offer| &offer.job) {
            if !pinned.contains_key(job) {
                let class = self.store.pin_job(job, &join.instruction_set).await?;
                if let Some(entry) = self.book().job(job) {
                    entry.wants.class.clone_from(&class);
                }
                pinned.insert(job, class);
            }
        }
        let mut claims = Vec::new();
        for (Offer { job, batch, audit, .. }, lease) in offers.iter().zip(ids) {
            let class = match pinned.get(job) {
                Some(class) => class.clone(),
                None => self.book().job(job).and_then(|entry| entry.wants.class.clone()),
            };
            let right = class.as_ref() == Some(&join.instruction_set);
            claimed.push(right && audit.is_some());
            if right && audit.is_none() {
                let (job, worker) = (job.clone(), worker.clone());
                claims.push((claimed.len() - 1, Claim { lease: lease.clone(), job, batch: *batch, worker }));
            }
        }
        let (places, claims): (Vec<usize>, Vec<Claim>) = claims.into_iter().unzip();
        if !claims.is_empty() {
            FailPoint::ClaimBeforeRow.pass();
            for (place, yes) in places.into_iter().zip(self.store.claim(claims, self.rules.lease).await?) {
                claimed[place] = yes;
            }
            FailPoint::ClaimAfterRow.pass();
        }
        Ok(claimed)
    }

    /// A worker gives a batch back.
    pub async fn give_back(&self, lease: &LeaseId, failure: LeaseFailure) -> Result<()> {
        let reason: String = failure.reason.chars().filter(|c| !c.is_control()).take(1000).collect();
        let audit = self.book().end_audit(lease);
        if let Some((row, audit)) = audit {
            self.book().audits.ask(row.job, row.batch, audit);
            return Ok(());
        }
        let counted = (failure.kind != FailureKind::HandedBack).then(|| reason.clone());
        let Some(released) = self.store.release(lease, counted).await? else {
            return Err(FarmError::not_found("lease", lease));
        };
        self.book().take_back(&released.lease);
        if failure.kind == FailureKind::HandedBack {
            return Ok(());
        }
        self.counters.count(Fate::Failed);
        let LeaseRow { job, batch, worker, .. } = &released.lease;
        if let Some(entry) = self.book().job(job) {
            entry.failed.entry(*batch).or_default().insert(worker.clone());
        }
        if failure.kind == FailureKind::Worker {
            self.crew().strike(worker, self.rules.rest);
            self.blame(worker, job, &reason).await?;
        }
        self.judge(&released, failure.kind, &reason).await
    }

    /// A worker failed at a job by its own fault: where it does so at several, it is put aside.
    pub(super) async fn blame(&self, worker: &WorkerId, job: &JobId, reason: &str) -> Result<()> {
        let jobs = self.crew().blame(worker, job);
        if jobs < self.rules.failing_jobs {
            return Ok(());
        }
        let text = format!("it failed at {jobs} jobs, the last time because: {reason}");
        self.put_aside(worker, &text).await
    }

    /// Fails a job one of whose batches fails again and again. What seems the job's fault needs the word of
    /// several workers, where there are several.
    pub(super) async fn judge(&self, released: &Released, kind: FailureKind, reason: &str) -> Result<()> {
        let Released { lease, failures, workers, losses } = released;
        let LeaseRow { id, job, batch, worker } = lease;
        tracing::warn!(%job, %batch, lease = %id, %worker, failures, losses, reason, "a batch came back");
        let span = self.traces.span("come back", Place::OfLease(job, id));
        if span.is_told() {
            let mut span =
                span.note("ovtigre.batch", batch.to_string()).note("ovtigre.worker", worker.to_string());
            span.fail(reason);
        }
        let all = self.crew().active(self.rules.silence).max(1);
        let jobs_fault = kind == FailureKind::Job
            && *failures >= self.rules.failing_workers
            && *workers >= self.rules.failing_workers.min(all);
        let given_back = *workers >= self.rules.failing_workers || *failures >= self.rules.failures;
        let text = if jobs_fault || given_back && kind == FailureKind::Job {
            reason.to_owned()
        } else if given_back {
            format!(
                "{} failed {failures} times on {workers} workers, the last time because: {reason}",
                lease.batch
            )
        } else if *losses >= self.rules.losses {
            format!("{} lost its worker {losses} times: it may need more memory than they have", lease.batch)
        } else {
            return Ok(());
        };
        self.fail(&lease.job, text).await
    }
}

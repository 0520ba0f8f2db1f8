//! Workers join, beat, get batches and give them back.

use super::{
    Farm,
    book::Offer,
    counters::Fate,
    crew::Member,
    error::{FarmError, Result, fault},
};
use crate::store::row::{Claim, LeaseRow, Released};
use ovtigre_proto::{
    id::{LeaseId, WorkerId},
    lease::{Exchange, ExchangeReply, FailureKind, Lease, LeaseFailure, WorkerJoin, WorkerJoined},
    status::WorkerState,
};
use std::{
    pin::pin,
    time::{Duration, Instant},
};

/// Longest text that a worker says of itself.
const TEXT_MAX: usize = 200;
/// Tags of a worker, at most.
const TAGS_MAX: usize = 64;

impl Farm {
    /// A worker joins.
    pub async fn join(&self, join: WorkerJoin) -> Result<WorkerJoined> {
        let texts =
            [("/name", &join.name), ("/build", &join.build), ("/instruction_set", &join.instruction_set)];
        for (pointer, text) in texts {
            if text.len() > TEXT_MAX {
                return Err(FarmError::Request(vec![fault(
                    pointer,
                    format!("longer than {TEXT_MAX} bytes"),
                )]));
            }
        }
        if join.tags.len() > TAGS_MAX || join.tags.iter().any(|tag| tag.len() > TEXT_MAX) {
            let detail = format!("more than {TAGS_MAX} tags, or one longer than {TEXT_MAX} bytes");
            return Err(FarmError::Request(vec![fault("/tags", detail)]));
        }
        let id = self.ids.worker();
        let (name, threads) = (join.name.clone(), join.threads);
        self.store.add_worker(&id, join).await?;
        self.crew().set(&id, Member::new(WorkerState::Active, Instant::now()));
        tracing::info!(worker = %id, name, threads, "worker joined");
        Ok(WorkerJoined { id, interval_seconds: self.interval() })
    }

    /// A worker's beat: renews what it holds, tells what to drop, hands out what it wants. A worker that
    /// holds nothing is answered when there is something for it, or else at the time of its next beat.
    pub async fn exchange(&self, worker: &WorkerId, said: Exchange) -> Result<ExchangeReply> {
        let state = self.hear(worker, &said).await?;
        let drop = self.renew(worker, &said).await?;
        let more = self.book().more();
        let mut more = pin!(more.notified());
        more.as_mut().enable();
        let mut interval = self.interval();
        let mut leases = Vec::new();
        if state == WorkerState::Active && !said.leaving && !self.crew().rests(worker) {
            leases = self.hand_out(worker, &said).await?;
            let idle = said.wants > 0 && said.holding.is_empty() && drop.is_empty();
            if leases.is_empty() && idle {
                tokio::select! {
                    () = more => {}
                    () = self.stopping.cancelled() => {}
                    () = tokio::time::sleep(Duration::from_secs_f64(interval)) => interval = 0.0,
                }
                leases = self.hand_out(worker, &said).await?;
            }
        }
        let drain = state != WorkerState::Active;
        Ok(ExchangeReply { leases, drop, interval_seconds: interval, drain })
    }

    /// Seconds between beats: short while there are few workers.
    fn interval(&self) -> f64 {
        let crowd = f64::from(self.crew().active(self.rules.silence)) / self.rules.beats_per_second;
        // A lease is renewed several times before it ends.
        crowd.max(self.rules.beat.as_secs_f64()).min(self.rules.lease.as_secs_f64() / 4.0)
    }

    async fn hear(&self, id: &WorkerId, said: &Exchange) -> Result<WorkerState> {
        let known = self.crew().get(id);
        let before = match known {
            Some(member) => member.state,
            None => self.worker_row(id).await?.state,
        };
        let state = match before {
            WorkerState::Gone => return Err(FarmError::not_found("worker", id)),
            _ if said.leaving && said.holding.is_empty() => WorkerState::Gone,
            WorkerState::Draining => WorkerState::Draining,
            WorkerState::Active | WorkerState::Lost => WorkerState::Active,
        };
        let now = Instant::now();
        let noted = known.filter(|m| m.state == state && m.noted.elapsed() < self.rules.note_beat);
        if noted.is_none() && !self.store.see_worker(id, state).await? {
            return Err(FarmError::not_found("worker", id));
        }
        let capacity = said.wants.min(self.rules.wants_max) + said.holding.len() as u32;
        let member = Member {
            state,
            capacity,
            noted: noted.map_or(now, |m| m.noted),
            seen: now,
            ..known.unwrap_or_else(|| Member::new(state, now))
        };
        if state == WorkerState::Gone {
            self.crew().remove(id);
        } else {
            self.crew().set(id, member);
        }
        Ok(state)
    }

    /// Renews leases that are due; returns those that the worker no longer has.
    async fn renew(&self, worker: &WorkerId, said: &Exchange) -> Result<Vec<LeaseId>> {
        let mut lost = Vec::new();
        let mut due = Vec::new();
        {
            let mut book = self.book();
            for progress in &said.holding {
                match book.lease(&progress.lease).filter(|held| held.row.worker == *worker) {
                    Some(held) if held.renewed.elapsed() > self.rules.lease / 4 => {
                        due.push(progress.lease.clone());
                    }
                    Some(_) => {}
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
                    _ => lost.push(id),
                }
            }
        }
        Ok(lost)
    }

    async fn hand_out(&self, worker: &WorkerId, said: &Exchange) -> Result<Vec<Lease>> {
        let wants = said.wants.min(self.rules.wants_max);
        // Twice what workers hold or would take: none stands idle while a checkpoint is taken.
        let ahead = 2 * self.crew().capacity(self.rules.silence);
        let offers = self.book().offer(wants, &said.scenes, ahead);
        if offers.is_empty() {
            return Ok(Vec::new());
        }
        let claims: Vec<Claim> = (offers.iter())
            .map(|Offer { job, batch, .. }| Claim {
                lease: self.ids.lease(job, *batch),
                job: job.clone(),
                batch: *batch,
                worker: worker.clone(),
            })
            .collect();
        let claimed = match self.store.claim(claims.clone(), self.rules.lease).await {
            Ok(claimed) => claimed,
            Err(error) => {
                let mut book = self.book();
                for offer in &offers {
                    book.put_back(&offer.job, offer.batch);
                }
                return Err(error.into());
            }
        };
        let mut leases = Vec::new();
        let mut begun = Vec::new();
        for ((offer, claim), claimed) in offers.into_iter().zip(claims).zip(claimed) {
            let batch = self.live(&offer.job).and_then(|live| live.batch(offer.batch));
            // Not claimed: the job was paused or ended meanwhile.
            let (true, Some(batch)) = (claimed, batch) else {
                self.book().put_back(&offer.job, offer.batch);
                continue;
            };
            let Claim { lease, job, batch: key, worker } = claim;
            self.book().hold(LeaseRow { id: lease.clone(), job: job.clone(), batch: key, worker });
            leases.push(Lease {
                id: lease,
                job: job.clone(),
                scene: offer.scene,
                settings: offer.settings.as_ref().clone(),
                batch,
                seconds: self.rules.lease.as_secs_f64(),
            });
            begun.push(job);
        }
        begun.dedup();
        begun.iter().filter_map(|job| self.live(job)).for_each(|live| live.changed());
        Ok(leases)
    }

    /// A worker gives a batch back.
    pub async fn give_back(&self, lease: &LeaseId, failure: LeaseFailure) -> Result<()> {
        let reason: String = failure.reason.chars().take(1000).collect();
        let counted = (failure.kind != FailureKind::HandedBack).then(|| reason.clone());
        let Some(released) = self.store.release(lease, counted).await? else {
            return Err(FarmError::not_found("lease", lease));
        };
        self.book().take_back(&released.lease);
        match failure.kind {
            FailureKind::HandedBack => Ok(()),
            FailureKind::Job => {
                self.counters.count(Fate::Failed);
                self.fail(&released.lease.job, reason).await
            }
            FailureKind::Worker => {
                self.counters.count(Fate::Failed);
                self.crew().strike(&released.lease.worker, self.rules.rest);
                self.judge(&released, &reason).await
            }
        }
    }

    /// Fails a job one of whose batches fails again and again.
    pub(super) async fn judge(&self, released: &Released, reason: &str) -> Result<()> {
        let Released { lease, failures, workers, losses } = released;
        tracing::warn!(lease = %lease.id, worker = %lease.worker, failures, losses, reason, "a batch came back");
        let given_back = *workers >= self.rules.failing_workers || *failures >= self.rules.failures;
        let text = if given_back {
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

//! What happens by itself, now and then: leases run out, workers are lost, deadlines pass.

use super::{
    Farm,
    counters::Fate,
    error::{FarmError, Result},
    live::Live,
};
use crate::store::error::StoreError;
use ovtigre_proto::lease::FailureKind;
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// How long a job rests after its store or its files failed.
const REST: Duration = Duration::from_secs(1);

impl Farm {
    /// Leases that ran out go back, silent workers are lost, jobs whose time is over end.
    pub async fn reap(&self) -> Result<()> {
        self.look_at_room();
        for released in self.store.expire().await? {
            self.counters.count(Fate::Expired);
            self.book().take_back(&released.lease);
            if let Some(live) = self.live(&released.lease.job) {
                live.changed();
            }
            self.judge(&released, FailureKind::HandedBack, "its worker was not heard of in time").await?;
        }
        self.drop_audits(None);
        for worker in self.store.lose_workers(self.rules.silence).await? {
            tracing::warn!(%worker, "worker is lost");
            self.crew().remove(&worker);
        }
        for live in self.lives() {
            if live.spec.seconds.is_some()
                && live.ending().is_none()
                && let Some(row) = self.store.job(&live.id).await?
            {
                live.end_in_time(row.run_seconds);
            }
        }
        Ok(())
    }

    /// Leases of workers that missed two beats end now: `reap` takes them back.
    pub(super) async fn end_missed(&self) -> Result<()> {
        if self.is_shared() {
            // It may beat at another server.
            return Ok(());
        }
        let time = Duration::from_secs_f64(2.0 * self.interval()).max(self.rules.missed);
        let silent = self.crew().silent(time);
        for worker in silent {
            let leases = self.book().held_by(&worker);
            if !leases.is_empty() {
                tracing::info!(%worker, leases = leases.len(), "worker missed two beats");
                self.store.renew(&worker, leases, Duration::ZERO).await?;
            }
        }
        Ok(())
    }

    pub(super) async fn tick(self: Arc<Self>) {
        let mut beat = tokio::time::interval(self.rules.tick);
        beat.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        let mut keep = tokio::time::interval(self.rules.keep_mandate);
        keep.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        let mut latest = Instant::now();
        loop {
            let done = tokio::select! {
                () = self.stopping.cancelled() => return,
                _ = keep.tick() => self.keep_and_tell().await,
                _ = beat.tick() => {
                    // Where the server itself was held up, nobody could be heard.
                    let awake = std::mem::replace(&mut latest, Instant::now()).elapsed() < self.rules.missed / 2;
                    self.reap_and_follow(awake).await
                }
            };
            if let Err(error) = done {
                tracing::error!(%error, "looking after leases and deadlines failed");
            }
        }
    }

    async fn reap_and_follow(self: &Arc<Self>, awake: bool) -> Result<()> {
        self.follow_others().await?;
        if awake {
            self.end_missed().await?;
        }
        self.reap().await
    }

    async fn keep_and_tell(&self) -> Result<()> {
        self.keep_mandates().await?;
        self.tell_others().await?;
        self.tell_outlooks().await
    }

    /// Appends what comes until the job is over.
    pub(super) async fn pump(self: Arc<Self>, live: Arc<Live>) {
        loop {
            tokio::select! {
                () = self.stopping.cancelled() => return,
                () = live.kick.notified() => {}
            }
            if self.live(&live.id).is_none_or(|now| !Arc::ptr_eq(&now, &live)) {
                return;
            }
            match self.advance(&live).await {
                Ok(true) => return,
                Ok(false) => {}
                Err(FarmError::Store(StoreError::Superseded)) => self.lose(&live).await,
                Err(error) => {
                    // What is in memory may be half done: it is built again from what is kept.
                    *live.merge.lock().await = None;
                    if self.give_up(&live, error).await {
                        return;
                    }
                }
            }
        }
    }

    /// After an error: fails a job that cannot be appended to, or lets it rest. True when it is over.
    async fn give_up(&self, live: &Live, error: FarmError) -> bool {
        if self.store.job(&live.id).await.is_ok_and(|row| row.is_none()) {
            return true;
        }
        tracing::error!(job = %live.id, %error, "appending failed");
        if matches!(error, FarmError::Damaged(_)) {
            let failed = self.settle_without_picture(live, error.to_string()).await;
            match failed {
                Ok(()) => return true,
                Err(FarmError::Store(StoreError::Superseded)) => {
                    self.lose(live).await;
                    return false;
                }
                Err(error) => tracing::error!(job = %live.id, %error, "the job could not be failed"),
            }
        }
        tokio::select! {
            () = self.stopping.cancelled() => true,
            () = tokio::time::sleep(REST) => {
                live.kick.notify_one();
                false
            }
        }
    }
}

//! The worker's beat: it says how far it is, and hears what to do.

use crate::{
    desk::{Desk, duration},
    errand::note,
    leave::{Bell, Leave},
    run::WorkerError,
    scenes::SceneFolder,
};
use ovtigre_proto::{
    client::{error::ClientError, farm::Client},
    id::WorkerId,
    lease::{Exchange, ExchangeReply, WorkerJoin},
};
use std::{
    sync::atomic::{AtomicU64, Ordering},
    time::{Duration, Instant},
};
use tokio::sync::watch;

/// A farm that cannot be reached is asked again at most this often in the log.
const COMPLAINT: Duration = Duration::from_mins(1);

/// All that the beat needs.
#[derive(Debug)]
pub struct Beat<'a> {
    /// The farm.
    pub client: &'a Client,
    /// How the worker introduces itself.
    pub join: &'a WorkerJoin,
    /// What it holds.
    pub desk: &'a Desk,
    /// What it has on disk.
    pub scenes: &'a SceneFolder,
    /// When it leaves.
    pub bell: &'a Bell,
    /// Its name on the farm, once it has one.
    pub id: &'a watch::Sender<Option<WorkerId>>,
    /// Exchanges that were begun.
    pub beats: AtomicU64,
}

/// Whether who answers is no farm at all.
fn is_strange(error: &ClientError) -> bool {
    matches!(error, ClientError::Unexpected { status: None, .. })
}

impl Beat<'_> {
    /// Beats until the farm refuses this worker. A farm that does not answer is waited for.
    pub async fn run(&self) -> WorkerError {
        let mut backoff = self.client.backoff();
        let mut complained: Option<Instant> = None;
        loop {
            let known = self.id.borrow().is_some();
            let wait = match self.once().await {
                Ok(interval) => {
                    if complained.take().is_some() {
                        tracing::info!("the farm is back");
                    }
                    backoff.reset();
                    interval
                }
                Err(error) if error.status() == Some(404) && self.id.borrow().is_some() => {
                    if self.bell.heard() > Leave::Stay {
                        // It has said that it leaves, and is forgotten.
                        std::future::pending::<()>().await;
                    }
                    tracing::warn!("the farm does not know this worker any more: joining again");
                    drop(self.desk.take_all());
                    self.id.send_replace(None);
                    Duration::ZERO
                }
                // Something else may stand for a moment where a farm stood that knew this worker.
                Err(error) if error.may_pass() || known && is_strange(&error) => {
                    if complained.is_none_or(|at| at.elapsed() > COMPLAINT) {
                        tracing::warn!(%error, "trying again");
                        complained = Some(Instant::now());
                    }
                    self.drop_ended();
                    backoff.delay()
                }
                Err(error) => return WorkerError::Refused(error),
            };
            self.pause(wait, complained.is_some()).await;
        }
    }

    /// Joins where it has not; else one exchange. Returns the time until the next.
    async fn once(&self) -> Result<Duration, ClientError> {
        let id = self.id.borrow().clone();
        let Some(id) = id else {
            let joined = self.client.join(self.join).await?;
            tracing::info!(worker = %joined.id, farm = %self.client.address(), "joined");
            self.id.send_replace(Some(joined.id));
            return Ok(Duration::ZERO);
        };
        let staying = self.bell.heard() == Leave::Stay;
        let exchange = Exchange {
            holding: self.desk.holding(),
            wants: if staying { self.desk.wants() } else { 0 },
            scenes: self.scenes.at_hand(),
            leaving: !staying,
            beat: self.beats.fetch_add(1, Ordering::Relaxed) + 1,
        };
        let asked = Instant::now();
        let reply = self.client.exchange(&id, &exchange).await?;
        Ok(self.hear(&id, &exchange, asked, reply))
    }

    fn hear(&self, id: &WorkerId, said: &Exchange, asked: Instant, reply: ExchangeReply) -> Duration {
        self.desk.renewed(&said.holding, asked);
        for errand in self.desk.drop_leases(&reply.drop) {
            note!(debug, errand, "not wanted any more: dropped");
        }
        self.drop_ended();
        if !reply.leases.is_empty() {
            tracing::debug!(worker = %id, leases = reply.leases.len(), "took");
            self.desk.add(reply.leases, id, asked);
        }
        if reply.drain {
            self.bell.ring(Leave::AfterBatch);
        }
        duration(reply.interval_seconds)
    }

    fn drop_ended(&self) {
        for errand in self.desk.drop_ended(Instant::now()) {
            note!(warn, errand, "could not be renewed in time: dropped");
        }
    }

    /// Waits for the next beat, which comes early where there is something to say.
    async fn pause(&self, wait: Duration, lost: bool) {
        let staying = self.bell.heard() == Leave::Stay;
        tokio::select! {
            () = tokio::time::sleep(wait) => {}
            () = self.desk.freed(), if staying && !lost => {}
            () = self.bell.wait(Leave::AfterBatch), if staying => {}
        }
    }
}

//! The batches that a worker holds.

use crate::errand::Errand;
use ovtigre_core::render::progress::Progress;
use ovtigre_proto::{
    id::{LeaseId, WorkerId},
    lease::{Lease, LeaseProgress},
};
use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant, SystemTime},
};
use tokio::sync::Notify;

/// Batches rendered or waiting: one each, so that the pool never idles.
const LEASES: usize = 2;
/// Sums on their way to the farm; with more, rendering waits for the line.
pub const BRINGING_MAX: usize = 4;

/// How far a batch is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Waiting,
    Rendering,
    Bringing,
}

/// A batch to render.
#[derive(Clone, Debug)]
pub struct Work {
    /// What the farm said.
    pub lease: Lease,
    /// Its names.
    pub errand: Errand,
    /// When it came.
    pub came: SystemTime,
    /// How far it is; stopped where the result is not wanted any more.
    pub progress: Arc<Progress>,
}

#[derive(Debug)]
struct Held {
    work: Work,
    stage: Stage,
    ends: Instant,
}

/// The batches that a worker holds.
#[derive(Debug, Default)]
pub struct Desk {
    held: Mutex<Vec<Held>>,
    came: Notify,
    freed: Notify,
}

impl Desk {
    fn held(&self) -> MutexGuard<'_, Vec<Held>> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts new batches on it that were handed to `worker`.
    pub fn add(&self, leases: Vec<Lease>, worker: &WorkerId, now: Instant) {
        let mut held = self.held();
        for lease in leases {
            let ends = now + duration(lease.seconds);
            let errand = Errand::new(&lease, worker.clone());
            let (progress, came) = (Arc::new(Progress::new()), SystemTime::now());
            let work = Work { lease, errand, came, progress };
            held.push(Held { work, stage: Stage::Waiting, ends });
        }
        self.came.notify_one();
    }

    /// The batch that waits longest, from now on rendered.
    pub async fn next(&self) -> Work {
        loop {
            if let Some(held) = self.held().iter_mut().find(|held| held.stage == Stage::Waiting) {
                held.stage = Stage::Rendering;
                return held.work.clone();
            }
            self.came.notified().await;
        }
    }

    /// A batch is rendered and on its way.
    pub fn bringing(&self, id: &LeaseId) {
        if let Some(held) = self.held().iter_mut().find(|held| held.work.lease.id == *id) {
            held.stage = Stage::Bringing;
        }
        self.freed.notify_one();
    }

    /// Whether a batch is on it.
    pub fn holds(&self, id: &LeaseId) -> bool {
        self.held().iter().any(|held| held.work.lease.id == *id)
    }

    /// Takes a batch off; whether it was there.
    pub fn remove(&self, id: &LeaseId) -> bool {
        let mut held = self.held();
        let before = held.len();
        held.retain(|held| held.work.lease.id != *id);
        self.freed.notify_one();
        held.len() < before
    }

    /// Stops and takes off the batches that `choose` names.
    fn stop(&self, choose: impl Fn(&Held) -> bool) -> Vec<Errand> {
        let mut stopped = Vec::new();
        self.held().retain(|held| {
            let chosen = choose(held);
            if chosen {
                held.work.progress.stop();
                stopped.push(held.work.errand.clone());
            }
            !chosen
        });
        if !stopped.is_empty() {
            self.freed.notify_one();
        }
        stopped
    }

    /// Stops batches that the farm does not want any more.
    pub fn drop_leases(&self, ids: &[LeaseId]) -> Vec<Errand> {
        self.stop(|held| ids.contains(&held.work.lease.id))
    }

    /// Stops the batches that could not be renewed in time. Sums on their way go on: late ones may
    /// still be used.
    pub fn drop_ended(&self, now: Instant) -> Vec<Errand> {
        self.stop(|held| held.ends <= now && held.stage != Stage::Bringing)
    }

    /// Takes off those that are not begun.
    pub fn take_waiting(&self) -> Vec<Errand> {
        self.stop(|held| held.stage == Stage::Waiting)
    }

    /// Stops everything.
    pub fn take_all(&self) -> Vec<Errand> {
        self.stop(|_| true)
    }

    /// What the farm is told: all that is held is renewed by it.
    pub fn holding(&self) -> Vec<LeaseProgress> {
        (self.held().iter())
            .map(|held| LeaseProgress {
                lease: held.work.lease.id.clone(),
                done: if held.stage == Stage::Bringing { 1.0 } else { held.work.progress.fraction() },
            })
            .collect()
    }

    /// The farm has renewed `leases`.
    pub fn renewed(&self, leases: &[LeaseProgress], now: Instant) {
        for held in self.held().iter_mut() {
            if leases.iter().any(|renewed| renewed.lease == held.work.lease.id) {
                held.ends = now + duration(held.work.lease.seconds);
            }
        }
    }

    /// Batches that it has room for.
    pub fn wants(&self) -> u32 {
        let held = self.held();
        let bringing = held.iter().filter(|held| held.stage == Stage::Bringing).count();
        if bringing >= BRINGING_MAX { 0 } else { LEASES.saturating_sub(held.len() - bringing) as u32 }
    }

    /// Returns when room has been made.
    pub async fn freed(&self) {
        self.freed.notified().await;
    }
}

/// Seconds from the farm, made harmless.
pub(crate) fn duration(seconds: f64) -> Duration {
    let day = 86_400.0;
    Duration::from_secs_f64(if seconds.is_finite() { seconds.clamp(0.01, day) } else { 1.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mock;

    #[tokio::test]
    async fn what_is_held_is_rendered_in_order_and_dropped_when_it_ends() {
        let (desk, now) = (Desk::default(), Instant::now());
        desk.add(vec![mock::lease(0, 10.0), mock::lease(1, 20.0)], &"worker".parse().unwrap(), now);
        assert_eq!(desk.wants(), 0);
        let (first, second) = (desk.next().await, desk.next().await);
        assert_eq!((first.lease.batch.block.index, second.lease.batch.block.index), (0, 1));
        desk.bringing(&first.lease.id);
        assert_eq!(desk.wants(), 1);
        assert_eq!(desk.drop_ended(now + Duration::from_secs(19)).len(), 0, "a sum on its way goes on");
        desk.renewed(&desk.holding(), now + Duration::from_secs(15));
        assert_eq!(desk.drop_ended(now + Duration::from_secs(34)).len(), 0);
        assert_eq!(desk.drop_ended(now + Duration::from_secs(35)).len(), 1);
        assert!(second.progress.is_stopped() && !first.progress.is_stopped());
        assert!(desk.remove(&first.lease.id) && !desk.remove(&first.lease.id));
        assert_eq!(desk.wants(), 2);
    }

    #[test]
    fn durations_from_outside_are_harmless() {
        for seconds in [f64::NAN, f64::INFINITY, -1.0, 0.0, 1e300] {
            let taken = duration(seconds);
            assert!(taken >= Duration::from_millis(10) && taken <= Duration::from_hours(24));
        }
    }
}

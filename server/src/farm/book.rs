//! What can be handed out, of all jobs: the store's ledger as seen from memory.

use super::split::Plan;
use crate::store::row::{BatchKey, LeaseRow};
use ovtigre_core::settings::Settings;
use ovtigre_proto::id::{BlobId, JobId, LeaseId, WorkerId};
use std::{
    cmp::Reverse,
    collections::{BTreeMap, HashMap},
    sync::Arc,
    time::Instant,
};
use tokio::sync::Notify;

/// Batches of one job before its turn is over.
const TURN: u64 = 4;

/// A job whose batches are handed out.
#[derive(Debug)]
pub struct Entry {
    /// Its scene.
    pub scene: BlobId,
    /// What is rendered.
    pub settings: Arc<Settings>,
    /// What may be handed out.
    pub plan: Plan,
    /// Higher goes first.
    pub priority: i32,
    /// Its place in the order of coming.
    pub sequence: i64,
    /// Whether its batches are handed out now.
    pub hand_out: HandOut,
    served: u64,
}

/// Whether a job's batches are handed out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandOut {
    /// They are.
    Yes,
    /// The job is paused.
    Paused,
}

/// A lease in a worker's hands.
#[derive(Clone, Debug)]
pub struct Holding {
    /// Whose batch, which, who.
    pub row: LeaseRow,
    /// When its time was last extended in the store.
    pub renewed: Instant,
}

/// A batch that is set aside for a worker.
#[derive(Clone, Debug)]
pub struct Offer {
    /// Whose batch.
    pub job: JobId,
    /// Which.
    pub batch: BatchKey,
    /// Its scene.
    pub scene: BlobId,
    /// What is rendered.
    pub settings: Arc<Settings>,
}

/// Jobs whose batches are handed out, and the leases.
#[derive(Debug, Default)]
pub struct Book {
    jobs: BTreeMap<JobId, Entry>,
    leases: HashMap<LeaseId, Holding>,
    more: Arc<Notify>,
}

impl Book {
    /// Adds a job. It begins level with the others: what they got before is no debt of theirs.
    pub fn add(&mut self, id: JobId, mut entry: Entry) {
        entry.served = self.jobs.values().map(|e| e.served).min().unwrap_or(0);
        self.jobs.insert(id, entry);
        self.more.notify_waiters();
    }

    /// Notified when there may be more to hand out than before.
    pub fn more(&self) -> Arc<Notify> {
        Arc::clone(&self.more)
    }

    /// A job that is over, and its leases.
    pub fn remove(&mut self, id: &JobId) {
        self.jobs.remove(id);
        self.leases.retain(|_, held| held.row.job != *id);
    }

    /// A job.
    pub fn job(&mut self, id: &JobId) -> Option<&mut Entry> {
        self.jobs.get_mut(id)
    }

    /// A checkpoint of a job was taken: so many are.
    pub fn reach(&mut self, id: &JobId, checkpoints: u32) {
        if let Some(entry) = self.jobs.get_mut(id) {
            entry.plan.reach(checkpoints);
            self.more.notify_waiters();
        }
    }

    /// Sets aside up to `wants` batches: by priority, then in turns; within a turn, jobs whose scene
    /// is in `scenes` first. `ahead` bounds each job's batches past its next checkpoint.
    pub fn offer(&mut self, wants: u32, scenes: &[BlobId], ahead: u64) -> Vec<Offer> {
        let mut offers = Vec::new();
        while offers.len() < wants as usize {
            let mut order: Vec<(&JobId, &mut Entry)> =
                self.jobs.iter_mut().filter(|(_, e)| e.hand_out == HandOut::Yes).collect();
            order.sort_by_key(|(_, e)| {
                (Reverse(e.priority), e.served / TURN, !scenes.contains(&e.scene), e.served, e.sequence)
            });
            let taken = order.into_iter().find_map(|(id, entry)| {
                let batch = entry.plan.take(ahead)?;
                entry.served += 1;
                let settings = Arc::clone(&entry.settings);
                Some(Offer { job: id.clone(), batch, scene: entry.scene.clone(), settings })
            });
            match taken {
                Some(offer) => offers.push(offer),
                None => break,
            }
        }
        offers
    }

    /// A batch that was set aside or handed out may be handed out again.
    pub fn put_back(&mut self, job: &JobId, batch: BatchKey) {
        if let Some(entry) = self.jobs.get_mut(job) {
            entry.plan.put_back(batch);
            self.more.notify_waiters();
        }
    }

    /// A batch was handed out.
    pub fn hold(&mut self, row: LeaseRow) {
        self.leases.insert(row.id.clone(), Holding { row, renewed: Instant::now() });
    }

    /// A lease.
    pub fn lease(&mut self, id: &LeaseId) -> Option<&mut Holding> {
        self.leases.get_mut(id)
    }

    /// A lease ended and its batch comes back.
    pub fn take_back(&mut self, row: &LeaseRow) {
        self.leases.remove(&row.id);
        self.put_back(&row.job, row.batch);
    }

    /// A batch was brought: nobody needs it any more. Returns who held it last.
    pub fn brought(&mut self, job: &JobId, batch: BatchKey) -> Option<WorkerId> {
        if let Some(entry) = self.jobs.get_mut(job) {
            entry.plan.brought(batch);
        }
        let of = |held: &Holding| held.row.job == *job && held.row.batch == batch;
        let who = self.leases.values().find(|held| of(held)).map(|held| held.row.worker.clone());
        self.leases.retain(|_, held| !of(held));
        who
    }

    /// Batches that could be handed out now before the next checkpoints.
    pub fn waiting(&self) -> u64 {
        self.jobs.values().filter(|e| e.hand_out == HandOut::Yes).map(|e| e.plan.waiting()).sum()
    }

    /// Batches in workers' hands.
    pub fn leased(&self) -> u64 {
        self.leases.len() as u64
    }
}

impl Entry {
    /// A job of which nothing was handed out in this turn.
    pub fn new(
        scene: BlobId,
        settings: Settings,
        plan: Plan,
        priority: i32,
        sequence: i64,
        hand_out: HandOut,
    ) -> Self {
        Self { scene, settings: Arc::new(settings), plan, priority, sequence, hand_out, served: 0 }
    }
}

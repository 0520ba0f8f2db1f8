//! What can be handed out, of all jobs: the store's ledger as seen from memory.

use super::{
    audit::{Audit, Audits},
    split::Plan,
};
use crate::store::row::{BatchKey, LeaseRow};
use ovtigre_core::settings::Settings;
use ovtigre_proto::{
    id::{BlobId, JobId, LeaseId, WorkerId},
    lease::{Exchange, WorkerJoin},
};
use std::{
    cmp::Reverse,
    collections::{BTreeMap, BTreeSet, HashMap},
    sync::Arc,
    time::Instant,
};
use tokio::sync::Notify;

/// Batches of one job of weight 1 before its turn is over.
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
    /// Who may render it.
    pub wants: Wants,
    /// Workers that gave a batch back with a reason, until somebody brings it.
    pub failed: BTreeMap<BatchKey, BTreeSet<WorkerId>>,
    served: u64,
}

/// Who may render a job, and how much of the farm is its.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wants {
    /// Version of the program; any where it is empty.
    pub build: String,
    /// Class of processors, once it is known.
    pub class: Option<String>,
    /// What a worker has to offer.
    pub tags: Vec<String>,
    /// Workers at a time, at most.
    pub max_workers: Option<u32>,
    /// Its share among jobs of its priority, at least 1.
    pub weight: u32,
}

impl Wants {
    /// Whether a worker is of the kind that may render it.
    pub fn allows(&self, join: &WorkerJoin) -> bool {
        (self.build.is_empty() || self.build == join.build)
            && self.class.as_ref().is_none_or(|class| *class == join.instruction_set)
            && self.tags.iter().all(|tag| join.tags.contains(tag))
    }
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
    /// When its time was last extended.
    pub renewed: Instant,
    /// Number of the worker's exchange in whose answer it was handed out; 0 where that is not known.
    pub beat: u64,
    /// What a sum is held against that is only for comparison; `None` where it is to count.
    pub audit: Option<Audit>,
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
    /// Whether its job is pinned to a class of processors.
    pub pinned: bool,
    /// What its sum is held against, where it is only for comparison.
    pub audit: Option<Audit>,
}

/// A worker that asks for batches.
#[derive(Clone, Copy, Debug)]
pub struct Asker<'a> {
    /// Who.
    pub id: &'a WorkerId,
    /// What it says of itself.
    pub join: &'a WorkerJoin,
    /// Scenes that it has at hand.
    pub scenes: &'a [BlobId],
    /// Batches that it would take.
    pub wants: u32,
    /// Active workers, itself included.
    pub active: usize,
    /// Number of its exchange.
    pub beat: u64,
}

/// Jobs whose batches are handed out, and the leases.
#[derive(Debug, Default)]
pub struct Book {
    jobs: BTreeMap<JobId, Entry>,
    leases: HashMap<LeaseId, Holding>,
    more: Arc<Notify>,
    /// Batches that are rendered again to compare.
    pub audits: Audits,
}

impl Book {
    /// Adds a job. It begins level with the others: what they got before is no debt of theirs.
    pub fn add(&mut self, id: JobId, mut entry: Entry) {
        let level = self.jobs.values().map(|e| e.served / u64::from(e.wants.weight)).min().unwrap_or(0);
        entry.served = level * u64::from(entry.wants.weight);
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
        self.audits.forget(id);
    }

    /// A job.
    pub fn job(&mut self, id: &JobId) -> Option<&mut Entry> {
        self.jobs.get_mut(id)
    }

    /// Whether a job is for workers of this version of the program.
    pub fn has_build(&self, build: &str) -> bool {
        self.jobs.values().any(|entry| entry.wants.build == build)
    }

    /// A checkpoint of a job was taken: so many are.
    pub fn reach(&mut self, id: &JobId, checkpoints: u32) {
        if let Some(entry) = self.jobs.get_mut(id) {
            entry.plan.reach(checkpoints);
            self.more.notify_waiters();
        }
    }

    /// Sets aside batches: by priority, then in turns by weight; within a turn, jobs whose scene is at hand
    /// first. `ahead` bounds each job's batches past its next checkpoint.
    pub fn offer(&mut self, asker: &Asker<'_>, ahead: u64) -> Vec<Offer> {
        let mut offers = Vec::new();
        while offers.len() < asker.wants as usize {
            match self.offer_audit(asker).or_else(|| self.offer_one(asker, ahead)) {
                Some(offer) => offers.push(offer),
                None => break,
            }
        }
        offers
    }

    fn offer_audit(&mut self, asker: &Asker<'_>) -> Option<Offer> {
        let jobs = &self.jobs;
        let fits = |job: &JobId| jobs.get(job).is_some_and(|e| e.wants.allows(asker.join));
        let (job, batch, audit) = self.audits.take(asker.id, fits)?;
        let entry = self.jobs.get(&job)?;
        let (scene, settings) = (entry.scene.clone(), Arc::clone(&entry.settings));
        Some(Offer { job, batch, scene, settings, pinned: true, audit: Some(audit) })
    }

    fn offer_one(&mut self, asker: &Asker<'_>, ahead: u64) -> Option<Offer> {
        let leases = &self.leases;
        let has_room = |id: &JobId, most: Option<u32>| {
            most.is_none_or(|most| {
                let of = leases.values().filter(|held| held.row.job == *id && held.row.worker != *asker.id);
                let others: BTreeSet<&WorkerId> = of.map(|held| &held.row.worker).collect();
                others.len() < most as usize
            })
        };
        let mut order: Vec<(&JobId, &mut Entry)> = (self.jobs.iter_mut())
            .filter(|(id, e)| {
                e.hand_out == HandOut::Yes && e.wants.allows(asker.join) && has_room(id, e.wants.max_workers)
            })
            .collect();
        order.sort_by_key(|(_, e)| {
            let weight = u64::from(e.wants.weight);
            let far = !asker.scenes.contains(&e.scene);
            (Reverse(e.priority), e.served / (TURN * weight), far, e.served / weight, e.sequence)
        });
        order.into_iter().find_map(|(id, entry)| {
            // A batch that failed here is for others, as long as there are others.
            let failed = &entry.failed;
            let shun = |batch: BatchKey| {
                failed.get(&batch).is_some_and(|who| who.contains(asker.id) && who.len() < asker.active)
            };
            let batch = entry.plan.take(ahead, shun)?;
            entry.served += 1;
            let (scene, settings) = (entry.scene.clone(), Arc::clone(&entry.settings));
            let pinned = entry.wants.class.is_some();
            Some(Offer { job: id.clone(), batch, scene, settings, pinned, audit: None })
        })
    }

    /// A batch that was set aside or handed out may be handed out again.
    pub fn put_back(&mut self, job: &JobId, batch: BatchKey) {
        if let Some(entry) = self.jobs.get_mut(job) {
            entry.plan.put_back(batch);
            self.more.notify_waiters();
        }
    }

    /// What was offered and is not handed out may be offered again.
    pub fn withdraw(&mut self, offer: Offer) {
        match offer.audit {
            Some(audit) => self.audits.ask(offer.job, offer.batch, audit),
            None => self.put_back(&offer.job, offer.batch),
        }
    }

    /// A batch was handed out, in the answer to the worker's exchange number `beat`.
    pub fn hold(&mut self, row: LeaseRow, audit: Option<Audit>, beat: u64) {
        self.leases.insert(row.id.clone(), Holding { row, renewed: Instant::now(), beat, audit });
    }

    /// Leases that a worker was given before this exchange of its, and does not hold.
    pub fn unheard(&self, worker: &WorkerId, said: &Exchange) -> Vec<LeaseId> {
        let unheard = |held: &&Holding| {
            held.row.worker == *worker
                && held.beat < said.beat
                && said.holding.iter().all(|progress| progress.lease != held.row.id)
        };
        self.leases.values().filter(unheard).map(|held| held.row.id.clone()).collect()
    }

    /// A lease is nobody's any more.
    pub fn forget(&mut self, id: &LeaseId) {
        self.leases.remove(id);
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

    /// A lease whose sum is only for comparison ends; `None` where it is no such lease.
    pub fn end_audit(&mut self, id: &LeaseId) -> Option<(LeaseRow, Audit)> {
        self.leases.get(id)?.audit.as_ref()?;
        let held = self.leases.remove(id)?;
        held.audit.map(|audit| (held.row, audit))
    }

    /// Leases for comparison that were not renewed since `before`, or that are a worker's.
    pub fn audits_held(&self, before: Option<Instant>, by: Option<&WorkerId>) -> Vec<LeaseId> {
        let ended =
            |held: &&Holding| before.is_some_and(|at| held.renewed < at) || Some(&held.row.worker) == by;
        let held = self.leases.values().filter(|held| held.audit.is_some()).filter(ended);
        held.map(|held| held.row.id.clone()).collect()
    }

    /// A worker's leases whose sums are to count.
    pub fn held_by(&self, worker: &WorkerId) -> Vec<LeaseId> {
        let its = |held: &&Holding| held.row.worker == *worker && held.audit.is_none();
        self.leases.values().filter(its).map(|held| held.row.id.clone()).collect()
    }

    /// A batch was brought: nobody needs it any more. Returns who had failed at it.
    pub fn brought(&mut self, job: &JobId, batch: BatchKey) -> BTreeSet<WorkerId> {
        let of = |held: &Holding| held.audit.is_none() && held.row.job == *job && held.row.batch == batch;
        self.leases.retain(|_, held| !of(held));
        let Some(entry) = self.jobs.get_mut(job) else { return BTreeSet::new() };
        entry.plan.brought(batch);
        entry.failed.remove(&batch).unwrap_or_default()
    }

    /// Batches that could be handed out now before the next checkpoints.
    pub fn waiting(&self) -> u64 {
        self.jobs.values().filter(|e| e.hand_out == HandOut::Yes).map(|e| e.plan.waiting()).sum()
    }
}

impl Entry {
    /// A job of which nothing was handed out in this turn.
    pub fn new(
        scene: BlobId,
        settings: Settings,
        plan: Plan,
        order: (i32, i64),
        hand_out: HandOut,
        wants: Wants,
    ) -> Self {
        let (priority, sequence) = order;
        let (settings, failed) = (Arc::new(settings), BTreeMap::new());
        Self { scene, settings, plan, priority, sequence, hand_out, wants, failed, served: 0 }
    }
}

//! Workers that were heard of, in memory: the store is told of beats only now and then.

use ovtigre_proto::{
    id::{JobId, WorkerId},
    lease::WorkerJoin,
    status::WorkerState,
};
use std::{
    collections::{BTreeSet, HashMap},
    sync::Arc,
    time::{Duration, Instant},
};

/// A rest is doubled so often, at most.
const STRIKES_MAX: u32 = 6;

/// A worker.
#[derive(Clone, Debug)]
pub struct Member {
    /// What it says of itself.
    pub join: Arc<WorkerJoin>,
    /// How it stands.
    pub state: WorkerState,
    /// Batches that it holds or would take.
    pub capacity: u32,
    /// When its beat was last written down.
    pub noted: Instant,
    /// When it was last heard of.
    pub seen: Instant,
    /// Batches it gave back with a reason since it brought one.
    pub strikes: u32,
    /// It gets no batch before.
    pub rests_until: Instant,
    /// Jobs at which it failed since it brought a batch, by its own fault.
    pub failed_at: BTreeSet<JobId>,
}

impl Member {
    /// One that is heard of for the first time.
    pub fn new(join: Arc<WorkerJoin>, state: WorkerState, now: Instant) -> Self {
        let failed_at = BTreeSet::new();
        Self { join, state, capacity: 1, noted: now, seen: now, strikes: 0, rests_until: now, failed_at }
    }
}

/// Workers that were heard of.
#[derive(Debug, Default)]
pub struct Crew {
    members: HashMap<WorkerId, Member>,
}

impl Crew {
    /// A worker, if it was heard of since the farm was started.
    pub fn get(&self, id: &WorkerId) -> Option<Member> {
        self.members.get(id).cloned()
    }

    /// A worker is heard of.
    pub fn set(&mut self, id: &WorkerId, member: Member) {
        self.members.insert(id.clone(), member);
    }

    /// How a worker stands from now on.
    pub fn set_state(&mut self, id: &WorkerId, state: WorkerState) {
        if let Some(member) = self.members.get_mut(id) {
            member.state = state;
        }
    }

    /// A worker gave a batch back with a reason: it rests for `time`, twice as long for each batch
    /// before since it brought one.
    pub fn strike(&mut self, id: &WorkerId, time: Duration) {
        if let Some(member) = self.members.get_mut(id) {
            member.rests_until = Instant::now() + time * (1 << member.strikes.min(STRIKES_MAX));
            member.strikes += 1;
        }
    }

    /// A worker failed at a job by its own fault; at how many it did so since it brought a batch.
    pub fn blame(&mut self, id: &WorkerId, job: &JobId) -> usize {
        self.members.get_mut(id).map_or(0, |member| {
            member.failed_at.insert(job.clone());
            member.failed_at.len()
        })
    }

    /// A worker brought a batch.
    pub fn clear(&mut self, id: &WorkerId) {
        if let Some(member) = self.members.get_mut(id) {
            member.strikes = 0;
            member.rests_until = Instant::now();
            member.failed_at.clear();
        }
    }

    /// Whether a worker is to get no batch now.
    pub fn rests(&self, id: &WorkerId) -> bool {
        self.members.get(id).is_some_and(|member| member.rests_until > Instant::now())
    }

    /// Workers that were not heard of for `time`.
    pub fn silent(&self, time: Duration) -> Vec<WorkerId> {
        let silent = self.members.iter().filter(|(_, member)| member.seen.elapsed() > time);
        silent.map(|(id, _)| id.clone()).collect()
    }

    /// Workers lost or gone.
    pub fn remove(&mut self, id: &WorkerId) {
        self.members.remove(id);
    }

    /// Active workers heard of within `time`.
    pub fn active(&self, time: Duration) -> u32 {
        self.lately(time).count() as u32
    }

    /// Batches that active workers hold or would take, all together.
    pub fn capacity(&self, time: Duration) -> u64 {
        self.lately(time).map(|m| u64::from(m.capacity)).sum()
    }

    fn lately(&self, time: Duration) -> impl Iterator<Item = &Member> {
        // The clock is read once, not for each of a thousand workers at each beat of theirs.
        let now = Instant::now();
        let lately =
            move |m: &&Member| m.state == WorkerState::Active && now.saturating_duration_since(m.seen) < time;
        self.members.values().filter(lately)
    }
}

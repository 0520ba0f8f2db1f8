//! Workers that were heard of, in memory: the store is told of beats only now and then.

use ovtigre_proto::{id::WorkerId, status::WorkerState};
use std::{
    collections::HashMap,
    time::{Duration, Instant},
};

/// A rest is doubled so often, at most.
const STRIKES_MAX: u32 = 6;

/// A worker.
#[derive(Clone, Copy, Debug)]
pub struct Member {
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
}

impl Member {
    /// One that is heard of for the first time.
    pub fn new(state: WorkerState, now: Instant) -> Self {
        Self { state, capacity: 1, noted: now, seen: now, strikes: 0, rests_until: now }
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
        self.members.get(id).copied()
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

    /// A worker brought a batch.
    pub fn clear(&mut self, id: &WorkerId) {
        if let Some(member) = self.members.get_mut(id) {
            member.strikes = 0;
            member.rests_until = Instant::now();
        }
    }

    /// Whether a worker is to get no batch now.
    pub fn rests(&self, id: &WorkerId) -> bool {
        self.members.get(id).is_some_and(|member| member.rests_until > Instant::now())
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
        self.members.values().filter(move |m| m.state == WorkerState::Active && m.seen.elapsed() < time)
    }
}

//! Workers that were heard of, in memory: the store is told of beats only now and then.

use ovtigre_proto::{id::WorkerId, status::WorkerState};
use std::{
    collections::HashMap,
    time::{Duration, Instant},
};

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

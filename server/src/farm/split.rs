//! Which batch is handed out next. Pure: no clock, no store.

use crate::store::row::{BatchKey, Lane};
use ovtigre_core::film::schedule::Schedule;
use std::{collections::BTreeSet, sync::Arc};

/// What of a job's schedule is handed out, and what may be.
///
/// The lowest block goes first over all lanes, so that replicates advance together. Blocks past the
/// next checkpoint are handed out only so far as workers would stand idle: they are wasted where the
/// checkpoint ends the job.
#[derive(Clone, Debug)]
pub struct Plan {
    schedule: Arc<Schedule>,
    /// Numbers of blocks at which the job is looked at.
    checkpoints: Vec<u32>,
    /// How many of them were reached.
    reached: usize,
    /// The next block of each lane that has one.
    next: BTreeSet<BatchKey>,
    returned: BTreeSet<BatchKey>,
    /// Blocks from this one on are handed out only once the checkpoint before it was reached.
    gate: Option<u32>,
}

impl Plan {
    /// Where `cursors` say which block of each lane is next, and `returned` are to be handed out again.
    pub fn new(
        schedule: Arc<Schedule>,
        cursors: impl IntoIterator<Item = (Lane, u32)>,
        returned: impl IntoIterator<Item = BatchKey>,
        reached: u32,
    ) -> Self {
        let blocks = schedule.blocks().len() as u32;
        let next =
            cursors.into_iter().filter(|(_, block)| *block < blocks).map(|(lane, block)| lane.at(block));
        let checkpoints = schedule.checkpoints().into_iter().map(|blocks| blocks as u32).collect();
        Self {
            checkpoints,
            reached: reached as usize,
            next: next.collect(),
            returned: returned.into_iter().collect(),
            gate: None,
            schedule,
        }
    }

    /// The same, of which no batch after `blocks` blocks is handed out before their checkpoint was reached.
    #[must_use]
    pub fn gated(self, blocks: Option<u32>) -> Self {
        Self { gate: blocks, ..self }
    }

    /// A plan of which nothing was handed out.
    pub fn fresh(schedule: Arc<Schedule>) -> Self {
        let lanes = lanes(&schedule).map(|lane| (lane, 0)).collect::<Vec<_>>();
        Self::new(schedule, lanes, [], 0)
    }

    /// The schedule.
    pub fn schedule(&self) -> &Schedule {
        &self.schedule
    }

    /// The next batch to hand out, with at most `ahead` batches past the next checkpoint in hands, and
    /// without those that came back and that `shun` names.
    pub fn take(&mut self, ahead: u64, shun: impl Fn(BatchKey) -> bool) -> Option<BatchKey> {
        let returned = self.returned.iter().find(|batch| !shun(**batch));
        let batch = [returned, self.next.first()].into_iter().flatten().min().copied()?;
        let shut = self.gate.is_some_and(|gate| batch.block >= gate && self.limit() <= gate);
        if shut || batch.block >= self.limit() && self.past_limit() >= ahead {
            return None;
        }
        if !self.returned.remove(&batch) {
            self.next.remove(&batch);
            if batch.block + 1 < self.schedule.blocks().len() as u32 {
                self.next.insert(batch.lane().at(batch.block + 1));
            }
        }
        Some(batch)
    }

    /// Goes on where `cursors` and `returned` say, whatever was handed out here.
    pub fn refresh(
        &mut self,
        cursors: impl IntoIterator<Item = (Lane, u32)>,
        returned: impl IntoIterator<Item = BatchKey>,
    ) {
        let (schedule, gate) = (Arc::clone(&self.schedule), self.gate);
        *self = Self::new(schedule, cursors, returned, self.reached as u32).gated(gate);
    }

    /// A batch that was handed out comes back.
    pub fn put_back(&mut self, batch: BatchKey) {
        self.returned.insert(batch);
    }

    /// A batch that came back was brought after all.
    pub fn brought(&mut self, batch: BatchKey) {
        self.returned.remove(&batch);
    }

    /// So many checkpoints were reached.
    pub fn reach(&mut self, checkpoints: u32) {
        self.reached = self.reached.max(checkpoints as usize);
    }

    /// Batches that could be handed out before the next checkpoint.
    pub fn waiting(&self) -> u64 {
        let limit = self.limit();
        let fresh = self.next.iter().map(|b| u64::from(limit.saturating_sub(b.block))).sum::<u64>();
        fresh + self.returned.iter().filter(|b| b.block < limit).count() as u64
    }

    fn limit(&self) -> u32 {
        self.checkpoints.get(self.reached).copied().unwrap_or(self.schedule.blocks().len() as u32)
    }

    fn past_limit(&self) -> u64 {
        let limit = self.limit();
        let blocks = self.schedule.blocks().len() as u32;
        let lanes = self.schedule.regions().len() as u64 * u64::from(self.schedule.replicates());
        let finished = (lanes - self.next.len() as u64) * u64::from(blocks - limit);
        let handed: u64 = self.next.iter().map(|b| u64::from(b.block.saturating_sub(limit))).sum();
        finished + handed - self.returned.iter().filter(|b| b.block >= limit).count() as u64
    }
}

/// All lanes of a schedule.
pub fn lanes(schedule: &Schedule) -> impl Iterator<Item = Lane> + use<> {
    let (regions, replicates) = (schedule.regions().len() as u32, schedule.replicates());
    (0..replicates).flat_map(move |replicate| (0..regions).map(move |region| Lane { replicate, region }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use ovtigre_core::film::size::Region;
    use std::collections::BTreeMap;

    fn plan(samples: u32) -> Plan {
        let region = Region { x: 0, y: 0, width: 640, height: 360 };
        Plan::fresh(Arc::new(Schedule::new(region, 1, 3, samples)))
    }

    #[test]
    fn replicates_advance_together_and_every_batch_is_handed_out_once() {
        let mut plan = plan(100);
        let mut taken = BTreeMap::new();
        while let Some(batch) = plan.take(u64::MAX, |_| false) {
            *taken.entry(batch).or_insert(0) += 1;
            let blocks = taken.keys().map(|b| b.block);
            assert!(batch.block + 1 >= blocks.max().unwrap(), "{batch} came late");
        }
        assert!(taken.values().all(|n| *n == 1));
        assert_eq!(taken.len() as u64, plan.schedule().batches());
    }

    #[test]
    fn a_batch_that_came_back_goes_first() {
        let mut plan = plan(100);
        let first = plan.take(0, |_| false).unwrap();
        let second = plan.take(0, |_| false).unwrap();
        plan.put_back(second);
        plan.put_back(first);
        assert_eq!(plan.take(0, |_| false), Some(first));
        plan.brought(second);
        assert_ne!(plan.take(0, |_| false), Some(second));
    }

    #[test]
    fn look_ahead_past_a_checkpoint_is_bounded() {
        let mut plan = plan(100);
        // The first checkpoint is after one block of each of three replicates.
        let count = |plan: &mut Plan, ahead| std::iter::from_fn(|| plan.take(ahead, |_| false)).count();
        assert_eq!(plan.waiting(), 3);
        assert_eq!(count(&mut plan, 2), 5);
        assert_eq!(count(&mut plan, 4), 2);
        plan.put_back(BatchKey { block: 1, replicate: 0, region: 0 });
        assert_eq!(count(&mut plan, 4), 1);
        plan.reach(1);
        assert_eq!(count(&mut plan, 4), 3, "four are past the second checkpoint, of which one was before");
    }

    #[test]
    fn a_gate_is_shut_until_its_checkpoint_was_reached() {
        // Checkpoints are after 1, 2, 3, 4 … blocks.
        let mut plan = plan(100).gated(Some(2));
        let count = |plan: &mut Plan| std::iter::from_fn(|| plan.take(u64::MAX, |_| false)).count();
        assert_eq!(count(&mut plan), 6);
        plan.reach(1);
        plan.refresh([0, 1, 2].map(|replicate| (Lane { replicate, region: 0 }, 2)), []);
        assert_eq!(count(&mut plan), 0);
        plan.reach(2);
        assert_eq!(count(&mut plan) as u64, plan.schedule().batches() - 6);
    }

    #[test]
    fn a_plan_goes_on_where_the_ledger_says() {
        let schedule = plan(100).schedule.clone();
        let blocks = schedule.blocks().len() as u32;
        let lane = |replicate| Lane { replicate, region: 0 };
        let returned = lane(1).at(2);
        let mut plan =
            Plan::new(schedule, [(lane(0), 3), (lane(1), blocks), (lane(2), 4)], [returned], u32::MAX);
        assert_eq!(plan.take(0, |_| false), Some(returned));
        assert_eq!(plan.take(0, |_| false), Some(lane(0).at(3)));
    }
}

//! A farm begins and ends.

use super::{
    Farm,
    allocation::looks_before,
    book::{self, HandOut},
    error::{FarmError, Result},
    live::{Ending, Live, Waits, held},
    rules::Rules,
    scene::Inspect,
    spec::JobSpec,
    split::Plan,
};
use crate::{
    blobs::Blobs,
    store::{Store, row::JobRow},
    webhook::Messenger,
};
use ovtigre_proto::{status::JobState, telemetry::traces::Traces};
use std::{
    collections::btree_map::Entry,
    num::NonZero,
    sync::{Arc, Mutex},
    thread::available_parallelism,
    time::{Duration, SystemTime},
};
use tokio::sync::Semaphore;

/// Scenes looked into at a time: each is in memory whole.
const INSPECTORS: usize = 2;
/// Uploads that were begun so long ago were cut off.
pub(super) const UPLOAD_MAX: Duration = Duration::from_hours(24);

impl Farm {
    /// A farm that goes on where the last one over the same store and blobs ended, however it ended.
    pub async fn open(
        store: Arc<dyn Store>,
        blobs: Blobs,
        inspect: Inspect,
        rules: Rules,
        traces: Traces,
    ) -> Result<Arc<Self>> {
        let processors = available_parallelism().map_or(1, NonZero::get);
        let ids = super::ids::Ids::new();
        let messenger = Messenger::new(rules.notices_to).map_err(|e| FarmError::Messenger(e.to_string()))?;
        let farm = Arc::new(Self {
            store,
            blobs,
            rules,
            traces,
            name: ids.text(16),
            counters: super::counters::Counters::default(),
            stopping: tokio_util::sync::CancellationToken::new(),
            inspect,
            fullness: super::space::Fullness::default(),
            shown: super::picture::Shown::default(),
            sketches: super::sketches::Sketches::default(),
            ids,
            tasks: tokio_util::task::TaskTracker::new(),
            decoders: Semaphore::new(processors),
            inspectors: Semaphore::new(INSPECTORS),
            messenger,
            book: Mutex::default(),
            crew: Mutex::default(),
            lives: Mutex::default(),
        });
        farm.look_at_room();
        if farm.is_shared() {
            let farm = Arc::clone(&farm);
            farm.tasks.clone().spawn(async move {
                if let Err(error) = farm.sweep().await {
                    tracing::warn!(%error, "files that nobody needs were not removed");
                }
            });
        } else {
            farm.sweep().await?;
        }
        farm.tasks.spawn(Arc::clone(&farm).remove_staged(SystemTime::now()));
        for row in farm.store.unsettled_jobs().await? {
            farm.take_up(&row).await?;
        }
        farm.tasks.spawn(Arc::clone(&farm).tick());
        farm.tasks.spawn(Arc::clone(&farm).tell());
        farm.tasks.spawn(Arc::clone(&farm).keep_house());
        Ok(farm)
    }

    /// Stops what goes on by itself, waits for what is being written, and closes the store.
    pub async fn close(&self) {
        self.stopping.cancel();
        self.tasks.close();
        self.tasks.wait().await;
        if let Err(error) = self.store.leave_merges(&self.name).await {
            tracing::warn!(%error, "other servers go on only after a while");
        }
        self.store.close().await;
    }

    /// A job in the store that is not settled goes on.
    pub(super) async fn take_up(self: &Arc<Self>, row: &JobRow) -> Result<()> {
        let spec: JobSpec = read_spec(row)?;
        let curve = self.store.curve(&row.id).await?;
        let layers = self.store.layers(&row.id).await?;
        let live = Arc::new(Live::new(row, spec, curve, layers));
        self.learn_allocations(&live).await?;
        match held(&self.lives).entry(row.id.clone()) {
            Entry::Occupied(_) => return Ok(()),
            Entry::Vacant(place) => place.insert(Arc::clone(&live)),
        };
        if row.state.is_over() {
            live.end(Ending { state: row.state, reason: None, certified: false, waits: Waits::Not });
        } else {
            live.end_in_time(row.run_seconds);
            self.hand_out_from(row, &live).await?;
        }
        self.tasks.spawn(Arc::clone(self).pump(live));
        Ok(())
    }

    async fn hand_out_from(&self, row: &JobRow, live: &Live) -> Result<()> {
        let ledger = self.store.ledger(&row.id).await?;
        if !ledger.commits.is_empty() {
            live.kick.notify_one();
        }
        // Again after the ledger: what was decided before the checkpoints that it tells of is known then.
        self.learn_allocations(live).await?;
        let undecided = live.decision().filter(|decision| decision.allocations.is_none());
        let before = undecided.map_or(u32::MAX, |decision| looks_before(&live.schedule, decision.after));
        let reached = ledger.checkpoints.min(before);
        let plan = Plan::new(Arc::clone(&live.schedule), ledger.cursors, ledger.returned, reached);
        let plan = plan.gated(live.spec.decided_after);
        let hand_out = if row.state == JobState::Paused { HandOut::Paused } else { HandOut::Yes };
        let settings = live.spec.settings.clone();
        let wants = live.spec.wants(row.class.clone());
        let order = (row.priority, row.sequence);
        let entry =
            book::Entry::new(live.spec.fetched(&row.scene).clone(), settings, plan, order, hand_out, wants);
        let mut book = self.book();
        book.add(row.id.clone(), entry);
        ledger.leases.into_iter().for_each(|lease| book.hold(lease, None, 0));
        Ok(())
    }
}

/// The document of a job in the store.
pub fn read_spec(row: &JobRow) -> Result<JobSpec> {
    read_document(&row.spec)
}

/// A job's document.
pub(super) fn read_document(text: &str) -> Result<JobSpec> {
    serde_json::from_str(text).map_err(|e| FarmError::Damaged(e.to_string()))
}

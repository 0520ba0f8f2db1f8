//! Batches become prefixes: each lane is appended in block order, and no lane goes past a
//! checkpoint before all have reached it.

use super::{
    Farm,
    allocation::Decision,
    error::{FarmError, Result},
    live::{Arrival, Live, View, sum_bytes},
    source::Source,
    split::lanes,
    stop::can_end,
};
use crate::{
    blobs::{BlobError, BlobName},
    fail_point::FailPoint,
    store::row::{BatchKey, CommitRow, Lane, Progress},
};
use ovtigre_core::film::{append::Prefix, invalid::InvalidSamples, schedule::Schedule, sum::Sum};
use ovtigre_proto::id::JobId;
use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
    time::Instant,
};
use tokio::sync::OwnedMutexGuard;

/// Batches appended in one go, between two looks at what else happened.
const GO: usize = 8;

/// A job's sums, and what waits to be added to them.
#[derive(Debug)]
pub struct Merge {
    schedule: Arc<Schedule>,
    /// Region by region, replicate by replicate.
    pub prefixes: Vec<Vec<Prefix>>,
    /// Time workers spent on what is appended, in microseconds.
    pub worker_micros: u64,
    /// Checkpoints taken.
    pub checkpoints: u32,
    /// What is known of its allocations, where it has any.
    pub decision: Option<Decision>,
    /// When it was needed last.
    pub used: Instant,
    pub(super) points: Vec<u32>,
    waiting: BTreeMap<BatchKey, Arrival>,
    pub(super) snapshots: BTreeMap<Lane, u32>,
}

/// What the lanes can do now.
#[derive(Debug)]
pub enum Next {
    /// Add these.
    Append(Vec<Arrival>),
    /// All lanes have reached a checkpoint, or the end: look.
    Look,
    /// Wait for more.
    Wait,
}

impl Merge {
    /// No block yet, or the blobs of sums that are kept of some lanes.
    pub fn new(
        schedule: Arc<Schedule>,
        planes: u32,
        kept: Vec<Prefix>,
        commits: Vec<CommitRow>,
        checkpoints: u32,
    ) -> Self {
        let mut prefixes: Vec<Vec<Prefix>> = (schedule.regions().iter())
            .map(|r| (0..schedule.replicates()).map(|n| Prefix::empty(*r, n, planes as usize)).collect())
            .collect();
        let mut snapshots = BTreeMap::new();
        for prefix in kept {
            let region = schedule.regions().iter().position(|r| *r == prefix.region());
            let place = region.and_then(|r| prefixes[r].get_mut(prefix.replicate() as usize).map(|p| (r, p)));
            if let Some((region, place)) = place {
                let lane = Lane { replicate: prefix.replicate(), region: region as u32 };
                snapshots.insert(lane, prefix.blocks());
                *place = prefix;
            }
        }
        let points = schedule.checkpoints().into_iter().map(|blocks| blocks as u32).collect();
        let mut merge = Self {
            schedule,
            prefixes,
            worker_micros: 0,
            checkpoints,
            decision: None,
            used: Instant::now(),
            points,
            waiting: BTreeMap::new(),
            snapshots,
        };
        for row in commits {
            if row.batch.block < merge.prefix(row.batch.lane()).blocks() {
                merge.worker_micros += row.worker_micros;
            } else {
                merge.add(Arrival { row, sum: None });
            }
        }
        merge
    }

    /// The sums of a lane.
    pub fn prefix(&self, lane: Lane) -> &Prefix {
        &self.prefixes[lane.region as usize][lane.replicate as usize]
    }

    /// A batch was brought: it waits, unless it is in already.
    pub fn add(&mut self, arrival: Arrival) {
        let batch = arrival.row.batch;
        if batch.block >= self.prefix(batch.lane()).blocks() {
            let before = self.waiting.remove(&batch);
            let sum = arrival.sum.or(before.and_then(|b| b.sum));
            self.waiting.insert(batch, Arrival { row: arrival.row, sum });
        }
    }

    /// Takes up what was brought to and looked at by whoever appends.
    pub(super) fn follow(&mut self, commits: Vec<CommitRow>, checkpoints: u32) {
        self.checkpoints = self.checkpoints.max(checkpoints);
        for row in commits {
            self.add(Arrival { row, sum: None });
        }
    }

    /// Keeps at most `bytes` of decoded sums among what waits: the others are read from their blobs
    /// when their turn comes.
    fn slim(&mut self, bytes: u64) {
        let mut kept = 0;
        for arrival in self.waiting.values_mut() {
            kept += arrival.sum.as_ref().map_or(0, sum_bytes);
            if kept > bytes {
                arrival.sum = None;
            }
        }
    }

    /// Blocks at which the lanes wait for each other.
    fn limit(&self) -> u32 {
        self.points.get(self.checkpoints as usize).copied().unwrap_or(self.schedule.blocks().len() as u32)
    }

    /// Takes what can be appended now, lowest block first.
    pub fn advance(&mut self) -> Next {
        let limit = self.limit();
        let mut heads: VecDeque<Lane> = lanes(&self.schedule).collect();
        let mut reach: BTreeMap<Lane, u32> = heads.iter().map(|l| (*l, self.prefix(*l).blocks())).collect();
        let mut ready = Vec::new();
        while let Some(lane) = heads.pop_front()
            && ready.len() < GO
        {
            let block = reach[&lane];
            if block < limit
                && let Some(arrival) = self.waiting.remove(&lane.at(block))
            {
                ready.push(arrival);
                reach.insert(lane, block + 1);
                heads.push_back(lane);
            }
        }
        if !ready.is_empty() {
            return Next::Append(ready);
        }
        let at_limit = reach.values().all(|blocks| *blocks == limit);
        if at_limit && (self.checkpoints as usize) < self.points.len() { Next::Look } else { Next::Wait }
    }

    /// Adds a sum to its lane.
    pub(super) fn append(&mut self, row: &CommitRow, sum: &Sum) -> Result<()> {
        let Lane { replicate, region } = row.batch.lane();
        let prefix = &mut self.prefixes[region as usize][replicate as usize];
        if self.decision.as_ref().is_some_and(|decision| decision.is_awaited_by(sum.batch)) {
            let batch = sum.batch;
            return Err(FarmError::Damaged(format!(
                "how many samples each pixel has of {batch} is not known"
            )));
        }
        let appended = match self.decision.as_ref().and_then(|decision| decision.of(sum.batch)) {
            Some(allocation) => prefix.append_allocated(sum, allocation),
            None => prefix.append(sum),
        };
        appended.map_err(|e| FarmError::Damaged(e.to_string()))?;
        self.worker_micros += row.worker_micros;
        Ok(())
    }

    /// Whether all that the schedule has is in.
    pub fn is_complete(&self) -> bool {
        let blocks = self.schedule.blocks().len() as u32;
        self.prefixes.iter().flatten().all(|p| p.blocks() == blocks)
    }

    /// Whether each pixel has a sample.
    pub fn has_picture(&self) -> bool {
        self.prefixes.iter().all(|region| region.iter().any(|p| p.samples() > 0))
    }

    /// What is in the picture.
    pub fn progress(&self) -> Progress {
        let pixels: f64 = self.schedule.regions().iter().map(|r| r.pixels() as f64).sum();
        let all = || self.prefixes.iter().flatten();
        Progress {
            samples: all().map(|p| f64::from(p.samples()) * p.region().pixels() as f64).sum::<f64>() / pixels,
            batches: all().map(|p| u64::from(p.blocks())).sum(),
            worker_micros: self.worker_micros,
            rays: all().map(Prefix::rays).sum(),
            invalid: self.invalid().total(),
        }
    }

    /// Samples that were dropped.
    pub fn invalid(&self) -> InvalidSamples {
        let mut all = InvalidSamples::default();
        self.prefixes.iter().flatten().for_each(|prefix| all.add(prefix.invalid()));
        all
    }

    /// Hash of the set of batches in the picture: of all that its pixels depend on.
    pub fn manifest(&self, identity: &blake3::Hash) -> Option<String> {
        if !self.has_picture() {
            return None;
        }
        let mut hasher = blake3::Hasher::new();
        hasher.update(identity.as_bytes());
        for lane in lanes(&self.schedule) {
            let prefix = self.prefix(lane);
            for n in [lane.region, lane.replicate, prefix.blocks(), prefix.samples()] {
                hasher.update(&n.to_le_bytes());
            }
        }
        if let Some(allocations) = self.decision.as_ref().and_then(|decision| decision.allocations.as_ref()) {
            for half in &allocations.0 {
                hasher.update(half.hash().as_bytes());
            }
        }
        Some(hasher.finalize().to_hex().to_string())
    }

    /// Lanes with so many partials since their last blob of sums, and that number of blocks.
    pub(super) fn overdue(&self, partials: u32) -> Vec<(Lane, u32)> {
        let since = |lane: &Lane| self.snapshots.get(lane).copied().unwrap_or(0);
        lanes(&self.schedule)
            .filter(|lane| {
                let blocks = self.prefix(*lane).blocks();
                // Past these a longer schedule has other blocks: what is kept is what both have.
                blocks >= since(lane) + partials && blocks <= self.schedule.whole_blocks() as u32
            })
            .map(|lane| (lane, since(&lane)))
            .collect()
    }
}

/// A job's sums, held.
pub type Held = OwnedMutexGuard<Option<Merge>>;

impl Farm {
    /// A job's sums, read from their blobs where they are not in memory.
    pub async fn sums(&self, live: &Live) -> Result<Held> {
        let mut held = Arc::clone(&live.merge).lock_owned().await;
        if held.is_none() {
            self.make_room(live);
        }
        if self.is_shared() && live.mandate().is_none() {
            held = self.catch_up(live, held).await?;
        } else if held.is_none() {
            *held = Some(self.load(live).await?);
        }
        if let Some(merge) = held.as_mut() {
            merge.used = Instant::now();
        }
        Ok(held)
    }

    /// A job's sums from their blobs.
    pub(super) async fn load(&self, live: &Live) -> Result<Merge> {
        let mut ledger = self.store.ledger(&live.id).await?;
        let mut kept = Vec::with_capacity(ledger.snapshots.len());
        let mut lost = Vec::new();
        for (lane, blocks) in &ledger.snapshots {
            match self.prefix(live, *lane, *blocks).await? {
                Some(prefix) => kept.push(prefix),
                None => lost.push((*lane, *blocks)),
            }
        }
        if !lost.is_empty() {
            self.may_mend(live)?;
            let batches = lost.iter().flat_map(|(lane, blocks)| (0..*blocks).map(|block| lane.at(block)));
            self.again(live, batches.collect(), lost.iter().map(|(lane, _)| *lane).collect()).await?;
            ledger = self.store.ledger(&live.id).await?;
        }
        let schedule = Arc::clone(&live.schedule);
        let mut merge =
            Merge::new(schedule, live.spec.settings.planes(), kept, ledger.commits, ledger.checkpoints);
        self.learn_allocations(live).await?;
        merge.decision = live.decision();
        if live.mandate().is_some() {
            merge.look_again();
        }
        live.set_brought(ledger.brought);
        live.arrivals().into_iter().for_each(|arrival| merge.add(arrival));
        publish(live, &merge);
        Ok(merge)
    }

    /// An error where another server appends to the job's sums: what is missing here is only replaced there.
    fn may_mend(&self, live: &Live) -> Result<()> {
        if self.is_shared() && live.mandate().is_none() {
            return Err(FarmError::Damaged("a part of its sums is not there".to_owned()));
        }
        Ok(())
    }

    /// What is kept of a lane; `None` where that is lost or damaged.
    pub(super) async fn prefix(&self, live: &Live, lane: Lane, blocks: u32) -> Result<Option<Prefix>> {
        let bytes = match self.blobs.get(&BlobName::Prefix(live.id.clone(), lane, blocks)).await {
            Ok(bytes) => bytes,
            Err(BlobError::Missing(_)) => return Ok(None),
            Err(error) => return Err(error.into()),
        };
        let region = live.schedule.regions().get(lane.region as usize).copied();
        let prefix = blocking(move || Prefix::from_bytes(&bytes)).await?;
        Ok(prefix.ok().filter(|p| {
            p.blocks() == blocks && p.replicate() == lane.replicate && Some(p.region()) == region
        }))
    }

    /// Lets go of sums that were not needed lately, until those of `live` fit beside the rest.
    fn make_room(&self, live: &Live) {
        let mut others: Vec<(Instant, u64, Held)> = Vec::new();
        for other in self.lives() {
            if other.id != live.id
                && let Ok(held) = Arc::clone(&other.merge).try_lock_owned()
                && let Some(used) = held.as_ref().map(|m| m.used)
            {
                others.push((used, other.spec.sums_bytes(), held));
            }
        }
        others.sort_by_key(|(used, ..)| *used);
        let mut bytes = live.spec.sums_bytes() + others.iter().map(|(_, bytes, _)| bytes).sum::<u64>();
        for (_, its, mut held) in others {
            if bytes > self.rules.sums_bytes {
                *held = None;
                bytes -= its;
            }
        }
    }

    /// Appends what can be, looks at checkpoints; true when the job is over.
    pub async fn advance(&self, live: &Arc<Live>) -> Result<bool> {
        if !self.holds(live).await? {
            // Whoever appends reads from the store what was brought.
            live.arrivals();
            return Ok(false);
        }
        let mut held = self.sums(live).await?;
        loop {
            if self.stopping.is_cancelled() {
                return Ok(false);
            }
            let merge = held.as_mut().expect("loaded above");
            live.arrivals().into_iter().for_each(|arrival| merge.add(arrival));
            if let Some(ending) = live.ending()
                && can_end(merge, &ending)
            {
                return self.finish(live, held, ending).await.map(|()| true);
            }
            match merge.advance() {
                Next::Append(ready) => {
                    held = self.append(live, held, ready).await?;
                    held = self.snapshot(live, held).await?;
                }
                Next::Look => {
                    let (back, ending) = self.look(live, held).await?;
                    held = back;
                    if let Some(ending) = ending {
                        return self.finish(live, held, ending).await.map(|()| true);
                    }
                }
                Next::Wait => {
                    merge.slim(self.rules.fresh_bytes);
                    return Ok(false);
                }
            }
        }
    }

    /// Appends what can be, and writes nothing down.
    pub(super) async fn append_all(&self, live: &Live, mut held: Held) -> Result<Held> {
        while let Next::Append(ready) = held.as_mut().expect("loaded by the caller").advance() {
            held = self.append(live, held, ready).await?;
        }
        Ok(held)
    }

    async fn append(&self, live: &Live, mut held: Held, ready: Vec<Arrival>) -> Result<Held> {
        let mut sums = Vec::with_capacity(ready.len());
        let mut bytes = 0;
        for Arrival { row, sum } in ready {
            let source = match sum {
                Some(sum) => Source::Decoded(sum),
                None => self.partial(&live.id, &row).await?,
            };
            bytes += source.bytes();
            sums.push((row, source));
        }
        FailPoint::AppendRead.pass();
        let appended = sums.len() as u64;
        let (held, lost) = blocking(move || -> Result<(Held, Vec<BatchKey>)> {
            let merge = held.as_mut().expect("loaded by the caller");
            let mut lost: Vec<BatchKey> = Vec::new();
            for (row, source) in sums {
                if lost.iter().any(|batch| batch.lane() == row.batch.lane()) {
                    merge.add(Arrival { row, sum: None });
                    continue;
                }
                let region = merge.schedule.regions()[row.batch.region as usize];
                match source.decode(region.pixels(), &row) {
                    Some(sum) => merge.append(&row, &sum)?,
                    None => lost.push(row.batch),
                }
            }
            Ok((held, lost))
        })
        .await??;
        if !lost.is_empty() {
            self.may_mend(live)?;
            self.again(live, lost, Vec::new()).await?;
        }
        FailPoint::AppendAdded.pass();
        self.counters.appended(appended, bytes);
        publish(live, held.as_ref().expect("loaded by the caller"));
        Ok(held)
    }

    async fn partial(&self, job: &JobId, row: &CommitRow) -> Result<Source> {
        let name = BlobName::Partial(job.clone(), row.batch, row.hash.clone());
        match self.blobs.get(&name).await {
            Ok(bytes) => Ok(Source::Partial(bytes)),
            Err(BlobError::Missing(_)) => Ok(Source::Lost),
            Err(error) => Err(error.into()),
        }
    }

    /// Keeps lanes with many partials as one blob each, then removes those partials.
    async fn snapshot(&self, live: &Live, mut held: Held) -> Result<Held> {
        let overdue = held.as_ref().expect("loaded by the caller").overdue(self.rules.partials_kept);
        for (lane, since) in overdue {
            let (back, bytes, blocks) = blocking(move || {
                let prefix = held.as_ref().expect("loaded by the caller").prefix(lane);
                let (bytes, blocks) = (prefix.to_bytes(), prefix.blocks());
                (held, bytes, blocks)
            })
            .await?;
            held = back;
            FailPoint::PrefixBeforeBlob.pass();
            self.blobs.put(&BlobName::Prefix(live.id.clone(), lane, blocks), bytes.into()).await?;
            FailPoint::PrefixAfterBlob.pass();
            self.store.set_snapshot(&live.id, Self::mandate(live)?, lane, blocks).await?;
            FailPoint::PrefixAfterRow.pass();
            held.as_mut().expect("loaded by the caller").snapshots.insert(lane, blocks);
            self.forget_partials(live, lane, since, blocks).await?;
        }
        Ok(held)
    }

    async fn forget_partials(&self, live: &Live, lane: Lane, since: u32, blocks: u32) -> Result<()> {
        if since > 0 {
            self.blobs.delete(&BlobName::Prefix(live.id.clone(), lane, since)).await?;
        }
        for row in self.store.commits(&live.id, lane, since..blocks).await? {
            self.blobs.delete(&BlobName::Partial(live.id.clone(), row.batch, row.hash)).await?;
            FailPoint::PartialsBetween.pass();
        }
        Ok(())
    }
}

/// Lets the world see what is in the picture.
fn publish(live: &Live, merge: &Merge) {
    let (progress, manifest) = (merge.progress(), merge.manifest(&live.identity));
    live.set_view(|view: &mut View| {
        view.progress = progress;
        view.manifest = manifest;
    });
}

/// Runs work of the processor off the async threads. A panic in it is an error of the one who waits.
pub async fn blocking<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<T> {
    tokio::task::spawn_blocking(work).await.map_err(|error| match error.try_into_panic() {
        Ok(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
            FarmError::Damaged(format!("a defect of this program: {text}"))
        }
        Err(_) => FarmError::Stopping,
    })
}

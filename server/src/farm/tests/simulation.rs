//! The farm's rules under thousands of schedules of faults, in virtual time: what happens follows from a seed alone.
//!
//! Real are the book (what is offered to whom, what comes back), the plan of each job, the merge (what is appended when, what is
//! kept, when is looked) and the rule for what a worker never heard of. The store is a model of what its contract asks for,
//! and the line, the workers and the clock are made up. Not simulated are several servers, audits and failures with a reason.

use crate::{
    farm::{
        append::{Merge, Next},
        book::{Asker, Book, Entry, HandOut, Wants},
        live::Arrival,
        split::{Plan, lanes},
    },
    store::row::{BatchKey, CommitRow, Lane, LeaseRow},
};
use ovtigre_core::{
    film::{append::Prefix, invalid::InvalidSamples, schedule::Schedule, size::Region, sum::Sum},
    settings::Settings,
};
use ovtigre_proto::{
    id::{BlobId, JobId, LeaseId, WorkerId},
    lease::{Exchange, LeaseProgress, WorkerJoin},
};
use std::{
    cmp::Reverse,
    collections::{BTreeMap, BTreeSet, BinaryHeap},
    sync::Arc,
};

/// Schedules of an ordinary run; `OVTIGRE_SIMULATIONS` says another number.
const SCHEDULES: u64 = 2000;
/// Milliseconds that a lease lasts.
const LEASE: u64 = 1000;
/// Between two beats.
const BEAT: u64 = 100;
/// Between two looks for leases that ran out.
const TICK: u64 = 50;
/// Milliseconds after which everything has to be over.
const LONGEST: u64 = 600_000;

struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    fn below(&mut self, n: u64) -> u64 {
        self.next() % n
    }

    /// True in so many of a hundred cases.
    fn percent(&mut self, n: u64) -> bool {
        self.below(100) < n
    }
}

/// What is durable of a job.
struct Durable {
    cursors: BTreeMap<Lane, u32>,
    returned: BTreeSet<BatchKey>,
    commits: BTreeMap<BatchKey, CommitRow>,
    snapshots: BTreeMap<Lane, Prefix>,
    looks: u32,
    paused: bool,
    /// Number of looks at which it ended; `None` while it is not over.
    ended: Option<Ended>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Ended {
    Done { looks: u32 },
    Cancelled,
}

struct Held {
    job: usize,
    batch: BatchKey,
    worker: u64,
    ends: u64,
}

/// A worker, or what is left of it.
#[derive(Default)]
struct Worker {
    alive: bool,
    beats: u64,
    /// Lease, job, batch, and when it is rendered.
    desk: Vec<(LeaseId, usize, BatchKey, u64)>,
    silent_until: u64,
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Event {
    Beat(u64),
    Bring { worker: u64, lease: String, job: usize, batch: BatchKey },
    Tick,
    Fault,
}

/// A farm, its workers and its clock.
struct World {
    random: Random,
    now: u64,
    count: u64,
    events: BinaryHeap<Reverse<(u64, u64, Event)>>,
    schedules: Vec<Arc<Schedule>>,
    /// The look at which each job's error would be small enough.
    enough: Vec<u32>,
    durable: Vec<Durable>,
    leases: BTreeMap<String, Held>,
    // What a server has in memory.
    book: Book,
    merges: Vec<Option<Merge>>,
    workers: BTreeMap<u64, Worker>,
    faults: u64,
    crashes: u64,
}

fn job_id(job: usize) -> JobId {
    format!("j{job}").parse().unwrap()
}

fn worker_id(worker: u64) -> WorkerId {
    format!("w{worker}").parse().unwrap()
}

fn hash() -> BlobId {
    BlobId::of([7; 32])
}

fn join() -> WorkerJoin {
    WorkerJoin {
        name: String::new(),
        threads: 1,
        build: String::new(),
        instruction_set: String::new(),
        tags: Vec::new(),
    }
}

fn settings() -> Settings {
    let text = r#"{"size":{"width":1,"height":1},"camera":"framed","method":"path","paths":"L(D|S)*E","layers":[],
        "gloss":"as_it_is","strategies":[],"weights":"balance","bounces":null,"lens":null,"shutter":{"open":0,"close":0},
        "environment":null,"shadows":"on","seed":0,"replicates":4}"#;
    serde_json::from_str(text).unwrap()
}

/// A value that no other batch has, and that depends on the order in which it is added.
fn sum(schedule: &Schedule, job: usize, batch: BatchKey) -> Sum {
    let mixed = Random(job as u64 ^ u64::from(batch.replicate) << 20 ^ u64::from(batch.block) << 40).next();
    let value = (mixed >> 40) as f32 * 1.1920929e-3;
    let of = schedule.batch(batch.region as usize, batch.replicate, batch.block as usize).unwrap();
    let rays = 1 << (batch.block % 60);
    Sum {
        batch: of,
        planes: vec![vec![[value; 3]; of.region.pixels()]],
        invalid: InvalidSamples::default(),
        rays,
        tile_rays: Vec::new(),
    }
}

impl World {
    fn new(seed: u64) -> Self {
        let mut random = Random(seed);
        let mut world = Self {
            now: 0,
            count: 0,
            events: BinaryHeap::new(),
            schedules: Vec::new(),
            enough: Vec::new(),
            durable: Vec::new(),
            leases: BTreeMap::new(),
            book: Book::default(),
            merges: Vec::new(),
            workers: BTreeMap::new(),
            faults: 0,
            crashes: 0,
            random: Random(random.next()),
        };
        for _ in 0..=random.below(3) {
            let region = Region { x: 0, y: 0, width: 2, height: 1 };
            let (replicates, samples) = (1 + random.below(4) as u32, 200 + random.below(6000) as u32);
            let schedule = Arc::new(Schedule::new(region, 1, replicates, samples));
            let looks = schedule.checkpoints().len() as u64;
            // Beyond the last look: such a job ends when all samples are drawn.
            world.enough.push(1 + random.below(looks + 2) as u32);
            world.durable.push(Durable {
                cursors: lanes(&schedule).map(|lane| (lane, 0)).collect(),
                returned: BTreeSet::new(),
                commits: BTreeMap::new(),
                snapshots: BTreeMap::new(),
                looks: 0,
                paused: false,
                ended: None,
            });
            world.schedules.push(schedule);
        }
        world.start_server();
        for worker in 0..2 + random.below(4) {
            world.start_worker(worker);
        }
        world.after(TICK, Event::Tick);
        world.after(200, Event::Fault);
        world
    }

    fn after(&mut self, time: u64, event: Event) {
        self.count += 1;
        self.events.push(Reverse((self.now + time, self.count, event)));
    }

    fn start_worker(&mut self, worker: u64) {
        self.workers.insert(worker, Worker { alive: true, ..Worker::default() });
        self.after(1, Event::Beat(worker));
    }

    /// Takes up what is durable, as `Farm::open` does.
    fn start_server(&mut self) {
        self.book = Book::default();
        self.merges = self.durable.iter().map(|_| None).collect();
        for (job, durable) in self.durable.iter().enumerate().filter(|(_, durable)| durable.ended.is_none()) {
            let cursors = durable.cursors.clone();
            let returned = durable.returned.clone();
            let plan = Plan::new(Arc::clone(&self.schedules[job]), cursors, returned, durable.looks);
            let hand_out = if durable.paused { HandOut::Paused } else { HandOut::Yes };
            let wants =
                Wants { build: String::new(), class: None, tags: Vec::new(), max_workers: None, weight: 1 };
            let entry = Entry::new(hash(), settings(), plan, (0, job as i64), hand_out, wants);
            self.book.add(job_id(job), entry);
        }
        for (id, held) in &self.leases {
            let (id, worker) = (id.parse().unwrap(), worker_id(held.worker));
            self.book.hold(LeaseRow { id, job: job_id(held.job), batch: held.batch, worker }, None, 0);
        }
        for job in 0..self.durable.len() {
            self.pump(job);
        }
    }

    fn crash(&mut self) {
        self.crashes += 1;
        self.start_server();
    }

    /// A job's sums from what is durable, as `Farm::load` does.
    fn load(&self, job: usize) -> Merge {
        let durable = &self.durable[job];
        let kept = durable.snapshots.values().cloned().collect();
        let commits = durable.commits.values().cloned().collect();
        let mut merge = Merge::new(Arc::clone(&self.schedules[job]), 1, kept, commits, durable.looks);
        merge.look_again();
        merge
    }

    /// Appends what can be, as `Farm::advance` does; the server may die between any two steps.
    fn pump(&mut self, job: usize) {
        if self.durable[job].ended.is_some() {
            return;
        }
        let mut merge = self.merges[job].take().unwrap_or_else(|| self.load(job));
        loop {
            match merge.advance() {
                Next::Append(ready) => {
                    for Arrival { row, .. } in ready {
                        let sum = sum(&self.schedules[job], job, row.batch);
                        merge.append(&row, &sum).expect("in the order of blocks, each once");
                    }
                    for (lane, _) in merge.overdue(2) {
                        let prefix = merge.prefix(lane).clone();
                        merge.snapshots.insert(lane, prefix.blocks());
                        self.durable[job].snapshots.insert(lane, prefix);
                        if self.random.percent(2) {
                            return self.crash();
                        }
                    }
                }
                Next::Look => {
                    merge.checkpoints += 1;
                    let looks = merge.checkpoints;
                    self.check_level(job, &merge);
                    self.durable[job].looks = self.durable[job].looks.max(looks);
                    if self.random.percent(5) {
                        return self.crash();
                    }
                    if looks >= self.enough[job] || merge.is_complete() {
                        self.check_picture(job, &merge, looks);
                        if self.random.percent(20) {
                            return self.crash();
                        }
                        return self.end(job, Ended::Done { looks });
                    }
                    self.book.reach(&job_id(job), looks);
                }
                Next::Wait => break,
            }
        }
        self.merges[job] = Some(merge);
    }

    fn end(&mut self, job: usize, how: Ended) {
        self.durable[job].ended = Some(how);
        self.book.remove(&job_id(job));
        self.leases.retain(|_, held| held.job != job);
        self.merges[job] = None;
    }

    /// At a look all lanes are equally far.
    fn check_level(&self, job: usize, merge: &Merge) {
        let blocks = |lane| merge.prefix(lane).blocks();
        let mut all = lanes(&self.schedules[job]).map(blocks);
        let first = all.next().unwrap();
        assert!(all.all(|others| others == first), "a look at lanes that are not level");
        let points = self.schedules[job].checkpoints();
        assert_eq!(first as usize, points[merge.checkpoints as usize - 1], "a look at another time");
    }

    /// The sums are those of every block once, added in order, as far as this look.
    fn check_picture(&self, job: usize, merge: &Merge, looks: u32) {
        let schedule = &self.schedules[job];
        assert_eq!(looks.min(self.enough[job]), looks, "the job went on though its error was small enough");
        let blocks = schedule.checkpoints()[looks as usize - 1] as u32;
        for lane in lanes(schedule) {
            let mut expected = Prefix::empty(schedule.regions()[0], lane.replicate, 1);
            for block in 0..blocks {
                expected.append(&sum(schedule, job, lane.at(block))).unwrap();
            }
            assert_eq!(*merge.prefix(lane), expected, "a block is lost, or counts twice");
        }
    }

    /// The store's `claim`.
    fn claim(&mut self, job: usize, batch: BatchKey, worker: u64, lease: &LeaseId) -> bool {
        let durable = &mut self.durable[job];
        if durable.ended.is_some() || durable.paused {
            return false;
        }
        if !durable.returned.remove(&batch) {
            let next = durable.cursors.get_mut(&batch.lane()).unwrap();
            if *next != batch.block {
                return false;
            }
            *next += 1;
        }
        let twice = self.leases.values().any(|held| held.job == job && held.batch == batch);
        assert!(!twice && !durable.commits.contains_key(&batch), "a batch is handed out twice");
        let held = Held { job, batch, worker, ends: self.now + LEASE };
        self.leases.insert(lease.to_string(), held);
        true
    }

    /// The store's `release` and `expire`.
    fn take_back(&mut self, lease: &LeaseId) {
        let Some(held) = self.leases.remove(lease.as_str()) else { return self.book.forget(lease) };
        self.durable[held.job].returned.insert(held.batch);
        let (job, batch) = (job_id(held.job), held.batch);
        if self.random.percent(1) {
            return self.crash();
        }
        self.book.take_back(&LeaseRow { id: lease.clone(), job, batch, worker: worker_id(held.worker) });
    }

    /// The server's part of a beat: `None` where it died over it.
    fn exchange(&mut self, worker: u64, said: &Exchange) -> Vec<(LeaseId, usize, BatchKey)> {
        let id = worker_id(worker);
        for progress in &said.holding {
            if let Some(held) =
                self.leases.get_mut(progress.lease.as_str()).filter(|held| held.worker == worker)
            {
                held.ends = self.now + LEASE;
            }
        }
        for lease in self.book.unheard(&id, said) {
            self.take_back(&lease);
        }
        let join = join();
        let asker =
            Asker { id: &id, join: &join, scenes: &[], wants: said.wants, active: 4, beat: said.beat };
        let offers = self.book.offer(&asker, 8);
        let mut claimed = Vec::new();
        for offer in offers {
            self.count += 1;
            let lease: LeaseId = format!("l{}", self.count).parse().unwrap();
            let job = (0..self.durable.len()).find(|job| job_id(*job) == offer.job).unwrap();
            if self.claim(job, offer.batch, worker, &lease) {
                claimed.push((lease, job, offer.batch));
            } else {
                self.book.withdraw(offer);
            }
        }
        if self.random.percent(1) {
            self.crash();
            return Vec::new();
        }
        for (lease, job, batch) in &claimed {
            let row = LeaseRow { id: lease.clone(), job: job_id(*job), batch: *batch, worker: id.clone() };
            self.book.hold(row, None, said.beat);
        }
        claimed
    }

    fn beat(&mut self, worker: u64) {
        let Some(state) = self.workers.get_mut(&worker).filter(|worker| worker.alive) else { return };
        if state.silent_until > self.now {
            let wait = state.silent_until - self.now;
            return self.after(wait, Event::Beat(worker));
        }
        state.beats += 1;
        let holding = state.desk.iter().map(|(lease, ..)| LeaseProgress { lease: lease.clone(), done: 0.0 });
        let holding: Vec<LeaseProgress> = holding.collect();
        let wants = 2_u32.saturating_sub(holding.len() as u32);
        let said = Exchange { holding, wants, beat: state.beats, ..Exchange::default() };
        let line = self.random.below(100);
        if line < 5 {
            // Lost on its way there.
            return self.after(BEAT, Event::Beat(worker));
        }
        if line < 8 {
            // Comes twice.
            self.exchange(worker, &said);
        }
        let heard = self.exchange(worker, &said);
        if line < 95 {
            for (lease, job, batch) in heard {
                let time = 20 + self.random.below(300);
                let ready = self.now + time;
                let bring = Event::Bring { worker, lease: lease.to_string(), job, batch };
                self.workers.get_mut(&worker).unwrap().desk.push((lease, job, batch, ready));
                self.after(time, bring);
            }
        }
        self.after(BEAT, Event::Beat(worker));
    }

    /// The store's `commit`, and what follows from it.
    fn bring(&mut self, worker: u64, lease: &str, job: usize, batch: BatchKey) {
        let Some(state) = self.workers.get_mut(&worker).filter(|worker| worker.alive) else { return };
        if state.silent_until > self.now {
            let wait = state.silent_until - self.now + 10;
            return self.after(wait, Event::Bring { worker, lease: lease.to_owned(), job, batch });
        }
        if self.random.percent(8) {
            // Lost on its way there: it is brought again.
            return self.after(50, Event::Bring { worker, lease: lease.to_owned(), job, batch });
        }
        let durable = &mut self.durable[job];
        let row = CommitRow { batch, hash: hash(), worker_micros: 1 };
        let first = durable.ended.is_none() && !durable.commits.contains_key(&batch);
        if first {
            durable.commits.insert(batch, row.clone());
            durable.returned.remove(&batch);
            self.leases.retain(|_, held| held.job != job || held.batch != batch);
            if self.random.percent(2) {
                self.crash();
                return self.after(50, Event::Bring { worker, lease: lease.to_owned(), job, batch });
            }
            self.book.brought(&job_id(job), batch);
            if let Some(merge) = &mut self.merges[job] {
                merge.add(Arrival { row, sum: None });
            }
            self.pump(job);
        }
        if self.random.percent(8) {
            // The answer is lost: it is brought again.
            return self.after(50, Event::Bring { worker, lease: lease.to_owned(), job, batch });
        }
        if let Some(state) = self.workers.get_mut(&worker) {
            state.desk.retain(|(held, ..)| held.as_str() != lease);
        }
    }

    fn tick(&mut self) {
        let now = self.now;
        let ended: Vec<LeaseId> = self
            .leases
            .iter()
            .filter(|(_, held)| held.ends <= now)
            .map(|(id, _)| id.parse().unwrap())
            .collect();
        for lease in ended {
            self.take_back(&lease);
        }
        self.after(TICK, Event::Tick);
    }

    fn fault(&mut self) {
        self.faults += 1;
        let worker = self.random.below(self.workers.len() as u64);
        let job = self.random.below(self.durable.len() as u64) as usize;
        match self.random.below(20) {
            0..6 => {
                // Another comes instead, under a name of its own.
                self.workers.get_mut(&worker).unwrap().alive = false;
                let next = self.workers.len() as u64;
                self.start_worker(next);
            }
            6..10 => {
                let time = self.random.below(3 * LEASE);
                self.workers.get_mut(&worker).unwrap().silent_until = self.now + time;
            }
            10..14 => self.crash(),
            14 if self.durable[job].ended.is_none() && self.random.percent(20) => {
                self.end(job, Ended::Cancelled);
            }
            15..20 if self.durable[job].ended.is_none() => {
                let paused = !self.durable[job].paused;
                self.durable[job].paused = paused;
                if let Some(entry) = self.book.job(&job_id(job)) {
                    entry.hand_out = if paused { HandOut::Paused } else { HandOut::Yes };
                }
            }
            _ => {}
        }
        // Later on there is peace, and nothing stays paused.
        if self.now < 20_000 {
            let time = 50 + self.random.below(800);
            self.after(time, Event::Fault);
        } else {
            self.durable.iter_mut().for_each(|durable| durable.paused = false);
            self.start_server();
        }
    }

    fn run(&mut self) {
        while self.durable.iter().any(|durable| durable.ended.is_none()) {
            let Reverse((time, _, event)) = self.events.pop().expect("somebody always beats");
            assert!(time < LONGEST, "a job never ends");
            self.now = time;
            match event {
                Event::Beat(worker) => self.beat(worker),
                Event::Bring { worker, lease, job, batch } => self.bring(worker, &lease, job, batch),
                Event::Tick => self.tick(),
                Event::Fault => self.fault(),
            }
        }
    }
}

#[test]
fn no_schedule_of_faults_loses_a_block_or_counts_one_twice() {
    let schedules = std::env::var("OVTIGRE_SIMULATIONS").map_or(SCHEDULES, |n| n.parse().unwrap());
    let (mut crashes, mut faults, mut early, mut cancelled) = (0, 0, 0, 0);
    let begun = std::time::Instant::now();
    for seed in 0..schedules {
        let mut world = World::new(seed);
        let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| world.run()));
        assert!(done.is_ok(), "with seed {seed}, after {} ms", world.now);
        for (job, durable) in world.durable.iter().enumerate() {
            match durable.ended {
                Some(Ended::Cancelled) => cancelled += 1,
                Some(Ended::Done { looks }) => {
                    let all = world.schedules[job].checkpoints().len() as u32;
                    assert_eq!(looks, world.enough[job].min(all), "seed {seed}");
                    early += u32::from(looks < all);
                }
                None => unreachable!("it ran to the end"),
            }
        }
        crashes += world.crashes;
        faults += world.faults;
    }
    eprintln!("{schedules} schedules in {:?}: {crashes} crashes, {faults} other faults", begun.elapsed());
    assert!(crashes > schedules && faults > schedules && early > 0 && cancelled > 0, "too calm");
}

#[test]
fn a_schedule_follows_from_its_seed() {
    let end = |seed| {
        let mut world = World::new(seed);
        world.run();
        (world.now, world.count, world.crashes)
    };
    assert_eq!(end(5), end(5));
}

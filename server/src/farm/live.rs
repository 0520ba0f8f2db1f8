//! A job that is not over, in memory.

use super::{allocation::Decision, append::Merge, spec::JobSpec};
use crate::store::row::{BatchKey, CommitRow, JobRow, Mandate, Progress};
use bytes::Bytes;
use ovtigre_core::film::{allocation::Allocations, schedule::Schedule, sum::Sum};
use ovtigre_proto::{
    curve::{CurveRow, LayerError},
    id::{BlobId, JobId},
    status::JobState,
};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::{Notify, watch};

/// A batch that was brought, and its sum where it is still in memory.
#[derive(Debug)]
pub struct Arrival {
    /// Which, and its hash.
    pub row: CommitRow,
    /// Its sum, decoded.
    pub sum: Option<Sum>,
}

/// How a job is to end.
#[derive(Clone, Debug, PartialEq)]
pub struct Ending {
    /// The state it ends in.
    pub state: JobState,
    /// Why.
    pub reason: Option<String>,
    /// Whether the error target was reached.
    pub certified: bool,
    /// Whether the end waits for a first whole picture.
    pub waits: Waits,
}

/// Whether an end waits for a first whole picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Waits {
    /// It does.
    ForPicture,
    /// What is there is kept; nothing where there is nothing.
    Not,
}

/// What is known of a job's picture without touching its sums.
#[derive(Clone, Debug, Default)]
pub struct View {
    /// What is in it.
    pub progress: Progress,
    /// The set of batches in it, where each pixel has a sample.
    pub manifest: Option<String>,
    /// Checkpoints taken.
    pub curve: Vec<CurveRow>,
    /// The layers at the latest of them.
    pub layers: Vec<LayerError>,
}

/// A picture's file that was made last.
#[derive(Clone, Debug)]
pub struct Made {
    /// The set of batches in it.
    pub manifest: String,
    /// The EXR.
    pub bytes: Bytes,
}

/// A job that is not over, or not settled.
#[derive(Debug)]
pub struct Live {
    /// Its name.
    pub id: JobId,
    /// Its scene.
    pub scene: BlobId,
    /// What it is.
    pub spec: JobSpec,
    /// Its batches.
    pub schedule: Arc<Schedule>,
    /// Hash of all that a sum depends on beside its batch.
    pub identity: blake3::Hash,
    /// Its sums; `None` until they are needed.
    pub merge: Arc<tokio::sync::Mutex<Option<Merge>>>,
    /// Set when there is something to append or to end.
    pub kick: Notify,
    /// Counted up when something can be seen to have changed.
    pub changes: watch::Sender<u64>,
    inbox: Mutex<Vec<Arrival>>,
    view: Mutex<View>,
    ending: Mutex<Option<Ending>>,
    made: Mutex<Option<Made>>,
    others: Mutex<Others>,
    allocations: Mutex<Option<Arc<Allocations>>>,
}

/// What this server knows of the others' part in a job.
#[derive(Debug, Default)]
struct Others {
    /// The right to append to its sums, where this server has it.
    mandate: Option<Mandate>,
    /// Whether another server had it when this one asked last.
    elsewhere: bool,
    /// Batches brought that were taken up.
    brought: u64,
    /// Its version when it was looked at last.
    version: u64,
    /// What the others were told.
    told: Option<Progress>,
    /// Batches and checkpoints of what lists go by.
    outlook: Option<(u64, usize)>,
}

impl Live {
    /// Of a job in the store.
    pub fn new(row: &JobRow, spec: JobSpec, curve: Vec<CurveRow>, layers: Vec<LayerError>) -> Self {
        Self {
            id: row.id.clone(),
            scene: row.scene.clone(),
            schedule: Arc::new(spec.schedule()),
            identity: spec.identity(&row.scene),
            spec,
            merge: Arc::default(),
            kick: Notify::new(),
            changes: watch::Sender::new(0),
            inbox: Mutex::default(),
            view: Mutex::new(View { progress: row.progress, manifest: None, curve, layers }),
            ending: Mutex::default(),
            made: Mutex::default(),
            others: Mutex::new(Others { version: row.version, ..Others::default() }),
            allocations: Mutex::default(),
        }
    }

    /// What is known of its allocations; `None` where all pixels have the same number of samples.
    pub fn decision(&self) -> Option<Decision> {
        let after = self.spec.decided_after?;
        Some(Decision { after, allocations: held(&self.allocations).clone() })
    }

    /// How its samples are allocated was decided.
    pub fn set_allocations(&self, allocations: Arc<Allocations>) {
        *held(&self.allocations) = Some(allocations);
    }

    /// A batch was brought.
    pub fn arrive(&self, arrival: Arrival) {
        held(&self.inbox).push(arrival);
        self.kick.notify_one();
    }

    /// What was brought since the last call.
    pub fn arrivals(&self) -> Vec<Arrival> {
        std::mem::take(&mut *held(&self.inbox))
    }

    /// Bytes of sums that wait in memory.
    pub fn fresh_bytes(&self) -> u64 {
        let inbox = held(&self.inbox);
        inbox.iter().filter_map(|a| a.sum.as_ref()).map(sum_bytes).sum()
    }

    /// What is known of the picture.
    pub fn view(&self) -> View {
        held(&self.view).clone()
    }

    /// Changes what is known of the picture.
    pub fn set_view(&self, change: impl FnOnce(&mut View)) {
        change(&mut held(&self.view));
        self.changed();
    }

    /// Something can be seen to have changed.
    pub fn changed(&self) {
        self.changes.send_modify(|n| *n += 1);
    }

    /// Asks the job to end; the first such wish stands, unless the new one does not wait.
    pub fn end(&self, ending: Ending) {
        let mut wish = held(&self.ending);
        if wish.as_ref().is_none_or(|w| w.waits == Waits::ForPicture && ending.waits == Waits::Not) {
            *wish = Some(ending);
        }
        self.kick.notify_one();
    }

    /// Asks the job to end where it has run for as long as it may.
    pub fn end_in_time(&self, run_seconds: f64) {
        if self.spec.seconds.is_some_and(|most| run_seconds >= most) {
            self.end(Ending {
                state: JobState::Done,
                reason: Some("the time was over".to_owned()),
                certified: false,
                waits: Waits::ForPicture,
            });
        }
    }

    /// How it is to end, where that was asked for.
    pub fn ending(&self) -> Option<Ending> {
        held(&self.ending).clone()
    }

    /// The picture's file that was made last.
    pub fn made(&self) -> Option<Made> {
        held(&self.made).clone()
    }

    /// Keeps a picture's file.
    pub fn set_made(&self, made: Made) {
        *held(&self.made) = Some(made);
    }

    /// The right to append to its sums, where this server has it.
    pub fn mandate(&self) -> Option<Mandate> {
        held(&self.others).mandate
    }

    /// This server has the right to append to its sums, or not any more.
    pub fn set_mandate(&self, mandate: Option<Mandate>) {
        held(&self.others).mandate = mandate;
    }

    /// Whether another server appends, as far as is known.
    pub fn is_elsewhere(&self) -> bool {
        held(&self.others).elsewhere
    }

    /// Another server appends, or none.
    pub fn set_elsewhere(&self, elsewhere: bool) {
        held(&self.others).elsewhere = elsewhere;
    }

    /// Batches brought that were taken up, in the order of coming.
    pub fn brought(&self) -> u64 {
        held(&self.others).brought
    }

    /// So many were taken up.
    pub fn set_brought(&self, brought: u64) {
        held(&self.others).brought = brought;
    }

    /// Whether `version` is new since the last call.
    pub fn note_version(&self, version: u64) -> bool {
        std::mem::replace(&mut held(&self.others).version, version) != version
    }

    /// Whether `progress` is new to the other servers since the last call.
    pub fn note_told(&self, progress: Progress) -> bool {
        held(&self.others).told.replace(progress) != Some(progress)
    }

    /// Batches and checkpoints by which lists go, where this server has said how far it is.
    pub fn outlook(&self) -> Option<(u64, usize)> {
        held(&self.others).outlook
    }

    /// Lists go by so many batches and checkpoints.
    pub fn set_outlook(&self, stage: (u64, usize)) {
        held(&self.others).outlook = Some(stage);
    }

    /// The batch at `key`, where the schedule has it.
    pub fn batch(&self, key: BatchKey) -> Option<ovtigre_core::film::batch::Batch> {
        self.schedule.batch(key.region as usize, key.replicate, key.block as usize)
    }
}

/// Bytes of a decoded sum.
pub fn sum_bytes(sum: &Sum) -> u64 {
    sum.planes.iter().map(|plane| plane.len() as u64 * 12).sum()
}

/// The guard of a mutex. What it guards is replaced whole or counted up: no panic leaves it torn.
pub fn held<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

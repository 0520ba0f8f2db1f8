//! Rules, no HTTP: submit, split, lease, commit, append, checkpoint, stop, reap.

pub mod allocation;
pub mod append;
pub mod audit;
pub mod book;
pub mod check;
pub mod checkpoint;
mod choice;
pub mod commit;
pub mod control;
pub mod counters;
pub mod crew;
pub mod curve;
pub mod error;
pub mod extend;
pub mod ids;
pub mod join;
pub mod keep;
pub mod lease;
mod light_groups;
pub mod live;
pub mod mandates;
pub mod needs;
pub mod notices;
mod numbers;
pub mod open;
pub mod others;
mod outlook;
pub mod parts;
pub mod paths;
pub mod picture;
pub mod pixel;
pub mod reach;
pub mod reap;
pub mod rules;
pub mod scene;
mod sketches;
pub mod solution;
mod source;
pub mod space;
pub mod spec;
pub mod split;
pub mod status;
pub mod stop;
mod strip;
pub mod submit;
mod sweep;
mod unused;

#[cfg(test)]
pub(crate) mod tests;

use crate::{
    blobs::Blobs,
    store::{Store, row::JobRow},
    webhook::Messenger,
};
use book::Book;
use counters::Counters;
use crew::Crew;
use error::{FarmError, Result};
use ids::Ids;
use live::{Live, held};
use ovtigre_proto::{id::JobId, telemetry::traces::Traces};
use rules::Rules;
use scene::Inspect;
use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard},
};
use tokio_util::{sync::CancellationToken, task::TaskTracker};

/// A farm: its memory, its files, and the jobs that are not over.
#[derive(Debug)]
pub struct Farm {
    /// Its memory.
    pub store: Arc<dyn Store>,
    /// Its files.
    pub blobs: Blobs,
    /// Its numbers.
    pub rules: Rules,
    /// What it counts.
    pub counters: Counters,
    /// Where spans go.
    pub traces: Traces,
    /// Cancelled when it stops.
    pub stopping: CancellationToken,
    /// Its name among the servers over the same store.
    name: String,
    inspect: Inspect,
    ids: Ids,
    fullness: space::Fullness,
    shown: picture::Shown,
    sketches: sketches::Sketches,
    tasks: TaskTracker,
    decoders: tokio::sync::Semaphore,
    inspectors: tokio::sync::Semaphore,
    messenger: Messenger,
    book: Mutex<Book>,
    crew: Mutex<Crew>,
    lives: Mutex<BTreeMap<JobId, Arc<Live>>>,
}

impl Farm {
    fn book(&self) -> MutexGuard<'_, Book> {
        held(&self.book)
    }

    fn crew(&self) -> MutexGuard<'_, Crew> {
        held(&self.crew)
    }

    /// A job that is not over, or not settled.
    pub fn live(&self, id: &JobId) -> Option<Arc<Live>> {
        held(&self.lives).get(id).cloned()
    }

    fn lives(&self) -> Vec<Arc<Live>> {
        held(&self.lives).values().cloned().collect()
    }

    fn forget_live(&self, id: &JobId) {
        if let Some(live) = held(&self.lives).remove(id) {
            live.changed();
            // Ends the task that appends to it.
            live.kick.notify_one();
        }
    }

    /// A job in the store.
    pub async fn job_row(&self, id: &JobId) -> Result<JobRow> {
        self.store.job(id).await?.ok_or_else(|| FarmError::not_found("job", id))
    }
}

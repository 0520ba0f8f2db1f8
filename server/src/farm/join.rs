//! Workers join.

use super::{
    Farm,
    crew::Member,
    error::{FarmError, Result, fault},
    submit::{TAGS_MAX, bad_text},
};
use ovtigre_proto::{
    lease::{WorkerJoin, WorkerJoined},
    problem::Fault,
    status::WorkerState,
};
use std::{sync::Arc, time::Instant};

/// Threads of a worker, at most.
const THREADS_MAX: u32 = 4096;

impl Farm {
    /// A worker joins. Its version has to be the farm's, or that of a job that is not over: sums of another
    /// version have other bits.
    pub async fn join(&self, join: WorkerJoin) -> Result<WorkerJoined> {
        let faults = faults(&join);
        if !faults.is_empty() {
            return Err(FarmError::Worker(faults));
        }
        if join.build != self.rules.build && !self.book().has_build(&join.build) {
            let detail = format!(
                "this farm is ovtigre {} and has no job of {}: use a worker of the same version",
                self.rules.build, join.build
            );
            return Err(FarmError::Worker(vec![fault("/build", detail)]));
        }
        let id = self.ids.worker();
        self.store.add_worker(&id, join.clone()).await?;
        tracing::info!(worker = %id, name = join.name, threads = join.threads, "worker joined");
        self.crew().set(&id, Member::new(Arc::new(join), WorkerState::Active, Instant::now()));
        Ok(WorkerJoined { id, interval_seconds: self.interval() })
    }
}

fn faults(join: &WorkerJoin) -> Vec<Fault> {
    let texts = [("/name", &join.name), ("/build", &join.build), ("/instruction_set", &join.instruction_set)];
    let mut faults: Vec<Fault> = (texts.into_iter())
        .filter_map(|(pointer, text)| bad_text(text).map(|detail| fault(pointer, detail)))
        .collect();
    if !(1..=THREADS_MAX).contains(&join.threads) {
        faults.push(fault("/threads", format!("threads are 1 to {THREADS_MAX}")));
    }
    if join.tags.len() > TAGS_MAX {
        faults.push(fault("/tags", format!("there are more than {TAGS_MAX} tags")));
    }
    for (i, tag) in join.tags.iter().enumerate() {
        faults.extend(bad_text(tag).map(|detail| fault(format!("/tags/{i}"), detail)));
    }
    faults
}

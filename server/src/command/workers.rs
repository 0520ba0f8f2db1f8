//! `ovtigre workers`: who works.

use super::{exit::Outcome, farm_flags::FarmFlags, table, terminal};
use clap::Args;
use ovtigre_proto::status::{WorkerState, WorkerStatus};

/// Workers that are listed.
const WORKERS_MAX: usize = 10_000;

/// Show who works.
#[derive(Args, Debug)]
pub(crate) struct Workers {
    #[command(flatten)]
    farm: FarmFlags,
}

impl Workers {
    /// Shows.
    pub(crate) async fn run(self) -> Outcome {
        let workers = self.farm.client()?.workers().all(WORKERS_MAX).await?;
        if self.farm.json {
            terminal::json(&workers);
            return Ok(());
        }
        let rows: Vec<_> = workers.iter().map(row).collect();
        table::print(
            ["WORKER", "NAME", "STATE", "THREADS", "JOB", "BATCHES", "FAILURES", "MRAY/S", "KIND"],
            &rows,
        );
        Ok(())
    }
}

fn row(worker: &WorkerStatus) -> [String; 9] {
    let state = match worker.state {
        WorkerState::Active => "active",
        WorkerState::Draining => "draining",
        WorkerState::Lost => "lost",
        WorkerState::Gone => "gone",
        WorkerState::Aside => "aside",
    };
    [
        worker.id.to_string(),
        worker.name.clone(),
        state.to_owned(),
        worker.threads.to_string(),
        worker.job.as_ref().map(ToString::to_string).unwrap_or_default(),
        worker.batches_done.to_string(),
        worker.failures.to_string(),
        format!("{:.1}", worker.rays_per_second * 1e-6),
        format!("{} {}", worker.instruction_set, worker.build),
    ]
}

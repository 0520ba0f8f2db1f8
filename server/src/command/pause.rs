//! `ovtigre pause`: hand out no more batches of a job until it is resumed.

use super::{exit::Outcome, farm_flags::FarmFlags, progress, terminal};
use clap::Args;
use ovtigre_proto::{id::JobId, job::JobPatch, status::JobState};

/// Hand out no more batches of a job until it is resumed.
#[derive(Args, Debug)]
pub(crate) struct Pause {
    /// Job to pause.
    #[arg(value_name = "JOB")]
    job: JobId,
    #[command(flatten)]
    farm: FarmFlags,
}

impl Pause {
    /// Pauses.
    pub(crate) async fn run(self) -> Outcome {
        let patch = JobPatch { state: Some(JobState::Paused), ..JobPatch::default() };
        let status = self.farm.client()?.change(&self.job, &patch).await?;
        if self.farm.json {
            terminal::json(&status);
        } else {
            terminal::result(&progress::line(&status));
        }
        Ok(())
    }
}

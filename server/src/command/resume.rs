//! `ovtigre resume`: go on with a paused job.

use super::{exit::Outcome, farm_flags::FarmFlags, progress, terminal};
use clap::Args;
use ovtigre_proto::{id::JobId, job::JobPatch, status::JobState};

/// Go on with a paused job.
#[derive(Args, Debug)]
pub(crate) struct Resume {
    /// Job to resume.
    #[arg(value_name = "JOB")]
    job: JobId,
    #[command(flatten)]
    farm: FarmFlags,
}

impl Resume {
    /// Resumes.
    pub(crate) async fn run(self) -> Outcome {
        let patch = JobPatch { state: Some(JobState::Running), ..JobPatch::default() };
        let status = self.farm.client()?.change(&self.job, &patch).await?;
        if self.farm.json {
            terminal::json(&status);
        } else {
            terminal::result(&progress::line(&status));
        }
        Ok(())
    }
}

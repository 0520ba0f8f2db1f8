//! `ovtigre cancel`: stops a job.

use super::{exit::Outcome, farm_flags::FarmFlags, progress, terminal};
use clap::Args;
use ovtigre_proto::id::JobId;

/// Stop a job; its picture so far is kept.
#[derive(Args, Debug)]
pub(crate) struct Cancel {
    /// Job to stop.
    #[arg(value_name = "JOB")]
    job: JobId,
    #[command(flatten)]
    farm: FarmFlags,
}

impl Cancel {
    /// Stops it.
    pub(crate) async fn run(self) -> Outcome {
        let status = self.farm.client()?.cancel(&self.job).await?;
        if self.farm.json {
            terminal::json(&status);
        } else {
            terminal::result(&progress::line(&status));
        }
        Ok(())
    }
}

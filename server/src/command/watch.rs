//! `ovtigre watch`: a job until it is over.

use super::{
    exit::{CommandError, Outcome},
    farm_flags::FarmFlags,
    follow::until_interrupted,
    interrupt::Interrupt,
    progress::{self, Others, Progress},
    terminal,
};
use clap::Args;
use ovtigre_proto::{
    id::JobId,
    status::{JobEvent, JobState},
};

/// Follow a job until it is over.
#[derive(Args, Debug)]
pub(crate) struct Watch {
    /// Job to follow.
    #[arg(value_name = "JOB")]
    job: JobId,
    #[command(flatten)]
    farm: FarmFlags,
}

impl Watch {
    /// Follows; with `--json` each event is a line.
    pub(crate) async fn run(self) -> Outcome {
        let client = self.farm.client()?;
        let interrupt = Interrupt::listen();
        let status = if self.farm.json {
            let show = |event: &JobEvent| {
                terminal::result(&serde_json::to_string(event).expect("an event is plain data"));
            };
            until_interrupted(&client, &self.job, &interrupt, show).await?
        } else {
            let mut shown = Progress::new(Others::None);
            let show = |event: &JobEvent| {
                if let JobEvent::Status(status) = event {
                    shown.show(status);
                }
            };
            let status = until_interrupted(&client, &self.job, &interrupt, show).await?;
            drop(shown);
            terminal::result(&progress::line(&status));
            status
        };
        match status.state {
            JobState::Failed => {
                Err(CommandError::failed(status.reason.unwrap_or_else(|| "the job failed".to_owned())))
            }
            JobState::Cancelled => Err(CommandError::stopped("the job was cancelled")),
            _ => Ok(()),
        }
    }
}

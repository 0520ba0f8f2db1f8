//! `ovtigre work`: a worker.

use super::exit::{CommandError, Outcome};
use clap::Args;
use ovtigre_proto::{client::error::ClientError, telemetry::traces::Traces};
use ovtigre_worker::{
    flags::WorkFlags,
    leave::Bell,
    log::LogFlags,
    run::{WorkerError, run},
};

/// Work for a farm until told to leave.
#[derive(Args, Debug)]
pub(crate) struct Work {
    #[command(flatten)]
    work: WorkFlags,
    #[command(flatten)]
    log: LogFlags,
}

impl Work {
    /// Works.
    pub(crate) async fn run(self) -> Outcome {
        self.log.start();
        let traces = Traces::from_environment("ovtigre-worker")?;
        let bell = Bell::default();
        tokio::spawn(bell.clone().ring_on_signals(self.work.first_signal()));
        if self.work.until_stdin_closes {
            tokio::spawn(bell.clone().ring_when_stdin_closes());
        }
        let config = self.work.config(u64::from(std::process::id()), traces);
        run(config, bell).await.map_err(|error| match error {
            WorkerError::Refused(error @ ClientError::Unexpected { .. }) => error.into(),
            other => CommandError::wrong(other.to_string()),
        })
    }
}

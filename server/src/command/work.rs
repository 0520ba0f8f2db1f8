//! `ovtigre work`: a worker.

use super::{
    exit::{CommandError, Outcome},
    terminal,
};
use clap::Args;
use ovtigre_proto::client::error::ClientError;
use ovtigre_worker::{
    flags::WorkFlags,
    leave::Bell,
    run::{WorkerError, run},
};

/// Work for a farm until told to leave.
#[derive(Args, Debug)]
pub(crate) struct Work {
    #[command(flatten)]
    work: WorkFlags,
    /// What is logged to stderr: error, warn, info, debug or trace, also for one part such as `ovtigre_worker=debug`.
    #[arg(long, value_name = "FILTER", default_value = "info")]
    log: String,
}

impl Work {
    /// Works.
    pub(crate) async fn run(self) -> Outcome {
        terminal::log(&self.log);
        let bell = Bell::default();
        tokio::spawn(bell.clone().ring_on_signals(self.work.first_signal()));
        if self.work.until_stdin_closes {
            tokio::spawn(bell.clone().ring_when_stdin_closes());
        }
        let config = self.work.config(u64::from(std::process::id()));
        run(config, bell).await.map_err(|error| match error {
            WorkerError::Refused(error @ ClientError::Unexpected { .. }) => error.into(),
            other => CommandError::wrong(other.to_string()),
        })
    }
}

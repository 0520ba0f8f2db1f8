//! `ovtigre render`: the main job in one line.

use super::{
    embedded::{Embedded, Plan},
    exit::{CommandError, Outcome},
    farm_flags,
    follow::{Workers, until_over},
    interrupt::Interrupt,
    job_flags::JobFlags,
    local_workers::WorkerLog,
    progress::{Others, Progress},
    submission::Submission,
};
use clap::Args;
use ovtigre_proto::client::farm::Client;
use ovtigre_worker::log::{LogFlags, LogFormat};
use std::{num::NonZeroUsize, path::PathBuf};

/// Render a scene.
#[derive(Args, Debug)]
pub(crate) struct Render {
    /// Scene to render: .glb, or .gltf with its files beside it.
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    #[command(flatten)]
    job: JobFlags,
    /// Worker processes of the farm that is started.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1024))]
    workers: u32,
    /// Threads of each worker process [default: the cores shared out].
    #[arg(long, value_name = "N", value_parser = ovtigre_worker::flags::threads)]
    threads: Option<NonZeroUsize>,
    /// Folder in which the farm keeps its memory [default: a temporary one].
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Render on this farm instead of starting one.
    #[arg(long, value_name = "URL", conflicts_with_all = ["workers", "threads", "data"])]
    server: Option<String>,
    /// Token that this farm knows [default: `OVTIGRE_TOKEN` of the environment].
    #[arg(long, value_name = "TOKEN", requires = "server")]
    token: Option<String>,
    /// Show the log of farm and workers instead of a bar.
    #[arg(short, long)]
    verbose: bool,
}

impl Render {
    /// Renders.
    pub(crate) async fn run(self) -> Outcome {
        let filter = if self.verbose { "info" } else { "error" };
        let log = LogFlags { filter: filter.to_owned(), format: LogFormat::Text };
        log.start();
        let interrupt = Interrupt::listen();
        let mut submission = Submission::read(&self.scene, self.job).await?;
        let others = if self.verbose { Others::Log } else { Others::None };
        if let Some(server) = &self.server {
            let client = farm_flags::client(server, self.token.as_deref())?;
            return carry_out(&client, &mut submission, others, &interrupt, Workers::Theirs).await;
        }
        let plan = Plan {
            workers: self.workers,
            threads: self.threads,
            data: self.data,
            log: if self.verbose { WorkerLog::Shown(log) } else { WorkerLog::Kept },
        };
        let farm = Embedded::start(plan).await?;
        let client = farm_flags::client(&farm.address(), None)?;
        let workers = Workers::Ours(&farm.workers);
        let outcome = carry_out(&client, &mut submission, others, &interrupt, workers).await;
        tokio::select! {
            () = farm.stop() => {}
            () = interrupt.twice() => {}
        }
        outcome
    }
}

async fn carry_out(
    client: &Client,
    submission: &mut Submission,
    others: Others,
    interrupt: &Interrupt,
    workers: Workers<'_>,
) -> Outcome {
    let job = tokio::select! {
        job = submission.submit(client) => job?,
        () = interrupt.once() => return Err(CommandError::stopped("stopped before the job was submitted")),
    };
    let mut truth = submission.truth.take();
    let mut progress = Progress::new(others);
    progress.show(&job);
    let status = until_over(client, &job.id, &mut progress, interrupt, &workers, truth.as_mut()).await?;
    drop(progress);
    workers.dismiss();
    tokio::select! {
        collected = submission.collect(client, &status, truth.as_ref()) => collected,
        () = interrupt.twice() => Err(CommandError::stopped("left before the picture was written")),
    }
}

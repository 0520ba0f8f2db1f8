//! A farm of one's own, for one command.

use super::{
    exit::{CommandError, Outcome},
    local_workers::{LocalWorkers, Team, WorkerLog},
};
use ovtigre::{
    farm::rules::Rules,
    serve::{ServeConfig, Serving, start},
};
use ovtigre_proto::telemetry::traces::Traces;
use std::{
    net::{Ipv4Addr, SocketAddr},
    num::NonZeroUsize,
    path::PathBuf,
    thread::available_parallelism,
};
use tempfile::TempDir;

/// What the farm is made of.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    /// Worker processes, at least 1.
    pub(crate) workers: u32,
    /// Threads of each; the cores shared out where `None`.
    pub(crate) threads: Option<NonZeroUsize>,
    /// Where it keeps its memory; a folder that goes with it where `None`.
    pub(crate) data: Option<PathBuf>,
    /// What becomes of what workers write to standard error.
    pub(crate) log: WorkerLog,
}

/// A farm that listens on a free loopback port, and its workers.
#[derive(Debug)]
pub(crate) struct Embedded {
    pub(crate) workers: LocalWorkers,
    serving: Serving,
    _folder: Option<TempDir>,
}

impl Embedded {
    /// Starts it.
    pub(crate) async fn start(plan: Plan) -> Outcome<Self> {
        let mut folder = None;
        let data = if let Some(data) = plan.data {
            data
        } else {
            let made = tempfile::Builder::new().prefix("ovtigre-").tempdir();
            let made =
                made.map_err(|e| CommandError::wrong(format!("cannot make a temporary folder: {e}")))?;
            folder.insert(made).path().to_owned()
        };
        // A folder that goes with the farm keeps no sums for more samples.
        let kept_sums_bytes = if folder.is_some() { 0 } else { Rules::default().kept_sums_bytes };
        let cache = data.join("worker-scenes");
        let listen = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        let rules = Rules { kept_sums_bytes, ..Rules::default() };
        let traces = Traces::from_environment("ovtigre-server")?;
        let config = ServeConfig { rules, traces, ..ServeConfig::new(listen, data) };
        let serving = start(config).await.map_err(|e| CommandError::wrong(e.to_string()))?;
        let threads = plan.threads.map_or_else(|| share_of_cores(plan.workers), NonZeroUsize::get);
        let farm = serving.address;
        let team = Team { token: None, count: plan.workers, threads, farm, cache, log: plan.log };
        let workers = LocalWorkers::start(&team)?;
        Ok(Self { workers, serving, _folder: folder })
    }

    /// Where it listens.
    pub(crate) fn address(&self) -> String {
        format!("http://{}", self.serving.address)
    }

    /// Ends the workers, and then the farm.
    pub(crate) async fn stop(self) {
        self.workers.stop().await;
        self.serving.stop().await;
    }
}

/// Threads of each of `workers` processes, so that together they have one a core.
pub(crate) fn share_of_cores(workers: u32) -> usize {
    let cores = available_parallelism().map_or(1, NonZeroUsize::get);
    (cores / workers.max(1) as usize).max(1)
}

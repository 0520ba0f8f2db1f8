//! `ovtigre serve`: a farm.

use super::{
    embedded::share_of_cores,
    exit::{CommandError, Outcome},
    interrupt::Interrupt,
    local_workers::{LocalWorkers, Team, WorkerLog},
    terminal,
};
use clap::Args;
use ovtigre::serve::{ServeConfig, start};
use std::{
    net::{IpAddr, SocketAddr},
    num::NonZeroUsize,
    path::PathBuf,
};

/// Run a farm.
#[derive(Args, Debug)]
pub(crate) struct Serve {
    /// Address and port to listen on; port 0 takes a free one.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:7700")]
    listen: SocketAddr,
    /// Folder of the farm's memory: jobs, scenes, sums and pictures; made where it is not there.
    #[arg(long, value_name = "DIR", default_value = "ovtigre-data")]
    data: PathBuf,
    /// Worker processes to start on this machine.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=1024))]
    workers: u32,
    /// Threads of each of them [default: the cores shared out].
    #[arg(long, value_name = "N", value_parser = ovtigre_worker::flags::threads)]
    threads: Option<NonZeroUsize>,
    /// Listen on other addresses than loopback although anyone who reaches them may do anything.
    #[arg(long)]
    insecure: bool,
    /// What is logged to stderr: error, warn, info, debug or trace, also for one part such as ovtigre=debug.
    #[arg(long, value_name = "FILTER", default_value = "info")]
    log: String,
}

impl Serve {
    /// Serves until it is interrupted.
    pub(crate) async fn run(self) -> Outcome {
        if !self.listen.ip().is_loopback() && !self.insecure {
            return Err(CommandError::wrong(format!(
                "anyone who reaches {} could use this farm: listen on 127.0.0.1, or say --insecure",
                self.listen
            )));
        }
        terminal::log(&self.log);
        let interrupt = Interrupt::listen();
        let cache = self.data.join("worker-scenes");
        let config = ServeConfig { listen: self.listen, data: self.data };
        let serving = start(config).await.map_err(|e| CommandError::wrong(e.to_string()))?;
        terminal::result(&format!("http://{}", serving.address));
        let workers = LocalWorkers::start(&Team {
            count: self.workers,
            threads: self.threads.map_or_else(|| share_of_cores(self.workers), NonZeroUsize::get),
            farm: reachable(serving.address),
            cache,
            log: WorkerLog::Shown,
        })?;
        let lost =
            async { if self.workers == 0 { std::future::pending().await } else { workers.lost().await } };
        tokio::select! {
            () = interrupt.once() => {}
            reason = lost => tracing::error!("no worker of this machine is left: {reason}"),
        }
        interrupt.once().await;
        let stopped = async {
            workers.stop().await;
            serving.stop().await;
        };
        tokio::select! {
            () = stopped => Ok(()),
            () = interrupt.twice() => Err(CommandError::stopped("left before everything was put away")),
        }
    }
}

/// Where this machine finds a farm that listens everywhere.
fn reachable(address: SocketAddr) -> SocketAddr {
    let ip = match address.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => IpAddr::from([127, 0, 0, 1]),
        IpAddr::V6(ip) if ip.is_unspecified() => IpAddr::from([0, 0, 0, 0, 0, 0, 0, 1]),
        ip => ip,
    };
    SocketAddr::new(ip, address.port())
}

//! `ovtigre serve`: a farm.

use super::{
    embedded::share_of_cores,
    exit::{CommandError, Outcome},
    interrupt::Interrupt,
    keep::{Limit, kept, limit},
    local_workers::{LocalWorkers, Team, WorkerLog},
    secret, terminal,
};
use clap::Args;
use ovtigre::{
    api::guard::{Guarding, WithoutTokens, hash},
    farm::{rules::Rules, space::Room},
    serve::{OwnPort, ServeConfig, free_bytes, start, verify},
    store::{Store as _, sql::Sql},
    webhook::Reach,
};
use ovtigre_proto::telemetry::traces::Traces;
use ovtigre_worker::log::LogFlags;
use std::{
    net::{IpAddr, SocketAddr},
    num::NonZeroUsize,
    path::{Path, PathBuf},
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
    /// Keep jobs in a PostgreSQL database instead, postgres://USER:PASSWORD@HOST:PORT/DATABASE; any number of farms over
    /// the same database and blobs are one farm. [env: `OVTIGRE_DATABASE`]
    #[arg(long, value_name = "URL")]
    database: Option<String>,
    /// Keep scenes, sums and pictures in a bucket of an S3-compatible service instead, `s3://BUCKET/PREFIX`; keys, region
    /// and endpoint as for the service's own programs: `AWS_ACCESS_KEY_ID`, `AWS_SECRET_ACCESS_KEY`, `AWS_REGION`,
    /// `AWS_ENDPOINT_URL`. [env: `OVTIGRE_BLOBS`]
    #[arg(long, value_name = "URL")]
    blobs: Option<String>,
    /// Worker processes to start on this machine.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=1024))]
    workers: u32,
    /// Threads of each of them [default: the cores shared out].
    #[arg(long, value_name = "N", value_parser = ovtigre_worker::flags::threads)]
    threads: Option<NonZeroUsize>,
    /// Certificate chain of this farm, PEM: callers encrypt.
    #[arg(long, value_name = "FILE", requires = "tls_key")]
    tls_cert: Option<PathBuf>,
    /// Its key, PEM.
    #[arg(long, value_name = "FILE", requires = "tls_cert")]
    tls_key: Option<PathBuf>,
    /// Another name under which callers of this machine may call the farm; repeatable.
    #[arg(long = "host", value_name = "NAME")]
    hosts: Vec<String>,
    /// Share of batches that another worker renders again, to compare.
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = share)]
    audit: f64,
    /// GiB on the disk that are kept free: below, nothing new is taken and no batch is handed out.
    #[arg(long, value_name = "GIB", default_value_t = 1.0, value_parser = not_negative)]
    reserve: f64,
    /// How long jobs that are over are kept with their pictures, as 30d, 12h or 8w, and how many bytes of their files, as
    /// 200GB or 1TiB, or both, as 30d,200GB; those that are over longest go first [default: all, for ever].
    #[arg(long, value_name = "TIME,SIZE", value_delimiter = ',', value_parser = limit)]
    keep: Vec<Limit>,
    /// Look whether what the database names is among the files, say what is lost, and leave.
    #[arg(long)]
    check: bool,
    /// Sums of a lane that are kept one by one before they are kept as one file.
    #[arg(long, value_name = "N", default_value_t = 8, hide = true, value_parser = clap::value_parser!(u32).range(1..))]
    partials_kept: u32,
    /// Jobs under way of one token, at most.
    #[arg(long, value_name = "N", default_value_t = 1000)]
    jobs_per_token: usize,
    /// Requests a second of one token, at most; of workers any number.
    #[arg(long, value_name = "N", default_value_t = 100.0, value_parser = not_negative)]
    requests_per_second: f64,
    /// Tell webhooks of jobs' changes also at addresses of this machine and of private networks: whoever may send jobs can
    /// then have this machine post there.
    #[arg(long)]
    private_webhooks: bool,
    /// Listen on other addresses than loopback although anyone who reaches them may do anything.
    #[arg(long)]
    insecure: bool,
    #[command(flatten)]
    log: LogFlags,
}

fn share(text: &str) -> Result<f64, String> {
    let number = not_negative(text)?;
    if number <= 1.0 { Ok(number) } else { Err("it is a share, 0 to 1".to_owned()) }
}

fn not_negative(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "it is not a number".to_owned())?;
    if number.is_finite() && number >= 0.0 { Ok(number) } else { Err("it is not 0 or more".to_owned()) }
}

impl Serve {
    /// Serves until it is interrupted.
    pub(crate) async fn run(self) -> Outcome {
        self.log.start();
        let traces = Traces::from_environment("ovtigre-server")?;
        let interrupt = Interrupt::listen();
        let cache = self.data.join("worker-scenes");
        // A password in the environment is not in the list of processes.
        let named = |flag: &Option<String>, name| flag.clone().or_else(|| std::env::var(name).ok());
        let database = named(&self.database, "OVTIGRE_DATABASE");
        let blobs = named(&self.blobs, "OVTIGRE_BLOBS");
        if self.check {
            let config = ServeConfig { database, blobs, ..ServeConfig::new(self.listen, self.data) };
            return say_what_is_lost(config).await;
        }
        let own_token = secret::token()?;
        let rules = self.rules();
        let listens_to_all = !self.listen.ip().is_loopback();
        let guarding = self.guarding(&own_token);
        let tls = self.tls_cert.zip(self.tls_key);
        let scheme = if tls.is_some() { "https" } else { "http" };
        let own_port = if tls.is_some() && self.workers > 0 { OwnPort::Yes } else { OwnPort::No };
        if listens_to_all && !self.insecure {
            need_tokens(database.as_deref(), &self.data, self.listen).await?;
            if tls.is_none() {
                tracing::warn!("tokens and pictures are sent in the clear: give --tls-cert and --tls-key");
            }
        }
        let config = ServeConfig {
            listen: self.listen,
            data: self.data,
            database,
            blobs,
            rules,
            guarding,
            tls,
            own_port,
            traces,
        };
        let serving = start(config).await.map_err(|e| CommandError::wrong(e.to_string()))?;
        terminal::result(&format!("{scheme}://{}", serving.address));
        let workers = LocalWorkers::start(&Team {
            count: self.workers,
            threads: self.threads.map_or_else(|| share_of_cores(self.workers), NonZeroUsize::get),
            farm: reachable(serving.own.unwrap_or(serving.address)),
            token: Some(own_token),
            cache,
            log: WorkerLog::Shown(self.log),
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

impl Serve {
    fn guarding(&self, own_token: &str) -> Guarding {
        let listens_to_all = !self.listen.ip().is_loopback();
        Guarding {
            without_tokens: match (listens_to_all, self.insecure) {
                (true, false) => WithoutTokens::Refuse,
                _ => WithoutTokens::LetIn,
            },
            hosts: if listens_to_all {
                Vec::new()
            } else {
                [vec!["localhost".to_owned()], self.hosts.clone()].concat()
            },
            requests_per_second: self.requests_per_second,
            own_work: Some(hash(own_token)),
        }
    }

    fn rules(&self) -> Rules {
        let disk = self.data.clone();
        Rules {
            audit: self.audit,
            reserve_bytes: (self.reserve * f64::from(1 << 30)) as u64,
            jobs_per_token: self.jobs_per_token,
            partials_kept: self.partials_kept,
            kept: kept(&self.keep),
            notices_to: if self.private_webhooks { Reach::Anywhere } else { Reach::Public },
            // Where blobs are elsewhere the disk is not what fills.
            room: Room::new(move || free_bytes(&disk)),
            ..Rules::default()
        }
    }
}

/// Says what of a farm is lost and what is to be rendered again.
async fn say_what_is_lost(config: ServeConfig) -> Outcome {
    let checked = verify(config).await.map_err(|e| CommandError::wrong(e.to_string()))?;
    checked.again.iter().for_each(|line| terminal::result(&format!("to be rendered again: {line}")));
    checked.lost.iter().for_each(|line| terminal::result(&format!("lost: {line}")));
    let (jobs, scenes, lost) = (checked.jobs, checked.scenes, checked.lost.len());
    terminal::remark(&format!("{jobs} jobs and {scenes} scenes looked at"));
    if lost > 0 { Err(CommandError::failed(format!("{lost} things are lost: see above"))) } else { Ok(()) }
}

/// An error where a farm that others can reach has no token that would let them in.
async fn need_tokens(database: Option<&str>, data: &Path, listen: SocketAddr) -> Outcome {
    let store = if let Some(url) = database {
        Sql::server(url).await
    } else {
        std::fs::create_dir_all(data).ok();
        Sql::beside(&data.join("farm.sqlite")).await
    };
    let store = store.map_err(|e| CommandError::wrong(e.to_string()))?;
    let tokens = store.tokens().await.map_err(|e| CommandError::wrong(e.to_string()));
    store.close().await;
    if tokens?.is_empty() {
        return Err(CommandError::wrong(format!(
            "anyone who reaches {listen} could use this farm: make a token first (ovtigre token create --role admin), \
             listen on 127.0.0.1, or say --insecure"
        )));
    }
    Ok(())
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

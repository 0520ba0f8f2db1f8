//! Worker processes that a command starts, watches and ends.

use super::{
    exit::{CommandError, Outcome},
    terminal,
};
use ovtigre_worker::log::{LogFlags, LogFormat};
use std::{
    collections::VecDeque,
    net::SocketAddr,
    path::PathBuf,
    process::Stdio,
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant},
};
use tokio::{
    io::{AsyncBufReadExt as _, BufReader},
    process::{Child, ChildStderr, Command},
    sync::watch,
    task::JoinSet,
};
use tokio_util::sync::CancellationToken;

/// Times in a row that a worker is started again.
const RESTARTS: u32 = 4;
/// A worker that lived this long starts with a clean slate.
const LIVED: Duration = Duration::from_mins(1);
/// Time that a worker has to hand back its batches.
const FAREWELL: Duration = Duration::from_secs(4);
/// Lines of a worker's log that are kept for the day it fails.
const LINES_KEPT: usize = 20;

/// How workers are started.
#[derive(Clone, Debug)]
pub(crate) struct Team {
    /// Processes.
    pub(crate) count: u32,
    /// Threads of each.
    pub(crate) threads: usize,
    /// The farm.
    pub(crate) farm: SocketAddr,
    /// What lets them in, where that is needed.
    pub(crate) token: Option<String>,
    /// Where they keep scenes.
    pub(crate) cache: PathBuf,
    /// What becomes of what they write to standard error.
    pub(crate) log: WorkerLog,
}

/// What becomes of what workers write to standard error.
#[derive(Clone, Debug)]
pub(crate) enum WorkerLog {
    /// Shown only if they fail.
    Kept,
    /// Shown, as that of the command itself.
    Shown(LogFlags),
}

/// Worker processes; they end with this value, and with this process however it ends.
#[derive(Debug)]
pub(crate) struct LocalWorkers {
    stop: CancellationToken,
    watchers: JoinSet<()>,
    /// How many are left, and why the last one gave up.
    left: watch::Receiver<(u32, String)>,
}

impl LocalWorkers {
    /// Starts them.
    pub(crate) fn start(team: &Team) -> Outcome<Self> {
        let program = std::env::current_exe()
            .map_err(|e| CommandError::failed(format!("cannot find this program to start workers: {e}")))?;
        let stop = CancellationToken::new();
        let (sender, left) = watch::channel((team.count, String::new()));
        let sender = Arc::new(sender);
        let mut watchers = JoinSet::new();
        for number in 1..=team.count {
            let watched = Watched {
                program: program.clone(),
                number,
                team: team.clone(),
                lines: Arc::default(),
                stop: stop.clone(),
            };
            let sender = sender.clone();
            watchers.spawn(async move {
                if let Some(reason) = watched.watch().await {
                    sender.send_modify(|(left, last)| (*left, *last) = (*left - 1, reason));
                }
            });
        }
        Ok(Self { stop, watchers, left })
    }

    /// Returns, with the reason, when the last worker has failed for good.
    pub(crate) async fn lost(&self) -> String {
        let mut left = self.left.clone();
        let lost = left.wait_for(|(left, _)| *left == 0).await.map(|lost| lost.1.clone());
        match lost {
            Ok(reason) => reason,
            Err(_) => std::future::pending().await,
        }
    }

    /// Tells them to hand back what they hold and to leave.
    pub(crate) fn dismiss(&self) {
        self.stop.cancel();
    }

    /// Dismisses them, and returns when they are gone.
    pub(crate) async fn stop(mut self) {
        self.dismiss();
        while self.watchers.join_next().await.is_some() {}
    }
}

/// One worker, started again where it dies.
struct Watched {
    program: PathBuf,
    number: u32,
    team: Team,
    lines: Arc<Mutex<VecDeque<String>>>,
    stop: CancellationToken,
}

/// How a worker ended.
enum Ending {
    /// It was told to.
    Told,
    /// In peace.
    Left,
    /// Not in peace.
    Died(String),
}

impl Watched {
    /// Returns when the worker was told to leave, or else why there is none any more.
    async fn watch(&self) -> Option<String> {
        let mut restarts = 0;
        loop {
            let began = Instant::now();
            let ended = match self.start() {
                Ok(mut child) => match self.outlive(&mut child).await {
                    Ending::Told => return None,
                    Ending::Left => return Some(format!("worker {} has left", self.number)),
                    Ending::Died(how) => how,
                },
                Err(error) => format!("cannot be started: {error}"),
            };
            restarts = if began.elapsed() > LIVED { 1 } else { restarts + 1 };
            if restarts > RESTARTS {
                return Some(format!("worker {} {ended}{}", self.number, self.last_words()));
            }
            tracing::warn!(worker = self.number, "{ended}: starting it again");
            tokio::select! {
                () = tokio::time::sleep(Duration::from_millis(100 << restarts)) => {}
                () = self.stop.cancelled() => return None,
            }
        }
    }

    fn start(&self) -> std::io::Result<Child> {
        let mut command = Command::new(&self.program);
        command
            .arg("work")
            .args(["--server", &format!("http://{}", self.team.farm)])
            .args(["--threads", &self.team.threads.to_string()])
            .args(["--name", &format!("local-{}", self.number)])
            .arg("--cache")
            .arg(&self.team.cache)
            .arg("--until-stdin-closes")
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .kill_on_drop(true);
        if let WorkerLog::Shown(LogFlags { filter, format }) = &self.team.log {
            command.args(["--log", filter]).args(["--log-format", &format.to_string()]);
        }
        match &self.team.token {
            Some(token) => command.env("OVTIGRE_TOKEN", token),
            None => command.env_remove("OVTIGRE_TOKEN"),
        };
        // A Ctrl-C at the terminal is for the command, which then decides about its workers.
        #[cfg(unix)]
        command.process_group(0);
        let mut child = command.spawn()?;
        if let Some(stderr) = child.stderr.take() {
            tokio::spawn(keep(stderr, self.number, self.team.log.clone(), self.lines.clone()));
        }
        Ok(child)
    }

    /// Waits for its end.
    async fn outlive(&self, child: &mut Child) -> Ending {
        // Waiting would close it, and closing it tells the worker to leave.
        let stdin = child.stdin.take();
        let ended = tokio::select! {
            ended = child.wait() => ended,
            () = self.stop.cancelled() => {
                drop(stdin);
                if tokio::time::timeout(FAREWELL, child.wait()).await.is_err() {
                    child.kill().await.ok();
                }
                return Ending::Told;
            }
        };
        match ended {
            Ok(status) if status.success() => Ending::Left,
            Ok(status) => Ending::Died(format!("ended with {status}")),
            Err(error) => Ending::Died(format!("was lost: {error}")),
        }
    }

    fn last_words(&self) -> String {
        let lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        if matches!(self.team.log, WorkerLog::Shown(_)) || lines.is_empty() {
            return String::new();
        }
        format!("; its last words: {}", lines.iter().cloned().collect::<Vec<_>>().join(" | "))
    }
}

async fn keep(stderr: ChildStderr, number: u32, log: WorkerLog, kept: Arc<Mutex<VecDeque<String>>>) {
    let mut lines = BufReader::new(stderr).lines();
    while let Ok(Some(line)) = lines.next_line().await {
        match &log {
            WorkerLog::Shown(LogFlags { format: LogFormat::Text, .. }) => {
                terminal::remark(&format!("worker {number}: {line}"));
            }
            WorkerLog::Shown(_) => terminal::remark(&line),
            WorkerLog::Kept => {}
        }
        let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.push_back(line.chars().take(300).collect());
        if kept.len() > LINES_KEPT {
            kept.pop_front();
        }
    }
}

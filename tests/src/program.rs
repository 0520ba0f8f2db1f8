//! The program `ovtigre` as processes: a farm, workers, commands.

use ovtigre_proto::client::farm::Client;
use std::{
    ffi::OsStr,
    io::{BufRead as _, BufReader},
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio},
    time::{Duration, Instant},
};

/// The program, built beside the tests.
fn program() -> PathBuf {
    let tests = std::env::current_exe().expect("this program has a path");
    let program = tests.parent().and_then(Path::parent).expect("target/PROFILE/deps").join("ovtigre");
    assert!(program.is_file(), "{} is not there: cargo build -p ovtigre", program.display());
    program
}

/// The program, to be given arguments.
pub fn command() -> Command {
    Command::new(program())
}

/// Starts a worker of one thread for the farm at an address.
pub fn worker_of(url: &str) -> Process {
    worker_with(url, &[])
}

/// The same with further variables.
pub fn worker_with(url: &str, environment: &[(String, String)]) -> Process {
    let mut work = command();
    work.envs(environment.iter().map(|(name, value)| (name, value)));
    work.args(["work", "--threads", "1", "--server", url]);
    let work = work.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    Process(work.spawn().expect("the program starts"))
}

/// Runs a command to its end.
pub fn run<S: AsRef<OsStr>>(arguments: impl IntoIterator<Item = S>) -> Output {
    Command::new(program()).args(arguments).stdin(Stdio::null()).output().expect("the program starts")
}

/// A process that is killed when it is dropped.
#[derive(Debug)]
pub struct Process(Child);

impl Process {
    /// SIGKILL: no farewell.
    pub fn kill(mut self) {
        self.end();
    }

    fn end(&mut self) {
        // Either may fail because the process is gone: that is what is wanted.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.end();
    }
}

/// Longest wait for a job, or for a farm.
const PATIENCE: Duration = Duration::from_mins(2);

/// A farm that listens on a free port of the loopback.
#[derive(Debug)]
pub struct Farm {
    /// Its address.
    pub url: String,
    process: Process,
}

impl Farm {
    /// Starts a farm over a folder.
    pub fn start(data: &Path) -> Self {
        Self::start_with(data, &[])
    }

    /// Starts a farm over a folder, with further flags.
    pub fn start_with(data: &Path, further: &[&str]) -> Self {
        Self::start_as(command(), data, further)
    }

    /// Starts a farm with further variables.
    pub fn start_among(environment: &[(&str, &str)], data: &Path, further: &[&str]) -> Self {
        let mut serve = command();
        serve.envs(environment.iter().copied());
        Self::start_as(serve, data, further)
    }

    /// Starts a farm that logs to a file.
    pub fn start_logged(log: &Path, data: &Path, further: &[&str]) -> Self {
        let log = std::fs::File::create(log).expect("a file can be written here");
        Self::start_to(log.into(), command(), data, further)
    }

    /// The number of its process.
    pub fn process_id(&self) -> u32 {
        self.process.0.id()
    }

    /// Starts a farm in a folder that is a small disk of its own, of so many MiB; `None` where that is not allowed. The disk
    /// goes away with the process.
    pub fn start_on_a_disk(data: &Path, mib: u32, further: &[&str]) -> Option<Self> {
        let allowed = Command::new("unshare").args(["-rm", "mount", "-t", "tmpfs", "none", "/mnt"]).output();
        if !allowed.is_ok_and(|tried| tried.status.success()) {
            return None;
        }
        std::fs::create_dir_all(data).expect("a folder");
        let mut serve = Command::new("unshare");
        let script = format!("mount -t tmpfs -o size={mib}m none \"$0\" && exec \"$@\"");
        serve.args(["-rm", "sh", "-c", &script]).arg(data).arg(program());
        Some(Self::start_as(serve, data, further))
    }

    /// The root of the farm's files, as it sees them.
    pub fn root(&self) -> PathBuf {
        PathBuf::from(format!("/proc/{}/root", self.process.0.id()))
    }

    fn start_as(serve: Command, data: &Path, further: &[&str]) -> Self {
        Self::start_to(Stdio::null(), serve, data, further)
    }

    fn start_to(log: Stdio, mut serve: Command, data: &Path, further: &[&str]) -> Self {
        serve.args(["serve", "--listen", "127.0.0.1:0", "--data"]).arg(data).args(further);
        serve.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(log);
        let mut child = serve.spawn().expect("the program starts");
        let mut line = String::new();
        let stdout = child.stdout.take().expect("piped");
        BufReader::new(stdout).read_line(&mut line).expect("the farm says where it listens");
        Self { url: line.trim().to_owned(), process: Process(child) }
    }

    /// SIGKILL: no farewell.
    pub fn kill(self) {
        self.process.kill();
    }

    /// Waits until it has died by itself, at most two minutes.
    pub fn died(mut self) {
        let start = Instant::now();
        while self.process.0.try_wait().expect("it is a child").is_none() {
            assert!(start.elapsed() < PATIENCE, "it lives");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Seconds of processor time that its process has taken, and the most bytes that it ever had in memory.
    pub fn cost(&self) -> (f64, u64) {
        let about = |file| {
            std::fs::read_to_string(format!("/proc/{}/{file}", self.process.0.id())).expect("it is there")
        };
        let stat = about("stat");
        let after_name = stat.rsplit(')').next().expect("a line").split_whitespace();
        // User and system time, in hundredths of a second on every Linux.
        let ticks: f64 = after_name.skip(11).take(2).map(|t| t.parse::<f64>().expect("a number")).sum();
        let status = about("status");
        let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).expect("a line of memory");
        let kib: u64 = peak.trim().trim_end_matches(" kB").parse().expect("a number");
        (ticks / 100.0, kib << 10)
    }

    /// Starts a worker of one thread.
    pub fn worker(&self) -> Process {
        worker_of(&self.url)
    }

    /// Runs a client's command to its end and returns what it wrote; it must succeed.
    pub fn client(&self, arguments: &[&str]) -> String {
        let output = run(arguments.iter().copied().chain(["--server", &self.url]));
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {error}");
        String::from_utf8(output.stdout).expect("text")
    }

    /// The job as JSON.
    pub fn job(&self, id: &str) -> serde_json::Value {
        let id = id.parse().expect("a job's name");
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a thread");
        let job = runtime.block_on(async { Client::new(&self.url, 0)?.job(&id).await });
        serde_json::to_value(job.expect("the farm answers")).expect("plain data")
    }

    /// Waits until `reached` says so of the job, at most two minutes.
    pub fn wait(&self, id: &str, reached: impl Fn(&serde_json::Value) -> bool) -> serde_json::Value {
        let start = Instant::now();
        loop {
            let job = self.job(id);
            if reached(&job) {
                return job;
            }
            assert!(start.elapsed() < PATIENCE, "still {job}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

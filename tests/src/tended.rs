//! A farm that is started again whenever it has died, always at the same address.

use crate::program::{Process, command, run, worker_of};
use ovtigre_proto::{client::farm::Client, status::JobStatus};
use std::{
    net::TcpListener,
    path::{Path, PathBuf},
    process::{Child, Stdio},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread::JoinHandle,
    time::{Duration, Instant},
};

/// Longest wait for anything.
const PATIENCE: Duration = Duration::from_mins(2);
/// Between two looks.
const LOOK: Duration = Duration::from_millis(20);

/// A farm that is started again whenever it has died.
#[derive(Debug)]
pub struct Tended {
    /// Its address.
    pub url: String,
    ground: Arc<Ground>,
    watcher: Option<JoinHandle<()>>,
}

/// How it is started, and the process there is now.
#[derive(Debug)]
struct Ground {
    listen: String,
    data: PathBuf,
    flags: Vec<String>,
    environment: Vec<(String, String)>,
    now: Mutex<Now>,
}

#[derive(Debug, Default)]
struct Now {
    child: Option<Child>,
    deaths: u32,
    ends: bool,
}

impl Ground {
    fn now(&self) -> MutexGuard<'_, Now> {
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn spawn(&self, fail_point: Option<&str>) -> Child {
        let mut serve = command();
        serve
            .args(["serve", "--listen", &self.listen, "--log", "warn", "--data"])
            .arg(&self.data)
            .args(&self.flags);
        serve.envs(self.environment.iter().map(|(name, value)| (name, value)));
        if let Some(place) = fail_point {
            serve.env("OVTIGRE_FAIL_POINT", place);
        }
        serve.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        serve.spawn().expect("the program starts")
    }

    fn tend(&self) {
        loop {
            let mut now = self.now();
            if now.ends {
                return;
            }
            if now.child.as_mut().is_none_or(|child| !matches!(child.try_wait(), Ok(None))) {
                now.deaths += 1;
                now.child = Some(self.spawn(None));
            }
            drop(now);
            std::thread::sleep(LOOK);
        }
    }
}

/// A port that nobody listens at.
pub fn free_port() -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a loopback");
    listener.local_addr().expect("it is bound").port()
}

impl Tended {
    /// Starts it over a folder, with further flags and variables; the first process dies at `fail_point`.
    pub fn start(
        data: &Path,
        flags: &[&str],
        environment: &[(String, String)],
        fail_point: Option<&str>,
    ) -> Self {
        let listen = format!("127.0.0.1:{}", free_port());
        let ground = Arc::new(Ground {
            listen: listen.clone(),
            data: data.to_owned(),
            flags: flags.iter().map(|flag| (*flag).to_owned()).collect(),
            environment: environment.to_vec(),
            now: Mutex::default(),
        });
        ground.now().child = Some(ground.spawn(fail_point));
        let tended = Arc::clone(&ground);
        let watcher = Some(std::thread::spawn(move || tended.tend()));
        Self { url: format!("http://{listen}"), ground, watcher }
    }

    /// How often it has died.
    pub fn deaths(&self) -> u32 {
        self.ground.now().deaths
    }

    /// SIGKILL: no farewell.
    pub fn kill(&self) {
        if let Some(child) = &mut self.ground.now().child {
            // It may be gone already.
            let _ = child.kill();
        }
    }

    /// Starts a worker of one thread.
    pub fn worker(&self) -> Process {
        worker_of(&self.url)
    }

    /// Runs a client's command, again until it succeeds, and returns what it wrote.
    pub fn client(&self, arguments: &[&str]) -> String {
        let start = Instant::now();
        loop {
            let output = run(arguments.iter().copied().chain(["--server", &self.url]));
            if output.status.success() {
                return String::from_utf8(output.stdout).expect("text");
            }
            let error = String::from_utf8_lossy(&output.stderr);
            assert!(start.elapsed() < PATIENCE, "{arguments:?}: {error}");
            std::thread::sleep(LOOK);
        }
    }

    /// All its jobs.
    pub fn jobs(&self) -> Vec<JobStatus> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a thread");
        let start = Instant::now();
        loop {
            let jobs = runtime.block_on(async { Client::new(&self.url, 0)?.jobs(None).all(1000).await });
            match jobs {
                Ok(jobs) => return jobs,
                Err(error) => assert!(start.elapsed() < PATIENCE, "{error}"),
            }
            std::thread::sleep(LOOK);
        }
    }

    /// Waits until all its jobs are over, and returns them; `what` says of which test.
    pub fn settle(&self, what: &str) -> Vec<JobStatus> {
        let start = Instant::now();
        loop {
            let jobs = self.jobs();
            if jobs.iter().all(|job| job.state.is_over()) {
                return jobs;
            }
            let said = || {
                jobs.iter().map(|job| format!("{:?} {}/{}", job.state, job.batches_done, job.batches_asked))
            };
            assert!(start.elapsed() < PATIENCE, "{what}: {:?}", said().collect::<Vec<_>>());
            std::thread::sleep(LOOK);
        }
    }
}

impl Drop for Tended {
    fn drop(&mut self) {
        let child = {
            let mut now = self.ground.now();
            now.ends = true;
            now.child.take()
        };
        if let Some(mut child) = child {
            let _ = child.kill();
            let _ = child.wait();
        }
        if let Some(watcher) = self.watcher.take() {
            let _ = watcher.join();
        }
    }
}

//! How much one server takes: many workers over real HTTP that bring made-up sums of 8×8 pixels, at a steady rate of exchanges;
//! then a long list of jobs that are over, page by page, in four orders, with their checkpoints.
//!
//! `./tests/services cargo bench -p ovtigre-tests --bench load -- [WORKERS [SECONDS [EXCHANGES A SECOND [JOBS LISTED]]]]`, with
//! 1000, 60, 600 and 100000 where nothing is said; over a file and, where `tests/services` has started it, over PostgreSQL.
//! Build the program in the same profile first: `cargo build --release`.

#![expect(clippy::unwrap_used, reason = "a benchmark that cannot go on panics")]

use ovtigre_core::film::{
    exr::{PartialAttributes, write_partial},
    invalid::InvalidSamples,
    sum::Sum,
};
use ovtigre_proto::{
    client::{farm::Client, file::Upload},
    job::JobRequest,
    lease::{Exchange, Lease, LeaseProgress, WorkerJoin},
};
use ovtigre_tests::{program::Farm, room::room, services::Shared};
use sqlx::{AssertSqlSafe, Connection as _, PgConnection, SqliteConnection};
use std::{
    path::Path,
    sync::{
        Arc, Mutex,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

/// What is to be borne.
#[derive(Clone, Copy)]
struct Load {
    workers: usize,
    time: Duration,
    /// Exchanges a second of all workers together.
    rate: f64,
    listed: u32,
}

/// What was measured of calls of one kind.
#[derive(Default)]
struct Times(Mutex<Vec<f64>>);

impl Times {
    fn add(&self, since: Instant) {
        self.0.lock().unwrap().push(since.elapsed().as_secs_f64() * 1e3);
    }

    /// How many, and milliseconds that half, 99 % and all of them took at most.
    fn summary(&self) -> (usize, [f64; 3]) {
        let mut all = self.0.lock().unwrap().clone();
        all.sort_by(f64::total_cmp);
        let at = |share: f64| all.get((share * (all.len().max(1) - 1) as f64) as usize).copied();
        (all.len(), [0.5, 0.99, 1.0].map(|share| at(share).unwrap_or(f64::NAN)))
    }
}

#[derive(Default)]
struct Measured {
    exchanges: Times,
    sums: Times,
    leases: AtomicU64,
    failed: AtomicU64,
    late: AtomicU64,
}

#[expect(clippy::print_stdout, reason = "a benchmark's result")]
fn print(line: &str) {
    println!("{line}");
}

/// A sum that says nothing.
fn partial(lease: &Lease) -> Vec<u8> {
    let sum = Sum {
        batch: lease.batch,
        planes: vec![vec![[lease.batch.block.count as f32; 3]; lease.batch.region.pixels()]],
        invalid: InvalidSamples::default(),
        rays: 1,
        tile_rays: Vec::new(),
    };
    let attributes = PartialAttributes {
        job: lease.job.to_string(),
        scene: lease.scene.to_string(),
        method: lease.settings.method.name().to_owned(),
        solution: None,
        allocation: None,
    };
    write_partial(&sum, lease.settings.size, &attributes)
}

/// A worker that beats at its times and brings each batch at once.
async fn work(client: Client, load: Load, number: usize, begin: Instant, measured: Arc<Measured>) {
    let join = WorkerJoin {
        name: format!("load-{number}"),
        threads: 1,
        build: env!("CARGO_PKG_VERSION").to_owned(),
        instruction_set: "load".to_owned(),
        tags: Vec::new(),
    };
    let id = client.join(&join).await.unwrap().id;
    let period = load.workers as f64 / load.rate;
    let mut at = begin + Duration::from_secs_f64(period * number as f64 / load.workers as f64);
    let mut held: Vec<Lease> = Vec::new();
    while at < begin + load.time {
        tokio::time::sleep_until(at.into()).await;
        if at.elapsed() > Duration::from_millis(100) {
            measured.late.fetch_add(1, Ordering::Relaxed);
        }
        at += Duration::from_secs_f64(period);
        let holding = held.iter().map(|lease| LeaseProgress { lease: lease.id.clone(), done: 0.5 }).collect();
        let since = Instant::now();
        match client.exchange(&id, &Exchange { holding, wants: 1, ..Exchange::default() }).await {
            Ok(reply) => {
                measured.exchanges.add(since);
                measured.leases.fetch_add(reply.leases.len() as u64, Ordering::Relaxed);
                held.extend(reply.leases);
            }
            Err(_) => drop(measured.failed.fetch_add(1, Ordering::Relaxed)),
        }
        for lease in std::mem::take(&mut held) {
            let since = Instant::now();
            match client.bring(&lease.id, partial(&lease).into(), 0.001).await {
                Ok(_) => measured.sums.add(since),
                Err(_) => drop(measured.failed.fetch_add(1, Ordering::Relaxed)),
            }
        }
    }
}

/// A number at `/metrics`.
async fn metric(url: &str, name: &str) -> f64 {
    let text = reqwest::get(format!("{url}/metrics")).await.unwrap().text().await.unwrap();
    text.lines().find_map(|line| line.strip_prefix(name)?.trim().parse().ok()).unwrap()
}

async fn bear(farm: &Farm, load: Load, scene: &Path, client: &Client) {
    let upload = Upload::file(scene.to_owned()).await.unwrap();
    client.upload(&upload).await.unwrap();
    // 1,536 batches each: six blocks of 256 replicates.
    let jobs = (load.rate * load.time.as_secs_f64() * 1.2 / 1536.0).ceil() as u32;
    for seed in 0..jobs {
        let request = JobRequest {
            scene: Some(upload.id().clone()),
            size: Some("8x8".parse().unwrap()),
            samples: Some(256 * 4096 * 2),
            replicates: Some(256),
            seed: Some(u64::from(seed)),
            ..JobRequest::default()
        };
        client.submit(&request, &format!("load-{seed}")).await.unwrap();
    }
    let measured = Arc::new(Measured::default());
    let (cpu, _) = farm.cost();
    let begin = Instant::now() + Duration::from_secs(2);
    let works = (0..load.workers).map(|n| work(client.clone(), load, n, begin, Arc::clone(&measured)));
    let tasks: Vec<_> = works.map(tokio::spawn).collect();
    for task in tasks {
        task.await.unwrap();
    }
    let seconds = begin.elapsed().as_secs_f64();
    let (cpu, peak) = (farm.cost().0 - cpu, farm.cost().1);
    let appended = metric(&farm.url, "ovtigre_batches_appended_total ").await;
    for (what, times) in [("exchanges", &measured.exchanges), ("sums brought", &measured.sums)] {
        let (n, [half, most, all]) = times.summary();
        let rate = n as f64 / seconds;
        print(&format!(
            "  {what}: {rate:.0}/s; half in {half:.1} ms, 99 % in {most:.1} ms, all in {all:.0} ms"
        ));
    }
    print(&format!("  leases handed out: {:.0}/s", measured.leases.load(Ordering::Relaxed) as f64 / seconds));
    let exchanges = measured.exchanges.summary().0 as f64;
    let (failed, late) = (measured.failed.load(Ordering::Relaxed), measured.late.load(Ordering::Relaxed));
    print(&format!(
        "  appended {:.0}/s; the server's CPU {cpu:.1} s of {seconds:.0} s, {:.2} ms for each exchange with its sum; memory at most {} MiB; failed {failed}, begun late by more than 100 ms {late}",
        appended / seconds,
        cpu * 1e3 / exchanges,
        peak >> 20
    ));
}

/// Copies of one job that is over, as rows of the database.
async fn copy_jobs(database: Result<&str, &Path>, load: Load) {
    let columns = "name, scene, state, reason, version, priority, created_ms, started_ms, ended_ms, paused_ms, spec, progress, certified, manifest, settled";
    let looks = "look, samples, wall_seconds, worker_seconds, rays, rms_error, relative_error, relative_error_upper, layers";
    // One with checkpoints, where there is one.
    let one = "SELECT id FROM job WHERE settled = 1 ORDER BY (SELECT count(*) FROM checkpoint WHERE job = job.id) DESC, sequence LIMIT 1";
    let listed = load.listed;
    let copies = [
        format!(
            "INSERT INTO job (id, error_ppb, {columns}) SELECT 'c' || n, n, {columns} FROM n, (SELECT * FROM job WHERE id = ({one})) AS one"
        ),
        format!(
            "INSERT INTO checkpoint (job, {looks}) SELECT 'c' || n, {looks} FROM n, checkpoint WHERE job = ({one})"
        ),
        format!(
            "INSERT INTO job_file (job, scene) SELECT 'c' || n, scene FROM n, job_file WHERE job = ({one})"
        ),
    ];
    for copy in copies {
        match database {
            Ok(url) => {
                let numbers = format!("WITH n(n) AS (SELECT generate_series(1, {listed})) ");
                let mut db = PgConnection::connect(url).await.unwrap();
                sqlx::query(AssertSqlSafe(numbers + &copy)).execute(&mut db).await.unwrap();
            }
            Err(file) => {
                let numbers = format!(
                    "WITH RECURSIVE n(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM n WHERE n < {listed}) "
                );
                let mut db = SqliteConnection::connect(file.to_str().unwrap()).await.unwrap();
                sqlx::query(AssertSqlSafe(numbers + &copy)).execute(&mut db).await.unwrap();
            }
        }
    }
}

/// Pages of 50 jobs each, from the first to the last, in the order of `sort`.
async fn list(farm: &Farm, sort: &str) {
    let times = Times::default();
    let client = reqwest::Client::new();
    let (mut cursor, mut jobs) = (String::new(), 0);
    loop {
        let since = Instant::now();
        let page = format!("{}/v1/jobs?limit=50&sort={sort}{cursor}", farm.url);
        let page: serde_json::Value = client.get(page).send().await.unwrap().json().await.unwrap();
        times.add(since);
        jobs += page["items"].as_array().unwrap().len();
        let Some(next) = page["next"].as_str() else { break };
        cursor = format!("&cursor={next}");
    }
    let (pages, [half, most, all]) = times.summary();
    let memory = farm.cost().1 >> 20;
    print(&format!(
        "  {jobs} jobs listed by {sort} in {pages} pages; half in {half:.1} ms, 99 % in {most:.1} ms, all in {all:.0} ms; memory at most {memory} MiB"
    ));
}

async fn measure(name: &str, place: &Path, flags: &[&str], database: Option<&str>, load: Load, scene: &Path) {
    print(&format!(
        "{name}: {} workers, {} s, {} exchanges a second asked for",
        load.workers,
        load.time.as_secs(),
        load.rate
    ));
    let farm = Farm::start_with(place, flags);
    let client = Client::new(&farm.url, 1).unwrap();
    bear(&farm, load, scene, &client).await;
    let request = JobRequest {
        scene: Some(Upload::file(scene.to_owned()).await.unwrap().id().clone()),
        ..JobRequest::default()
    };
    let job = client.submit(&request, "to copy").await.unwrap().id;
    client.cancel(&job).await.unwrap();
    for job in client.jobs(None).all(10_000).await.unwrap() {
        client.cancel(&job.id).await.ok();
    }
    // Until all of them have their last form.
    tokio::time::sleep(Duration::from_secs(3)).await;
    farm.kill();
    let file = place.join("farm.sqlite");
    copy_jobs(database.ok_or(&file), load).await;
    let since = Instant::now();
    let farm = Farm::start_with(place, flags);
    print(&format!("  started over {} jobs in {:.1} s", load.listed, since.elapsed().as_secs_f64()));
    for sort in ["-created", "name", "error", "-workers"] {
        list(&farm, sort).await;
    }
}

#[tokio::main]
async fn main() {
    let numbers: Vec<u32> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let number = |n: usize, default| numbers.get(n).copied().unwrap_or(default);
    let load = Load {
        workers: number(0, 1000) as usize,
        time: Duration::from_secs(u64::from(number(1, 60))),
        rate: f64::from(number(2, 600)),
        listed: number(3, 100_000),
    };
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.glb");
    std::fs::write(&scene, room()).unwrap();
    let flags = ["--reserve", "0", "--requests-per-second", "100000", "--log", "error"];
    measure("SQLite", &folder.path().join("sqlite"), &flags, None, load, &scene).await;
    let shared = tokio::task::spawn_blocking(|| Shared::place("load")).await.unwrap();
    if let Some(shared) = shared {
        let flags = [&flags[..], &shared.flags()[..2]].concat();
        let place = folder.path().join("postgres");
        measure("PostgreSQL", &place, &flags, Some(shared.database()), load, &scene).await;
    }
}

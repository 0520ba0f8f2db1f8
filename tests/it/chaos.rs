//! All that can go wrong goes wrong at random moments, of a seed; the pictures do not change.
//!
//! A longer run: `OVTIGRE_CHAOS_SECONDS=600 OVTIGRE_CHAOS_SEED=2 ./tests/services cargo test -p ovtigre-tests --test it chaos --
//! --nocapture --test-threads 1`.

use crate::faults::undisturbed;
use ovtigre_core::{
    film::exr::{Layers, read_layers},
    settings::{Distribution, Method, Settings},
};
use ovtigre_proto::{id::JobId, status::JobState};
use ovtigre_tests::{
    clock::wrong_by,
    picture::settings,
    program::{Process, worker_with},
    proxy::{Proxy, Random},
    room::room,
    services::Shared,
    tended::Tended,
};
use std::{
    collections::BTreeSet,
    env, fs,
    path::Path,
    time::{Duration, Instant},
};

/// Workers at a time.
const WORKERS: usize = 4;
/// Share of calls of workers that meet a fault on the line.
const LINE: f64 = 0.15;
/// Share of calls to the bucket that do.
const BUCKET: f64 = 0.03;

/// A number of the environment.
fn number(name: &str, default: u64) -> u64 {
    env::var(name).map_or(default, |text| text.parse().expect("a number"))
}

/// A kind of job: its flags, its samples, and its picture by core alone.
struct Kind {
    flags: Vec<&'static str>,
    samples: u32,
    expected: Layers,
}

fn kinds() -> Vec<Kind> {
    let kind = |size: u32, samples: u32, (method, sampling), flags: &[&'static str]| {
        let wish = Settings { bounces: Some(2), method, sampling, ..settings(size, size, 4) };
        let flags = [flags, &["--bounces", "2", "--method", method.name()]].concat();
        Kind { flags, samples, expected: undisturbed(&room(), &wish, samples) }
    };
    let even = |method| (method, Distribution::Uniform);
    let adaptive = ["--size", "24x24", "--samples", "1024", "--sampling", "adaptive"];
    vec![
        kind(4, 4 * 1024, even(Method::Path), &["--size", "4x4", "--samples", "4096"]),
        kind(24, 1024, (Method::Path, Distribution::Adaptive), &adaptive),
        kind(6, 4 * 1024, even(Method::Caustics), &["--size", "6x6", "--samples", "4096"]),
        kind(12, 4 * 1024, even(Method::Path), &["--size", "12x12", "--samples", "4096"]),
        kind(8, 4 * 1024, even(Method::Light), &["--size", "8x8", "--samples", "4096"]),
    ]
}

/// What was survived.
#[derive(Debug, Default)]
struct Survived {
    jobs: usize,
    servers_killed: u32,
    workers_killed: u32,
    folders_taken: u32,
    connections_ended: i64,
    lines: u64,
}

/// A farm to torment.
struct Chaos<'a> {
    farms: Vec<Tended>,
    lines: Vec<Proxy>,
    workers: Vec<Process>,
    clocks: [Vec<(String, String)>; 2],
    /// The folder of its files, where it has one.
    files: Option<&'a Path>,
    /// The database and the bucket, where those are elsewhere.
    shared: Option<&'a Shared>,
    runtime: tokio::runtime::Runtime,
    random: Random,
    survived: Survived,
}

impl Chaos<'_> {
    fn worker(&mut self) -> Process {
        let line = self.random.below(self.lines.len());
        // Two of three have a clock that is an hour wrong, this way or that.
        let clock = self.clocks.get(self.random.below(3)).map_or(&[][..], Vec::as_slice);
        worker_with(&self.lines[line].url, clock)
    }

    /// Whether too little went wrong, or there was too little that could have suffered.
    fn is_calm(&self, jobs: usize) -> bool {
        let Survived { servers_killed, workers_killed, .. } = self.survived;
        jobs < 3 || servers_killed < 1 || workers_killed < 2 || self.faults() < 30
    }

    /// Calls that met a fault on a line to a farm.
    fn faults(&self) -> u64 {
        self.lines.iter().flat_map(Proxy::faults).map(|(_, times)| times).sum()
    }

    fn harm(&mut self) {
        match self.random.below(10) {
            0..5 => {
                let n = self.random.below(self.workers.len());
                let next = self.worker();
                std::mem::replace(&mut self.workers[n], next).kill();
                self.survived.workers_killed += 1;
            }
            5..8 => {
                let n = self.random.below(self.farms.len());
                self.farms[n].kill();
                self.survived.servers_killed += 1;
            }
            _ => {
                if let Some(files) = self.files {
                    take_away(&files.join("jobs"), Duration::from_millis(self.random.draw() % 400));
                    self.survived.folders_taken += 1;
                }
                if let Some(shared) = self.shared {
                    self.survived.connections_ended += shared.end_connections(&self.runtime);
                }
            }
        }
    }
}

/// For a while a folder cannot be used: what is in it is gone, and nothing can be written.
fn take_away(folder: &Path, time: Duration) {
    let aside = folder.with_extension("aside");
    if fs::rename(folder, &aside).is_ok() {
        let stands = fs::write(folder, "not a folder").is_ok();
        std::thread::sleep(time);
        if stands {
            fs::remove_file(folder).unwrap();
        } else {
            fs::remove_dir_all(folder).unwrap();
        }
        fs::rename(&aside, folder).unwrap();
    }
}

/// Torments farms for a while, and asserts that every job is done and every picture that of core alone.
#[expect(clippy::print_stderr, reason = "says what was survived")]
fn assert_survives(name: &str, servers: usize, shared: Option<&Shared>) {
    let (seconds, seed) = (number("OVTIGRE_CHAOS_SECONDS", 15), number("OVTIGRE_CHAOS_SEED", 1));
    let folder = tempfile::tempdir().unwrap();
    let data = |n: usize| folder.path().join(format!("farm-{n}"));
    let bucket = shared.map(|_| Proxy::start(&Shared::endpoint(), BUCKET, seed ^ 0x5eed));
    let environment: Vec<(String, String)> =
        bucket.iter().map(|line| ("AWS_ENDPOINT_URL".to_owned(), line.url.clone())).collect();
    let places: Vec<&str> = shared.map_or(Vec::new(), |shared| shared.flags().to_vec());
    let flags = [&places[..], &["--partials-kept", "2", "--reserve", "0", "--audit", "0.05"]].concat();
    let farms: Vec<Tended> =
        (0..servers).map(|n| Tended::start(&data(n), &flags, &environment, None)).collect();
    let lines = (farms.iter().zip(1..)).map(|(farm, n)| Proxy::start(&farm.url, LINE, seed + n)).collect();
    let files = data(0).join("blobs");
    let clock = |hours| wrong_by(hours, folder.path()).unwrap_or_default();
    let mut chaos = Chaos {
        farms,
        lines,
        workers: Vec::new(),
        clocks: [clock(1), clock(-1)],
        files: shared.is_none().then_some(&*files),
        shared,
        runtime: tokio::runtime::Runtime::new().unwrap(),
        random: Random::new(seed),
        survived: Survived::default(),
    };
    chaos.workers = (0..WORKERS).map(|_| chaos.worker()).collect();
    let scene = folder.path().join("scene.glb");
    fs::write(&scene, room()).unwrap();
    let kinds = kinds();
    let mut asked: Vec<(JobId, usize)> = Vec::new();
    let begun = Instant::now();
    let mut open = 0;
    // On a machine that is busy with other things less happens in that time.
    while begun.elapsed() < Duration::from_secs(seconds) || chaos.is_calm(asked.len()) {
        if open < 3 {
            let (kind, farm) = (asked.len() % kinds.len(), chaos.random.below(servers));
            let submit = [&["submit", scene.to_str().unwrap()], &kinds[kind].flags[..]].concat();
            asked.push((chaos.farms[farm].client(&submit).trim().parse().unwrap(), kind));
        }
        chaos.harm();
        std::thread::sleep(Duration::from_millis(200 + chaos.random.draw() % 600));
        open = chaos.farms[0].jobs().iter().filter(|job| !job.state.is_over()).count();
    }
    let jobs = chaos.farms[0].settle(name);
    let names: BTreeSet<&JobId> = jobs.iter().map(|job| &job.id).collect();
    for (id, kind) in &asked {
        assert!(names.contains(id), "{name}: job {id} is gone");
        let job = jobs.iter().find(|job| job.id == *id).unwrap();
        let Kind { samples, expected, .. } = &kinds[*kind];
        assert_eq!(job.state, JobState::Done, "{name}: {job:?}");
        assert_eq!((job.batches_done, job.invalid_samples), (job.batches_asked, 0), "{name}: {job:?}");
        assert_eq!(job.samples_done, f64::from(*samples), "{name}: {job:?}");
        let picture = folder.path().join("picture.exr");
        chaos.farms[servers - 1].client(&["fetch", id.as_str(), "-o", picture.to_str().unwrap()]);
        let picture = read_layers(&fs::read(picture).unwrap()).unwrap();
        assert!(
            picture.channels == expected.channels,
            "{name}: the picture of {id} is not that of core alone"
        );
    }
    let of_bucket: u64 = bucket.iter().flat_map(Proxy::faults).map(|(_, times)| times).sum();
    let survived = Survived { jobs: jobs.len(), lines: chaos.faults() + of_bucket, ..chaos.survived };
    eprintln!("{name}, {} s, seed {seed}: {survived:?}", begun.elapsed().as_secs());
    assert!(survived.jobs >= asked.len() && survived.lines >= 30, "{survived:?}");
}

#[test]
fn chaos_changes_no_byte_over_files() {
    assert_survives("files", 1, None);
}

#[test]
fn chaos_changes_no_byte_of_two_servers_over_a_database_and_a_bucket() {
    let Some(shared) = Shared::place("chaos") else { return };
    assert_survives("database and bucket", 2, Some(&shared));
}

//! Measures what method `auto` chooses against every fixed method, and prints the tables of docs/PERFORMANCE.md:
//! `cargo run --release -p ovtigre-tests --bin auto -- [--scene NAME] [--file SCENE.glb]… [--jobs WIDTHxSAMPLES,…] [--seeds N] [--runs N]`.
//! Where files are given, only these are tried. True errors are over so many runs: one may happen not to meet what others do.
//!
//! Errors are compared after the same time. Each method renders 1, 2, 4 … samples, and between two of these its error is taken to fall as
//! a power of them, so that none is compared with the advantage that the sampler has at powers of two.
//! Time is that of one thread on a processor, so that others on the machine count little; methods take turns.

use anyhow::{Context as _, bail};
use glam::Vec3;
use ovtigre_core::{
    film::{
        append::Prefix,
        batch::{Batch, Block},
        estimate::{Picture, picture},
        reference::Reference,
        size::Size,
        sum::Sum,
    },
    gltf::limits::Limits,
    path::{
        expression::language::Language,
        reach::{LightKind, unreachable},
    },
    render::{
        batch::render,
        inspect::{by_chance, casts, inspect},
        pilot::{
            plan::{Chance, NoPilot, Plan},
            report::Pilot,
            trying::pilot,
        },
        prepare::{Prepared, prepare},
        progress::Progress,
    },
    settings::{FULL, Method, Settings},
};
use ovtigre_tests::{
    glb::Glb,
    matrix,
    picture::settings,
    room::room,
    scenes::{cornell, floor, glass, lambert, sphere, two_rooms},
    showcase::{caustic, lamp_behind_glass},
    stage,
    thread_time::thread_seconds,
};
use std::{fmt::Write as _, io::Write as _, path::Path};

const METHODS: [Method; 4] = [Method::Path, Method::Bidirectional, Method::Caustics, Method::Light];
/// Of them, and of a job.
const REPLICATES: u32 = 8;
const REPLICATES_OF_A_JOB: u32 = 4;
/// Of the pictures that are compared.
const SIZE: Size = Size { width: 96, height: 54 };
/// Seed of references; what is compared has others.
const REFERENCE_SEED: u64 = u64::MAX;
/// Time of a reference over that of the longest of what is compared with it.
const REFERENCE: f64 = 8.0;

/// A job of a frame so wide, 16:9, with so many samples a pixel.
#[derive(Clone, Copy, Debug)]
struct Job {
    width: u32,
    samples: u32,
}

struct Arguments {
    scene: Option<String>,
    files: Vec<(String, Vec<u8>)>,
    jobs: Vec<Job>,
    seeds: u64,
    runs: u64,
}

fn main() -> anyhow::Result<()> {
    let jobs = vec![Job { width: 480, samples: 256 }];
    let mut asked = Arguments { scene: None, files: Vec::new(), jobs, seeds: 8, runs: 1 };
    let mut arguments = std::env::args().skip(1);
    while let Some(flag) = arguments.next() {
        let value = arguments.next().with_context(|| format!("{flag} needs a value"))?;
        match flag.as_str() {
            "--seeds" => asked.seeds = value.parse()?,
            "--runs" => asked.runs = value.parse()?,
            "--jobs" => asked.jobs = value.split(',').map(job).collect::<anyhow::Result<_>>()?,
            "--scene" => asked.scene = Some(value),
            "--file" => asked.files.push(read(&value)?),
            _ => bail!("{flag} is no flag"),
        }
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let ours = if asked.files.is_empty() { scenes() } else { Vec::new() };
    for (name, glb) in ours.iter().chain(&asked.files) {
        if asked.scene.as_ref().is_none_or(|scene| scene == name) {
            let tables = pool.install(|| compare(name, glb, &asked))?;
            writeln!(std::io::stdout(), "{tables}")?;
        }
    }
    Ok(())
}

/// A scene in one file, by the file's name.
fn read(path: &str) -> anyhow::Result<(String, Vec<u8>)> {
    let name = Path::new(path).file_stem().context("--file needs a file")?;
    Ok((name.to_string_lossy().into_owned(), std::fs::read(path).with_context(|| path.to_owned())?))
}

/// The scenes of the repository.
fn scenes() -> Vec<(String, Vec<u8>)> {
    let scenes = [
        ("room", room()),
        ("cornell", cornell()),
        ("two-rooms", two_rooms()),
        ("caustic", caustic()),
        ("lamp-behind-glass", lamp_behind_glass()),
        ("glossy", matrix::smooth_normals().glb),
        ("coated", matrix::coated().glb),
        ("rough-glass", matrix::ball_of_glass(0.5).glb),
        ("under-sky", under_sky()),
        ("outdoors", outdoors()),
    ];
    scenes.into_iter().map(|(name, glb)| (name.to_owned(), glb)).collect()
}

/// Plastic and metal without a lamp, so that there is a sky.
fn under_sky() -> Vec<u8> {
    stage::room(0.0, |glb| {
        stage::smooth_sphere(glb, stage::plastic(0.3), Vec3::new(-0.4, -0.5, 0.0), 0.45);
        stage::smooth_sphere(glb, stage::metal(0.2), Vec3::new(0.5, -0.4, 0.2), 0.4);
    })
}

/// Three balls on a wide floor, with sky in most of the picture.
fn outdoors() -> Vec<u8> {
    let mut glb = Glb::new();
    glb.body(lambert(0.4, 0.0), floor(0.0, 60.0, 0.0, 0.0));
    stage::smooth_sphere(&mut glb, stage::plastic(0.2), Vec3::new(-1.3, 0.5, 0.0), 0.5);
    stage::smooth_sphere(&mut glb, stage::metal(0.3), Vec3::new(1.3, 0.5, 0.0), 0.5);
    glb.body(glass(1.5), sphere(Vec3::new(0.0, 0.55, 0.3), 0.5, 24));
    glb.perspective(Vec3::new(0.0, 0.6, 6.0), Vec3::new(0.0, 1.6, 0.0), 45.0);
    glb.finish()
}

fn job(text: &str) -> anyhow::Result<Job> {
    let (width, samples) = text.split_once('x').with_context(|| format!("{text} is no WIDTHxSAMPLES"))?;
    Ok(Job { width: width.parse()?, samples: samples.parse()? })
}

/// A method on trial, with more and more samples.
struct Measured {
    settings: Settings,
    lanes: Vec<Prefix>,
    seconds: f64,
    /// Of the true error, after each block.
    squares: Vec<f64>,
}

impl Measured {
    fn new(method: Method, settings: &Settings) -> Self {
        let lanes = (0..settings.replicates).map(|r| Prefix::empty(settings.size.frame(), r, 1)).collect();
        let settings = Settings { method, ..settings.clone() };
        Self { settings, lanes, seconds: 0.0, squares: Vec::new() }
    }

    /// Seconds of one sample of all pixels of a replicate.
    fn once(&self, prepared: &Prepared) -> f64 {
        let start = thread_seconds();
        self.block(prepared, 0, Block { index: 0, start: 0, count: 4 });
        0.25 * (thread_seconds() - start)
    }

    fn block(&self, prepared: &Prepared, replicate: u32, block: Block) -> Sum {
        let batch = Batch { region: self.settings.size.frame(), replicate, block };
        render(prepared, &self.settings, batch, &Progress::new()).expect("not stopped")
    }

    /// Renders a block of one replicate.
    fn take_turn(&mut self, prepared: &Prepared, replicate: u32, index: u32) {
        let start = thread_seconds();
        let sum = self.block(prepared, replicate, doubling(index));
        self.seconds += thread_seconds() - start;
        self.lanes[replicate as usize].append(&sum).expect("blocks come in order");
    }

    fn picture(&self) -> Picture {
        picture(SIZE, SIZE.frame(), std::slice::from_ref(&self.lanes))
    }

    fn method(&self) -> Method {
        self.settings.method
    }

    /// Samples of all pixels and replicates.
    fn all_samples(&self) -> f64 {
        let each = self.lanes.iter().map(|lane| f64::from(lane.samples()));
        each.sum::<f64>() * self.settings.size.pixels() as f64
    }

    fn seconds_a_sample(&self) -> f64 {
        self.seconds / self.all_samples()
    }

    /// Samples of a pixel in so many seconds, over all replicates.
    fn samples_in(&self, seconds: f64) -> f64 {
        seconds / (self.seconds_a_sample() * self.settings.size.pixels() as f64)
    }

    /// Of the true error after so many seconds: between two blocks a power of the samples.
    fn square_in(&self, seconds: f64) -> f64 {
        let doublings = (self.samples_in(seconds) / f64::from(self.settings.replicates)).log2();
        let before = (doublings.max(0.0) as usize).min(self.squares.len() - 2);
        let [from, to] = [self.squares[before], self.squares[before + 1]];
        from * (to / from).powf(doublings - before as f64)
    }
}

/// Each block but the first doubles the samples.
fn doubling(index: u32) -> Block {
    let start = if index == 0 { 0 } else { 1 << (index - 1) };
    Block { index, start, count: start.max(1) }
}

/// A picture that is known well enough for a job of so many samples by `path`.
fn reference(prepared: &Prepared, settings: &Settings, samples: u32) -> Reference {
    let seconds =
        Measured::new(Method::Path, settings).once(prepared) * f64::from(samples / REPLICATES_OF_A_JOB);
    let other = Settings { seed: REFERENCE_SEED, ..settings.clone() };
    let mut reference = Measured::new(Method::Bidirectional, &other);
    let doublings = (REFERENCE * seconds / reference.once(prepared)).log2().round().max(1.0) as u32;
    for index in 0..=doublings {
        (0..settings.replicates).for_each(|replicate| reference.take_turn(prepared, replicate, index));
    }
    Reference::of_picture(&reference.picture())
}

/// Every method, for the time of so many samples by `path` and until its samples are a power of two. Squares of errors are means over the runs.
fn measure(
    prepared: &Prepared,
    settings: &Settings,
    samples: u32,
    (reference, runs): (&Reference, u64),
) -> Vec<Measured> {
    let once = METHODS.map(|method| Measured::new(method, settings).once(prepared));
    let by_path = f64::from(samples / REPLICATES_OF_A_JOB);
    // The next power of two, but for a little that may be wrong with what is taken for the time of a sample.
    let doublings = |seconds: f64| ((by_path * once[0] / seconds).log2() - 0.1).ceil().max(1.0) as u32;
    let sized = once.map(|seconds| doublings(seconds) + 1);
    let mut all: Vec<Measured> = Vec::new();
    for run in 0..runs {
        let settings = Settings { seed: settings.seed + run, ..settings.clone() };
        let mut these: Vec<Measured> =
            METHODS.iter().map(|method| Measured::new(*method, &settings)).collect();
        for index in 0..sized.into_iter().fold(0, u32::max) {
            for replicate in 0..settings.replicates {
                let going = these.iter_mut().zip(sized).filter(|(_, blocks)| index < *blocks);
                going.for_each(|(one, _)| one.take_turn(prepared, replicate, index));
            }
            for (one, _) in these.iter_mut().zip(sized).filter(|(_, blocks)| index < *blocks) {
                let error = reference.relative_error(&one.picture().planes[0]);
                one.squares.push(error * error);
            }
        }
        if run == 0 {
            all = these;
        } else {
            for (one, other) in all.iter_mut().zip(these) {
                one.seconds += other.seconds;
                one.squares.iter_mut().zip(other.squares).for_each(|(sum, square)| *sum += square);
            }
        }
    }
    for one in &mut all {
        one.seconds /= runs as f64;
        one.squares.iter_mut().for_each(|square| *square /= runs as f64);
    }
    all
}

fn compare(name: &str, glb: &[u8], asked: &Arguments) -> anyhow::Result<String> {
    let contents = inspect(glb, &Limits::default())?;
    let language = Language::compile(&[FULL])?;
    let around = contents.surroundings(&language.tags().collect::<Vec<_>>());
    let is_open = |method: &Method| {
        unreachable(&language, *method, &around, None).is_empty()
            && (*method != Method::Caustics || casts(contents.letters))
    };
    let plan = |job: Job, seed: u64| {
        let settings = Settings { seed, ..settings(job.width, job.width * 9 / 16, 4) };
        Plan {
            region: settings.size.frame(),
            settings,
            samples: job.samples,
            error_target: None,
            seconds: None,
            triangles: contents.report.triangles,
            pixels: contents.report.pixels,
            chance: match by_chance(Method::Path, contents.letters, contents.brightest) {
                None => Chance::Never,
                Some(_) if around.lights.iter().all(|(kind, _)| *kind != LightKind::Surface) => Chance::Never,
                Some(_) => Chance::Sometimes,
            },
            methods: METHODS.into_iter().filter(is_open).collect(),
        }
    };
    if !METHODS.iter().any(is_open) {
        bail!("{name}: no method makes all paths, so that there is nothing to choose from");
    }
    let small = settings(SIZE.width, SIZE.height, REPLICATES);
    let prepared = prepare(glb, None, &small)?;
    let longest = asked.jobs.iter().map(|job| job.samples).max().context("there are no jobs")?;
    let reference = reference(&prepared, &small, longest);
    let mut out = format!("{name}: the reference is known to {:.4}\n", reference.own_error());
    let measured = measure(&prepared, &small, longest, (&reference, asked.runs));
    let open: Vec<&Measured> = measured.iter().filter(|one| is_open(&one.method())).collect();
    let pixels = SIZE.pixels() as f64;
    for (i, job) in asked.jobs.iter().enumerate() {
        let tried: Vec<Tried> = (0..asked.seeds).map(|seed| Tried::new(glb, &plan(*job, seed))).collect();
        // That of as many samples of each replicate by `path`.
        let samples = f64::from(job.samples / REPLICATES_OF_A_JOB * REPLICATES);
        let seconds = measured[0].seconds_a_sample() * pixels * samples;
        let best = open.iter().map(|one| one.square_in(seconds)).fold(f64::INFINITY, f64::min);
        if i == 0 || asked.jobs[i - 1].samples != job.samples {
            fixed(&mut out, (&measured, &tried[0]), (seconds, best))?;
        }
        chosen(&mut out, *job, &tried, (&open, seconds, best))?;
    }
    Ok(out)
}

/// A pilot, and the time it took.
struct Tried {
    found: Result<Pilot, NoPilot>,
    method: Method,
    seconds: f64,
}

impl Tried {
    fn new(glb: &[u8], plan: &Plan) -> Self {
        let start = thread_seconds();
        let found = pilot(glb, None, plan).map(|(pilot, _)| pilot);
        let method = found.as_ref().map_or_else(|_| plan.untried(), |pilot| pilot.method);
        Self { found, method, seconds: thread_seconds() - start }
    }
}

/// Each method, and what the first pilot says of it.
fn fixed(
    out: &mut String,
    (measured, tried): (&[Measured], &Tried),
    (seconds, best): (f64, f64),
) -> anyhow::Result<()> {
    writeln!(
        out,
        "\n| method | samples | rays a sample | µs a sample | true error | time for the same error | by the pilot |"
    )?;
    writeln!(out, "| --- | ---: | ---: | ---: | ---: | ---: | ---: |")?;
    for one in measured {
        let trials = tried.found.iter().flat_map(|pilot| &pilot.trials);
        let by_pilot = trials.into_iter().find(|trial| trial.method == one.method());
        let by_pilot = by_pilot.map_or("–".to_owned(), |trial| {
            format!(
                "{:.2} (error {:.3}, by its error {:.3}, expected {:.3}, missed {:.3})",
                trial.time_ratio,
                trial.relative_error,
                trial.square_error.sqrt(),
                trial.expected_error,
                trial.missed
            )
        });
        let rays: u64 = one.lanes.iter().map(Prefix::rays).sum();
        writeln!(
            out,
            "| {} | {:.0} | {:.2} | {:.2} | {:.4} | {:.2} | {by_pilot} |",
            one.method().name(),
            one.samples_in(seconds),
            rays as f64 / one.all_samples(),
            1e6 * one.seconds_a_sample(),
            one.square_in(seconds).sqrt(),
            one.square_in(seconds) / best,
        )?;
    }
    writeln!(out)?;
    Ok(())
}

/// What pilots of several seeds choose for a job.
fn chosen(
    out: &mut String,
    job: Job,
    tried: &[Tried],
    (open, seconds, best): (&[&Measured], f64, f64),
) -> anyhow::Result<()> {
    let all = tried.len() as f64;
    let pixels = f64::from(job.width * (job.width * 9 / 16));
    // Of the job by the method that is taken: the pilot's time, and the whole time over that of the best.
    let mut rows = Vec::new();
    for one in tried {
        let taken = open.iter().find(|measured| measured.method() == one.method).context("one of them")?;
        let share = one.seconds / (taken.seconds_a_sample() * pixels * f64::from(job.samples));
        rows.push((share, taken.square_in(seconds) / best * (1.0 + share)));
    }
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| rows.iter().map(of).sum::<f64>() / all;
    let taken: Vec<String> = (open.iter())
        .map(|one| (one.method(), tried.iter().filter(|tried| tried.method == one.method()).count()))
        .filter(|(_, times)| *times > 0)
        .map(|(method, times)| format!("{} {times}", method.name()))
        .collect();
    let worst = rows.iter().map(|row| row.1).fold(0.0, f64::max);
    let worst_fixed = open.iter().map(|one| one.square_in(seconds)).fold(0.0, f64::max) / best;
    let counted = tried.iter().flat_map(|one| &one.found).map(|pilot| pilot.share).fold(0.0, f64::max);
    writeln!(
        out,
        "{}x{}: {}; {:.2} of the time of the best on average, {worst:.2} at most, by the worst method {worst_fixed:.2}; \
         pilot {:.2} s, {:.2} % of the job, {:.2} % as counted at most",
        job.width,
        job.samples,
        taken.join(", "),
        mean(&|row| row.1),
        tried.iter().map(|one| one.seconds).sum::<f64>() / all,
        100.0 * mean(&|row| row.0),
        100.0 * counted,
    )?;
    Ok(())
}

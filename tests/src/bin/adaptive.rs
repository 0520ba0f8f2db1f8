//! Measures what adaptive sampling gains over uniform sampling, and prints the table of docs/PERFORMANCE.md:
//! `cargo run -p ovtigre-tests --bin adaptive -- [--runs N] [--width N] [--samples N] [--scene NAME|FILE.glb]`.
//!
//! Time is that of one thread on a processor, so that others on the machine count little.

use anyhow::{Context as _, bail};
use ovtigre_core::{
    film::{reference::Reference, size::Size},
    render::prepare::Prepared,
    settings::{Distribution, Method, Settings},
};
use ovtigre_tests::{
    picture::{rendered_of, scene, settings},
    room::room,
    scenes::{cornell, two_rooms},
    showcase::{caustic, lamp_behind_glass},
    thread_time::thread_seconds,
};
use std::io::Write as _;

const REPLICATES: u32 = 4;
/// Samples of a reference over those of what is compared with it.
const REFERENCE: u32 = 16;

struct Arguments {
    runs: u64,
    width: u32,
    samples: u32,
    only: Option<String>,
}

fn main() -> anyhow::Result<()> {
    let mut asked = Arguments { runs: 4, width: 160, samples: 256, only: None };
    let mut arguments = std::env::args().skip(1);
    while let Some(flag) = arguments.next() {
        let value = arguments.next().with_context(|| format!("{flag} needs a value"))?;
        match flag.as_str() {
            "--runs" => asked.runs = value.parse()?,
            "--width" => asked.width = value.parse()?,
            "--samples" => asked.samples = value.parse()?,
            "--scene" => asked.only = Some(value),
            _ => bail!("{flag} is no flag"),
        }
    }
    let own = [
        ("room", room as fn() -> Vec<u8>),
        ("cornell", cornell),
        ("two-rooms", two_rooms),
        ("caustic", caustic),
        ("lamp-behind-glass", lamp_behind_glass),
    ];
    let mut out = std::io::stdout().lock();
    writeln!(
        out,
        "| scene | samples | error, uniform | adaptive | time, adaptive over uniform | gain | true gain |"
    )?;
    writeln!(out, "| --- | ---: | ---: | ---: | ---: | ---: | ---: |")?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut line = |name: &str, glb: &[u8]| -> anyhow::Result<()> {
        writeln!(out, "{}", pool.install(|| compare(name, glb, &asked)))?;
        Ok(out.flush()?)
    };
    match asked.only.as_deref().filter(|only| only.contains('.')) {
        Some(file) => line(file, &std::fs::read(file)?),
        None => (own.iter().filter(|(name, _)| asked.only.as_deref().is_none_or(|only| only == *name)))
            .try_for_each(|(name, glb)| line(name, &glb())),
    }
}

/// Both ways, with the same seeds.
fn compare(name: &str, glb: &[u8], asked: &Arguments) -> String {
    let of = |seed, sampling, replicates| {
        let size = Size { width: asked.width, height: asked.width * 9 / 16 };
        let settings = settings(size.width, size.height, replicates);
        Settings { method: Method::Path, seed, sampling, ..settings }
    };
    let prepared = scene(glb, &of(0, Distribution::Uniform, REPLICATES));
    let own = asked.samples / REPLICATES;
    let reference = of(u64::MAX, Distribution::Uniform, 16);
    let reference = rendered_of(&prepared, &reference, asked.samples * REFERENCE / 16);
    let reference = Reference::of_picture(&reference.picture());
    let mut totals = [Measured::default(); 2];
    for seed in 0..asked.runs {
        for (total, way) in totals.iter_mut().zip([Distribution::Uniform, Distribution::Adaptive]) {
            let settings = of(seed, way, REPLICATES);
            total.add(&measure(&prepared, &settings, own, &reference));
        }
    }
    let [uniform, adaptive] = totals;
    let error = |m: Measured| (m.square / asked.runs as f64).sqrt();
    format!(
        "| {name} | {} | {:.4} | {:.4} | {:.2} | {:.2} | {:.2} |",
        asked.samples,
        error(uniform),
        error(adaptive),
        adaptive.seconds / uniform.seconds,
        uniform.square * uniform.seconds / (adaptive.square * adaptive.seconds),
        uniform.truth * uniform.seconds / (adaptive.truth * adaptive.seconds),
    )
}

#[derive(Clone, Copy, Default)]
struct Measured {
    /// Squared relative errors, as estimated.
    square: f64,
    /// The same against the reference.
    truth: f64,
    seconds: f64,
}

impl Measured {
    fn add(&mut self, other: &Self) {
        self.square += other.square;
        self.truth += other.truth;
        self.seconds += other.seconds;
    }
}

fn measure(prepared: &Prepared, settings: &Settings, samples: u32, reference: &Reference) -> Measured {
    let before = thread_seconds();
    let done = rendered_of(prepared, settings, samples);
    let seconds = thread_seconds() - before;
    let truth = reference.relative_error(&done.picture().planes[0]);
    Measured { square: done.error().relative.powi(2), truth: truth * truth, seconds }
}

//! Measures what method `auto` chooses against every fixed method, and prints the table of docs/PERFORMANCE.md:
//! `cargo run --release -p ovtigre-tests --bin auto -- [--seconds N] [--scene NAME] [--samples N] [--width N]`.
//!
//! Time is that of one thread on a processor, so that others on the machine count little.

use anyhow::{Context as _, bail};
use ovtigre_core::{
    film::{
        append::Prefix,
        batch::{Batch, Block},
        estimate::picture,
        reference::Reference,
        size::Size,
    },
    gltf::limits::Limits,
    path::{expression::language::Language, reach::unreachable},
    render::{
        batch::render,
        inspect::{by_chance, inspect},
        pilot::{Chance, Pilot, Plan, pilot},
        prepare::{Prepared, prepare},
        progress::Progress,
    },
    settings::{FULL, Method, Settings},
};
use ovtigre_tests::{
    picture::settings,
    room::room,
    scenes::{cornell, two_rooms},
    showcase::{caustic, lamp_behind_glass},
    thread_time::thread_seconds,
};
use std::{fmt::Write as _, io::Write as _};

const METHODS: [Method; 3] = [Method::Path, Method::Bidirectional, Method::Light];
const REPLICATES: u32 = 16;
/// Of the pictures that are compared.
const SIZE: Size = Size { width: 96, height: 54 };
/// Seed of references; what is compared has others.
const REFERENCE_SEED: u64 = u64::MAX;
/// Time of a reference over that of what is compared with it.
const REFERENCE: f64 = 4.0;

struct Arguments {
    seconds: f64,
    scene: Option<String>,
    samples: u32,
    width: u32,
}

fn main() -> anyhow::Result<()> {
    let mut asked = Arguments { seconds: 8.0, scene: None, samples: 256, width: 480 };
    let mut arguments = std::env::args().skip(1);
    while let Some(flag) = arguments.next() {
        let value = arguments.next().with_context(|| format!("{flag} needs a value"))?;
        match flag.as_str() {
            "--seconds" => asked.seconds = value.parse()?,
            "--samples" => asked.samples = value.parse()?,
            "--width" => asked.width = value.parse()?,
            "--scene" => asked.scene = Some(value),
            _ => bail!("{flag} is no flag"),
        }
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let scenes: [(&str, Vec<u8>); 5] = [
        ("room", room()),
        ("cornell", cornell()),
        ("two-rooms", two_rooms()),
        ("caustic", caustic()),
        ("lamp-behind-glass", lamp_behind_glass()),
    ];
    for (name, glb) in scenes.iter().filter(|(name, _)| asked.scene.as_deref().is_none_or(|s| s == *name)) {
        let table = pool.install(|| compare(name, glb, &asked))?;
        writeln!(std::io::stdout(), "{table}")?;
    }
    Ok(())
}

/// What a method did in its time.
struct Measured {
    method: Method,
    seconds: f64,
    samples_a_pixel: u32,
    samples: f64,
    rays: u64,
    error: f64,
}

impl Measured {
    /// The time for an error is in proportion to it.
    fn cost(&self) -> f64 {
        self.error * self.error * self.seconds
    }
}

fn compare(name: &str, glb: &[u8], asked: &Arguments) -> anyhow::Result<String> {
    let contents = inspect(glb, &Limits::default())?;
    let language = Language::compile(&[FULL])?;
    let around = contents.surroundings(&language.tags().collect::<Vec<_>>());
    let makes_all = |method: &Method| unreachable(&language, *method, &around, None).is_empty();
    let job = settings(asked.width, asked.width * 9 / 16, 4);
    let plan = Plan {
        region: job.size.frame(),
        settings: job,
        samples: asked.samples,
        error_target: None,
        seconds: None,
        triangles: contents.report.triangles,
        chance: match by_chance(Method::Path, contents.letters, contents.brightest) {
            None => Chance::Never,
            Some(_) => Chance::Sometimes,
        },
        methods: METHODS.into_iter().filter(makes_all).collect(),
    };
    let start = thread_seconds();
    let (tried, _) = pilot(glb, None, &plan)?;
    let pilot_seconds = thread_seconds() - start;

    let small = settings(SIZE.width, SIZE.height, REPLICATES);
    let prepared = prepare(glb, None, &small)?;
    let other = Settings { method: Method::Bidirectional, seed: REFERENCE_SEED, ..small.clone() };
    let (lanes, _) = run(&prepared, &other, REFERENCE * asked.seconds);
    let reference = Reference::of_picture(&picture(SIZE, SIZE.frame(), &lanes));
    let measured = METHODS.map(|method| {
        let (lanes, seconds) = run(&prepared, &Settings { method, ..small.clone() }, asked.seconds);
        let error = reference.relative_error(&picture(SIZE, SIZE.frame(), &lanes).planes[0]);
        let samples_a_pixel = lanes[0].iter().map(Prefix::samples).sum();
        let rays = lanes[0].iter().map(Prefix::rays).sum();
        let samples = f64::from(samples_a_pixel) * SIZE.pixels() as f64;
        Measured { method, seconds, samples_a_pixel, samples, rays, error }
    });
    let about = format!("{name}: the reference is known to {:.4}", reference.own_error());
    table(&about, &plan, (&tried, pilot_seconds), &measured)
}

/// Replicates, and the seconds that they took: the time is not used up where another block would take too long.
fn run(prepared: &Prepared, settings: &Settings, seconds: f64) -> (Vec<Vec<Prefix>>, f64) {
    let region = settings.size.frame();
    let mut lanes = vec![(0..settings.replicates).map(|r| Prefix::empty(region, r, 1)).collect::<Vec<_>>()];
    let start = thread_seconds();
    let (mut index, mut drawn) = (0, 0);
    loop {
        let block = Block { index, start: drawn, count: drawn.max(1) };
        for prefix in &mut lanes[0] {
            let batch = Batch { region, replicate: prefix.replicate(), block };
            let sum = render(prepared, settings, batch, &Progress::new()).expect("not stopped");
            prefix.append(&sum).expect("in order");
        }
        (index, drawn) = (index + 1, drawn + block.count);
        let spent = thread_seconds() - start;
        if 1.5 * spent > seconds {
            return (lanes, spent);
        }
    }
}

fn table(
    about: &str,
    plan: &Plan,
    (pilot, pilot_seconds): (&Pilot, f64),
    measured: &[Measured],
) -> anyhow::Result<String> {
    let mut out = format!("{about}\n\n");
    let whole = measured.iter().filter(|one| pilot.trials.iter().any(|trial| trial.method == one.method));
    let best = whole.map(Measured::cost).fold(f64::INFINITY, f64::min);
    writeln!(
        out,
        "| method | samples | rays a sample | µs a sample | true error | time for the same error | by the pilot |"
    )?;
    writeln!(out, "| --- | ---: | ---: | ---: | ---: | ---: | ---: |")?;
    for one in measured {
        let tried = pilot.trials.iter().find(|trial| trial.method == one.method);
        let [time, tried] = tried.map_or(["–".to_owned(), "leaves out paths".to_owned()], |tried| {
            let time = format!("{:.2}", one.cost() / best);
            [
                time,
                format!(
                    "{:.2} (error {:.3}, by its error {:.3}, missed {:.3})",
                    tried.time_ratio,
                    tried.relative_error,
                    tried.square_error.sqrt(),
                    tried.missed
                ),
            ]
        });
        writeln!(
            out,
            "| {} | {} | {:.2} | {:.2} | {:.4} | {time} | {tried} |",
            one.method.name(),
            one.samples_a_pixel,
            one.rays as f64 / one.samples,
            1e6 * one.seconds / one.samples,
            one.error,
        )?;
    }
    let taken = measured.iter().find(|one| one.method == pilot.method).context("one of them")?;
    let job = plan.settings.size.pixels() as f64 * f64::from(plan.samples);
    let share = pilot_seconds / (taken.seconds / taken.samples * job);
    writeln!(
        out,
        "\nauto: {}, {:.2} of the time of the best, the pilot's {:.2} s included: {:.2} % of the job, {:.2} % as counted",
        pilot.method.name(),
        taken.cost() / best * (1.0 + share),
        pilot_seconds,
        100.0 * share,
        100.0 * pilot.share,
    )?;
    Ok(out)
}

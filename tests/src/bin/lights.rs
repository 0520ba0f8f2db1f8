//! Measures the choice among many lights by a tree against that by their power, and prints the table of
//! docs/PERFORMANCE.md: `cargo run -p ovtigre-tests --bin lights -- [--seconds N] [--most LIGHTS] [--hall NAME]`.
//!
//! Time is that of one thread on a processor, so that others on the machine count little.

use anyhow::{Context as _, bail};
use ovtigre_core::settings::Settings;
use ovtigre_tests::{
    lamps::{Hall, lamps},
    picture::{rendered_of, scene, settings},
    thread_time::thread_seconds,
};
use std::io::Write as _;

const REPLICATES: u32 = 16;
const LIGHTS: [u32; 11] = [1, 2, 4, 8, 16, 32, 100, 256, 1_000, 10_000, 100_000];

fn main() -> anyhow::Result<()> {
    let (mut seconds, mut most, mut only) = (1.0, 10_000, None);
    let mut arguments = std::env::args().skip(1);
    while let Some(flag) = arguments.next() {
        let value = arguments.next().with_context(|| format!("{flag} needs a value"))?;
        match flag.as_str() {
            "--seconds" => seconds = value.parse()?,
            "--most" => most = value.parse()?,
            "--hall" => only = Some(value),
            _ => bail!("{flag} is no flag"),
        }
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let mut out = std::io::stdout();
    writeln!(
        out,
        "| hall | lights | error by power | by tree | µs a sample by power | by tree | rays | work by power over tree, time | rays |"
    )?;
    writeln!(out, "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")?;
    let halls = [Hall::Open, Hall::Rooms, Hall::OneLamp];
    for hall in halls.into_iter().filter(|hall| only.as_ref().is_none_or(|only| *only == format!("{hall:?}")))
    {
        for n in LIGHTS.into_iter().filter(|n| *n <= most) {
            writeln!(out, "{}", pool.install(|| row(n, hall, seconds)))?;
        }
    }
    Ok(())
}

/// What a choice did.
struct Measured {
    error: f64,
    seconds: f64,
    rays: f64,
    samples: f64,
}

impl Measured {
    /// Microseconds and rays a sample.
    fn a_sample(&self) -> [f64; 2] {
        [1e6 * self.seconds / self.samples, self.rays / self.samples]
    }

    /// The time and the rays for an error are in proportion to them.
    fn work(&self) -> [f64; 2] {
        self.a_sample().map(|one| one * self.error * self.error * self.samples)
    }
}

fn row(n: u32, hall: Hall, seconds: f64) -> String {
    let settings = settings(96, 54, REPLICATES);
    let glb = lamps(n, hall);
    let mut prepared = scene(&glb, &settings);
    let lights = [
        prepared.scene.lights.clone().by_power(),
        prepared.scene.lights.clone().by_tree(&prepared.scene.data),
    ];
    let mut samples = 1;
    let mut measured = Vec::new();
    while measured.is_empty() {
        for lights in &lights {
            prepared.scene.lights = lights.clone();
            let start = thread_seconds();
            let rendered =
                rendered_of(&prepared, &Settings { seed: u64::from(samples), ..settings.clone() }, samples);
            let seconds = thread_seconds() - start;
            let error = rendered.error().relative;
            measured.push(Measured {
                error,
                seconds,
                rays: rendered.rays() as f64,
                samples: rendered.samples() as f64,
            });
        }
        if measured.iter().map(|one| one.seconds).sum::<f64>() < seconds {
            measured.clear();
            samples *= 2;
        }
    }
    let [power, tree] = &measured[..] else { return String::new() };
    let ([a, _], [b, rays]) = (power.a_sample(), tree.a_sample());
    let [time, by_rays] = [0, 1].map(|of| power.work()[of] / tree.work()[of]);
    format!(
        "| {hall:?} | {n} | {:.4} | {:.4} | {a:.2} | {b:.2} | {rays:.2} | {time:.2} | {by_rays:.2} |",
        power.error, tree.error
    )
}

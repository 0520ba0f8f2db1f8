//! Writes docs/STABILITY.md: `cargo run -p ovtigre-tests --bin stability -- -o docs/STABILITY.md`.

use anyhow::{Context as _, bail};
use ovtigre_tests::stability::{
    budget::Budget,
    case::Case,
    cases,
    report::{Row, page},
};
use std::{
    collections::BTreeMap,
    fs,
    path::PathBuf,
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    time::Instant,
};

const USAGE: &str =
    "stability [--only PART-OF-A-NAME] [--samples-scale X] [--threads N] [--seconds S] [-o FILE.md] [--list]";

struct Wishes {
    only: String,
    scale: f64,
    threads: usize,
    /// After which no trial is begun.
    seconds: f64,
    output: Option<PathBuf>,
    lists: bool,
}

fn wishes() -> anyhow::Result<Wishes> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let (only, seconds) = (String::new(), f64::INFINITY);
    let mut wishes = Wishes { only, scale: 1.0, threads, seconds, output: None, lists: false };
    let mut given = std::env::args().skip(1);
    while let Some(flag) = given.next() {
        let mut value = || given.next().with_context(|| format!("{flag} needs a value: {USAGE}"));
        match flag.as_str() {
            "--only" => wishes.only = value()?,
            "--samples-scale" => wishes.scale = value()?.parse().context("a number like 0.1")?,
            "--threads" => wishes.threads = value()?.parse().context("a number of threads")?,
            "--seconds" => wishes.seconds = value()?.parse().context("a number of seconds")?,
            "-o" => wishes.output = Some(value()?.into()),
            "--list" => wishes.lists = true,
            _ => bail!("{flag} is not known: {USAGE}"),
        }
    }
    Ok(wishes)
}

#[expect(clippy::print_stderr, clippy::print_stdout, reason = "this is a program")]
fn main() -> anyhow::Result<()> {
    let wishes = wishes()?;
    let cases: Vec<Case> = cases().into_iter().filter(|case| case.name.contains(&wishes.only)).collect();
    if wishes.lists {
        for case in &cases {
            println!("{}: {}: {:?}", case.group, case.name, case.trials);
        }
        return Ok(());
    }
    let rows = look(&cases, &wishes);
    let rows: Vec<(&Case, Vec<Option<Row>>)> = cases.iter().zip(rows).collect();
    let head = format!(
        "Made by `cargo run -p ovtigre-tests --bin stability -- --samples-scale {} -o docs/STABILITY.md`.",
        wishes.scale
    );
    let text = page(&rows, &head);
    match &wishes.output {
        Some(file) => {
            fs::write(file, text).with_context(|| format!("{} cannot be written", file.display()))?;
        }
        None => println!("{text}"),
    }
    eprintln!("done");
    Ok(())
}

/// Looks at all trials, each on one thread, those that take long first.
#[expect(clippy::print_stderr, reason = "progress of a program")]
fn look(cases: &[Case], wishes: &Wishes) -> Vec<Vec<Option<Row>>> {
    let (budget, begun) = (Budget { share: wishes.scale, counts: wishes.scale.max(1.0) }, Instant::now());
    let mut all: Vec<(usize, usize)> =
        cases.iter().enumerate().flat_map(|(c, case)| (0..case.trials.len()).map(move |t| (c, t))).collect();
    // Bidirectional takes longest.
    all.sort_by_key(|&(c, t)| cases[c].trials[t].by != "bidirectional");
    let (next, rows) = (AtomicUsize::new(0), Mutex::new(BTreeMap::new()));
    std::thread::scope(|scope| {
        for _ in 0..wishes.threads {
            scope.spawn(|| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
                while let Some(&(c, t)) = all.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if begun.elapsed().as_secs_f64() > wishes.seconds {
                        break;
                    }
                    let start = Instant::now();
                    let finding = pool.install(|| cases[c].trials[t].look(budget));
                    let seconds = start.elapsed().as_secs_f64();
                    let trial = &cases[c].trials[t].by;
                    eprintln!(
                        "{:?} {}, {trial}: {:?}, {seconds:.1} s",
                        finding.verdict(),
                        cases[c].name,
                        finding.answer
                    );
                    rows.lock().expect("no thread panics").insert((c, t), Row { finding, seconds });
                }
            });
        }
    });
    let rows = rows.into_inner().expect("no thread panics");
    (0..cases.len())
        .map(|c| (0..cases[c].trials.len()).map(|t| rows.get(&(c, t)).copied()).collect())
        .collect()
}

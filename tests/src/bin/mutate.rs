//! Reads and renders scenes changed by chance:
//! `cargo run -p ovtigre-tests --bin mutate -- --count 50000 --folder found`.

use anyhow::{Context as _, bail};
use ovtigre_tests::mutate::{Mutator, Outcome, most_memory, outcome};
use std::{collections::BTreeMap, path::PathBuf, time::Instant};

const USAGE: &str =
    "mutate [--seed N] [--from NUMBER] [--count N] [--seconds S] [--folder WHERE-FINDS-ARE-KEPT]";
/// Memory that a file may take.
const MEMORY: u64 = 4 << 30;

#[expect(clippy::print_stdout, clippy::print_stderr, reason = "this is a program")]
fn main() -> anyhow::Result<()> {
    let (mut seed, mut from, mut files, mut seconds, mut folder) = (1, 0, 1000, f64::INFINITY, None);
    let mut given = std::env::args().skip(1);
    while let Some(flag) = given.next() {
        let value = given.next().with_context(|| format!("{flag} needs a value: {USAGE}"))?;
        match flag.as_str() {
            "--seed" => seed = value.parse().context("a whole number")?,
            "--from" => from = value.parse().context("a whole number")?,
            "--count" => files = value.parse().context("a whole number")?,
            "--seconds" => seconds = value.parse().context("a number of seconds")?,
            "--folder" => folder = Some(PathBuf::from(value)),
            _ => bail!("{flag} is not known: {USAGE}"),
        }
    }
    if let Some(folder) = &folder {
        std::fs::create_dir_all(folder)?;
    }
    let (mutator, start) = (Mutator::new(seed), Instant::now());
    let (mut counted, mut slowest, mut done) = (BTreeMap::new(), (0.0, 0), 0_u64);
    let mut found = 0;
    for number in from..from + files {
        if start.elapsed().as_secs_f64() > seconds {
            break;
        }
        let file = mutator.file(number);
        // A process that is ended by the system leaves its file here.
        let at = folder.as_ref().map(|folder| folder.join(format!("seed-{seed}-{number}.glb")));
        if let Some(at) = &at {
            std::fs::write(at, &file)?;
        }
        let (began, before) = (Instant::now(), most_memory().unwrap_or(0));
        let outcome = outcome(file);
        let took = began.elapsed().as_secs_f64();
        let memory = most_memory().unwrap_or(0);
        let greedy = memory > MEMORY && memory > before;
        done += 1;
        if took > slowest.0 {
            slowest = (took, number);
        }
        if greedy || matches!(outcome, Outcome::Panicked(_) | Outcome::Hung) {
            found += 1;
            eprintln!("file {number}: {outcome:?}, {took:.1} s, {} MiB", memory >> 20);
        } else if let Some(at) = &at {
            std::fs::remove_file(at)?;
        }
        if number < 7 && outcome != Outcome::Rendered {
            eprintln!("file {number}, which is not changed: {outcome:?}");
        }
        let kind = match outcome {
            Outcome::Rendered => "rendered",
            Outcome::Refused => "refused",
            Outcome::Panicked(_) => "panicked",
            Outcome::Hung => "hung",
        };
        *counted.entry(kind).or_insert(0_u64) += 1;
    }
    println!("{done} files of seed {seed} in {:.0} s: {counted:?}", start.elapsed().as_secs_f64());
    let memory = most_memory().unwrap_or(0) >> 20;
    println!("slowest: file {} with {:.2} s; most memory {memory} MiB", slowest.1, slowest.0);
    if found > 0 {
        bail!("{found} files panicked, hung or took too much memory");
    }
    Ok(())
}

//! Sends changed bytes to everything that reads bytes from outside:
//! `cargo run -p ovtigre-tests --bin torment -- [SECONDS [SEED [READER…]]]`, 60 seconds for each reader and seed 1 where nothing is said.
//! What a reader does not bear is written to `tests/fuzz/corpus`, where the tests and the fuzzers find it again.
//! `torment begin` writes what the fuzzers begin with there.

#![expect(clippy::print_stdout, reason = "a program of the command line")]

use ovtigre_tests::hostile::{Target, peak_bytes, torment};
use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

/// Most bytes of a file that fuzzers begin with.
const BEGIN_MAX: usize = 8 << 10;

/// Writes a file where it is found again.
fn keep(target: Target, name: &str, bytes: &[u8]) -> std::io::Result<PathBuf> {
    let fuzzer = target.fuzzer().unwrap_or("other");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(fuzzer);
    fs::create_dir_all(&folder)?;
    let file = folder.join(name);
    fs::write(&file, bytes)?;
    Ok(file)
}

fn begin() -> std::io::Result<()> {
    for target in Target::ALL.into_iter().filter(|target| target.fuzzer().is_some()) {
        for (n, bytes) in target.corpus().iter().filter(|bytes| bytes.len() <= BEGIN_MAX).enumerate() {
            keep(target, &format!("{}-{n}", format!("{target:?}").to_lowercase()), bytes)?;
        }
    }
    Ok(())
}

fn main() -> anyhow::Result<()> {
    if std::env::args().any(|word| word == "begin") {
        return Ok(begin()?);
    }
    let mut numbers = std::env::args().filter(|word| word.parse::<f64>().is_ok());
    let seconds = numbers.next().map_or(Ok(60.0), |word| word.parse())?;
    let seed = numbers.next().map_or(Ok(1_u64), |word| word.parse())?;
    // Panics are told of with the bytes that brought them about; some decoders' are caught on purpose.
    std::panic::set_hook(Box::new(|_| ()));
    let mut found = 0;
    let named = |target: &Target| format!("{target:?}").to_lowercase();
    let some: Vec<Target> =
        Target::ALL.into_iter().filter(|target| std::env::args().any(|word| word == named(target))).collect();
    for target in if some.is_empty() { Target::ALL.to_vec() } else { some } {
        let begun = Instant::now();
        let mut count = 0;
        let mut next = seed;
        while begun.elapsed() < Duration::from_secs_f64(seconds) {
            let over = |n: u64| !n.is_multiple_of(16) || begun.elapsed() < Duration::from_secs_f64(seconds);
            match torment(target, next, over) {
                Ok(borne) => count += borne,
                Err(stumbled) => {
                    let name = blake3::hash(&stumbled.bytes).to_hex();
                    let file = keep(target, &format!("found-{}", &name.as_str()[..12]), &stumbled.bytes)?;
                    println!("{target:?}: {}: {}", stumbled.how, file.display());
                    found += 1;
                    // It would be found again at once: it is among the files that are begun with.
                    break;
                }
            }
            next = next.wrapping_add(1 << 32);
        }
        let peak = peak_bytes().unwrap_or_default() >> 20;
        println!(
            "{target:?}: {count} inputs in {:.0} s, memory at most {peak} MiB",
            begun.elapsed().as_secs_f64()
        );
    }
    anyhow::ensure!(found == 0, "{found} inputs were not borne");
    Ok(())
}

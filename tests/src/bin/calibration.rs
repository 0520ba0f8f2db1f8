//! Measures how often the certified error holds, and prints the tables of docs/ERROR.md, case by case:
//! `cargo run --release -p ovtigre-tests --bin calibration -- [--runs N] [--side N] [--looks N] [--replicates N] [--reference N]
//! [--seed N] [--threads N] [--case NAME]`.

use anyhow::{Context as _, bail};
use ovtigre_tests::calibration::{Plan, calibrate, cases};
use std::io::Write as _;

const COVERAGE: &str = "\
| case | samples | true error | relative error | at most | doubted | certified too low | of all | claimed, at most | covered, the doubted too |
| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
";
const STOPS: &str = "\
| case | target | stopped | above the target | of all |
| --- | ---: | ---: | ---: | ---: |
";

fn main() -> anyhow::Result<()> {
    let mut plan = Plan { runs: 200, side: 32, looks: 7, replicates: 4, reference: 100, seed: 0 };
    let (mut threads, mut only) = (0, None);
    let mut arguments = std::env::args().skip(1);
    while let Some(flag) = arguments.next() {
        let value = arguments.next().with_context(|| format!("{flag} needs a value"))?;
        let number = || value.parse::<u32>().with_context(|| format!("{flag} {value}"));
        match flag.as_str() {
            "--runs" => plan.runs = number()?,
            "--side" => plan.side = number()?,
            "--looks" => plan.looks = number()?,
            "--replicates" => plan.replicates = number()?,
            "--reference" => plan.reference = number()?,
            "--seed" => plan.seed = number()?.into(),
            "--threads" => threads = number()? as usize,
            "--case" => only = Some(value),
            _ => bail!("{flag} is no flag"),
        }
    }
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    let (mut out, mut err) = (std::io::stdout().lock(), std::io::stderr().lock());
    for case in cases().iter().filter(|case| only.as_deref().is_none_or(|name| name == case.name)) {
        let found = calibrate(case, plan);
        writeln!(err, "{}: the reference is known to {:.5}", case.name, found.own)?;
        let [coverage, stops] = found.tables(case);
        writeln!(out, "{COVERAGE}{coverage}\n{STOPS}{stops}")?;
        out.flush()?;
    }
    Ok(())
}

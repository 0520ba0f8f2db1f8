//! The page.

use super::{
    case::Case,
    finding::{Answer, Finding, Verdict},
};
use std::fmt::Write as _;

/// What the verdicts mean.
const RULE: &str = "A row *holds* if it is within 4 standard errors (and 10⁻⁵, for the rounding of f32) of the known answer, no sample was dropped, and \
    a bias of 0.3 % would have been found (in five of six runs); it holds *within x %* if only a bias of x % would have been; it *says nothing* if that is more than \
    20 %. Everything else *fails* and stays here until it is mended; `tests/it/stability.rs` runs all cases with fewer samples and fails where a case gets better or worse.";

/// A trial's finding and how long it took.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// What was found.
    pub finding: Finding,
    /// Seconds of one thread.
    pub seconds: f64,
}

/// The page: what each case stresses, what is known, and what each trial found, in the order of the cases' trials; `None`
/// of those that were not looked at.
pub fn page(cases: &[(&Case, Vec<Option<Row>>)], head: &str) -> String {
    let mut page = format!("# Numerical stability\n\n{head}\n");
    let mut rows = Vec::new();
    for (case, found) in cases {
        let looked_at = case.trials.iter().zip(found).filter_map(|(trial, row)| Some((trial, (*row)?)));
        rows.extend(looked_at.map(|(trial, row)| (*case, trial, row)));
    }
    let count = |of: fn(Verdict) -> bool| rows.iter().filter(|(.., row)| of(row.finding.verdict())).count();
    let _ = writeln!(
        page,
        "{} cases, {} rows: {} hold, {} hold within the bias they can find, {} say nothing, {} fail. {:.0} s of one core in all.\n",
        cases.len(),
        rows.len(),
        count(|v| v == Verdict::Holds),
        count(|v| matches!(v, Verdict::HoldsWithin(_))),
        count(|v| v == Verdict::Unsure),
        count(|v| v == Verdict::Fails),
        rows.iter().map(|(.., row)| row.seconds).sum::<f64>(),
    );
    let _ = writeln!(page, "{RULE}\n\n## What fails\n");
    for (case, found) in cases {
        failures(&mut page, case, found);
    }
    let mut group = "";
    for (case, rows) in cases {
        if case.group != group {
            group = case.group;
            let _ = writeln!(page, "\n## {group}");
        }
        section(&mut page, case, rows);
    }
    page
}

/// A line for a case of which something fails.
fn failures(page: &mut String, case: &Case, rows: &[Option<Row>]) {
    let off = |by: &str, finding: &Finding| match finding.answer {
        Answer::Estimate { .. } => format!("{by}: off by {:+.3} %", 100.0 * finding.off()),
        Answer::Bound { at_most, got } => format!("{by}: {got:.3e}, may be {at_most:.1e}"),
    };
    let failing: Vec<String> = (case.trials.iter().zip(rows))
        .filter_map(|(trial, row)| Some((trial, (*row)?.finding)))
        .filter(|(_, finding)| finding.verdict() == Verdict::Fails)
        .map(|(trial, finding)| off(&trial.by, &finding))
        .collect();
    if failing.is_empty() {
        return;
    }
    let note = if case.note.is_empty() { "Why was not found." } else { case.note };
    let _ = writeln!(page, "* **{}**. {}. {note}", case.name, failing.join("; "));
}

fn section(page: &mut String, case: &Case, rows: &[Option<Row>]) {
    let _ = writeln!(page, "\n### {}\n\nStresses {}. Known: {}.", case.name, case.stresses, case.known);
    if !case.note.is_empty() {
        let _ = writeln!(page, "{}", case.note);
    }
    let _ = writeln!(
        page,
        "\n| by | ovtigre gives | off by | finds a bias of | invalid | samples | s | verdict |"
    );
    let _ = writeln!(page, "| --- | --- | --- | --- | --- | --- | --- | --- |");
    for (trial, row) in case.trials.iter().zip(rows) {
        let Some(row) = row else {
            let _ = writeln!(page, "| {} | | | | | | | not looked at |", trial.by);
            continue;
        };
        let Finding { answer, invalid, samples } = row.finding;
        let (gives, off, finds) = match answer {
            Answer::Estimate { expected, got, error } => (
                format!("{} ± {error:.1e}", number(got)),
                format!("{:+.3} %, {:.1} σ", 100.0 * row.finding.off(), sigmas(got - expected, error)),
                if expected == 0.0 {
                    String::new()
                } else {
                    format!("{:.2} %", 500.0 * error / expected.abs())
                },
            ),
            Answer::Bound { at_most, got } => {
                (number(got), format!("may be {}", number(at_most)), String::new())
            }
        };
        let verdict = match row.finding.verdict() {
            Verdict::Holds => "holds".to_owned(),
            Verdict::HoldsWithin(found) => format!("holds within {:.1} %", 100.0 * found),
            Verdict::Unsure => "says nothing".to_owned(),
            Verdict::Fails => "**fails**".to_owned(),
        };
        let _ = writeln!(
            page,
            "| {} | {gives} | {off} | {finds} | {invalid} | {} | {:.1} | {verdict} |",
            trial.by,
            number(samples as f64),
            row.seconds,
        );
    }
}

fn sigmas(off: f64, error: f64) -> f64 {
    if off == 0.0 { 0.0 } else { (off / error.max(f64::MIN_POSITIVE)).abs().min(1e3) }
}

/// Six digits, with a power of ten where that is shorter.
fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || (0.001..1e6).contains(&size) {
        let digits =
            if value.fract() == 0.0 { 0 } else { (5 - size.log10().floor() as i32).clamp(0, 8) as usize };
        format!("{value:.digits$}")
    } else {
        format!("{value:.3e}")
    }
}

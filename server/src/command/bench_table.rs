//! What a bench says: rows, and which method is ahead.

use super::trial::{Trial, between};
use ovtigre_core::settings::Method;
use serde::{Serialize, Serializer, ser::SerializeStruct as _};
use std::fmt::Write as _;

/// A scene, and what became of it.
#[derive(Debug)]
pub(crate) struct Entry {
    pub(crate) scene: String,
    pub(crate) reference: Option<Known>,
    pub(crate) trials: Vec<(Method, Trial)>,
}

/// What errors are measured against.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Known {
    /// The method, or the file.
    pub(crate) method: String,
    pub(crate) samples: Option<u32>,
    /// Its own relative error, which is taken off.
    pub(crate) own_error: f64,
}

impl Known {
    /// As a sentence.
    pub(crate) fn line(&self) -> String {
        let samples = self.samples.map_or_else(String::new, |n| format!(", {n} samples a pixel"));
        format!("{}{samples}, itself known to {:.5}", self.method, self.own_error)
    }
}

/// A method on a scene, at the end and in comparison.
#[derive(Clone, Debug, Serialize)]
struct Summary {
    /// Where all methods were at the time at which the first of them ended.
    error_at_equal_time: Option<f64>,
    /// Until the error that all methods have reached.
    seconds_to_equal_error: Option<f64>,
    /// 1 / (relative error² · worker seconds), and what it is at least and at most.
    efficiency: [Option<f64>; 3],
    slope: Option<f64>,
}

/// The time and the error at which methods are compared.
#[derive(Clone, Copy, Debug, Serialize)]
struct Common {
    seconds: f64,
    error: f64,
}

impl Entry {
    fn common(&self) -> Common {
        let ends = || self.trials.iter().filter_map(|(_, trial)| trial.errors().last().copied());
        Common {
            seconds: ends().map(|(t, _)| t).fold(f64::INFINITY, f64::min),
            error: ends().map(|(_, e)| e).fold(0.0, f64::max),
        }
    }

    fn summary(&self, trial: &Trial) -> Summary {
        let (common, points, last) = (self.common(), trial.errors(), trial.last());
        let turned: Vec<(f64, f64)> = points.iter().map(|(t, e)| (*e, *t)).collect();
        let of = |error: f64| Some(1.0 / (error * error * last.worker_seconds)).filter(|x| x.is_finite());
        let (error, upper) = (last.relative_error, last.relative_error_upper);
        // The bound is as far above the estimate, in logarithms, as the other end of the interval is below it.
        let efficiency = [of(error), upper.and_then(of), upper.and_then(|upper| of(error * error / upper))];
        Summary {
            error_at_equal_time: between(&points, common.seconds),
            seconds_to_equal_error: between(&turned, common.error),
            efficiency,
            slope: trial.slope(),
        }
    }
}

impl Serialize for Entry {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let method = |(method, trial): &(Method, Trial)| serde_json::json!({"method": method.name(), "rows": trial.rows, "summary": self.summary(trial)});
        let mut entry = serializer.serialize_struct("Entry", 4)?;
        entry.serialize_field("scene", &self.scene)?;
        entry.serialize_field("reference", &self.reference)?;
        entry.serialize_field("compared_at", &self.common())?;
        entry.serialize_field("methods", &self.trials.iter().map(method).collect::<Vec<_>>())?;
        entry.end()
    }
}

/// All rows as comma-separated values.
pub(crate) fn csv(entries: &[Entry]) -> String {
    let mut text =
        "scene,method,samples,wall_seconds,worker_seconds,rays,relative_error,relative_error_upper,\
                    doubted,true_error\r\n"
            .to_owned();
    let cell = |x: Option<f64>| x.map_or_else(String::new, |x| x.to_string());
    for entry in entries {
        let scene = format!("\"{}\"", entry.scene.replace('"', "\"\""));
        for (method, trial) in &entry.trials {
            for row in &trial.rows {
                let (upper, truth) = (cell(row.relative_error_upper), cell(row.true_error));
                let numbers =
                    format!("{},{},{},{}", row.samples, row.wall_seconds, row.worker_seconds, row.rays);
                let errors = format!("{},{upper},{},{truth}", row.relative_error, row.doubted);
                write!(text, "{scene},{},{numbers},{errors}\r\n", method.name())
                    .expect("writing to a string cannot fail");
            }
        }
    }
    text
}

/// A table for each scene.
pub(crate) fn markdown(entries: &[Entry], threads: usize) -> String {
    entries.iter().map(|entry| table(entry, threads)).collect::<Vec<_>>().join("\n")
}

fn smallest(entry: &Entry) -> f64 {
    entry.trials.iter().map(|(_, trial)| trial.last().relative_error).fold(f64::INFINITY, f64::min)
}

fn table(entry: &Entry, threads: usize) -> String {
    let common = entry.common();
    let number =
        |x: Option<f64>, digits: usize| x.map_or_else(|| "–".to_owned(), |x| format!("{x:.digits$}"));
    let against = entry.reference.as_ref().map_or_else(|| "none".to_owned(), Known::line);
    let near = entry.reference.as_ref().is_some_and(|known| 2.0 * known.own_error > smallest(entry));
    let near =
        if near { " It is hardly closer to the truth than what it judges: give it more time." } else { "" };
    let mut text = format!("### {}\n\n{threads} threads. Reference: {against}.{near}\n\n", entry.scene);
    text += &format!(
        "| method | samples | wall s | worker s | estimated | at most | true | error at {:.1} s | seconds to {:.4} | efficiency | slope |\n",
        common.seconds, common.error
    );
    text += "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |\n";
    for (method, trial) in &entry.trials {
        let (last, summary) = (trial.last(), entry.summary(trial));
        let doubt = if last.doubted { " (not certified)" } else { "" };
        let [efficiency, low, high] = summary.efficiency.map(|x| number(x, 1));
        let cells = [
            method.name().to_owned(),
            last.samples.to_string(),
            format!("{:.1}", last.wall_seconds),
            format!("{:.1}", last.worker_seconds),
            format!("{:.4}", last.relative_error),
            number(last.relative_error_upper, 4) + doubt,
            number(last.true_error, 4),
            number(summary.error_at_equal_time, 4),
            number(summary.seconds_to_equal_error, 1),
            format!("{efficiency} ({low}–{high})"),
            number(summary.slope, 2),
        ];
        text += &format!("| {} |\n", cells.join(" | "));
    }
    text
}

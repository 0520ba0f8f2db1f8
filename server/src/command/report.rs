//! The files of `--report` and `--plot`.

use super::{
    exit::Outcome,
    output,
    truth::{TrueError, Truth, read},
};
use ovtigre::plot::{Trace, svg};
use ovtigre_core::film::{reference::plane, shares::shares, size::Size};
use ovtigre_proto::{client::farm::Client, curve::Curve, status::JobStatus};
use serde::Serialize;
use std::path::Path;

/// Where a job's report and plot go, if anywhere.
#[derive(Debug)]
pub(crate) struct Files<'a> {
    pub(crate) report: Option<&'a Path>,
    pub(crate) plot: Option<&'a Path>,
}

/// Error against run time, and what was used.
#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    curve: &'a Curve,
    /// Against the reference, where one was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    reference: Option<Against<'a>>,
    /// Share of the squared relative error in each cell of an 8×8 grid over the picture, rows from the top.
    #[serde(skip_serializing_if = "Option::is_none")]
    error_by_region: Option<Vec<Vec<f64>>>,
    job: &'a JobStatus,
}

#[derive(Serialize)]
struct Against<'a> {
    /// Relative error of the reference itself.
    own_error: f64,
    rows: &'a [TrueError],
}

/// Writes a job's report and plot; `picture` is its EXR on this side.
pub(crate) async fn write(
    client: &Client,
    status: &JobStatus,
    truth: Option<&Truth>,
    picture: &Path,
    files: &Files<'_>,
) -> Outcome {
    if files.report.is_none() && files.plot.is_none() {
        return Ok(());
    }
    let curve = client.curve(&status.id).await?;
    if let Some(path) = files.plot {
        let mut trace = Trace::of(&status.method, &curve);
        trace.truth = truth.map_or_else(Vec::new, |truth| {
            truth.rows().iter().map(|row| [row.wall_seconds, row.true_error]).collect()
        });
        output::save_text(&svg(&status.name, &[trace], curve.error_target), path)?;
    }
    let Some(path) = files.report else { return Ok(()) };
    let reference = truth.map(|truth| Against { own_error: truth.own_error(), rows: truth.rows() });
    let report = Report { curve: &curve, reference, error_by_region: by_region(picture)?, job: status };
    let text = serde_json::to_string_pretty(&report).expect("a report is plain data");
    output::save_text(&(text + "\n"), path)
}

fn by_region(picture: &Path) -> Outcome<Option<Vec<Vec<f64>>>> {
    let layers = read(picture)?;
    let size = Size { width: layers.width as u32, height: layers.height as u32 };
    let planes = plane(&layers, "").zip(plane(&layers, "error."));
    Ok(planes.and_then(|(means, errors)| shares(size, &means, &errors)))
}

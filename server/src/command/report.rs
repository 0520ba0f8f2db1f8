//! The file of `--report`.

use super::{exit::Outcome, output};
use ovtigre_proto::{client::farm::Client, curve::Curve, status::JobStatus};
use serde::Serialize;
use std::path::Path;

/// Error against run time, and what was used.
#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    curve: &'a Curve,
    job: &'a JobStatus,
}

/// Writes a job's report.
pub(crate) async fn write(client: &Client, status: &JobStatus, path: &Path) -> Outcome {
    let curve = client.curve(&status.id).await?;
    let report = Report { curve: &curve, job: status };
    let text = serde_json::to_string_pretty(&report).expect("a report is plain data");
    output::save_text(&(text + "\n"), path)
}

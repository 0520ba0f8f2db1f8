//! `ovtigre status`: how jobs stand.

use super::{exit::Outcome, farm_flags::FarmFlags, table, terminal, words};
use clap::Args;
use ovtigre_proto::{id::JobId, status::JobStatus};

/// Jobs that are listed.
const JOBS_MAX: usize = 1000;

/// Show how a job stands, or all.
#[derive(Args, Debug)]
pub(crate) struct Status {
    /// Job to show [default: all, the newest first].
    #[arg(value_name = "JOB")]
    job: Option<JobId>,
    #[command(flatten)]
    farm: FarmFlags,
}

impl Status {
    /// Shows.
    pub(crate) async fn run(self) -> Outcome {
        let client = self.farm.client()?;
        if let Some(job) = &self.job {
            let status = client.job(job).await?;
            if self.farm.json {
                terminal::json(&status);
            } else {
                show(&status);
            }
            return Ok(());
        }
        let jobs = client.jobs(None).all(JOBS_MAX).await?;
        if self.farm.json {
            terminal::json(&jobs);
        } else {
            table::print(
                ["JOB", "NAME", "STATE", "SAMPLES", "ERROR", "TIME", "LEFT"],
                &jobs.iter().map(row).collect::<Vec<_>>(),
            );
        }
        Ok(())
    }
}

fn row(job: &JobStatus) -> [String; 7] {
    let error = job.error.as_ref().and_then(|row| row.relative_error);
    [
        job.id.to_string(),
        job.name.clone(),
        job.state.name().to_owned(),
        format!("{:.0}/{}", job.samples_done, job.samples_asked),
        error.map(|error| format!("±{error:.4}")).unwrap_or_default(),
        words::duration(job.wall_seconds),
        job.eta_seconds.map(words::duration).unwrap_or_default(),
    ]
}

/// One job, a line for each thing.
pub(crate) fn show(job: &JobStatus) {
    let optional = |seconds: Option<f64>| seconds.map(words::duration).unwrap_or_default();
    let invalid = if job.invalid_samples > 0 { job.invalid_samples.to_string() } else { String::new() };
    table::facts(&[
        ("job", job.id.to_string()),
        ("name", job.name.clone()),
        ("state", job.state.name().to_owned()),
        ("reason", job.reason.clone().unwrap_or_default()),
        ("samples", format!("{:.0} of {} a pixel", job.samples_done, job.samples_asked)),
        ("error", words::error(job).trim_start_matches("error ").to_owned()),
        ("error target", job.error_target.map(|target| target.to_string()).unwrap_or_default()),
        ("run time", words::duration(job.wall_seconds)),
        ("worker time", words::duration(job.worker_seconds)),
        ("left", optional(job.eta_seconds)),
        ("speed", words::speed(job)),
        ("workers", job.workers.to_string()),
        ("invalid samples", invalid),
        ("frame", format!("{}, region {}", job.settings.size, job.region)),
        ("method", words::list(&[job.method.clone(), job.method_reason.clone()])),
        ("paths", job.paths.clone()),
        ("scene", job.scene.to_string()),
    ]);
    if !job.layers.is_empty() {
        let number = |n: Option<f64>| n.map(|n| format!("{n:.4}")).unwrap_or_default();
        let rows: Vec<_> = (job.layers.iter())
            .map(|layer| {
                let error = layer.error.and_then(|e| e.relative_error);
                let mean = layer.error.map(|e| e.mean_luminance);
                let error = error.map(|error| format!("±{error:.4}")).unwrap_or_default();
                let rms = layer.error.and_then(|e| e.rms_error);
                [layer.name.clone(), layer.shows.clone(), number(mean), error, number(rms)]
            })
            .collect();
        table::print(["LAYER", "SHOWS", "MEAN LUMINANCE", "ERROR", "RMS ERROR"], &rows);
    }
    for warning in &job.warnings {
        terminal::result(&format!("warning: {warning}"));
    }
}

//! Probes and numbers.

use super::error::Result;
use crate::farm::{Farm, counters::Fate, error::FarmError};
use axum::{
    Json,
    extract::State,
    http::header,
    response::{IntoResponse as _, Response},
};
use ovtigre_proto::status::{JobState, Scaling, WorkerState};
use std::{
    fmt::{Display, Write as _},
    sync::Arc,
};

/// The process runs.
pub async fn alive() -> &'static str {
    "ok\n"
}

/// The farm can be used.
pub async fn ready(State(farm): State<Arc<Farm>>) -> Result<&'static str> {
    if farm.stopping.is_cancelled() {
        return Err(FarmError::Stopping.into());
    }
    farm.store.ping().await.map_err(FarmError::from)?;
    Ok("ok\n")
}

/// How many workers the queue could use now.
pub async fn scaling(State(farm): State<Arc<Farm>>) -> Result<Json<Scaling>> {
    Ok(Json(farm.scaling().await?))
}

/// Numbers for Prometheus (text format 0.0.4).
pub async fn metrics(State(farm): State<Arc<Farm>>) -> Result<Response> {
    let counts = farm.store.counts().await.map_err(FarmError::from)?;
    let scaling = farm.scaling().await?;
    let mut text = Metrics::default();
    text.kind("ovtigre_jobs", "gauge", "Jobs by state.");
    for state in [
        JobState::Queued,
        JobState::Running,
        JobState::Paused,
        JobState::Done,
        JobState::Failed,
        JobState::Cancelled,
    ] {
        let number = counts.jobs.iter().find(|(s, _)| *s == state).map_or(0, |(_, n)| *n);
        text.labelled("ovtigre_jobs", "state", state.name(), number);
    }
    text.kind("ovtigre_workers", "gauge", "Workers by state.");
    for (state, name) in [
        (WorkerState::Active, "active"),
        (WorkerState::Draining, "draining"),
        (WorkerState::Lost, "lost"),
        (WorkerState::Aside, "aside"),
    ] {
        let number = counts.workers.iter().find(|(s, _)| *s == state).map_or(0, |(_, n)| *n);
        text.labelled("ovtigre_workers", "state", name, number);
    }
    text.kind("ovtigre_leases", "gauge", "Batches in workers' hands.");
    text.plain("ovtigre_leases", counts.leases);
    text.kind("ovtigre_batches_waiting", "gauge", "Batches that could be handed out now.");
    text.plain("ovtigre_batches_waiting", scaling.batches_waiting);
    text.kind("ovtigre_desired_workers", "gauge", "Workers that would have something to do.");
    text.plain("ovtigre_desired_workers", scaling.desired_workers);
    text.kind("ovtigre_batches_total", "counter", "Batches by what became of them.");
    for fate in Fate::ALL {
        text.labelled("ovtigre_batches_total", "fate", fate.name(), farm.counters.batches(fate));
    }
    text.kind("ovtigre_batches_appended_total", "counter", "Batches appended to pictures.");
    text.plain("ovtigre_batches_appended_total", farm.counters.appended_batches());
    text.kind("ovtigre_merged_bytes_total", "counter", "Bytes of sums appended to pictures.");
    text.plain("ovtigre_merged_bytes_total", farm.counters.merged_bytes());
    text.kind("ovtigre_notices_total", "counter", "Notices to webhooks by what became of them.");
    for (fate, number) in ["taken", "given_up"].into_iter().zip(farm.counters.notices()) {
        text.labelled("ovtigre_notices_total", "fate", fate, number);
    }
    Ok(([(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], text.0).into_response())
}

#[derive(Default)]
struct Metrics(String);

impl Metrics {
    fn line(&mut self, line: std::fmt::Arguments<'_>) {
        self.0.write_fmt(line).expect("writing to a string cannot fail");
        self.0.push('\n');
    }

    fn kind(&mut self, name: &str, kind: &str, help: &str) {
        self.line(format_args!("# HELP {name} {help}"));
        self.line(format_args!("# TYPE {name} {kind}"));
    }

    fn plain(&mut self, name: &str, value: impl Display) {
        self.line(format_args!("{name} {value}"));
    }

    fn labelled(&mut self, name: &str, label: &str, of: &str, value: impl Display) {
        self.line(format_args!("{name}{{{label}=\"{of}\"}} {value}"));
    }
}

//! How jobs, workers and the queue stand, for people.

use super::{
    Farm,
    curve::target_at,
    error::{FarmError, Result},
    open::read_spec,
    spec::JobSpec,
};
use crate::store::row::{JobFilter, JobRow, Progress, WorkerRow};
use ovtigre_core::{path::expression::presets::shown, settings::Layer};
use ovtigre_proto::{
    curve::CurveRow,
    id::{JobId, WorkerId},
    status::{JobState, JobStatus, LayerStatus, Page, Scaling, WorkerState, WorkerStatus},
};

/// Items of a page where it is not said.
pub const PAGE: u32 = 50;
/// Items of a page at most.
pub const PAGE_MAX: u32 = 500;

impl Farm {
    /// A job.
    pub async fn status(&self, id: &JobId) -> Result<JobStatus> {
        let row = self.job_row(id).await?;
        self.status_of(&row).await
    }

    /// Jobs, the newest first.
    pub async fn jobs(&self, filter: JobFilter) -> Result<Page<JobStatus>> {
        let limit = filter.limit.clamp(1, PAGE_MAX);
        let mut rows = self.store.jobs(JobFilter { limit: limit + 1, ..filter }).await?;
        let more = rows.len() > limit as usize;
        rows.truncate(limit as usize);
        let next = rows.last().filter(|_| more).map(|row| row.sequence.to_string());
        let mut items = Vec::with_capacity(rows.len());
        for row in &rows {
            items.push(self.status_of(row).await?);
        }
        Ok(Page { items, next })
    }

    /// How far a job's picture is.
    pub(super) fn progress(&self, row: &JobRow) -> Progress {
        self.live(&row.id).filter(|_| !row.settled).map_or(row.progress, |live| live.view().progress)
    }

    /// A job that is in the store as `row`.
    pub(super) async fn status_of(&self, row: &JobRow) -> Result<JobStatus> {
        let spec = read_spec(row)?;
        let curve = self.curve_rows(&row.id).await?;
        let progress = self.progress(row);
        let schedule = spec.schedule();
        let workers = if row.state.is_over() { 0 } else { self.store.workers_of(&row.id).await? };
        let eta_seconds = eta(row, &progress, &spec, &curve);
        let layers = self.layers_of(&row.id, &spec).await?;
        let radiosity = self.solution_of(&row.id, spec.settings.method).await?;
        Ok(JobStatus {
            id: row.id.clone(),
            name: row.name.clone(),
            scene: row.scene.clone(),
            state: row.state,
            reason: row.reason.clone(),
            version: row.version,
            priority: row.priority,
            created_at: row.created_at,
            started_at: row.started_at,
            ended_at: row.ended_at,
            samples_done: progress.samples,
            samples_asked: spec.samples_asked(),
            batches_done: progress.batches,
            batches_asked: schedule.batches(),
            wall_seconds: row.run_seconds,
            worker_seconds: progress.worker_micros as f64 * 1e-6,
            rays: progress.rays,
            invalid_samples: progress.invalid,
            workers,
            error: curve.last().cloned(),
            error_target: spec.error_target,
            certified: row.certified,
            eta_seconds,
            method: spec.settings.method.name().to_owned(),
            method_reason: spec.method_reason,
            pilot: spec.pilot,
            class: row.class.clone(),
            paths: shown(&spec.settings.paths).to_owned(),
            unreachable: spec.unreachable,
            needs: spec.needs,
            radiosity,
            layers,
            settings: spec.settings,
            region: spec.region,
            request: spec.request,
            warnings: spec.warnings,
        })
    }

    async fn layers_of(&self, id: &JobId, spec: &JobSpec) -> Result<Vec<LayerStatus>> {
        let layers = &spec.settings.layers;
        let errors = match self.live(id) {
            _ if layers.is_empty() => Vec::new(),
            Some(live) => live.view().layers,
            None => self.store.layers(id).await?,
        };
        let status = |(i, layer): (usize, &Layer)| LayerStatus {
            name: layer.name.clone(),
            shows: layer.shows.to_string(),
            error: errors.get(i).copied(),
        };
        Ok(layers.iter().enumerate().map(status).collect())
    }

    /// A worker in the store.
    pub(super) async fn worker_row(&self, id: &WorkerId) -> Result<WorkerRow> {
        self.store.worker(id).await?.ok_or_else(|| FarmError::not_found("worker", id))
    }

    /// A worker.
    pub async fn worker(&self, id: &WorkerId) -> Result<WorkerStatus> {
        self.worker_row(id).await.map(worker_status)
    }

    /// Workers, the newest first.
    pub async fn workers(&self, before: Option<i64>, limit: u32) -> Result<Page<WorkerStatus>> {
        let limit = limit.clamp(1, PAGE_MAX);
        let mut rows = self.store.workers(before, limit + 1).await?;
        let more = rows.len() > limit as usize;
        rows.truncate(limit as usize);
        let next = rows.last().filter(|_| more).map(|(sequence, _)| sequence.to_string());
        Ok(Page { items: rows.into_iter().map(|(_, row)| worker_status(row)).collect(), next })
    }

    /// A worker gets no more batches; one that is lost is let go.
    pub async fn drain(&self, id: &WorkerId) -> Result<WorkerStatus> {
        let state = match self.worker_row(id).await?.state {
            WorkerState::Active | WorkerState::Draining | WorkerState::Aside => WorkerState::Draining,
            WorkerState::Lost | WorkerState::Gone => WorkerState::Gone,
        };
        self.store.set_worker_state(id, state).await?;
        self.crew().set_state(id, state);
        Ok(worker_status(self.worker_row(id).await?))
    }

    /// How many workers the queue could use now.
    pub async fn scaling(&self) -> Result<Scaling> {
        // What other servers handed out is not in this one's book.
        if self.is_shared() {
            for live in self.lives() {
                self.refresh_plan(&live.id).await?;
            }
        }
        let batches_waiting = self.book().waiting();
        let counts = self.store.counts().await?;
        let desired_workers = u32::try_from(batches_waiting + counts.leases).unwrap_or(u32::MAX);
        let active = counts.workers.iter().find(|(state, _)| *state == WorkerState::Active);
        let active_workers = active.map_or(0, |(_, workers)| u32::try_from(*workers).unwrap_or(u32::MAX));
        Ok(Scaling { desired_workers, active_workers, batches_waiting })
    }
}

fn worker_status(row: WorkerRow) -> WorkerStatus {
    WorkerStatus {
        id: row.id,
        name: row.join.name,
        threads: row.join.threads,
        build: row.join.build,
        instruction_set: row.join.instruction_set,
        tags: row.join.tags,
        state: row.state,
        joined_at: row.joined_at,
        seen_at: row.seen_at,
        leases: row.leases,
        job: row.job,
        batches_done: row.batches_done,
        failures: row.failures,
        rays_per_second: row.rays_per_second,
        reason: row.reason,
    }
}

/// Seconds until the first of: all samples drawn, the time over, the error reached.
fn eta(row: &JobRow, progress: &Progress, spec: &JobSpec, curve: &[CurveRow]) -> Option<f64> {
    if row.state != JobState::Running {
        return None;
    }
    let asked = f64::from(spec.samples_asked());
    let by_samples = (progress.samples > 0.0)
        .then(|| row.run_seconds * (asked - progress.samples).max(0.0) / progress.samples);
    let by_time = spec.seconds.map(|seconds| seconds - row.run_seconds);
    let by_error = target_at(curve, spec).map(|at| at - row.run_seconds);
    [by_samples, by_time, by_error].into_iter().flatten().map(|t| t.max(0.0)).min_by(f64::total_cmp)
}

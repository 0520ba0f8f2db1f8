//! How jobs, workers and the queue stand, for people.

use super::{
    Farm,
    curve::target_at,
    error::{FarmError, Result},
    open::read_spec,
    spec::JobSpec,
};
use crate::store::{
    list::{JobFilter, Place, Standing},
    row::{JobRow, Progress, WorkerRow},
};
use ovtigre_core::{
    film::allocation::Allocations, path::expression::presets::shown, radiosity::report::RadiosityReport,
    settings::Layer,
};
use ovtigre_proto::{
    curve::{CurveRow, LayerError},
    id::{JobId, WorkerId},
    status::{JobState, JobStatus, LayerStatus, Page, Scaling, WorkerState, WorkerStatus},
};

/// Items of a page where it is not said.
pub const PAGE: u32 = 50;
/// Items of a page at most.
pub const PAGE_MAX: u32 = 500;

/// What is known of a job beside its row.
struct Known {
    /// Its checkpoints; of a job that is settled at least the latest.
    curve: Vec<CurveRow>,
    /// The layers' errors at the latest.
    layers: Vec<LayerError>,
    /// Workers that hold one of its batches.
    workers: u32,
    /// How its scene was solved.
    radiosity: Option<RadiosityReport>,
    /// How its samples are allocated.
    allocations: Option<Allocations>,
}

impl From<Standing> for Known {
    fn from(Standing { latest, layers, workers }: Standing) -> Self {
        Self { curve: latest.into_iter().collect(), layers, workers, radiosity: None, allocations: None }
    }
}

impl Farm {
    /// A job.
    pub async fn status(&self, id: &JobId) -> Result<JobStatus> {
        let row = self.job_row(id).await?;
        self.status_of(&row).await
    }

    /// A page of jobs. How their scenes were solved is left out.
    pub async fn jobs(&self, filter: JobFilter) -> Result<Page<JobStatus>> {
        let (limit, by) = (filter.limit.clamp(1, PAGE_MAX), filter.order.by);
        let mut rows = self.store.jobs(JobFilter { limit: limit + 1, ..filter }).await?;
        let more = rows.len() > limit as usize;
        rows.truncate(limit as usize);
        let next = rows.last().filter(|_| more).map(|row| Place::of(row, by).to_string());
        let ids: Vec<JobId> = rows.iter().map(|row| row.id.clone()).collect();
        let standings = self.store.standings(&ids).await?;
        let mut items = Vec::with_capacity(rows.len());
        for (row, standing) in rows.iter().zip(standings) {
            let spec = read_spec(row)?;
            let known = match self.seen(&row.id, standing.workers) {
                Some(known) => known,
                None if row.settled => Known::from(standing),
                // Another server has just taken it: how long it takes follows from its whole curve.
                None => self.known(row, &spec).await?,
            };
            items.push(self.described(row, spec, known));
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
        let mut known = self.known(row, &spec).await?;
        known.radiosity = self.solution_of(&row.id, spec.settings.method).await?;
        if spec.decided_after.is_some() {
            known.allocations = self.store.allocations(&row.id).await?;
        }
        Ok(self.described(row, spec, known))
    }

    /// What this server has in memory of a job that `workers` work at.
    fn seen(&self, id: &JobId, workers: u32) -> Option<Known> {
        let view = self.live(id)?.view();
        Some(Known { curve: view.curve, layers: view.layers, workers, radiosity: None, allocations: None })
    }

    async fn known(&self, row: &JobRow, spec: &JobSpec) -> Result<Known> {
        let workers = if row.state.is_over() { 0 } else { self.store.workers_of(&row.id).await? };
        if let Some(known) = self.seen(&row.id, workers) {
            return Ok(known);
        }
        let curve = self.store.curve(&row.id).await?;
        let plain = spec.settings.layers.is_empty();
        let layers = if plain { Vec::new() } else { self.store.layers(&row.id).await? };
        Ok(Known { curve, layers, workers, radiosity: None, allocations: None })
    }

    fn described(&self, row: &JobRow, spec: JobSpec, known: Known) -> JobStatus {
        let progress = self.progress(row);
        let running = (row.state == JobState::Running).then_some(row.run_seconds);
        let eta_seconds = running.and_then(|seconds| eta(seconds, &progress, &spec, &known.curve));
        let batches_asked = spec.schedule().batches();
        let layers = layers_of(&spec.settings.layers, &known.layers);
        JobStatus {
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
            batches_asked,
            wall_seconds: row.run_seconds,
            worker_seconds: progress.worker_micros as f64 * 1e-6,
            rays: progress.rays,
            invalid_samples: progress.invalid,
            workers: if row.state.is_over() { 0 } else { known.workers },
            error: known.curve.into_iter().next_back(),
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
            radiosity: known.radiosity,
            allocations: known.allocations,
            layers,
            settings: spec.settings,
            region: spec.region,
            request: spec.request,
            warnings: spec.warnings,
        }
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

fn layers_of(layers: &[Layer], errors: &[LayerError]) -> Vec<LayerStatus> {
    let status = |(i, layer): (usize, &Layer)| LayerStatus {
        name: layer.name.clone(),
        shows: layer.shows.to_string(),
        error: errors.get(i).copied(),
    };
    layers.iter().enumerate().map(status).collect()
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

/// Seconds until the first of: all samples drawn, the time over, the error reached; of a job that has run for `run_seconds`.
pub(super) fn eta(run_seconds: f64, progress: &Progress, spec: &JobSpec, curve: &[CurveRow]) -> Option<f64> {
    let asked = f64::from(spec.samples_asked());
    let by_samples = (progress.samples > 0.0)
        .then(|| run_seconds * (asked - progress.samples).max(0.0) / progress.samples);
    let by_time = spec.seconds.map(|seconds| seconds - run_seconds);
    let by_error = target_at(curve, spec).map(|at| at - run_seconds);
    [by_samples, by_time, by_error].into_iter().flatten().map(|t| t.max(0.0)).min_by(f64::total_cmp)
}

//! Columns to the store's own words.

use super::connection::Row;
use crate::store::{
    error::{Result, StoreError},
    row::{BatchKey, CommitRow, LeaseRow},
};
use jiff::Timestamp;
use ovtigre_proto::status::{JobState, WorkerState};
use serde::{Serialize, de::DeserializeOwned};
use std::{fmt::Display, str::FromStr, time::Duration};

/// Columns by their names. Never `*`: PostgreSQL refuses a statement that it has prepared when its columns change, and a newer
/// program adds some beside an older one.
macro_rules! columns_of {
    (job) => {
        "sequence, id, name, scene, state, reason, version, priority, created_ms, started_ms, ended_ms, paused_ms, \
         paused_since_ms, spec, progress, certified, manifest, settled, class, error_ppb, part_ppb, expected_ms, \
         workers"
    };
    (checkpoint) => {
        "look, samples, wall_seconds, worker_seconds, rays, rms_error, relative_error, relative_error_upper, \
         target_expected_at_seconds, doubt, layers"
    };
    (worker) => {
        "sequence, id, name, threads, build, instruction_set, tags, state, joined_ms, seen_ms, batches_done, failures, \
         rays_per_second, reason"
    };
    (token) => {
        "id, name, role, hash, created_ms"
    };
}
pub(super) use columns_of;

/// Whole milliseconds.
pub(super) fn millis(time: Duration) -> i64 {
    i64::try_from(time.as_millis()).unwrap_or(i64::MAX / 4)
}

/// Milliseconds since 1970 as a time.
pub(super) fn time(millis: i64) -> Result<Timestamp> {
    Timestamp::from_millisecond(millis).map_err(|e| StoreError::damaged("time", e))
}

/// A text column as what it says.
pub(super) fn parse<T: FromStr<Err: Display>>(row: &Row, column: &'static str) -> Result<T> {
    row.text(column)?.parse().map_err(|e: T::Err| StoreError::damaged(column, e))
}

/// A whole number that is not negative.
pub(super) fn count<T: TryFrom<i64>>(row: &Row, column: &'static str) -> Result<T> {
    let number = row.whole(column)?;
    T::try_from(number).map_err(|_| StoreError::damaged(column, number))
}

/// A document as text.
pub(super) fn to_json(value: &impl Serialize) -> Result<String> {
    serde_json::to_string(value).map_err(|e| StoreError::damaged("document", e))
}

/// A text column as the document it holds.
pub(super) fn from_json<T: DeserializeOwned>(row: &Row, column: &'static str) -> Result<T> {
    serde_json::from_str(&row.text(column)?).map_err(|e| StoreError::damaged(column, e))
}

/// Columns `block`, `replicate`, `region`.
pub(super) fn batch(row: &Row) -> Result<BatchKey> {
    Ok(BatchKey {
        block: count(row, "block")?,
        replicate: count(row, "replicate")?,
        region: count(row, "region")?,
    })
}

/// Columns of a lease.
pub(super) fn lease(row: &Row) -> Result<LeaseRow> {
    Ok(LeaseRow {
        id: parse(row, "id")?,
        job: parse(row, "job")?,
        batch: batch(row)?,
        worker: parse(row, "worker")?,
    })
}

/// Columns of a batch that was brought.
pub(super) fn commit(row: &Row) -> Result<CommitRow> {
    Ok(CommitRow {
        batch: batch(row)?,
        hash: parse(row, "hash")?,
        worker_micros: count(row, "worker_micros")?,
    })
}

/// A job's state by its name.
pub(super) fn job_state(text: &str) -> Result<JobState> {
    let all = [
        JobState::Queued,
        JobState::Running,
        JobState::Paused,
        JobState::Done,
        JobState::Failed,
        JobState::Cancelled,
    ];
    all.into_iter().find(|s| s.name() == text).ok_or_else(|| StoreError::damaged("job state", text))
}

/// A worker's state as a column.
pub(super) fn worker_state_name(state: WorkerState) -> &'static str {
    match state {
        WorkerState::Active => "active",
        WorkerState::Draining => "draining",
        WorkerState::Lost => "lost",
        WorkerState::Gone => "gone",
        WorkerState::Aside => "aside",
    }
}

/// A worker's state by its name.
pub(super) fn worker_state(text: &str) -> Result<WorkerState> {
    let all = [
        WorkerState::Active,
        WorkerState::Draining,
        WorkerState::Lost,
        WorkerState::Gone,
        WorkerState::Aside,
    ];
    all.into_iter()
        .find(|s| worker_state_name(*s) == text)
        .ok_or_else(|| StoreError::damaged("worker state", text))
}

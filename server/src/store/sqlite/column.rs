//! Rows of SQLite to the store's own.

use crate::store::{
    error::{Result, StoreError},
    row::{BatchKey, LeaseRow},
};
use jiff::Timestamp;
use ovtigre_proto::status::{JobState, WorkerState};
use sqlx::{Row as _, SqliteConnection, sqlite::SqliteRow};
use std::{fmt::Display, str::FromStr, time::Duration};

/// Milliseconds since 1970 by the database's clock.
pub(super) async fn now(connection: &mut SqliteConnection) -> Result<i64> {
    Ok(sqlx::query_scalar("SELECT CAST(unixepoch('subsec') * 1000 AS INTEGER)").fetch_one(connection).await?)
}

/// Whole milliseconds.
pub(super) fn millis(time: Duration) -> i64 {
    i64::try_from(time.as_millis()).unwrap_or(i64::MAX / 4)
}

/// Milliseconds since 1970 as a time.
pub(super) fn time(millis: i64) -> Result<Timestamp> {
    Timestamp::from_millisecond(millis).map_err(|e| StoreError::damaged("time", e))
}

/// A text column as what it says.
pub(super) fn parse<T: FromStr<Err: Display>>(row: &SqliteRow, column: &'static str) -> Result<T> {
    row.try_get::<&str, _>(column)?.parse().map_err(|e: T::Err| StoreError::damaged(column, e))
}

/// A whole number that is not negative.
pub(super) fn count<T: TryFrom<i64>>(row: &SqliteRow, column: &'static str) -> Result<T> {
    let number: i64 = row.try_get(column)?;
    T::try_from(number).map_err(|_| StoreError::damaged(column, number))
}

/// Columns `block`, `replicate`, `region`.
pub(super) fn batch(row: &SqliteRow) -> Result<BatchKey> {
    Ok(BatchKey {
        block: count(row, "block")?,
        replicate: count(row, "replicate")?,
        region: count(row, "region")?,
    })
}

/// Columns of a lease.
pub(super) fn lease(row: &SqliteRow) -> Result<LeaseRow> {
    Ok(LeaseRow {
        id: parse(row, "id")?,
        job: parse(row, "job")?,
        batch: batch(row)?,
        worker: parse(row, "worker")?,
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

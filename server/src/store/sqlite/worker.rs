//! Workers, and numbers for gauges.

use super::column::{count, job_state, millis, now, parse, time, worker_state, worker_state_name};
use crate::store::{
    error::{Result, StoreError},
    row::{Counts, WorkerRow},
};
use ovtigre_proto::{id::WorkerId, lease::WorkerJoin, status::WorkerState};
use sqlx::{Row as _, SqliteConnection, sqlite::SqliteRow};
use std::time::Duration;

/// A worker joins.
pub(super) async fn add(db: &mut SqliteConnection, id: &WorkerId, join: WorkerJoin) -> Result<()> {
    let tags = serde_json::to_string(&join.tags).map_err(|e| StoreError::damaged("tags", e))?;
    let now = now(db).await?;
    sqlx::query(
        "INSERT INTO worker (id, name, threads, build, instruction_set, tags, state, joined_ms, seen_ms)
         VALUES (?, ?, ?, ?, ?, ?, 'active', ?, ?)",
    )
    .bind(id.as_str())
    .bind(join.name)
    .bind(join.threads)
    .bind(join.build)
    .bind(join.instruction_set)
    .bind(tags)
    .bind(now)
    .bind(now)
    .execute(db)
    .await?;
    Ok(())
}

/// A worker is heard of.
pub(super) async fn see(db: &mut SqliteConnection, id: &WorkerId, state: WorkerState) -> Result<bool> {
    let now = now(db).await?;
    let seen = sqlx::query("UPDATE worker SET seen_ms = ?, state = ? WHERE id = ?");
    let seen = seen.bind(now).bind(worker_state_name(state)).bind(id.as_str()).execute(db).await?;
    Ok(seen.rows_affected() > 0)
}

/// A worker stands so from now on.
pub(super) async fn set_state(db: &mut SqliteConnection, id: &WorkerId, state: WorkerState) -> Result<bool> {
    let set = sqlx::query("UPDATE worker SET state = ? WHERE id = ?");
    let set = set.bind(worker_state_name(state)).bind(id.as_str()).execute(db).await?;
    Ok(set.rows_affected() > 0)
}

const SELECT: &str = "SELECT *, (SELECT count(*) FROM lease WHERE lease.worker = worker.id) AS leases,
    (SELECT lease.job FROM lease WHERE lease.worker = worker.id ORDER BY granted_ms LIMIT 1) AS job FROM worker ";

/// A worker.
pub(super) async fn get(db: &mut SqliteConnection, id: &WorkerId) -> Result<Option<WorkerRow>> {
    let sql = sqlx::AssertSqlSafe(format!("{SELECT} WHERE id = ?"));
    sqlx::query(sql).bind(id.as_str()).fetch_optional(db).await?.as_ref().map(read).transpose()
}

/// Workers, the newest first.
pub(super) async fn list(
    db: &mut SqliteConnection,
    before: Option<i64>,
    limit: u32,
) -> Result<Vec<(i64, WorkerRow)>> {
    let sql = sqlx::AssertSqlSafe(format!("{SELECT} WHERE sequence < ? ORDER BY sequence DESC LIMIT ?"));
    let rows = sqlx::query(sql).bind(before.unwrap_or(i64::MAX)).bind(limit).fetch_all(db).await?;
    rows.iter().map(|row| Ok((row.try_get("sequence")?, read(row)?))).collect()
}

fn read(row: &SqliteRow) -> Result<WorkerRow> {
    let tags = serde_json::from_str(row.try_get("tags")?).map_err(|e| StoreError::damaged("tags", e))?;
    Ok(WorkerRow {
        id: parse(row, "id")?,
        join: WorkerJoin {
            name: row.try_get("name")?,
            threads: count(row, "threads")?,
            build: row.try_get("build")?,
            instruction_set: row.try_get("instruction_set")?,
            tags,
        },
        state: worker_state(row.try_get("state")?)?,
        joined_at: time(row.try_get("joined_ms")?)?,
        seen_at: time(row.try_get("seen_ms")?)?,
        leases: count(row, "leases")?,
        job: match row.try_get::<Option<&str>, _>("job")? {
            Some(_) => Some(parse(row, "job")?),
            None => None,
        },
        batches_done: count(row, "batches_done")?,
        failures: count(row, "failures")?,
        rays_per_second: row.try_get("rays_per_second")?,
        reason: row.try_get("reason")?,
    })
}

/// Workers that would be lost, without a change.
pub(super) async fn any_silent(db: &mut SqliteConnection, silence: Duration) -> Result<bool> {
    let since = now(db).await? - millis(silence);
    let sql = "SELECT EXISTS (SELECT 1 FROM worker WHERE state IN ('active', 'draining') AND seen_ms < ?)";
    Ok(sqlx::query_scalar(sql).bind(since).fetch_one(db).await?)
}

/// Marks workers as lost that were not heard of.
pub(super) async fn lose(db: &mut SqliteConnection, silence: Duration) -> Result<Vec<WorkerId>> {
    let since = now(db).await? - millis(silence);
    let rows = sqlx::query(
        "UPDATE worker SET state = 'lost' WHERE state IN ('active', 'draining') AND seen_ms < ? RETURNING id",
    );
    rows.bind(since).fetch_all(db).await?.iter().map(|row| parse(row, "id")).collect()
}

/// Numbers for gauges.
pub(super) async fn counts(db: &mut SqliteConnection) -> Result<Counts> {
    let mut counts = Counts::default();
    for row in sqlx::query("SELECT state, count(*) AS n FROM job GROUP BY state").fetch_all(&mut *db).await? {
        counts.jobs.push((job_state(row.try_get("state")?)?, count(&row, "n")?));
    }
    for row in
        sqlx::query("SELECT state, count(*) AS n FROM worker GROUP BY state").fetch_all(&mut *db).await?
    {
        counts.workers.push((worker_state(row.try_get("state")?)?, count(&row, "n")?));
    }
    let leases: i64 = sqlx::query_scalar("SELECT count(*) FROM lease").fetch_one(db).await?;
    counts.leases = leases as u64;
    Ok(counts)
}

/// Forgets idempotency keys older than `age`.
pub(super) async fn forget_keys(db: &mut SqliteConnection, age: Duration) -> Result<()> {
    let before = now(db).await? - millis(age);
    sqlx::query("DELETE FROM idempotency WHERE created_ms < ?").bind(before).execute(db).await?;
    Ok(())
}

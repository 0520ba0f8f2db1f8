//! Workers, and numbers for gauges.

use super::{
    column::{
        columns_of, count, from_json, job_state, millis, parse, time, to_json, worker_state,
        worker_state_name,
    },
    connection::{Db, Row},
    query::query,
};
use crate::store::{
    error::Result,
    row::{Counts, WorkerRow},
};
use ovtigre_proto::{id::WorkerId, lease::WorkerJoin, status::WorkerState};
use std::time::Duration;

/// A worker joins.
pub(super) async fn add(db: &mut Db, id: &WorkerId, join: WorkerJoin) -> Result<()> {
    let now = db.now().await?;
    let insert = query(
        "INSERT INTO worker (id, name, threads, build, instruction_set, tags, state, joined_ms, seen_ms)
         VALUES ($1, $2, $3, $4, $5, $6, 'active', $7, $7)",
    );
    let insert = insert.bind(id.as_str()).bind(join.name).bind(join.threads).bind(join.build);
    db.execute(insert.bind(join.instruction_set).bind(to_json(&join.tags)?).bind(now)).await.map(drop)
}

/// A worker is heard of. One that is to leave, or has left, does not come back by it.
pub(super) async fn see(db: &mut Db, id: &WorkerId, state: WorkerState) -> Result<Option<WorkerState>> {
    let now = db.now().await?;
    let seen = query(
        "UPDATE worker SET seen_ms = $1,
                state = CASE WHEN state = 'gone' OR (state IN ('draining', 'aside') AND $2 = 'active') THEN state ELSE $2 END
         WHERE id = $3 RETURNING state",
    );
    let row = db.first(seen.bind(now).bind(worker_state_name(state)).bind(id.as_str())).await?;
    row.map(|row| worker_state(&row.text("state")?)).transpose()
}

/// A worker stands so from now on.
pub(super) async fn set_state(db: &mut Db, id: &WorkerId, state: WorkerState) -> Result<bool> {
    let set = query("UPDATE worker SET state = $1 WHERE id = $2").bind(worker_state_name(state));
    Ok(db.execute(set.bind(id.as_str())).await? > 0)
}

/// A worker.
pub(super) async fn get(db: &mut Db, id: &WorkerId) -> Result<Option<WorkerRow>> {
    let row = query(concat!(
        "SELECT ", columns_of!(worker), ", (SELECT count(*) FROM lease WHERE lease.worker = worker.id) AS leases,
                (SELECT lease.job FROM lease WHERE lease.worker = worker.id ORDER BY granted_ms LIMIT 1) AS job
         FROM worker WHERE id = $1"
    ));
    db.first(row.bind(id.as_str())).await?.as_ref().map(read).transpose()
}

/// Workers, the newest first.
pub(super) async fn list(db: &mut Db, before: Option<i64>, limit: u32) -> Result<Vec<(i64, WorkerRow)>> {
    let rows = query(concat!(
        "SELECT ", columns_of!(worker), ", (SELECT count(*) FROM lease WHERE lease.worker = worker.id) AS leases,
                (SELECT lease.job FROM lease WHERE lease.worker = worker.id ORDER BY granted_ms LIMIT 1) AS job
         FROM worker WHERE sequence < $1 ORDER BY sequence DESC LIMIT $2"
    ));
    let rows = db.all(rows.bind(before.unwrap_or(i64::MAX)).bind(limit)).await?;
    rows.iter().map(|row| Ok((row.whole("sequence")?, read(row)?))).collect()
}

fn read(row: &Row) -> Result<WorkerRow> {
    Ok(WorkerRow {
        id: parse(row, "id")?,
        join: WorkerJoin {
            name: row.text("name")?,
            threads: count(row, "threads")?,
            build: row.text("build")?,
            instruction_set: row.text("instruction_set")?,
            tags: from_json(row, "tags")?,
        },
        state: worker_state(&row.text("state")?)?,
        joined_at: time(row.whole("joined_ms")?)?,
        seen_at: time(row.whole("seen_ms")?)?,
        leases: count(row, "leases")?,
        job: match row.text_or_none("job")? {
            Some(_) => Some(parse(row, "job")?),
            None => None,
        },
        batches_done: count(row, "batches_done")?,
        failures: count(row, "failures")?,
        rays_per_second: row.real("rays_per_second")?,
        reason: row.text_or_none("reason")?,
    })
}

/// Workers that would be lost, without a change.
pub(super) async fn any_silent(db: &mut Db, silence: Duration) -> Result<bool> {
    let since = db.now().await? - millis(silence);
    let any = "SELECT id FROM worker WHERE state IN ('active', 'draining') AND seen_ms < $1 LIMIT 1";
    Ok(db.first(query(any).bind(since)).await?.is_some())
}

/// Marks workers as lost that were not heard of.
pub(super) async fn lose(db: &mut Db, silence: Duration) -> Result<Vec<WorkerId>> {
    let since = db.now().await? - millis(silence);
    let lost = query(
        "UPDATE worker SET state = 'lost' WHERE state IN ('active', 'draining') AND seen_ms < $1 RETURNING id",
    );
    db.all(lost.bind(since)).await?.iter().map(|row| parse(row, "id")).collect()
}

/// Numbers for gauges.
pub(super) async fn counts(db: &mut Db) -> Result<Counts> {
    let mut counts = Counts::default();
    for row in db.all(query("SELECT state, count(*) AS n FROM job GROUP BY state")).await? {
        counts.jobs.push((job_state(&row.text("state")?)?, count(&row, "n")?));
    }
    for row in db.all(query("SELECT state, count(*) AS n FROM worker GROUP BY state")).await? {
        counts.workers.push((worker_state(&row.text("state")?)?, count(&row, "n")?));
    }
    counts.leases = count(&db.one(query("SELECT count(*) AS n FROM lease")).await?, "n")?;
    Ok(counts)
}

/// Forgets idempotency keys older than `age`.
pub(super) async fn forget_keys(db: &mut Db, age: Duration) -> Result<()> {
    let before = db.now().await? - millis(age);
    db.execute(query("DELETE FROM idempotency WHERE created_ms < $1").bind(before)).await.map(drop)
}

//! Handing out batches and taking them back.

use super::column::{batch, count, lease, millis, now, parse};
use crate::store::{
    error::Result,
    row::{BatchKey, Claim, CommitRow, Lane, LeaseRow, Ledger, Released},
};
use ovtigre_proto::id::{JobId, LeaseId, WorkerId};
use sqlx::{Row as _, SqliteConnection, sqlite::SqliteRow};
use std::{ops::Range, time::Duration};

/// What a job's work looks like.
pub(super) async fn read(db: &mut SqliteConnection, job: &JobId) -> Result<Ledger> {
    let mut ledger = Ledger::default();
    let id = job.as_str();
    let rows = sqlx::query("SELECT region, replicate, next_block AS block FROM cursor WHERE job = ?");
    for row in rows.bind(id).fetch_all(&mut *db).await? {
        let at = batch(&row)?;
        ledger.cursors.push((at.lane(), at.block));
    }
    let rows = sqlx::query("SELECT region, replicate, block FROM returned WHERE job = ?");
    for row in rows.bind(id).fetch_all(&mut *db).await? {
        ledger.returned.push(batch(&row)?);
    }
    let rows = sqlx::query("SELECT id, job, region, replicate, block, worker FROM lease WHERE job = ?");
    for row in rows.bind(id).fetch_all(&mut *db).await? {
        ledger.leases.push(lease(&row)?);
    }
    let rows = sqlx::query("SELECT region, replicate, block, hash, worker_micros FROM commits WHERE job = ?");
    for row in rows.bind(id).fetch_all(&mut *db).await? {
        ledger.commits.push(commit(&row)?);
    }
    let rows = sqlx::query("SELECT region, replicate, blocks AS block FROM snapshot WHERE job = ?");
    for row in rows.bind(id).fetch_all(&mut *db).await? {
        let at = batch(&row)?;
        ledger.snapshots.push((at.lane(), at.block));
    }
    let checkpoints: i64 =
        sqlx::query_scalar("SELECT count(*) FROM checkpoint WHERE job = ?").bind(id).fetch_one(db).await?;
    ledger.checkpoints = checkpoints as u32;
    Ok(ledger)
}

fn commit(row: &SqliteRow) -> Result<CommitRow> {
    Ok(CommitRow {
        batch: batch(row)?,
        hash: parse(row, "hash")?,
        worker_micros: count(row, "worker_micros")?,
    })
}

/// What was brought of some blocks of a lane.
pub(super) async fn commits(
    db: &mut SqliteConnection,
    job: &JobId,
    lane: Lane,
    blocks: Range<u32>,
) -> Result<Vec<CommitRow>> {
    let rows = sqlx::query(
        "SELECT region, replicate, block, hash, worker_micros FROM commits
         WHERE job = ? AND region = ? AND replicate = ? AND block >= ? AND block < ? ORDER BY block",
    );
    let rows = rows.bind(job.as_str()).bind(lane.region).bind(lane.replicate);
    rows.bind(blocks.start).bind(blocks.end).fetch_all(db).await?.iter().map(commit).collect()
}

/// Hands out each batch that may be.
pub(super) async fn claim(
    db: &mut SqliteConnection,
    claims: Vec<Claim>,
    time: Duration,
) -> Result<Vec<bool>> {
    let now = now(db).await?;
    let mut claimed = Vec::with_capacity(claims.len());
    for one in claims {
        claimed.push(claim_one(db, &one, now, millis(time)).await?);
    }
    Ok(claimed)
}

async fn claim_one(db: &mut SqliteConnection, claim: &Claim, now: i64, time: i64) -> Result<bool> {
    let Claim { lease, job, batch: BatchKey { block, replicate, region }, worker } = claim;
    let state: Option<String> = sqlx::query_scalar("SELECT state FROM job WHERE id = ?")
        .bind(job.as_str())
        .fetch_optional(&mut *db)
        .await?;
    if !matches!(state.as_deref(), Some("queued" | "running")) {
        return Ok(false);
    }
    let returned =
        sqlx::query("DELETE FROM returned WHERE job = ? AND region = ? AND replicate = ? AND block = ?");
    let returned =
        returned.bind(job.as_str()).bind(region).bind(replicate).bind(block).execute(&mut *db).await?;
    if returned.rows_affected() == 0 {
        let next = sqlx::query(
            "UPDATE cursor SET next_block = next_block + 1
             WHERE job = ? AND region = ? AND replicate = ? AND next_block = ?",
        );
        let next = next.bind(job.as_str()).bind(region).bind(replicate).bind(block).execute(&mut *db).await?;
        if next.rows_affected() == 0 {
            return Ok(false);
        }
    }
    sqlx::query(
        "INSERT INTO lease (id, job, region, replicate, block, worker, granted_ms, ends_ms)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
    )
    .bind(lease.as_str())
    .bind(job.as_str())
    .bind(region)
    .bind(replicate)
    .bind(block)
    .bind(worker.as_str())
    .bind(now)
    .bind(now + time)
    .execute(&mut *db)
    .await?;
    if state.as_deref() == Some("queued") {
        sqlx::query(
            "UPDATE job SET state = 'running', version = version + 1, started_ms = coalesce(started_ms, ?2)
             WHERE id = ?1",
        )
        .bind(job.as_str())
        .bind(now)
        .execute(db)
        .await?;
    }
    Ok(true)
}

/// Gives those leases `time` from now that the worker still has.
pub(super) async fn renew(
    db: &mut SqliteConnection,
    worker: &WorkerId,
    leases: Vec<LeaseId>,
    time: Duration,
) -> Result<Vec<LeaseId>> {
    let ends = now(db).await? + millis(time);
    let mut renewed = Vec::with_capacity(leases.len());
    for id in leases {
        let row = sqlx::query("UPDATE lease SET ends_ms = ? WHERE id = ? AND worker = ?");
        let row = row.bind(ends).bind(id.as_str()).bind(worker.as_str()).execute(&mut *db).await?;
        if row.rows_affected() > 0 {
            renewed.push(id);
        }
    }
    Ok(renewed)
}

/// Ends a lease and returns its batch.
pub(super) async fn release(
    db: &mut SqliteConnection,
    id: &LeaseId,
    failure: Option<String>,
) -> Result<Option<Released>> {
    let row = sqlx::query("SELECT id, job, region, replicate, block, worker FROM lease WHERE id = ?");
    let Some(row) = row.bind(id.as_str()).fetch_optional(&mut *db).await? else { return Ok(None) };
    let lease = lease(&row)?;
    let now = now(db).await?;
    take_back(db, lease, failure.map_or(End::HandedBack, End::Failed), now).await.map(Some)
}

/// Ends the leases whose time is over.
pub(super) async fn expire(db: &mut SqliteConnection) -> Result<Vec<Released>> {
    let now = now(db).await?;
    let rows = sqlx::query("SELECT id, job, region, replicate, block, worker FROM lease WHERE ends_ms <= ?");
    let mut ended = Vec::new();
    for row in rows.bind(now).fetch_all(&mut *db).await? {
        ended.push(take_back(db, lease(&row)?, End::Lost, now).await?);
    }
    Ok(ended)
}

/// Whether a lease's time is over, for a reader.
pub(super) async fn any_expired(db: &mut SqliteConnection) -> Result<bool> {
    let now = now(db).await?;
    Ok(sqlx::query_scalar("SELECT EXISTS (SELECT 1 FROM lease WHERE ends_ms <= ?)")
        .bind(now)
        .fetch_one(db)
        .await?)
}

/// How a lease ended without a sum.
enum End {
    HandedBack,
    Failed(String),
    Lost,
}

async fn take_back(db: &mut SqliteConnection, lease: LeaseRow, end: End, now: i64) -> Result<Released> {
    let LeaseRow { id, job, batch: BatchKey { block, replicate, region }, worker } = &lease;
    sqlx::query("DELETE FROM lease WHERE id = ?").bind(id.as_str()).execute(&mut *db).await?;
    sqlx::query(
        "INSERT INTO returned (job, region, replicate, block) VALUES (?, ?, ?, ?) ON CONFLICT DO NOTHING",
    )
    .bind(job.as_str())
    .bind(region)
    .bind(replicate)
    .bind(block)
    .execute(&mut *db)
    .await?;
    let failure = match end {
        End::HandedBack => None,
        End::Failed(reason) => Some((reason, false)),
        End::Lost => Some(("its worker was not heard of in time".to_owned(), true)),
    };
    if let Some((reason, lost)) = failure {
        sqlx::query(
            "INSERT INTO failure (job, region, replicate, block, worker, reason, lost, failed_ms)
             VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
        )
        .bind(job.as_str())
        .bind(region)
        .bind(replicate)
        .bind(block)
        .bind(worker.as_str())
        .bind(reason)
        .bind(lost)
        .bind(now)
        .execute(&mut *db)
        .await?;
        sqlx::query("UPDATE worker SET failures = failures + 1 WHERE id = ?")
            .bind(worker.as_str())
            .execute(&mut *db)
            .await?;
    }
    let (failures, workers, losses): (i64, i64, i64) = sqlx::query_as(
        "SELECT count(CASE WHEN lost = 0 THEN 1 END), count(DISTINCT CASE WHEN lost = 0 THEN worker END),
                count(CASE WHEN lost = 1 THEN 1 END)
         FROM failure
         WHERE job = ? AND region = ? AND replicate = ? AND block = ?",
    )
    .bind(job.as_str())
    .bind(region)
    .bind(replicate)
    .bind(block)
    .fetch_one(db)
    .await?;
    Ok(Released { lease, failures: failures as u32, workers: workers as u32, losses: losses as u32 })
}

/// Remembers how far a lane is kept as one blob.
pub(super) async fn set_snapshot(
    db: &mut SqliteConnection,
    job: &JobId,
    lane: Lane,
    blocks: u32,
) -> Result<()> {
    sqlx::query(
        "INSERT INTO snapshot (job, region, replicate, blocks) VALUES (?, ?, ?, ?)
         ON CONFLICT (job, region, replicate) DO UPDATE SET blocks = excluded.blocks",
    )
    .bind(job.as_str())
    .bind(lane.region)
    .bind(lane.replicate)
    .bind(blocks)
    .execute(db)
    .await?;
    Ok(())
}

/// Workers that hold a batch of the job.
pub(super) async fn workers_of(db: &mut SqliteConnection, job: &JobId) -> Result<u32> {
    let row = sqlx::query("SELECT count(DISTINCT worker) AS n FROM lease WHERE job = ?").bind(job.as_str());
    Ok(row.fetch_one(db).await?.try_get::<i64, _>("n")? as u32)
}

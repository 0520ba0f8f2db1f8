//! What was brought, and the curve.

use super::column::{now, parse};
use crate::store::{
    error::{Result, StoreError},
    row::{BatchKey, CommitOutcome, CommitRow, NewCheckpoint, NewCommit},
};
use ovtigre_proto::{
    curve::{CurveRow, LayerError},
    id::{BlobId, JobId},
};
use sqlx::{Row as _, SqliteConnection};

/// Records a batch's sum if there is none; otherwise compares.
pub(super) async fn commit(db: &mut SqliteConnection, new: NewCommit) -> Result<CommitOutcome> {
    let NewCommit { job, row: CommitRow { batch, hash, worker_micros }, worker, rays_per_second } = new;
    let over: Option<String> = sqlx::query_scalar("SELECT state FROM job WHERE id = ?")
        .bind(job.as_str())
        .fetch_optional(&mut *db)
        .await?;
    match over {
        None => return Ok(CommitOutcome::NoJob),
        Some(state) if super::column::job_state(&state)?.is_over() => return Ok(CommitOutcome::JobOver),
        Some(_) => {}
    }
    let next: Option<i64> =
        sqlx::query_scalar("SELECT next_block FROM cursor WHERE job = ? AND region = ? AND replicate = ?")
            .bind(job.as_str())
            .bind(batch.region)
            .bind(batch.replicate)
            .fetch_optional(&mut *db)
            .await?;
    if next.is_none_or(|next| next <= i64::from(batch.block)) {
        return Ok(CommitOutcome::NeverHandedOut);
    }
    let now = now(db).await?;
    let who = worker.as_ref().map_or("", |w| w.as_str());
    let inserted = sqlx::query(
        "INSERT INTO commits (job, region, replicate, block, hash, worker, worker_micros, committed_ms)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT DO NOTHING",
    )
    .bind(job.as_str())
    .bind(batch.region)
    .bind(batch.replicate)
    .bind(batch.block)
    .bind(hash.as_str())
    .bind(who)
    .bind(worker_micros as i64)
    .bind(now)
    .execute(&mut *db)
    .await?;
    if inserted.rows_affected() == 0 {
        return compare(db, &job, batch, &hash, who, now).await;
    }
    for sql in [
        "DELETE FROM lease WHERE job = ? AND region = ? AND replicate = ? AND block = ?",
        "DELETE FROM returned WHERE job = ? AND region = ? AND replicate = ? AND block = ?",
        "DELETE FROM failure WHERE job = ? AND region = ? AND replicate = ? AND block = ?",
    ] {
        let query = sqlx::query(sql).bind(job.as_str());
        query.bind(batch.region).bind(batch.replicate).bind(batch.block).execute(&mut *db).await?;
    }
    sqlx::query("UPDATE worker SET batches_done = batches_done + 1, rays_per_second = ?2 WHERE id = ?1")
        .bind(who)
        .bind(rays_per_second)
        .execute(db)
        .await?;
    Ok(CommitOutcome::First)
}

async fn compare(
    db: &mut SqliteConnection,
    job: &JobId,
    batch: BatchKey,
    hash: &BlobId,
    worker: &str,
    now: i64,
) -> Result<CommitOutcome> {
    let row =
        sqlx::query("SELECT hash FROM commits WHERE job = ? AND region = ? AND replicate = ? AND block = ?");
    let row = row.bind(job.as_str()).bind(batch.region).bind(batch.replicate).bind(batch.block);
    let kept: BlobId = parse(&row.fetch_one(&mut *db).await?, "hash")?;
    if kept == *hash {
        return Ok(CommitOutcome::Same);
    }
    sqlx::query(
        "INSERT INTO disagreement (job, region, replicate, block, hash, worker, seen_ms)
         VALUES (?, ?, ?, ?, ?, ?, ?) ON CONFLICT DO NOTHING",
    )
    .bind(job.as_str())
    .bind(batch.region)
    .bind(batch.replicate)
    .bind(batch.block)
    .bind(hash.as_str())
    .bind(worker)
    .bind(now)
    .execute(db)
    .await?;
    Ok(CommitOutcome::Differs { kept })
}

/// Adds a checkpoint; again changes nothing.
pub(super) async fn add_checkpoint(db: &mut SqliteConnection, job: &JobId, new: NewCheckpoint) -> Result<()> {
    let NewCheckpoint { look, row, layers, progress } = new;
    let layers = serde_json::to_string(&layers).map_err(|e| StoreError::damaged("layers", e))?;
    let added = sqlx::query(
        "INSERT INTO checkpoint (job, look, samples, wall_seconds, worker_seconds, rays,
                                 rms_error, relative_error, relative_error_upper, layers)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT DO NOTHING",
    )
    .bind(job.as_str())
    .bind(look)
    .bind(row.samples)
    .bind(row.wall_seconds)
    .bind(row.worker_seconds)
    .bind(row.rays as i64)
    .bind(row.rms_error)
    .bind(row.relative_error)
    .bind(row.relative_error_upper)
    .bind(layers)
    .execute(&mut *db)
    .await?;
    if added.rows_affected() > 0 {
        let progress = serde_json::to_string(&progress).map_err(|e| StoreError::damaged("progress", e))?;
        sqlx::query("UPDATE job SET progress = ? WHERE id = ?")
            .bind(progress)
            .bind(job.as_str())
            .execute(db)
            .await?;
    }
    Ok(())
}

/// What was known of a job's layers at its latest checkpoint.
pub(super) async fn layers(db: &mut SqliteConnection, job: &JobId) -> Result<Vec<LayerError>> {
    let text: Option<String> =
        sqlx::query_scalar("SELECT layers FROM checkpoint WHERE job = ? ORDER BY look DESC LIMIT 1")
            .bind(job.as_str())
            .fetch_optional(db)
            .await?;
    let Some(text) = text else { return Ok(Vec::new()) };
    serde_json::from_str(&text).map_err(|e| StoreError::damaged("layers", e))
}

/// A job's checkpoints in order.
pub(super) async fn curve(db: &mut SqliteConnection, job: &JobId) -> Result<Vec<CurveRow>> {
    let rows = sqlx::query("SELECT * FROM checkpoint WHERE job = ? ORDER BY look").bind(job.as_str());
    let rows = rows.fetch_all(db).await?;
    rows.iter()
        .map(|row| {
            Ok(CurveRow {
                samples: row.try_get("samples")?,
                wall_seconds: row.try_get("wall_seconds")?,
                worker_seconds: row.try_get("worker_seconds")?,
                rays: super::column::count(row, "rays")?,
                rms_error: row.try_get("rms_error")?,
                relative_error: row.try_get("relative_error")?,
                relative_error_upper: row.try_get("relative_error_upper")?,
            })
        })
        .collect()
}

//! What was brought, and the curve.

use super::{
    column::{columns_of, commit as commit_row, count, from_json, to_json},
    connection::{Db, Row},
    merger::require,
    query::query,
};
use crate::store::{
    error::Result,
    list::billionths,
    row::{BatchKey, Brought, CommitRow, Lane, Mandate, NewCheckpoint},
};
use ovtigre_core::film::allocation::Allocations;
use ovtigre_proto::{
    curve::{CurveRow, LayerError},
    id::{BlobId, JobId},
};
use std::ops::Range;

/// Remembers a sum that differs from the one that counts.
pub(super) async fn disagree(
    db: &mut Db,
    job: &JobId,
    batch: BatchKey,
    hash: &BlobId,
    worker: &str,
    now: i64,
) -> Result<()> {
    let insert = query(
        "INSERT INTO disagreement (job, region, replicate, block, hash, worker, seen_ms)
         VALUES ($1, $2, $3, $4, $5, $6, $7) ON CONFLICT DO NOTHING",
    );
    let insert = insert.bind(job.as_str()).bind(batch.region).bind(batch.replicate).bind(batch.block);
    db.execute(insert.bind(hash.as_str()).bind(worker).bind(now)).await.map(drop)
}

/// What was brought of some blocks of a lane.
pub(super) async fn of_lane(
    db: &mut Db,
    job: &JobId,
    lane: Lane,
    blocks: Range<u32>,
) -> Result<Vec<CommitRow>> {
    let rows = query(
        "SELECT region, replicate, block, hash, worker_micros FROM commits
         WHERE job = $1 AND region = $2 AND replicate = $3 AND block >= $4 AND block < $5 ORDER BY block",
    );
    let rows = rows.bind(job.as_str()).bind(lane.region).bind(lane.replicate);
    db.all(rows.bind(blocks.start).bind(blocks.end)).await?.iter().map(commit_row).collect()
}

/// What was brought after the `after`-th.
pub(super) async fn after(db: &mut Db, job: &JobId, after: u64) -> Result<Brought> {
    let rows = query(
        "SELECT region, replicate, block, hash, worker_micros, number FROM commits
         WHERE job = $1 AND number > $2 ORDER BY number",
    );
    let rows = db.all(rows.bind(job.as_str()).bind(after)).await?;
    let count = rows.last().map_or(Ok(after), |row| count(row, "number"))?;
    Ok(Brought { rows: rows.iter().map(commit_row).collect::<Result<_>>()?, count })
}

/// Adds a checkpoint; again changes nothing.
pub(super) async fn add_checkpoint(
    db: &mut Db,
    job: &JobId,
    mandate: Mandate,
    new: NewCheckpoint,
) -> Result<()> {
    require(db, job, mandate).await?;
    let NewCheckpoint { look, row, layers, progress, allocations } = new;
    let insert = query(
        "INSERT INTO checkpoint (job, look, samples, wall_seconds, worker_seconds, rays,
                                 rms_error, relative_error, relative_error_upper, layers,
                                 target_expected_at_seconds, doubt)
         VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12) ON CONFLICT DO NOTHING",
    );
    let insert = insert.bind(job.as_str()).bind(look).bind(row.samples).bind(row.wall_seconds);
    let insert = insert.bind(row.worker_seconds).bind(row.rays).bind(row.rms_error);
    let insert = insert.bind(row.relative_error).bind(row.relative_error_upper).bind(to_json(&layers)?);
    let insert =
        insert.bind(row.target_expected_at_seconds).bind(row.doubt.as_ref().map(to_json).transpose()?);
    if db.execute(insert).await? > 0 {
        let progress = to_json(&progress)?;
        let set = query("UPDATE job SET progress = $2, looks = $3, error_ppb = $4 WHERE id = $1");
        let set = set.bind(job.as_str()).bind(progress).bind(look);
        db.execute(set.bind(billionths(row.relative_error))).await?;
    }
    if let Some(allocations) = allocations {
        let insert =
            query("INSERT INTO allocation (job, allocations) VALUES ($1, $2) ON CONFLICT DO NOTHING");
        db.execute(insert.bind(job.as_str()).bind(to_json(&allocations)?)).await?;
    }
    Ok(())
}

/// What was known of a job's layers at its latest checkpoint.
pub(super) async fn layers(db: &mut Db, job: &JobId) -> Result<Vec<LayerError>> {
    let latest = query("SELECT layers FROM checkpoint WHERE job = $1 ORDER BY look DESC LIMIT 1");
    let row = db.first(latest.bind(job.as_str())).await?;
    row.map_or_else(|| Ok(Vec::new()), |row| from_json(&row, "layers"))
}

/// How a job's samples are allocated.
pub(super) async fn allocations(db: &mut Db, job: &JobId) -> Result<Option<Allocations>> {
    let row = query("SELECT allocations FROM allocation WHERE job = $1").bind(job.as_str());
    db.first(row).await?.map(|row| from_json(&row, "allocations")).transpose()
}

/// A job's checkpoints in order.
pub(super) async fn curve(db: &mut Db, job: &JobId) -> Result<Vec<CurveRow>> {
    let rows =
        query(concat!("SELECT ", columns_of!(checkpoint), " FROM checkpoint WHERE job = $1 ORDER BY look"))
            .bind(job.as_str());
    db.all(rows).await?.iter().map(curve_row).collect()
}

/// Columns of a checkpoint.
pub(super) fn curve_row(row: &Row) -> Result<CurveRow> {
    Ok(CurveRow {
        samples: count(row, "samples")?,
        wall_seconds: row.real("wall_seconds")?,
        worker_seconds: row.real("worker_seconds")?,
        rays: count(row, "rays")?,
        rms_error: row.real_or_none("rms_error")?,
        relative_error: row.real_or_none("relative_error")?,
        relative_error_upper: row.real_or_none("relative_error_upper")?,
        target_expected_at_seconds: row.real_or_none("target_expected_at_seconds")?,
        doubt: row.text_or_none("doubt")?.map(|_| from_json(row, "doubt")).transpose()?,
    })
}

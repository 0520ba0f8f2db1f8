//! What was brought, and the curve.

use super::{
    column::{commit as commit_row, count, from_json, job_state, parse, to_json},
    connection::Db,
    merger::require,
    query::query,
};
use crate::store::{
    error::Result,
    row::{BatchKey, Brought, CommitOutcome, CommitRow, Lane, Mandate, NewCheckpoint, NewCommit},
};
use ovtigre_proto::{
    curve::{CurveRow, LayerError},
    id::{BlobId, JobId},
};
use std::ops::Range;

/// Records a batch's sum if there is none; otherwise compares.
pub(super) async fn commit(db: &mut Db, new: NewCommit) -> Result<CommitOutcome> {
    let NewCommit { job, row: CommitRow { batch, hash, worker_micros }, worker, rays_per_second } = new;
    let state = query(
        "SELECT state, brought,
           (SELECT next_block FROM cursor WHERE job = $1 AND region = $2 AND replicate = $3) AS next_block,
           (SELECT worker FROM lease WHERE job = $1 AND region = $2 AND replicate = $3 AND block = $4) AS holder,
           (SELECT count(*) FROM returned WHERE job = $1 AND region = $2 AND replicate = $3 AND block = $4) AS returned,
           (SELECT count(*) FROM failure WHERE job = $1 AND region = $2 AND replicate = $3 AND block = $4) AS failed
         FROM job WHERE id = $1",
    );
    let state = state.bind(job.as_str()).bind(batch.region).bind(batch.replicate).bind(batch.block);
    let Some(row) = db.first(state).await? else { return Ok(CommitOutcome::NoJob) };
    if job_state(&row.text("state")?)?.is_over() {
        return Ok(CommitOutcome::JobOver);
    }
    let number = row.whole("brought")? + 1;
    let next = row.whole_or_none("next_block")?;
    if next.is_none_or(|next| next <= i64::from(batch.block)) {
        return Ok(CommitOutcome::NeverHandedOut);
    }
    let holder = row.text_or_none("holder")?;
    let who = worker.map(|worker| worker.to_string()).or_else(|| holder.clone()).unwrap_or_default();
    let now = db.now().await?;
    let insert = query(
        "INSERT INTO commits (job, region, replicate, block, hash, worker, worker_micros, committed_ms, number)
         VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9) ON CONFLICT DO NOTHING",
    );
    let insert = insert.bind(job.as_str()).bind(batch.region).bind(batch.replicate).bind(batch.block);
    let insert = insert.bind(hash.as_str()).bind(&*who).bind(worker_micros).bind(now).bind(number);
    if db.execute(insert).await? == 0 {
        return compare(db, &job, batch, &hash, &who, now).await;
    }
    for (there, sql) in [
        (
            holder.is_some(),
            "DELETE FROM lease WHERE job = $1 AND region = $2 AND replicate = $3 AND block = $4",
        ),
        (
            row.truth("returned")?,
            "DELETE FROM returned WHERE job = $1 AND region = $2 AND replicate = $3 AND block = $4",
        ),
        (
            row.truth("failed")?,
            "DELETE FROM failure WHERE job = $1 AND region = $2 AND replicate = $3 AND block = $4",
        ),
    ] {
        if !there {
            continue;
        }
        let delete = query(sql).bind(job.as_str());
        db.execute(delete.bind(batch.region).bind(batch.replicate).bind(batch.block)).await?;
    }
    let counted = query("UPDATE job SET brought = $2 WHERE id = $1").bind(job.as_str()).bind(number);
    db.execute(counted).await?;
    let done = "UPDATE worker SET batches_done = batches_done + 1, rays_per_second = $2 WHERE id = $1";
    db.execute(query(done).bind(who).bind(rays_per_second)).await?;
    Ok(CommitOutcome::First)
}

async fn compare(
    db: &mut Db,
    job: &JobId,
    batch: BatchKey,
    hash: &BlobId,
    worker: &str,
    now: i64,
) -> Result<CommitOutcome> {
    let kept = "SELECT hash FROM commits WHERE job = $1 AND region = $2 AND replicate = $3 AND block = $4";
    let kept = query(kept).bind(job.as_str()).bind(batch.region).bind(batch.replicate).bind(batch.block);
    let kept: BlobId = parse(&db.one(kept).await?, "hash")?;
    if kept == *hash {
        return Ok(CommitOutcome::Same);
    }
    let insert = query(
        "INSERT INTO disagreement (job, region, replicate, block, hash, worker, seen_ms)
         VALUES ($1, $2, $3, $4, $5, $6, $7) ON CONFLICT DO NOTHING",
    );
    let insert = insert.bind(job.as_str()).bind(batch.region).bind(batch.replicate).bind(batch.block);
    db.execute(insert.bind(hash.as_str()).bind(worker).bind(now)).await?;
    Ok(CommitOutcome::Differs { kept })
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
    let NewCheckpoint { look, row, layers, progress } = new;
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
        let set = query("UPDATE job SET progress = $2, looks = $3 WHERE id = $1");
        db.execute(set.bind(job.as_str()).bind(progress).bind(look)).await?;
    }
    Ok(())
}

/// What was known of a job's layers at its latest checkpoint.
pub(super) async fn layers(db: &mut Db, job: &JobId) -> Result<Vec<LayerError>> {
    let latest = query("SELECT layers FROM checkpoint WHERE job = $1 ORDER BY look DESC LIMIT 1");
    let row = db.first(latest.bind(job.as_str())).await?;
    row.map_or_else(|| Ok(Vec::new()), |row| from_json(&row, "layers"))
}

/// A job's checkpoints in order.
pub(super) async fn curve(db: &mut Db, job: &JobId) -> Result<Vec<CurveRow>> {
    let rows = query("SELECT * FROM checkpoint WHERE job = $1 ORDER BY look").bind(job.as_str());
    let read = |row: &super::connection::Row| {
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
    };
    db.all(rows).await?.iter().map(read).collect()
}

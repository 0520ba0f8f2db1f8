//! What is taken back of a job's work, and what workers and callers are held to.

use super::{
    column::{batch, columns_of, count, job_state, parse, time},
    connection::{Db, Row},
    notice,
    query::query,
};
use crate::store::{
    error::{Result, StoreError},
    list::billionths,
    row::{BatchKey, Extension, Lane, TokenRow},
};
use ovtigre_proto::id::{BlobId, JobId, WorkerId};

/// Forgets what was brought of some batches, and lanes kept as one blob.
pub(super) async fn uncommit(
    db: &mut Db,
    job: &JobId,
    batches: Vec<BatchKey>,
    lanes: Vec<Lane>,
) -> Result<()> {
    let Some(row) = db.first(query("SELECT state FROM job WHERE id = $1").bind(job.as_str())).await? else {
        return Ok(());
    };
    let over = job_state(&row.text("state")?)?.is_over();
    for BatchKey { block, replicate, region } in batches {
        let removed =
            query("DELETE FROM commits WHERE job = $1 AND region = $2 AND replicate = $3 AND block = $4");
        let removed = removed.bind(job.as_str()).bind(region).bind(replicate).bind(block);
        if db.execute(removed).await? > 0 && !over {
            let back = query(
                "INSERT INTO returned (job, region, replicate, block) VALUES ($1, $2, $3, $4)
                 ON CONFLICT DO NOTHING",
            );
            db.execute(back.bind(job.as_str()).bind(region).bind(replicate).bind(block)).await?;
        }
    }
    for Lane { replicate, region } in lanes {
        let forgotten = query("DELETE FROM snapshot WHERE job = $1 AND region = $2 AND replicate = $3");
        db.execute(forgotten.bind(job.as_str()).bind(region).bind(replicate)).await?;
    }
    Ok(())
}

/// Batches that a worker brought of jobs that are not over.
pub(super) async fn commits_by(db: &mut Db, worker: &WorkerId) -> Result<Vec<(JobId, BatchKey)>> {
    let rows = query(
        "SELECT commits.job, region, replicate, block FROM commits JOIN job ON job.id = commits.job
         WHERE worker = $1 AND job.state IN ('queued', 'running', 'paused')",
    );
    let rows = db.all(rows.bind(worker.as_str())).await?;
    rows.iter().map(|row| Ok((parse(row, "job")?, batch(row)?))).collect()
}

/// Whoever appends to the job's sums has to begin again.
pub(super) async fn free_merge(db: &mut Db, job: &JobId) -> Result<()> {
    let freed = query("UPDATE merger SET holder = '', epoch = epoch + 1, ends_ms = 0 WHERE job = $1");
    db.execute(freed.bind(job.as_str())).await.map(drop)
}

/// Pins a job to a class of processors.
pub(super) async fn pin_job(db: &mut Db, id: &JobId, class: &str) -> Result<Option<String>> {
    let pinned = query("UPDATE job SET class = $2 WHERE id = $1 AND class IS NULL");
    db.execute(pinned.bind(id.as_str()).bind(class)).await?;
    let row = db.first(query("SELECT class FROM job WHERE id = $1").bind(id.as_str())).await?;
    row.map_or(Ok(None), |row| row.text_or_none("class"))
}

/// Puts a worker aside.
pub(super) async fn set_aside(db: &mut Db, id: &WorkerId, reason: &str) -> Result<bool> {
    let set = query("UPDATE worker SET state = 'aside', reason = $2 WHERE id = $1");
    Ok(db.execute(set.bind(id.as_str()).bind(reason)).await? > 0)
}

/// Gives a job another specification.
pub(super) async fn extend_job(db: &mut Db, id: &JobId, version: u64, to: Extension) -> Result<bool> {
    let now = db.now().await?;
    let row = query("SELECT state FROM job WHERE id = $1 AND version = $2").bind(id.as_str()).bind(version);
    let Some(row) = db.first(row).await? else { return Ok(false) };
    if job_state(&row.text("state")?)?.is_over() {
        go_on(db, id, &to, now).await?;
        notice::note(db, id.as_str(), now).await?;
    } else {
        let back = query("UPDATE cursor SET next_block = $2 WHERE job = $1 AND next_block > $2");
        db.execute(back.bind(id.as_str()).bind(to.whole)).await?;
    }
    for sql in [
        "DELETE FROM commits WHERE job = $1 AND block >= (SELECT next_block FROM cursor WHERE
            cursor.job = commits.job AND cursor.region = commits.region AND cursor.replicate = commits.replicate)",
        "DELETE FROM returned WHERE job = $1 AND block >= (SELECT next_block FROM cursor WHERE
            cursor.job = returned.job AND cursor.region = returned.region AND cursor.replicate = returned.replicate)",
        "DELETE FROM lease WHERE job = $1 AND block >= (SELECT next_block FROM cursor WHERE
            cursor.job = lease.job AND cursor.region = lease.region AND cursor.replicate = lease.replicate)",
        "DELETE FROM failure WHERE job = $1 AND block >= (SELECT next_block FROM cursor WHERE
            cursor.job = failure.job AND cursor.region = failure.region AND cursor.replicate = failure.replicate)",
    ] {
        db.execute(query(sql).bind(id.as_str())).await?;
    }
    let looks = query("DELETE FROM checkpoint WHERE job = $1 AND look > $2").bind(id.as_str());
    db.execute(looks.bind(to.looks)).await?;
    free_merge(db, id).await?;
    let latest = query("SELECT relative_error FROM checkpoint WHERE job = $1 ORDER BY look DESC LIMIT 1");
    let latest = db.first(latest.bind(id.as_str())).await?;
    let error = latest.map_or(Ok(None), |row| row.real_or_none("relative_error"))?;
    let told =
        query("UPDATE job SET version = version + 1, spec = $2, looks = $3, error_ppb = $4 WHERE id = $1");
    let told = told.bind(id.as_str()).bind(to.spec).bind(to.looks);
    db.execute(told.bind(billionths(error))).await?;
    Ok(true)
}

/// A job that is over goes on at what is kept of each lane.
async fn go_on(db: &mut Db, id: &JobId, to: &Extension, now: i64) -> Result<()> {
    let open = query(
        "UPDATE job SET state = 'queued', reason = NULL, settled = 0, certified = 0, manifest = NULL, part_ppb = 0,
            paused_ms = paused_ms + $2 - coalesce(ended_ms, $2), ended_ms = NULL WHERE id = $1",
    );
    db.execute(open.bind(id.as_str()).bind(now)).await?;
    for region in 0..to.regions {
        for replicate in 0..to.replicates {
            let kept = query("SELECT blocks FROM snapshot WHERE job = $1 AND region = $2 AND replicate = $3");
            let kept = db.first(kept.bind(id.as_str()).bind(region).bind(replicate)).await?;
            let next = kept.map_or(Ok(0), |row| row.whole("blocks"))?;
            let cursor =
                query("INSERT INTO cursor (job, region, replicate, next_block) VALUES ($1, $2, $3, $4)");
            db.execute(cursor.bind(id.as_str()).bind(region).bind(replicate).bind(next)).await?;
        }
    }
    Ok(())
}

/// Adds a token.
pub(super) async fn add_token(db: &mut Db, token: TokenRow) -> Result<()> {
    let now = db.now().await?;
    let insert = query("INSERT INTO token (id, name, role, hash, created_ms) VALUES ($1, $2, $3, $4, $5)");
    let insert = insert.bind(token.id).bind(token.name).bind(token.role.name());
    db.execute(insert.bind(token.hash.as_str()).bind(now)).await.map(drop)
}

/// All tokens, the oldest first.
pub(super) async fn tokens(db: &mut Db) -> Result<Vec<TokenRow>> {
    let rows =
        db.all(query(concat!("SELECT ", columns_of!(token), " FROM token ORDER BY created_ms, id"))).await?;
    rows.iter().map(token_row).collect()
}

/// The token of a hash.
pub(super) async fn token(db: &mut Db, hash: &BlobId) -> Result<Option<TokenRow>> {
    let row = db
        .first(
            query(concat!("SELECT ", columns_of!(token), " FROM token WHERE hash = $1")).bind(hash.as_str()),
        )
        .await?;
    row.as_ref().map(token_row).transpose()
}

/// Forgets a token.
pub(super) async fn remove_token(db: &mut Db, id: &str) -> Result<bool> {
    Ok(db.execute(query("DELETE FROM token WHERE id = $1").bind(id)).await? > 0)
}

fn token_row(row: &Row) -> Result<TokenRow> {
    Ok(TokenRow {
        id: row.text("id")?,
        name: row.text("name")?,
        role: row.text("role")?.parse().map_err(|e: String| StoreError::damaged("role", e))?,
        hash: parse(row, "hash")?,
        created_at: Some(time(count(row, "created_ms")?)?),
    })
}

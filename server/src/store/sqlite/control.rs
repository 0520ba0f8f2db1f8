//! What is taken back of a job's work, and what workers and callers are held to.

use super::column::{batch, count, job_state, now, parse, time};
use crate::store::{
    error::{Result, StoreError},
    row::{BatchKey, Extension, Lane, TokenRow},
};
use ovtigre_proto::id::{BlobId, JobId, WorkerId};
use sqlx::{Row as _, SqliteConnection, sqlite::SqliteRow};

/// Forgets what was brought of some batches, and lanes kept as one blob.
pub(super) async fn uncommit(
    db: &mut SqliteConnection,
    job: &JobId,
    batches: Vec<BatchKey>,
    lanes: Vec<Lane>,
) -> Result<()> {
    let state: Option<String> = sqlx::query_scalar("SELECT state FROM job WHERE id = $1")
        .bind(job.as_str())
        .fetch_optional(&mut *db)
        .await?;
    let Some(state) = state else { return Ok(()) };
    let over = job_state(&state)?.is_over();
    for BatchKey { block, replicate, region } in batches {
        let removed = sqlx::query(
            "DELETE FROM commits WHERE job = $1 AND region = $2 AND replicate = $3 AND block = $4",
        );
        let removed = removed.bind(job.as_str()).bind(region).bind(replicate).bind(block);
        if removed.execute(&mut *db).await?.rows_affected() > 0 && !over {
            let back = sqlx::query(
                "INSERT INTO returned (job, region, replicate, block) VALUES ($1, $2, $3, $4)
                 ON CONFLICT DO NOTHING",
            );
            back.bind(job.as_str()).bind(region).bind(replicate).bind(block).execute(&mut *db).await?;
        }
    }
    for Lane { replicate, region } in lanes {
        sqlx::query("DELETE FROM snapshot WHERE job = $1 AND region = $2 AND replicate = $3")
            .bind(job.as_str())
            .bind(region)
            .bind(replicate)
            .execute(&mut *db)
            .await?;
    }
    Ok(())
}

/// Batches that a worker brought of jobs that are not over.
pub(super) async fn commits_by(
    db: &mut SqliteConnection,
    worker: &WorkerId,
) -> Result<Vec<(JobId, BatchKey)>> {
    let rows = sqlx::query(
        "SELECT commits.job, region, replicate, block FROM commits JOIN job ON job.id = commits.job
         WHERE worker = $1 AND job.state IN ('queued', 'running', 'paused')",
    );
    let rows = rows.bind(worker.as_str()).fetch_all(db).await?;
    rows.iter().map(|row| Ok((parse(row, "job")?, batch(row)?))).collect()
}

/// Pins a job to a class of processors.
pub(super) async fn pin_job(db: &mut SqliteConnection, id: &JobId, class: &str) -> Result<Option<String>> {
    sqlx::query("UPDATE job SET class = $2 WHERE id = $1 AND class IS NULL")
        .bind(id.as_str())
        .bind(class)
        .execute(&mut *db)
        .await?;
    let class = sqlx::query_scalar("SELECT class FROM job WHERE id = $1").bind(id.as_str());
    Ok(class.fetch_optional(db).await?.flatten())
}

/// Puts a worker aside.
pub(super) async fn set_aside(db: &mut SqliteConnection, id: &WorkerId, reason: &str) -> Result<bool> {
    let set = sqlx::query("UPDATE worker SET state = 'aside', reason = $2 WHERE id = $1");
    Ok(set.bind(id.as_str()).bind(reason).execute(db).await?.rows_affected() > 0)
}

/// Gives a job another specification.
pub(super) async fn extend_job(
    db: &mut SqliteConnection,
    id: &JobId,
    version: u64,
    to: Extension,
) -> Result<bool> {
    let now = now(db).await?;
    let state: Option<String> = sqlx::query_scalar("SELECT state FROM job WHERE id = $1 AND version = $2")
        .bind(id.as_str())
        .bind(version as i64)
        .fetch_optional(&mut *db)
        .await?;
    let Some(state) = state else { return Ok(false) };
    if job_state(&state)?.is_over() {
        sqlx::query(
            "UPDATE job SET state = 'queued', reason = NULL, settled = 0, certified = 0, manifest = NULL,
                paused_ms = paused_ms + $2 - coalesce(ended_ms, $2), ended_ms = NULL WHERE id = $1",
        )
        .bind(id.as_str())
        .bind(now)
        .execute(&mut *db)
        .await?;
        for region in 0..to.regions {
            for replicate in 0..to.replicates {
                sqlx::query(
                    "INSERT INTO cursor (job, region, replicate, next_block) VALUES ($1, $2, $3,
                        coalesce((SELECT blocks FROM snapshot
                                  WHERE job = $1 AND region = $2 AND replicate = $3), 0))",
                )
                .bind(id.as_str())
                .bind(region)
                .bind(replicate)
                .execute(&mut *db)
                .await?;
            }
        }
    } else {
        sqlx::query("UPDATE cursor SET next_block = $2 WHERE job = $1 AND next_block > $2")
            .bind(id.as_str())
            .bind(to.whole)
            .execute(&mut *db)
            .await?;
    }
    for table in ["commits", "returned", "lease", "failure"] {
        let sql = sqlx::AssertSqlSafe(format!(
            "DELETE FROM {table} WHERE job = $1 AND block >= (SELECT next_block FROM cursor
                WHERE cursor.job = {table}.job AND cursor.region = {table}.region
                  AND cursor.replicate = {table}.replicate)"
        ));
        sqlx::query(sql).bind(id.as_str()).execute(&mut *db).await?;
    }
    sqlx::query("DELETE FROM checkpoint WHERE job = $1 AND look > $2")
        .bind(id.as_str())
        .bind(to.looks)
        .execute(&mut *db)
        .await?;
    sqlx::query("UPDATE job SET version = version + 1, spec = $2 WHERE id = $1")
        .bind(id.as_str())
        .bind(to.spec)
        .execute(db)
        .await?;
    Ok(true)
}

/// Adds a token.
pub(super) async fn add_token(db: &mut SqliteConnection, token: TokenRow) -> Result<()> {
    sqlx::query("INSERT INTO token (id, name, role, hash, created_ms) VALUES ($1, $2, $3, $4, $5)")
        .bind(token.id)
        .bind(token.name)
        .bind(token.role.name())
        .bind(token.hash.as_str())
        .bind(now(db).await?)
        .execute(db)
        .await?;
    Ok(())
}

/// All tokens, the oldest first.
pub(super) async fn tokens(db: &mut SqliteConnection) -> Result<Vec<TokenRow>> {
    let rows = sqlx::query("SELECT * FROM token ORDER BY created_ms, id").fetch_all(db).await?;
    rows.iter().map(token_row).collect()
}

/// The token of a hash.
pub(super) async fn token(db: &mut SqliteConnection, hash: &BlobId) -> Result<Option<TokenRow>> {
    let row = sqlx::query("SELECT * FROM token WHERE hash = $1").bind(hash.as_str());
    row.fetch_optional(db).await?.as_ref().map(token_row).transpose()
}

/// Forgets a token.
pub(super) async fn remove_token(db: &mut SqliteConnection, id: &str) -> Result<bool> {
    let removed = sqlx::query("DELETE FROM token WHERE id = $1").bind(id).execute(db).await?;
    Ok(removed.rows_affected() > 0)
}

fn token_row(row: &SqliteRow) -> Result<TokenRow> {
    let role: String = row.try_get("role")?;
    Ok(TokenRow {
        id: row.try_get("id")?,
        name: row.try_get("name")?,
        role: role.parse().map_err(|e| StoreError::damaged("role", e))?,
        hash: parse(row, "hash")?,
        created_at: Some(time(count(row, "created_ms")?)?),
    })
}

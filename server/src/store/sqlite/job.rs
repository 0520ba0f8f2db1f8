//! Scenes and jobs.

use super::column::{count, job_state, now, parse, time};
use crate::store::{
    error::{Result, StoreError},
    row::{Added, IdempotencyKey, JobChange, JobFilter, JobRow, NewJob, SceneRow, Settlement},
};
use ovtigre_proto::{
    id::{BlobId, JobId},
    scene::SceneReport,
    status::JobState,
};
use sqlx::{Row as _, SqliteConnection, sqlite::SqliteRow};

/// Remembers an uploaded file.
pub(super) async fn add_scene(db: &mut SqliteConnection, report: SceneReport) -> Result<()> {
    let json = serde_json::to_string(&report).map_err(|e| StoreError::damaged("scene report", e))?;
    sqlx::query(
        "INSERT INTO scene (id, bytes, report, created_ms) VALUES (?, ?, ?, ?) ON CONFLICT DO NOTHING",
    )
    .bind(report.id.as_str())
    .bind(report.bytes as i64)
    .bind(json)
    .bind(now(db).await?)
    .execute(db)
    .await?;
    Ok(())
}

/// An uploaded file.
pub(super) async fn scene(db: &mut SqliteConnection, id: &BlobId) -> Result<Option<SceneRow>> {
    let row = sqlx::query("SELECT report, created_ms FROM scene WHERE id = ?").bind(id.as_str());
    let Some(row) = row.fetch_optional(db).await? else { return Ok(None) };
    let report = serde_json::from_str(row.try_get("report")?);
    let report = report.map_err(|e| StoreError::damaged("scene report", e))?;
    Ok(Some(SceneRow { report, created_at: time(row.try_get("created_ms")?)? }))
}

/// Adds a job with a cursor at block 0 of each lane, unless `key` was used before.
pub(super) async fn add(
    db: &mut SqliteConnection,
    job: NewJob,
    key: Option<IdempotencyKey>,
) -> Result<Added> {
    let now = now(db).await?;
    if let Some(IdempotencyKey { key, fingerprint }) = key {
        let before: Option<(String, String)> =
            sqlx::query_as("SELECT fingerprint, job FROM idempotency WHERE key = ?")
                .bind(&key)
                .fetch_optional(&mut *db)
                .await?;
        if let Some((of, job)) = before {
            let job = job.parse().map_err(|e| StoreError::damaged("idempotency key", e))?;
            return Ok(if of == fingerprint { Added::Before(job) } else { Added::KeyTaken });
        }
        sqlx::query("INSERT INTO idempotency (key, fingerprint, job, created_ms) VALUES (?, ?, ?, ?)")
            .bind(key)
            .bind(fingerprint)
            .bind(job.id.as_str())
            .bind(now)
            .execute(&mut *db)
            .await?;
    }
    sqlx::query(
        "INSERT INTO job (id, name, scene, state, version, priority, created_ms, spec, progress)
         VALUES (?, ?, ?, 'queued', 1, ?, ?, ?, ?)",
    )
    .bind(job.id.as_str())
    .bind(&job.name)
    .bind(job.scene.as_str())
    .bind(job.priority)
    .bind(now)
    .bind(&job.spec)
    .bind(json(&crate::store::row::Progress::default())?)
    .execute(&mut *db)
    .await?;
    for region in 0..job.regions {
        for replicate in 0..job.replicates {
            sqlx::query("INSERT INTO cursor (job, region, replicate, next_block) VALUES (?, ?, ?, 0)")
                .bind(job.id.as_str())
                .bind(region)
                .bind(replicate)
                .execute(&mut *db)
                .await?;
        }
    }
    Ok(Added::New)
}

const SELECT: &str = "SELECT *, CAST(unixepoch('subsec') * 1000 AS INTEGER) AS now_ms FROM job ";

/// A job.
pub(super) async fn get(db: &mut SqliteConnection, id: &JobId) -> Result<Option<JobRow>> {
    let sql = sqlx::AssertSqlSafe(format!("{SELECT} WHERE id = ?"));
    sqlx::query(sql).bind(id.as_str()).fetch_optional(db).await?.as_ref().map(read).transpose()
}

/// Jobs, the newest first.
pub(super) async fn list(db: &mut SqliteConnection, filter: JobFilter) -> Result<Vec<JobRow>> {
    let sql = sqlx::AssertSqlSafe(format!(
        "{SELECT} WHERE (?1 IS NULL OR state = ?1) AND sequence < ?2 ORDER BY sequence DESC LIMIT ?3"
    ));
    let rows = sqlx::query(sql)
        .bind(filter.state.map(JobState::name))
        .bind(filter.before.unwrap_or(i64::MAX))
        .bind(filter.limit)
        .fetch_all(db)
        .await?;
    rows.iter().map(read).collect()
}

/// Jobs that are not over or have no last form, the oldest first.
pub(super) async fn unsettled(db: &mut SqliteConnection) -> Result<Vec<JobRow>> {
    let sql = sqlx::AssertSqlSafe(format!("{SELECT} WHERE settled = 0 ORDER BY sequence"));
    sqlx::query(sql).fetch_all(db).await?.iter().map(read).collect()
}

fn read(row: &SqliteRow) -> Result<JobRow> {
    let optional = |column| -> Result<Option<i64>> { Ok(row.try_get(column)?) };
    let (started, ended) = (optional("started_ms")?, optional("ended_ms")?);
    let until = match (ended, optional("paused_since_ms")?) {
        (Some(end), _) => end,
        (None, Some(pause)) => pause,
        (None, None) => row.try_get("now_ms")?,
    };
    let paused: i64 = row.try_get("paused_ms")?;
    let progress = serde_json::from_str(row.try_get("progress")?);
    Ok(JobRow {
        sequence: row.try_get("sequence")?,
        id: parse(row, "id")?,
        name: row.try_get("name")?,
        scene: parse(row, "scene")?,
        state: job_state(row.try_get("state")?)?,
        reason: row.try_get("reason")?,
        version: count(row, "version")?,
        priority: row.try_get("priority")?,
        created_at: time(row.try_get("created_ms")?)?,
        started_at: started.map(time).transpose()?,
        ended_at: ended.map(time).transpose()?,
        run_seconds: started.map_or(0.0, |start| (until - start - paused).max(0) as f64 / 1000.0),
        spec: row.try_get("spec")?,
        progress: progress.map_err(|e| StoreError::damaged("progress", e))?,
        certified: row.try_get("certified")?,
        manifest: row.try_get("manifest")?,
        settled: row.try_get("settled")?,
        class: row.try_get("class")?,
    })
}

/// Changes a job that still has `version`.
pub(super) async fn change(
    db: &mut SqliteConnection,
    id: &JobId,
    version: u64,
    change: JobChange,
) -> Result<bool> {
    let now = now(db).await?;
    let counted = sqlx::query(
        "UPDATE job SET version = version + 1, priority = coalesce(?3, priority), reason = coalesce(?4, reason)
         WHERE id = ?1 AND version = ?2",
    )
    .bind(id.as_str())
    .bind(version as i64)
    .bind(change.priority)
    .bind(change.reason)
    .execute(&mut *db)
    .await?;
    if counted.rows_affected() == 0 {
        return Ok(false);
    }
    if let Some(state) = change.state {
        set_state(db, id, state, now).await?;
    }
    if let Some(Settlement { progress, manifest, certified }) = change.settlement {
        sqlx::query("UPDATE job SET settled = 1, progress = ?2, manifest = ?3, certified = ?4 WHERE id = ?1")
            .bind(id.as_str())
            .bind(json(&progress)?)
            .bind(manifest)
            .bind(certified)
            .execute(&mut *db)
            .await?;
    }
    Ok(true)
}

async fn set_state(db: &mut SqliteConnection, id: &JobId, state: JobState, now: i64) -> Result<()> {
    sqlx::query(
        "UPDATE job SET state = ?2,
            paused_ms = paused_ms + CASE WHEN paused_since_ms IS NULL OR started_ms IS NULL THEN 0
                                         ELSE ?3 - max(paused_since_ms, started_ms) END,
            paused_since_ms = CASE WHEN ?2 = 'paused' THEN ?3 END,
            ended_ms = CASE WHEN ?4 THEN coalesce(ended_ms, ?3) END
         WHERE id = ?1",
    )
    .bind(id.as_str())
    .bind(state.name())
    .bind(now)
    .bind(state.is_over())
    .execute(&mut *db)
    .await?;
    if state.is_over() {
        for sql in [
            "DELETE FROM cursor WHERE job = ?",
            "DELETE FROM returned WHERE job = ?",
            "DELETE FROM lease WHERE job = ?",
            "DELETE FROM failure WHERE job = ?",
        ] {
            sqlx::query(sql).bind(id.as_str()).execute(&mut *db).await?;
        }
    }
    Ok(())
}

/// Forgets a job and all of it.
pub(super) async fn remove(db: &mut SqliteConnection, id: &JobId) -> Result<bool> {
    for sql in [
        "DELETE FROM cursor WHERE job = ?",
        "DELETE FROM returned WHERE job = ?",
        "DELETE FROM lease WHERE job = ?",
        "DELETE FROM failure WHERE job = ?",
        "DELETE FROM commits WHERE job = ?",
        "DELETE FROM disagreement WHERE job = ?",
        "DELETE FROM snapshot WHERE job = ?",
        "DELETE FROM checkpoint WHERE job = ?",
        "DELETE FROM idempotency WHERE job = ?",
    ] {
        sqlx::query(sql).bind(id.as_str()).execute(&mut *db).await?;
    }
    let removed = sqlx::query("DELETE FROM job WHERE id = ?").bind(id.as_str()).execute(db).await?;
    Ok(removed.rows_affected() > 0)
}

fn json(value: &impl serde::Serialize) -> Result<String> {
    serde_json::to_string(value).map_err(|e| StoreError::damaged("document", e))
}

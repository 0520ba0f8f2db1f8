//! Jobs.

use super::{
    column::{columns_of, count, from_json, job_state, parse, time, to_json},
    connection::{Db, Row},
    kept,
    merger::require,
    notice,
    query::query,
};
use crate::store::{
    error::Result,
    list::{NEVER, Ranks, billionths},
    row::{Added, IdempotencyKey, JobChange, JobHead, JobRow, NewJob, Progress, Settlement},
};
use ovtigre_proto::{id::JobId, status::JobState};

/// What became of an earlier job under that key.
pub(super) async fn keyed(db: &mut Db, key: &IdempotencyKey) -> Result<Option<Added>> {
    let before = query("SELECT fingerprint, job FROM idempotency WHERE key = $1").bind(&*key.key);
    let Some(row) = db.first(before).await? else { return Ok(None) };
    let same = row.text("fingerprint")? == key.fingerprint;
    Ok(Some(if same { Added::Before(parse(&row, "job")?) } else { Added::KeyTaken }))
}

/// Adds a job with a cursor at block 0 of each lane, unless `key` was used before or a file is not there.
pub(super) async fn add(db: &mut Db, job: NewJob, key: Option<IdempotencyKey>) -> Result<Added> {
    let now = db.now().await?;
    if let Some(key) = &key
        && let Some(before) = keyed(db, key).await?
    {
        return Ok(before);
    }
    if let Some(file) = kept::need(db, &job.id, job.files).await? {
        return Ok(Added::Lacks(file));
    }
    if let Some(key) = key {
        let IdempotencyKey { key, fingerprint } = key;
        let insert =
            query("INSERT INTO idempotency (key, fingerprint, job, created_ms) VALUES ($1, $2, $3, $4)");
        db.execute(insert.bind(key).bind(fingerprint).bind(job.id.as_str()).bind(now)).await?;
    }
    let insert = query(
        "INSERT INTO job (id, name, scene, state, version, priority, created_ms, spec, progress)
         VALUES ($1, $2, $3, 'queued', 1, $4, $5, $6, $7)",
    );
    let insert = insert.bind(job.id.as_str()).bind(job.name).bind(job.scene.as_str()).bind(job.priority);
    db.execute(insert.bind(now).bind(job.spec).bind(to_json(&Progress::default())?)).await?;
    for region in 0..job.regions {
        for replicate in 0..job.replicates {
            let cursor =
                query("INSERT INTO cursor (job, region, replicate, next_block) VALUES ($1, $2, $3, 0)");
            db.execute(cursor.bind(job.id.as_str()).bind(region).bind(replicate)).await?;
        }
    }
    if let Some(webhook) = job.webhook {
        notice::add_webhook(db, &job.id, webhook).await?;
    }
    Ok(Added::New)
}

/// A job.
pub(super) async fn get(db: &mut Db, id: &JobId) -> Result<Option<JobRow>> {
    let now = db.now().await?;
    let row = db
        .first(query(concat!("SELECT ", columns_of!(job), " FROM job WHERE id = $1")).bind(id.as_str()))
        .await?;
    row.map(|row| read(&row, now)).transpose()
}

/// Jobs that are not over or have no last form, the oldest first.
pub(super) async fn unsettled(db: &mut Db) -> Result<Vec<JobRow>> {
    let now = db.now().await?;
    let rows = db
        .all(query(concat!("SELECT ", columns_of!(job), " FROM job WHERE settled = 0 ORDER BY sequence")))
        .await?;
    rows.iter().map(|row| read(row, now)).collect()
}

/// What changes most of the jobs that are not over or have no last form.
pub(super) async fn heads(db: &mut Db) -> Result<Vec<JobHead>> {
    let rows = query(
        "SELECT id, version, state, brought, looks, progress,
                CAST(CASE WHEN ends_ms > $1 THEN 0 ELSE 1 END AS BIGINT) AS free
         FROM job LEFT JOIN merger ON merger.job = job.id WHERE settled = 0 ORDER BY sequence",
    );
    let now = db.now().await?;
    let read = |row: &Row| {
        Ok(JobHead {
            id: parse(row, "id")?,
            version: count(row, "version")?,
            state: job_state(&row.text("state")?)?,
            brought: count(row, "brought")?,
            looks: count(row, "looks")?,
            free: row.truth("free")?,
            progress: from_json(row, "progress")?,
        })
    };
    db.all(rows.bind(now)).await?.iter().map(read).collect()
}

/// A job's columns; `now` is the time.
pub(super) fn read(row: &Row, now: i64) -> Result<JobRow> {
    let (started, ended) = (row.whole_or_none("started_ms")?, row.whole_or_none("ended_ms")?);
    let until = match (ended, row.whole_or_none("paused_since_ms")?) {
        (Some(end), _) => end,
        (None, Some(pause)) => pause,
        (None, None) => now,
    };
    let paused = row.whole("paused_ms")?;
    Ok(JobRow {
        sequence: row.whole("sequence")?,
        id: parse(row, "id")?,
        name: row.text("name")?,
        scene: parse(row, "scene")?,
        state: job_state(&row.text("state")?)?,
        reason: row.text_or_none("reason")?,
        version: count(row, "version")?,
        priority: count(row, "priority")?,
        created_at: time(row.whole("created_ms")?)?,
        started_at: started.map(time).transpose()?,
        ended_at: ended.map(time).transpose()?,
        run_seconds: started.map_or(0.0, |start| (until - start - paused).max(0) as f64 / 1000.0),
        spec: row.text("spec")?,
        progress: from_json(row, "progress")?,
        certified: row.truth("certified")?,
        manifest: row.text_or_none("manifest")?,
        settled: row.truth("settled")?,
        class: row.text_or_none("class")?,
        ranks: Ranks {
            error_ppb: row.whole("error_ppb")?,
            part_ppb: row.whole("part_ppb")?,
            expected_ms: row.whole("expected_ms")?,
            workers: row.whole("workers")?,
        },
    })
}

/// Changes a job that still has `version`.
pub(super) async fn change(db: &mut Db, id: &JobId, version: u64, change: JobChange) -> Result<bool> {
    let now = db.now().await?;
    let counted = query(
        "UPDATE job SET version = version + 1, priority = coalesce($3, priority), reason = coalesce($4, reason)
         WHERE id = $1 AND version = $2",
    );
    let counted = counted.bind(id.as_str()).bind(version).bind(change.priority).bind(change.reason);
    if db.execute(counted).await? == 0 {
        return Ok(false);
    }
    if let Some(state) = change.state {
        set_state(db, id, state, now).await?;
        notice::note(db, id.as_str(), now).await?;
    }
    if let Some(settlement) = change.settlement {
        settle(db, id, settlement).await?;
    }
    Ok(true)
}

async fn set_state(db: &mut Db, id: &JobId, state: JobState, now: i64) -> Result<()> {
    let set = query(
        "UPDATE job SET state = $2,
            paused_ms = paused_ms + CASE WHEN paused_since_ms IS NULL OR started_ms IS NULL THEN 0
                                         WHEN paused_since_ms > started_ms THEN $3 - paused_since_ms
                                         ELSE $3 - started_ms END,
            paused_since_ms = CASE WHEN $2 = 'paused' THEN $3 END,
            ended_ms = CASE WHEN $4 = 1 THEN coalesce(ended_ms, $3) END,
            expected_ms = $5, workers = CASE WHEN $4 = 1 THEN 0 ELSE workers END
         WHERE id = $1",
    );
    let set = set.bind(id.as_str()).bind(state.name()).bind(now).bind(state.is_over());
    db.execute(set.bind(NEVER)).await?;
    if state.is_over() { forget(db, id, Kept::Commits).await } else { Ok(()) }
}

/// The job has its last form: nobody asks any more who brought what.
async fn settle(db: &mut Db, id: &JobId, settlement: Settlement) -> Result<()> {
    let Settlement { mandate, progress, part, manifest, certified } = settlement;
    require(db, id, mandate).await?;
    let set = query(
        "UPDATE job SET settled = 1, progress = $2, manifest = $3, certified = $4, part_ppb = $5 WHERE id = $1",
    );
    let set = set.bind(id.as_str()).bind(to_json(&progress)?).bind(manifest).bind(certified);
    db.execute(set.bind(billionths(Some(part)))).await?;
    forget(db, id, Kept::Curve).await
}

/// What is kept of a job's rows.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kept {
    /// All but what is in flight.
    Commits,
    /// What is shown of a job that is over.
    Curve,
    /// Nothing.
    Nothing,
}

async fn forget(db: &mut Db, id: &JobId, kept: Kept) -> Result<()> {
    let flight: &[&'static str] = &[
        "DELETE FROM cursor WHERE job = $1",
        "DELETE FROM returned WHERE job = $1",
        "DELETE FROM lease WHERE job = $1",
        "DELETE FROM failure WHERE job = $1",
    ];
    let sums: &[&'static str] = &[
        // What is in sums that are kept for more samples stays.
        "DELETE FROM commits WHERE job = $1 AND NOT EXISTS (SELECT 1 FROM snapshot WHERE snapshot.job = $1)",
        "DELETE FROM disagreement WHERE job = $1",
        "DELETE FROM merger WHERE job = $1",
    ];
    let shown: &[&'static str] = &[
        "DELETE FROM snapshot WHERE job = $1",
        "DELETE FROM commits WHERE job = $1",
        "DELETE FROM checkpoint WHERE job = $1",
        "DELETE FROM allocation WHERE job = $1",
        "DELETE FROM idempotency WHERE job = $1",
        "DELETE FROM notice WHERE job = $1",
        "DELETE FROM webhook WHERE job = $1",
    ];
    let sums = if kept >= Kept::Curve { sums } else { &[] };
    let shown = if kept >= Kept::Nothing { shown } else { &[] };
    for sql in flight.iter().chain(sums).chain(shown) {
        db.execute(query(sql).bind(id.as_str())).await?;
    }
    Ok(())
}

/// Forgets a job and all of it.
pub(super) async fn remove(db: &mut Db, id: &JobId) -> Result<bool> {
    kept::leave(db, id).await?;
    forget(db, id, Kept::Nothing).await?;
    Ok(db.execute(query("DELETE FROM job WHERE id = $1").bind(id.as_str())).await? > 0)
}

/// Forgets a job that is settled and still has `version`.
pub(super) async fn remove_settled(db: &mut Db, id: &JobId, version: u64) -> Result<bool> {
    let there = query("SELECT id FROM job WHERE id = $1 AND version = $2 AND settled = 1");
    match db.first(there.bind(id.as_str()).bind(version)).await? {
        Some(_) => remove(db, id).await,
        None => Ok(false),
    }
}

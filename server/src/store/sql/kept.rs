//! Uploaded files and who needs them; what jobs that are over take up.

use super::{
    column::{count, from_json, millis, parse, time, to_json},
    connection::{Db, Row},
    query::query,
};
use crate::store::{
    error::Result,
    kept::{KeptJob, UnfiledJob},
    row::SceneRow,
};
use ovtigre_proto::{
    id::{BlobId, JobId},
    scene::SceneReport,
};
use std::time::Duration;

/// Remembers an uploaded file, unless its bytes are being removed.
pub(super) async fn add_scene(db: &mut Db, report: SceneReport) -> Result<bool> {
    if is_dropped(db, &report.id).await? {
        return Ok(false);
    }
    let insert = query(
        "INSERT INTO scene (id, bytes, report, created_ms) VALUES ($1, $2, $3, $4) ON CONFLICT DO NOTHING",
    );
    let insert = insert.bind(report.id.as_str()).bind(report.bytes).bind(to_json(&report)?);
    let now = db.now().await?;
    db.execute(insert.bind(now)).await?;
    use_scene(db, &report.id).await
}

/// An uploaded file.
pub(super) async fn scene(db: &mut Db, id: &BlobId) -> Result<Option<SceneRow>> {
    let now = db.now().await?;
    let row = query(
        "SELECT report, created_ms, coalesce(used_ms, created_ms) AS used_ms
         FROM scene LEFT JOIN scene_use ON scene_use.scene = scene.id WHERE id = $1",
    );
    let Some(row) = db.first(row.bind(id.as_str())).await? else { return Ok(None) };
    Ok(Some(SceneRow {
        report: from_json(&row, "report")?,
        created_at: time(row.whole("created_ms")?)?,
        unused: since(&row, "used_ms", now)?,
    }))
}

/// The time since a column's.
fn since(row: &Row, column: &'static str, now: i64) -> Result<Duration> {
    Ok(Duration::from_millis((now - row.whole(column)?).max(0) as u64))
}

/// A file is used now.
pub(super) async fn use_scene(db: &mut Db, id: &BlobId) -> Result<bool> {
    let now = db.now().await?;
    let used = query(
        "INSERT INTO scene_use (scene, used_ms) SELECT id, CAST($2 AS BIGINT) FROM scene WHERE id = $1
         ON CONFLICT (scene) DO UPDATE SET used_ms = excluded.used_ms",
    );
    Ok(db.execute(used.bind(id.as_str()).bind(now)).await? > 0)
}

/// A new job needs these files; the first that is not there.
pub(super) async fn need(db: &mut Db, job: &JobId, files: Vec<BlobId>) -> Result<Option<BlobId>> {
    for file in &files {
        if db.first(query("SELECT id FROM scene WHERE id = $1").bind(file.as_str())).await?.is_none() {
            return Ok(Some(file.clone()));
        }
    }
    note(db, job, &files).await.map(|()| None)
}

async fn note(db: &mut Db, job: &JobId, files: &[BlobId]) -> Result<()> {
    for file in files {
        let note = query("INSERT INTO job_file (job, scene) VALUES ($1, $2) ON CONFLICT DO NOTHING");
        db.execute(note.bind(job.as_str()).bind(file.as_str())).await?;
    }
    Ok(())
}

/// A job is removed: its files were used until now.
pub(super) async fn leave(db: &mut Db, job: &JobId) -> Result<()> {
    let now = db.now().await?;
    let used = query(
        "INSERT INTO scene_use (scene, used_ms)
         SELECT id, CAST($2 AS BIGINT) FROM scene JOIN job_file ON job_file.scene = scene.id WHERE job = $1
         ON CONFLICT (scene) DO UPDATE SET used_ms = excluded.used_ms",
    );
    db.execute(used.bind(job.as_str()).bind(now)).await?;
    for sql in ["DELETE FROM job_file WHERE job = $1", "DELETE FROM job_bytes WHERE job = $1"] {
        db.execute(query(sql).bind(job.as_str())).await?;
    }
    Ok(())
}

/// Files that no job needs and nobody used for `unused`. Asked for file by file, by the index of who needs it: PostgreSQL would
/// otherwise join all of either.
pub(super) async fn unused(db: &mut Db, unused: Duration, most: u32) -> Result<Vec<BlobId>> {
    let before = db.now().await? - millis(unused);
    let rows = query(
        "SELECT id FROM scene LEFT JOIN scene_use ON scene_use.scene = scene.id
         WHERE coalesce(used_ms, created_ms) <= $1 AND
            (SELECT 1 FROM job_file WHERE job_file.scene = scene.id
             AND EXISTS (SELECT 1 FROM job WHERE job.id = job_file.job) LIMIT 1) IS NULL
         ORDER BY id LIMIT $2",
    );
    db.all(rows.bind(before).bind(most)).await?.iter().map(|row| parse(row, "id")).collect()
}

/// Forgets such a file, or one that was never known; its bytes are being removed from now on.
///
/// One transaction at a time writes, over SQLite as over PostgreSQL with any number of servers. So a job that needs the file
/// was added before, and is found here; or it is added after, and does not find the file (`need`).
pub(super) async fn drop_scene(db: &mut Db, id: &BlobId, unused: Duration) -> Result<bool> {
    let now = db.now().await?;
    let row = query(
        "SELECT (SELECT count(*) FROM scene WHERE id = $1) AS there,
            (SELECT count(*) FROM scene LEFT JOIN scene_use ON scene_use.scene = scene.id
             WHERE id = $1 AND coalesce(used_ms, created_ms) > $2) AS used,
            (SELECT count(*) FROM scene_use WHERE scene = $1 AND dropped_ms IS NOT NULL) AS dropped,
            (SELECT count(*) FROM job_file JOIN job ON job.id = job_file.job
             WHERE job_file.scene = $1) AS needed",
    );
    let row = db.one(row.bind(id.as_str()).bind(now - millis(unused))).await?;
    if row.truth("used")? || row.truth("dropped")? || row.truth("needed")? {
        return Ok(false);
    }
    if row.truth("there")? {
        if !unfiled(db, 1).await?.is_empty() {
            return Ok(false);
        }
        db.execute(query("DELETE FROM scene WHERE id = $1").bind(id.as_str())).await?;
    }
    let dropped = query(
        "INSERT INTO scene_use (scene, used_ms, dropped_ms) VALUES ($1, $2, $2)
         ON CONFLICT (scene) DO UPDATE SET dropped_ms = excluded.dropped_ms",
    );
    db.execute(dropped.bind(id.as_str()).bind(now)).await?;
    Ok(true)
}

/// Whether the bytes of a file are being removed.
pub(super) async fn is_dropped(db: &mut Db, id: &BlobId) -> Result<bool> {
    let row = query("SELECT scene FROM scene_use WHERE scene = $1 AND dropped_ms IS NOT NULL");
    Ok(db.first(row.bind(id.as_str())).await?.is_some())
}

/// Files whose bytes were to be removed `time` ago; from now on that is done again.
pub(super) async fn dropped_before(db: &mut Db, time: Duration) -> Result<Vec<BlobId>> {
    let now = db.now().await?;
    let rows = query("UPDATE scene_use SET dropped_ms = $1 WHERE dropped_ms <= $2 RETURNING scene");
    let rows = db.all(rows.bind(now).bind(now - millis(time))).await?;
    rows.iter().map(|row| parse(row, "scene")).collect()
}

/// The bytes of a file are removed.
pub(super) async fn end_drop(db: &mut Db, id: &BlobId) -> Result<()> {
    let ended = query("DELETE FROM scene_use WHERE scene = $1 AND dropped_ms IS NOT NULL");
    db.execute(ended.bind(id.as_str())).await.map(drop)
}

/// Jobs of which it is not known which files they need.
pub(super) async fn unfiled(db: &mut Db, most: u32) -> Result<Vec<UnfiledJob>> {
    let rows = query(
        "SELECT id, scene, spec FROM job WHERE sequence > (SELECT coalesce(max(upto), 0) FROM filing)
         AND NOT EXISTS (SELECT 1 FROM job_file WHERE job_file.job = job.id) ORDER BY sequence LIMIT $1",
    );
    let read = |row: &Row| {
        Ok(UnfiledJob { id: parse(row, "id")?, scene: parse(row, "scene")?, spec: row.text("spec")? })
    };
    db.all(rows.bind(most)).await?.iter().map(read).collect()
}

/// Which files each of those jobs needs. Jobs up to the first of which it is still not known are not looked at again: those
/// that come have greater sequences, as one transaction at a time writes.
pub(super) async fn file(db: &mut Db, jobs: Vec<(JobId, Vec<BlobId>)>) -> Result<()> {
    for (job, files) in jobs {
        let there = query("SELECT id FROM job WHERE id = $1").bind(job.as_str());
        if db.first(there).await?.is_some() {
            note(db, &job, &files).await?;
        }
    }
    let row = query(
        "SELECT (SELECT min(sequence) - 1 FROM job WHERE sequence > (SELECT coalesce(max(upto), 0) FROM filing)
            AND NOT EXISTS (SELECT 1 FROM job_file WHERE job_file.job = job.id)) AS before_first,
            (SELECT max(sequence) FROM job) AS latest",
    );
    let row = db.one(row).await?;
    let Some(upto) = row.whole_or_none("before_first")?.or(row.whole_or_none("latest")?) else {
        return Ok(());
    };
    let set = query(
        "INSERT INTO filing (one, upto) VALUES (1, $1) ON CONFLICT (one) DO UPDATE SET upto = excluded.upto",
    );
    db.execute(set.bind(upto)).await.map(drop)
}

fn kept_job(row: &Row, now: i64) -> Result<KeptJob> {
    Ok(KeptJob {
        id: parse(row, "id")?,
        version: count(row, "version")?,
        over: since(row, "over_ms", now)?,
        with_later: count(row, "with_later")?,
    })
}

/// Jobs that are settled, the longest over first. What the later ones take up is of the same moment as the list, so that
/// nobody takes jobs that somebody else has just removed for ones that still take up room.
pub(super) async fn jobs(db: &mut Db, most: u32) -> Result<Vec<KeptJob>> {
    let now = db.now().await?;
    let rows = query(
        "SELECT id, job.version AS version, coalesce(ended_ms, created_ms) AS over_ms,
            CAST(sum(coalesce(bytes, 0)) OVER (ORDER BY ended_ms, sequence
                ROWS BETWEEN CURRENT ROW AND UNBOUNDED FOLLOWING) AS BIGINT) AS with_later
         FROM job LEFT JOIN job_bytes ON job_bytes.job = job.id AND job_bytes.version = job.version
         WHERE settled = 1 ORDER BY ended_ms, sequence LIMIT $1",
    );
    db.all(rows.bind(most)).await?.iter().map(|row| kept_job(row, now)).collect()
}

/// Those of them whose bytes were not counted.
pub(super) async fn uncounted(db: &mut Db, most: u32) -> Result<Vec<(JobId, u64)>> {
    let rows = query(
        "SELECT id, version FROM job
         WHERE settled = 1 AND NOT EXISTS
            (SELECT 1 FROM job_bytes WHERE job_bytes.job = job.id AND job_bytes.version = job.version)
         ORDER BY ended_ms, sequence LIMIT $1",
    );
    db.all(rows.bind(most)).await?.iter().map(|row| Ok((parse(row, "id")?, count(row, "version")?))).collect()
}

/// The files of each job have so many bytes as of that version.
pub(super) async fn count_jobs(db: &mut Db, jobs: Vec<(JobId, u64, u64)>) -> Result<()> {
    for (job, version, bytes) in jobs {
        let set = query(
            "INSERT INTO job_bytes (job, version, bytes)
             SELECT id, version, CAST($3 AS BIGINT) FROM job WHERE id = $1 AND version = $2 AND settled = 1
             ON CONFLICT (job) DO UPDATE SET version = excluded.version, bytes = excluded.bytes",
        );
        db.execute(set.bind(job.as_str()).bind(version).bind(bytes)).await?;
    }
    Ok(())
}

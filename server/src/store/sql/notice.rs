//! Changes of which somebody is still to be told.

use super::{
    column::{count, job_state, millis, parse, time},
    connection::{Db, Row},
    query::query,
};
use crate::store::{
    error::Result,
    notice::{NoticeRow, Webhook},
};
use ovtigre_proto::id::JobId;
use std::time::Duration;

/// Somebody is told of a job's changes from now on.
pub(super) async fn add_webhook(db: &mut Db, job: &JobId, webhook: Webhook) -> Result<()> {
    let insert = query("INSERT INTO webhook (job, url, secret) VALUES ($1, $2, $3)").bind(job.as_str());
    db.execute(insert.bind(webhook.url).bind(webhook.secret)).await.map(drop)
}

/// A job's state has changed to what its row says: whoever is told of it will be, even if this process ends now.
pub(super) async fn note(db: &mut Db, job: &str, now: i64) -> Result<()> {
    let insert = query(
        "INSERT INTO notice (job, state, reason, changed_ms, tries, due_ms)
         SELECT id, state, reason, $2, 0, $2 FROM job
         WHERE id = $1 AND EXISTS (SELECT 1 FROM webhook WHERE webhook.job = job.id)",
    );
    db.execute(insert.bind(job).bind(now)).await.map(drop)
}

/// Whether one is due, for a reader.
pub(super) async fn any_due(db: &mut Db) -> Result<bool> {
    let now = db.now().await?;
    let any = query("SELECT sequence FROM notice WHERE due_ms <= $1 LIMIT 1").bind(now);
    Ok(db.first(any).await?.is_some())
}

/// The first of each job, where it is due; due again after `time`.
pub(super) async fn take(db: &mut Db, most: u32, time: Duration) -> Result<Vec<NoticeRow>> {
    let now = db.now().await?;
    let due = query(
        "SELECT n.sequence AS sequence, n.job AS job, job.name AS name, n.state AS state, n.reason AS reason,
                n.changed_ms AS changed_ms, n.tries + 1 AS tries, webhook.url AS url, webhook.secret AS secret
         FROM notice AS n JOIN job ON job.id = n.job JOIN webhook ON webhook.job = n.job
         WHERE n.due_ms <= $1
           AND NOT EXISTS (SELECT 1 FROM notice AS e WHERE e.job = n.job AND e.sequence < n.sequence)
         ORDER BY n.due_ms LIMIT $2",
    );
    let rows = db.all(due.bind(now).bind(most)).await?;
    let taken: Vec<NoticeRow> = rows.iter().map(read).collect::<Result<_>>()?;
    for notice in &taken {
        let held = query("UPDATE notice SET tries = tries + 1, due_ms = $2 WHERE sequence = $1");
        db.execute(held.bind(notice.sequence).bind(now + millis(time))).await?;
    }
    Ok(taken)
}

fn read(row: &Row) -> Result<NoticeRow> {
    Ok(NoticeRow {
        sequence: row.whole("sequence")?,
        job: parse(row, "job")?,
        name: row.text("name")?,
        state: job_state(&row.text("state")?)?,
        reason: row.text_or_none("reason")?,
        changed_at: time(row.whole("changed_ms")?)?,
        tries: count(row, "tries")?,
        webhook: Webhook { url: row.text("url")?, secret: row.text("secret")? },
    })
}

/// Was told, or never will be.
pub(super) async fn end(db: &mut Db, sequence: i64) -> Result<()> {
    db.execute(query("DELETE FROM notice WHERE sequence = $1").bind(sequence)).await.map(drop)
}

/// Is due again after `time`.
pub(super) async fn put_off(db: &mut Db, sequence: i64, time: Duration) -> Result<()> {
    let due = db.now().await? + millis(time);
    let set = query("UPDATE notice SET due_ms = $2 WHERE sequence = $1").bind(sequence);
    db.execute(set.bind(due)).await.map(drop)
}

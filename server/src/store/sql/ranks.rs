//! What lists of jobs go by that changes while a job is rendered.

use super::{
    connection::{Db, Row},
    gathered::{of_run_times, to_outlooks, to_workers},
    query::query,
};
use crate::store::{
    error::Result,
    list::{NEVER, Outlook},
};
use ovtigre_proto::id::JobId;

/// Seconds for which each of these jobs runs already; `None` where it does not run.
pub(super) async fn run_times(db: &mut Db, jobs: &[JobId]) -> Result<Vec<Option<f64>>> {
    if jobs.is_empty() {
        return Ok(Vec::new());
    }
    let now = db.now().await?;
    let time = |row: &Row| {
        let Some(start) = row.whole_or_none("started_ms")? else { return Ok(None) };
        Ok(Some((now - start - row.whole("paused_ms")?).max(0) as f64 / 1000.0))
    };
    db.all(of_run_times(jobs)).await?.iter().map(time).collect()
}

/// Writes down how far jobs are.
pub(super) async fn look_out(db: &mut Db, outlooks: Vec<Outlook>) -> Result<()> {
    let now = db.now().await?;
    let rows = outlooks.iter().map(|Outlook { job, part, left }| {
        let expected = left.map_or(NEVER, |left| now.saturating_add((left.max(0.0) * 1e3) as i64).min(NEVER));
        (job, (part.clamp(0.0, 1.0) * 1e9) as i64, expected)
    });
    db.execute(to_outlooks(rows.collect()).bind(NEVER)).await.map(drop)
}

/// Jobs whose number of workers is not what their leases say, and that number.
pub(super) async fn miscounted(db: &mut Db) -> Result<Vec<(String, i64)>> {
    let rows = query(
        "SELECT job.id AS id, n FROM (SELECT job, count(DISTINCT worker) AS n FROM lease GROUP BY job) AS held
           JOIN job ON job.id = held.job WHERE workers <> n
         UNION ALL
         SELECT id, 0 AS n FROM job
         WHERE workers > 0 AND NOT EXISTS (SELECT 1 FROM lease WHERE lease.job = job.id)",
    );
    db.all(rows).await?.iter().map(|row| Ok((row.text("id")?, row.whole("n")?))).collect()
}

/// Writes down how many workers jobs have.
pub(super) async fn count_workers(db: &mut Db, counted: Vec<(String, i64)>) -> Result<()> {
    db.execute(to_workers(counted)).await.map(drop)
}

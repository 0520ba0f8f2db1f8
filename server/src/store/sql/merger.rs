//! Who appends to which job.

use super::{
    column::{count, millis, parse, to_json},
    connection::Db,
    query::query,
};
use crate::store::{
    error::{Result, StoreError},
    row::{Mandate, Progress},
};
use ovtigre_proto::id::JobId;
use std::time::Duration;

/// Gives a job's sums to `holder` for `time`, unless another has them.
pub(super) async fn take(db: &mut Db, job: &JobId, holder: &str, time: Duration) -> Result<Option<Mandate>> {
    let exists = query("SELECT id FROM job WHERE id = $1 AND settled = 0").bind(job.as_str());
    if db.first(exists).await?.is_none() {
        return Ok(None);
    }
    let now = db.now().await?;
    let ends = now + millis(time);
    let row = query("SELECT holder, epoch, ends_ms FROM merger WHERE job = $1").bind(job.as_str());
    let Some(row) = db.first(row).await? else {
        let new = query("INSERT INTO merger (job, holder, epoch, ends_ms) VALUES ($1, $2, 1, $3)");
        db.execute(new.bind(job.as_str()).bind(holder).bind(ends)).await?;
        return Ok(Some(Mandate(1)));
    };
    let (same, epoch): (bool, u64) = (row.text("holder")? == holder, count(&row, "epoch")?);
    if !same && row.whole("ends_ms")? > now {
        return Ok(None);
    }
    // A holder that asks again has lost what it had in memory: nothing that it still does may count.
    let next = query("UPDATE merger SET holder = $2, epoch = $3, ends_ms = $4 WHERE job = $1");
    db.execute(next.bind(job.as_str()).bind(holder).bind(epoch + 1).bind(ends)).await?;
    Ok(Some(Mandate(epoch + 1)))
}

/// Gives `holder` `time` more for each job whose sums it has; says which those are.
pub(super) async fn keep(db: &mut Db, holder: &str, time: Duration) -> Result<Vec<(JobId, Mandate)>> {
    let ends = db.now().await? + millis(time);
    let kept = query("UPDATE merger SET ends_ms = $2 WHERE holder = $1 RETURNING job, epoch");
    let rows = db.all(kept.bind(holder).bind(ends)).await?;
    rows.iter().map(|row| Ok((parse(row, "job")?, Mandate(count(row, "epoch")?)))).collect()
}

/// `holder` gives all its jobs up: others need not wait.
pub(super) async fn leave(db: &mut Db, holder: &str) -> Result<()> {
    let ended = query("UPDATE merger SET holder = '', ends_ms = 0 WHERE holder = $1").bind(holder);
    db.execute(ended).await.map(drop)
}

/// No job's sums are held, after the only program that could hold them ended.
pub(super) async fn free_all(db: &mut Db) -> Result<()> {
    db.execute(query("UPDATE merger SET holder = '', ends_ms = 0")).await.map(drop)
}

/// An error where the job's sums were given to somebody else since.
pub(super) async fn require(db: &mut Db, job: &JobId, mandate: Mandate) -> Result<()> {
    let row = query("SELECT epoch FROM merger WHERE job = $1 AND epoch = $2");
    match db.first(row.bind(job.as_str()).bind(mandate.0)).await? {
        Some(_) => Ok(()),
        None => Err(StoreError::Superseded),
    }
}

/// Writes down how far the picture is, for those who do not append.
pub(super) async fn publish(db: &mut Db, job: &JobId, mandate: Mandate, progress: Progress) -> Result<()> {
    require(db, job, mandate).await?;
    let set = query("UPDATE job SET progress = $2 WHERE id = $1 AND settled = 0");
    db.execute(set.bind(job.as_str()).bind(to_json(&progress)?)).await.map(drop)
}

//! Handing out batches and taking them back.

use super::{
    column::{batch, commit, count, lease, millis},
    connection::{Db, Row},
    merger::require,
    notice,
    query::query,
};
use crate::store::{
    error::Result,
    row::{BatchKey, Lane, LeaseRow, Ledger, Mandate, Released, Unclaimed},
};
use ovtigre_proto::id::{JobId, LeaseId, WorkerId};
use std::time::Duration;

fn lane_and_block(row: &Row) -> Result<(Lane, u32)> {
    batch(row).map(|at| (at.lane(), at.block))
}

/// What a job's work looks like.
pub(super) async fn read(db: &mut Db, job: &JobId) -> Result<Ledger> {
    let id = job.as_str();
    let Unclaimed { cursors, returned } = unclaimed(db, job).await?;
    let leases = query("SELECT id, job, region, replicate, block, worker FROM lease WHERE job = $1").bind(id);
    let leases = db.all(leases).await?.iter().map(lease).collect::<Result<_>>()?;
    let commits = query("SELECT region, replicate, block, hash, worker_micros FROM commits WHERE job = $1");
    let commits = db.all(commits.bind(id)).await?.iter().map(commit).collect::<Result<_>>()?;
    let snapshots = query("SELECT region, replicate, blocks AS block FROM snapshot WHERE job = $1").bind(id);
    let snapshots = db.all(snapshots).await?.iter().map(lane_and_block).collect::<Result<_>>()?;
    let (mut checkpoints, mut brought) = (0, 0);
    if let Some(row) = db.first(query("SELECT looks, brought FROM job WHERE id = $1").bind(id)).await? {
        (checkpoints, brought) = (count(&row, "looks")?, count(&row, "brought")?);
    }
    Ok(Ledger { cursors, returned, leases, commits, snapshots, checkpoints, brought })
}

/// What of a job can be handed out.
pub(super) async fn unclaimed(db: &mut Db, job: &JobId) -> Result<Unclaimed> {
    let cursors = query("SELECT region, replicate, next_block AS block FROM cursor WHERE job = $1");
    let cursors = db.all(cursors.bind(job.as_str())).await?;
    let returned = query("SELECT region, replicate, block FROM returned WHERE job = $1").bind(job.as_str());
    let returned = db.all(returned).await?;
    Ok(Unclaimed {
        cursors: cursors.iter().map(lane_and_block).collect::<Result<_>>()?,
        returned: returned.iter().map(batch).collect::<Result<_>>()?,
    })
}

/// Batches of all jobs that were given back.
pub(super) async fn returned(db: &mut Db) -> Result<Vec<(JobId, BatchKey)>> {
    let rows = db.all(query("SELECT job, region, replicate, block FROM returned")).await?;
    rows.iter().map(|row| Ok((super::column::parse(row, "job")?, batch(row)?))).collect()
}

/// The first batch of a job that waits in line is handed out.
pub(super) async fn begin(db: &mut Db, job: &str, now: i64) -> Result<()> {
    let begun = query(
        "UPDATE job SET state = 'running', version = version + 1, started_ms = coalesce(started_ms, $2)
         WHERE id = $1 AND state = 'queued'",
    );
    if db.execute(begun.bind(job).bind(now)).await? > 0 {
        notice::note(db, job, now).await?;
    }
    Ok(())
}

/// Gives those leases `time` from now that the worker still has.
pub(super) async fn renew(
    db: &mut Db,
    worker: &WorkerId,
    leases: Vec<LeaseId>,
    time: Duration,
) -> Result<Vec<LeaseId>> {
    let ends = db.now().await? + millis(time);
    let mut renewed = Vec::with_capacity(leases.len());
    for id in leases {
        let row = query("UPDATE lease SET ends_ms = $1 WHERE id = $2 AND worker = $3");
        if db.execute(row.bind(ends).bind(id.as_str()).bind(worker.as_str())).await? > 0 {
            renewed.push(id);
        }
    }
    Ok(renewed)
}

/// Ends a lease and returns its batch.
pub(super) async fn release(db: &mut Db, id: &LeaseId, failure: Option<String>) -> Result<Option<Released>> {
    let row = query("SELECT id, job, region, replicate, block, worker FROM lease WHERE id = $1");
    let Some(row) = db.first(row.bind(id.as_str())).await? else { return Ok(None) };
    let lease = lease(&row)?;
    let now = db.now().await?;
    take_back(db, lease, failure.map_or(End::HandedBack, End::Failed), now).await.map(Some)
}

/// Ends the leases whose time is over.
pub(super) async fn expire(db: &mut Db) -> Result<Vec<Released>> {
    let now = db.now().await?;
    let rows = query("SELECT id, job, region, replicate, block, worker FROM lease WHERE ends_ms <= $1");
    let mut ended = Vec::new();
    for row in db.all(rows.bind(now)).await? {
        ended.push(take_back(db, lease(&row)?, End::Lost, now).await?);
    }
    Ok(ended)
}

/// Whether a lease's time is over, for a reader.
pub(super) async fn any_expired(db: &mut Db) -> Result<bool> {
    let now = db.now().await?;
    let any = query("SELECT id FROM lease WHERE ends_ms <= $1 LIMIT 1").bind(now);
    Ok(db.first(any).await?.is_some())
}

/// How a lease ended without a sum.
enum End {
    HandedBack,
    Failed(String),
    Lost,
}

async fn take_back(db: &mut Db, lease: LeaseRow, end: End, now: i64) -> Result<Released> {
    let LeaseRow { id, job, batch: BatchKey { block, replicate, region }, worker } = &lease;
    db.execute(query("DELETE FROM lease WHERE id = $1").bind(id.as_str())).await?;
    let returned = query(
        "INSERT INTO returned (job, region, replicate, block) VALUES ($1, $2, $3, $4) ON CONFLICT DO NOTHING",
    );
    db.execute(returned.bind(job.as_str()).bind(*region).bind(*replicate).bind(*block)).await?;
    let failure = match end {
        End::HandedBack => None,
        End::Failed(reason) => Some((reason, false)),
        End::Lost => Some(("its worker was not heard of in time".to_owned(), true)),
    };
    if let Some((reason, lost)) = failure {
        let insert = query(
            "INSERT INTO failure (job, region, replicate, block, worker, reason, lost, failed_ms)
             VALUES ($1, $2, $3, $4, $5, $6, $7, $8)",
        );
        let insert = insert.bind(job.as_str()).bind(*region).bind(*replicate).bind(*block);
        db.execute(insert.bind(worker.as_str()).bind(reason).bind(lost).bind(now)).await?;
        let counted = query("UPDATE worker SET failures = failures + 1 WHERE id = $1");
        db.execute(counted.bind(worker.as_str())).await?;
    }
    let counts = query(
        "SELECT count(CASE WHEN lost = 0 THEN 1 END) AS failures,
                count(DISTINCT CASE WHEN lost = 0 THEN worker END) AS workers,
                count(CASE WHEN lost = 1 THEN 1 END) AS losses
         FROM failure WHERE job = $1 AND region = $2 AND replicate = $3 AND block = $4",
    );
    let row = db.one(counts.bind(job.as_str()).bind(*region).bind(*replicate).bind(*block)).await?;
    let (failures, workers) = (count(&row, "failures")?, count(&row, "workers")?);
    let losses = count(&row, "losses")?;
    Ok(Released { lease, failures, workers, losses })
}

/// Remembers how far a lane is kept as one blob.
pub(super) async fn set_snapshot(
    db: &mut Db,
    job: &JobId,
    mandate: Mandate,
    lane: Lane,
    blocks: u32,
) -> Result<()> {
    require(db, job, mandate).await?;
    let set = query(
        "INSERT INTO snapshot (job, region, replicate, blocks) VALUES ($1, $2, $3, $4)
         ON CONFLICT (job, region, replicate) DO UPDATE SET blocks = excluded.blocks",
    );
    db.execute(set.bind(job.as_str()).bind(lane.region).bind(lane.replicate).bind(blocks)).await.map(drop)
}

/// Workers that hold a batch of the job.
pub(super) async fn workers_of(db: &mut Db, job: &JobId) -> Result<u32> {
    let row = query("SELECT count(DISTINCT worker) AS n FROM lease WHERE job = $1").bind(job.as_str());
    count(&db.one(row).await?, "n")
}

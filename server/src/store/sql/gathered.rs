//! What many callers ask for at a time, done by a few statements for all of them: batches handed out and sums
//! that are brought.

use super::{
    column::{job_state, parse},
    commit::disagree,
    connection::Db,
    ledger::begin,
    query::{Query, both},
};
use crate::store::{
    error::{Result, StoreError},
    row::{BatchKey, Claim, CommitOutcome, NewCommit},
};
use ovtigre_proto::{
    id::{BlobId, JobId},
    status::JobState,
};
use serde_json::{Value, json};
use std::collections::{BTreeMap, HashMap};

/// A kind of column in a list: how PostgreSQL is told it. SQLite takes numbers in JSON for what they are.
macro_rules! cast {
    (text) => {
        ""
    };
    (whole) => {
        "::BIGINT"
    };
    (real) => {
        "::DOUBLE PRECISION"
    };
}

/// A statement over `item`, the rows of a JSON list of lists that is bound to `$1`; `n` is a row's place from 0.
macro_rules! over {
    ([$($place:literal $column:ident $kind:ident),+], $statement:expr) => {
        both(
            concat!(
                "WITH item AS (SELECT key AS n", $(", value->>", $place, " AS ", stringify!($column),)+
                " FROM json_each($1)) ", $statement
            ),
            concat!(
                "WITH item AS (SELECT place - 1 AS n",
                $(", (value->>", $place, ")", cast!($kind), " AS ", stringify!($column),)+
                " FROM jsonb_array_elements(CAST($1 AS JSONB)) WITH ORDINALITY AS list (value, place)) ", $statement
            ),
        )
    };
}

fn bound(query: Query, rows: Vec<Value>) -> Query {
    query.bind(Value::Array(rows).to_string())
}

/// A batch as the first four columns of a row.
fn place(job: &impl ToString, at: BatchKey) -> [Value; 4] {
    [job.to_string().into(), at.region.into(), at.replicate.into(), at.block.into()]
}

/// The latest checkpoint of each job and how many workers hold batches of it, in the order of the jobs.
pub(super) fn of_jobs(jobs: &[JobId]) -> Query {
    let statement = over!(
        [0 job text],
        "SELECT c.look, samples, wall_seconds, worker_seconds, rays, rms_error, relative_error, relative_error_upper,
           target_expected_at_seconds, doubt, layers, (SELECT count(DISTINCT worker) FROM lease WHERE lease.job = item.job) AS workers
         FROM item LEFT JOIN checkpoint AS c ON c.job = item.job
         AND c.look = (SELECT max(look) FROM checkpoint AS d WHERE d.job = item.job) ORDER BY n"
    );
    bound(statement, jobs.iter().map(|job| json!([job.as_str()])).collect())
}

/// Those of these jobs that are not there.
pub(super) fn not_there(jobs: &[JobId]) -> Query {
    let statement = over!(
        [0 job text],
        "SELECT job FROM item WHERE NOT EXISTS (SELECT 1 FROM job WHERE job.id = item.job)"
    );
    bound(statement, jobs.iter().map(|job| json!([job.as_str()])).collect())
}

/// Since when each of these jobs runs, in the order of the jobs; nothing where it does not.
pub(super) fn of_run_times(jobs: &[JobId]) -> Query {
    let statement = over!(
        [0 job text],
        "SELECT started_ms, paused_ms FROM item LEFT JOIN job ON job.id = item.job AND state = 'running' ORDER BY n"
    );
    bound(statement, jobs.iter().map(|job| json!([job.as_str()])).collect())
}

/// How far jobs are that are not settled, in billionths, and when they are expected to be done: `$2` where they do not run.
pub(super) fn to_outlooks(jobs: Vec<(&JobId, i64, i64)>) -> Query {
    let statement = over!(
        [0 job text, 1 part whole, 2 expected whole],
        "UPDATE job SET part_ppb = item.part, expected_ms = CASE WHEN state = 'running' THEN item.expected ELSE $2 END
         FROM item WHERE job.id = item.job AND settled = 0"
    );
    bound(statement, jobs.into_iter().map(|(job, part, at)| json!([job.as_str(), part, at])).collect())
}

/// How many workers jobs have.
pub(super) fn to_workers(jobs: Vec<(String, i64)>) -> Query {
    let statement = over!(
        [0 job text, 1 count whole],
        "UPDATE job SET workers = item.count FROM item WHERE job.id = item.job"
    );
    bound(statement, jobs.into_iter().map(|(job, count)| json!([job, count])).collect())
}

/// What is known of a batch before it is handed out.
struct Claimable {
    state: Option<String>,
    next: Option<i64>,
    returned: bool,
}

async fn claimable(db: &mut Db, claims: &[(Claim, i64)]) -> Result<Vec<Claimable>> {
    let rows = claims.iter().map(|(claim, _)| place(&claim.job, claim.batch).to_vec().into()).collect();
    let statement = over!(
        [0 job text, 1 region whole, 2 replicate whole, 3 block whole],
        "SELECT (SELECT state FROM job WHERE id = item.job) AS state,
           (SELECT next_block FROM cursor AS c
            WHERE c.job = item.job AND c.region = item.region AND c.replicate = item.replicate) AS next_block,
           (SELECT count(*) FROM returned AS r WHERE r.job = item.job AND r.region = item.region
            AND r.replicate = item.replicate AND r.block = item.block) AS returned
         FROM item ORDER BY n"
    );
    let rows = db.all(bound(statement, rows)).await?;
    let read = |row: &super::connection::Row| {
        Ok(Claimable {
            state: row.text_or_none("state")?,
            next: row.whole_or_none("next_block")?,
            returned: row.truth("returned")?,
        })
    };
    rows.iter().map(read).collect()
}

/// Hands out each batch that may be, until its time in milliseconds since 1970; whether it was, in the same order.
pub(super) async fn claim(db: &mut Db, claims: &[(Claim, i64)]) -> Result<Vec<bool>> {
    let now = db.now().await?;
    let known = claimable(db, claims).await?;
    let mut cursors: BTreeMap<(&str, u32, u32), i64> = BTreeMap::new();
    let mut queued: Vec<&str> = Vec::new();
    let (mut leases, mut taken) = (Vec::new(), Vec::new());
    let mut claimed = Vec::with_capacity(claims.len());
    for ((claim, ends), known) in claims.iter().zip(known) {
        let (job, at) = (claim.job.as_str(), claim.batch);
        let state = known.state.as_deref();
        let mut yes = matches!(state, Some("queued" | "running"));
        if yes && known.returned {
            let row = Value::from(place(&claim.job, at).to_vec());
            yes = !taken.contains(&row);
            if yes {
                taken.push(row);
            }
        } else if yes {
            // One after another: the next block of a lane may be asked for in the same group.
            let lane = (job, at.region, at.replicate);
            let next = cursors.get(&lane).copied().or(known.next);
            yes = next == Some(i64::from(at.block));
            if yes {
                cursors.insert(lane, i64::from(at.block) + 1);
            }
        }
        claimed.push(yes);
        if !yes {
            continue;
        }
        let mut row = place(&claim.job, at).to_vec();
        row.extend([json!(claim.lease.as_str()), json!(claim.worker.as_str()), json!(ends)]);
        leases.push(row.into());
        if state == Some("queued") && !queued.contains(&job) {
            queued.push(job);
        }
    }
    let lanes =
        cursors.into_iter().map(|((job, region, replicate), next)| json!([job, region, replicate, next]));
    advance(db, lanes.collect(), taken).await?;
    add_leases(db, leases, now).await?;
    for job in queued {
        begin(db, job, now).await?;
    }
    Ok(claimed)
}

/// Moves lanes on, and forgets of batches that they had come back.
async fn advance(db: &mut Db, lanes: Vec<Value>, taken: Vec<Value>) -> Result<()> {
    if !lanes.is_empty() {
        let statement = over!(
            [0 job text, 1 region whole, 2 replicate whole, 3 next whole],
            "UPDATE cursor SET next_block = item.next FROM item
             WHERE cursor.job = item.job AND cursor.region = item.region AND cursor.replicate = item.replicate"
        );
        db.execute(bound(statement, lanes)).await?;
    }
    if !taken.is_empty() {
        forget(db, Came::Returned, taken).await?;
    }
    Ok(())
}

async fn add_leases(db: &mut Db, leases: Vec<Value>, now: i64) -> Result<()> {
    if leases.is_empty() {
        return Ok(());
    }
    let statement = over!(
        [0 job text, 1 region whole, 2 replicate whole, 3 block whole, 4 lease text, 5 worker text, 6 ends whole],
        "INSERT INTO lease (id, job, region, replicate, block, worker, granted_ms, ends_ms)
         SELECT lease, job, region, replicate, block, worker, $2, ends FROM item ORDER BY n"
    );
    db.execute(bound(statement, leases).bind(now)).await.map(drop)
}

/// Where rows of batches are that were not brought.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Came {
    /// In a worker's hands.
    Leased,
    /// Back from one.
    Returned,
    /// Back, and why.
    Failed,
}

/// Removes rows of batches.
async fn forget(db: &mut Db, what: Came, batches: Vec<Value>) -> Result<()> {
    macro_rules! delete {
        ($table:literal) => {
            over!(
                [0 job text, 1 region whole, 2 replicate whole, 3 block whole],
                concat!(
                    "DELETE FROM ", $table, " WHERE (job, region, replicate, block) IN
                     (SELECT job, region, replicate, block FROM item)"
                )
            )
        };
    }
    if batches.is_empty() {
        return Ok(());
    }
    let statement = match what {
        Came::Leased => delete!("lease"),
        Came::Returned => delete!("returned"),
        Came::Failed => delete!("failure"),
    };
    db.execute(bound(statement, batches)).await.map(drop)
}

/// What is known of a batch before its sum is taken.
struct Bringable {
    job: Option<(JobState, i64)>,
    next: Option<i64>,
    holder: Option<String>,
    kept: Option<BlobId>,
    returned: bool,
    failed: bool,
}

async fn bringable(db: &mut Db, commits: &[NewCommit]) -> Result<Vec<Bringable>> {
    let rows = commits.iter().map(|new| place(&new.job, new.row.batch).to_vec().into()).collect();
    let statement = over!(
        [0 job text, 1 region whole, 2 replicate whole, 3 block whole],
        "SELECT (SELECT state FROM job WHERE id = item.job) AS state,
           (SELECT brought FROM job WHERE id = item.job) AS brought,
           (SELECT next_block FROM cursor AS c
            WHERE c.job = item.job AND c.region = item.region AND c.replicate = item.replicate) AS next_block,
           (SELECT worker FROM lease AS l WHERE l.job = item.job AND l.region = item.region
            AND l.replicate = item.replicate AND l.block = item.block) AS holder,
           (SELECT hash FROM commits AS k WHERE k.job = item.job AND k.region = item.region
            AND k.replicate = item.replicate AND k.block = item.block) AS kept,
           (SELECT count(*) FROM returned AS r WHERE r.job = item.job AND r.region = item.region
            AND r.replicate = item.replicate AND r.block = item.block) AS returned,
           (SELECT count(*) FROM failure AS f WHERE f.job = item.job AND f.region = item.region
            AND f.replicate = item.replicate AND f.block = item.block) AS failed
         FROM item ORDER BY n"
    );
    let rows = db.all(bound(statement, rows)).await?;
    let read = |row: &super::connection::Row| {
        let state = row.text_or_none("state")?.map(|state| job_state(&state)).transpose()?;
        Ok(Bringable {
            job: state.map(|state| Ok::<_, StoreError>((state, row.whole("brought")?))).transpose()?,
            next: row.whole_or_none("next_block")?,
            holder: row.text_or_none("holder")?,
            kept: row.text_or_none("kept")?.map(|_| parse(row, "kept")).transpose()?,
            returned: row.truth("returned")?,
            failed: row.truth("failed")?,
        })
    };
    rows.iter().map(read).collect()
}

/// What sums that count change.
#[derive(Default)]
struct Counted<'a> {
    rows: Vec<Value>,
    leased: Vec<Value>,
    returned: Vec<Value>,
    failed: Vec<Value>,
    /// Batches brought of each job.
    jobs: BTreeMap<&'a str, i64>,
    /// Batches of each worker, and rays a second of its last.
    workers: BTreeMap<String, (u32, f64)>,
}

/// Records each batch's sum if there is none, otherwise compares; what became of each, in the same order.
pub(super) async fn commit(db: &mut Db, commits: &[NewCommit]) -> Result<Vec<CommitOutcome>> {
    let now = db.now().await?;
    let known = bringable(db, commits).await?;
    let mut counted = Counted::default();
    let mut here: HashMap<(&str, BatchKey), &BlobId> = HashMap::new();
    let mut outcomes = Vec::with_capacity(commits.len());
    for (new, known) in commits.iter().zip(known) {
        let (batch, hash) = (new.row.batch, &new.row.hash);
        let who =
            new.worker.as_ref().map(ToString::to_string).or_else(|| known.holder.clone()).unwrap_or_default();
        let outcome = match (known.job, here.get(&(new.job.as_str(), batch)).copied().or(known.kept.as_ref()))
        {
            (None, _) => CommitOutcome::NoJob,
            (Some((state, _)), _) if state.is_over() => CommitOutcome::JobOver,
            _ if known.next.is_none_or(|next| next <= i64::from(batch.block)) => {
                CommitOutcome::NeverHandedOut
            }
            (_, Some(kept)) if kept == hash => CommitOutcome::Same,
            (_, Some(kept)) => CommitOutcome::Differs { kept: kept.clone() },
            (Some((_, brought)), None) => {
                here.insert((new.job.as_str(), batch), hash);
                counted.add(new, who.clone(), &known, brought);
                CommitOutcome::First
            }
        };
        if let CommitOutcome::Differs { .. } = &outcome {
            disagree(db, &new.job, batch, hash, &who, now).await?;
        }
        outcomes.push(outcome);
    }
    counted.write(db, now).await?;
    Ok(outcomes)
}

impl<'a> Counted<'a> {
    fn add(&mut self, new: &'a NewCommit, who: String, known: &Bringable, brought: i64) {
        let number = self.jobs.entry(new.job.as_str()).or_insert(brought);
        *number += 1;
        let at = place(&new.job, new.row.batch).to_vec();
        let mut row = at.clone();
        let hash = new.row.hash.as_str();
        row.extend([json!(hash), json!(who), json!(new.row.worker_micros), json!(*number)]);
        self.rows.push(row.into());
        for (there, rows) in [
            (known.holder.is_some(), &mut self.leased),
            (known.returned, &mut self.returned),
            (known.failed, &mut self.failed),
        ] {
            if there {
                rows.push(at.clone().into());
            }
        }
        let worker = self.workers.entry(who).or_default();
        *worker = (worker.0 + 1, new.rays_per_second);
    }

    async fn write(self, db: &mut Db, now: i64) -> Result<()> {
        if self.rows.is_empty() {
            return Ok(());
        }
        let statement = over!(
            [0 job text, 1 region whole, 2 replicate whole, 3 block whole,
             4 hash text, 5 worker text, 6 micros whole, 7 number whole],
            "INSERT INTO commits (job, region, replicate, block, hash, worker, worker_micros, committed_ms, number)
             SELECT job, region, replicate, block, hash, worker, micros, $2, number FROM item ORDER BY n"
        );
        db.execute(bound(statement, self.rows).bind(now)).await?;
        for (what, batches) in
            [(Came::Leased, self.leased), (Came::Returned, self.returned), (Came::Failed, self.failed)]
        {
            forget(db, what, batches).await?;
        }
        let statement = over!(
            [0 job text, 1 number whole],
            "UPDATE job SET brought = item.number FROM item WHERE job.id = item.job"
        );
        let jobs = self.jobs.into_iter().map(|(job, number)| json!([job, number])).collect();
        db.execute(bound(statement, jobs)).await?;
        let statement = over!(
            [0 worker text, 1 done whole, 2 rays real],
            "UPDATE worker SET batches_done = batches_done + item.done, rays_per_second = item.rays
             FROM item WHERE worker.id = item.worker"
        );
        let workers =
            self.workers.into_iter().map(|(worker, (done, rays))| json!([worker, done, rays])).collect();
        db.execute(bound(statement, workers)).await.map(drop)
    }
}

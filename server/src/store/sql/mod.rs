//! The store in SQL: one set of statements, for a file (SQLite) and for a server (PostgreSQL).
//!
//! On either there is one transaction that writes at a time, so that what a change has read is still so
//! when it is made durable: SQLite by itself, PostgreSQL by an advisory lock. Groups make up for it.

mod column;
mod commit;
mod connection;
mod control;
mod gathered;
mod job;
mod kept;
mod ledger;
mod list;
mod merger;
mod notice;
mod open;
mod query;
mod ranks;
#[cfg(test)]
pub(crate) mod schema;
mod worker;
mod writer;

use super::{
    Sharing, Store,
    error::{Result, StoreError},
    kept::{KeptJob, UnfiledJob},
    list::{JobFilter, Outlook, Standing},
    notice::NoticeRow,
    row::{
        Added, BatchKey, Brought, Claim, CommitOutcome, CommitRow, Counts, Extension, IdempotencyKey,
        JobChange, JobHead, JobRow, Lane, Ledger, Mandate, NewCheckpoint, NewCommit, NewJob, Progress,
        Released, SceneRow, TokenRow, Unclaimed, WorkerRow,
    },
};
use connection::Db;
use open::{Readers, Source};
use ovtigre_core::film::allocation::Allocations;
use ovtigre_proto::{
    curve::{CurveRow, LayerError},
    id::{BlobId, JobId, LeaseId, WorkerId},
    lease::WorkerJoin,
    scene::SceneReport,
    status::WorkerState,
};
use std::{ops::Range, path::Path, time::Duration};

/// A store in a database. Durable: what a call has done is on disk when it returns.
#[derive(Debug)]
pub struct Sql {
    writer: writer::Writer,
    readers: Readers,
    sharing: Sharing,
}

impl Sql {
    /// Opens a file of SQLite, makes it where it is not there, and brings its tables up to date. One
    /// process at a time.
    pub async fn file(path: &Path) -> Result<Self> {
        let store = Self::open(Source::file(path), Sharing::Alone).await?;
        store.writer.write(|db| Box::pin(merger::free_all(db))).await?;
        Ok(store)
    }

    /// Opens a file of SQLite beside the process whose file it is.
    pub async fn beside(path: &Path) -> Result<Self> {
        Self::open(Source::file(path), Sharing::Alone).await
    }

    /// Connects to a PostgreSQL server, `postgres://user:password@host:port/database`, and brings its
    /// tables up to date. Any number of processes.
    pub async fn server(url: &str) -> Result<Self> {
        Self::open(Source::server(url)?, Sharing::WithOthers).await
    }

    async fn open(source: Source, sharing: Sharing) -> Result<Self> {
        let connection = source.prepare().await?;
        let readers = source.readers().await?;
        Ok(Self { writer: writer::Writer::start(connection, source), readers, sharing })
    }

    async fn reader(&self) -> Result<Db> {
        self.readers.one().await
    }
}

#[async_trait::async_trait]
impl Store for Sql {
    fn sharing(&self) -> Sharing {
        self.sharing
    }

    async fn add_scene(&self, report: SceneReport) -> Result<bool> {
        self.writer.write(|db| Box::pin(kept::add_scene(db, report))).await
    }

    async fn scene(&self, id: &BlobId) -> Result<Option<SceneRow>> {
        kept::scene(&mut self.reader().await?, id).await
    }

    async fn use_scene(&self, id: &BlobId) -> Result<bool> {
        let id = id.clone();
        self.writer.write(move |db| Box::pin(async move { kept::use_scene(db, &id).await })).await
    }

    async fn unused_scenes(&self, unused: Duration, most: u32) -> Result<Vec<BlobId>> {
        kept::unused(&mut self.reader().await?, unused, most).await
    }

    async fn drop_scene(&self, id: &BlobId, unused: Duration) -> Result<bool> {
        let id = id.clone();
        self.writer.write(move |db| Box::pin(async move { kept::drop_scene(db, &id, unused).await })).await
    }

    async fn is_dropped(&self, id: &BlobId) -> Result<bool> {
        kept::is_dropped(&mut self.reader().await?, id).await
    }

    async fn dropped_before(&self, time: Duration) -> Result<Vec<BlobId>> {
        self.writer.write(move |db| Box::pin(kept::dropped_before(db, time))).await
    }

    async fn end_drop(&self, id: &BlobId) -> Result<()> {
        let id = id.clone();
        self.writer.write(move |db| Box::pin(async move { kept::end_drop(db, &id).await })).await
    }

    async fn unfiled(&self, most: u32) -> Result<Vec<UnfiledJob>> {
        kept::unfiled(&mut self.reader().await?, most).await
    }

    async fn file(&self, jobs: Vec<(JobId, Vec<BlobId>)>) -> Result<()> {
        self.writer.write(move |db| Box::pin(kept::file(db, jobs))).await
    }

    async fn kept_jobs(&self, most: u32) -> Result<Vec<KeptJob>> {
        kept::jobs(&mut self.reader().await?, most).await
    }

    async fn uncounted_jobs(&self, most: u32) -> Result<Vec<(JobId, u64)>> {
        kept::uncounted(&mut self.reader().await?, most).await
    }

    async fn count_jobs(&self, jobs: Vec<(JobId, u64, u64)>) -> Result<()> {
        self.writer.write(move |db| Box::pin(kept::count_jobs(db, jobs))).await
    }

    async fn add_job(&self, job: NewJob, key: Option<IdempotencyKey>) -> Result<Added> {
        self.writer.write(|db| Box::pin(job::add(db, job, key))).await
    }

    async fn keyed(&self, key: &IdempotencyKey) -> Result<Option<Added>> {
        job::keyed(&mut self.reader().await?, key).await
    }

    async fn job(&self, id: &JobId) -> Result<Option<JobRow>> {
        job::get(&mut self.reader().await?, id).await
    }

    async fn jobs(&self, filter: JobFilter) -> Result<Vec<JobRow>> {
        list::list(&mut self.reader().await?, filter).await
    }

    async fn unknown_jobs(&self, jobs: Vec<JobId>) -> Result<Vec<JobId>> {
        list::unknown(&mut self.reader().await?, &jobs).await
    }

    async fn standings(&self, jobs: &[JobId]) -> Result<Vec<Standing>> {
        list::standings(&mut self.reader().await?, jobs).await
    }

    async fn run_times(&self, jobs: &[JobId]) -> Result<Vec<Option<f64>>> {
        ranks::run_times(&mut self.reader().await?, jobs).await
    }

    async fn look_out(&self, outlooks: Vec<Outlook>) -> Result<()> {
        if outlooks.is_empty() {
            return Ok(());
        }
        self.writer.write(|db| Box::pin(ranks::look_out(db, outlooks))).await
    }

    async fn count_workers(&self) -> Result<()> {
        let counted = ranks::miscounted(&mut self.reader().await?).await?;
        if counted.is_empty() {
            return Ok(());
        }
        self.writer.write(|db| Box::pin(ranks::count_workers(db, counted))).await
    }

    async fn unsettled_jobs(&self) -> Result<Vec<JobRow>> {
        job::unsettled(&mut self.reader().await?).await
    }

    async fn heads(&self) -> Result<Vec<JobHead>> {
        job::heads(&mut self.reader().await?).await
    }

    async fn change_job(&self, id: &JobId, version: u64, change: JobChange) -> Result<bool> {
        let id = id.clone();
        self.writer
            .write(move |db| Box::pin(async move { job::change(db, &id, version, change).await }))
            .await
    }

    async fn remove_job(&self, id: &JobId) -> Result<bool> {
        let id = id.clone();
        self.writer.write(move |db| Box::pin(async move { job::remove(db, &id).await })).await
    }

    async fn remove_settled(&self, id: &JobId, version: u64) -> Result<bool> {
        let id = id.clone();
        self.writer
            .write(move |db| Box::pin(async move { job::remove_settled(db, &id, version).await }))
            .await
    }

    async fn ledger(&self, job: &JobId) -> Result<Ledger> {
        let (mut reader, job) = (self.reader().await?, job.clone());
        // A task of its own: a caller that goes away must not leave a reader behind that has begun.
        let read = tokio::spawn(async move {
            reader.begin_snapshot().await?;
            let ledger = ledger::read(&mut reader, &job).await;
            reader.execute(query::query("COMMIT")).await?;
            ledger
        });
        read.await.map_err(|_| StoreError::Closed)?
    }

    async fn unclaimed(&self, job: &JobId) -> Result<Unclaimed> {
        ledger::unclaimed(&mut self.reader().await?, job).await
    }

    async fn returned(&self) -> Result<Vec<(JobId, BatchKey)>> {
        ledger::returned(&mut self.reader().await?).await
    }

    async fn claim(&self, claims: Vec<Claim>, time: Duration) -> Result<Vec<bool>> {
        self.writer.claim(claims, time).await
    }

    async fn renew(&self, worker: &WorkerId, leases: Vec<LeaseId>, time: Duration) -> Result<Vec<LeaseId>> {
        let worker = worker.clone();
        self.writer
            .write(move |db| Box::pin(async move { ledger::renew(db, &worker, leases, time).await }))
            .await
    }

    async fn release(&self, lease: &LeaseId, failure: Option<String>) -> Result<Option<Released>> {
        let lease = lease.clone();
        self.writer.write(move |db| Box::pin(async move { ledger::release(db, &lease, failure).await })).await
    }

    async fn expire(&self) -> Result<Vec<Released>> {
        if !ledger::any_expired(&mut self.reader().await?).await? {
            return Ok(Vec::new());
        }
        self.writer.write(|db| Box::pin(ledger::expire(db))).await
    }

    async fn commit(&self, commit: NewCommit) -> Result<CommitOutcome> {
        self.writer.commit(commit).await
    }

    async fn commits(&self, job: &JobId, lane: Lane, blocks: Range<u32>) -> Result<Vec<CommitRow>> {
        commit::of_lane(&mut self.reader().await?, job, lane, blocks).await
    }

    async fn commits_after(&self, job: &JobId, after: u64) -> Result<Brought> {
        commit::after(&mut self.reader().await?, job, after).await
    }

    async fn take_merge(&self, job: &JobId, holder: &str, time: Duration) -> Result<Option<Mandate>> {
        let (job, holder) = (job.clone(), holder.to_owned());
        self.writer
            .write(move |db| Box::pin(async move { merger::take(db, &job, &holder, time).await }))
            .await
    }

    async fn keep_merges(&self, holder: &str, time: Duration) -> Result<Vec<(JobId, Mandate)>> {
        let holder = holder.to_owned();
        self.writer.write(move |db| Box::pin(async move { merger::keep(db, &holder, time).await })).await
    }

    async fn leave_merges(&self, holder: &str) -> Result<()> {
        let holder = holder.to_owned();
        self.writer.write(move |db| Box::pin(async move { merger::leave(db, &holder).await })).await
    }

    async fn publish(&self, job: &JobId, mandate: Mandate, progress: Progress) -> Result<()> {
        let job = job.clone();
        self.writer
            .write(move |db| Box::pin(async move { merger::publish(db, &job, mandate, progress).await }))
            .await
    }

    async fn set_snapshot(&self, job: &JobId, mandate: Mandate, lane: Lane, blocks: u32) -> Result<()> {
        let job = job.clone();
        self.writer
            .write(move |db| {
                Box::pin(async move { ledger::set_snapshot(db, &job, mandate, lane, blocks).await })
            })
            .await
    }

    async fn add_checkpoint(&self, job: &JobId, mandate: Mandate, checkpoint: NewCheckpoint) -> Result<()> {
        let job = job.clone();
        self.writer
            .write(move |db| {
                Box::pin(async move { commit::add_checkpoint(db, &job, mandate, checkpoint).await })
            })
            .await
    }

    async fn allocations(&self, job: &JobId) -> Result<Option<Allocations>> {
        commit::allocations(&mut self.reader().await?, job).await
    }

    async fn layers(&self, job: &JobId) -> Result<Vec<LayerError>> {
        commit::layers(&mut self.reader().await?, job).await
    }

    async fn curve(&self, job: &JobId) -> Result<Vec<CurveRow>> {
        commit::curve(&mut self.reader().await?, job).await
    }

    async fn add_worker(&self, id: &WorkerId, join: WorkerJoin) -> Result<()> {
        let id = id.clone();
        self.writer.write(move |db| Box::pin(async move { worker::add(db, &id, join).await })).await
    }

    async fn see_worker(&self, id: &WorkerId, state: WorkerState) -> Result<Option<WorkerState>> {
        let id = id.clone();
        self.writer.write(move |db| Box::pin(async move { worker::see(db, &id, state).await })).await
    }

    async fn set_worker_state(&self, id: &WorkerId, state: WorkerState) -> Result<bool> {
        let id = id.clone();
        self.writer.write(move |db| Box::pin(async move { worker::set_state(db, &id, state).await })).await
    }

    async fn worker(&self, id: &WorkerId) -> Result<Option<WorkerRow>> {
        worker::get(&mut self.reader().await?, id).await
    }

    async fn workers(&self, before: Option<i64>, limit: u32) -> Result<Vec<(i64, WorkerRow)>> {
        worker::list(&mut self.reader().await?, before, limit).await
    }

    async fn lose_workers(&self, time: Duration) -> Result<Vec<WorkerId>> {
        if !worker::any_silent(&mut self.reader().await?, time).await? {
            return Ok(Vec::new());
        }
        self.writer.write(move |db| Box::pin(worker::lose(db, time))).await
    }

    async fn workers_of(&self, job: &JobId) -> Result<u32> {
        ledger::workers_of(&mut self.reader().await?, job).await
    }

    async fn uncommit(&self, job: &JobId, batches: Vec<BatchKey>, lanes: Vec<Lane>) -> Result<()> {
        let job = job.clone();
        self.writer
            .write(move |db| Box::pin(async move { control::uncommit(db, &job, batches, lanes).await }))
            .await
    }

    async fn commits_by(&self, worker: &WorkerId) -> Result<Vec<(JobId, BatchKey)>> {
        control::commits_by(&mut self.reader().await?, worker).await
    }

    async fn pin_job(&self, id: &JobId, class: &str) -> Result<Option<String>> {
        let (id, class) = (id.clone(), class.to_owned());
        self.writer.write(move |db| Box::pin(async move { control::pin_job(db, &id, &class).await })).await
    }

    async fn extend_job(&self, id: &JobId, version: u64, to: Extension) -> Result<bool> {
        let id = id.clone();
        self.writer
            .write(move |db| Box::pin(async move { control::extend_job(db, &id, version, to).await }))
            .await
    }

    async fn set_aside(&self, worker: &WorkerId, reason: &str) -> Result<bool> {
        let (id, reason) = (worker.clone(), reason.to_owned());
        self.writer.write(move |db| Box::pin(async move { control::set_aside(db, &id, &reason).await })).await
    }

    async fn add_token(&self, token: TokenRow) -> Result<()> {
        self.writer.write(|db| Box::pin(control::add_token(db, token))).await
    }

    async fn tokens(&self) -> Result<Vec<TokenRow>> {
        control::tokens(&mut self.reader().await?).await
    }

    async fn token(&self, hash: &BlobId) -> Result<Option<TokenRow>> {
        control::token(&mut self.reader().await?, hash).await
    }

    async fn remove_token(&self, id: &str) -> Result<bool> {
        let id = id.to_owned();
        self.writer.write(move |db| Box::pin(async move { control::remove_token(db, &id).await })).await
    }

    async fn free_merge(&self, job: &JobId) -> Result<()> {
        let job = job.clone();
        self.writer.write(move |db| Box::pin(async move { control::free_merge(db, &job).await })).await
    }

    async fn due_notices(&self, most: u32, time: Duration) -> Result<Vec<NoticeRow>> {
        if !notice::any_due(&mut self.reader().await?).await? {
            return Ok(Vec::new());
        }
        self.writer.write(move |db| Box::pin(notice::take(db, most, time))).await
    }

    async fn end_notice(&self, sequence: i64) -> Result<()> {
        self.writer.write(move |db| Box::pin(notice::end(db, sequence))).await
    }

    async fn put_off_notice(&self, sequence: i64, time: Duration) -> Result<()> {
        self.writer.write(move |db| Box::pin(notice::put_off(db, sequence, time))).await
    }

    async fn forget_keys(&self, age: Duration) -> Result<()> {
        self.writer.write(move |db| Box::pin(worker::forget_keys(db, age))).await
    }

    async fn counts(&self) -> Result<Counts> {
        worker::counts(&mut self.reader().await?).await
    }

    async fn ping(&self) -> Result<()> {
        self.reader().await?.now().await.map(drop)
    }

    async fn close(&self) {
        // The writer last: whoever is last folds the log into the file, and readers may not.
        self.readers.close().await;
        self.writer.close().await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::{contract, sql::schema::schema};
    use std::sync::{
        Arc,
        atomic::{AtomicU32, Ordering},
    };

    fn join() -> WorkerJoin {
        WorkerJoin {
            name: "w".to_owned(),
            threads: 1,
            build: String::new(),
            instruction_set: String::new(),
            tags: Vec::new(),
        }
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_file_keeps_the_contract() {
        let folder = tempfile::tempdir().unwrap();
        let count = AtomicU32::new(0);
        contract::run(|| async {
            let n = count.fetch_add(1, Ordering::Relaxed);
            let store = Sql::file(&folder.path().join(format!("{n}.sqlite"))).await.unwrap();
            Arc::new(store) as Arc<dyn Store>
        })
        .await;
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_server_keeps_the_contract() {
        if schema("contract").await.is_none() {
            return;
        }
        let count = AtomicU32::new(0);
        contract::run(|| async {
            let n = count.fetch_add(1, Ordering::Relaxed);
            let url = schema(&format!("contract_{n}")).await.unwrap();
            Arc::new(Sql::server(&url).await.unwrap()) as Arc<dyn Store>
        })
        .await;
    }

    #[tokio::test]
    async fn what_was_written_is_there_after_it_is_opened_again() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("farm.sqlite");
        let store = Sql::file(&file).await.unwrap();
        let id: WorkerId = "w".parse().unwrap();
        store.add_worker(&id, join()).await.unwrap();
        store.close().await;
        assert!(!folder.path().join("farm.sqlite-wal").exists(), "the log is folded into the file");
        assert!(matches!(store.see_worker(&id, WorkerState::Active).await, Err(StoreError::Closed)));
        assert!(matches!(store.worker(&id).await, Err(StoreError::Closed)));
        let again = Sql::file(&file).await.unwrap();
        assert!(again.worker(&id).await.unwrap().is_some());
    }

    #[tokio::test]
    async fn tables_of_a_later_version_are_refused() {
        let insert = "INSERT INTO _sqlx_migrations (version, description, success, checksum, execution_time)
                      VALUES (9999, 'later', TRUE, 'x', 0)";
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("farm.sqlite");
        Sql::file(&file).await.unwrap().close().await;
        Source::file(&file).connect().await.unwrap().execute(query::query(insert)).await.unwrap();
        let refused = Sql::file(&file).await.unwrap_err();
        assert!(matches!(refused, StoreError::Newer { version: 9999 }), "{refused}");

        let Some(url) = schema("later").await else { return };
        Sql::server(&url).await.unwrap().close().await;
        Source::server(&url).unwrap().connect().await.unwrap().execute(query::query(insert)).await.unwrap();
        let refused = Sql::server(&url).await.unwrap_err();
        assert!(matches!(refused, StoreError::Newer { version: 9999 }), "{refused}");
    }

    #[test]
    fn migrations_only_add() {
        for migration in open::SQLITE.iter().chain(open::POSTGRES.iter()) {
            let sql = migration.sql.as_str().to_uppercase();
            for word in ["DROP ", "RENAME ", "ALTER COLUMN", "TRUNCATE"] {
                assert!(!sql.contains(word), "{}: {word}", migration.description);
            }
        }
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn columns_that_a_newer_program_adds_do_not_disturb_this_one() {
        let Some(url) = schema("columns").await else { return };
        let store = Sql::server(&url).await.unwrap();
        let (worker, job): (WorkerId, JobId) = ("w".parse().unwrap(), "a".parse().unwrap());
        store.add_worker(&worker, join()).await.unwrap();
        store.add_job(contract::new_job("a"), None).await.unwrap();
        let read = async || {
            assert!(store.job(&job).await.unwrap().is_some());
            assert_eq!(store.unsettled_jobs().await.unwrap().len(), 1);
            assert_eq!(store.jobs(JobFilter { limit: 9, ..JobFilter::default() }).await.unwrap().len(), 1);
            assert_eq!(store.standings(std::slice::from_ref(&job)).await.unwrap().len(), 1);
            assert!(store.curve(&job).await.unwrap().is_empty());
            assert_eq!(store.ledger(&job).await.unwrap().cursors.len(), 4);
            assert!(store.worker(&worker).await.unwrap().is_some());
            assert_eq!(store.workers(None, 9).await.unwrap().len(), 1);
            assert!(store.tokens().await.unwrap().is_empty());
            assert!(store.kept_jobs(9).await.unwrap().is_empty());
            assert!(store.scene(&BlobId::of([1; 32])).await.unwrap().is_none());
            assert!(store.due_notices(9, Duration::ZERO).await.unwrap().is_empty());
        };
        read().await;
        let mut db = Source::server(&url).unwrap().connect().await.unwrap();
        for add in [
            "ALTER TABLE job ADD COLUMN later TEXT",
            "ALTER TABLE worker ADD COLUMN later TEXT",
            "ALTER TABLE token ADD COLUMN later TEXT",
            "ALTER TABLE checkpoint ADD COLUMN later TEXT",
            "ALTER TABLE scene ADD COLUMN later TEXT",
            "ALTER TABLE notice ADD COLUMN later TEXT",
        ] {
            db.execute(query::query(add)).await.unwrap();
        }
        read().await;
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_server_that_ended_the_connection_is_found_again() {
        let Some(url) = schema("again").await else { return };
        let store = Sql::server(&format!("{url}&application_name=again")).await.unwrap();
        let id: WorkerId = "w".parse().unwrap();
        store.add_worker(&id, join()).await.unwrap();
        let end = "SELECT count(pg_terminate_backend(pid)) AS n FROM pg_stat_activity
                   WHERE application_name = 'again'";
        let mut db = Source::server(&url).unwrap().connect().await.unwrap();
        assert!(db.one(query::query(end)).await.unwrap().whole("n").unwrap() >= 1);
        // What was under way is lost, and its caller hears of it.
        let lost = store.see_worker(&id, WorkerState::Active).await;
        assert!(matches!(lost, Err(StoreError::Commit(_))), "{lost:?}");
        assert_eq!(store.see_worker(&id, WorkerState::Active).await.unwrap(), Some(WorkerState::Active));
    }
}

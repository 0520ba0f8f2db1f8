//! The store in one file: SQLite, one writer, many readers.

mod column;
mod commit;
mod control;
mod job;
mod ledger;
mod worker;
mod writer;

use super::{
    Store,
    error::{Result, StoreError},
    row::{
        Added, BatchKey, Claim, CommitOutcome, CommitRow, Counts, Extension, IdempotencyKey, JobChange,
        JobFilter, JobRow, Lane, Ledger, NewCheckpoint, NewCommit, NewJob, Released, SceneRow, TokenRow,
        WorkerRow,
    },
};
use ovtigre_proto::{
    curve::{CurveRow, LayerError},
    id::{BlobId, JobId, LeaseId, WorkerId},
    lease::WorkerJoin,
    scene::SceneReport,
    status::WorkerState,
};
use sqlx::{
    ConnectOptions as _, SqlitePool,
    pool::PoolConnection,
    sqlite::{
        Sqlite as Driver, SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous,
    },
};
use std::{ops::Range, path::Path, time::Duration};

/// Readers at a time.
const READERS: u32 = 4;

/// A store in a file. Durable: write-ahead log, synced at each commit.
#[derive(Debug)]
pub struct Sqlite {
    writer: writer::Writer,
    readers: SqlitePool,
}

impl Sqlite {
    /// Opens the file, makes it where it is not there, and brings its tables up to date.
    pub async fn open(file: &Path) -> Result<Self> {
        let options = SqliteConnectOptions::new()
            .filename(file)
            .create_if_missing(true)
            .journal_mode(SqliteJournalMode::Wal)
            .synchronous(SqliteSynchronous::Full)
            .busy_timeout(Duration::from_secs(10))
            .pragma("journal_size_limit", "67108864");
        let mut connection = options.connect().await?;
        sqlx::migrate!("./migrations/sqlite").run(&mut connection).await?;
        let readers = SqlitePoolOptions::new()
            .max_connections(READERS)
            .connect_with(options.create_if_missing(false).read_only(true))
            .await?;
        Ok(Self { writer: writer::Writer::start(connection), readers })
    }

    async fn reader(&self) -> Result<PoolConnection<Driver>> {
        self.readers.acquire().await.map_err(|error| match error {
            sqlx::Error::PoolClosed => StoreError::Closed,
            other => other.into(),
        })
    }
}

#[async_trait::async_trait]
impl Store for Sqlite {
    async fn add_scene(&self, report: SceneReport) -> Result<()> {
        self.writer.write(|db| Box::pin(job::add_scene(db, report))).await
    }

    async fn scene(&self, id: &BlobId) -> Result<Option<SceneRow>> {
        job::scene(&mut *self.reader().await?, id).await
    }

    async fn add_job(&self, job: NewJob, key: Option<IdempotencyKey>) -> Result<Added> {
        self.writer.write(|db| Box::pin(job::add(db, job, key))).await
    }

    async fn job(&self, id: &JobId) -> Result<Option<JobRow>> {
        job::get(&mut *self.reader().await?, id).await
    }

    async fn jobs(&self, filter: JobFilter) -> Result<Vec<JobRow>> {
        job::list(&mut *self.reader().await?, filter).await
    }

    async fn unsettled_jobs(&self) -> Result<Vec<JobRow>> {
        job::unsettled(&mut *self.reader().await?).await
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

    async fn ledger(&self, job: &JobId) -> Result<Ledger> {
        use sqlx::Connection as _;
        let mut reader = self.reader().await?;
        let mut snapshot = reader.begin().await?;
        ledger::read(&mut snapshot, job).await
    }

    async fn claim(&self, claims: Vec<Claim>, time: Duration) -> Result<Vec<bool>> {
        self.writer.write(move |db| Box::pin(ledger::claim(db, claims, time))).await
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
        if !ledger::any_expired(&mut *self.reader().await?).await? {
            return Ok(Vec::new());
        }
        self.writer.write(|db| Box::pin(ledger::expire(db))).await
    }

    async fn commit(&self, commit: NewCommit) -> Result<CommitOutcome> {
        self.writer.write(|db| Box::pin(commit::commit(db, commit))).await
    }

    async fn commits(&self, job: &JobId, lane: Lane, blocks: Range<u32>) -> Result<Vec<CommitRow>> {
        ledger::commits(&mut *self.reader().await?, job, lane, blocks).await
    }

    async fn set_snapshot(&self, job: &JobId, lane: Lane, blocks: u32) -> Result<()> {
        let job = job.clone();
        self.writer
            .write(move |db| Box::pin(async move { ledger::set_snapshot(db, &job, lane, blocks).await }))
            .await
    }

    async fn add_checkpoint(&self, job: &JobId, checkpoint: NewCheckpoint) -> Result<()> {
        let job = job.clone();
        self.writer
            .write(move |db| Box::pin(async move { commit::add_checkpoint(db, &job, checkpoint).await }))
            .await
    }

    async fn layers(&self, job: &JobId) -> Result<Vec<LayerError>> {
        commit::layers(&mut *self.reader().await?, job).await
    }

    async fn curve(&self, job: &JobId) -> Result<Vec<CurveRow>> {
        commit::curve(&mut *self.reader().await?, job).await
    }

    async fn add_worker(&self, id: &WorkerId, join: WorkerJoin) -> Result<()> {
        let id = id.clone();
        self.writer.write(move |db| Box::pin(async move { worker::add(db, &id, join).await })).await
    }

    async fn see_worker(&self, id: &WorkerId, state: WorkerState) -> Result<bool> {
        let id = id.clone();
        self.writer.write(move |db| Box::pin(async move { worker::see(db, &id, state).await })).await
    }

    async fn set_worker_state(&self, id: &WorkerId, state: WorkerState) -> Result<bool> {
        let id = id.clone();
        self.writer.write(move |db| Box::pin(async move { worker::set_state(db, &id, state).await })).await
    }

    async fn worker(&self, id: &WorkerId) -> Result<Option<WorkerRow>> {
        worker::get(&mut *self.reader().await?, id).await
    }

    async fn workers(&self, before: Option<i64>, limit: u32) -> Result<Vec<(i64, WorkerRow)>> {
        worker::list(&mut *self.reader().await?, before, limit).await
    }

    async fn lose_workers(&self, time: Duration) -> Result<Vec<WorkerId>> {
        if !worker::any_silent(&mut *self.reader().await?, time).await? {
            return Ok(Vec::new());
        }
        self.writer.write(move |db| Box::pin(worker::lose(db, time))).await
    }

    async fn workers_of(&self, job: &JobId) -> Result<u32> {
        ledger::workers_of(&mut *self.reader().await?, job).await
    }

    async fn uncommit(&self, job: &JobId, batches: Vec<BatchKey>, lanes: Vec<Lane>) -> Result<()> {
        let job = job.clone();
        self.writer
            .write(move |db| Box::pin(async move { control::uncommit(db, &job, batches, lanes).await }))
            .await
    }

    async fn commits_by(&self, worker: &WorkerId) -> Result<Vec<(JobId, BatchKey)>> {
        control::commits_by(&mut *self.reader().await?, worker).await
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
        control::tokens(&mut *self.reader().await?).await
    }

    async fn token(&self, hash: &BlobId) -> Result<Option<TokenRow>> {
        control::token(&mut *self.reader().await?, hash).await
    }

    async fn remove_token(&self, id: &str) -> Result<bool> {
        let id = id.to_owned();
        self.writer.write(move |db| Box::pin(async move { control::remove_token(db, &id).await })).await
    }

    async fn forget_keys(&self, age: Duration) -> Result<()> {
        self.writer.write(move |db| Box::pin(worker::forget_keys(db, age))).await
    }

    async fn counts(&self) -> Result<Counts> {
        worker::counts(&mut *self.reader().await?).await
    }

    async fn ping(&self) -> Result<()> {
        column::now(&mut *self.reader().await?).await.map(|_| ())
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
    use crate::store::{contract, error::StoreError};
    use std::sync::Arc;

    #[tokio::test(flavor = "multi_thread")]
    async fn keeps_the_contract() {
        let folder = tempfile::tempdir().unwrap();
        let count = std::sync::atomic::AtomicU32::new(0);
        contract::run(|| async {
            let n = count.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
            let store = Sqlite::open(&folder.path().join(format!("{n}.sqlite"))).await.unwrap();
            Arc::new(store) as Arc<dyn Store>
        })
        .await;
    }

    #[tokio::test]
    async fn what_was_written_is_there_after_it_is_opened_again() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("farm.sqlite");
        let store = Sqlite::open(&file).await.unwrap();
        let id: WorkerId = "w".parse().unwrap();
        let join = WorkerJoin {
            name: "w".to_owned(),
            threads: 1,
            build: String::new(),
            instruction_set: String::new(),
            tags: Vec::new(),
        };
        store.add_worker(&id, join).await.unwrap();
        store.close().await;
        assert!(!folder.path().join("farm.sqlite-wal").exists(), "the log is folded into the file");
        assert!(matches!(store.see_worker(&id, WorkerState::Active).await, Err(StoreError::Closed)));
        assert!(matches!(store.worker(&id).await, Err(StoreError::Closed)));
        let again = Sqlite::open(&file).await.unwrap();
        assert!(again.worker(&id).await.unwrap().is_some());
    }
}

//! Where a database is, and how it is opened.

use super::connection::{Db, To};
use crate::store::error::{Result, StoreError};
use sqlx::{
    ConnectOptions as _, PgPool, SqlitePool,
    migrate::{MigrateError, Migrator},
    postgres::{PgConnectOptions, PgPoolOptions},
    sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous},
};
use std::{path::Path, time::Duration};

/// Readers of a file at a time.
const FILE_READERS: u32 = 4;
/// Readers of a server at a time, of each process.
const SERVER_READERS: u32 = 8;
/// A reader is waited for so long.
const READER_WAIT: Duration = Duration::from_secs(10);

/// Migrations only add: tables, columns, indexes. So an older program goes on beside a newer one, until
/// it is started again.
pub(super) static SQLITE: Migrator = sqlx::migrate!("./migrations/sqlite");
/// The same tables on a server.
pub(super) static POSTGRES: Migrator = sqlx::migrate!("./migrations/postgres");

/// Where a database is.
#[derive(Clone, Debug)]
pub(super) enum Source {
    /// In a file.
    File(Box<SqliteConnectOptions>),
    /// On a server.
    Server(Box<PgConnectOptions>),
}

/// Connections to read over.
#[derive(Clone, Debug)]
pub(super) enum Readers {
    /// Of a file.
    File(SqlitePool),
    /// Of a server.
    Server(PgPool),
}

impl Source {
    /// A file, made where it is not there. Durable: write-ahead log, synced at each commit.
    pub(super) fn file(path: &Path) -> Self {
        let options = SqliteConnectOptions::new()
            .filename(path)
            .create_if_missing(true)
            .journal_mode(SqliteJournalMode::Wal)
            .synchronous(SqliteSynchronous::Full)
            .busy_timeout(Duration::from_secs(10))
            .pragma("journal_size_limit", "67108864");
        Self::File(Box::new(options))
    }

    /// A server: `postgres://user:password@host:port/database`. A program that hangs within a transaction
    /// is cut off, so that others go on.
    pub(super) fn server(url: &str) -> Result<Self> {
        let mut options: PgConnectOptions = url.parse()?;
        if options.get_application_name().is_none() {
            options = options.application_name("ovtigre");
        }
        let limits = [("idle_in_transaction_session_timeout", "5s"), ("lock_timeout", "20s")];
        // Every statement that runs often has an index to go by, which has its order, too, and what the planner knows of
        // tables that fill and empty all the time is soon wrong.
        let plans = [
            ("enable_seqscan", "off"),
            ("enable_sort", "off"),
            ("enable_incremental_sort", "off"),
            ("jit", "off"),
            ("plan_cache_mode", "force_generic_plan"),
        ];
        Ok(Self::Server(Box::new(options.options(limits).options(plans))))
    }

    /// Whether it is a file.
    pub(super) fn is_file(&self) -> bool {
        matches!(self, Self::File(_))
    }

    /// A connection to write over.
    pub(super) async fn connect(&self) -> Result<Db> {
        Ok(match self {
            Self::File(options) => Db::new(To::Sqlite(options.connect().await?)),
            Self::Server(options) => Db::new(To::Postgres(options.connect().await?)),
        })
    }

    /// A connection to write over, once the tables are up to date.
    pub(super) async fn prepare(&self) -> Result<Db> {
        let mut db = self.connect().await?;
        let migrated = match &mut db.to {
            To::Sqlite(connection) => SQLITE.run(connection).await,
            To::Postgres(connection) => POSTGRES.run(connection).await,
            To::SqliteReader(_) | To::PostgresReader(_) => Ok(()),
        };
        match migrated {
            Ok(()) => Ok(db),
            Err(MigrateError::VersionMissing(version)) => Err(StoreError::Newer { version }),
            Err(error) => Err(error.into()),
        }
    }

    /// Connections to read over.
    pub(super) async fn readers(&self) -> Result<Readers> {
        Ok(match self {
            Self::File(options) => {
                let pool = SqlitePoolOptions::new().max_connections(FILE_READERS);
                let options = options.clone().create_if_missing(false).read_only(true);
                Readers::File(pool.connect_with(options).await?)
            }
            Self::Server(options) => {
                let pool = PgPoolOptions::new().max_connections(SERVER_READERS).acquire_timeout(READER_WAIT);
                Readers::Server(pool.connect_with(*options.clone()).await?)
            }
        })
    }
}

impl Readers {
    /// One of them.
    pub(super) async fn one(&self) -> Result<Db> {
        let reader = match self {
            Self::File(pool) => pool.acquire().await.map(To::SqliteReader),
            Self::Server(pool) => pool.acquire().await.map(To::PostgresReader),
        };
        reader.map(Db::new).map_err(|error| match error {
            sqlx::Error::PoolClosed => StoreError::Closed,
            other => other.into(),
        })
    }

    /// Waits for those in use, and lets go of all.
    pub(super) async fn close(&self) {
        match self {
            Self::File(pool) => pool.close().await,
            Self::Server(pool) => pool.close().await,
        }
    }
}

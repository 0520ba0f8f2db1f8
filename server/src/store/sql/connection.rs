//! A connection to either database.

use super::query::{Query, Value, query};
use crate::store::error::{Result, StoreError};
use sqlx::{
    Connection as _, PgConnection, Postgres, Row as _, Sqlite, SqliteConnection,
    pool::PoolConnection,
    postgres::{PgArguments, PgRow},
    query::Query as Bound,
    sqlite::{SqliteArguments, SqliteRow},
};

/// A connection to either database, alone or out of a pool.
#[derive(Debug)]
pub(super) enum Db {
    /// A file, to write.
    Sqlite(SqliteConnection),
    /// A file, to read.
    SqliteReader(PoolConnection<Sqlite>),
    /// A server, to write.
    Postgres(PgConnection),
    /// A server, to read.
    PostgresReader(PoolConnection<Postgres>),
}

/// A row of an answer.
pub(super) enum Row {
    /// Of a file.
    Sqlite(SqliteRow),
    /// Of a server.
    Postgres(PgRow),
}

fn for_sqlite(query: Query) -> Bound<'static, Sqlite, SqliteArguments> {
    query.values.into_iter().fold(sqlx::query(query.sql), |bound, value| match value {
        Value::Text(text) => bound.bind(text),
        Value::Whole(number) => bound.bind(number),
        Value::Real(number) => bound.bind(number),
    })
}

fn for_postgres(query: Query) -> Bound<'static, Postgres, PgArguments> {
    query.values.into_iter().fold(sqlx::query(query.sql), |bound, value| match value {
        // PostgreSQL has no text with a zero in it.
        Value::Text(text) => bound.bind(text.map(|text| text.replace('\0', "\u{fffd}"))),
        Value::Whole(number) => bound.bind(number),
        Value::Real(number) => bound.bind(number),
    })
}

impl Db {
    /// Does it; returns how many rows it changed.
    pub(super) async fn execute(&mut self, query: Query) -> Result<u64> {
        Ok(match self {
            Self::Sqlite(db) => for_sqlite(query).execute(db).await?.rows_affected(),
            Self::SqliteReader(db) => for_sqlite(query).execute(&mut **db).await?.rows_affected(),
            Self::Postgres(db) => for_postgres(query).execute(db).await?.rows_affected(),
            Self::PostgresReader(db) => for_postgres(query).execute(&mut **db).await?.rows_affected(),
        })
    }

    /// The first row of the answer.
    pub(super) async fn first(&mut self, query: Query) -> Result<Option<Row>> {
        Ok(match self {
            Self::Sqlite(db) => for_sqlite(query).fetch_optional(db).await?.map(Row::Sqlite),
            Self::SqliteReader(db) => for_sqlite(query).fetch_optional(&mut **db).await?.map(Row::Sqlite),
            Self::Postgres(db) => for_postgres(query).fetch_optional(db).await?.map(Row::Postgres),
            Self::PostgresReader(db) => {
                for_postgres(query).fetch_optional(&mut **db).await?.map(Row::Postgres)
            }
        })
    }

    /// The one row of an answer that always has one.
    pub(super) async fn one(&mut self, query: Query) -> Result<Row> {
        self.first(query).await?.ok_or_else(|| StoreError::damaged("answer", "no row"))
    }

    /// All rows of the answer.
    pub(super) async fn all(&mut self, query: Query) -> Result<Vec<Row>> {
        let sqlite = |rows: Vec<SqliteRow>| rows.into_iter().map(Row::Sqlite).collect();
        let postgres = |rows: Vec<PgRow>| rows.into_iter().map(Row::Postgres).collect();
        Ok(match self {
            Self::Sqlite(db) => sqlite(for_sqlite(query).fetch_all(db).await?),
            Self::SqliteReader(db) => sqlite(for_sqlite(query).fetch_all(&mut **db).await?),
            Self::Postgres(db) => postgres(for_postgres(query).fetch_all(db).await?),
            Self::PostgresReader(db) => postgres(for_postgres(query).fetch_all(&mut **db).await?),
        })
    }

    /// Milliseconds since 1970 by the database's clock.
    pub(super) async fn now(&mut self) -> Result<i64> {
        let sql = match self {
            Self::Sqlite(_) | Self::SqliteReader(_) => {
                "SELECT CAST(unixepoch('subsec') * 1000 AS INTEGER) AS now_ms"
            }
            Self::Postgres(_) | Self::PostgresReader(_) => {
                "SELECT CAST(floor(extract(epoch FROM clock_timestamp()) * 1000) AS BIGINT) AS now_ms"
            }
        };
        self.one(query(sql)).await?.whole("now_ms")
    }

    /// Begins to read what is there at one moment; ends with `COMMIT`.
    pub(super) async fn begin_snapshot(&mut self) -> Result<()> {
        let sql = match self {
            Self::Sqlite(_) | Self::SqliteReader(_) => "BEGIN",
            Self::Postgres(_) | Self::PostgresReader(_) => "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY",
        };
        self.execute(query(sql)).await.map(drop)
    }

    /// Begins a group of changes. No other group, of this process or another over the same database, goes
    /// on until it ends: what it reads stays so.
    pub(super) async fn begin_group(&mut self) -> Result<()> {
        match self {
            Self::Sqlite(_) | Self::SqliteReader(_) => self.execute(query("BEGIN IMMEDIATE")).await.map(drop),
            Self::Postgres(_) | Self::PostgresReader(_) => {
                self.execute(query("BEGIN")).await?;
                let alone =
                    "SELECT pg_advisory_xact_lock(hashtextextended('ovtigre ' || current_schema(), 0))";
                self.execute(query(alone)).await.map(drop)
            }
        }
    }

    /// Says goodbye to the database.
    pub(super) async fn close(self) -> Result<()> {
        match self {
            Self::Sqlite(db) => db.close().await?,
            Self::Postgres(db) => db.close().await?,
            Self::SqliteReader(_) | Self::PostgresReader(_) => {}
        }
        Ok(())
    }
}

macro_rules! columns {
    ($($(#[$doc:meta])* $name:ident: $type:ty),* $(,)?) => {
        impl Row {
            $(
                $(#[$doc])*
                pub(super) fn $name(&self, column: &'static str) -> Result<$type> {
                    Ok(match self {
                        Self::Sqlite(row) => row.try_get(column)?,
                        Self::Postgres(row) => row.try_get(column)?,
                    })
                }
            )*
        }
    };
}

columns! {
    /// A text.
    text: String,
    /// A text, where it is not NULL.
    text_or_none: Option<String>,
    /// A whole number.
    whole: i64,
    /// A whole number, where it is not NULL.
    whole_or_none: Option<i64>,
    /// A number.
    real: f64,
    /// A number, where it is not NULL.
    real_or_none: Option<f64>,
}

impl Row {
    /// A truth.
    pub(super) fn truth(&self, column: &'static str) -> Result<bool> {
        Ok(self.whole(column)? != 0)
    }
}

//! A connection to either database.

use super::query::{Query, Value, query};
use crate::store::error::{Result, StoreError};
use sqlx::{
    Connection as _, PgConnection, Postgres, Row as _, Sqlite, SqliteConnection,
    pool::PoolConnection,
    postgres::{PgArguments, PgRow},
    query::Query as Bound,
    raw_sql,
    sqlite::{SqliteArguments, SqliteRow},
};

/// A connection to either database.
#[derive(Debug)]
pub(super) struct Db {
    /// Which, and for what.
    pub(super) to: To,
    /// Milliseconds since 1970 when the group of changes under way asked for the time first.
    moment: Moment,
}

/// The time within a group of changes.
#[derive(Clone, Copy, Debug)]
enum Moment {
    /// There is no group: it is asked for each time.
    Passes,
    /// Nobody asked yet.
    Unknown,
    /// One for all changes of the group.
    Is(i64),
}

/// A connection, alone or out of a pool.
#[derive(Debug)]
pub(super) enum To {
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
    query.values.into_iter().fold(sqlx::query(query.postgres), |bound, value| match value {
        // PostgreSQL has no text with a zero in it.
        Value::Text(text) => bound.bind(text.map(|text| text.replace('\0', "\u{fffd}"))),
        Value::Whole(number) => bound.bind(number),
        Value::Real(number) => bound.bind(number),
    })
}

impl Db {
    /// Over a connection.
    pub(super) fn new(to: To) -> Self {
        Self { to, moment: Moment::Passes }
    }

    /// Does it; returns how many rows it changed.
    pub(super) async fn execute(&mut self, query: Query) -> Result<u64> {
        Ok(match &mut self.to {
            To::Sqlite(db) => for_sqlite(query).execute(db).await?.rows_affected(),
            To::SqliteReader(db) => for_sqlite(query).execute(&mut **db).await?.rows_affected(),
            To::Postgres(db) => for_postgres(query).execute(db).await?.rows_affected(),
            To::PostgresReader(db) => for_postgres(query).execute(&mut **db).await?.rows_affected(),
        })
    }

    /// The first row of the answer.
    pub(super) async fn first(&mut self, query: Query) -> Result<Option<Row>> {
        Ok(match &mut self.to {
            To::Sqlite(db) => for_sqlite(query).fetch_optional(db).await?.map(Row::Sqlite),
            To::SqliteReader(db) => for_sqlite(query).fetch_optional(&mut **db).await?.map(Row::Sqlite),
            To::Postgres(db) => for_postgres(query).fetch_optional(db).await?.map(Row::Postgres),
            To::PostgresReader(db) => for_postgres(query).fetch_optional(&mut **db).await?.map(Row::Postgres),
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
        Ok(match &mut self.to {
            To::Sqlite(db) => sqlite(for_sqlite(query).fetch_all(db).await?),
            To::SqliteReader(db) => sqlite(for_sqlite(query).fetch_all(&mut **db).await?),
            To::Postgres(db) => postgres(for_postgres(query).fetch_all(db).await?),
            To::PostgresReader(db) => postgres(for_postgres(query).fetch_all(&mut **db).await?),
        })
    }

    /// Milliseconds since 1970 by the database's clock; one moment for all changes of a group.
    pub(super) async fn now(&mut self) -> Result<i64> {
        if let Moment::Is(now) = self.moment {
            return Ok(now);
        }
        let sql = match &mut self.to {
            To::Sqlite(_) | To::SqliteReader(_) => {
                "SELECT CAST(unixepoch('subsec') * 1000 AS INTEGER) AS now_ms"
            }
            To::Postgres(_) | To::PostgresReader(_) => {
                "SELECT CAST(floor(extract(epoch FROM clock_timestamp()) * 1000) AS BIGINT) AS now_ms"
            }
        };
        let now = self.one(query(sql)).await?.whole("now_ms")?;
        if let Moment::Unknown = self.moment {
            self.moment = Moment::Is(now);
        }
        Ok(now)
    }

    /// Does several statements without values in one go.
    pub(super) async fn run(&mut self, sql: &'static str) -> Result<()> {
        match &mut self.to {
            To::Sqlite(db) => raw_sql(sql).execute(db).await.map(drop)?,
            To::SqliteReader(db) => raw_sql(sql).execute(&mut **db).await.map(drop)?,
            To::Postgres(db) => raw_sql(sql).execute(db).await.map(drop)?,
            To::PostgresReader(db) => raw_sql(sql).execute(&mut **db).await.map(drop)?,
        }
        Ok(())
    }

    /// Begins to read what is there at one moment; ends with `COMMIT`.
    pub(super) async fn begin_snapshot(&mut self) -> Result<()> {
        let sql = match &mut self.to {
            To::Sqlite(_) | To::SqliteReader(_) => "BEGIN",
            To::Postgres(_) | To::PostgresReader(_) => "BEGIN ISOLATION LEVEL REPEATABLE READ READ ONLY",
        };
        self.execute(query(sql)).await.map(drop)
    }

    /// Begins a group of changes. No other group, of this process or another over the same database, goes
    /// on until it ends: what it reads stays so.
    pub(super) async fn begin_group(&mut self) -> Result<()> {
        self.moment = Moment::Unknown;
        match &mut self.to {
            To::Sqlite(_) | To::SqliteReader(_) => self.execute(query("BEGIN IMMEDIATE")).await.map(drop),
            To::Postgres(_) | To::PostgresReader(_) => {
                self.execute(query("BEGIN")).await?;
                let alone =
                    "SELECT pg_advisory_xact_lock(hashtextextended('ovtigre ' || current_schema(), 0))";
                self.execute(query(alone)).await.map(drop)
            }
        }
    }

    /// Says goodbye to the database.
    pub(super) async fn close(self) -> Result<()> {
        match self.to {
            To::Sqlite(db) => db.close().await?,
            To::Postgres(db) => db.close().await?,
            To::SqliteReader(_) | To::PostgresReader(_) => {}
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

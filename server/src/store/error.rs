//! Why the store did not do something.

use std::fmt::Display;

/// A store that failed. Whether a change was made is told by the variant.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The database refused or broke; nothing was changed.
    #[error("the database failed: {0}")]
    Database(#[from] sqlx::Error),
    /// The tables could not be brought up to date.
    #[error("the database cannot be used by this version of the program: {0}")]
    Migration(#[from] sqlx::migrate::MigrateError),
    /// The tables are those of a later version.
    #[error(
        "the database has the tables of a later version of this program (migration {version}): use that one"
    )]
    Newer {
        /// The migration that is not known.
        version: i64,
    },
    /// Another farm appends to the job's sums.
    #[error("another server has taken over the job's sums")]
    Superseded,
    /// A group of changes could not be made durable; nothing of it was changed.
    #[error("the database could not write: {0}")]
    Commit(String),
    /// A row that this program did not write so.
    #[error("the database holds a damaged {what}: {detail}")]
    Damaged {
        /// Which kind of row.
        what: &'static str,
        /// What is wrong with it.
        detail: String,
    },
    /// The store is closed.
    #[error("the store is closed")]
    Closed,
}

impl StoreError {
    /// A row of kind `what` whose `detail` cannot be understood.
    pub fn damaged(what: &'static str, detail: impl Display) -> Self {
        Self::Damaged { what, detail: format!("{detail}") }
    }
}

/// What the store answers.
pub type Result<T> = std::result::Result<T, StoreError>;

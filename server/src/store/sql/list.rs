//! Jobs page by page.
//!
//! Each page is a range of one index, wherever it begins. PostgreSQL plans without the values: it goes by an index
//! of more columns only where a comparison of rows and the order name all of them. SQLite goes by one only where
//! leading columns are equal to something: what is like the place before comes first, then what is beyond.

use super::{
    column::{columns_of, count, from_json, parse},
    commit::curve_row,
    connection::Db,
    gathered::{not_there, of_jobs},
    job::read,
    query::{Query, both},
};
use crate::store::{
    error::Result,
    list::{JobFilter, Key, Mark, Place, Standing, Way},
    row::JobRow,
};
use ovtigre_proto::{id::JobId, status::JobState};

/// Rows of jobs that are looked for: in state `$3`, with text `$2` in a name or an id, or any where that is empty. `$1` at most.
macro_rules! found {
    ($name:literal; $($condition:literal),+; $($order:literal),+) => {
        concat!(
            "SELECT ", columns_of!(job), " FROM job WHERE ", $($condition,)+ " AND ($3 = '' OR state = $3)
             AND ($2 = '' OR ", $name, " LIKE $2 ESCAPE '\\' OR lower(id) LIKE $2 ESCAPE '\\')
             ORDER BY ", $($order,)+ " LIMIT $1"
        )
    };
}

/// A page by SQLite, whose `lower` knows the letters of ASCII.
macro_rules! page {
    ($($condition:literal),+; $($order:literal),+) => { found!("lower(name)"; $($condition),+; $($order),+) };
}

/// A page by PostgreSQL, asked for the same letters.
macro_rules! server_page {
    ($($condition:literal),+; $($order:literal),+) => {
        found!("lower(name COLLATE \"C\")"; $($condition),+; $($order),+)
    };
}

/// Statements of a key, from the beginning or after `$4` and sequence `$5`; of all jobs or of those in a state.
macro_rules! ordered {
    ($key:literal, $server_key:literal, $way:literal, $than:literal, $within:literal, $which:expr) => {
        match $which {
            (None, None) => both(
                page!($key, " IS NOT NULL"; $key, $way, ", sequence", $way),
                server_page!($server_key, " IS NOT NULL"; $server_key, $way, ", sequence", $way),
            ),
            (None, Some(_)) => both(
                page!("state = $3"; $key, $way, ", sequence", $way),
                server_page!("state >= $3 AND state <= $3"; "state", $way, ", ", $server_key, $way, ", sequence", $way),
            ),
            (Some(_), None) => both(
                concat!(
                    "SELECT * FROM (", page!($key, " = $4 AND sequence", $than, "$5"; "sequence", $way),
                    ") UNION ALL SELECT * FROM (", page!($key, $than, "$4"; $key, $way, ", sequence", $way),
                    ") LIMIT $1"
                ),
                server_page!("(", $server_key, ", sequence)", $than, "($4, $5)"; $server_key, $way, ", sequence", $way),
            ),
            (Some(_), Some(_)) => both(
                concat!(
                    "SELECT * FROM (", page!("state = $3 AND ", $key, " = $4 AND sequence", $than, "$5"; "sequence", $way),
                    ") UNION ALL SELECT * FROM (",
                    page!("state = $3 AND ", $key, $than, "$4"; $key, $way, ", sequence", $way), ") LIMIT $1"
                ),
                server_page!(
                    "(state, ", $server_key, ", sequence)", $than, "($3, $4, $5) AND state", $within, "$3";
                    "state", $way, ", ", $server_key, $way, ", sequence", $way
                ),
            ),
        }
    };
}

/// Statements of the order of coming, after sequence `$4`.
macro_rules! as_they_came {
    ($way:literal, $than:literal, $within:literal, $which:expr) => {
        match $which {
            (None, None) => both(
                page!("sequence IS NOT NULL"; "sequence", $way),
                server_page!("sequence IS NOT NULL"; "sequence", $way),
            ),
            (None, Some(_)) => both(
                page!("state = $3"; "sequence", $way),
                server_page!("state >= $3 AND state <= $3"; "state", $way, ", sequence", $way),
            ),
            (Some(_), None) => both(
                page!("sequence", $than, "$4"; "sequence", $way),
                server_page!("sequence", $than, "$4"; "sequence", $way),
            ),
            (Some(_), Some(_)) => both(
                page!("state = $3 AND sequence", $than, "$4"; "sequence", $way),
                server_page!(
                    "(state, sequence)", $than, "($3, $4) AND state", $within, "$3";
                    "state", $way, ", sequence", $way
                ),
            ),
        }
    };
}

/// A key's statements, up or down.
macro_rules! either_way {
    ($way:expr, $statements:ident!($($key:literal,)* ...), $which:expr) => {
        match $way {
            Way::Up => $statements!($($key,)* " ASC", " > ", " <= ", $which),
            Way::Down => $statements!($($key,)* " DESC", " < ", " >= ", $which),
        }
    };
}

fn statement(key: Key, way: Way, which: (Option<&Place>, Option<JobState>)) -> Query {
    match key {
        Key::Created => either_way!(way, as_they_came!(...), which),
        Key::Name => {
            either_way!(way, ordered!("lower(name)", "lower(name COLLATE \"C\")", ...), which)
        }
        Key::State => either_way!(way, ordered!("state", "state", ...), which),
        Key::Priority => either_way!(way, ordered!("priority", "priority", ...), which),
        Key::Error => either_way!(way, ordered!("error_ppb", "error_ppb", ...), which),
        Key::Progress => either_way!(way, ordered!("part_ppb", "part_ppb", ...), which),
        Key::Eta => either_way!(way, ordered!("expected_ms", "expected_ms", ...), which),
        Key::Workers => either_way!(way, ordered!("workers", "workers", ...), which),
    }
}

/// A page of jobs.
pub(super) async fn list(db: &mut Db, filter: JobFilter) -> Result<Vec<JobRow>> {
    let JobFilter { state, text, order, after, limit } = filter;
    let now = db.now().await?;
    // Those of one state go by when they came.
    let (key, after) = match (order.by, state) {
        (Key::State, Some(_)) => (Key::Created, after.map(|place| Place { mark: Mark::Nothing, ..place })),
        (key, _) => (key, after),
    };
    let mut rows = statement(key, order.way, (after.as_ref(), state))
        .bind(limit)
        .bind(text.map_or_else(String::new, |text| pattern(&text)))
        .bind(state.map_or("", JobState::name));
    if let Some(Place { mark, sequence }) = after {
        rows = match mark {
            Mark::Nothing => rows,
            Mark::Text(text) => rows.bind(text),
            Mark::Number(number) => rows.bind(number),
        };
        rows = rows.bind(sequence);
    }
    db.all(rows).await?.iter().map(|row| read(row, now)).collect()
}

/// What LIKE finds `text` with, wherever it is.
fn pattern(text: &str) -> String {
    let mut pattern = "%".to_owned();
    for c in text.chars() {
        if matches!(c, '%' | '_' | '\\') {
            pattern.push('\\');
        }
        pattern.push(c.to_ascii_lowercase());
    }
    pattern + "%"
}

/// Those of these jobs that are not there.
pub(super) async fn unknown(db: &mut Db, jobs: &[JobId]) -> Result<Vec<JobId>> {
    if jobs.is_empty() {
        return Ok(Vec::new());
    }
    db.all(not_there(jobs)).await?.iter().map(|row| parse(row, "job")).collect()
}

/// What a list says of each job beside its row, in the same order.
pub(super) async fn standings(db: &mut Db, jobs: &[JobId]) -> Result<Vec<Standing>> {
    if jobs.is_empty() {
        return Ok(Vec::new());
    }
    let rows = db.all(of_jobs(jobs)).await?;
    let standing = |row: &super::connection::Row| {
        let workers = count(row, "workers")?;
        if row.whole_or_none("look")?.is_none() {
            return Ok(Standing { workers, ..Standing::default() });
        }
        Ok(Standing { latest: Some(curve_row(row)?), layers: from_json(row, "layers")?, workers })
    };
    rows.iter().map(standing).collect()
}

//! A statement and its values, in words that both databases understand.

/// A value bound to a place `$1`, `$2` … of a statement.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    /// Text, or NULL.
    Text(Option<String>),
    /// A whole number, or NULL. A truth is 0 or 1.
    Whole(Option<i64>),
    /// A number, or NULL.
    Real(Option<f64>),
}

macro_rules! values {
    ($($from:ty => $to:ident($value:ident => $into:expr)),* $(,)?) => {
        $(
            impl From<$from> for Value {
                fn from($value: $from) -> Self {
                    Self::$to(Some($into))
                }
            }

            impl From<Option<$from>> for Value {
                fn from(value: Option<$from>) -> Self {
                    Self::$to(value.map(|$value| $into))
                }
            }
        )*
    };
}

values! {
    &str => Text(text => text.to_owned()),
    String => Text(text => text),
    i64 => Whole(number => number),
    u64 => Whole(number => number as i64),
    i32 => Whole(number => i64::from(number)),
    u32 => Whole(number => i64::from(number)),
    bool => Whole(truth => i64::from(truth)),
    f64 => Real(number => number),
}

/// A statement with its values.
#[derive(Clone, Debug)]
pub(super) struct Query {
    /// What SQLite reads: places are `$1`, `$2` …, numbers BIGINT or REAL.
    pub(super) sql: &'static str,
    /// What PostgreSQL reads; the same but for lists.
    pub(super) postgres: &'static str,
    /// Place by place.
    pub(super) values: Vec<Value>,
}

/// A statement without values yet.
pub(super) fn query(sql: &'static str) -> Query {
    both(sql, sql)
}

/// A statement that SQLite and PostgreSQL read differently.
pub(super) fn both(sqlite: &'static str, postgres: &'static str) -> Query {
    Query { sql: sqlite, postgres, values: Vec::new() }
}

impl Query {
    /// The value of the next place.
    pub(super) fn bind(mut self, value: impl Into<Value>) -> Self {
        self.values.push(value.into());
        self
    }
}

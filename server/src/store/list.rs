//! Lists of jobs: which are shown, in which order, and where a page of them begins.

use super::row::JobRow;
use ovtigre_proto::{
    curve::{CurveRow, LayerError},
    id::JobId,
    status::JobState,
};
use std::fmt;

/// Which jobs to list.
#[derive(Clone, Debug, Default)]
pub struct JobFilter {
    /// Only those in this state.
    pub state: Option<JobState>,
    /// Only those whose name or id has this in it, whatever the case of its letters A to Z.
    pub text: Option<String>,
    /// What they go by.
    pub order: Order,
    /// Only those after this place in that order.
    pub after: Option<Place>,
    /// At most so many.
    pub limit: u32,
}

/// What jobs go by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Key {
    /// When they came.
    #[default]
    Created,
    /// Their names, whatever the case of the letters A to Z.
    Name,
    /// The names of their states.
    State,
    /// Their priorities.
    Priority,
    /// Their relative errors at their latest checkpoints.
    Error,
    /// The parts of their samples that are drawn.
    Progress,
    /// When they are expected to be done.
    Eta,
    /// How many workers hold batches of them.
    Workers,
}

/// Of what is not known, in a list's order: more than any that is.
pub const NEVER: i64 = 9_000_000_000_000_000_000;

/// A number in billionths; `NEVER` where there is none, and of 10⁹ and more.
pub fn billionths(number: Option<f64>) -> i64 {
    number.filter(|number| *number < 1e9).map_or(NEVER, |number| (number * 1e9).round() as i64)
}

/// What lists of jobs go by that changes while a job is rendered: whole numbers, so that a place in a list is exact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ranks {
    /// Relative error at the latest checkpoint, in billionths.
    pub error_ppb: i64,
    /// The part of the samples that is drawn, in billionths.
    pub part_ppb: i64,
    /// When it is expected to be done, in milliseconds since 1970.
    pub expected_ms: i64,
    /// Workers that hold one of its batches.
    pub workers: i64,
}

/// How far a job is.
#[derive(Clone, Debug)]
pub struct Outlook {
    /// Which.
    pub job: JobId,
    /// The part of what was asked for that is in its picture, 0 to 1.
    pub part: f64,
    /// Seconds until it is expected to be done, where that is known.
    pub left: Option<f64>,
}

/// Which way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Way {
    /// The least first.
    Up,
    /// The greatest first.
    #[default]
    Down,
}

/// An order of jobs; those that are alike in it go by when they came, the same way. By itself the newest comes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Order {
    /// What they go by.
    pub by: Key,
    /// Which way.
    pub way: Way,
}

/// What a job has of a key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Mark {
    /// Nothing beside when it came.
    Nothing,
    /// A text.
    Text(String),
    /// A number.
    Number(i64),
}

/// A job's place in an order, whether the job is still there or not. As text it is its sequence, and after a
/// point its mark as text in hexadecimal digits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// What it has of the order's key.
    pub mark: Mark,
    /// Its place in the order of coming.
    pub sequence: i64,
}

impl Place {
    /// The place of a job among those that go by `key`.
    pub fn of(row: &JobRow, key: Key) -> Self {
        let mark = match key {
            Key::Created => Mark::Nothing,
            Key::Name => Mark::Text(row.name.to_ascii_lowercase()),
            Key::State => Mark::Text(row.state.name().to_owned()),
            Key::Priority => Mark::Number(row.priority.into()),
            Key::Error => Mark::Number(row.ranks.error_ppb),
            Key::Progress => Mark::Number(row.ranks.part_ppb),
            Key::Eta => Mark::Number(row.ranks.expected_ms),
            Key::Workers => Mark::Number(row.ranks.workers),
        };
        Self { mark, sequence: row.sequence }
    }

    /// A place among jobs that go by `key`, as it was written; `None` where the text is none.
    pub fn parse(text: &str, key: Key) -> Option<Self> {
        let (sequence, mark) = text.split_once('.').map_or((text, None), |(n, mark)| (n, Some(mark)));
        let mark = match (key, mark.map(unhex)) {
            (Key::Created, None) => Mark::Nothing,
            (Key::Name | Key::State, Some(mark)) => Mark::Text(mark?),
            (Key::Created | Key::Name | Key::State, _) => return None,
            (_, mark) => Mark::Number(mark??.parse().ok()?),
        };
        Some(Self { mark, sequence: sequence.parse().ok()? })
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.sequence)?;
        let mark = match &self.mark {
            Mark::Nothing => return Ok(()),
            Mark::Text(text) => text.clone(),
            Mark::Number(number) => number.to_string(),
        };
        write!(f, ".")?;
        mark.bytes().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

/// The text of hexadecimal digits.
fn unhex(digits: &str) -> Option<String> {
    let byte = |pair: &[u8]| match pair.iter().map(|c| char::from(*c).to_digit(16)).collect::<Vec<_>>()[..] {
        [Some(high), Some(low)] => Some((high * 16 + low) as u8),
        _ => None,
    };
    let bytes = digits.as_bytes().chunks(2).map(byte).collect::<Option<Vec<u8>>>()?;
    // PostgreSQL has no text with a zero in it.
    String::from_utf8(bytes).ok().filter(|text| !text.contains('\0'))
}

/// What a list says of a job beside its row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Standing {
    /// Its latest checkpoint.
    pub latest: Option<CurveRow>,
    /// The layers' errors at that.
    pub layers: Vec<LayerError>,
    /// Workers that hold one of its batches.
    pub workers: u32,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_read_as_it_was_written_and_in_no_other_order() {
        let place = |mark| Place { mark, sequence: 17 };
        for (mark, text, key) in [
            (Mark::Nothing, "17", Key::Created),
            (Mark::Text("zoë .".to_owned()), "17.7a6fc3ab202e", Key::Name),
            (Mark::Text(String::new()), "17.", Key::State),
            (Mark::Number(-3), "17.2d33", Key::Priority),
            (Mark::Number(NEVER), "17.39303030303030303030303030303030303030", Key::Error),
        ] {
            assert_eq!(place(mark.clone()).to_string(), text);
            assert_eq!(Place::parse(text, key), Some(place(mark)));
        }
        assert_eq!(Place::parse("17", Key::Name), None);
        assert_eq!(Place::parse("17.7a", Key::Priority), None);
        for text in ["17.7a", "", "x", "99999999999999999999", "-"] {
            assert_eq!(Place::parse(text, Key::Created), None, "{text}");
        }
        for text in ["17.7", "17.ff", "17.xy", "17.00", ".7a", "17.+a"] {
            assert_eq!(Place::parse(text, Key::Name), None, "{text}");
        }
    }
}

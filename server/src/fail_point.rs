//! Places at which a test lets this process die, as if the machine had lost its power there.
//!
//! A process dies where `OVTIGRE_FAIL_POINT` says, `NAME` or `NAME:N` for the N-th time that it gets there. Programs that
//! were built without debug assertions never do.

use std::{
    str::FromStr,
    sync::{
        OnceLock,
        atomic::{AtomicU64, Ordering},
    },
};

/// Which place, and how often it is passed before the process dies there.
static CHOSEN: OnceLock<(FailPoint, AtomicU64)> = OnceLock::new();

macro_rules! fail_points {
    ($($(#[$doc:meta])* $name:ident = $text:literal,)*) => {
        /// A place between two steps that have to be one for whoever looks later.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum FailPoint {
            $($(#[$doc])* $name,)*
        }

        impl FailPoint {
            /// All of them, in the order of a job's life.
            pub const ALL: &[Self] = &[$(Self::$name,)*];

            /// As in the environment.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$name => $text,)*
                }
            }
        }
    };
}

fail_points! {
    /// A scene was received, and is not among the blobs yet.
    SceneBeforeBlob = "scene-before-blob",
    /// A scene is among the blobs, and no row names it.
    SceneAfterBlob = "scene-after-blob",
    /// A scene's row is written, and nobody was told.
    SceneAfterRow = "scene-after-row",
    /// A job is resolved, and its row is not written.
    JobBeforeRow = "job-before-row",
    /// A job's row is written, and it is not in memory.
    JobAfterRow = "job-after-row",
    /// Batches are offered, and the claim is not written.
    ClaimBeforeRow = "claim-before-row",
    /// A claim is written, and the worker does not know.
    ClaimAfterRow = "claim-after-row",
    /// A sum that its worker has put among the blobs was read, and has no name yet.
    SumHanded = "sum-handed",
    /// A sum was decoded, and is nowhere.
    SumBeforeBlob = "sum-before-blob",
    /// A sum is among the blobs, and no row names it.
    SumAfterBlob = "sum-after-blob",
    /// A sum's row is written, and it waits for no append.
    SumAfterRow = "sum-after-row",
    /// A sum waits for its append, and its worker was not told.
    SumBeforeReply = "sum-before-reply",
    /// A group of changes is made, and not durable.
    GroupBeforeCommit = "group-before-commit",
    /// A group of changes is durable, and nobody was told.
    GroupAfterCommit = "group-after-commit",
    /// The right to append to a job's sums is written, and not used.
    MandateAfterRow = "mandate-after-row",
    /// Sums were read to be appended.
    AppendRead = "append-read",
    /// Sums were appended in memory.
    AppendAdded = "append-added",
    /// A lane is to be kept as one blob, which is not written.
    PrefixBeforeBlob = "prefix-before-blob",
    /// A lane is kept as one blob, and no row names it.
    PrefixAfterBlob = "prefix-after-blob",
    /// A lane's blob has its row, and its partials are still there.
    PrefixAfterRow = "prefix-after-row",
    /// Some of a lane's partials are removed.
    PartialsBetween = "partials-between",
    /// A checkpoint is measured, and not written down.
    CheckpointBeforeRow = "checkpoint-before-row",
    /// A checkpoint is written down, and nothing follows from it.
    CheckpointAfterRow = "checkpoint-after-row",
    /// A job is to end, and its picture is not written.
    EndBeforeResult = "end-before-result",
    /// A job's picture is among the blobs, and no row names it.
    EndAfterResult = "end-after-result",
    /// A job's sums are kept, and it is not over.
    EndAfterSums = "end-after-sums",
    /// A job's last row is written, and its leftovers are there.
    EndAfterRow = "end-after-row",
    /// A job's partials are removed, and what else is left is not.
    EndBetweenLeftovers = "end-between-leftovers",
}

impl FromStr for FailPoint {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.iter().copied().find(|point| point.name() == text);
        found.ok_or_else(|| format!("'{text}' is no place to fail at"))
    }
}

/// Lets this process die where `text` says, `NAME` or `NAME:N`. To be called once, at its start.
pub fn choose(text: &str) -> Result<(), String> {
    let (name, count) = text.split_once(':').unwrap_or((text, "1"));
    let count: u64 = count.parse().map_err(|_| format!("'{count}' is no number of times"))?;
    let chosen = (name.parse()?, AtomicU64::new(count.max(1)));
    CHOSEN.set(chosen).map_err(|_| "a place to fail at was chosen before".to_owned())
}

impl FailPoint {
    /// The process is here; it goes no further if that was chosen. Nothing is flushed, closed or unwound.
    pub fn pass(self) {
        if cfg!(debug_assertions)
            && let Some((point, left)) = CHOSEN.get()
            && *point == self
            && left.fetch_sub(1, Ordering::Relaxed) == 1
        {
            std::process::abort();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_place_has_a_name_of_its_own() {
        let names: BTreeSet<&str> = FailPoint::ALL.iter().map(|point| point.name()).collect();
        assert_eq!(names.len(), FailPoint::ALL.len());
        for point in FailPoint::ALL {
            assert_eq!(point.name().parse(), Ok(*point));
        }
        assert!("nowhere".parse::<FailPoint>().is_err());
        assert!(choose("job-after-row:x").is_err());
    }
}

//! What a farm counts since it was started.

use std::sync::atomic::{AtomicU64, Ordering};

/// Numbers that only grow.
#[derive(Debug, Default)]
pub struct Counters {
    accepted: AtomicU64,
    duplicate: AtomicU64,
    disagreeing: AtomicU64,
    not_needed: AtomicU64,
    expired: AtomicU64,
    failed: AtomicU64,
    appended: AtomicU64,
    merged_bytes: AtomicU64,
    told: AtomicU64,
    not_told: AtomicU64,
}

/// What became of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It counts.
    Accepted,
    /// The same sum was there.
    Duplicate,
    /// Another sum was there.
    Disagreeing,
    /// The job was over.
    NotNeeded,
    /// Its lease ran out.
    Expired,
    /// Its worker gave it back with a reason.
    Failed,
}

impl Fate {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Accepted, Self::Duplicate, Self::Disagreeing, Self::NotNeeded, Self::Expired, Self::Failed];

    /// As a label.
    pub fn name(self) -> &'static str {
        match self {
            Self::Accepted => "accepted",
            Self::Duplicate => "duplicate",
            Self::Disagreeing => "disagreeing",
            Self::NotNeeded => "not_needed",
            Self::Expired => "expired",
            Self::Failed => "failed",
        }
    }
}

impl Counters {
    fn of(&self, fate: Fate) -> &AtomicU64 {
        match fate {
            Fate::Accepted => &self.accepted,
            Fate::Duplicate => &self.duplicate,
            Fate::Disagreeing => &self.disagreeing,
            Fate::NotNeeded => &self.not_needed,
            Fate::Expired => &self.expired,
            Fate::Failed => &self.failed,
        }
    }

    /// Counts a batch.
    pub fn count(&self, fate: Fate) {
        self.of(fate).fetch_add(1, Ordering::Relaxed);
    }

    /// Batches of that fate.
    pub fn batches(&self, fate: Fate) -> u64 {
        self.of(fate).load(Ordering::Relaxed)
    }

    /// Counts batches that were appended, and their bytes.
    pub fn appended(&self, batches: u64, bytes: u64) {
        self.appended.fetch_add(batches, Ordering::Relaxed);
        self.merged_bytes.fetch_add(bytes, Ordering::Relaxed);
    }

    /// Somebody was told of a job's change.
    pub fn told(&self) {
        self.told.fetch_add(1, Ordering::Relaxed);
    }

    /// Somebody was not told of a job's change, and will not be.
    pub fn not_told(&self) {
        self.not_told.fetch_add(1, Ordering::Relaxed);
    }

    /// Notices that were taken, and that were given up.
    pub fn notices(&self) -> [u64; 2] {
        [&self.told, &self.not_told].map(|number| number.load(Ordering::Relaxed))
    }

    /// Batches appended.
    pub fn appended_batches(&self) -> u64 {
        self.appended.load(Ordering::Relaxed)
    }

    /// Bytes of sums appended.
    pub fn merged_bytes(&self) -> u64 {
        self.merged_bytes.load(Ordering::Relaxed)
    }
}

//! Names that nobody else has.

use crate::store::row::BatchKey;
use ovtigre_proto::id::{JobId, LeaseId, WorkerId};
use std::{
    hash::{BuildHasher as _, RandomState},
    sync::atomic::{AtomicU64, Ordering},
};

/// Makes names: random at the start of the program, counted from there, hashed.
#[derive(Debug)]
pub struct Ids {
    start: [u64; 2],
    count: AtomicU64,
}

impl Ids {
    /// With a start of the operating system's randomness.
    pub fn new() -> Self {
        // Its keys come from the operating system; two of them are needed for 128 bits.
        let random = || RandomState::new().hash_one(std::process::id());
        Self { start: [random(), random()], count: AtomicU64::new(0) }
    }

    /// `digits` hexadecimal digits, at most 64.
    pub fn text(&self, digits: usize) -> String {
        let count = self.count.fetch_add(1, Ordering::Relaxed);
        let mut hasher = blake3::Hasher::new();
        for n in [self.start[0], self.start[1], count] {
            hasher.update(&n.to_le_bytes());
        }
        hasher.finalize().to_hex()[..digits].to_owned()
    }

    /// A job.
    pub fn job(&self) -> JobId {
        self.text(12).parse().expect("hexadecimal digits name a job")
    }

    /// A worker.
    pub fn worker(&self) -> WorkerId {
        self.text(12).parse().expect("hexadecimal digits name a worker")
    }

    /// A lease. Its name says its batch, so that a sum which comes after the lease's end is still
    /// held against the batch it was leased for.
    pub fn lease(&self, job: &JobId, batch: BatchKey) -> LeaseId {
        let BatchKey { block, replicate, region } = batch;
        let name = format!("{job}_{region}_{replicate}_{block}_{}", self.text(8));
        name.parse().expect("a job's name and four numbers are short")
    }
}

impl Default for Ids {
    fn default() -> Self {
        Self::new()
    }
}

/// The batch that a lease was for.
pub fn batch_of(lease: &LeaseId) -> Option<(JobId, BatchKey)> {
    let (job, [region, replicate, block]) = lease.batch()?;
    Some((job, BatchKey { block, replicate, region }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leases_name_says_its_batch_and_names_differ() {
        let ids = Ids::new();
        let (job, batch) = (ids.job(), BatchKey { block: 1_048_576, replicate: 255, region: 32_767 });
        let lease = ids.lease(&job, batch);
        assert_eq!(batch_of(&lease), Some((job.clone(), batch)));
        assert_ne!(lease, ids.lease(&job, batch));
        assert_ne!(Ids::new().job(), Ids::new().job());
        for text in ["x", "a_b", "a_1_2_x_9", "_1_2_3_4"] {
            assert_eq!(batch_of(&text.parse().unwrap()), None, "{text}");
        }
    }
}

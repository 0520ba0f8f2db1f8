//! Where a sum comes from that is appended.

use super::live::sum_bytes;
use crate::store::row::CommitRow;
use bytes::Bytes;
use ovtigre_core::film::{exr, sum::Sum};
use ovtigre_proto::id::BlobId;

/// A sum, decoded or not.
pub(super) enum Source {
    /// In memory.
    Decoded(Sum),
    /// As its worker brought it.
    Partial(Bytes),
    /// Nowhere any more.
    Lost,
}

impl Source {
    /// Bytes of it.
    pub(super) fn bytes(&self) -> u64 {
        match self {
            Self::Decoded(sum) => sum_bytes(sum),
            Self::Partial(bytes) => bytes.len() as u64,
            Self::Lost => 0,
        }
    }

    /// The sum that was committed; `None` where what is kept is not that, or not whole.
    pub(super) fn decode(self, pixels: usize, row: &CommitRow) -> Option<Sum> {
        match self {
            Self::Decoded(sum) => Some(sum),
            Self::Lost => None,
            Self::Partial(bytes) => {
                let (sum, _) = exr::read_partial(&bytes, pixels).ok()?;
                (BlobId::of(sum.hash()) == row.hash).then_some(sum)
            }
        }
    }
}

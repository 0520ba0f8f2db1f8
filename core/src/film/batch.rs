//! The unit of work: which samples of which pixels.

use super::size::Region;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::{fmt, ops::Range};

/// A run of sample indices of one replicate, by its place in the schedule.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub struct Block {
    /// Place in the schedule, from 0.
    pub index: u32,
    /// First sample index.
    pub start: u32,
    /// Number of sample indices, at least 1.
    pub count: u32,
}

impl Block {
    /// Its sample indices.
    pub fn samples(self) -> Range<u32> {
        self.start..self.start + self.count
    }
}

/// Some samples of some pixels. Its sum is a pure function of (scene, settings, batch).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub struct Batch {
    /// Which pixels.
    pub region: Region,
    /// Which of the independently scrambled sequences.
    pub replicate: u32,
    /// Which samples of it.
    pub block: Block,
}

impl fmt::Display for Batch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "region {} replicate {} block {}", self.region, self.replicate, self.block.index)
    }
}

//! Batches of one replicate, appended in block order.

use super::{batch::Batch, invalid::InvalidSamples, size::Region, sum::Sum};

/// The first blocks of one replicate of one region, summed in f64 in block order: the same bits
/// however the batches came.
#[derive(Clone, Debug, PartialEq)]
pub struct Prefix {
    region: Region,
    replicate: u32,
    blocks: u32,
    samples: u32,
    /// Layer by layer, pixel by pixel, channel by channel.
    sums: Vec<f64>,
    invalid: InvalidSamples,
    rays: u64,
}

/// Why a sum was not appended, or a stored prefix not read.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum AppendError {
    /// Not the block that comes next.
    #[error("{got} does not follow block {blocks} of region {region} replicate {replicate}")]
    OutOfOrder {
        /// The sum's batch.
        got: Batch,
        /// Blocks appended so far.
        blocks: u32,
        /// The prefix's region.
        region: Region,
        /// The prefix's replicate.
        replicate: u32,
    },
    /// Another number of layers or pixels.
    #[error("a sum of {got} values cannot be appended to {expected}")]
    Shape {
        /// Values in the sum.
        got: usize,
        /// Values in the prefix.
        expected: usize,
    },
    /// Bytes that are no prefix.
    #[error("stored sums are damaged: {0}")]
    Damaged(&'static str),
}

const MAGIC: &[u8; 8] = b"ovtpre01";
const HEADER: usize = 8 + 4 * 8 + 8 * 4;

impl Prefix {
    /// No block yet.
    pub fn empty(region: Region, replicate: u32, layers: usize) -> Self {
        let sums = vec![0.0; region.pixels() * layers * 3];
        Self { region, replicate, blocks: 0, samples: 0, sums, invalid: InvalidSamples::default(), rays: 0 }
    }

    /// Its pixels.
    pub fn region(&self) -> Region {
        self.region
    }

    /// Which sequence.
    pub fn replicate(&self) -> u32 {
        self.replicate
    }

    /// Blocks appended.
    pub fn blocks(&self) -> u32 {
        self.blocks
    }

    /// Sample indices a pixel.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Number of layers, the picture included.
    pub fn layers(&self) -> usize {
        self.sums.len() / (3 * self.region.pixels())
    }

    /// Samples dropped.
    pub fn invalid(&self) -> InvalidSamples {
        self.invalid
    }

    /// Rays traced.
    pub fn rays(&self) -> u64 {
        self.rays
    }

    /// Sums of one layer: three channels a pixel, row by row.
    pub fn layer(&self, layer: usize) -> &[f64] {
        let length = 3 * self.region.pixels();
        &self.sums[layer * length..(layer + 1) * length]
    }

    /// Adds the next block. Refused sums change nothing.
    pub fn append(&mut self, sum: &Sum) -> Result<(), AppendError> {
        let Batch { region, replicate, block } = sum.batch;
        if (region, replicate) != (self.region, self.replicate)
            || (block.index, block.start) != (self.blocks, self.samples)
        {
            return Err(AppendError::OutOfOrder {
                got: sum.batch,
                blocks: self.blocks,
                region: self.region,
                replicate: self.replicate,
            });
        }
        let got: usize = sum.planes.iter().map(|plane| plane.len() * 3).sum();
        if got != self.sums.len() {
            return Err(AppendError::Shape { got, expected: self.sums.len() });
        }
        for (into, value) in self.sums.iter_mut().zip(sum.planes.iter().flatten().flatten()) {
            *into += f64::from(*value);
        }
        self.blocks += 1;
        self.samples += block.count;
        self.invalid.add(sum.invalid);
        self.rays += sum.rays;
        Ok(())
    }

    /// For a blob: little-endian, read by [`Prefix::from_bytes`].
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER + self.sums.len() * 8);
        bytes.extend_from_slice(MAGIC);
        let Region { x, y, width, height } = self.region;
        for n in [x, y, width, height, self.replicate, self.blocks, self.samples, self.layers() as u32] {
            bytes.extend_from_slice(&n.to_le_bytes());
        }
        for n in [self.invalid.nan, self.invalid.infinite, self.invalid.negative, self.rays] {
            bytes.extend_from_slice(&n.to_le_bytes());
        }
        for n in &self.sums {
            bytes.extend_from_slice(&n.to_le_bytes());
        }
        bytes
    }

    /// What [`Prefix::to_bytes`] wrote.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, AppendError> {
        if bytes.len() < HEADER || &bytes[..8] != MAGIC {
            return Err(AppendError::Damaged("not a prefix"));
        }
        let u32_at = |i: usize| u32::from_le_bytes(bytes[8 + i * 4..][..4].try_into().expect("four bytes"));
        let u64_at = |i: usize| u64::from_le_bytes(bytes[40 + i * 8..][..8].try_into().expect("eight bytes"));
        let region = Region { x: u32_at(0), y: u32_at(1), width: u32_at(2), height: u32_at(3) };
        let values = (region.pixels().checked_mul(3)).and_then(|n| n.checked_mul(u32_at(7) as usize));
        if region.pixels() == 0 || values.and_then(|n| n.checked_mul(8)) != Some(bytes.len() - HEADER) {
            return Err(AppendError::Damaged("its length does not fit its header"));
        }
        let sums = (bytes[HEADER..].chunks_exact(8))
            .map(|b| f64::from_le_bytes(b.try_into().expect("eight bytes")))
            .collect();
        Ok(Self {
            region,
            replicate: u32_at(4),
            blocks: u32_at(5),
            samples: u32_at(6),
            sums,
            invalid: InvalidSamples { nan: u64_at(0), infinite: u64_at(1), negative: u64_at(2) },
            rays: u64_at(3),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::schedule::Schedule;

    fn sum(batch: Batch) -> Sum {
        let value = |i: usize| {
            let x = (batch.block.index * 131 + i as u32 * 7 + 1) as f32;
            [x * 0.1, 1e-20 * x, 1e20 / x]
        };
        let planes = vec![(0..batch.region.pixels()).map(value).collect()];
        Sum { batch, planes, invalid: InvalidSamples { nan: 1, ..Default::default() }, rays: 10 }
    }

    #[test]
    fn only_the_next_block_is_appended_and_a_stored_prefix_is_read_back() {
        let region = Region { x: 1, y: 2, width: 5, height: 3 };
        let schedule = Schedule::new(region, 1, 2, 1000);
        let mut prefix = Prefix::empty(region, 1, 1);
        for block in 0..schedule.blocks().len() {
            let late = schedule.batch(0, 1, block + 1).or(schedule.batch(0, 1, 0)).unwrap();
            if late.block.index != 0 || block > 0 {
                assert!(prefix.clone().append(&sum(late)).is_err());
            }
            assert!(prefix.append(&sum(schedule.batch(0, 0, block).unwrap())).is_err(), "another replicate");
            prefix.append(&sum(schedule.batch(0, 1, block).unwrap())).unwrap();
            prefix = Prefix::from_bytes(&prefix.to_bytes()).unwrap();
        }
        assert_eq!((prefix.samples(), prefix.rays()), (1000, 10 * schedule.blocks().len() as u64));
        let bytes = prefix.to_bytes();
        for end in [0, 7, 40, bytes.len() - 1] {
            assert!(Prefix::from_bytes(&bytes[..end]).is_err());
        }
    }
}

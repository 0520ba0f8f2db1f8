//! Batches of one replicate, appended in block order.

use super::{
    allocation::Allocation,
    batch::Batch,
    grid::{Grid, TILES_MAX},
    invalid::InvalidSamples,
    size::Region,
    sum::Sum,
};

/// The first blocks of one replicate of one region, summed in f64 in block order: the same bits
/// however the batches came.
///
/// Where samples are allocated a pixel has N(n) of the n that are counted here. Its sum is kept times n/N(n): divided by n it is
/// the mean of what the pixel has.
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
    /// Of each tile of the frame that the region meets; empty where they are not counted.
    tile_rays: Vec<u64>,
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
    /// It was to be allocated before there was an allocation.
    #[error("{got} begins before the allocation, which is from sample {from} on")]
    BeforeAllocation {
        /// The sum's batch.
        got: Batch,
        /// The allocation's first sample.
        from: u32,
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
/// Of a prefix with rays of tiles behind its sums.
const MAGIC_WITH_TILES: &[u8; 8] = b"ovtpre02";
const HEADER: usize = 8 + 4 * 8 + 8 * 4;

impl Prefix {
    /// No block yet.
    pub fn empty(region: Region, replicate: u32, layers: usize) -> Self {
        let sums = vec![0.0; region.pixels() * layers * 3];
        Self {
            region,
            replicate,
            blocks: 0,
            samples: 0,
            sums,
            invalid: InvalidSamples::default(),
            rays: 0,
            tile_rays: Vec::new(),
        }
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

    /// Sample indices a pixel; where samples are allocated, those that it has in the mean.
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

    /// Rays of each tile that was met, where they were counted.
    pub fn rays_of_tiles(&self, grid: Grid) -> impl Iterator<Item = (usize, f64)> {
        grid.met(self.region).zip(self.tile_rays.iter().map(|rays| *rays as f64))
    }

    /// Sums of one layer: three channels a pixel, row by row.
    pub fn layer(&self, layer: usize) -> &[f64] {
        let length = 3 * self.region.pixels();
        &self.sums[layer * length..(layer + 1) * length]
    }

    /// Adds the next block. Refused sums change nothing.
    pub fn append(&mut self, sum: &Sum) -> Result<(), AppendError> {
        self.check(sum)?;
        for (into, value) in self.sums.iter_mut().zip(sum.planes.iter().flatten().flatten()) {
            *into += f64::from(*value);
        }
        self.count(sum);
        Ok(())
    }

    /// The same of a block whose samples were allocated. All blocks from the allocation's first sample on are appended so.
    pub fn append_allocated(&mut self, sum: &Sum, allocation: &Allocation) -> Result<(), AppendError> {
        self.check(sum)?;
        let block = sum.batch.block;
        if block.start < allocation.from() {
            return Err(AppendError::BeforeAllocation { got: sum.batch, from: allocation.from() });
        }
        let grid = allocation.grid();
        // L n₁/N₁ (N₀/n₀) + s n₁/N₁, with L what is kept at n₀, and s what the N₁ − N₀ new samples add up to.
        let factors: Vec<[f64; 2]> = (0..grid.tiles())
            .map(|tile| {
                let [before, after] = [block.start, block.start + block.count];
                let [had, has] = [before, after].map(|n| f64::from(allocation.count(tile, n)));
                let levelled = f64::from(after) / has;
                [had / f64::from(before) * levelled, levelled]
            })
            .collect();
        let Region { x, y, width, .. } = self.region;
        let pixels = self.region.pixels();
        for (plane, into) in sum.planes.iter().zip(self.sums.chunks_exact_mut(3 * pixels)) {
            for (pixel, (value, into)) in plane.iter().zip(into.chunks_exact_mut(3)).enumerate() {
                let place = [x + pixel as u32 % width, y + pixel as u32 / width];
                let [kept, added] = factors[grid.tile(place)];
                for (into, value) in into.iter_mut().zip(value) {
                    *into = *into * kept + f64::from(*value) * added;
                }
            }
        }
        self.count(sum);
        Ok(())
    }

    fn check(&self, sum: &Sum) -> Result<(), AppendError> {
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
        Ok(())
    }

    fn count(&mut self, sum: &Sum) {
        self.blocks += 1;
        self.samples += sum.batch.block.count;
        self.invalid.add(sum.invalid);
        self.rays += sum.rays;
        if self.tile_rays.len() < sum.tile_rays.len() {
            self.tile_rays.resize(sum.tile_rays.len(), 0);
        }
        for (into, rays) in self.tile_rays.iter_mut().zip(&sum.tile_rays) {
            *into += u64::from(*rays);
        }
    }

    /// For a blob: little-endian, read by [`Prefix::from_bytes`].
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER + self.sums.len() * 8);
        bytes.extend_from_slice(if self.tile_rays.is_empty() { MAGIC } else { MAGIC_WITH_TILES });
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
        for n in &self.tile_rays {
            bytes.extend_from_slice(&n.to_le_bytes());
        }
        bytes
    }

    /// What [`Prefix::to_bytes`] wrote.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, AppendError> {
        let with_tiles = bytes.get(..8) == Some(MAGIC_WITH_TILES);
        if bytes.len() < HEADER || !(with_tiles || &bytes[..8] == MAGIC) {
            return Err(AppendError::Damaged("not a prefix"));
        }
        let u32_at = |i: usize| u32::from_le_bytes(bytes[8 + i * 4..][..4].try_into().expect("four bytes"));
        let u64_at = |i: usize| u64::from_le_bytes(bytes[40 + i * 8..][..8].try_into().expect("eight bytes"));
        let region = Region { x: u32_at(0), y: u32_at(1), width: u32_at(2), height: u32_at(3) };
        let values = (region.pixels().checked_mul(3)).and_then(|n| n.checked_mul(u32_at(7) as usize));
        let length = values.and_then(|n| n.checked_mul(8)).filter(|_| region.pixels() > 0);
        let tiles = length.and_then(|length| (bytes.len() - HEADER).checked_sub(length));
        // The number of tiles follows from the frame, which is not known here.
        let tiles_fit = |bytes: usize| bytes > 0 && bytes.is_multiple_of(8) && bytes <= 8 * TILES_MAX;
        let (Some(length), true) =
            (length, tiles.is_some_and(|t| if with_tiles { tiles_fit(t) } else { t == 0 }))
        else {
            return Err(AppendError::Damaged("its length does not fit its header"));
        };
        let (sums, tiles) = bytes[HEADER..].split_at(length);
        let tile_rays = tiles.chunks_exact(8);
        let tile_rays = tile_rays.map(|b| u64::from_le_bytes(b.try_into().expect("eight bytes"))).collect();
        let sums =
            (sums.chunks_exact(8)).map(|b| f64::from_le_bytes(b.try_into().expect("eight bytes"))).collect();
        Ok(Self {
            region,
            replicate: u32_at(4),
            blocks: u32_at(5),
            samples: u32_at(6),
            sums,
            invalid: InvalidSamples { nan: u64_at(0), infinite: u64_at(1), negative: u64_at(2) },
            rays: u64_at(3),
            tile_rays,
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
        Sum {
            batch,
            planes,
            invalid: InvalidSamples { nan: 1, ..Default::default() },
            rays: 10,
            tile_rays: Vec::new(),
        }
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

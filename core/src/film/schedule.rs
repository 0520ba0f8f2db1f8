//! How the samples of a picture are cut into blocks. Follows from sizes alone, never from a clock.

use super::{
    batch::{Batch, Block},
    size::Region,
};

/// Samples of a whole frame in the first block of a replicate, about: small, so that a picture comes soon.
const FIRST_BLOCK_SAMPLES: u64 = 1 << 16;
/// Samples of a whole frame in the largest block, about: some seconds of work.
const LARGEST_BLOCK_SAMPLES: u64 = 1 << 22;
/// Longest block a replicate is cut into, whatever the frame.
const BLOCK_MAX: u32 = 1 << 14;
/// A partial EXR stays below this, about.
const PARTIAL_BYTES_MAX: usize = 32 << 20;
/// Bytes of one pixel of one plane of a partial EXR.
const PIXEL_BYTES: usize = 12;

/// Regions × replicates × blocks.
///
/// Blocks are aligned powers of two that grow, `b, b, 2b, 4b … B, B, B …`, so that each keeps the
/// stratification of its sequence. What is left at the end is cut into aligned powers of two that
/// shrink; [`Schedule::whole_blocks`] says where that tail begins.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schedule {
    regions: Vec<Region>,
    replicates: u32,
    blocks: Vec<Block>,
    whole: usize,
}

impl Schedule {
    /// For a picture of `region` with `planes` planes (at least 1: itself and its layers), and `samples` sample
    /// indices a pixel in each of `replicates` sequences.
    pub fn new(region: Region, planes: u32, replicates: u32, samples: u32) -> Self {
        assert!(planes > 0, "a picture without planes");
        let bands = region.bands(PARTIAL_BYTES_MAX / (PIXEL_BYTES * planes as usize));
        Self { regions: bands, ..Self::whole(region, replicates, samples) }
    }

    /// The same for a method whose samples add light to any pixel: `region` is not cut, however large.
    pub fn whole(region: Region, replicates: u32, samples: u32) -> Self {
        assert!(region.pixels() > 0 && replicates > 0, "an empty schedule");
        let pixels = region.pixels() as u64;
        let first = power_of_two_near(FIRST_BLOCK_SAMPLES / pixels).min(256);
        let largest = power_of_two_near(LARGEST_BLOCK_SAMPLES / pixels).clamp(first, BLOCK_MAX);
        let (blocks, whole) = cut(first, largest, samples);
        Self { regions: vec![region], replicates, blocks, whole }
    }

    /// Rectangles that cover the picture once, top to bottom.
    pub fn regions(&self) -> &[Region] {
        &self.regions
    }

    /// Number of independently scrambled sequences.
    pub fn replicates(&self) -> u32 {
        self.replicates
    }

    /// Blocks of each replicate, in order.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Number of leading blocks that a longer schedule of the same picture has, too.
    pub fn whole_blocks(&self) -> usize {
        self.whole
    }

    /// Number of batches.
    pub fn batches(&self) -> u64 {
        self.regions.len() as u64 * u64::from(self.replicates) * self.blocks.len() as u64
    }

    /// The batch at (region, replicate, block), where there is one.
    pub fn batch(&self, region: usize, replicate: u32, block: usize) -> Option<Batch> {
        let (region, block) = (*self.regions.get(region)?, *self.blocks.get(block)?);
        (replicate < self.replicates).then_some(Batch { region, replicate, block })
    }

    /// Sample indices a replicate has after its first `blocks` blocks.
    pub fn samples_after(&self, blocks: usize) -> u32 {
        self.blocks[..blocks].last().map_or(0, |b| b.start + b.count)
    }

    /// Numbers of blocks after which the picture is looked at: each time the samples have
    /// doubled, and at the end.
    pub fn checkpoints(&self) -> Vec<usize> {
        let mut next = 0;
        let mut points = Vec::new();
        for (i, block) in self.blocks.iter().enumerate() {
            let samples = block.start + block.count;
            if samples >= next {
                points.push(i + 1);
                next = samples.saturating_mul(2);
            }
        }
        if points.last().is_some_and(|&p| p < self.blocks.len()) {
            points.push(self.blocks.len());
        }
        points
    }
}

fn power_of_two_near(n: u64) -> u32 {
    1 << n.max(1).ilog2().min(24)
}

fn cut(first: u32, largest: u32, samples: u32) -> (Vec<Block>, usize) {
    let mut blocks = Vec::new();
    let mut start = 0;
    let mut push = |start: &mut u32, count: u32| {
        blocks.push(Block { index: blocks.len() as u32, start: *start, count });
        *start += count;
    };
    loop {
        // The largest power of two that start is aligned to, and that has been reached.
        let count = start.clamp(first, largest);
        if count > samples - start {
            break;
        }
        push(&mut start, count);
    }
    let whole = start;
    while start < samples {
        let left = samples - start;
        let count = (1 << left.ilog2()).min(if start == 0 { u32::MAX } else { 1 << start.trailing_zeros() });
        push(&mut start, count);
    }
    let whole_blocks = blocks.iter().take_while(|b| b.start + b.count <= whole).count();
    (blocks, whole_blocks)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HD: Region = Region { x: 0, y: 0, width: 1280, height: 720 };

    #[test]
    fn blocks_are_aligned_powers_of_two_that_cover_the_samples_once() {
        for (w, h) in [(1, 1), (16, 16), (64, 64), (256, 256), (1280, 720), (7680, 4320)] {
            let region = Region { x: 0, y: 0, width: w, height: h };
            for samples in [1, 2, 3, 5, 25, 64, 100, 1000, 4096, 100_003] {
                let schedule = Schedule::new(region, 1, 4, samples);
                let mut end = 0;
                for (i, block) in schedule.blocks().iter().enumerate() {
                    assert_eq!((block.index as usize, block.start), (i, end));
                    assert!(block.count.is_power_of_two() && block.start % block.count == 0, "{block:?}");
                    end += block.count;
                }
                assert_eq!(end, samples);
            }
        }
    }

    #[test]
    fn a_longer_schedule_begins_with_the_whole_blocks_of_a_shorter_one() {
        let long = Schedule::new(HD, 1, 4, 4096);
        for samples in 1..600 {
            let short = Schedule::new(HD, 1, 4, samples);
            let whole = short.whole_blocks();
            assert_eq!(short.blocks()[..whole], long.blocks()[..whole]);
        }
    }

    #[test]
    fn checkpoints_stand_where_the_samples_doubled_and_at_the_end() {
        let schedule = Schedule::new(HD, 1, 4, 25);
        let samples: Vec<u32> = schedule.checkpoints().iter().map(|&p| schedule.samples_after(p)).collect();
        assert_eq!(samples, [1, 2, 4, 8, 16, 25]);
    }

    #[test]
    fn a_large_frame_is_cut_so_that_partials_stay_small() {
        let region = Region { x: 0, y: 0, width: 7680, height: 4320 };
        let schedule = Schedule::new(region, 3, 4, 4);
        assert!(schedule.regions().iter().all(|r| r.pixels() * 36 <= PARTIAL_BYTES_MAX));
        assert_eq!(schedule.regions().iter().map(|r| r.pixels()).sum::<usize>(), region.pixels());
        let whole = Schedule::whole(region, 4, 4);
        assert_eq!(whole.regions(), [region]);
        assert_eq!((whole.blocks(), whole.replicates()), (schedule.blocks(), 4));
    }
}

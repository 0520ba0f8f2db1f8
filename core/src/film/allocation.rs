//! How many samples each tile of a frame gets.

use super::{
    batch::Block,
    grid::Grid,
    size::{Region, Size},
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// Shares are counted in eighths of the samples that a block has.
pub const UNIT: u8 = 8;
/// Smallest share of a tile: a quarter. What looks quiet may only have been missed.
pub const SHARE_MIN: u8 = 2;
/// Largest share of a tile: eight times.
pub const SHARE_MAX: u8 = 64;
/// One character a share, from 1 on.
const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+-";

/// How many samples each tile gets of what some replicates have from a sample index on.
///
/// Where a batch says that it has the indices a..b, a pixel of a tile with share w has N(a)..N(b) of them, with
/// `N(n) = from + ⌊(n − from) w⌋`, and N(n) = n up to `from`. So a pixel's samples are the first of its sequence, whatever
/// the blocks are, and N follows from n.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Written", into = "Written")]
#[schemars(with = "Written")]
pub struct Allocation {
    frame: Size,
    from: u32,
    shares: Vec<u8>,
}

/// An allocation in JSON.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "Allocation")]
struct Written {
    /// The whole frame.
    frame: Size,
    /// Sample index from which on tiles differ.
    from: u32,
    /// Of each tile, row by row, its share in eighths, as a digit: `A` to `Z`, `a` to `z`, `0` to `9`, `+` and `-` are 1 to 64.
    shares: String,
}

impl From<Allocation> for Written {
    fn from(Allocation { frame, from, shares }: Allocation) -> Self {
        let digit = |share: u8| char::from(DIGITS[usize::from(share) - 1]);
        Self { frame, from, shares: shares.into_iter().map(digit).collect() }
    }
}

impl TryFrom<Written> for Allocation {
    type Error = &'static str;

    fn try_from(Written { frame, from, shares }: Written) -> Result<Self, Self::Error> {
        let share = |digit: u8| DIGITS.iter().position(|d| *d == digit).map(|place| place as u8 + 1);
        let shares: Option<Vec<u8>> = shares.bytes().map(share).collect();
        let shares = shares.ok_or("a share is no digit of an allocation")?;
        let sides = [frame.width, frame.height];
        if !sides.iter().all(|side| (1..=Size::SIDE_MAX).contains(side)) || from == 0 {
            return Err("an allocation for no frame, or from no sample on");
        }
        if Grid::of(frame).tiles() != shares.len() {
            return Err("an allocation has not one share for each tile of its frame");
        }
        if !shares.iter().all(|share| (SHARE_MIN..=SHARE_MAX).contains(share)) {
            return Err("a share of an allocation is less than a quarter or more than eight");
        }
        Ok(Self { frame, from, shares })
    }
}

impl Allocation {
    /// Shares, in eighths, of the tiles of a frame from a sample index on.
    ///
    /// # Panics
    ///
    /// Where there is not one share from [`SHARE_MIN`] to [`SHARE_MAX`] for each tile, or `from` is 0.
    pub fn new(frame: Size, from: u32, shares: Vec<u8>) -> Self {
        assert!(from > 0 && shares.len() == Grid::of(frame).tiles(), "not one share for each tile");
        assert!(shares.iter().all(|share| (SHARE_MIN..=SHARE_MAX).contains(share)), "a share out of bounds");
        Self { frame, from, shares }
    }

    /// The frame.
    pub fn frame(&self) -> Size {
        self.frame
    }

    /// Its tiles.
    pub fn grid(&self) -> Grid {
        Grid::of(self.frame)
    }

    /// Sample index from which on tiles differ.
    pub fn from(&self) -> u32 {
        self.from
    }

    /// Shares in eighths, tile by tile.
    pub fn shares(&self) -> &[u8] {
        &self.shares
    }

    /// N(n) of a tile.
    #[inline]
    pub fn count(&self, tile: usize, samples: u32) -> u32 {
        let more = u64::from(samples.saturating_sub(self.from));
        let given = more * u64::from(self.shares[tile]) / u64::from(UNIT);
        samples.min(self.from) + u32::try_from(given).unwrap_or(u32::MAX - self.from)
    }

    /// Sample indices that a tile has of a block.
    #[inline]
    pub fn samples(&self, tile: usize, block: Block) -> Range<u32> {
        self.count(tile, block.start)..self.count(tile, block.start + block.count)
    }

    /// Samples of the pixel of a region that has the fewest, where a pixel has `samples` in the mean.
    pub fn fewest(&self, region: Region, samples: u32) -> u32 {
        self.grid().met(region).map(|tile| self.count(tile, samples)).min().unwrap_or(samples)
    }

    /// BLAKE3 of all that it says, in hex.
    pub fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for n in [self.frame.width, self.frame.height, self.from] {
            hasher.update(&n.to_le_bytes());
        }
        hasher.update(&self.shares);
        hasher.finalize().to_hex().to_string()
    }
}

/// Those of a job: one for replicates of even number and one for those of odd number, each decided by the other half.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Allocations(pub [Allocation; 2]);

impl Allocations {
    /// That of a replicate.
    pub fn of(&self, replicate: u32) -> &Allocation {
        &self.0[replicate as usize % 2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Size = Size { width: 40, height: 20 };

    fn allocation() -> Allocation {
        Allocation::new(FRAME, 8, vec![2, 8, 64, 3, 9, 17])
    }

    #[test]
    fn blocks_give_a_pixel_the_first_samples_of_its_sequence_without_gaps() {
        let allocation = allocation();
        for tile in 0..6 {
            let mut next = 0;
            for (start, count) in [(0, 4), (4, 4), (8, 8), (16, 16), (32, 1), (33, 1), (34, 2)] {
                let samples = allocation.samples(tile, Block { index: 0, start, count });
                assert_eq!(samples.start, next, "tile {tile}");
                next = samples.end;
                if start + count <= 8 {
                    assert_eq!(next, start + count, "all alike at first");
                }
            }
            assert_eq!(next, 8 + 28 * u32::from(allocation.shares()[tile]) / 8);
        }
        assert_eq!(allocation.fewest(FRAME.frame(), 36), 8 + 7);
        assert_eq!(allocation.fewest(Region { x: 33, y: 1, width: 7, height: 9 }, 36), 8 + 28 * 8);
    }

    #[test]
    fn what_is_written_is_read_and_nonsense_is_refused() {
        let json = serde_json::to_string(&allocation()).unwrap();
        assert_eq!(json, r#"{"frame":{"width":40,"height":20},"from":8,"shares":"BH-CIQ"}"#);
        assert_eq!(serde_json::from_str::<Allocation>(&json).unwrap(), allocation());
        for (what, with) in
            [("BH-CIQ", "BH-CI"), ("BH-CIQ", "BH-CI!"), ("BH-CIQ", "AH-CIQ"), (":8", ":0"), (":40", ":0")]
        {
            assert!(
                serde_json::from_str::<Allocation>(&json.replace(what, with)).is_err(),
                "{what} → {with}"
            );
        }
        assert_ne!(allocation().hash(), Allocation { from: 9, ..allocation() }.hash());
    }
}

//! Squares over a frame, to each of which samples are given as a whole.

use super::size::{Region, Size};

/// Tiles of a frame, at most.
pub const TILES_MAX: usize = 4096;
/// Shortest side of a tile in pixels: fewer pixels tell too little of their error.
const SIDE_MIN: u32 = 16;

/// Squares that cover a frame, row by row from the top left; those at the right and at the bottom are cut off by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    frame: Size,
    side: u32,
}

impl Grid {
    /// That of a frame: squares of 16 pixels a side, or of the next power of two with at most [`TILES_MAX`] of them.
    pub fn of(frame: Size) -> Self {
        let mut grid = Self { frame, side: SIDE_MIN };
        while grid.tiles() > TILES_MAX {
            grid.side *= 2;
        }
        grid
    }

    /// Pixels along a tile's side.
    pub fn side(self) -> u32 {
        self.side
    }

    /// Tiles in a row.
    pub fn columns(self) -> usize {
        self.frame.width.div_ceil(self.side) as usize
    }

    /// Tiles of the frame.
    pub fn tiles(self) -> usize {
        self.columns() * self.frame.height.div_ceil(self.side) as usize
    }

    /// The tile of a pixel of the frame.
    #[inline]
    pub fn tile(self, [x, y]: [u32; 2]) -> usize {
        (y / self.side) as usize * self.columns() + (x / self.side) as usize
    }

    /// The tiles that a region meets, row by row.
    pub fn met(self, region: Region) -> impl Iterator<Item = usize> {
        let range = |start: u32, length: u32| start / self.side..(start + length).div_ceil(self.side);
        let (columns, rows) = (range(region.x, region.width), range(region.y, region.height));
        rows.flat_map(move |row| {
            columns.clone().map(move |column| row as usize * self.columns() + column as usize)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_a_frame_once_and_are_not_too_many() {
        for (width, height) in [(1, 1), (16, 17), (480, 270), (1920, 1080), (32_768, 32_768), (32_768, 1)] {
            let grid = Grid::of(Size { width, height });
            assert!(grid.tiles() <= TILES_MAX, "{width}x{height}");
            assert_eq!(grid.tile([0, 0]), 0);
            assert_eq!(grid.tile([width - 1, height - 1]), grid.tiles() - 1);
            let all: Vec<usize> = grid.met(Size { width, height }.frame()).collect();
            assert_eq!(all, (0..grid.tiles()).collect::<Vec<_>>());
        }
        assert_eq!(Grid::of(Size { width: 1920, height: 1080 }).side(), 32);
    }

    #[test]
    fn a_region_meets_the_tiles_of_its_pixels() {
        let grid = Grid::of(Size { width: 100, height: 80 });
        let region = Region { x: 15, y: 16, width: 34, height: 17 };
        let mut tiles: Vec<usize> = (region.y..region.y + region.height)
            .flat_map(|y| (region.x..region.x + region.width).map(move |x| [x, y]))
            .map(|pixel| grid.tile(pixel))
            .collect();
        tiles.sort_unstable();
        tiles.dedup();
        assert_eq!(grid.met(region).collect::<Vec<_>>(), tiles);
    }
}

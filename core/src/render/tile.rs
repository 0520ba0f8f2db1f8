//! Tiles of pixels, for methods whose samples stay in their pixel.

use crate::film::grid::Grid;
use crate::film::invalid::InvalidSamples;
use crate::film::size::Region;
use crate::film::sum::Sum;
use crate::path::tally::Tally;
use crate::path::throughput::Carriage;
use crate::render::batch::{Canvas, RenderError};
use crate::render::progress::Progress;
use crate::render::sample::Sampling;
use glam::DVec3;
use rayon::prelude::*;

/// Side of a tile in pixels: small enough to keep all threads busy to the end of a batch.
const TILE: u32 = 8;

/// One thread's pixels: sums of each plane, pixel by pixel.
struct Tile {
    pixels: Vec<DVec3>,
    invalid: InvalidSamples,
    rays: u64,
    /// Of each pixel, where they are counted.
    pixel_rays: Vec<u64>,
}

pub(super) fn render<C: Carriage>(sampling: &Sampling<'_>, progress: &Progress) -> Result<Sum, RenderError> {
    let region = sampling.batch.region;
    let tiles = tiles(region);
    progress.begin(region.pixels() as u64);
    let done = tiles
        .par_iter()
        .map(|tile| render_tile::<C>(sampling, *tile, progress))
        .collect::<Result<Vec<_>, RenderError>>()?;
    let planes = sampling.rules.planes();
    let mut canvas = Canvas::new(region, planes);
    let (mut invalid, mut rays) = (InvalidSamples::default(), 0);
    let mut tile_rays = TileRays::new(sampling);
    for (tile, result) in tiles.iter().zip(done) {
        invalid.add(result.invalid);
        rays += result.rays;
        for (pixel, rays) in pixels(*tile).zip(result.pixel_rays) {
            tile_rays.add(pixel, rays);
        }
        for (pixel, sums) in pixels(*tile).zip(result.pixels.chunks(planes)) {
            for (plane, sum) in sums.iter().enumerate() {
                canvas.add(plane, pixel, *sum);
            }
        }
    }
    Ok(canvas.finish_with(sampling.batch, invalid, rays, tile_rays.finish(region)))
}

/// Rays of the frame's tiles; nothing where they are not counted.
struct TileRays {
    grid: Option<Grid>,
    rays: Vec<u64>,
}

impl TileRays {
    fn new(sampling: &Sampling<'_>) -> Self {
        let grid = sampling.counted();
        Self { grid, rays: vec![0; grid.map_or(0, Grid::tiles)] }
    }

    fn add(&mut self, pixel: [u32; 2], rays: u64) {
        if let Some(grid) = self.grid {
            self.rays[grid.tile(pixel)] += rays;
        }
    }

    fn finish(self, region: Region) -> Vec<u32> {
        let met = self.grid.into_iter().flat_map(|grid| grid.met(region));
        met.map(|tile| u32::try_from(self.rays[tile]).unwrap_or(u32::MAX)).collect()
    }
}

fn render_tile<C: Carriage>(
    sampling: &Sampling<'_>,
    region: Region,
    progress: &Progress,
) -> Result<Tile, RenderError> {
    let planes = sampling.rules.planes();
    let pixels_of_planes = Vec::with_capacity(region.pixels() * planes);
    let mut tile = Tile {
        pixels: pixels_of_planes,
        invalid: InvalidSamples::default(),
        rays: 0,
        pixel_rays: Vec::new(),
    };
    let counts = sampling.counted().is_some();
    let mut tally = Tally::new(planes);
    for pixel in pixels(region) {
        if progress.is_stopped() {
            return Err(RenderError::Stopped);
        }
        let first = tile.pixels.len();
        tile.pixels.resize(first + planes, DVec3::ZERO);
        let before = tally.rays;
        for index in sampling.samples(pixel) {
            tally.clear();
            sampling.sample::<C>(pixel, index, &mut tally);
            for (sum, value) in tile.pixels[first..].iter_mut().zip(&tally.planes) {
                *sum += tile.invalid.checked(*value).as_dvec3();
            }
        }
        if counts {
            tile.pixel_rays.push(tally.rays - before);
        }
    }
    tile.rays = tally.rays;
    progress.advance(region.pixels() as u64);
    Ok(tile)
}

/// Pixels of a rectangle, row by row.
pub(super) fn pixels(region: Region) -> impl Iterator<Item = [u32; 2]> {
    (region.y..region.y + region.height)
        .flat_map(move |y| (region.x..region.x + region.width).map(move |x| [x, y]))
}

/// Squares that cover a region once, row by row.
pub(super) fn tiles(region: Region) -> Vec<Region> {
    let mut tiles = Vec::new();
    for y in (0..region.height).step_by(TILE as usize) {
        for x in (0..region.width).step_by(TILE as usize) {
            let (width, height) = (TILE.min(region.width - x), TILE.min(region.height - y));
            tiles.push(Region { x: region.x + x, y: region.y + y, width, height });
        }
    }
    tiles
}

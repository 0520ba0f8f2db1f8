//! One batch: tiles on the threads of a pool, added in their order.

use crate::film::batch::Batch;
use crate::film::invalid::InvalidSamples;
use crate::film::size::Region;
use crate::film::sum::{Plane, Sum};
use crate::method::radiosity::Reconstruction;
use crate::method::{path, radiosity};
use crate::render::prepare::Prepared;
use crate::render::progress::Progress;
use crate::sampler::Sampler;
use crate::settings::{Method, Settings};
use rayon::prelude::*;

/// Side of a tile in pixels: small enough to keep all threads busy to the end of a batch.
const TILE: u32 = 8;

/// The render was asked to end before it was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("stopped before it was done")]
pub struct Stopped;

/// The sum of a batch. Runs on the current rayon pool; the same arguments give the same bits on any number of threads:
/// a pixel's samples are added in f64 in the order of their indices, by one thread.
pub fn render(
    prepared: &Prepared,
    settings: &Settings,
    batch: Batch,
    progress: &Progress,
) -> Result<Sum, Stopped> {
    assert!(batch.region.is_in(settings.size), "the batch's region is not in the frame");
    let tiles = tiles(batch.region);
    progress.begin(batch.region.pixels() as u64);
    let done = tiles
        .par_iter()
        .map(|tile| render_tile(prepared, settings, batch, *tile, progress))
        .collect::<Result<Vec<_>, Stopped>>()?;
    let mut plane: Plane = vec![[0.0; 3]; batch.region.pixels()];
    let (mut invalid, mut rays) = (InvalidSamples::default(), 0);
    for (tile, result) in tiles.iter().zip(done) {
        invalid.add(result.invalid);
        rays += result.rays;
        let width = tile.width as usize;
        for (y, row) in (tile.y..).zip(result.pixels.chunks(width)) {
            let start = (y - batch.region.y) as usize * batch.region.width as usize;
            let start = start + (tile.x - batch.region.x) as usize;
            plane[start..start + width].copy_from_slice(row);
        }
    }
    Ok(Sum { batch, planes: vec![plane], invalid, rays })
}

/// One thread's pixels.
struct Tile {
    pixels: Plane,
    invalid: InvalidSamples,
    rays: u64,
}

fn render_tile(
    prepared: &Prepared,
    settings: &Settings,
    batch: Batch,
    region: Region,
    progress: &Progress,
) -> Result<Tile, Stopped> {
    let scene = &prepared.scene;
    let mut tile =
        Tile { pixels: Vec::with_capacity(region.pixels()), invalid: InvalidSamples::default(), rays: 0 };
    for y in region.y..region.y + region.height {
        for x in region.x..region.x + region.width {
            if progress.is_stopped() {
                return Err(Stopped);
            }
            let mut sum = glam::DVec3::ZERO;
            for index in batch.block.samples() {
                let sampler = Sampler::new(settings.seed, batch.replicate, [x, y], index);
                let value = match settings.method {
                    Method::Path => path::sample(scene, settings, [x, y], &sampler, &mut tile.rays),
                    Method::Radiosity => {
                        let solution = prepared.radiosity.as_ref().expect("prepared for this method");
                        let how = Reconstruction::Gather;
                        radiosity::sample(scene, solution, settings, how, [x, y], &sampler, &mut tile.rays)
                    }
                    other => unreachable!("{} is refused when a job is submitted", other.name()),
                };
                sum += tile.invalid.checked(value).as_dvec3();
            }
            // What f64 holds but f32 does not is as bright as f32 can be: a partial sum must stay finite.
            let sum = sum.min(glam::DVec3::splat(f64::from(f32::MAX)));
            tile.pixels.push(sum.as_vec3().to_array());
        }
    }
    progress.advance(region.pixels() as u64);
    Ok(tile)
}

/// Squares that cover a region once, row by row.
fn tiles(region: Region) -> Vec<Region> {
    let mut tiles = Vec::new();
    for y in (0..region.height).step_by(TILE as usize) {
        for x in (0..region.width).step_by(TILE as usize) {
            let (width, height) = (TILE.min(region.width - x), TILE.min(region.height - y));
            tiles.push(Region { x: region.x + x, y: region.y + y, width, height });
        }
    }
    tiles
}

//! Passes of photons: for each sample index a map of its own, and one sample of every pixel from it.

use crate::film::invalid::InvalidSamples;
use crate::film::size::Region;
use crate::film::sum::Sum;
use crate::method::photon;
use crate::path::photons::map::PhotonMap;
use crate::path::photons::photon::{Photon, photons};
use crate::path::photons::radius::radius;
use crate::path::tally::{Splat, Tally};
use crate::path::throughput::Carriage;
use crate::render::batch::{Canvas, RenderError};
use crate::render::progress::Progress;
use crate::render::sample::Sampling;
use crate::render::tile::{pixels, tiles};
use rayon::prelude::*;

/// Light subpaths that one thread traces at a time.
const PATHS: u64 = 1024;

/// Values of a tile's pixels in one pass, plane after plane.
struct Tile {
    values: Vec<Splat>,
    invalid: InvalidSamples,
    rays: u64,
}

pub(super) fn render<C: Carriage>(sampling: &Sampling<'_>, progress: &Progress) -> Result<Sum, RenderError>
where
    C::Light: Send + Sync,
{
    let (region, block) = (sampling.batch.region, sampling.batch.block);
    progress.begin(region.pixels() as u64 * u64::from(block.count));
    let mut canvas = Canvas::new(region, sampling.rules.planes());
    let (mut invalid, mut rays) = (InvalidSamples::default(), 0);
    let tiles = tiles(region);
    for index in block.samples() {
        let (map, traced) = map::<C>(sampling, index, progress)?;
        rays += traced;
        let done = tiles
            .par_iter()
            .map(|tile| render_tile::<C>(sampling, *tile, index, &map, progress))
            .collect::<Result<Vec<_>, RenderError>>()?;
        for tile in done {
            invalid.add(tile.invalid);
            rays += tile.rays;
            for value in tile.values {
                canvas.add(value.plane as usize, value.pixel, value.value.as_dvec3());
            }
        }
    }
    Ok(canvas.finish(sampling.batch, invalid, rays))
}

/// The photons of a pass, in the order of their subpaths, and the rays they took.
fn map<C: Carriage>(
    sampling: &Sampling<'_>,
    index: u32,
    progress: &Progress,
) -> Result<(PhotonMap<C::Light>, u64), RenderError>
where
    C::Light: Send,
{
    let paths = sampling.rules.light_paths as u64;
    let moment = sampling.moment_of_pass(index);
    let traced = (0..paths.div_ceil(PATHS))
        .into_par_iter()
        .map(|run| {
            if progress.is_stopped() {
                return Err(RenderError::Stopped);
            }
            let mut tally = Tally::new(sampling.rules.planes());
            let mut all: Vec<Photon<C::Light>> = Vec::new();
            for number in run * PATHS..((run + 1) * PATHS).min(paths) {
                let sampler = sampling.light_path(index, number);
                all.extend(photons::<C>(sampling.scene, sampling.rules, (&sampler, moment), &mut tally));
            }
            Ok((all, tally.rays))
        })
        .collect::<Result<Vec<_>, RenderError>>()?;
    let rays = traced.iter().map(|(_, rays)| rays).sum();
    let all = traced.into_iter().flat_map(|(photons, _)| photons).collect();
    let radius = radius(sampling.scene, sampling.batch.region.pixels(), index);
    Ok((PhotonMap::new(all, radius), rays))
}

fn render_tile<C: Carriage>(
    sampling: &Sampling<'_>,
    region: Region,
    index: u32,
    map: &PhotonMap<C::Light>,
    progress: &Progress,
) -> Result<Tile, RenderError>
where
    C::Light: Send,
{
    if progress.is_stopped() {
        return Err(RenderError::Stopped);
    }
    let mut tally = Tally::new(sampling.rules.planes());
    let moment = sampling.moment_of_pass(index);
    let mut tile = Tile { values: Vec::new(), invalid: InvalidSamples::default(), rays: 0 };
    for pixel in pixels(region) {
        tally.clear();
        let (sampler, ray) = sampling.eye_in_pass(pixel, index, moment);
        photon::sample::<C>(sampling.scene, sampling.rules, (&sampler, ray), map, &mut tally);
        for (plane, value) in tally.planes.iter().enumerate() {
            let value = tile.invalid.checked(*value);
            tile.values.push(Splat { pixel, plane: plane as u32, value });
        }
    }
    tile.rays = tally.rays;
    progress.advance(region.pixels() as u64);
    Ok(tile)
}

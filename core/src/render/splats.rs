//! Pieces of work for methods whose samples reach any pixel.
//!
//! Splats cannot be added by the thread that finds them: f64 sums depend on their order. So each piece keeps a list, and
//! lists are added in the order of the pieces, a wave of them at a time to bound the memory.

use crate::film::invalid::InvalidSamples;
use crate::film::size::Region;
use crate::film::sum::Sum;
use crate::path::tally::{Splat, Tally};
use crate::path::throughput::Carriage;
use crate::render::batch::{Canvas, RenderError};
use crate::render::progress::Progress;
use crate::render::sample::Sampling;
use crate::render::tile::{pixels, tiles};
use rayon::prelude::*;
use std::ops::Range;

/// Sample indices of a piece at most.
const INDICES: u32 = 16;
/// Pieces of a wave: more than a machine has threads, by far.
const WAVE: usize = 512;

/// Some indices of some pixels.
#[derive(Clone, Debug)]
struct Piece {
    region: Region,
    indices: Range<u32>,
}

/// What a piece adds, in order.
struct Done {
    own: Vec<Splat>,
    splats: Vec<Splat>,
    invalid: InvalidSamples,
    rays: u64,
}

pub(super) fn render<C: Carriage>(sampling: &Sampling<'_>, progress: &Progress) -> Result<Sum, RenderError> {
    let (region, block) = (sampling.batch.region, sampling.batch.block);
    let pieces: Vec<Piece> = (block.start..block.start + block.count)
        .step_by(INDICES as usize)
        .flat_map(|start| {
            let indices = start..(start + INDICES).min(block.start + block.count);
            tiles(region).into_iter().map(move |region| Piece { region, indices: indices.clone() })
        })
        .collect();
    progress.begin(pieces.iter().map(|piece| piece.region.pixels() as u64).sum());
    let mut canvas = Canvas::new(region, sampling.rules.planes());
    let (mut invalid, mut rays) = (InvalidSamples::default(), 0);
    for wave in pieces.chunks(WAVE) {
        let done = wave
            .par_iter()
            .map(|piece| render_piece::<C>(sampling, piece, progress))
            .collect::<Result<Vec<_>, RenderError>>()?;
        for piece in done {
            invalid.add(piece.invalid);
            rays += piece.rays;
            for splat in piece.own.iter().chain(&piece.splats) {
                canvas.add(splat.plane as usize, splat.pixel, splat.value.as_dvec3());
            }
        }
    }
    Ok(canvas.finish(sampling.batch, invalid, rays))
}

fn render_piece<C: Carriage>(
    sampling: &Sampling<'_>,
    piece: &Piece,
    progress: &Progress,
) -> Result<Done, RenderError> {
    let mut done = Done { own: Vec::new(), splats: Vec::new(), invalid: InvalidSamples::default(), rays: 0 };
    let mut tally = Tally::new(sampling.rules.planes());
    for pixel in pixels(piece.region) {
        if progress.is_stopped() {
            return Err(RenderError::Stopped);
        }
        for index in piece.indices.clone() {
            tally.clear();
            sampling.sample::<C>(pixel, index, &mut tally);
            for (plane, value) in tally.planes.iter().enumerate() {
                if *value != glam::Vec3::ZERO {
                    let value = done.invalid.checked(*value);
                    done.own.push(Splat { pixel, plane: plane as u32, value });
                }
            }
            for splat in &tally.splats {
                let value = done.invalid.checked(splat.value);
                done.splats.push(Splat { value, ..*splat });
            }
        }
    }
    done.rays = tally.rays;
    progress.advance(piece.region.pixels() as u64);
    Ok(done)
}

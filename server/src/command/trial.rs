//! One render under a time limit, in this process, with its error on the way.

use ovtigre_core::{
    film::{
        append::Prefix,
        batch::{Batch, Block},
        certificate::Look,
        error::{estimate, slope},
        estimate::{Picture, picture},
        reference::Reference,
    },
    render::{
        batch::{RenderError, render},
        prepare::{PrepareError, prepare},
        progress::Progress,
    },
    settings::Settings,
};
use serde::Serialize;
use std::{sync::Arc, time::Instant};

/// Longest block.
const BLOCK_MAX: u32 = 1 << 12;

/// Why a trial has no result.
#[derive(Debug, thiserror::Error)]
pub(crate) enum TrialError {
    /// The scene cannot be rendered so.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The paths cannot be followed.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Nothing was drawn.
    #[error("no error is known after the first samples: ask for two replicates and more")]
    NoError,
}

/// What is rendered, and how long.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) settings: Settings,
    /// Seconds, the scene's preparation included. The first sample of each sequence is always drawn.
    pub(crate) budget: f64,
    /// Samples a pixel at most, over all sequences.
    pub(crate) samples: u32,
    /// The brightest that a sample can be which meets a light by chance only.
    pub(crate) by_chance: Option<f64>,
}

/// How a render stood.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Row {
    pub(crate) samples: u32,
    pub(crate) wall_seconds: f64,
    /// Time spent in batches.
    pub(crate) worker_seconds: f64,
    pub(crate) rays: u64,
    pub(crate) relative_error: f64,
    pub(crate) relative_error_upper: Option<f64>,
    /// Whether the upper end is not to be believed.
    pub(crate) doubted: bool,
    /// Against the reference, whose own is taken off.
    pub(crate) true_error: Option<f64>,
}

/// A render and its error on the way.
#[derive(Debug)]
pub(crate) struct Trial {
    pub(crate) rows: Vec<Row>,
    pictures: Vec<Picture>,
}

impl Trial {
    /// Renders. Blocks double as a farm's do; where the time does not suffice for the next one it is cut to an aligned power of
    /// two that fits, so that the time is used.
    pub(crate) fn run(scene: Arc<[u8]>, plan: &Plan) -> Result<Self, TrialError> {
        let start = Instant::now();
        let settings = &plan.settings;
        let prepared = prepare(scene, None, settings)?;
        let before = start.elapsed().as_secs_f64();
        let region = settings.size.frame();
        let mut lanes =
            vec![(0..settings.replicates).map(|r| Prefix::empty(region, r, 1)).collect::<Vec<_>>()];
        let mut trial = Self { rows: Vec::new(), pictures: Vec::new() };
        let mut block = Block { index: 0, start: 0, count: 1 };
        let mut shown = 0;
        loop {
            for prefix in &mut lanes[0] {
                let batch = Batch { region, replicate: prefix.replicate(), block };
                let sum = render(&prepared, settings, batch, &Progress::new())?;
                prefix.append(&sum).expect("blocks come in order");
            }
            let seconds = start.elapsed().as_secs_f64();
            let drawn = block.start + block.count;
            let a_sample = (seconds - before) / f64::from(drawn);
            let left = plan.samples / settings.replicates - drawn.min(plan.samples / settings.replicates);
            let next = next_count(drawn, ((plan.budget - seconds) / a_sample).min(f64::from(left)));
            if next.is_none() || f64::from(drawn) >= 1.4 * f64::from(shown) {
                shown = drawn;
                let number = trial.rows.len() as u32 + 1;
                let look = Look { number, by_chance: plan.by_chance };
                let found = estimate(region, &lanes, look).ok_or(TrialError::NoError)?;
                trial.rows.push(Row {
                    samples: drawn * settings.replicates,
                    wall_seconds: seconds,
                    worker_seconds: seconds - before,
                    rays: lanes[0].iter().map(Prefix::rays).sum(),
                    relative_error: found.relative,
                    relative_error_upper: found.relative_upper,
                    doubted: found.doubt.is_some(),
                    true_error: None,
                });
                trial.pictures.push(picture(settings.size, region, &lanes));
            }
            let Some(count) = next else { return Ok(trial) };
            block = Block { index: block.index + 1, start: drawn, count };
        }
    }

    /// Compares the pictures on the way with a reference.
    pub(crate) fn compare(&mut self, reference: &Reference) {
        for (row, picture) in self.rows.iter_mut().zip(&self.pictures) {
            row.true_error = Some(reference.relative_error(&picture.planes[0]));
        }
    }

    /// The picture as it was at the end.
    pub(crate) fn picture(&self) -> &Picture {
        self.pictures.last().expect("a trial has a look at least")
    }

    /// How it stood at the end.
    pub(crate) fn last(&self) -> &Row {
        self.rows.last().expect("a trial has a look at least")
    }

    /// Seconds and errors: against the reference where there is one.
    pub(crate) fn errors(&self) -> Vec<(f64, f64)> {
        self.rows.iter().map(|row| (row.wall_seconds, row.true_error.unwrap_or(row.relative_error))).collect()
    }

    /// Slope of log error over log time in batches, over the later half of the looks.
    pub(crate) fn slope(&self) -> Option<f64> {
        let later = &self.rows[self.rows.len() / 2..];
        let error = |row: &Row| (row.worker_seconds, row.true_error.unwrap_or(row.relative_error));
        slope(&later.iter().map(error).collect::<Vec<_>>())
    }
}

/// The largest block that may follow `start` samples and that `room` has a place for.
fn next_count(start: u32, room: f64) -> Option<u32> {
    let largest = (1_u32 << start.trailing_zeros().min(31)).min(BLOCK_MAX);
    (room >= 1.0).then(|| largest.min(1 << (room.min(1e9) as u32).ilog2()))
}

/// Where a curve is at `x`, straight between its points in logarithms; `None` outside of them.
pub(crate) fn between(points: &[(f64, f64)], x: f64) -> Option<f64> {
    points.windows(2).find_map(|pair| {
        let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
        let inside = x0.min(x1) <= x && x <= x0.max(x1);
        let positive = x0 > 0.0 && x1 > 0.0 && y0 > 0.0 && y1 > 0.0;
        let share = if x0 == x1 { 0.0 } else { (x / x0).ln() / (x1 / x0).ln() };
        (inside && positive).then(|| y0 * (y1 / y0).powf(share))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_stay_aligned_and_fit() {
        assert_eq!([next_count(1, 9.0), next_count(4, 9.0), next_count(4, 3.5)], [Some(1), Some(4), Some(2)]);
        assert_eq!([next_count(8, 0.9), next_count(1 << 20, 1e12)], [None, Some(BLOCK_MAX)]);
    }

    #[test]
    fn curves_are_straight_in_logarithms() {
        let points = [(1.0, 0.4), (4.0, 0.2), (16.0, 0.1)];
        assert!((between(&points, 8.0).unwrap() - 0.1 * 2.0_f64.sqrt()).abs() < 1e-12);
        assert_eq!(between(&points, 17.0), None);
        let turned = points.map(|(t, e)| (e, t));
        assert!((between(&turned, 0.1 * 2.0_f64.sqrt()).unwrap() - 8.0).abs() < 1e-9);
    }
}

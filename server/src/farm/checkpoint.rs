//! A look at the picture: its error, and whether the job goes on.

use super::{
    Farm,
    append::{Held, Merge, blocking},
    curve::target_at,
    error::Result,
    live::{Ending, Live, Waits},
};
use crate::{fail_point::FailPoint, store::row::NewCheckpoint};
use ovtigre_core::{
    film::{
        allocation::Allocations,
        certificate::Look,
        error::{ErrorEstimate, PlaneSummary, estimate, summarise},
    },
    settings::Shows,
};
use ovtigre_proto::{
    curve::{CurveRow, LayerError},
    status::JobState,
    telemetry::span::Place,
};
use std::sync::Arc;

impl Farm {
    /// All lanes are at a checkpoint: its row of the curve is written down. Says how the job ends,
    /// where it ends here.
    pub(super) async fn look(&self, live: &Arc<Live>, held: Held) -> Result<(Held, Option<Ending>)> {
        let mut span = self.traces.span("checkpoint", Place::OfJob(&live.id));
        let (held, found) = measure(live, held).await?;
        let (mut held, allocations) = decide(live, held).await?;
        let row = self.take_row(live, &mut held, found, allocations).await?;
        span.add("ovtigre.samples", i64::from(row.samples));
        if let Some(error) = row.relative_error {
            span.add("ovtigre.relative_error", error);
        }
        let merge = held.as_ref().expect("loaded by the caller");
        let reached = live.spec.error_target.is_some_and(|target| {
            let under = row.relative_error_upper.is_some_and(|upper| upper <= target);
            under && row.doubt.is_none() && has_light(merge)
        });
        let done = |reason: &str| Ending {
            state: JobState::Done,
            reason: Some(reason.to_owned()),
            certified: reached && !live.spec.settings.method.has_bias(),
            waits: Waits::Not,
        };
        let ending = if reached {
            Some(done(if live.spec.settings.method.has_bias() {
                "the spread of the samples is under the error target; the method has a bias beside it"
            } else {
                "the error target was reached"
            }))
        } else if merge.is_complete() {
            let doubt = row.doubt.filter(|_| live.spec.error_target.is_some());
            let doubt =
                doubt.map_or_else(String::new, |doubt| format!("; the error is not certified: {doubt}"));
            Some(done(&format!("all samples asked for were drawn{doubt}")))
        } else {
            self.book().reach(&live.id, merge.checkpoints);
            None
        };
        Ok((held, ending))
    }

    /// A last row of the curve for a picture that ends between two checkpoints.
    pub(super) async fn last_look(&self, live: &Live, held: Held) -> Result<Held> {
        let samples = held.as_ref().expect("loaded by the caller").progress().samples;
        let last = live.view().curve.last().map_or(0, |row| row.samples);
        if samples.round() <= f64::from(last) {
            return Ok(held);
        }
        let (mut held, found) = measure(live, held).await?;
        self.take_row(live, &mut held, found, None).await?;
        Ok(held)
    }

    async fn take_row(
        &self,
        live: &Live,
        held: &mut Held,
        measured: Measured,
        allocations: Option<Arc<Allocations>>,
    ) -> Result<CurveRow> {
        let Measured { picture: found, layers } = measured;
        let merge = held.as_mut().expect("loaded by the caller");
        let progress = merge.progress();
        let wall_seconds = self.job_row(&live.id).await?.run_seconds;
        let mut row = CurveRow {
            samples: progress.samples.round() as u32,
            wall_seconds,
            worker_seconds: progress.worker_micros as f64 * 1e-6,
            rays: progress.rays,
            rms_error: found.as_ref().map(|e| e.rms),
            relative_error: found.as_ref().map(|e| e.relative),
            relative_error_upper: found.as_ref().and_then(|e| e.relative_upper),
            target_expected_at_seconds: None,
            doubt: found.and_then(|e| e.doubt),
        };
        let mut rows = live.view().curve;
        rows.push(row.clone());
        row.target_expected_at_seconds = target_at(&rows, &live.spec);
        let mandate = Self::mandate(live)?;
        FailPoint::CheckpointBeforeRow.pass();
        merge.checkpoints += 1;
        let checkpoint = NewCheckpoint {
            look: merge.checkpoints,
            row: row.clone(),
            layers: layers.clone(),
            progress,
            allocations: allocations.as_deref().cloned(),
        };
        if let Err(error) = self.store.add_checkpoint(&live.id, mandate, checkpoint).await {
            merge.checkpoints -= 1;
            return Err(error.into());
        }
        FailPoint::CheckpointAfterRow.pass();
        if let Some(allocations) = allocations {
            live.set_allocations(allocations);
            merge.decision = live.decision();
        }
        live.set_view(|view| {
            if view.curve.len() < merge.checkpoints as usize {
                view.curve.push(row.clone());
            }
            view.layers = layers;
        });
        Ok(row)
    }
}

impl Merge {
    /// The latest checkpoint is looked at once more where no lane is past it: whoever looked before may have
    /// died when the job was about to end there.
    pub(super) fn look_again(&mut self) {
        let Some(latest) = self.checkpoints.checked_sub(1) else { return };
        let Some(limit) = self.points.get(latest as usize) else { return };
        if self.prefixes.iter().flatten().all(|prefix| prefix.blocks() <= *limit) {
            self.checkpoints = latest;
        }
    }
}

/// How samples are allocated from here on, where that is decided here.
async fn decide(live: &Arc<Live>, held: Held) -> Result<(Held, Option<Arc<Allocations>>)> {
    let live = Arc::clone(live);
    blocking(move || {
        let decided = held.as_ref().expect("loaded by the caller").decide(&live);
        (held, decided)
    })
    .await
}

/// The errors of what is appended.
struct Measured {
    picture: Option<ErrorEstimate>,
    layers: Vec<LayerError>,
}

/// The errors of what is appended. An estimate that is not finite is none.
async fn measure(live: &Live, held: Held) -> Result<(Held, Measured)> {
    let (region, by_chance) = (live.spec.region, live.spec.by_chance);
    let planes = live.spec.settings.planes() as usize;
    let narrow = live.spec.settings.layers.iter().position(|layer| layer.shows == Shows::Narrow);
    let narrow = narrow.map(|layer| layer + 1);
    blocking(move || {
        let merge = held.as_ref().expect("loaded by the caller");
        // A pixel that has fewer samples than counted may have missed as much more.
        let by_chance = by_chance.map(|brightest| brightest * merge.scarcity(region));
        let look = Look { number: merge.checkpoints + 1, by_chance };
        let found = estimate(region, &merge.prefixes, look);
        let found = found.filter(|e| e.rms.is_finite() && e.relative.is_finite());
        let found = found.map(|e| ErrorEstimate {
            relative_upper: e.relative_upper.filter(|upper| upper.is_finite()),
            ..e
        });
        let of = |plane| summarise(region, &merge.prefixes, plane);
        let layers = (1..planes).map(|plane| LayerError {
            estimated_bias: (narrow == Some(plane)).then(|| bias(&of(0), &of(plane))).flatten(),
            ..layer_error(&of(plane))
        });
        let measured = Measured { picture: found, layers: layers.collect() };
        (held, measured)
    })
    .await
}

fn layer_error(summary: &PlaneSummary) -> LayerError {
    let finite = |error: Option<f64>| error.filter(|e| e.is_finite());
    LayerError {
        mean_luminance: summary.mean_luminance,
        rms_error: finite(summary.rms),
        relative_error: finite(summary.relative),
        estimated_bias: None,
    }
}

/// What a picture of photons lacks around edges is in proportion to the radius of gathering: from the means at a radius and
/// at that of half the area follows the mean at radius zero.
fn bias(wide: &PlaneSummary, narrow: &PlaneSummary) -> Option<f64> {
    let (wide, narrow) = (wide.mean_luminance, narrow.mean_luminance);
    let at_zero = wide + (narrow - wide) / (1.0 - 0.5_f64.sqrt());
    Some((wide - at_zero) / at_zero).filter(|bias| bias.is_finite())
}

/// Whether any light was found. A picture that is black so far has no spread, and no proof either.
fn has_light(merge: &Merge) -> bool {
    merge.prefixes.iter().flatten().any(|prefix| prefix.layer(0).iter().any(|v| *v > 0.0))
}

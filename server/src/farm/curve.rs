//! Error against run time.

use super::{Farm, error::Result, open::read_spec, spec::JobSpec};
use ovtigre_core::{
    film::{certificate::level, error::slope},
    math::quantile::student_t_upper,
};
use ovtigre_proto::{
    curve::{Curve, CurveRow},
    id::JobId,
};

/// Slope of log error over log time of plain Monte Carlo, until a curve says better.
const PLAIN: f64 = -0.5;
/// Checkpoints that a slope is fitted to, at most.
const OCTAVES: usize = 6;
/// Checkpoints that are looked ahead: a millionfold of the time, about.
const LOOKS: usize = 20;

impl Farm {
    /// A job's curve.
    pub async fn curve(&self, id: &JobId) -> Result<Curve> {
        let row = self.job_row(id).await?;
        let rows = self.curve_rows(id).await?;
        let (spec, invalid) = (read_spec(&row)?, self.progress(&row).invalid);
        let last = rows.last();
        let error_and_work = last.and_then(|r| r.relative_error.map(|e| (e, r.worker_seconds)));
        Ok(Curve {
            slope: fitted(&rows),
            efficiency: error_and_work.map(|(e, t)| 1.0 / (e * e * t)).filter(|x| x.is_finite()),
            error_target: spec.error_target,
            target_expected_at_seconds: target_at(&rows, &spec),
            prediction_ratios: if row.certified { ratios(&rows) } else { Vec::new() },
            certified: row.certified,
            invalid_samples: invalid,
            rows,
        })
    }

    /// A job's checkpoints.
    pub async fn curve_rows(&self, id: &JobId) -> Result<Vec<CurveRow>> {
        match self.live(id) {
            Some(live) => Ok(live.view().curve),
            None => Ok(self.store.curve(id).await?),
        }
    }
}

/// Slope of log relative error over log worker seconds, over the latest octaves.
pub fn fitted(rows: &[CurveRow]) -> Option<f64> {
    let latest = &rows[rows.len().saturating_sub(OCTAVES)..];
    let points = latest.iter().filter_map(|r| r.relative_error.map(|e| (r.worker_seconds, e)));
    slope(&points.collect::<Vec<_>>())
}

/// Run time at which the job is expected to be certified: that of the first look whose bound is under the target, where the error
/// goes on to fall as it did, and its logarithmic distance to the bound goes as Student's quantile of the look.
pub fn target_at(rows: &[CurveRow], spec: &JobSpec) -> Option<f64> {
    let (target, last) = (spec.error_target?, rows.last()?);
    let (error, upper) = (last.relative_error?, last.relative_error_upper?);
    if upper <= target {
        return last.doubt.is_none().then_some(last.wall_seconds);
    }
    // A curve that does not fall says nothing yet.
    let slope = fitted(rows).filter(|s| (-2.0..=-0.1).contains(s)).unwrap_or(PLAIN);
    let quantile = |look: usize| student_t_upper(level(look as u32), spec.settings.replicates.max(3) - 1);
    let (now, distance) = (quantile(rows.len()), (upper / error).ln());
    (1..LOOKS).find_map(|ahead| {
        let times = 2.0_f64.powi(ahead as i32);
        let expected = error * times.powf(slope) * (distance * quantile(rows.len() + ahead) / now).exp();
        (expected <= target).then_some(last.wall_seconds * times)
    })
}

/// What each checkpoint but the last expected, over what came.
fn ratios(rows: &[CurveRow]) -> Vec<f64> {
    let Some((last, before)) = rows.split_last() else { return Vec::new() };
    let expected = before.iter().filter_map(|row| row.target_expected_at_seconds);
    expected.map(|at| at / last.wall_seconds).filter(|ratio| ratio.is_finite()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(seconds: f64) -> CurveRow {
        CurveRow {
            samples: 1,
            wall_seconds: seconds,
            worker_seconds: seconds,
            rays: 0,
            rms_error: None,
            relative_error: Some(0.1 / seconds.sqrt()),
            relative_error_upper: Some(0.1 / seconds.sqrt()),
            target_expected_at_seconds: Some(2.0 * seconds),
            doubt: None,
        }
    }

    #[test]
    fn halving_the_error_of_plain_monte_carlo_takes_four_times_as_long() {
        assert!((fitted(&[row(1.0), row(2.0), row(4.0)]).unwrap() + 0.5).abs() < 1e-9);
    }

    #[test]
    fn predictions_are_held_against_what_came() {
        assert_eq!(ratios(&[row(1.0), row(2.0), row(4.0)]), [0.5, 1.0]);
        assert!(ratios(&[]).is_empty());
    }
}

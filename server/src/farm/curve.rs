//! Error against run time.

use super::{Farm, error::Result, open::read_spec, spec::JobSpec};
use crate::store::row::JobRow;
use ovtigre_core::film::error::slope;
use ovtigre_proto::{
    curve::{Curve, CurveRow},
    id::JobId,
};

/// Slope of log error over log time of plain Monte Carlo, until a curve says better.
const PLAIN: f64 = -0.5;

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
            target_expected_at_seconds: target_at(&rows, &spec, &row),
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

/// Slope of log relative error over log worker seconds.
pub fn fitted(rows: &[CurveRow]) -> Option<f64> {
    let points = rows.iter().filter_map(|r| r.relative_error.map(|e| (r.worker_seconds, e)));
    slope(&points.collect::<Vec<_>>())
}

/// Run time at which the upper end of the error is expected to be at the target, by the fitted slope.
pub fn target_at(rows: &[CurveRow], spec: &JobSpec, job: &JobRow) -> Option<f64> {
    let (target, last) = (spec.error_target?, rows.last()?);
    let upper = last.relative_error_upper?;
    if job.certified || upper <= target {
        return Some(last.wall_seconds);
    }
    // A curve that does not fall says nothing yet.
    let slope = fitted(rows).filter(|s| (-2.0..=-0.1).contains(s)).unwrap_or(PLAIN);
    Some(last.wall_seconds * (upper / target).powf(-1.0 / slope)).filter(|t| t.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halving_the_error_of_plain_monte_carlo_takes_four_times_as_long() {
        let row = |seconds: f64| CurveRow {
            samples: 1,
            wall_seconds: seconds,
            worker_seconds: seconds,
            rays: 0,
            rms_error: None,
            relative_error: Some(0.1 / seconds.sqrt()),
            relative_error_upper: Some(0.1 / seconds.sqrt()),
        };
        assert!((fitted(&[row(1.0), row(2.0), row(4.0)]).unwrap() + 0.5).abs() < 1e-9);
    }
}

//! What lists of jobs go by that changes while they are rendered.

use super::{Farm, error::Result, spec::JobSpec, status::eta};
use crate::store::{list::Outlook, row::Progress};
use ovtigre_proto::{id::JobId, status::JobState};

impl Farm {
    /// Writes down how far those jobs are that this server appends to, where that has changed, and who works at jobs: one change
    /// for all of them, now and then, so that no commit has to.
    pub(super) async fn tell_outlooks(&self) -> Result<()> {
        let mut changed = Vec::new();
        for live in self.lives().into_iter().filter(|live| live.mandate().is_some()) {
            let view = live.view();
            let stage = (view.progress.batches, view.curve.len());
            if live.outlook() != Some(stage) {
                changed.push((live, view, stage));
            }
        }
        let jobs: Vec<JobId> = changed.iter().map(|(live, ..)| live.id.clone()).collect();
        let run_times = self.store.run_times(&jobs).await?;
        let told = changed.iter().zip(run_times).map(|((live, view, _), seconds)| Outlook {
            job: live.id.clone(),
            part: part(&live.spec, &view.progress, JobState::Running),
            left: seconds.and_then(|seconds| eta(seconds, &view.progress, &live.spec, &view.curve)),
        });
        self.store.look_out(told.collect()).await?;
        for (live, _, stage) in &changed {
            live.set_outlook(*stage);
        }
        Ok(self.store.count_workers().await?)
    }
}

/// The part of what was asked for that is in the picture, 0 to 1: all of it where a job is done before all samples are drawn.
pub(super) fn part(spec: &JobSpec, progress: &Progress, state: JobState) -> f64 {
    match state {
        JobState::Done => 1.0,
        _ => (progress.samples / f64::from(spec.samples_asked().max(1))).min(1.0),
    }
}

//! How far a job is, for who waits for it.

use super::{terminal, words};
use indicatif::{ProgressBar, ProgressStyle};
use ovtigre_proto::status::{JobState, JobStatus};
use std::time::{Duration, Instant};

/// Lines to a file or a pipe come at most this often.
const LINES_APART: Duration = Duration::from_secs(5);
/// Steps of the bar.
const STEPS: u64 = 1000;

/// A bar at a terminal, a line now and then elsewhere; on standard error.
#[derive(Debug)]
pub(crate) struct Progress {
    bar: Option<ProgressBar>,
    last_line: Option<Instant>,
    warned: bool,
}

impl Progress {
    /// Nothing shown yet. Among `other_lines` there is no place for a bar.
    pub(crate) fn new(other_lines: Others) -> Self {
        let bar = (terminal::is_watched() && other_lines == Others::None).then(|| {
            let style = ProgressStyle::with_template("{elapsed:>4} [{bar:24}] {wide_msg}");
            let bar = ProgressBar::new(STEPS);
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> "));
            bar.enable_steady_tick(Duration::from_millis(200));
            bar
        });
        Self { bar, last_line: None, warned: false }
    }

    /// Shows how a job stands.
    pub(crate) fn show(&mut self, status: &JobStatus) {
        if !self.warned {
            self.warned = true;
            self.remark(&format!("method: {}, {}", status.method, status.method_reason));
            for warning in &status.warnings {
                self.remark(&format!("warning: {warning}"));
            }
        }
        if let Some(bar) = &self.bar {
            bar.set_position((fraction(status) * STEPS as f64) as u64);
            bar.set_message(words::list(&parts(status)));
        } else if self.last_line.is_none_or(|at| at.elapsed() >= LINES_APART)
            && status.state != JobState::Queued
        {
            self.last_line = Some(Instant::now());
            terminal::remark(&line(status));
        }
    }

    /// A line that stays.
    pub(crate) fn remark(&self, line: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| terminal::remark(line)),
            None => terminal::remark(line),
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Whether other lines are written to standard error, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Others {
    /// No others.
    None,
    /// A log.
    Log,
}

/// Part of a job that is done: by time where the farm expects an end, else by samples.
fn fraction(status: &JobStatus) -> f64 {
    let done = match status.eta_seconds {
        Some(left) if status.wall_seconds + left > 0.0 => status.wall_seconds / (status.wall_seconds + left),
        _ => status.samples_done / f64::from(status.samples_asked.max(1)),
    };
    if done.is_finite() { done.clamp(0.0, 1.0) } else { 0.0 }
}

/// One line: samples, error, speed, time.
pub(crate) fn line(status: &JobStatus) -> String {
    let mut parts = parts(status);
    parts.insert(parts.len() - 1, words::duration(status.wall_seconds));
    words::list(&parts)
}

/// State, samples, error, speed, time left; some empty.
fn parts(status: &JobStatus) -> Vec<String> {
    let state = match status.state {
        JobState::Running => String::new(),
        other => other.name().to_owned(),
    };
    let left = status.eta_seconds.filter(|_| !status.state.is_over());
    vec![
        state,
        words::samples(status),
        words::error(status),
        words::speed(status),
        left.map(|left| format!("{} left", words::duration(left))).unwrap_or_default(),
    ]
}

//! Who renders what for whom: the names that a line of the log is found by.

use ovtigre_proto::{
    id::{JobId, LeaseId, WorkerId},
    lease::Lease,
    telemetry::{
        span::{Place, Span},
        traces::Traces,
    },
};

/// A lease in this worker's hands.
#[derive(Clone, Debug)]
pub struct Errand {
    /// Whose batch.
    pub job: JobId,
    /// Which, in the words of the farm.
    pub batch: String,
    /// Its lease.
    pub lease: LeaseId,
    /// This worker, as the farm names it.
    pub worker: WorkerId,
}

impl Errand {
    /// Of a lease that was handed to `worker`.
    pub fn new(lease: &Lease, worker: WorkerId) -> Self {
        let batch = match lease.id.batch() {
            Some((_, [region, replicate, block])) => {
                format!("region {region} replicate {replicate} block {block}")
            }
            None => lease.batch.to_string(),
        };
        Self { job: lease.job.clone(), batch, lease: lease.id.clone(), worker }
    }

    /// The span of the whole errand.
    pub fn span(&self, traces: &Traces) -> Span {
        self.noted(traces.span("lease", Place::Lease(&self.job, &self.lease)))
    }

    /// The span of a part of it.
    pub fn part(&self, traces: &Traces, name: &'static str) -> Span {
        self.noted(traces.span(name, Place::OfLease(&self.job, &self.lease)))
    }

    fn noted(&self, span: Span) -> Span {
        if !span.is_told() {
            return span;
        }
        span.note("ovtigre.batch", self.batch.clone()).note("ovtigre.worker", self.worker.to_string())
    }
}

/// A line of the log about an errand.
macro_rules! note {
    ($level:ident, $errand:expr, $($rest:tt)+) => {
        tracing::$level!(
            job = %$errand.job,
            batch = %$errand.batch,
            lease = %$errand.lease,
            worker = %$errand.worker,
            $($rest)+
        )
    };
}
pub(crate) use note;

//! Something that took some time.

use super::traces::{Traces, span_of_job, span_of_lease, trace_of};
use crate::id::{JobId, LeaseId};
use opentelemetry::{
    KeyValue, Value,
    trace::{SpanContext, SpanId, SpanKind, Status, TraceFlags, TraceState},
};
use opentelemetry_sdk::trace::{SpanData, SpanEvents, SpanLinks};
use std::time::SystemTime;

/// Whose span it is, and under which other it hangs.
#[derive(Clone, Copy, Debug)]
pub enum Place<'a> {
    /// A job's whole life: the root of its trace.
    Job(&'a JobId),
    /// What is done for a job.
    OfJob(&'a JobId),
    /// A lease's whole life, as its worker sees it.
    Lease(&'a JobId, &'a LeaseId),
    /// What is done for a lease.
    OfLease(&'a JobId, &'a LeaseId),
}

impl Place<'_> {
    fn job(&self) -> &JobId {
        match self {
            Self::Job(job) | Self::OfJob(job) | Self::Lease(job, _) | Self::OfLease(job, _) => job,
        }
    }

    fn lease(&self) -> Option<&LeaseId> {
        match self {
            Self::Lease(_, lease) | Self::OfLease(_, lease) => Some(lease),
            Self::Job(_) | Self::OfJob(_) => None,
        }
    }
}

/// Something that took some time: it is told when it is dropped. Nothing where there is no collector.
#[derive(Debug, Default)]
pub struct Span(Option<Box<Open>>);

#[derive(Debug)]
struct Open {
    traces: Traces,
    data: SpanData,
}

impl Span {
    pub(super) fn begin(traces: Traces, name: &'static str, place: Place<'_>) -> Self {
        let (job, lease) = (place.job(), place.lease());
        let (number, parent) = match place {
            Place::Job(job) => (span_of_job(job), SpanId::INVALID),
            Place::OfJob(job) => (traces.number(name), span_of_job(job)),
            Place::Lease(job, lease) => (span_of_lease(lease), span_of_job(job)),
            Place::OfLease(_, lease) => (traces.number(name), span_of_lease(lease)),
        };
        let mut attributes = vec![KeyValue::new("ovtigre.job", job.to_string())];
        attributes.extend(lease.map(|lease| KeyValue::new("ovtigre.lease", lease.to_string())));
        let now = SystemTime::now();
        let data = SpanData {
            span_context: SpanContext::new(
                trace_of(job),
                number,
                TraceFlags::SAMPLED,
                false,
                TraceState::NONE,
            ),
            parent_span_id: parent,
            parent_span_is_remote: parent != SpanId::INVALID,
            span_kind: SpanKind::Internal,
            name: name.into(),
            start_time: now,
            end_time: now,
            attributes,
            dropped_attributes_count: 0,
            events: SpanEvents::default(),
            links: SpanLinks::default(),
            status: Status::Unset,
            instrumentation_scope: traces.scope(),
        };
        Self(Some(Box::new(Open { traces, data })))
    }

    /// Whether there is somebody to be told.
    pub fn is_told(&self) -> bool {
        self.0.is_some()
    }

    /// With a further attribute; `ovtigre.batch` and `ovtigre.worker` are names that others use, too.
    #[must_use]
    pub fn note(mut self, key: &'static str, value: impl Into<Value>) -> Self {
        self.add(key, value);
        self
    }

    /// It began earlier.
    #[must_use]
    pub fn since(mut self, start: SystemTime) -> Self {
        if let Some(open) = &mut self.0 {
            open.data.start_time = start;
        }
        self
    }

    /// Adds an attribute.
    pub fn add(&mut self, key: &'static str, value: impl Into<Value>) {
        if let Some(open) = &mut self.0 {
            open.data.attributes.push(KeyValue::new(key, value));
        }
    }

    /// It ended badly.
    pub fn fail(&mut self, reason: &str) {
        if let Some(open) = &mut self.0 {
            open.data.status = Status::error(reason.to_owned());
        }
    }
}

impl Drop for Span {
    fn drop(&mut self) {
        if let Some(open) = self.0.take() {
            let Open { traces, mut data } = *open;
            data.end_time = SystemTime::now().max(data.start_time);
            traces.take(data);
        }
    }
}

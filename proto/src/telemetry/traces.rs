//! Where spans go: to a collector, or nowhere.

use super::{
    post::Post,
    span::{Place, Span},
};
use crate::id::{JobId, LeaseId};
use opentelemetry::{
    InstrumentationScope, KeyValue,
    trace::{SpanId, TraceId},
};
use opentelemetry_otlp::{SpanExporter, WithHttpConfig as _};
use opentelemetry_sdk::{
    Resource,
    trace::{BatchSpanProcessor, SpanData, SpanProcessor as _},
};
use std::{
    env,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

/// Time for the last spans of a program that ends.
const FAREWELL: Duration = Duration::from_secs(3);
/// What is spoken.
const PROTOCOL: &str = "http/protobuf";

/// Why no spans can be sent.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TracesError {
    /// Another protocol is wanted.
    #[error("{variable} is '{wanted}': spans are sent by {PROTOCOL} only; collectors take it on port 4318")]
    Protocol {
        /// Which variable says so.
        variable: &'static str,
        /// What it says.
        wanted: String,
    },
    /// The variables say nothing that can be used.
    #[error("spans cannot be sent: {0}")]
    Configuration(String),
}

/// Where spans of jobs go. Without a collector it is nothing, and costs nothing.
///
/// Nobody hands contexts on: a job's trace and the spans that others hang under have numbers that are
/// made of the names of job and lease, so that any server and any worker knows them, also after a restart.
#[derive(Clone, Debug, Default)]
pub struct Traces(Option<Arc<Collected>>);

#[derive(Debug)]
struct Collected {
    processor: BatchSpanProcessor,
    scope: InstrumentationScope,
    made: AtomicU64,
}

impl Traces {
    /// As the variables of the OpenTelemetry specification say: to the collector at
    /// `OTEL_EXPORTER_OTLP_TRACES_ENDPOINT` or `OTEL_EXPORTER_OTLP_ENDPOINT`, nowhere where neither is set.
    /// `service` is told where `OTEL_SERVICE_NAME` is not set. To be called on a runtime with more than one
    /// thread; one thread more sends the spans.
    pub fn from_environment(service: &'static str) -> Result<Self, TracesError> {
        let set = |name: &str| env::var(name).ok().filter(|value| !value.is_empty());
        let endpoints = ["OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", "OTEL_EXPORTER_OTLP_ENDPOINT"];
        let off = set("OTEL_SDK_DISABLED").is_some_and(|value| value.eq_ignore_ascii_case("true"))
            || set("OTEL_TRACES_EXPORTER").is_some_and(|value| value == "none");
        if off || !endpoints.into_iter().any(|name| set(name).is_some()) {
            return Ok(Self::default());
        }
        for variable in ["OTEL_EXPORTER_OTLP_TRACES_PROTOCOL", "OTEL_EXPORTER_OTLP_PROTOCOL"] {
            if let Some(wanted) = set(variable).filter(|wanted| wanted != PROTOCOL) {
                return Err(TracesError::Protocol { variable, wanted });
            }
        }
        let unusable = |error: &dyn std::error::Error| TracesError::Configuration(error.to_string());
        let post = Post::new().map_err(|error| unusable(&error))?;
        let exporter = SpanExporter::builder().with_http().with_http_client(post).build();
        let mut processor = BatchSpanProcessor::builder(exporter.map_err(|error| unusable(&error))?).build();
        let named = set("OTEL_SERVICE_NAME").is_some()
            || set("OTEL_RESOURCE_ATTRIBUTES").is_some_and(|list| list.contains("service.name="));
        let resource =
            Resource::builder().with_attribute(KeyValue::new("service.version", env!("CARGO_PKG_VERSION")));
        let resource = if named { resource } else { resource.with_service_name(service) };
        processor.set_resource(&resource.build());
        let scope = InstrumentationScope::builder("ovtigre").with_version(env!("CARGO_PKG_VERSION")).build();
        Ok(Self(Some(Arc::new(Collected { processor, scope, made: AtomicU64::new(0) }))))
    }

    /// A span that begins now, and ends when it is dropped.
    pub fn span(&self, name: &'static str, place: Place<'_>) -> Span {
        match &self.0 {
            Some(_) => Span::begin(self.clone(), name, place),
            None => Span::default(),
        }
    }

    /// Sends what is left. Spans that end later go nowhere.
    pub async fn stop(&self) {
        if let Some(collected) = self.0.clone() {
            let last =
                tokio::task::spawn_blocking(move || collected.processor.shutdown_with_timeout(FAREWELL));
            if let Ok(Err(error)) = last.await {
                tracing::warn!(%error, "the last spans were not sent");
            }
        }
    }

    pub(super) fn take(&self, span: SpanData) {
        if let Some(collected) = &self.0 {
            collected.processor.on_end(span);
        }
    }

    pub(super) fn scope(&self) -> InstrumentationScope {
        self.0.as_ref().map(|collected| collected.scope.clone()).unwrap_or_default()
    }

    /// A number that no other span has.
    pub(super) fn number(&self, name: &str) -> SpanId {
        let made = self.0.as_ref().map_or(0, |collected| collected.made.fetch_add(1, Ordering::Relaxed));
        let here = format!("{name} {} {made} {:?}", std::process::id(), std::time::SystemTime::now());
        SpanId::from_bytes(first(&here))
    }
}

/// The number of a job's trace. It begins with the job's own name, where that is of hexadecimal digits.
pub fn trace_of(job: &JobId) -> TraceId {
    let hash = blake3::hash(job.as_str().as_bytes()).to_hex();
    let hex = job.as_str().bytes().all(|b| b.is_ascii_hexdigit());
    let digits = if hex { format!("{job}{hash}") } else { hash.to_string() };
    TraceId::from_hex(&digits[..32]).expect("32 hexadecimal digits are a number")
}

/// The number of the span that is a job's whole life.
pub fn span_of_job(job: &JobId) -> SpanId {
    SpanId::from_bytes(first(&format!("job {job}")))
}

/// The number of the span that is a lease's whole life.
pub fn span_of_lease(lease: &LeaseId) -> SpanId {
    SpanId::from_bytes(first(&format!("lease {lease}")))
}

fn first(text: &str) -> [u8; 8] {
    let hash = blake3::hash(text.as_bytes());
    *hash.as_bytes().first_chunk().expect("a hash has more bytes")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trace_begins_with_its_jobs_name_and_numbers_are_the_same_everywhere() {
        let [job, other]: [JobId; 2] =
            ["0123456789ab", "a_job-of-somebody"].map(|name| name.parse().unwrap());
        assert!(trace_of(&job).to_string().starts_with("0123456789ab"));
        assert_ne!(trace_of(&job), trace_of(&other));
        assert_ne!(span_of_job(&job), span_of_lease(&job.as_str().parse().unwrap()));
    }

    #[test]
    fn without_a_collector_there_is_nothing() {
        let traces = Traces::default();
        let job = "0123456789ab".parse().unwrap();
        let span = traces.span("job", Place::Job(&job)).note("ovtigre.scene", "x");
        assert_eq!(size_of_val(&span), size_of::<usize>());
        assert!(!span.is_told());
    }
}

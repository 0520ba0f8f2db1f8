//! A collector of OpenTelemetry spans, as a farm and its workers see one.

use axum::{Router, body::Bytes, extract::State, http::StatusCode, routing::post};
use opentelemetry_proto::tonic::{
    collector::trace::v1::ExportTraceServiceRequest,
    common::v1::{KeyValue, any_value::Value},
    trace::v1::Span,
};
use prost::Message as _;
use std::{
    collections::BTreeMap,
    fmt::Write as _,
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant},
};
use tokio::{net::TcpListener, runtime::Runtime};

/// Longest wait for spans.
const PATIENCE: Duration = Duration::from_mins(1);

/// A span that came.
#[derive(Clone, Debug)]
pub struct Told {
    /// Who told it.
    pub service: String,
    /// What it is of.
    pub name: String,
    /// Number of its trace, in hexadecimal digits.
    pub trace: String,
    /// Its number.
    pub number: String,
    /// Number of the span that it hangs under; empty for a root.
    pub parent: String,
    /// When it began and ended, in nanoseconds since 1970.
    pub time: [u64; 2],
    /// Its attributes that are texts.
    pub says: BTreeMap<String, String>,
}

/// A collector that listens on a free port of this machine.
#[derive(Debug)]
pub struct Collector {
    /// Its address, for `OTEL_EXPORTER_OTLP_ENDPOINT`.
    pub url: String,
    told: Arc<Mutex<Vec<Told>>>,
    _runtime: Runtime,
}

impl Collector {
    /// Starts one.
    pub fn start() -> Self {
        let runtime = Runtime::new().expect("threads");
        let told: Arc<Mutex<Vec<Told>>> = Arc::default();
        let listener = runtime.block_on(TcpListener::bind("127.0.0.1:0")).expect("a port");
        let url = format!("http://{}", listener.local_addr().expect("an address"));
        let doors = Router::new().route("/v1/traces", post(take)).with_state(told.clone());
        runtime.spawn(axum::serve(listener, doors).into_future());
        Self { url, told, _runtime: runtime }
    }

    /// What came of one trace, once `enough` says so.
    pub fn wait(&self, trace: &str, enough: impl Fn(&[Told]) -> bool) -> Vec<Told> {
        let start = Instant::now();
        loop {
            let mut all = self.told.lock().unwrap_or_else(PoisonError::into_inner).clone();
            all.retain(|span| span.trace.starts_with(trace));
            if enough(&all) {
                return all;
            }
            assert!(start.elapsed() < PATIENCE, "of {trace} came only {all:#?}");
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

async fn take(State(told): State<Arc<Mutex<Vec<Told>>>>, body: Bytes) -> StatusCode {
    let Ok(request) = ExportTraceServiceRequest::decode(body) else { return StatusCode::BAD_REQUEST };
    let mut told = told.lock().unwrap_or_else(PoisonError::into_inner);
    for group in request.resource_spans {
        let about = texts(group.resource.map(|resource| resource.attributes).unwrap_or_default());
        let service = about.get("service.name").cloned().unwrap_or_default();
        told.extend(
            group.scope_spans.into_iter().flat_map(|scope| scope.spans).map(|span| read(&service, span)),
        );
    }
    StatusCode::OK
}

fn read(service: &str, span: Span) -> Told {
    Told {
        service: service.to_owned(),
        name: span.name,
        trace: hex(&span.trace_id),
        number: hex(&span.span_id),
        parent: hex(&span.parent_span_id),
        time: [span.start_time_unix_nano, span.end_time_unix_nano],
        says: texts(span.attributes),
    }
}

fn texts(attributes: Vec<KeyValue>) -> BTreeMap<String, String> {
    let text = |value| if let Value::StringValue(text) = value { Some(text) } else { None };
    (attributes.into_iter()).filter_map(|a| Some((a.key, text(a.value?.value?)?))).collect()
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        write!(text, "{byte:02x}").expect("writing to a string cannot fail");
        text
    })
}

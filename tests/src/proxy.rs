//! A line that loses, repeats, delays and mixes up what goes over it, between a caller and a server of HTTP.

use axum::{
    Router,
    body::{Body, Bytes, to_bytes},
    extract::{Request, State},
    http::{HeaderMap, Method, StatusCode, Uri, header},
    response::Response,
};
use std::{
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

/// Longest body.
const BODY_MAX: usize = 64 << 20;

/// What becomes of a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// It is lost before it gets there.
    Lost,
    /// It gets there, and the answer is lost.
    AnswerLost,
    /// It gets there twice; the caller hears the second answer.
    Twice,
    /// It gets there, and once more when others have passed it.
    Again,
    /// It is held up, so that others pass it.
    Late,
    /// Somebody on the way says 503.
    Refused,
}

impl Fault {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Lost, Self::AnswerLost, Self::Twice, Self::Again, Self::Late, Self::Refused];
}

/// Numbers that follow from a seed: Steele, Lea & Flood, Fast splittable pseudorandom number generators, 2014.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// From a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next number.
    pub fn draw(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    /// One of 0 to `n` − 1.
    pub fn below(&mut self, n: usize) -> usize {
        (self.draw() % n as u64) as usize
    }

    /// True with that probability.
    pub fn happens(&mut self, probability: f64) -> bool {
        (self.draw() >> 11) as f64 / ((1_u64 << 53) as f64) < probability
    }
}

/// A line to a server.
#[derive(Debug)]
pub struct Proxy {
    /// Its address.
    pub url: String,
    line: Arc<Line>,
    /// Ends with this value.
    _runtime: tokio::runtime::Runtime,
}

#[derive(Debug)]
struct Line {
    to: String,
    client: reqwest::Client,
    share: f64,
    random: Mutex<Random>,
    calls: AtomicU64,
    faults: [AtomicU64; Fault::ALL.len()],
}

impl Proxy {
    /// To the server at `to`; the given share of calls meets a fault.
    pub fn start(to: &str, share: f64, seed: u64) -> Self {
        ovtigre_proto::client::tls::provide();
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build();
        let runtime = runtime.expect("threads");
        let line = Arc::new(Line {
            to: to.trim_end_matches('/').to_owned(),
            client: reqwest::Client::builder().no_proxy().build().expect("a client"),
            share,
            random: Mutex::new(Random::new(seed)),
            calls: AtomicU64::new(0),
            faults: Default::default(),
        });
        let router = Router::new().fallback(pass).with_state(Arc::clone(&line));
        let listener = runtime.block_on(tokio::net::TcpListener::bind("127.0.0.1:0")).expect("a loopback");
        let url = format!("http://{}", listener.local_addr().expect("it is bound"));
        runtime.spawn(axum::serve(listener, router).into_future());
        Self { url, line, _runtime: runtime }
    }

    /// Calls that went over it.
    pub fn calls(&self) -> u64 {
        self.line.calls.load(Ordering::Relaxed)
    }

    /// How many met which fault.
    pub fn faults(&self) -> [(Fault, u64); Fault::ALL.len()] {
        Fault::ALL.map(|fault| (fault, self.line.faults[fault as usize].load(Ordering::Relaxed)))
    }
}

/// A call that can be made more than once.
#[derive(Clone, Debug)]
struct Call {
    method: Method,
    uri: Uri,
    headers: HeaderMap,
    body: Bytes,
}

impl Line {
    fn draw(&self) -> (Option<Fault>, Duration) {
        let mut random = self.random.lock().unwrap_or_else(PoisonError::into_inner);
        let fault = random.happens(self.share).then(|| Fault::ALL[random.below(Fault::ALL.len())]);
        (fault, Duration::from_millis(random.draw() % 700))
    }

    async fn forward(&self, call: &Call) -> Response {
        let path = call.uri.path_and_query().map_or("/", |path| path.as_str());
        let mut headers = call.headers.clone();
        headers.remove(header::CONNECTION);
        let sent = self.client.request(call.method.clone(), format!("{}{path}", self.to));
        let Ok(answer) = sent.headers(headers).body(call.body.clone()).send().await else { return broken() };
        let (status, mut headers) = (answer.status(), answer.headers().clone());
        let Ok(body) = answer.bytes().await else { return broken() };
        headers.remove(header::TRANSFER_ENCODING);
        let mut response = Response::new(Body::from(body));
        (*response.status_mut(), *response.headers_mut()) = (status, headers);
        response
    }
}

/// Ends the connection without an answer.
fn broken() -> Response {
    std::panic::resume_unwind(Box::new("the line is broken"))
}

async fn pass(State(line): State<Arc<Line>>, request: Request) -> Response {
    let (parts, body) = request.into_parts();
    let Ok(body) = to_bytes(body, BODY_MAX).await else { return broken() };
    let call = Call { method: parts.method, uri: parts.uri, headers: parts.headers, body };
    line.calls.fetch_add(1, Ordering::Relaxed);
    let (fault, time) = line.draw();
    if let Some(fault) = fault {
        line.faults[fault as usize].fetch_add(1, Ordering::Relaxed);
    }
    match fault {
        None => line.forward(&call).await,
        Some(Fault::Lost) => broken(),
        Some(Fault::AnswerLost) => {
            line.forward(&call).await;
            broken()
        }
        Some(Fault::Twice) => {
            line.forward(&call).await;
            line.forward(&call).await
        }
        Some(Fault::Again) => {
            let (later, again) = (Arc::clone(&line), call.clone());
            tokio::spawn(async move {
                tokio::time::sleep(time).await;
                later.forward(&again).await;
            });
            line.forward(&call).await
        }
        Some(Fault::Late) => {
            tokio::time::sleep(time).await;
            line.forward(&call).await
        }
        Some(Fault::Refused) => {
            let mut response = Response::new(Body::empty());
            *response.status_mut() = StatusCode::SERVICE_UNAVAILABLE;
            response
        }
    }
}

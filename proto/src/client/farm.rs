//! A connection to a farm, and the trying again.

use super::{
    address::Address,
    answer::{Answer, problem},
    backoff::Backoff,
    call::{Call, Payload, Repeat},
    error::{ClientError, innermost},
};
use reqwest::{Response, StatusCode, header::RETRY_AFTER};
use std::{
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

/// Tries where nothing else is said: about three seconds.
const ATTEMPTS: u32 = 6;
/// The first wait between two tries.
pub(super) const FIRST_WAIT: Duration = Duration::from_millis(100);
/// The longest wait between two tries.
pub(super) const LONGEST_WAIT: Duration = Duration::from_secs(5);
/// A farm that says "later than this" is not waited for.
const RETRY_AFTER_MAX: Duration = Duration::from_secs(60);

/// A client of one farm; cheap to clone.
#[derive(Clone, Debug)]
pub struct Client {
    http: reqwest::Client,
    address: Address,
    attempts: u32,
    seed: Arc<AtomicU64>,
}

impl Client {
    /// For the farm at `address`. `seed` spreads the waits of many clients.
    pub fn new(address: &str, seed: u64) -> Result<Self, ClientError> {
        let address = Address::parse(address)?;
        let mut builder = reqwest::Client::builder()
            .connect_timeout(Duration::from_secs(5))
            .pool_idle_timeout(Duration::from_secs(30))
            .tcp_nodelay(true)
            .user_agent(concat!("ovtigre/", env!("CARGO_PKG_VERSION")));
        if address.is_loopback() {
            builder = builder.no_proxy();
        }
        let wrong = |e| ClientError::Address { text: address.to_string(), reason: innermost(&e) };
        let http = builder.build().map_err(wrong)?;
        Ok(Self { http, address, attempts: ATTEMPTS, seed: Arc::new(AtomicU64::new(seed)) })
    }

    /// Tries each call `attempts` times at most.
    #[must_use]
    pub fn with_attempts(mut self, attempts: u32) -> Self {
        self.attempts = attempts.max(1);
        self
    }

    /// Where the farm is.
    pub fn address(&self) -> &Address {
        &self.address
    }

    /// A wait that starts short, its own for each use.
    pub fn backoff(&self) -> Backoff {
        Backoff::new(FIRST_WAIT, LONGEST_WAIT, self.seed.fetch_add(1, Ordering::Relaxed))
    }

    /// Makes a call, again where that may help. An answer that is no success is an error.
    pub async fn send(&self, call: &Call) -> Result<Answer, ClientError> {
        let mut backoff = self.backoff();
        let attempts = call.attempts.unwrap_or(self.attempts);
        let mut attempt = 1;
        loop {
            let failure = match self.try_once(call).await {
                Ok(answer) => return Ok(answer),
                Err(failure) => failure,
            };
            if attempt >= attempts || !failure.again {
                return Err(failure.error);
            }
            attempt += 1;
            let wait = failure.after.unwrap_or_default().max(backoff.delay());
            tokio::time::sleep(wait).await;
        }
    }

    async fn try_once(&self, call: &Call) -> Result<Answer, Failure> {
        let name = format!("{} {}", call.method, self.address.join(&call.route));
        let mut request = self.http.request(call.method.clone(), self.address.join(&call.route));
        request = request.headers(call.headers.clone()).query(&call.query);
        request = match &call.payload {
            Payload::Empty => request,
            Payload::Bytes(bytes) => request.body(bytes.clone()),
            Payload::File { path, length } => {
                let file = tokio::fs::File::open(path).await.map_err(|e| Failure {
                    error: ClientError::File { path: path.clone(), reason: e.to_string() },
                    again: false,
                    after: None,
                })?;
                request.header(reqwest::header::CONTENT_LENGTH, *length).body(file)
            }
        };
        match tokio::time::timeout(call.patience(), request.send()).await {
            Err(_) => Err(self.unreachable("no answer in time".to_owned(), call.repeat == Repeat::Harmless)),
            Ok(Err(e)) => {
                Err(self.unreachable(innermost(&e), e.is_connect() || call.repeat == Repeat::Harmless))
            }
            Ok(Ok(response)) if is_success(response.status()) => {
                Ok(Answer { response, name, farm: self.address.to_string() })
            }
            Ok(Ok(response)) => Err(refusal(response, name, call.repeat).await),
        }
    }

    fn unreachable(&self, reason: String, again: bool) -> Failure {
        let error = ClientError::Unreachable { farm: self.address.to_string(), reason };
        Failure { error, again, after: None }
    }
}

/// A try that brought nothing.
struct Failure {
    error: ClientError,
    again: bool,
    after: Option<Duration>,
}

fn is_success(status: StatusCode) -> bool {
    status.is_success() || status == StatusCode::NOT_MODIFIED
}

async fn refusal(response: Response, name: String, repeat: Repeat) -> Failure {
    let status = response.status().as_u16();
    let after = (response.headers().get(RETRY_AFTER))
        .and_then(|text| text.to_str().ok()?.trim().parse().ok())
        .map(Duration::from_secs);
    // A farm that is too busy, or not ready, did not act; a gateway cannot know.
    let may_pass = match status {
        429 | 503 => true,
        502 | 504 => repeat == Repeat::Harmless,
        _ => false,
    };
    let again = may_pass && after.is_none_or(|after| after <= RETRY_AFTER_MAX);
    Failure { error: problem(response, name).await, again, after }
}

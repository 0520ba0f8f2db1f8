//! A connection to a farm, and the trying again.

use super::{
    address::Address,
    answer::{Answer, problem},
    backoff::Backoff,
    call::{Call, Payload, Repeat},
    error::{ClientError, innermost},
    tls,
};
use reqwest::{
    Response, StatusCode,
    header::{AUTHORIZATION, HeaderValue, RETRY_AFTER},
};
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
const RETRY_AFTER_MAX: Duration = Duration::from_mins(1);

/// A place that the farm named, and that does not answer for so long, is not used.
const ELSEWHERE: Duration = Duration::from_secs(3);

/// A client of one farm; cheap to clone.
#[derive(Clone, Debug)]
pub struct Client {
    http: reqwest::Client,
    /// Without anything that is only the farm's business.
    elsewhere: reqwest::Client,
    address: Address,
    attempts: u32,
    seed: Arc<AtomicU64>,
    token: Option<HeaderValue>,
}

impl Client {
    /// For the farm at `address`. `seed` spreads the waits of many clients.
    pub fn new(address: &str, seed: u64) -> Result<Self, ClientError> {
        let address = Address::parse(address)?;
        let near = |builder: reqwest::ClientBuilder| {
            if address.is_loopback() { builder.no_proxy() } else { builder }
        };
        let wrong = |e| ClientError::Address { text: address.to_string(), reason: innermost(&e) };
        let http = tls::client(|| {
            let builder = reqwest::Client::builder().connect_timeout(Duration::from_secs(5));
            let builder = builder.pool_idle_timeout(Duration::from_secs(30)).tcp_nodelay(true);
            near(builder.user_agent(concat!("ovtigre/", env!("CARGO_PKG_VERSION"))))
        });
        let elsewhere = tls::client(|| near(reqwest::Client::builder().connect_timeout(ELSEWHERE)));
        let (http, elsewhere) = (http.map_err(wrong)?, elsewhere.map_err(wrong)?);
        Ok(Self {
            http,
            elsewhere,
            address,
            attempts: ATTEMPTS,
            seed: Arc::new(AtomicU64::new(seed)),
            token: None,
        })
    }

    /// Puts bytes where the farm said, once: `patience` is how long that may take.
    pub async fn put_elsewhere(
        &self,
        url: &str,
        bytes: bytes::Bytes,
        patience: Duration,
    ) -> Result<(), ClientError> {
        let unreachable = |reason| ClientError::Unreachable { farm: host_of(url), reason };
        let sent = self.elsewhere.put(url).timeout(patience).body(bytes).send().await;
        let answer = sent.map_err(|e| unreachable(innermost(&e.without_url())))?;
        let status = answer.status();
        if status.is_success() { Ok(()) } else { Err(unreachable(format!("it answers {status}"))) }
    }

    /// Tries each call `attempts` times at most.
    #[must_use]
    pub fn with_attempts(mut self, attempts: u32) -> Self {
        self.attempts = attempts.max(1);
        self
    }

    /// Shows `token` with each call.
    #[must_use]
    pub fn with_token(mut self, token: Option<&str>) -> Self {
        let header = token.and_then(|token| HeaderValue::from_str(&format!("Bearer {}", token.trim())).ok());
        self.token = header.map(|mut header| {
            header.set_sensitive(true);
            header
        });
        self
    }

    /// Where the farm is.
    pub fn address(&self) -> &Address {
        &self.address
    }

    /// An error where the farm's address names a machine that nobody knows: no patience helps then.
    pub async fn resolve(&self) -> Result<(), ClientError> {
        let (host, port) = self.address.host_and_port();
        let found = tokio::net::lookup_host((host.as_str(), port)).await.map(|mut found| found.next());
        let reason = match found {
            Ok(Some(_)) => return Ok(()),
            Ok(None) => "its name leads nowhere".to_owned(),
            Err(error) => error.to_string(),
        };
        Err(ClientError::Address { text: self.address.to_string(), reason })
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
        if let Some(token) = &self.token {
            request = request.header(AUTHORIZATION, token.clone());
        }
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
            Err(_) => Err(self.unreachable("no answer in time".to_owned(), false)),
            Ok(Err(e)) if speaks_otherwise(&e) => {
                let error = ClientError::Unexpected { call: name, status: None, reason: innermost(&e) };
                Err(Failure { error, again: false, after: None })
            }
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

/// Whether somebody answered who does not speak HTTP, or encrypts where this side does not, or the other way round, or
/// whom this side does not believe: no patience helps then.
fn speaks_otherwise(error: &reqwest::Error) -> bool {
    let mut cause: Option<&(dyn std::error::Error + 'static)> = Some(error);
    while let Some(inner) = cause {
        if let Some(tls) = inner.downcast_ref::<rustls::Error>() {
            return matches!(tls, rustls::Error::InvalidMessage(_) | rustls::Error::InvalidCertificate(_));
        }
        // The error of the HTTP library has no kinds that can be asked for.
        if inner.to_string().starts_with("invalid HTTP") {
            return true;
        }
        // Errors of encryption are within errors of reading.
        let within = inner.downcast_ref::<std::io::Error>().and_then(|error| error.get_ref());
        cause = match within {
            Some(within) => Some(within),
            None => inner.source(),
        };
    }
    false
}

/// The part of an address that may be shown: what follows lets anybody write there.
fn host_of(url: &str) -> String {
    url.split('?').next().unwrap_or_default().to_owned()
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

#[cfg(test)]
mod tests {
    use super::{super::mock::serve, *};
    use crate::problem;
    use axum::{Router, http::StatusCode, response::IntoResponse, routing::any};
    use reqwest::Method;
    use std::time::Instant;

    /// A farm that answers its n-th call with the n-th of `answers`, and then with success.
    async fn farm(answers: &'static [(u16, &'static str)]) -> (Client, Arc<AtomicU64>) {
        let calls = Arc::new(AtomicU64::new(0));
        let counted = calls.clone();
        let answer = move || {
            let n = counted.fetch_add(1, Ordering::SeqCst) as usize;
            async move {
                let (status, retry_after) = answers.get(n).copied().unwrap_or((200, ""));
                let mut response = (StatusCode::from_u16(status).unwrap(), "{}").into_response();
                if !retry_after.is_empty() {
                    response.headers_mut().insert("retry-after", retry_after.parse().unwrap());
                }
                response
            }
        };
        (serve(Router::new().fallback(any(answer))).await, calls)
    }

    #[tokio::test]
    async fn what_may_pass_is_tried_again_and_what_counts_is_not() {
        let get = Call::new(Method::GET, "/");
        let post = Call::new(Method::POST, "/");
        for (call, answers, succeeds, calls_made) in [
            (&get, &[(503, ""), (502, ""), (504, "")][..], true, 4),
            (&get, &[(500, "")], false, 1),
            (&get, &[(404, "")], false, 1),
            (&post, &[(502, "")], false, 1),
            (&post, &[(503, ""), (429, "")], true, 3),
            (&get, &[(503, "3600")], false, 1),
        ] {
            let (client, calls) = farm(answers.to_vec().leak()).await;
            assert_eq!(client.send(call).await.is_ok(), succeeds, "{answers:?}");
            assert_eq!(calls.load(Ordering::SeqCst), calls_made, "{answers:?}");
        }
    }

    #[tokio::test]
    async fn a_farm_is_given_the_time_it_asks_for() {
        let (client, _) = farm(&[(429, "1")]).await;
        let start = Instant::now();
        client.send(&Call::new(Method::POST, "/")).await.unwrap();
        assert!(start.elapsed() >= Duration::from_secs(1));
    }

    #[tokio::test]
    async fn nobody_there_is_said_so() {
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        drop(listener);
        let client = Client::new(&address.to_string(), 1).unwrap().with_attempts(2);
        let error = client.send(&Call::new(Method::POST, "/")).await.unwrap_err();
        assert!(matches!(error, ClientError::Unreachable { .. }) && error.may_pass(), "{error}");
    }

    #[tokio::test]
    async fn a_broken_connection_is_tried_again_only_where_that_is_harmless() {
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let client = Client::new(&listener.local_addr().unwrap().to_string(), 1).unwrap().with_attempts(3);
        let connections = Arc::new(AtomicU64::new(0));
        let counted = connections.clone();
        tokio::spawn(async move {
            while let Ok((socket, _)) = listener.accept().await {
                counted.fetch_add(1, Ordering::SeqCst);
                socket.readable().await.unwrap();
            }
        });
        assert!(client.send(&Call::new(Method::POST, "/")).await.is_err());
        assert_eq!(connections.swap(0, Ordering::SeqCst), 1);
        assert!(client.send(&Call::new(Method::GET, "/")).await.is_err());
        assert_eq!(connections.load(Ordering::SeqCst), 3);
    }

    #[tokio::test]
    async fn a_problem_document_is_a_typed_error() {
        let document = r#"{"type":"/problems/invalid-job","title":"x","status":422,"detail":"samples is 0"}"#;
        let answer = move || async move {
            (StatusCode::UNPROCESSABLE_ENTITY, [("content-type", problem::MEDIA_TYPE)], document)
        };
        let client = serve(Router::new().fallback(any(answer))).await;
        let error = client.send(&Call::new(Method::GET, "/")).await.unwrap_err();
        assert_eq!((error.status(), error.to_string().as_str()), (Some(422), "samples is 0"));
    }
}

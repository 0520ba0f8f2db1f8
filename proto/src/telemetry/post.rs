//! The way to a collector: HTTP by the client that everything here uses.

use crate::client::tls;
use async_trait::async_trait;
use opentelemetry_http::{Bytes, HttpClient, HttpError, Request, Response};
use std::time::Duration;
use tokio::runtime::Handle;

/// Longest wait for a collector.
const PATIENCE: Duration = Duration::from_secs(10);
/// Longest answer that is read; what a collector says is short.
const ANSWER_MAX: usize = 1 << 20;

/// Posts spans. They come from a thread that knows no runtime: calls are made on this one's.
#[derive(Debug)]
pub(super) struct Post {
    client: reqwest::Client,
    runtime: Handle,
}

impl Post {
    /// On the runtime of the caller.
    ///
    /// # Panics
    ///
    /// Outside a runtime.
    pub(super) fn new() -> Result<Self, reqwest::Error> {
        let client = tls::client(|| {
            let client =
                reqwest::Client::builder().timeout(PATIENCE).redirect(reqwest::redirect::Policy::none());
            client.user_agent(concat!("ovtigre/", env!("CARGO_PKG_VERSION")))
        })?;
        Ok(Self { client, runtime: Handle::current() })
    }
}

#[async_trait]
impl HttpClient for Post {
    async fn send_bytes(&self, request: Request<Bytes>) -> Result<Response<Bytes>, HttpError> {
        let (client, request) = (self.client.clone(), reqwest::Request::try_from(request)?);
        let call = async move {
            let mut answer = client.execute(request).await?;
            let mut response = Response::builder().status(answer.status());
            if let Some(headers) = response.headers_mut() {
                headers.extend(answer.headers().clone());
            }
            let mut body = Vec::new();
            while let Some(piece) = answer.chunk().await? {
                if body.len() + piece.len() > ANSWER_MAX {
                    return Err("the collector's answer is too long".into());
                }
                body.extend_from_slice(&piece);
            }
            Ok(response.body(Bytes::from(body))?)
        };
        self.runtime.spawn(call).await?
    }
}

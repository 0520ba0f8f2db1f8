//! A farm's answer, read within limits.

use super::error::{ClientError, innermost};
use crate::problem::{MEDIA_TYPE, Problem};
use bytes::Bytes;
use reqwest::{
    Response, StatusCode,
    header::{CONTENT_TYPE, ETAG, HeaderMap},
};
use serde::de::DeserializeOwned;
use std::time::Duration;

/// Longest document that is read.
const DOCUMENT_MAX: usize = 64 << 20;
/// Longest pause between two pieces of an answer.
pub(super) const PAUSE_MAX: Duration = Duration::from_mins(1);

/// A success whose body is not read yet.
#[derive(Debug)]
pub struct Answer {
    pub(super) response: Response,
    pub(super) name: String,
    pub(super) farm: String,
}

impl Answer {
    /// Whether what is asked for has not changed.
    pub fn is_unchanged(&self) -> bool {
        self.response.status() == StatusCode::NOT_MODIFIED
    }

    /// The version of what was sent.
    pub fn etag(&self) -> Option<String> {
        header(self.response.headers(), ETAG.as_str())
    }

    /// The next piece of the body; `None` at its end.
    pub(super) async fn piece(&mut self) -> Result<Option<Bytes>, ClientError> {
        let broken = |reason| ClientError::Unreachable { farm: self.farm.clone(), reason };
        match tokio::time::timeout(PAUSE_MAX, self.response.chunk()).await {
            Err(_) => Err(broken("the answer stopped in its middle".to_owned())),
            Ok(Err(e)) => Err(broken(innermost(&e))),
            Ok(Ok(piece)) => Ok(piece),
        }
    }

    /// The whole body, of at most `limit` bytes.
    pub async fn bytes(mut self, limit: usize) -> Result<Bytes, ClientError> {
        let mut whole = Vec::new();
        while let Some(piece) = self.piece().await? {
            if whole.len() + piece.len() > limit {
                let reason = format!("it is longer than {limit} bytes");
                return Err(ClientError::Unexpected { call: self.name, status: None, reason });
            }
            whole.extend_from_slice(&piece);
        }
        Ok(whole.into())
    }

    /// The document in the body.
    pub async fn json<T: DeserializeOwned>(self) -> Result<T, ClientError> {
        let call = self.name.clone();
        let bytes = self.bytes(DOCUMENT_MAX).await?;
        serde_json::from_slice(&bytes).map_err(|e| {
            let reason = format!("not the document expected: {e}");
            ClientError::Unexpected { call, status: None, reason }
        })
    }
}

fn header(headers: &HeaderMap, name: &str) -> Option<String> {
    Some(headers.get(name)?.to_str().ok()?.to_owned())
}

/// What the farm says is wrong.
pub(super) async fn problem(response: Response, name: String) -> ClientError {
    let status = response.status();
    let media_type = header(response.headers(), CONTENT_TYPE.as_str()).unwrap_or_default();
    let answer = Answer { response, name: name.clone(), farm: String::new() };
    let body = answer.bytes(1 << 20).await.unwrap_or_default();
    if media_type.starts_with(MEDIA_TYPE)
        && let Ok(problem) = serde_json::from_slice::<Problem>(&body)
    {
        return ClientError::Problem(Box::new(problem));
    }
    let text: String = String::from_utf8_lossy(&body).chars().take(200).collect();
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let reason = format!("{status} {line}").trim().to_owned();
    ClientError::Unexpected { call: name, status: Some(status.as_u16()), reason }
}

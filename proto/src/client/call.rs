//! One call, as data, so that it can be made again.

use super::error::ClientError;
use bytes::Bytes;
use reqwest::{
    Method,
    header::{CONTENT_TYPE, HeaderMap, HeaderName, HeaderValue},
};
use serde::Serialize;
use std::{io::SeekFrom, ops::Range, path::PathBuf, time::Duration};
use tokio::io::{AsyncReadExt as _, AsyncSeekExt as _};

/// Whether making a call twice is the same as making it once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Repeat {
    /// It is: tried again after anything that may pass.
    Harmless,
    /// It is not: tried again only where the farm surely did not act on it.
    Counts,
}

/// What is sent along.
#[derive(Clone, Debug)]
pub enum Payload {
    /// Nothing.
    Empty,
    /// Bytes in memory.
    Bytes(Bytes),
    /// A file, read while it is sent.
    File {
        /// Which.
        path: PathBuf,
        /// Its length in bytes.
        length: u64,
    },
}

impl Payload {
    /// Some of its bytes.
    pub(super) async fn range(&self, range: Range<u64>) -> Result<Bytes, ClientError> {
        match self {
            Self::Empty => Ok(Bytes::new()),
            Self::Bytes(bytes) => Ok(bytes.slice(range.start as usize..range.end as usize)),
            Self::File { path, .. } => {
                let read = async {
                    let mut file = tokio::fs::File::open(path).await?;
                    file.seek(SeekFrom::Start(range.start)).await?;
                    let mut bytes = vec![0; (range.end - range.start) as usize];
                    file.read_exact(&mut bytes).await?;
                    Ok(bytes.into())
                };
                read.await.map_err(|error: std::io::Error| ClientError::File {
                    path: path.clone(),
                    reason: error.to_string(),
                })
            }
        }
    }

    pub(super) fn length(&self) -> u64 {
        match self {
            Self::Empty => 0,
            Self::Bytes(bytes) => bytes.len() as u64,
            Self::File { length, .. } => *length,
        }
    }
}

/// Time a call without a body may take until its answer begins.
const PATIENCE: Duration = Duration::from_secs(10);
/// Slowest line that uploads are not given up on, in bytes a second.
const SLOWEST_UPLOAD: f64 = 50_000.0;

/// One call, as data, so that it can be made again.
#[derive(Clone, Debug)]
pub struct Call {
    pub(super) method: Method,
    pub(super) route: String,
    pub(super) query: Vec<(&'static str, String)>,
    pub(super) headers: HeaderMap,
    pub(super) payload: Payload,
    pub(super) repeat: Repeat,
    pub(super) attempts: Option<u32>,
    pub(super) extra_patience: Duration,
}

impl Call {
    /// A call without a body; repeated as its method allows.
    pub fn new(method: Method, route: impl Into<String>) -> Self {
        let repeat = if method.is_idempotent() { Repeat::Harmless } else { Repeat::Counts };
        Self {
            method,
            route: route.into(),
            query: Vec::new(),
            headers: HeaderMap::new(),
            payload: Payload::Empty,
            repeat,
            attempts: None,
            extra_patience: Duration::ZERO,
        }
    }

    /// With a document.
    #[must_use]
    pub fn json<T: Serialize>(self, document: &T) -> Self {
        let text = serde_json::to_vec(document).expect("the farm's words are plain data");
        self.body(Payload::Bytes(text.into()), "application/json")
    }

    /// With a body.
    #[must_use]
    pub fn body(mut self, payload: Payload, media_type: &'static str) -> Self {
        self.payload = payload;
        self.headers.insert(CONTENT_TYPE, HeaderValue::from_static(media_type));
        self
    }

    /// With a header; one that cannot be written is left out.
    #[must_use]
    pub fn header(mut self, name: HeaderName, value: &str) -> Self {
        if let Ok(value) = HeaderValue::from_str(value) {
            self.headers.insert(name, value);
        }
        self
    }

    /// With a query parameter.
    #[must_use]
    pub fn query(mut self, name: &'static str, value: &impl ToString) -> Self {
        self.query.push((name, value.to_string()));
        self
    }

    /// Repeated after any failure that may pass, or not.
    #[must_use]
    pub fn repeat(mut self, repeat: Repeat) -> Self {
        self.repeat = repeat;
        self
    }

    /// Tried at most `attempts` times, whatever the client's own number.
    #[must_use]
    pub fn attempts(mut self, attempts: u32) -> Self {
        self.attempts = Some(attempts);
        self
    }

    /// Given that much more time: the farm was asked to wait.
    #[must_use]
    pub fn wait(mut self, longer: Duration) -> Self {
        self.extra_patience = longer;
        self
    }

    /// Time until the answer must begin.
    pub(super) fn patience(&self) -> Duration {
        let upload = Duration::from_secs_f64(self.payload.length() as f64 / SLOWEST_UPLOAD);
        PATIENCE + upload + self.extra_patience
    }
}

//! Bodies of requests: JSON and bytes, within limits.

use super::error::ApiError;
use crate::farm::{error::fault, rules::PARTIAL_BYTES_MAX};
use axum::{
    body::{Body, Bytes},
    extract::{FromRequest, Request},
    http::{HeaderMap, StatusCode, header},
};
use serde::de::DeserializeOwned;
use serde_path_to_error::{Path, Segment};
use std::fmt::Write as _;

/// Bytes of a JSON document, at most.
const JSON_MAX: usize = 1 << 20;
/// Bytes of a partial EXR, at most.
const PARTIAL_MAX: usize = PARTIAL_BYTES_MAX + (1 << 20);

/// A JSON document as what it says; faults are told by their JSON pointers.
#[derive(Debug)]
pub struct Document<T>(pub T);

impl<T: DeserializeOwned, S: Send + Sync> FromRequest<S> for Document<T> {
    type Rejection = ApiError;

    async fn from_request(request: Request, _: &S) -> Result<Self, ApiError> {
        let media = media_type(request.headers());
        if !media.as_deref().is_some_and(|m| m == "application/json" || m.ends_with("+json")) {
            return Err(unsupported_media(media.as_deref(), "application/json"));
        }
        let bytes = read(request, JSON_MAX).await?;
        // A list would be taken for the fields of a structure in their order.
        let first = bytes.iter().find(|byte| !byte.is_ascii_whitespace());
        let object: Option<serde_json::Value> = match first {
            Some(b'{') => None,
            _ => Some(serde_json::from_slice(&bytes).map_err(|error| refused(String::new(), &error))?),
        };
        if object.is_some() {
            return Err(invalid(String::new(), "an object is expected here: {\"…\": …}".to_owned()));
        }
        let mut json = serde_json::Deserializer::from_slice(&bytes);
        let document = serde_path_to_error::deserialize(&mut json).map_err(|error| {
            let pointer = pointer(error.path());
            // Where an enumeration is expected, any other kind of value is told like broken syntax.
            let well_formed = serde_json::from_slice::<serde::de::IgnoredAny>(&bytes).is_ok();
            if well_formed && !error.inner().is_data() {
                return invalid(pointer, "a value of another kind is expected here".to_owned());
            }
            refused(pointer, error.inner())
        })?;
        json.end().map_err(|error| refused(String::new(), &error))?;
        Ok(Self(document))
    }
}

fn invalid(pointer: String, detail: String) -> ApiError {
    let (status, kind) = (StatusCode::UNPROCESSABLE_ENTITY, "invalid-document");
    ApiError::new(status, kind, "Invalid document", detail.clone()).at(vec![fault(pointer, detail)])
}

fn refused(pointer: String, error: &serde_json::Error) -> ApiError {
    let detail = error.to_string();
    if error.is_data() {
        return invalid(pointer, detail);
    }
    let (kind, title) = ("malformed-json", "Malformed JSON");
    ApiError::new(StatusCode::BAD_REQUEST, kind, title, detail.clone()).at(vec![fault(pointer, detail)])
}

/// RFC 6901.
fn pointer(path: &Path) -> String {
    let mut pointer = String::new();
    for segment in path {
        match segment {
            Segment::Seq { index } => write!(pointer, "/{index}").expect("writing to a string cannot fail"),
            Segment::Map { key } => {
                pointer.push('/');
                pointer.push_str(&key.replace('~', "~0").replace('/', "~1"));
            }
            Segment::Enum { .. } | Segment::Unknown => {}
        }
    }
    pointer
}

/// The bytes of a partial EXR.
#[derive(Debug)]
pub struct Partial(pub Bytes);

impl<S: Send + Sync> FromRequest<S> for Partial {
    type Rejection = ApiError;

    async fn from_request(request: Request, _: &S) -> Result<Self, ApiError> {
        file_media(request.headers())?;
        read(request, PARTIAL_MAX).await.map(Self)
    }
}

/// The body of an upload, piece by piece.
#[derive(Debug)]
pub struct File(pub Body);

impl<S: Send + Sync> FromRequest<S> for File {
    type Rejection = ApiError;

    async fn from_request(request: Request, _: &S) -> Result<Self, ApiError> {
        file_media(request.headers())?;
        Ok(Self(request.into_body()))
    }
}

/// A file is the body itself, whatever its type: only wrappings of files are refused.
fn file_media(headers: &HeaderMap) -> Result<(), ApiError> {
    match media_type(headers) {
        Some(media) if media.starts_with("multipart/") || media == "application/json" => {
            Err(unsupported_media(Some(&media), "the file's own bytes as application/octet-stream"))
        }
        _ => Ok(()),
    }
}

fn media_type(headers: &HeaderMap) -> Option<String> {
    let value = headers.get(header::CONTENT_TYPE)?.to_str().ok()?;
    Some(value.split(';').next().unwrap_or("").trim().to_ascii_lowercase())
}

fn unsupported_media(got: Option<&str>, expected: &str) -> ApiError {
    let got = got.unwrap_or("no type");
    let detail = format!("the body is {got}: send {expected}");
    ApiError::new(
        StatusCode::UNSUPPORTED_MEDIA_TYPE,
        "unsupported-media-type",
        "Unsupported media type",
        detail,
    )
}

async fn read(request: Request, limit: usize) -> Result<Bytes, ApiError> {
    let length = request.headers().get(header::CONTENT_LENGTH);
    let said = length.and_then(|v| v.to_str().ok()?.parse::<u64>().ok());
    if said.is_some_and(|n| n > limit as u64) {
        return Err(ApiError::too_large(limit as u64));
    }
    axum::body::to_bytes(request.into_body(), limit).await.map_err(|error| {
        let too_long =
            std::error::Error::source(&error).is_some_and(|e| e.to_string().contains("length limit"));
        if too_long { ApiError::too_large(limit as u64) } else { cut_off(&error.to_string()) }
    })
}

/// A body that ended before its end.
pub fn cut_off(detail: &str) -> ApiError {
    let detail = format!("the body was cut off: {detail}");
    ApiError::new(StatusCode::BAD_REQUEST, "cut-off", "Body cut off", detail)
}

//! Entity tags and preferences in headers.

use super::error::ApiError;
use axum::http::{HeaderMap, HeaderValue, header};
use std::time::Duration;

/// Longest wait for a change that is granted.
const WAIT_MAX: Duration = Duration::from_mins(1);

/// A strong entity tag.
pub fn strong(text: &str) -> HeaderValue {
    HeaderValue::from_str(&format!("\"{text}\"")).expect("tags are made of digits and dots")
}

/// Whether `If-None-Match` names the tag (RFC 9110 §13.1.2: weakly compared).
pub fn none_match(headers: &HeaderMap, tag: &str) -> bool {
    let values = headers.get_all(header::IF_NONE_MATCH).iter().filter_map(|v| v.to_str().ok());
    values
        .flat_map(|v| v.split(','))
        .map(str::trim)
        .any(|one| one == "*" || one.strip_prefix("W/").unwrap_or(one).trim_matches('"') == tag)
}

/// The version in `If-Match`, which is compared strongly; `None` where any will do.
pub fn match_version(headers: &HeaderMap) -> Result<Option<u64>, ApiError> {
    let Some(value) = headers.get(header::IF_MATCH) else { return Ok(None) };
    let text = value.to_str().unwrap_or("").trim();
    if text == "*" {
        return Ok(None);
    }
    let version = text.strip_prefix('"').and_then(|t| t.strip_suffix('"')).and_then(|t| t.parse().ok());
    version.map(Some).ok_or_else(|| {
        ApiError::header("If-Match is not the ETag of a job: send that of GET /v1/jobs/{id}, with its quotes")
    })
}

/// `Prefer: wait=N` (RFC 7240).
pub fn wait(headers: &HeaderMap) -> Option<Duration> {
    let values = headers.get_all("prefer").iter().filter_map(|v| v.to_str().ok());
    let wait = values.flat_map(|v| v.split([',', ';'])).find_map(|p| p.trim().strip_prefix("wait="));
    let seconds: u64 = wait?.trim().parse().ok()?;
    Some(Duration::from_secs(seconds).min(WAIT_MAX))
}

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

/// The versions in `If-Match`; `None` where any will do. They are compared strongly (RFC 9110 §13.1.1), so
/// that weak tags, and tags of other things, are no version of a job.
pub fn match_versions(headers: &HeaderMap) -> Result<Option<Vec<u64>>, ApiError> {
    let mut tags = Vec::new();
    for value in headers.get_all(header::IF_MATCH) {
        tags.extend(value.to_str().unwrap_or("?").split(',').map(str::trim).filter(|tag| !tag.is_empty()));
    }
    if tags.is_empty() || tags.contains(&"*") {
        return Ok(None);
    }
    let quoted = |tag: &str| tag.len() > 1 && tag.starts_with('"') && tag.ends_with('"');
    if tags.iter().any(|tag| !quoted(tag.strip_prefix("W/").unwrap_or(tag))) {
        return Err(ApiError::header(
            "If-Match is not the ETag of a job: send that of GET /v1/jobs/{id}, with its quotes",
        ));
    }
    let strong = tags.iter().filter_map(|tag| tag.strip_prefix('"')?.strip_suffix('"')?.parse().ok());
    Ok(Some(strong.collect()))
}

/// `Prefer: wait=N` (RFC 7240).
pub fn wait(headers: &HeaderMap) -> Option<Duration> {
    let values = headers.get_all("prefer").iter().filter_map(|v| v.to_str().ok());
    let wait = values.flat_map(|v| v.split([',', ';'])).find_map(|p| p.trim().strip_prefix("wait="));
    let seconds: u64 = wait?.trim().parse().ok()?;
    Some(Duration::from_secs(seconds).min(WAIT_MAX))
}

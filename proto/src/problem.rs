//! Errors over HTTP: RFC 9457 problem documents.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The media type of a problem document.
pub const MEDIA_TYPE: &str = "application/problem+json";

/// What went wrong with a request.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema, thiserror::Error)]
#[error("{}", self.line())]
pub struct Problem {
    /// Names the kind, stable: `/problems/…`.
    #[serde(rename = "type")]
    pub kind: String,
    /// The kind for people.
    pub title: String,
    /// The HTTP status.
    pub status: u16,
    /// This occurrence for people: what, where, what to do.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub detail: String,
    /// Where in a document.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub errors: Vec<Fault>,
}

/// A fault in a document.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Fault {
    /// JSON pointer into the document.
    pub pointer: String,
    /// What is wrong there.
    pub detail: String,
}

impl Problem {
    /// One clear line.
    pub fn line(&self) -> String {
        let text = if self.detail.is_empty() { &self.title } else { &self.detail };
        match self.errors.first() {
            Some(fault) if !text.contains(&fault.detail) => {
                format!("{text}: {} at {}", fault.detail, fault.pointer)
            }
            _ => text.clone(),
        }
    }
}

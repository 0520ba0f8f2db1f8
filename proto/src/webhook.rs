//! How a farm tells another service that a job's state has changed.
//!
//! Sent and signed as the specification of Standard Webhooks says, so that its libraries verify it: headers `webhook-id`,
//! `webhook-timestamp` (seconds since 1970) and `webhook-signature`, which is `v1,` and the base64 of HMAC-SHA256 over
//! `ID.TIMESTAMP.BODY` under the secret's bytes.

use crate::{id::JobId, status::JobState};
use jiff::Timestamp;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Whom to tell of a job's changes.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, expecting = "an object with 'url' and 'secret'")]
pub struct WebhookRequest {
    /// Where notices are posted, http or https. Shown afterwards without path and query: they may be secret.
    pub url: String,
    /// `whsec_` and 24 to 64 bytes in base64: what notices are signed with. Required; never shown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub secret: Option<String>,
}

/// What a notice is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum NoticeKind {
    /// A job's state has changed.
    #[serde(rename = "job.state")]
    JobState,
}

/// A notice: a job stands otherwise than before.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Notice {
    /// What it is about.
    #[serde(rename = "type")]
    pub kind: NoticeKind,
    /// When the state changed.
    pub timestamp: Timestamp,
    /// The job.
    pub data: NoticeData,
}

/// The job of a notice.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct NoticeData {
    /// Which.
    pub id: JobId,
    /// Its name for people.
    pub name: String,
    /// How it stands since then.
    pub state: JobState,
    /// Why, where there is a reason.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

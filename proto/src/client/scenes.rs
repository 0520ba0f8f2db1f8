//! Calls about uploaded scenes.

use super::{
    answer::Answer,
    call::{Call, Payload},
    error::ClientError,
    farm::Client,
    file::Upload,
};
use crate::{
    id::BlobId,
    route,
    scene::{PartsReceived, SceneReport},
};
use bytes::Bytes;
use reqwest::{Method, header::CONTENT_RANGE};
use serde::Deserialize;
use std::time::Duration;

/// A large scene is parsed before the farm answers.
const PARSING: Duration = Duration::from_mins(10);
/// Longer files are sent in parts of so many bytes.
const PART: u64 = 16 << 20;

/// What a farm says to a part.
#[derive(Deserialize)]
#[serde(untagged)]
enum Answered {
    /// There is more to send.
    Received(PartsReceived),
    /// That was all.
    Report(Box<SceneReport>),
}

impl Client {
    /// Makes sure that the farm has the file: asks by name first, so that a second upload costs nothing.
    pub async fn upload(&self, upload: &Upload) -> Result<SceneReport, ClientError> {
        match self.scene(&upload.id).await {
            Err(e) if e.status() == Some(404) => {}
            known => return known,
        }
        let length = upload.payload.length();
        if length > PART {
            return self.upload_parts(upload, length).await;
        }
        let call = Call::new(Method::PUT, route::scene(&upload.id))
            .body(upload.payload.clone(), "application/octet-stream")
            .wait(PARSING);
        self.send(&call).await?.json().await
    }

    /// Sends what the farm does not have yet, part by part: what was sent before a line broke is not sent again.
    async fn upload_parts(&self, upload: &Upload, length: u64) -> Result<SceneReport, ClientError> {
        let put = |range: &str, part: Bytes| {
            let call = Call::new(Method::PUT, route::scene(&upload.id)).header(CONTENT_RANGE, range);
            call.body(Payload::Bytes(part), "application/octet-stream").wait(PARSING)
        };
        let mut call = put(&format!("bytes */{length}"), Bytes::new());
        loop {
            let there = match self.send(&call).await?.json().await? {
                Answered::Report(report) => return Ok(*report),
                Answered::Received(PartsReceived { received, .. }) => received.min(length - 1),
            };
            let end = (there + PART).min(length);
            let part = upload.payload.range(there..end).await?;
            call = put(&format!("bytes {there}-{}/{length}", end - 1), part);
        }
    }

    /// What the farm says of a file.
    pub async fn scene(&self, id: &BlobId) -> Result<SceneReport, ClientError> {
        self.send(&Call::new(Method::GET, route::scene(id))).await?.json().await
    }

    /// A file's bytes.
    pub async fn scene_bytes(&self, id: &BlobId) -> Result<Answer, ClientError> {
        self.send(&Call::new(Method::GET, route::scene_bytes(id))).await
    }
}

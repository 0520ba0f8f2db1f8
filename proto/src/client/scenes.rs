//! Calls about uploaded scenes.

use super::{answer::Answer, call::Call, error::ClientError, farm::Client, file::Upload};
use crate::{id::BlobId, route, scene::SceneReport};
use reqwest::Method;
use std::time::Duration;

/// A large scene is parsed before the farm answers.
const PARSING: Duration = Duration::from_mins(10);

impl Client {
    /// Makes sure that the farm has the file: asks by name first, so that a second upload costs nothing.
    pub async fn upload(&self, upload: &Upload) -> Result<SceneReport, ClientError> {
        match self.scene(&upload.id).await {
            Err(e) if e.status() == Some(404) => {}
            known => return known,
        }
        let call = Call::new(Method::PUT, route::scene(&upload.id))
            .body(upload.payload.clone(), "application/octet-stream")
            .wait(PARSING);
        self.send(&call).await?.json().await
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

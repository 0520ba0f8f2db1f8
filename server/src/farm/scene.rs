//! Uploaded files: named by their hash, looked into once.

use super::{
    Farm,
    append::blocking,
    error::{FarmError, Result, fault},
    open::UPLOAD_MAX,
};
use crate::{
    blobs::{BlobError, BlobName, Upload},
    fail_point::FailPoint,
};
use bytes::Bytes;
use futures::stream::BoxStream;
use ovtigre_proto::{
    id::BlobId,
    problem::Fault,
    scene::{SceneContent, SceneReport},
};
use std::{fmt, sync::Arc};

/// Looks into a file's bytes: what is in it, or what is wrong and where.
#[derive(Clone)]
pub struct Inspect(Arc<dyn Fn(Bytes) -> std::result::Result<SceneContent, Fault> + Send + Sync>);

impl Inspect {
    /// By `look`, which is called off the async threads.
    pub fn new(
        look: impl Fn(Bytes) -> std::result::Result<SceneContent, Fault> + Send + Sync + 'static,
    ) -> Self {
        Self(Arc::new(look))
    }
}

impl fmt::Debug for Inspect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Inspect")
    }
}

/// A file that is being uploaded.
#[derive(Debug)]
pub struct Incoming {
    upload: Upload,
    hasher: blake3::Hasher,
    bytes: u64,
    limit: u64,
}

impl Incoming {
    /// The next piece.
    pub async fn write(&mut self, piece: Bytes) -> Result<()> {
        self.bytes += piece.len() as u64;
        if self.bytes > self.limit {
            return Err(FarmError::TooLarge { limit: self.limit });
        }
        self.hasher.update(&piece);
        Ok(self.upload.write(piece).await?)
    }

    /// Forgets it.
    pub async fn abort(self) {
        if let Err(error) = self.upload.abort().await {
            tracing::warn!(%error, "an upload was not removed");
        }
    }
}

/// Whether an uploaded file is new.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Novelty {
    /// It was not there.
    New,
    /// It was there.
    Known,
}

impl Farm {
    /// Begins an upload.
    pub async fn receive(&self) -> Result<Incoming> {
        self.need_room()?;
        let upload = self.blobs.upload(self.ids.text(16)).await?;
        Ok(Incoming { upload, hasher: blake3::Hasher::new(), bytes: 0, limit: self.rules.scene_bytes })
    }

    /// Ends an upload: checks its name, where it has one, and looks into it.
    pub async fn take_in(
        &self,
        incoming: Incoming,
        named: Option<&BlobId>,
    ) -> Result<(SceneReport, Novelty)> {
        let id = BlobId::of(incoming.hasher.finalize().into());
        if let Some(named) = named.filter(|named| **named != id) {
            incoming.abort().await;
            return Err(FarmError::HashMismatch { named: named.clone(), got: id });
        }
        if let Some(report) = self.uploaded(&id).await? {
            incoming.abort().await;
            return Ok((report, Novelty::Known));
        }
        if incoming.bytes == 0 {
            incoming.abort().await;
            return Err(FarmError::Scene(vec![fault("", "the file is empty")]));
        }
        let (name, bytes) = (BlobName::Scene(id.clone()), incoming.bytes);
        if let Err(error) = self.let_removal_end(&id).await {
            incoming.abort().await;
            return Err(error);
        }
        FailPoint::SceneBeforeBlob.pass();
        incoming.upload.finish(&name).await?;
        FailPoint::SceneAfterBlob.pass();
        let (content, file) = match self.look_into(&id).await {
            Ok(found) => found,
            Err(error) => {
                // Not where somebody else has sent the same, and could read it.
                self.drop_file(&id, UPLOAD_MAX).await?;
                return Err(error);
            }
        };
        let report = SceneReport { id, bytes, content };
        self.remember(report.clone(), file).await?;
        FailPoint::SceneAfterRow.pass();
        Ok((report, Novelty::New))
    }

    async fn look_into(&self, id: &BlobId) -> Result<(SceneContent, Bytes)> {
        let _turn = self.inspectors.acquire().await.map_err(|_| FarmError::Stopping)?;
        let bytes = match self.blobs.get(&BlobName::Scene(id.clone())).await {
            // Who sent the same at the same time could not read it, and removes it.
            Err(BlobError::Missing(_)) => return Err(FarmError::BeingRemoved(id.clone())),
            other => other?,
        };
        let (inspect, file) = (self.inspect.clone(), bytes.clone());
        let content = blocking(move || (inspect.0)(file)).await?;
        Ok((content.map_err(|fault| FarmError::Scene(vec![fault]))?, bytes))
    }

    /// What is in an uploaded file. Who is told stays right for a while: the file is used now.
    pub async fn scene(&self, id: &BlobId) -> Result<SceneReport> {
        self.uploaded(id).await?.ok_or_else(|| FarmError::not_found("scene", id))
    }

    /// The same, where there is such a file.
    pub(super) async fn uploaded(&self, id: &BlobId) -> Result<Option<SceneReport>> {
        let Some(row) = self.store.scene(id).await? else { return Ok(None) };
        // Not written down each time that somebody looks.
        let is_used = row.unused < self.rules.unused / 2 || self.store.use_scene(id).await?;
        Ok(is_used.then_some(row.report))
    }

    /// An uploaded file's size and bytes.
    pub async fn scene_bytes(
        &self,
        id: &BlobId,
    ) -> Result<(u64, BoxStream<'static, std::result::Result<Bytes, BlobError>>)> {
        self.scene(id).await?;
        Ok(self.blobs.stream(&BlobName::Scene(id.clone())).await?)
    }
}

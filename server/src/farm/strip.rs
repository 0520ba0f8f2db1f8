//! What workers fetch of a scene: without what a job does not read.

use super::{
    Farm,
    append::blocking,
    error::{FarmError, Result},
    spec::JobSpec,
};
use crate::blobs::BlobName;
use bytes::Bytes;
use ovtigre_core::gltf::{limits::Limits, load::Choice, strip::strip};
use ovtigre_proto::{id::BlobId, needs::LeftOut, scene::SceneReport};
use std::sync::Arc;

impl Farm {
    /// Keeps a copy of the job's scene with only what it reads, where the file is large and the copy smaller: the job's workers
    /// fetch that.
    pub(super) async fn strip(&self, spec: &mut JobSpec) -> Result<()> {
        let scene = spec.request.scene.clone().expect("checked: a scene is there");
        let SceneReport { bytes, content, .. } = self.upload_at("/scene", &scene).await?;
        if bytes < self.rules.strip_from {
            return Ok(());
        }
        let turn = self.inspectors.acquire().await.map_err(|_| FarmError::Stopping)?;
        let whole = self.upload_bytes("/scene", &scene).await?;
        let settings = spec.settings.clone();
        let stripped = blocking(move || {
            let times = [settings.shutter.open, settings.shutter.close];
            let choice = Choice { times, variant: settings.variant.as_deref() };
            strip(Arc::<[u8]>::from(&whole[..]), &Limits::default(), &choice)
        });
        // What cannot be read fails where it is rendered.
        let Ok(Some(stripped)) = stripped.await? else { return Ok(()) };
        drop(turn);
        let id = BlobId::of(*blake3::hash(&stripped).as_bytes());
        let left = stripped.len() as u64;
        let report = SceneReport { id: id.clone(), bytes: left, content };
        if !self.store.use_scene(&id).await? && !self.keep_copy(report, stripped.into()).await? {
            return Ok(());
        }
        let what = format!("{} of {bytes} bytes of the scene's file", bytes - left);
        let why = format!("nothing that is rendered reads them: workers fetch {left}");
        spec.needs.left_out.push(LeftOut { what, why });
        spec.fetched = Some(id);
        Ok(())
    }

    /// False where such a copy is just being removed: workers fetch the whole file then.
    async fn keep_copy(&self, report: SceneReport, bytes: Bytes) -> Result<bool> {
        if self.store.is_dropped(&report.id).await? {
            return Ok(false);
        }
        self.blobs.put_once(&BlobName::Scene(report.id.clone()), bytes.clone()).await?;
        match self.remember(report, bytes).await {
            Err(FarmError::BeingRemoved(_)) => Ok(false),
            other => other.map(|()| true),
        }
    }
}

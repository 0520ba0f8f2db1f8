//! What workers fetch of a scene: without what a job does not read.

use super::{
    Farm,
    append::blocking,
    error::{FarmError, Result},
    spec::JobSpec,
};
use crate::blobs::BlobName;
use ovtigre_core::gltf::{limits::Limits, load::Choice, strip::strip};
use ovtigre_proto::{id::BlobId, needs::LeftOut, scene::SceneReport};
use std::sync::Arc;

impl Farm {
    /// Keeps a copy of the job's scene with only what it reads, where the file is large and the copy smaller: the job's workers
    /// fetch that.
    pub(super) async fn strip(&self, spec: &mut JobSpec) -> Result<()> {
        let scene = spec.request.scene.clone().expect("checked: a scene is there");
        let SceneReport { bytes, content, .. } = self.scene(&scene).await?;
        if bytes < self.rules.strip_from {
            return Ok(());
        }
        let turn = self.inspectors.acquire().await.map_err(|_| FarmError::Stopping)?;
        let whole = self.blobs.get(&BlobName::Scene(scene.clone())).await?;
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
        self.blobs.put_once(&BlobName::Scene(id.clone()), stripped.into()).await?;
        self.store.add_scene(SceneReport { id: id.clone(), bytes: left, content }).await?;
        let what = format!("{} of {bytes} bytes of the scene's file", bytes - left);
        let why = format!("nothing that is rendered reads them: workers fetch {left}");
        spec.needs.left_out.push(LeftOut { what, why });
        spec.fetched = Some(id);
        Ok(())
    }
}

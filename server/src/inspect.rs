//! What is in an uploaded file: a scene, or an image to light scenes with.

use crate::farm::{error::fault, scene::Inspect};
use ovtigre_core::film::exr::read_layers;
use ovtigre_proto::scene::{SceneContent, SceneContents};

/// Looks into files by their first bytes.
pub fn inspect() -> Inspect {
    Inspect::new(|bytes| {
        if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
            let layers = read_layers(&bytes).map_err(|e| fault("", e.to_string()))?;
            return Ok(SceneContent::Environment {
                width: layers.width as u32,
                height: layers.height as u32,
            });
        }
        Ok(SceneContent::Scene(SceneContents::default()))
    })
}

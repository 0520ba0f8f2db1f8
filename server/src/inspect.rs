//! What is in an uploaded file: a scene, or an image to light scenes with.

use crate::farm::{error::fault, scene::Inspect};
use ovtigre_core::{
    gltf::{error::LoadError, limits::Limits},
    render::inspect::{Contents, inspect as look},
    scene::environment::Environment,
};
use ovtigre_proto::{
    problem::Fault,
    scene::{LightCounts, SceneContent, SceneContents, SceneWarning},
};
use std::sync::Arc;

/// Names of lights that a report has, at most.
const NAMES_MAX: usize = 1000;
const EXR: &[u8] = &[0x76, 0x2f, 0x31, 0x01];
const RADIANCE: &[u8] = b"#?";

/// Looks into files by their first bytes, within limits.
pub fn inspect(limits: Limits) -> Inspect {
    Inspect::new(move |bytes| {
        if bytes.starts_with(EXR) || bytes.starts_with(RADIANCE) {
            let environment = Environment::decode(&bytes, 0.0).map_err(|e| fault("", e.to_string()))?;
            let (width, height) = environment.size();
            let brightest = environment.brightest().into();
            return Ok(SceneContent::Environment { width: width as u32, height: height as u32, brightest });
        }
        let found = look(Arc::<[u8]>::from(&bytes[..]), &limits).map_err(|e| at_fault(&e))?;
        Ok(SceneContent::Scene(contents(found)))
    })
}

fn at_fault(error: &LoadError) -> Fault {
    fault(error.pointer().unwrap_or_default(), error.to_string())
}

/// In the words of the wire.
pub fn contents(found: Contents) -> SceneContents {
    let [point, spot, directional] = found.punctual;
    let Contents {
        report,
        light_names: names,
        aspects,
        parallel,
        letters,
        brightest,
        needs,
        leaves_out,
        warnings,
        ..
    } = found;
    let aspects: Vec<Option<f64>> = aspects.into_iter().map(|a| a.map(f64::from)).collect();
    SceneContents {
        triangles: report.placed_triangles,
        triangles_stored: report.triangles,
        triangles_dropped: report.dropped.degenerate_triangles,
        meshes: report.meshes as u32,
        instances: report.instances as u32,
        materials: report.materials as u32,
        textures: report.textures as u32,
        pixels: report.pixels,
        cameras: report.camera_names,
        variants: report.variants,
        aspect_ratio: aspects.first().copied().flatten(),
        camera_aspect_ratios: aspects,
        lights: LightCounts { emissive_triangles: report.emissive_triangles, point, spot, directional },
        light_names: Some(names.all.into_iter().take(NAMES_MAX).collect()),
        light_groups: Some(names.groups.into_iter().take(NAMES_MAX).collect()),
        camera_rays_parallel: parallel,
        letters: letters.iter().map(|letter| letter.symbol().to_owned()).collect(),
        brightest,
        needs,
        leaves_out,
        warnings: warnings
            .into_iter()
            .map(|w| SceneWarning { pointer: w.pointer, detail: w.detail })
            .collect(),
    }
}

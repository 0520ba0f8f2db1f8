//! What is in a scene, what a render of it needs and what it leaves out.

use crate::gltf::bundle::Bundle;
use crate::gltf::error::{LoadError, Problem};
use crate::gltf::limits::Limits;
use crate::gltf::load::load;
use crate::gltf::report::Report;
use crate::render::prepare::is_lit;
use crate::scene::camera::Camera;
use crate::scene::data::SceneData;
use crate::scene::material::{Coverage, Material};
use crate::scene::punctual::PunctualKind;
use std::sync::Arc;

/// What is in a scene.
#[derive(Clone, Debug)]
pub struct Contents {
    /// Counts.
    pub report: Report,
    /// Punctual lights: points, spots, directional ones.
    pub punctual: [u32; 3],
    /// Width over height that each camera asks for.
    pub aspects: Vec<Option<f32>>,
    /// What a render needs.
    pub needs: Vec<String>,
    /// What a render leaves out.
    pub leaves_out: Vec<String>,
    /// What is odd.
    pub warnings: Vec<Problem>,
}

/// Reads a scene without building anything.
pub fn inspect(bytes: impl Into<Arc<[u8]>>, limits: &Limits) -> Result<Contents, LoadError> {
    let loaded = load(&Bundle::open(bytes)?, limits)?;
    let data = &loaded.scene;
    let count = |of: fn(&PunctualKind) -> bool| data.punctual.iter().filter(|p| of(&p.kind)).count() as u32;
    let punctual = [
        count(|k| matches!(k, PunctualKind::Point { .. })),
        count(|k| matches!(k, PunctualKind::Spot { .. })),
        count(|k| matches!(k, PunctualKind::Directional { .. })),
    ];
    let (mut needs, mut leaves_out) = (Vec::new(), Vec::new());
    for (name, needed) in features(&loaded.report, data) {
        let list = if needed { &mut needs } else { &mut leaves_out };
        list.push(name.to_owned());
    }
    let aspects = data.cameras.iter().map(Camera::aspect).collect();
    Ok(Contents { report: loaded.report, punctual, aspects, needs, leaves_out, warnings: loaded.warnings })
}

/// Each feature that a scene may need, and whether this one does.
fn features(report: &Report, data: &SceneData) -> [(&'static str, bool); 14] {
    let any = |of: fn(&Material) -> bool| data.materials.iter().any(of);
    [
        ("triangles", data.meshes.iter().any(|m| !m.triangles.is_empty())),
        ("instances", data.instances.len() > 1),
        ("textures", !data.textures.is_empty()),
        ("normal maps", any(|m| m.normal.is_some())),
        ("vertex colours", data.meshes.iter().any(|m| !m.colours.is_empty())),
        ("alpha", any(|m| m.coverage != Coverage::Opaque)),
        ("transmission", any(|m| m.transmission.factor > 0.0)),
        ("volumes", any(|m| m.volume.is_some())),
        ("emissive surfaces", any(Material::emits)),
        ("punctual lights", !data.punctual.is_empty()),
        ("default sky", !is_lit(data)),
        ("animation", report.animated.nodes > 0),
        ("skins", report.animated.skins > 0),
        ("morph targets", report.animated.morphs > 0),
    ]
}

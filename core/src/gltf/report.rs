//! What is in a scene, in numbers.

use crate::scene::data::SceneData;
use serde::Serialize;

/// What is in a scene, and what of the file is not.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Report {
    /// Triangles in memory: those of a repeated mesh count once.
    pub triangles: u64,
    /// Triangles that light can meet: those of a repeated mesh count at every place.
    pub placed_triangles: u64,
    /// Meshes of the file that the scene uses.
    pub meshes: u64,
    /// Places at which they stand.
    pub instances: u64,
    /// Materials that triangles have.
    pub materials: u64,
    /// Textures that those look at.
    pub textures: u64,
    /// Pixels of their pictures.
    pub pixels: u64,
    /// Triangles that emit, counted at every place.
    pub emissive_triangles: u64,
    /// Lights without extent.
    pub punctual_lights: u64,
    /// Cameras.
    pub cameras: u64,
    /// Names of the cameras, in order.
    pub camera_names: Vec<String>,
    /// Names of the variants of its materials.
    pub variants: Vec<String>,
    /// What can move.
    pub animated: Animated,
    /// What was left out.
    pub dropped: Dropped,
    /// Memory of geometry and pictures, in bytes.
    pub bytes: u64,
}

/// What of a scene can move, whether it does while the shutter is open or not.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Animated {
    /// Nodes that animations drive.
    pub nodes: u64,
    /// Meshes that a skin bends.
    pub skins: u64,
    /// Meshes with morph weights.
    pub morphs: u64,
}

/// What of a file no light can meet.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Dropped {
    /// Triangles without area.
    pub degenerate_triangles: u64,
    /// Primitives of points or lines.
    pub lines_and_points: u64,
    /// Places whose transform leaves nothing of the mesh.
    pub instances: u64,
}

impl Report {
    /// Counts what is in a scene.
    pub(crate) fn of(scene: &SceneData, meshes: u64, instances: u64, dropped: Dropped) -> Self {
        let emissive: Vec<u64> = (scene.meshes.iter())
            .map(|mesh| mesh.materials.iter().filter(|m| scene.materials[m.index()].emits()).count() as u64)
            .collect();
        let placed =
            |count: &dyn Fn(usize) -> u64| scene.instances.iter().map(|i| count(i.mesh.index())).sum();
        let mut pictures: Vec<_> = scene.textures.iter().map(|t| &t.picture).collect();
        pictures.sort_by_key(|picture| std::sync::Arc::as_ptr(picture));
        pictures.dedup_by_key(|picture| std::sync::Arc::as_ptr(picture));
        let geometry: usize = scene.meshes.iter().map(crate::scene::mesh::Mesh::bytes).sum();
        Self {
            triangles: scene.meshes.iter().map(|m| m.triangles.len() as u64).sum(),
            placed_triangles: placed(&|mesh| scene.meshes[mesh].triangles.len() as u64),
            meshes,
            instances,
            materials: scene.materials.len() as u64,
            textures: scene.textures.len() as u64,
            pixels: pictures.iter().map(|p| u64::from(p.width) * u64::from(p.height)).sum(),
            emissive_triangles: placed(&|mesh| emissive[mesh]),
            punctual_lights: scene.punctual.len() as u64,
            cameras: scene.cameras.len() as u64,
            camera_names: scene.cameras.iter().map(|c| c.name.clone()).collect(),
            variants: Vec::new(),
            animated: Animated::default(),
            dropped,
            bytes: geometry as u64 + pictures.iter().map(|p| p.bytes() as u64).sum::<u64>(),
        }
    }
}

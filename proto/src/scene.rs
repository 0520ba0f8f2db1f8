//! What the farm says of an uploaded scene.

use crate::id::BlobId;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How much of a file that is uploaded in parts is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct PartsReceived {
    /// Bytes that are there from the first on, without a gap.
    pub received: u64,
    /// Bytes of the whole file.
    pub bytes: u64,
}

/// What is in an uploaded file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SceneReport {
    /// The hash of its bytes.
    pub id: BlobId,
    /// Its size.
    pub bytes: u64,
    /// What kind of file, and what is in it.
    #[serde(flatten)]
    pub content: SceneContent,
}

/// What kind of file, and what is in it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[expect(clippy::large_enum_variant, reason = "one an upload, and most are scenes")]
pub enum SceneContent {
    /// A glTF scene.
    Scene(SceneContents),
    /// An image to light scenes with.
    Environment {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// The largest radiance that a channel of it has, in W/(sr·m²).
        #[serde(default)]
        brightest: f64,
    },
}

/// Counts and findings of a scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SceneContents {
    /// Triangles, each instance counted.
    pub triangles: u64,
    /// Triangles kept in memory.
    pub triangles_stored: u64,
    /// Triangles without area, dropped.
    pub triangles_dropped: u64,
    /// Meshes.
    pub meshes: u32,
    /// Placed meshes.
    pub instances: u32,
    /// Materials.
    pub materials: u32,
    /// Textures.
    pub textures: u32,
    /// Pixels of their images, of which each counts once.
    #[serde(default)]
    pub pixels: u64,
    /// Cameras, by name, in the order of their numbers.
    pub cameras: Vec<String>,
    /// Width over height of the first camera, where it says.
    pub aspect_ratio: Option<f64>,
    /// The same of each camera.
    #[serde(default)]
    pub camera_aspect_ratios: Vec<Option<f64>>,
    /// Variants of its materials, by name.
    #[serde(default)]
    pub variants: Vec<String>,
    /// Emitters of each kind.
    pub lights: LightCounts,
    /// Names by which expressions take its lights (`L'name'`): those of their nodes and of their materials.
    #[serde(default)]
    pub light_names: Option<Vec<String>>,
    /// Of those, one for each light that has any.
    #[serde(default)]
    pub light_groups: Option<Vec<String>>,
    /// Whether each camera's rays are parallel.
    #[serde(default)]
    pub camera_rays_parallel: Vec<bool>,
    /// Letters that its surfaces can have: `D`, `S` (glossy), `S_M`.
    #[serde(default)]
    pub letters: Vec<String>,
    /// The largest radiance that a channel of an emissive surface or of the default sky has, in W/(sr·m²).
    #[serde(default)]
    pub brightest: f64,
    /// What a render of it needs.
    pub needs: Vec<String>,
    /// What a render of it leaves out.
    pub leaves_out: Vec<String>,
    /// What could not be read, or looks unintended.
    pub warnings: Vec<SceneWarning>,
}

/// Emitters of each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct LightCounts {
    /// Triangles that emit.
    pub emissive_triangles: u64,
    /// Point lights.
    pub point: u32,
    /// Spot lights.
    pub spot: u32,
    /// Directional lights.
    pub directional: u32,
}

/// Something in a scene that a user should know of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct SceneWarning {
    /// JSON pointer into the document; empty for the whole.
    pub pointer: String,
    /// What it is, and what was done about it.
    pub detail: String,
}

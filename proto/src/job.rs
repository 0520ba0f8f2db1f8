//! A job as a user asks for it: the command line's job flags as JSON.

use crate::{
    id::BlobId,
    pair::{self, EnvironmentRequest},
    webhook::WebhookRequest,
};
use ovtigre_core::{
    film::size::{Region, Size},
    settings::{Distribution, Shadows},
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Samples a pixel where a job does not say.
pub const SAMPLES_DEFAULT: u32 = 256;
/// Replicates where a job does not say.
pub const REPLICATES_DEFAULT: u32 = 4;
/// What stands among a job's layers for one of each light.
pub const LAYER_OF_EACH_LIGHT: &str = "lights";
/// Width of a picture where a job does not say; the height follows from the camera.
pub const WIDTH_DEFAULT: u32 = 1280;

/// What is asked for; what is left out gets its default when the job is submitted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object with a job's settings")]
pub struct JobRequest {
    /// The uploaded scene; required.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene: Option<BlobId>,
    /// A name for people.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The frame in pixels.
    #[schemars(with = "Option<pair::WrittenSize>")]
    #[serde(with = "pair::size", skip_serializing_if = "Option::is_none")]
    pub size: Option<Size>,
    /// A camera's name, or its number from 0.
    #[schemars(with = "Option<pair::NameOrNumber>")]
    #[serde(deserialize_with = "pair::name_or_number", skip_serializing_if = "Option::is_none")]
    pub camera: Option<String>,
    /// A variant of the scene's materials, by name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub variant: Option<String>,
    /// Samples a pixel at most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub samples: Option<u32>,
    /// Stop when the relative error is certified at or under this.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// Stop after this many seconds of run time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seconds: Option<f64>,
    /// Path expression.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paths: Option<String>,
    /// A path expression by its name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub preset: Option<String>,
    /// How light is estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<MethodRequest>,
    /// Further pictures, `NAME=EXPR` each; `lights` is one for each light that has a name.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<String>,
    /// Only these techniques of `bidirectional`: pairs `s,t` of light and eye vertices, with `;` between.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strategies: Option<String>,
    /// How the techniques of a path are weighed against each other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weights: Option<WeightsRequest>,
    /// Longest path in scattering events.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bounces: Option<u32>,
    /// Radius of the lens in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lens_radius: Option<f64>,
    /// Distance in focus in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focus_distance: Option<f64>,
    /// Seconds of the scene's animation at which the shutter opens and closes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shutter: Option<[f64; 2]>,
    /// Light from infinitely far.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub environment: Option<EnvironmentRequest>,
    /// Its turn around the vertical axis in degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub environment_rotation: Option<f64>,
    /// Whether direct light is blocked.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shadows: Option<Shadows>,
    /// Which pixels get how many samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sampling: Option<Distribution>,
    /// Chooses the random sequences.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// Independently scrambled sequences; 1 gives no error bars.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replicates: Option<u32>,
    /// Part of the frame.
    #[schemars(with = "Option<pair::WrittenRegion>")]
    #[serde(with = "pair::region", skip_serializing_if = "Option::is_none")]
    pub region: Option<Region>,
    /// Higher goes first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub priority: Option<i32>,
    /// Its share of batches among jobs of its priority, in proportion: 1 where it is not said.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weight: Option<u32>,
    /// Only workers that offer all of these get its batches.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tags: Vec<String>,
    /// So many workers hold its batches at a time, at most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_workers: Option<u32>,
    /// Whom to tell when the job's state changes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub webhook: Option<WebhookRequest>,
}

/// A method by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MethodRequest {
    /// Chosen by the farm.
    Auto,
    /// Paths from the eye.
    Path,
    /// Paths from the lights.
    Light,
    /// Both, joined.
    Bidirectional,
    /// Paths from the eye, and caustics also from the lights.
    Caustics,
    /// Photon map.
    Photon,
    /// Finite elements.
    Radiosity,
}

/// How the techniques of a path are weighed against each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum WeightsRequest {
    /// In proportion to their densities.
    Balance,
    /// In proportion to the squares of their densities.
    Power,
    /// All alike.
    Uniform,
    /// One technique has it all.
    Single,
}

/// A change to a job; what is left out stays.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, expecting = "an object with what is to change")]
pub struct JobPatch {
    /// Higher goes first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub priority: Option<i32>,
    /// `paused` or `running`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub state: Option<crate::status::JobState>,
    /// Samples a pixel at most: more than before. A job that is done goes on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub samples: Option<u32>,
    /// Stop when the relative error is certified at or under this. A job that is done goes on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<f64>,
    /// Its share of batches among jobs of its priority.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weight: Option<u32>,
    /// So many workers hold its batches at a time, at most.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_workers: Option<u32>,
}

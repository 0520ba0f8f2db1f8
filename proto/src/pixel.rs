//! One pixel of a picture.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A pixel of a job's picture so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pixel {
    /// The set of batches in it: as the picture's `ETag`.
    pub manifest: String,
    /// Its column in the frame.
    pub x: u32,
    /// Its row in the frame.
    pub y: u32,
    /// The picture and its layers.
    pub planes: Vec<PixelValue>,
}

/// What a plane has at a pixel, linear Rec.709.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PixelValue {
    /// `picture`, or the layer's name.
    pub name: String,
    /// Mean.
    pub value: [f32; 3],
    /// Standard error of the mean; absent where there is a single replicate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<[f32; 3]>,
}

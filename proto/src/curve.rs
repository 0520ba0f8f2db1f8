//! Error against run time.

use ovtigre_core::film::certificate::Doubt;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One checkpoint. Errors are absent where there is a single replicate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CurveRow {
    /// Samples a pixel, over all replicates.
    pub samples: u32,
    /// Run time since the first batch was handed out.
    pub wall_seconds: f64,
    /// Time workers spent, summed.
    pub worker_seconds: f64,
    /// Rays traced.
    pub rays: u64,
    /// Root of the mean variance of the mean, over pixels and channels.
    pub rms_error: Option<f64>,
    /// Root of the mean relative variance of the mean.
    pub relative_error: Option<f64>,
    /// What the relative error is at most; needs three replicates.
    pub relative_error_upper: Option<f64>,
    /// Run time at which the target was expected then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target_expected_at_seconds: Option<f64>,
    /// Why the error is not certified, whatever it is at most.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub doubt: Option<Doubt>,
}

/// One layer at a checkpoint. Errors are absent where there is a single replicate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LayerError {
    /// Mean luminance over the pixels.
    pub mean_luminance: f64,
    /// As of the picture.
    pub rms_error: Option<f64>,
    /// As of the picture, by the layer's own luminance.
    pub relative_error: Option<f64>,
    /// Of the layer `narrow` of photons: how far the picture's mean luminance is from that of radius zero, as a share of it,
    /// by extrapolation from the two radii. Negative where light is missing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub estimated_bias: Option<f64>,
}

/// The whole curve of a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Curve {
    /// Checkpoints in order.
    pub rows: Vec<CurveRow>,
    /// Slope of log relative error over log worker seconds, at the latest checkpoints; −0.5 for plain Monte Carlo.
    pub slope: Option<f64>,
    /// 1 / (relative error² · worker seconds) at the last checkpoint.
    pub efficiency: Option<f64>,
    /// Relative error to stop at.
    pub error_target: Option<f64>,
    /// Run time at which the target is expected.
    pub target_expected_at_seconds: Option<f64>,
    /// Run times at which checkpoints expected the target, over that at which it was certified.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub prediction_ratios: Vec<f64>,
    /// Whether the target was reached and certified.
    pub certified: bool,
    /// Samples dropped, over the whole job.
    pub invalid_samples: u64,
}

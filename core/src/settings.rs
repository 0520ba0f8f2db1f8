//! What a picture is asked to be: all that a sum depends on beside scene and batch.

use crate::film::size::Size;
use serde::{Deserialize, Serialize};

/// Settings of a render, every default resolved. The same settings give the same bits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// The whole frame.
    pub size: Size,
    /// Where it is seen from.
    pub camera: CameraChoice,
    /// How light is estimated.
    pub method: Method,
    /// Longest path in scattering events; `None` for no limit.
    pub bounces: Option<u32>,
    /// Lens and focus; `None` for a pinhole.
    pub lens: Option<Lens>,
    /// Light from infinitely far instead of the scene's own; `None` to leave it as it is.
    pub environment: Option<Environment>,
    /// Whether direct light is blocked.
    pub shadows: Shadows,
    /// Chooses the random sequences.
    pub seed: u64,
    /// Number of independently scrambled sequences.
    pub replicates: u32,
}

/// Which camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CameraChoice {
    /// A camera that frames the whole scene.
    Framed,
    /// A camera of the scene, in the order of its nodes.
    Index(u32),
}

/// How light is estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Paths from the eye, with next event.
    Path,
}

impl Method {
    /// Its name on the command line and in a picture's attributes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
        }
    }
}

/// A thin lens.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lens {
    /// Radius of the aperture in metres, positive.
    pub radius: f64,
    /// Distance of the plane in focus in metres, positive.
    pub focus_distance: f64,
}

/// Light from infinitely far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Environment {
    /// Where its radiance comes from.
    pub source: EnvironmentSource,
    /// Turn around the vertical axis in degrees, counter-clockwise seen from above.
    pub rotation_degrees: f64,
}

/// Where an environment's radiance comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EnvironmentSource {
    /// The same radiance from everywhere, linear Rec.709, W/(sr·m²) a channel.
    Uniform([f32; 3]),
    /// A latitude-longitude image (EXR or Radiance HDR), by the BLAKE3 hash of its bytes in hex.
    Image(String),
}

/// Whether direct light is blocked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shadows {
    /// As in nature.
    #[default]
    On,
    /// Direct light is never blocked.
    Off,
}

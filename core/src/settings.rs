//! What a picture is asked to be: all that a sum depends on beside scene and batch.

use crate::film::size::Size;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The whole rendering equation.
pub const FULL: &str = "L(D|S)*E";

/// Settings of a render, every default resolved. The same settings give the same bits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// The whole frame.
    pub size: Size,
    /// Where it is seen from.
    pub camera: CameraChoice,
    /// Name of the variant of the scene's materials; `None` for those it has without.
    #[serde(default)]
    pub variant: Option<String>,
    /// How light is estimated.
    pub method: Method,
    /// Which paths the picture shows: a path expression.
    pub paths: String,
    /// Further pictures, in their order among a sum's planes.
    pub layers: Vec<Layer>,
    /// How gloss is taken after the first scattering.
    pub gloss: Gloss,
    /// The techniques of `bidirectional` that are used; empty for all.
    pub strategies: Vec<Strategy>,
    /// How the techniques of a path are weighed against each other.
    pub weights: Weights,
    /// Longest path in scattering events; `None` for no limit.
    pub bounces: Option<u32>,
    /// Lens and focus; `None` for a pinhole.
    pub lens: Option<Lens>,
    /// When light is let in.
    pub shutter: Shutter,
    /// Light from infinitely far instead of the scene's own; `None` to leave it as it is.
    pub environment: Option<Environment>,
    /// Whether direct light is blocked.
    pub shadows: Shadows,
    /// Chooses the random sequences.
    pub seed: u64,
    /// Number of independently scrambled sequences.
    pub replicates: u32,
    /// Which pixels get how many samples.
    #[serde(default, skip_serializing_if = "Distribution::is_uniform")]
    pub sampling: Distribution,
}

/// Which pixels get how many samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Distribution {
    /// All the same.
    #[default]
    Uniform,
    /// More where they lessen the error more.
    Adaptive,
}

impl Distribution {
    /// Whether all get the same.
    pub fn is_uniform(&self) -> bool {
        *self == Self::Uniform
    }
}

/// Which camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CameraChoice {
    /// A camera that frames the whole scene.
    Framed,
    /// A camera of the scene, in the order of its nodes.
    Index(u32),
}

impl fmt::Display for CameraChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Framed => f.write_str("framed"),
            Self::Index(n) => write!(f, "{n}"),
        }
    }
}

/// How light is estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Paths from the eye, with next event.
    Path,
    /// Paths from the lights, with next event to the lens.
    Light,
    /// Both, joined everywhere.
    Bidirectional,
    /// Paths from the eye, with next event; what surfaces that are more than diffuse make of light that comes straight from its
    /// source, also by paths from the lights, with next event to the lens.
    Caustics,
    /// Paths from the eye to a map of photons.
    Photon,
    /// Finite elements, for diffuse paths.
    Radiosity,
}

impl Method {
    /// Its name on the command line and in a picture's attributes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Path => "path",
            Self::Light => "light",
            Self::Bidirectional => "bidirectional",
            Self::Caustics => "caustics",
            Self::Photon => "photon",
            Self::Radiosity => "radiosity",
        }
    }

    /// Whether its mean is off the truth by what the spread of samples does not show.
    pub fn has_bias(self) -> bool {
        matches!(self, Self::Photon | Self::Radiosity)
    }

    /// Whether vertices of its paths look for light.
    pub fn has_next_events(self) -> bool {
        !matches!(self, Self::Light | Self::Photon)
    }

    /// Whether a sample of one pixel can add light to any other, so that a batch is always the whole picture.
    pub fn splats(self) -> bool {
        matches!(self, Self::Light | Self::Bidirectional | Self::Caustics | Self::Photon)
    }
}

impl Settings {
    /// Planes of a sum: the picture and its layers.
    pub fn planes(&self) -> u32 {
        1 + self.layers.len() as u32
    }
}

/// A further picture.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Layer {
    /// Its name in a picture's channels.
    pub name: String,
    /// What it shows.
    pub shows: Shows,
}

/// What a layer shows.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Shows {
    /// The paths of an expression.
    Paths(String),
    /// What one technique of `bidirectional` adds to the picture, weight included.
    Strategy(Strategy),
    /// The picture of `photon` with half the area of gathering: the difference tells its bias.
    Narrow,
    /// The picture without lamps and skies that are seen directly.
    Scattered,
    /// Squares of what a method adds to a pixel, path by path: in a picture of that method as its own samples find them, and in one of
    /// `bidirectional` as all techniques do, also before that method's have met some of the light.
    Squares(Method),
}

impl fmt::Display for Shows {
    /// As on the command line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Paths(paths) => f.write_str(paths),
            Self::Strategy(Strategy { s, t }) => write!(f, "({s},{t})"),
            Self::Narrow => f.write_str("half the area of gathering"),
            Self::Scattered => f.write_str("light that is scattered"),
            Self::Squares(method) => write!(f, "squares of what {} adds", method.name()),
        }
    }
}

/// A technique: how many vertices of a path come from the light, and how many from the eye, light and lens included.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub struct Strategy {
    /// Vertices of the light subpath.
    pub s: u32,
    /// Vertices of the eye subpath.
    pub t: u32,
}

/// How the techniques of a path are weighed against each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Weights {
    /// In proportion to their densities.
    #[default]
    Balance,
    /// In proportion to the squares of their densities.
    Power,
    /// All that can make the path alike.
    Uniform,
    /// Not at all: every technique counts in full.
    Single,
}

/// How gloss is taken after the first scattering from the light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Gloss {
    /// As it is.
    #[default]
    AsItIs,
    /// As a mirror's (Whitted).
    Mirror,
}

/// When light is let in: seconds of the scene's animation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Shutter {
    /// Opens.
    pub open: f64,
    /// Closes; not before it opens.
    pub close: f64,
}

/// A thin lens.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Lens {
    /// Radius of the aperture in metres, positive.
    pub radius: f64,
    /// Distance of the plane in focus in metres, positive.
    pub focus_distance: f64,
}

/// Light from infinitely far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Environment {
    /// Where its radiance comes from.
    pub source: EnvironmentSource,
    /// Turn around the vertical axis in degrees, counter-clockwise seen from above.
    pub rotation_degrees: f64,
}

/// Where an environment's radiance comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EnvironmentSource {
    /// The same radiance from everywhere, linear Rec.709, W/(sr·m²) a channel.
    Uniform([f32; 3]),
    /// A latitude-longitude image (EXR or Radiance HDR), by the BLAKE3 hash of its bytes in hex.
    Image(String),
}

/// Whether direct light is blocked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Shadows {
    /// As in nature.
    #[default]
    On,
    /// Direct light is never blocked.
    Off,
}

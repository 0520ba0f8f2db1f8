//! What was tried.

use crate::film::size::Size;
use crate::settings::Method;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What was tried.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pilot {
    /// Of the methods that need about the least work for an error, the one with the cheapest samples.
    pub method: Method,
    /// The size of the frames that were tried.
    pub size: Size,
    /// Each method that was tried.
    pub trials: Vec<Trial>,
    /// Work of the pilot over that of the job by the method that is taken, as far as that is known before.
    pub share: f64,
    /// The same of reading the scene for it.
    #[serde(default)]
    pub reading: f64,
}

/// A method that was tried. Errors are those of the picture without lamps and skies that are seen directly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Trial {
    /// The method.
    pub method: Method,
    /// Samples a pixel.
    pub samples: u32,
    /// Rays traced.
    pub rays: u64,
    /// What it took, counted: by how long a ray and a sample take by each method, in microseconds of one thread of the machine that this was
    /// measured on.
    pub work: f64,
    /// Relative error by the spread of the samples.
    pub relative_error: f64,
    /// Standard error of its square, by a jackknife over the sequences.
    pub square_error: f64,
    /// Relative error to be expected of as many samples. What `path`, `caustics` and `light` add to a pixel may be large and so rare that
    /// their own samples have not met it, or too much of it, where those of `bidirectional` meet it often.
    #[serde(default)]
    pub expected_error: f64,
    /// Relative error by light that another method has met and this one has not, where nothing else tells of it.
    pub missed: f64,
    /// Work for the same error, over that of the method that is taken: the geometric mean over what several halves of the sequences tell.
    pub time_ratio: f64,
}

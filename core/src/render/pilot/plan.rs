//! What a job is, as far as a pilot has to know.

use super::work::{SAMPLE, SAMPLES_A_SECOND, TELLING, dearness, reading};
use crate::film::size::{Region, Size};
use crate::render::batch::RenderError;
use crate::render::prepare::PrepareError;
use crate::settings::{Method, Settings};

/// Share of a job's work that a pilot may take, once the scene is read.
pub(super) const SHARE: f64 = 0.02;
/// Share of a job's work that reading the scene for it may take. That is no more than the 1.1 times that a pilot is to keep a job within,
/// and models with many textures take 1.4 to 2.1 times as long by what is taken untried.
const READING: f64 = 0.06;
/// Sequences of each method.
pub(super) const REPLICATES: u32 = 8;
/// Fewest pixels of a pilot's pictures.
const PIXELS_MIN: f64 = 48.0;
/// Most pixels of a pilot's pictures. Fewer have more samples each, so that more is seen of how the errors of methods fall with more of them;
/// but edges are noise that all methods share, and there is the more of it the larger pixels are, which speaks for the
/// method with the cheapest samples. Of 500, 1000, 1600 and 3600 pixels, 1600 chose best in the scenes of docs/PERFORMANCE.md
/// (by errors at numbers of samples that are powers of two, which is less fair than what stands there now).
const PIXELS_MAX: f64 = 1600.0;
/// Triangles that are read, at most: they are in memory meanwhile.
const TRIANGLES_MAX: u64 = 1 << 20;

/// How eye subpaths come to light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chance {
    /// By next events, which miss nothing.
    Never,
    /// Some of it by chance, behind glossy or specular surfaces.
    Sometimes,
}

/// What a job is, as far as a pilot has to know.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What is rendered, by any method.
    pub settings: Settings,
    /// Pixels that are rendered.
    pub region: Region,
    /// Samples a pixel over all replicates, at most.
    pub samples: u32,
    /// Relative error to stop at.
    pub error_target: Option<f64>,
    /// Seconds of run time to stop after.
    pub seconds: Option<f64>,
    /// Triangles that are read.
    pub triangles: u64,
    /// Pixels of images that are read.
    pub pixels: u64,
    /// Whether the first of the methods comes to some light by chance only.
    pub chance: Chance,
    /// Methods that make the picture; the first is taken where no other is better.
    pub methods: Vec<Method>,
}

/// Why nothing was tried.
#[derive(Debug, thiserror::Error)]
pub enum NoPilot {
    /// Little is asked for.
    #[error("the job is too small for trying others in 2 % of it")]
    TooLittle,
    /// There is much to read for what is asked for.
    #[error("reading the scene once more for trying others would take too much of the job")]
    TooLarge,
    /// Paths go on and on.
    #[error("paths are too long here for trying to join them")]
    TooLong,
    /// The scene cannot be rendered.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// A batch gave no sum.
    #[error(transparent)]
    Render(#[from] RenderError),
}

impl Plan {
    /// Samples of the job over all pixels, at most.
    pub(super) fn job(&self) -> f64 {
        let asked = self.region.pixels() as f64 * f64::from(self.samples);
        self.seconds.map_or(asked, |seconds| asked.min(seconds * SAMPLES_A_SECOND))
    }

    /// Work of reading the scene.
    pub(super) fn reading(&self) -> f64 {
        reading(self.triangles, self.pixels)
    }

    /// Pixels that may be tried, with a sample of each sequence: more pixels tell more than more samples.
    fn pixels_tried(&self) -> f64 {
        let all: f64 = self.methods.iter().map(|method| dearness(*method)).sum();
        SHARE * self.job() / (TELLING * f64::from(REPLICATES) * all)
    }

    /// Whether there is work enough for a pilot, before anything is read.
    pub fn check(&self) -> Result<(), NoPilot> {
        if self.pixels_tried() < PIXELS_MIN {
            Err(NoPilot::TooLittle)
        } else if self.triangles > TRIANGLES_MAX || self.reading() > READING * SAMPLE * self.job() {
            Err(NoPilot::TooLarge)
        } else {
            Ok(())
        }
    }

    /// What is taken where nothing is tried: the first, or `caustics` where that one meets light by chance and can need thousands of times
    /// the work.
    pub fn untried(&self) -> Method {
        match self.chance {
            Chance::Sometimes if self.methods.contains(&Method::Caustics) => Method::Caustics,
            _ => self.methods[0],
        }
    }

    /// The same picture in so few pixels that it can be tried.
    pub(super) fn small(&self) -> (Settings, Region) {
        let (Size { width, height }, region) = (self.settings.size, self.region);
        let pixels = self.pixels_tried().min(PIXELS_MAX);
        let scale = (pixels / region.pixels() as f64).sqrt().min(1.0);
        let length = |n: u32| (f64::from(n) * scale).round().max(1.0) as u32;
        let size = Size { width: length(width), height: length(height) };
        let start = |n: u32, of: u32, within: u32| {
            ((f64::from(n) / f64::from(of) * f64::from(within)) as u32).min(within - 1)
        };
        let (x, y) = (start(region.x, width, size.width), start(region.y, height, size.height));
        let region = Region {
            x,
            y,
            width: length(region.width).min(size.width - x),
            height: length(region.height).min(size.height - y),
        };
        (Settings { size, replicates: REPLICATES, ..self.settings.clone() }, region)
    }
}

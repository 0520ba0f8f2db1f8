//! What a job is, as far as a pilot has to know.

use super::work::{SAMPLE, SAMPLES_A_SECOND, TELLING, dearness, reading};
use crate::film::size::{Region, Size};
use crate::render::batch::RenderError;
use crate::render::prepare::PrepareError;
use crate::settings::{Method, Settings};

/// Share of a job's work that a pilot may take.
pub(super) const SHARE: f64 = 0.02;
/// Sequences of each method.
pub(super) const REPLICATES: u32 = 8;
/// Fewest pixels of a pilot's pictures.
const PIXELS_MIN: f64 = 48.0;
/// Most pixels of a pilot's pictures. They should be as small as the job's: edges are noise that all methods share, and there is
/// the more of it the larger pixels are, which speaks for the method with the cheapest samples.
const PIXELS_MAX: f64 = 3600.0;
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

    /// Pixels that may be tried in so much of the work, with a sample of each sequence: more pixels tell more than more samples.
    fn frame(&self, work: f64) -> f64 {
        let all: f64 = self.methods.iter().map(|method| dearness(*method)).sum();
        work / SAMPLE / (TELLING * f64::from(REPLICATES) * all)
    }

    /// Work that a pilot may take, reading included.
    fn share(&self) -> f64 {
        SHARE * SAMPLE * self.job()
    }

    /// Whether there is work enough for a pilot, before anything is read.
    pub fn check(&self) -> Result<(), NoPilot> {
        if self.frame(self.share()) < PIXELS_MIN {
            Err(NoPilot::TooLittle)
        } else if self.triangles > TRIANGLES_MAX || self.frame(self.share() - self.reading()) < PIXELS_MIN {
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
        let pixels = self.frame(self.share() - self.reading()).min(PIXELS_MAX);
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

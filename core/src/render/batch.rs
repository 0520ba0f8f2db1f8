//! One batch: tiles on the threads of a pool, added in their order.

use crate::film::allocation::Allocation;
use crate::film::batch::Batch;
use crate::film::invalid::InvalidSamples;
use crate::film::size::Region;
use crate::film::sum::{Plane, Sum};
use crate::path::expression::error::ExpressionError;
use crate::path::rules::Rules;
use crate::path::throughput::{Carriage, Everything, Filtered};
use crate::render::prepare::Prepared;
use crate::render::progress::Progress;
use crate::render::sample::Sampling;
use crate::render::{passes, splats, tile};
use crate::settings::{Method, Settings};

/// Which code renders a batch. The sums are the same, bit by bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    /// Compiled for what is asked: it follows no letters where every path counts for one picture.
    Fitting,
    /// Compiled for any expressions and layers.
    General,
}

/// A batch gave no sum.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RenderError {
    /// It was asked to end before it was done.
    #[error("stopped before it was done")]
    Stopped,
    /// The settings' paths cannot be followed.
    #[error(transparent)]
    Paths(#[from] ExpressionError),
}

/// The sum of a batch. Runs on the current rayon pool; the same arguments give the same bits on any number of threads:
/// a pixel's samples are added in f64 in a fixed order.
pub fn render(
    prepared: &Prepared,
    settings: &Settings,
    batch: Batch,
    progress: &Progress,
) -> Result<Sum, RenderError> {
    render_allocated(prepared, settings, batch, None, progress)
}

/// The same of a batch whose pixels have as many of its samples as they are allocated. Only for methods whose samples stay in
/// their pixel.
pub fn render_allocated(
    prepared: &Prepared,
    settings: &Settings,
    batch: Batch,
    allocation: Option<&Allocation>,
    progress: &Progress,
) -> Result<Sum, RenderError> {
    run_by(Kernel::Fitting, prepared, settings, (batch, allocation), progress)
}

/// The same by a kernel of choice, to compare them.
pub fn render_by(
    kernel: Kernel,
    prepared: &Prepared,
    settings: &Settings,
    batch: Batch,
    progress: &Progress,
) -> Result<Sum, RenderError> {
    run_by(kernel, prepared, settings, (batch, None), progress)
}

fn run_by(
    kernel: Kernel,
    prepared: &Prepared,
    settings: &Settings,
    (batch, allocation): (Batch, Option<&Allocation>),
    progress: &Progress,
) -> Result<Sum, RenderError> {
    assert!(batch.region.is_in(settings.size), "the batch's region is not in the frame");
    assert!(
        allocation.is_none_or(|a| a.frame() == settings.size && !settings.method.splats()),
        "an allocation for another frame, or for a method whose samples reach any pixel"
    );
    let scene = &prepared.scene;
    let rules = Rules::new(scene, settings, batch.region.pixels())?;
    let radiosity = prepared.radiosity.as_deref();
    let sampling = Sampling { scene, radiosity, settings, rules: &rules, batch, allocation };
    if kernel == Kernel::Fitting && rules.is_everything() {
        run::<Everything>(&sampling, progress)
    } else {
        run::<Filtered>(&sampling, progress)
    }
}

fn run<C: Carriage>(sampling: &Sampling<'_>, progress: &Progress) -> Result<Sum, RenderError>
where
    C::Light: Send + Sync,
{
    match sampling.settings.method {
        Method::Light | Method::Bidirectional | Method::Caustics => splats::render::<C>(sampling, progress),
        Method::Photon => passes::render::<C>(sampling, progress),
        _ => tile::render::<C>(sampling, progress),
    }
}

/// Sums of a batch's pixels, in f64.
#[derive(Debug)]
pub(super) struct Canvas {
    region: Region,
    planes: Vec<Vec<[f64; 3]>>,
}

impl Canvas {
    pub(super) fn new(region: Region, planes: usize) -> Self {
        Self { region, planes: vec![vec![[0.0; 3]; region.pixels()]; planes] }
    }

    /// Adds to a pixel of the frame; what is outside of the region is not kept.
    #[inline]
    pub(super) fn add(&mut self, plane: usize, [x, y]: [u32; 2], value: glam::DVec3) {
        let Region { x: left, y: top, width, height } = self.region;
        let (column, row) = (x.wrapping_sub(left), y.wrapping_sub(top));
        if column < width && row < height {
            let pixel = &mut self.planes[plane][row as usize * width as usize + column as usize];
            for (sum, value) in pixel.iter_mut().zip(value.to_array()) {
                *sum += value;
            }
        }
    }

    pub(super) fn finish(self, batch: Batch, invalid: InvalidSamples, rays: u64) -> Sum {
        self.finish_with(batch, invalid, rays, Vec::new())
    }

    pub(super) fn finish_with(
        self,
        batch: Batch,
        invalid: InvalidSamples,
        rays: u64,
        tile_rays: Vec<u32>,
    ) -> Sum {
        // What f64 holds but f32 does not is as bright as f32 can be: a partial sum must stay finite.
        let narrow = |sum: [f64; 3]| sum.map(|c| c.min(f64::from(f32::MAX)) as f32);
        let planes: Vec<Plane> =
            self.planes.into_iter().map(|plane| plane.into_iter().map(narrow).collect()).collect();
        Sum { batch, planes, invalid, rays, tile_rays }
    }
}

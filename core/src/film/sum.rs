//! What a batch adds up to.

use super::{batch::Batch, invalid::InvalidSamples};

/// One picture's worth of sums: linear Rec.709 a pixel, row by row from the top of the region.
pub type Plane = Vec<[f32; 3]>;

/// Light summed over the samples of a batch. Added in f64, kept in the f32 of an EXR.
///
/// Invariant: at least one plane; each has one entry for each pixel of the batch's region, finite.
#[derive(Clone, Debug, PartialEq)]
pub struct Sum {
    /// Which samples.
    pub batch: Batch,
    /// The picture first, then each layer in the settings' order.
    pub planes: Vec<Plane>,
    /// Samples that were dropped.
    pub invalid: InvalidSamples,
    /// Rays traced, shadow rays included.
    pub rays: u64,
}

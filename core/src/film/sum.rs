//! What a batch adds up to.

use super::{batch::Batch, invalid::InvalidSamples};

/// One picture's worth of sums or means: linear Rec.709 a pixel, row by row from the top of its region.
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
    /// Rays of each tile of the frame that the region meets, in their order, where samples are to be allocated; else empty.
    pub tile_rays: Vec<u32>,
}

impl Sum {
    /// BLAKE3 over batch, values and counts: equal for equal sums, whatever the file they came in.
    /// (An EXR's attributes have no fixed order, so files of equal sums can differ.)
    pub fn hash(&self) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        let Batch { region, replicate, block } = self.batch;
        let sizes = [region.x, region.y, region.width, region.height, replicate];
        for n in sizes.into_iter().chain([block.index, block.start, block.count, self.planes.len() as u32]) {
            hasher.update(&n.to_le_bytes());
        }
        for n in [self.invalid.nan, self.invalid.infinite, self.invalid.negative, self.rays] {
            hasher.update(&n.to_le_bytes());
        }
        for n in &self.tile_rays {
            hasher.update(&n.to_le_bytes());
        }
        let mut row = Vec::new();
        for pixels in self.planes.iter().flat_map(|plane| plane.chunks(1024)) {
            row.clear();
            row.extend(pixels.iter().flatten().flat_map(|value| value.to_le_bytes()));
            hasher.update(&row);
        }
        hasher.finalize().into()
    }
}

//! Where samples are worth most: decided for each half of the replicates by the other.

use super::{
    allocation::{Allocation, Allocations, SHARE_MAX, SHARE_MIN, UNIT},
    append::Prefix,
    error::{EPSILON, window_mean},
    grid::Grid,
    schedule::Schedule,
    size::{Region, Size},
};

/// Fewest replicates: two in each half, which have a spread.
pub const REPLICATES_MIN: u32 = 4;
/// Samples of each replicate that a decision needs: fewer tell too little of their error.
const SAMPLES_MIN: u32 = 16;
/// It is taken after this part of all samples at the latest, so that there are some left to allocate.
const PART: u32 = 2;
/// Halvings of the scale of all shares: more than the digits of an f64.
const HALVINGS: u32 = 64;

/// A job's samples that are surely enough for a decision, in each replicate: twice the longest first block.
pub const SAMPLES_ENOUGH: u32 = 512;

/// Samples a pixel that a job needs, so that there is something to decide, by a schedule of [`SAMPLES_ENOUGH`] samples: small
/// pictures have longer first blocks.
pub fn samples_min(schedule: &Schedule) -> u32 {
    let blocks = first_with_enough(schedule).unwrap_or(schedule.blocks().len());
    PART * schedule.samples_after(blocks) * schedule.replicates()
}

fn first_with_enough(schedule: &Schedule) -> Option<usize> {
    schedule.checkpoints().into_iter().find(|blocks| schedule.samples_after(*blocks) >= SAMPLES_MIN)
}

/// Number of blocks after which a job of so many samples a replicate allocates those to come: its first checkpoint with enough
/// of them, whatever comes after; `None` where there are too few samples.
pub fn decided_after(schedule: &Schedule, samples: u32) -> Option<u32> {
    let blocks = first_with_enough(schedule)?;
    (schedule.samples_after(blocks) <= samples / PART).then_some(blocks as u32)
}

/// An allocation for each half of the replicates, from what the other has so far; `None` for fewer than
/// [`REPLICATES_MIN`] replicates, or where those have no samples or not equally many.
///
/// A tile whose pixels add v to the squared relative error with one sample each, at c rays a sample, is given n ∝ √(v/c)
/// samples: that makes Σ v/n smallest for a given Σ n c (Neyman 1934). Pixels have as many in the mean as without.
///
/// What a half is given is not a function of its own samples, so that the mean of each of its replicates stays without
/// bias, whatever the number of samples that it is a mean of; and those means count alike. With one decision in a job this is
/// exact: a second one would see, in the other half, what this half's samples had decided there.
pub fn allocate(frame: Size, region: Region, prefixes: &[Vec<Prefix>]) -> Option<Allocations> {
    let first = prefixes.first()?.first()?;
    let replicates = prefixes[0].len() as u32;
    let level = prefixes.iter().flatten().all(|p| p.samples() == first.samples());
    if replicates < REPLICATES_MIN || first.samples() == 0 || !level {
        return None;
    }
    let of_half = |half: usize| {
        let other = Half::new(region, prefixes, 1 - half, Grid::of(frame));
        Allocation::new(frame, first.samples(), other.shares(Grid::of(frame)))
    };
    Some(Allocations([of_half(0), of_half(1)]))
}

/// What one half of the replicates knows.
struct Half {
    region: Region,
    /// Each pixel's part of the squared relative error.
    errors: Vec<f64>,
    /// Rays of each tile of the frame that was met; empty where they were not counted.
    rays: Vec<(usize, f64)>,
}

impl Half {
    fn new(region: Region, prefixes: &[Vec<Prefix>], half: usize, grid: Grid) -> Self {
        let mut errors = Vec::with_capacity(region.pixels());
        let mut luminance = Vec::with_capacity(region.pixels());
        let mut rays = Vec::new();
        for replicates in prefixes {
            let own: Vec<&Prefix> = replicates.iter().skip(half).step_by(2).collect();
            let sums: Vec<&[f64]> = own.iter().map(|p| p.layer(0)).collect();
            let (k, scale) = (own.len() as f64, 1.0 / f64::from(own[0].samples()));
            for pixel in 0..own[0].region().pixels() {
                let (mut y, mut v) = (0.0, 0.0);
                for (c, weight) in [0.2126, 0.7152, 0.0722].into_iter().enumerate() {
                    let values = sums.iter().map(|x| x[3 * pixel + c] * scale);
                    let mean = values.clone().sum::<f64>() / k;
                    v += values.map(|x| (x - mean) * (x - mean)).sum::<f64>() / (k - 1.0);
                    y += weight * mean;
                }
                luminance.push(y);
                errors.push(v / 3.0);
            }
            for prefix in own {
                rays.extend(prefix.rays_of_tiles(grid));
            }
        }
        let (width, height) = (region.width as usize, region.height as usize);
        let mean = luminance.iter().sum::<f64>() / luminance.len() as f64;
        for (pixel, error) in errors.iter_mut().enumerate() {
            let local = window_mean(&luminance, width, height, pixel % width, pixel / width);
            let square = local * local + EPSILON * mean * mean;
            *error = if square > 0.0 { *error / square } else { 0.0 };
        }
        Self { region, errors, rays }
    }

    fn shares(&self, grid: Grid) -> Vec<u8> {
        let tiles = self.tiles(grid);
        let all: f64 = tiles.iter().map(|tile| tile.pixels).sum();
        let of = |scale: f64| -> Vec<u8> { tiles.iter().map(|tile| share(scale * tile.worth())).collect() };
        let given = |shares: &[u8]| -> f64 {
            shares.iter().zip(&tiles).map(|(share, tile)| f64::from(*share) * tile.pixels).sum()
        };
        let most = tiles.iter().map(Tile::worth).fold(0.0, f64::max);
        if most == 0.0 || !most.is_finite() {
            return vec![UNIT; tiles.len()];
        }
        // At the lower end all shares are the smallest, at the upper end the largest one is the largest there is.
        let (mut low, mut high) = (0.0, f64::from(SHARE_MAX) / most * f64::from(1 << 20));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if given(&of(middle)) > f64::from(UNIT) * all { high = middle } else { low = middle }
        }
        of(low)
    }

    fn tiles(&self, grid: Grid) -> Vec<Tile> {
        let mut tiles = vec![Tile::default(); grid.tiles()];
        let Region { x, y, width, .. } = self.region;
        for (pixel, error) in self.errors.iter().enumerate() {
            let tile = &mut tiles[grid.tile([x + pixel as u32 % width, y + pixel as u32 / width])];
            tile.error += error;
            tile.pixels += 1.0;
        }
        for (tile, rays) in &self.rays {
            tiles[*tile].rays += rays;
        }
        tiles
    }
}

/// A tile as one half sees it.
#[derive(Clone, Copy, Debug, Default)]
struct Tile {
    error: f64,
    rays: f64,
    pixels: f64,
}

impl Tile {
    /// √(v/c), up to a factor that all tiles have.
    fn worth(&self) -> f64 {
        let rays = if self.rays > 0.0 { self.rays } else { self.pixels };
        if self.error > 0.0 { (self.error / rays).sqrt() } else { 0.0 }
    }
}

fn share(eighths: f64) -> u8 {
    eighths.round().clamp(f64::from(SHARE_MIN), f64::from(SHARE_MAX)) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{
        batch::{Batch, Block},
        invalid::InvalidSamples,
        sum::{Plane, Sum},
    };
    use std::ops::Range;

    const FRAME: Size = Size { width: 48, height: 16 };
    const REPLICATES: u32 = 4;

    /// Uniform numbers in 0..1 from a counter (PCG output of an LCG).
    fn uniform(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        let x = (((*state >> 18) ^ *state) >> 27) as u32;
        f64::from(x.rotate_right((*state >> 59) as u32)) / 4294967296.0
    }

    /// Adds a block whose samples are what `sample` says of a tile, the same for all of its pixels.
    fn add(
        prefixes: &mut [Prefix],
        block: Block,
        allocations: Option<&Allocations>,
        mut sample: impl FnMut(usize) -> f64,
    ) {
        add_pixels(prefixes, block, allocations, |indices| {
            let tiles: Vec<f32> =
                (0..3).map(|tile| indices(tile).map(|_| sample(tile)).sum::<f64>() as f32).collect();
            (0..FRAME.pixels() as usize).map(|pixel| [tiles[pixel % 48 / 16]; 3]).collect()
        });
    }

    /// Adds a block, made of what each tile has of its samples.
    fn add_pixels(
        prefixes: &mut [Prefix],
        block: Block,
        allocations: Option<&Allocations>,
        mut plane: impl FnMut(&dyn Fn(usize) -> Range<u32>) -> Plane,
    ) {
        for prefix in prefixes {
            let replicate = prefix.replicate();
            let allocation = allocations.map(|both| both.of(replicate));
            let indices = |tile| allocation.map_or(block.samples(), |a| a.samples(tile, block));
            let batch = Batch { region: FRAME.frame(), replicate, block };
            let sum = Sum {
                batch,
                planes: vec![plane(&indices)],
                invalid: InvalidSamples::default(),
                rays: 1,
                tile_rays: if allocation.is_none() { vec![1, 1, 9] } else { Vec::new() },
            };
            match allocation {
                Some(allocation) => prefix.append_allocated(&sum, allocation).unwrap(),
                None => prefix.append(&sum).unwrap(),
            }
        }
    }

    fn begun() -> Vec<Prefix> {
        (0..REPLICATES).map(|replicate| Prefix::empty(FRAME.frame(), replicate, 1)).collect()
    }

    const FIRST: Block = Block { index: 0, start: 0, count: 4 };
    const REST: Block = Block { index: 1, start: 4, count: 12 };

    #[test]
    fn tiles_with_more_error_get_more_and_those_that_cost_more_get_less() {
        let mut state = 3;
        let mut prefixes = begun();
        // The second tile has four times the deviation of the first; the third, too, and costs nine times as much.
        add_pixels(&mut prefixes, FIRST, None, |_| {
            let mut one =
                |width: f64| (0..4).map(|_| 1.0 + width * (uniform(&mut state) - 0.5)).sum::<f64>() as f32;
            (0..FRAME.pixels() as usize).map(|pixel| [one([0.1, 0.4, 0.4][pixel % 48 / 16]); 3]).collect()
        });
        let both = allocate(FRAME, FRAME.frame(), &[prefixes]).unwrap();
        for half in &both.0 {
            // 0.1, 0.4 and 0.4/3, times what makes their mean 1: 0.47, 1.89 and 0.63. Errors of 256 pixels that are told by two
            // replicates are known to 9 %, shares to half of that and to an eighth.
            for (share, expected) in half.shares().iter().zip([0.47, 1.89, 0.63]) {
                let off = f64::from(*share) / 8.0 - expected;
                assert!(off.abs() < 0.125 + 3.0 * 0.045 * expected, "{:?}", half.shares());
            }
        }
    }

    #[test]
    fn too_few_replicates_or_none_without_samples_decide_nothing() {
        let mut prefixes = begun();
        assert_eq!(allocate(FRAME, FRAME.frame(), &[prefixes.clone()]), None);
        add(&mut prefixes, FIRST, None, |_| 0.0);
        let both = allocate(FRAME, FRAME.frame(), &[prefixes.clone()]).unwrap();
        assert_eq!(both.0[0].shares(), [UNIT; 3], "nothing is known of a black picture");
        add(&mut prefixes[..1], REST, None, |_| 0.0);
        assert_eq!(allocate(FRAME, FRAME.frame(), &[prefixes.clone()]), None);
        prefixes.truncate(3);
        assert_eq!(allocate(FRAME, FRAME.frame(), &[prefixes]), None);
    }

    /// Mean over many jobs of what is off the true mean 1 in the second tile, and its standard error. Light comes in
    /// spikes: a fifth of the samples have five, so that a half that has met few of them thinks that it needs no more.
    fn bias(decides: impl Fn(Allocations) -> Allocations) -> (f64, f64) {
        let mut state = 11;
        let mut offs = Vec::new();
        for _ in 0..10_000 {
            let mut prefixes = begun();
            let mut sample = |tile: usize| match tile {
                1 => {
                    if uniform(&mut state) < 0.2 {
                        5.0
                    } else {
                        0.0
                    }
                }
                _ => 0.9 + 0.2 * uniform(&mut state),
            };
            add(&mut prefixes, FIRST, None, &mut sample);
            let both = decides(allocate(FRAME, FRAME.frame(), std::slice::from_ref(&prefixes)).unwrap());
            add(&mut prefixes, REST, Some(&both), &mut sample);
            let mean = |prefix: &Prefix| prefix.layer(0)[3 * 20] / f64::from(prefix.samples());
            offs.push(prefixes.iter().map(mean).sum::<f64>() / f64::from(REPLICATES) - 1.0);
        }
        let n = offs.len() as f64;
        let mean = offs.iter().sum::<f64>() / n;
        (mean, (offs.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n * (n - 1.0))).sqrt())
    }

    #[test]
    fn the_other_halfs_decision_leaves_no_bias_and_ones_own_would() {
        let (mean, error) = bias(|both| both);
        assert!(mean.abs() < 4.0 * error && error < 3e-3, "{mean} ± {error}");
        let (mean, error) = bias(|Allocations([a, b])| Allocations([b, a]));
        assert!(
            mean < -10.0 * error,
            "the test must see the bias of a decision by one's own samples: {mean} ± {error}"
        );
    }

    #[test]
    fn what_is_kept_is_the_mean_of_what_a_pixel_has() {
        let allocations =
            Allocations([[4, 8, 12], [2, 16, 8]].map(|s| Allocation::new(FRAME, 4, s.to_vec())));
        let mut prefixes = begun();
        let mut of = |_: usize| 3.0;
        add(&mut prefixes, FIRST, None, &mut of);
        add(&mut prefixes, REST, Some(&allocations), &mut of);
        add(&mut prefixes, Block { index: 2, start: 16, count: 1 }, Some(&allocations), &mut of);
        for prefix in &prefixes {
            assert!(prefix.layer(0).iter().all(|sum| (sum / 17.0 - 3.0).abs() < 1e-6), "all samples are 3");
            assert_eq!(Prefix::from_bytes(&prefix.to_bytes()).unwrap(), *prefix);
        }
        let early = Allocations(allocations.0.map(|a| Allocation::new(FRAME, 40, a.shares().to_vec())));
        let batch =
            Batch { region: FRAME.frame(), replicate: 0, block: Block { index: 3, start: 17, count: 1 } };
        let planes = vec![vec![[0.0; 3]; 48 * 16]];
        let sum = Sum { batch, planes, invalid: InvalidSamples::default(), rays: 0, tile_rays: Vec::new() };
        assert!(prefixes[0].append_allocated(&sum, early.of(0)).is_err());
    }

    #[test]
    fn a_decision_comes_early_and_only_where_enough_is_left() {
        let region = Region { x: 0, y: 0, width: 480, height: 270 };
        let after = |samples| {
            let schedule = Schedule::new(region, 1, 4, samples);
            decided_after(&schedule, samples).map(|blocks| schedule.samples_after(blocks as usize))
        };
        assert_eq!(
            [15, 16, 31, 32, 33, 100_000].map(after),
            [None, None, None, Some(16), Some(16), Some(16)]
        );
        let least = |region| samples_min(&Schedule::new(region, 1, 4, SAMPLES_ENOUGH));
        assert_eq!(least(region), 128);
        for (side, samples) in [(1, 2048), (16, 2048), (32, 512), (45, 256), (46, 128)] {
            let region = Region { x: 0, y: 0, width: side, height: side };
            assert_eq!(least(region), samples, "{side}");
            let decided =
                |samples: u32| decided_after(&Schedule::new(region, 1, 4, samples / 4), samples / 4);
            assert!(decided(samples).is_some() && decided(samples - 4).is_none(), "{side}");
        }
    }
}

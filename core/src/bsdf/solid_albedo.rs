//! Directional albedo of a single scattering, reflected or refracted, at the rough surface of glass.
//!
//! Kept is the missing flux M = 1 − E(μ, α, η), met from the rare side and from the dense side.
//!
//! * Planes, of the ratio of indices η from 1.00001 to infinity, are uniform in the mean of y and of blend(y, 1 − y, α),
//!   where y goes from 0 to 1 as √((η − 1) / (η + 1)): M changes within y ~ α of either end.
//! * Rows are those of `albedo`, uniform in √α.
//! * Columns are uniform in the root of how far the cosine is on its way through an interval, which is [0, 1] from the
//!   rare side. From the dense side M bends at the critical angle, within α of its cosine μc = √(1 − 1 / η²), and it is
//!   divided there: columns follow μc from plane to plane. With the distances a and b from the ends of the interval
//!   and k = 5 α the way is blend(a, b, k) below μc and, up to the normal, where nothing happens within α,
//!   a (a + b + k) / (a (a + b + k) + b k).
//!
//! blend(a, b, k) = a (b + k) / (a (b + k) + b (a + k)) goes from 0 to 1, fast within k of either end.
//!
//! It is more important that albedos stay at or below one than that the last of M is returned: nodes are as great as they
//! can be while interpolation does not exceed M. Of uniform light less than a thousandth is lost so (tests).
//!
//! The means 2 ∫ M μ dμ belong to the *interpolated* table, and are kept over α² ln(1 + 1/α²), on a finer
//! grid of planes and rows. For the same reason they are never less than what they stand for.
//!
//! `solid_albedo.bin` holds M as little-endian u16 in units of 1 / 65535, then the means as f32. To write it anew:
//! `cargo test -p ovtigre-core --lib bsdf::solid_albedo::tests::write -- --ignored`.

use crate::bsdf::albedo::{locate, row_of};

const PLANES: usize = 52;
const ROWS: usize = 37;
/// From the rare side, and from the dense side.
const COLUMNS: [usize; 2] = [33, 53];
/// √((η − 1) / (η + 1)) of the first plane: glass whose index is nearer to that around it is smooth (see `glass`).
const FIRST: f32 = 0.002_236_062_4;
/// Columns from the dense side up to the critical angle, without that of it.
const BELOW: usize = 24;
/// Breadth of what happens at the end of an interval of cosines, over α.
const BREADTH: f32 = 5.0;
const NODES: usize = PLANES * ROWS * (COLUMNS[0] + COLUMNS[1]);
/// Planes and rows of the means for one of the nodes.
const FINER: [usize; 2] = [2, 3];
const MEAN_PLANES: usize = (PLANES - 1) * FINER[0] + 1;
const MEAN_ROWS: usize = (ROWS - 1) * FINER[1] + 1;
const MEANS: usize = 2 * MEAN_PLANES * MEAN_ROWS;
const LENGTH: usize = 2 * NODES + 4 * MEANS;
const UNIT: f32 = 1.0 / 65535.0;

const BYTES: &[u8; LENGTH] = include_bytes!("solid_albedo.bin");
/// By side, plane, row and column.
static TABLE: &[[u8; 2]] = BYTES.split_at(2 * NODES).0.as_chunks().0;
/// By side, plane and row.
static MEAN_TABLE: &[[u8; 4]] = BYTES.split_at(2 * NODES).1.as_chunks().0;

/// The side that a direction is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    /// Of the smaller refractive index.
    Rare,
    /// Of the larger.
    Dense,
}

impl Side {
    /// The opposite one.
    pub(super) fn other(self) -> Self {
        match self {
            Self::Rare => Self::Dense,
            Self::Dense => Self::Rare,
        }
    }
}

/// Columns of one side: how they are divided among cosines.
#[derive(Clone, Copy, Debug)]
struct Columns {
    /// The first node of this side.
    first: usize,
    /// Nodes.
    count: usize,
    /// The cosine at which they are divided.
    critical: f32,
    /// One less that.
    rest: f32,
    /// Columns below it.
    below: f32,
    /// k of the head of this file.
    breadth: f32,
}

impl Columns {
    fn of(side: Side, alpha: f32, ratio: f32) -> Self {
        let breadth = BREADTH * alpha;
        match side {
            Side::Rare => Self { first: 0, count: COLUMNS[0], critical: 0.0, rest: 1.0, below: 0.0, breadth },
            Side::Dense => {
                let squared = 1.0 / (ratio * ratio);
                let critical = ((ratio - 1.0) * (ratio + 1.0) * squared).sqrt();
                let (first, count, below) = (PLANES * ROWS * COLUMNS[0], COLUMNS[1], BELOW as f32);
                Self { first, count, critical, rest: squared / (1.0 + critical), below, breadth }
            }
        }
    }

    /// The column of a cosine, and where above it.
    #[inline]
    fn locate(&self, mu: f32) -> (usize, f32) {
        let &Self { count, critical, rest, below, breadth, .. } = self;
        let all = (count - 1) as f32;
        // Selections, where a branch would often be mispredicted.
        let upper = mu >= critical;
        let (first, columns) = if upper { (below, all - below) } else { (0.0, below) };
        let (from, to) = if upper { (critical, 1.0) } else { (0.0, critical) };
        let (a, b) = (mu - from, to - mu);
        let (gone, left) =
            if upper { (a * (rest + breadth), b * breadth) } else { (a * (b + breadth), b * (a + breadth)) };
        // Where the critical angle is rounded to the normal, both may be nothing.
        let way = gone / (gone + left).max(f32::MIN_POSITIVE);
        let place = (first + columns * way.sqrt()).clamp(0.0, all);
        let column = (place as usize).min(count - 2);
        (column, place - column as f32)
    }
}

/// Where a roughness and a ratio of indices fall in the table.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    plane: usize,
    row: usize,
    along: f32,
    across: f32,
    alpha2: f32,
    columns: [Columns; 2],
}

impl Cell {
    /// For α within 1e-3..=1 and a ratio of at least one.
    pub(super) fn of(alpha: f32, ratio: f32) -> Self {
        let (plane, along) = locate(plane_of(alpha, ratio), PLANES);
        let (row, across) = locate(row_of(alpha), ROWS);
        let columns = [Side::Rare, Side::Dense].map(|side| Columns::of(side, alpha, ratio));
        Self { plane, row, along, across, alpha2: alpha * alpha, columns }
    }

    /// M of a direction with this cosine, which is positive.
    #[inline]
    pub(super) fn missing(&self, side: Side, mu: f32) -> f32 {
        let columns = &self.columns[side as usize];
        let count = columns.count;
        let (column, t) = columns.locate(mu);
        let plane = |plane: usize| {
            let first = columns.first + (plane * ROWS + self.row) * count + column;
            let nodes = &TABLE[first..][..count + 2];
            let node = |i: usize| f32::from(u16::from_le_bytes(nodes[i]));
            let low = lerp(node(0), node(1), t);
            lerp(low, lerp(node(count), node(count + 1), t), self.across)
        };
        UNIT * lerp(plane(self.plane), plane(self.plane + 1), self.along)
    }

    /// Its cosine-weighted mean; `ell` is ln(1 + 1/α²).
    pub(super) fn mean(&self, side: Side, ell: f32) -> f32 {
        let (plane, along) = locate((self.plane as f32 + self.along) / (PLANES - 1) as f32, MEAN_PLANES);
        let (row, across) = locate((self.row as f32 + self.across) / (ROWS - 1) as f32, MEAN_ROWS);
        let at = |plane: usize| {
            let first = (side as usize * MEAN_PLANES + plane) * MEAN_ROWS + row;
            let node = |i: usize| f32::from_le_bytes(MEAN_TABLE[first + i]);
            lerp(node(0), node(1), across)
        };
        lerp(at(plane), at(plane + 1), along) * self.alpha2 * ell
    }
}

/// The place of a ratio of indices among the planes, 0..=1.
fn plane_of(alpha: f32, ratio: f32) -> f32 {
    let y = (((ratio - 1.0) / (ratio + 1.0)).sqrt() - FIRST) / (1.0 - FIRST);
    let (gone, left) = (y * (1.0 - y + alpha), (1.0 - y) * (y + alpha));
    0.5 * (y + gone / (gone + left))
}

#[inline]
fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

#[cfg(test)]
mod tests;

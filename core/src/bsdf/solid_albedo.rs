//! Directional albedo of a single scattering, reflected or refracted, at the rough surface of glass.
//!
//! Kept is the missing flux M = 1 − E(μ, α, η), met from the rare side and from the dense side. Coordinates of
//! direction and roughness are those of `albedo`; planes are uniform in √((η − 1) / (η + 1)) from η = 1.1 to 3.
//! From the dense side M has a kink at the critical angle that no small table resolves, and it is more
//! important that albedos stay at or below one than that the last of it is returned:
//! from every node is subtracted more than interpolation errs by in the cells around it (test below), 0.9 % at most.
//!
//! The means 2 ∫ M μ dμ belong to the *interpolated* table; they are linear in the plane, and are kept over
//! α² ln(1 + 1/α²), on a finer grid of α.
//!
//! `solid_albedo.bin` holds both tables as little-endian f32. To write it anew:
//! `cargo test -p ovtigre-core --lib bsdf::solid_albedo::tests::write -- --ignored`.

use crate::bsdf::albedo::{column_of, locate, row_of};
use core::ops::RangeInclusive;
use glam::Vec3;

const PLANES: usize = 10;
const ROWS: usize = 20;
const COLUMNS: usize = 40;
/// Nodes of the means a row.
const FINER: usize = 16;
const MEANS: usize = (ROWS - 1) * FINER + 1;
const NODES: usize = 2 * PLANES * ROWS * COLUMNS;
const LENGTH: usize = 4 * (NODES + 2 * PLANES * MEANS);
/// The least and the most that is taken off a node.
#[cfg(test)]
const LEAST: f64 = 8e-4;
#[cfg(test)]
const MOST: f64 = 0.009;
/// Factor of the means: more than their interpolation errs by.
const SAFETY: f32 = 1.002;
/// Ratios of indices in the table. Below the least, refraction at grazing angles changes within
/// η − 1 ~ α², faster than planes can follow.
const RATIOS: RangeInclusive<f32> = 1.1..=3.0;
/// √((η − 1) / (η + 1)) of the least of them, and of the greatest.
const FIRST: f32 = 0.218_217_9;
const LAST: f32 = core::f32::consts::FRAC_1_SQRT_2;

const BYTES: &[u8; LENGTH] = include_bytes!("solid_albedo.bin");
/// By side, plane, row and column; then the means by side, plane and finer row.
static TABLE: [f32; LENGTH / 4] = decode();

#[expect(clippy::large_stack_arrays, reason = "evaluated by the compiler")]
const fn decode() -> [f32; LENGTH / 4] {
    let mut out = [0.0; LENGTH / 4];
    let mut i = 0;
    while i < out.len() {
        out[i] = f32::from_le_bytes([BYTES[4 * i], BYTES[4 * i + 1], BYTES[4 * i + 2], BYTES[4 * i + 3]]);
        i += 1;
    }
    out
}

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

/// Where a roughness and a ratio of indices fall in the table.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    plane: usize,
    row: usize,
    along: f32,
    across: f32,
    alpha2: f32,
}

impl Cell {
    /// For α within 1e-3..=1 and a ratio of at least one; `None` where that is not in the table.
    pub(super) fn of(alpha: f32, ratio: f32) -> Option<Self> {
        if !RATIOS.contains(&ratio) {
            return None;
        }
        let (plane, along) =
            locate((((ratio - 1.0) / (ratio + 1.0)).sqrt() - FIRST) / (LAST - FIRST), PLANES);
        let (row, across) = locate(row_of(alpha), ROWS);
        Some(Self { plane, row, along, across, alpha2: alpha * alpha })
    }

    /// M of a direction with `w.z` > 0 and stretched length σ.
    #[inline]
    pub(super) fn missing(&self, side: Side, w: Vec3, stretched: f32) -> f32 {
        let (column, t) = locate(column_of(w, self.alpha2, stretched), COLUMNS);
        let plane = |plane: usize| {
            let i = ((side as usize * PLANES + plane) * ROWS + self.row) * COLUMNS + column;
            let low = lerp(TABLE[i], TABLE[i + 1], t);
            lerp(low, lerp(TABLE[i + COLUMNS], TABLE[i + COLUMNS + 1], t), self.across)
        };
        lerp(plane(self.plane), plane(self.plane + 1), self.along)
    }

    /// Its cosine-weighted mean; `ell` is ln(1 + 1/α²).
    pub(super) fn mean(&self, side: Side, ell: f32) -> f32 {
        let (finer, t) = locate((self.row as f32 + self.across) / (ROWS - 1) as f32, MEANS);
        let plane = |plane: usize| {
            let i = NODES + (side as usize * PLANES + plane) * MEANS + finer;
            lerp(TABLE[i], TABLE[i + 1], t)
        };
        SAFETY * lerp(plane(self.plane), plane(self.plane + 1), self.along) * self.alpha2 * ell
    }
}

#[inline]
fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + (b - a) * t
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::ggx::Ggx;
    use crate::bsdf::tests::oracle::{alpha_of, cosine_of, hemisphere, passed, visible_mean};
    use rayon::prelude::*;

    /// E met from the side whose index is 1 of an interface with relative index `eta`.
    fn integrate(mu: f64, alpha: f64, eta: f64, n: usize) -> f64 {
        let [even] = visible_mean(mu, alpha, n, |dot, cos| {
            let up = passed(alpha, mu, 2.0 * dot * cos - mu);
            let squared = 1.0 - (1.0 - dot * dot) / (eta * eta);
            if squared <= 0.0 {
                return [up];
            }
            let root = squared.sqrt();
            let parallel = (eta * dot - root) / (eta * dot + root);
            let perpendicular = (dot - eta * root) / (dot + eta * root);
            let reflected = 0.5 * (parallel * parallel + perpendicular * perpendicular);
            let down = passed(alpha, mu, mu / eta - cos * (dot / eta - root));
            [reflected * up + (1.0 - reflected) * down]
        });
        even
    }

    fn ratio_of(plane: f64) -> f64 {
        let (first, last) = (f64::from(FIRST), f64::from(LAST));
        let y = first + (last - first) * plane / (PLANES - 1) as f64;
        (1.0 + y * y) / (1.0 - y * y)
    }

    fn missing(side: usize, plane: f64, row: f64, column: f64, n: usize) -> f64 {
        let (alpha, ratio) = (alpha_of(row / (ROWS - 1) as f64), ratio_of(plane));
        let mu = cosine_of(column / (COLUMNS - 1) as f64, alpha);
        1.0 - integrate(mu, alpha, if side == 0 { ratio } else { 1.0 / ratio }, n)
    }

    /// Side, plane, row and column of a node.
    fn place(i: usize) -> [usize; 4] {
        [i / COLUMNS / ROWS / PLANES, i / COLUMNS / ROWS % PLANES, i / COLUMNS % ROWS, i % COLUMNS]
    }

    fn exact(i: usize) -> f64 {
        let [side, plane, row, column] = place(i);
        missing(side, plane as f64, row as f64, column as f64, 160)
    }

    /// The most that interpolation between exact nodes exceeds the integral by in the cell above a node.
    fn excess(nodes: &[f64], i: usize) -> f64 {
        let [side, plane, row, column] = place(i);
        if plane + 1 == PLANES || row + 1 == ROWS || column + 1 == COLUMNS {
            return 0.0;
        }
        let corner = |k: usize| nodes[i + (k & 1) + (k >> 1 & 1) * COLUMNS + (k >> 2) * COLUMNS * ROWS];
        // No more can be taken off nodes than they are.
        if (0..8).any(|k| corner(k) < 2.0 * MOST) {
            return MOST;
        }
        let columns = [0.25, 0.5, 0.75];
        let mut most: f64 = 0.0;
        for (p, r, c) in (0..12).map(|k| ((k / 6) as f64 / 2.0, (k / 3 % 2) as f64 / 2.0, columns[k % 3])) {
            let share = |bit: usize, share: f64| if bit > 0 { share } else { 1.0 - share };
            let weight = |k: usize| share(k & 1, c) * share(k & 2, r) * share(k & 4, p);
            let between: f64 = (0..8).map(|k| weight(k) * corner(k)).sum();
            let there = missing(side, plane as f64 + p, row as f64 + r, column as f64 + c, 112);
            most = most.max(between - there);
        }
        most
    }

    /// What is taken off a node: more than interpolation in the cells around it errs by.
    fn margin(excesses: &[f64], i: usize) -> f64 {
        let [_, plane, row, column] = place(i);
        let around = |k: usize| {
            let (c, r, p) = (k & 1, k >> 1 & 1, k >> 2);
            (column >= c && row >= r && plane >= p)
                .then(|| excesses[i - c - r * COLUMNS - p * COLUMNS * ROWS])
        };
        (1.3 * (0..8).filter_map(around).fold(0.0, f64::max) + LEAST).min(MOST)
    }

    #[test]
    #[ignore = "writes solid_albedo.bin"]
    fn write() {
        let nodes: Vec<f64> = (0..NODES).into_par_iter().map(exact).collect();
        let excesses: Vec<f64> = (0..NODES).into_par_iter().map(|i| excess(&nodes, i)).collect();
        let mut table: Vec<f32> =
            (0..NODES).map(|i| (nodes[i] - margin(&excesses, i)).max(0.0) as f32).collect();
        for i in 0..2 * PLANES * MEANS {
            let row = (i % MEANS) as f64 / FINER as f64;
            let above = (row as usize).min(ROWS - 2);
            let first = (i / MEANS * ROWS + above) * COLUMNS;
            let (f, alpha) = (row - above as f64, alpha_of(row / (ROWS - 1) as f64));
            let at = |column: usize| {
                let (a, b) = (table[first + column], table[first + COLUMNS + column]);
                f64::from(a) + f64::from(b - a) * f
            };
            let [missing] = hemisphere(COLUMNS, alpha, |c, t, _| [at(c) + (at(c + 1) - at(c)) * t]);
            let c = alpha * alpha;
            table.push((missing / (c * libm::log(1.0 + 1.0 / c))) as f32);
        }
        let bytes: Vec<u8> = table.into_iter().flat_map(f32::to_le_bytes).collect();
        assert_eq!(bytes.len(), LENGTH);
        std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/src/bsdf/solid_albedo.bin"), bytes).unwrap();
    }

    #[test]
    fn the_table_is_the_integral_less_a_margin() {
        for i in (0..NODES).step_by(131) {
            let exact = exact(i);
            let taken = exact - f64::from(TABLE[i]);
            let range = LEAST.min(exact) - 1e-6..MOST + 1e-6;
            assert!(range.contains(&taken), "node {i}: {taken} taken of {exact}");
        }
    }

    #[test]
    fn interpolation_never_exceeds_the_integral() {
        for i in (0..NODES).step_by(29) {
            let off = [0.5, 0.3, 0.7, 0.15, 0.85][i % 5];
            let column = ((i % COLUMNS) as f64 + off).min(38.0 + off);
            let row = ((i / COLUMNS % ROWS) as f64 + 0.5).min(18.5);
            let plane = ((i / COLUMNS / ROWS % PLANES) as f64 + 0.5).min(8.5);
            let (k, alpha) = (i / COLUMNS / ROWS / PLANES, alpha_of(row / (ROWS - 1) as f64));
            let mu = cosine_of(column / (COLUMNS - 1) as f64, alpha);
            let ggx = Ggx::new(alpha as f32).unwrap();
            let w = Vec3::new((1.0 - mu * mu).sqrt() as f32, 0.0, mu as f32);
            let side = if k == 0 { Side::Rare } else { Side::Dense };
            let cell = Cell::of(ggx.alpha, ratio_of(plane) as f32).unwrap();
            let got = f64::from(cell.missing(side, w, ggx.stretched(w)));
            let excess = got - missing(k, plane, row, column, 96);
            assert!(excess < 0.0, "{excess} too much: {side:?} α {alpha} μ {mu} η {}", ratio_of(plane));
        }
    }
}

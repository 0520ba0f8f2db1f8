//! Directional albedo of the single-scattering GGX lobe, tabulated.
//!
//! With reflectance 1 a rough interface returns E(μ, α) < 1: what scatters twice between microfacets is
//! missing from the lobe. Two numbers a node are kept:
//! the missing energy M = 1 − E, and C, with which the albedo of the (1 − v·h)⁵ term of Schlick's
//! reflectance is B = (1 − M) (1 − μ)⁵ + C.
//!
//! Rows are uniform in √α (glTF's roughness) from α = 1e-3 to 1. Columns are uniform in t, where
//! x = μ / σ (σ the stretched length, see `ggx`) is 2t² up to one half and 1 − 2(1 − t)² above: in x the
//! table looks alike for every α, and M behaves as x ln x at both ends. Bilinear interpolation is
//! within 1e-3 of the integral everywhere (test below).
//!
//! The hemispherical means 2 ∫ · μ dμ are integrals of the *interpolated* table, so that lobes built as
//! (1 − E(v)) (1 − E(l)) / (π (1 − Ē)) have the albedo 1 − E(v) to rounding. The mean of M is kept over
//! α² ln(1 + 1/α²), which varies little.
//!
//! `albedo.bin` holds both tables as little-endian f32. To write it anew:
//! `cargo test -p ovtigre-core --lib bsdf::albedo::tests::write -- --ignored`.

use crate::bsdf::fresnel::fifth_power;
use crate::bsdf::ggx::SPECULAR_BELOW;
use glam::Vec3;

const ROWS: usize = 64;
const COLUMNS: usize = 64;
/// Nodes of the means a row of the table.
const FINER: usize = 32;
const MEANS: usize = (ROWS - 1) * FINER + 1;
const LENGTH: usize = 8 * (ROWS * COLUMNS + MEANS);

const BYTES: &[u8; LENGTH] = include_bytes!("albedo.bin");

/// M and C by row and column.
static NODES: [[f32; 2]; ROWS * COLUMNS] = decode(0);
/// Scaled mean of M and mean of B.
static MEAN_NODES: [[f32; 2]; MEANS] = decode(ROWS * COLUMNS);

const fn decode<const N: usize>(first: usize) -> [[f32; 2]; N] {
    let mut out = [[0.0; 2]; N];
    let mut i = 0;
    while i < N {
        out[i] = [float((first + i) * 8), float((first + i) * 8 + 4)];
        i += 1;
    }
    out
}

const fn float(at: usize) -> f32 {
    f32::from_le_bytes([BYTES[at], BYTES[at + 1], BYTES[at + 2], BYTES[at + 3]])
}

/// Where a roughness falls among the rows.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    index: usize,
    fraction: f32,
}

/// Means over the hemisphere, 2 ∫ · μ dμ.
#[derive(Clone, Copy, Debug)]
pub struct Means {
    /// Of M.
    pub missing: f32,
    /// Of B.
    pub grazing: f32,
}

impl Row {
    /// Of an α within 1e-3..=1.
    pub fn of(alpha: f32) -> Self {
        let (index, fraction) = locate(row_of(alpha), ROWS);
        Self { index, fraction }
    }

    /// M and B of a direction with `w.z` > 0 and stretched length σ.
    #[inline]
    pub fn missing_and_grazing(self, w: Vec3, alpha2: f32, stretched: f32) -> (f32, f32) {
        let (missing, correction) = self.at(column_of(w, alpha2, stretched));
        let grazing = (1.0 - missing) * fifth_power((1.0 - w.z).max(0.0)) + correction;
        (missing, grazing.clamp(0.0, 1.0 - missing))
    }

    #[inline]
    fn at(self, t: f32) -> (f32, f32) {
        let (column, fraction) = locate(t, COLUMNS);
        let i = self.index * COLUMNS + column;
        let [missing0, correction0] = lerp(NODES[i], NODES[i + 1], fraction);
        let [missing1, correction1] = lerp(NODES[i + COLUMNS], NODES[i + COLUMNS + 1], fraction);
        let [missing, correction] = lerp([missing0, correction0], [missing1, correction1], self.fraction);
        (missing, correction)
    }

    /// The means for the same α; `ell` is ln(1 + 1/α²).
    pub fn means(self, alpha2: f32, ell: f32) -> Means {
        let position = (self.index as f32 + self.fraction) / (ROWS - 1) as f32;
        let (i, fraction) = locate(position, MEANS);
        let [scaled, grazing] = lerp(MEAN_NODES[i], MEAN_NODES[i + 1], fraction);
        Means { missing: scaled * alpha2 * ell, grazing }
    }
}

#[inline]
fn lerp(a: [f32; 2], b: [f32; 2], t: f32) -> [f32; 2] {
    [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]
}

/// The place among the rows of a table, 0..=1, of a roughness.
pub(super) fn row_of(alpha: f32) -> f32 {
    let first = SPECULAR_BELOW.sqrt();
    (alpha.sqrt() - first) / (1.0 - first)
}

/// The place among the columns of a table, 0..=1, of a direction with `w.z` > 0 and stretched length σ.
#[inline]
pub(super) fn column_of(w: Vec3, alpha2: f32, stretched: f32) -> f32 {
    let x = w.z / stretched;
    // 1 − x without the difference. One root and two selections: a branch here is often mispredicted.
    let rest = alpha2 * (w.x * w.x + w.y * w.y) / (stretched * (stretched + w.z));
    let root = (0.5 * x.min(rest)).sqrt();
    if x < rest { root } else { 1.0 - root }
}

/// The cell of `n` uniform nodes over 0..=1, and where in it.
#[inline]
pub(super) fn locate(position: f32, n: usize) -> (usize, f32) {
    let scaled = position.clamp(0.0, 1.0) * (n - 1) as f32;
    let i = (scaled as usize).min(n - 2);
    (i, scaled - i as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::ggx::Ggx;
    use crate::bsdf::tests::oracle::{alpha_of, cosine_of, hemisphere, passed, visible_mean};

    /// E and the albedo of (1 − v·h)⁵ at a cosine.
    fn integrate(mu: f64, alpha: f64, n: usize) -> [f64; 2] {
        visible_mean(mu, alpha, n, |dot, cos| {
            let weight = passed(alpha, mu, 2.0 * dot * cos - mu);
            [weight, weight * (1.0 - dot).powi(5)]
        })
    }

    fn node(row: f64, column: f64, n: usize) -> [f64; 2] {
        let alpha = alpha_of(row / (ROWS - 1) as f64);
        let mu = cosine_of(column / (COLUMNS - 1) as f64, alpha);
        let [even, grazing] = integrate(mu, alpha, n);
        [1.0 - even, grazing - even * (1.0 - mu).powi(5)]
    }

    /// The means of the interpolated nodes.
    fn mean(nodes: &[[f32; 2]], row: f64) -> [f64; 2] {
        let alpha = alpha_of(row / (ROWS - 1) as f64);
        let i = (row as usize).min(ROWS - 2);
        let f = row - i as f64;
        let at = |column: usize, k: usize| {
            let (a, b) = (nodes[i * COLUMNS + column][k], nodes[(i + 1) * COLUMNS + column][k]);
            f64::from(a) + f64::from(b - a) * f
        };
        let [missing, grazing] = hemisphere(COLUMNS, alpha, |column, t, mu| {
            let missing = at(column, 0) + (at(column + 1, 0) - at(column, 0)) * t;
            let correction = at(column, 1) + (at(column + 1, 1) - at(column, 1)) * t;
            [missing, ((1.0 - missing) * (1.0 - mu).powi(5) + correction).clamp(0.0, 1.0 - missing)]
        });
        let c = alpha * alpha;
        [missing / (c * libm::log(1.0 + 1.0 / c)), grazing]
    }

    #[test]
    #[ignore = "writes albedo.bin"]
    fn write() {
        let mut nodes = vec![[0.0_f32; 2]; ROWS * COLUMNS];
        for (i, out) in nodes.iter_mut().enumerate() {
            let [a, b] = node((i / COLUMNS) as f64, (i % COLUMNS) as f64, 512);
            *out = [a as f32, b as f32];
        }
        let means = (0..MEANS).map(|i| mean(&nodes, i as f64 / FINER as f64).map(|v| v as f32));
        let bytes: Vec<u8> =
            nodes.iter().copied().chain(means).flatten().flat_map(f32::to_le_bytes).collect();
        assert_eq!(bytes.len(), LENGTH);
        std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/src/bsdf/albedo.bin"), bytes).unwrap();
    }

    #[test]
    fn the_table_is_the_integral() {
        for row in (0..ROWS).step_by(7) {
            for column in (0..COLUMNS).step_by(9) {
                let expected = node(row as f64, column as f64, 256);
                for k in 0..2 {
                    let got = f64::from(NODES[row * COLUMNS + column][k]);
                    assert!(
                        (got - expected[k]).abs() < 3e-4,
                        "row {row} column {column}: {got} {expected:?}"
                    );
                }
            }
        }
        for i in (0..MEANS).step_by(41) {
            let expected = mean(&NODES, i as f64 / FINER as f64);
            for k in 0..2 {
                assert!((f64::from(MEAN_NODES[i][k]) / expected[k] - 1.0).abs() < 1e-6, "mean {i}");
            }
        }
    }

    #[test]
    fn interpolation_is_within_a_thousandth() {
        for row in (0..ROWS - 1).step_by(5) {
            for column in (0..COLUMNS - 1).step_by(4) {
                let (row, column) = (row as f64 + 0.5, column as f64 + 0.5);
                let alpha = alpha_of(row / (ROWS - 1) as f64);
                let mu = cosine_of(column / (COLUMNS - 1) as f64, alpha);
                let [even, grazing] = integrate(mu, alpha, 192);
                let ggx = Ggx::new(alpha as f32).unwrap();
                let w = Vec3::new((1.0 - mu * mu).sqrt() as f32, 0.0, mu as f32);
                let got = Row::of(ggx.alpha).missing_and_grazing(w, ggx.alpha2, ggx.stretched(w));
                let error = (f64::from(got.0) - (1.0 - even)).abs().max((f64::from(got.1) - grazing).abs());
                assert!(error < 1e-3, "α {alpha} μ {mu}: {got:?} for {} {grazing}", 1.0 - even);
            }
        }
    }

    #[test]
    fn means_are_those_of_the_interpolated_table() {
        for i in 0..60 {
            let row = f64::from(i) * 0.79 + 0.03;
            let alpha = alpha_of(row / (ROWS - 1) as f64) as f32;
            let alpha2 = alpha * alpha;
            let ell = libm::log1pf(1.0 / alpha2);
            let got = Row::of(alpha).means(alpha2, ell);
            let [scaled, grazing] = mean(&NODES, row);
            assert!(
                (f64::from(got.missing) / (scaled * f64::from(alpha2 * ell)) - 1.0).abs() < 1e-3,
                "{row}"
            );
            assert!((f64::from(got.grazing) - grazing).abs() < 1e-4, "{row}");
        }
    }
}

//! Cloth: fibres that stand out from a surface and catch light at grazing angles (`KHR_materials_sheen`).
//!
//! A microfacet lobe with Charlie's distribution (Estevez and Kulla 2017), D = (2 + 1/α) sin^(1/α) θₕ / 2π, α the square
//! of the roughness, and Ashikhmin's visibility V = 1 / (4 (cos θₒ + cos θᵢ − cos θₒ cos θᵢ)). Its albedo E exceeds one at
//! grazing angles where α is small. So the lobe is C D V g(o) g(i) with g = 1 / max(1, E): reciprocal, and its albedo is at
//! most C min(1, E), which is what the layer takes from the surface below.
//!
//! `sheen.bin` holds E as little-endian f32: rows uniform in roughness from 0.1 to 1, columns in the root of the cosine.
//! To write it anew: `cargo test -p ovtigre-core --lib bsdf::sheen::tests::write -- --ignored`.

use crate::bsdf::albedo::locate;
use crate::bsdf::event::Scattered;
use crate::bsdf::lobe::Evaluated;
use crate::math::colour::Rgb;
use crate::math::warp;
use core::f32::consts::{FRAC_1_PI, TAU};
use glam::{Vec2, Vec3};

/// Least roughness: below it the lobe is a rim thinner than any pixel.
const LEAST: f32 = 0.1;
const ROWS: usize = 64;
const COLUMNS: usize = 32;
const BYTES: &[u8; 4 * ROWS * COLUMNS] = include_bytes!("sheen.bin");

/// E by row and column.
static NODES: [f32; ROWS * COLUMNS] = {
    let mut out = [0.0; ROWS * COLUMNS];
    let mut i = 0;
    while i < ROWS * COLUMNS {
        let at = 4 * i;
        out[i] = f32::from_le_bytes([BYTES[at], BYTES[at + 1], BYTES[at + 2], BYTES[at + 3]]);
        i += 1;
    }
    out
};

/// The lobe. All directions are above it: z > 0. Letter `S`: broad, but light that fibres reflect, not the base below.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheen {
    colour: Rgb,
    /// 1/α.
    power: f32,
    row: usize,
    fraction: f32,
}

impl Sheen {
    /// Of a colour in 0..=1 and a perceptual roughness; `None` where it is black.
    pub(super) fn new(colour: Rgb, roughness: f32) -> Option<Self> {
        let roughness = roughness.max(LEAST);
        let (row, fraction) = locate((roughness - LEAST) / (1.0 - LEAST), ROWS);
        let sheen = Self { colour, power: 1.0 / (roughness * roughness), row, fraction };
        (colour.max_element() > 0.0).then_some(sheen)
    }

    /// E.
    #[inline]
    fn raw(&self, cos: f32) -> f32 {
        let (column, t) = locate(cos.sqrt(), COLUMNS);
        let i = self.row * COLUMNS + column;
        let at = |i: usize| NODES[i] + (NODES[i + 1] - NODES[i]) * t;
        let (low, high) = (at(i), at(i + COLUMNS));
        low + (high - low) * self.fraction
    }

    /// The most that it reflects of light from a direction.
    pub(super) fn albedo(&self, w: Vec3) -> Rgb {
        self.colour * self.raw(w.z).min(1.0)
    }

    /// Share of the light from a direction that reaches what is below.
    pub(super) fn passes(&self, w: Vec3) -> f32 {
        1.0 - self.albedo(w).max_element()
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluated {
        let half = wo + wi;
        let across = half.x * half.x + half.y * half.y;
        let sine2 = across / (across + half.z * half.z);
        let density = (2.0 + self.power) * libm::powf(sine2, 0.5 * self.power) / TAU;
        let visible = 0.25 / (wo.z + wi.z - wo.z * wi.z);
        let least = self.raw(wo.z).max(1.0) * self.raw(wi.z).max(1.0);
        let glossy = self.colour * (density * visible * wi.z / least);
        Evaluated { value: Scattered { diffuse: Rgb::ZERO, glossy }, pdf: 0.5 * FRAC_1_PI }
    }

    /// Uniform on the hemisphere: much of the lobe is at the horizon.
    pub(super) fn draw(u: Vec2) -> Vec3 {
        let w = warp::sphere(u);
        w.with_z(w.z.abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// E by the midpoint rule, with more points towards the horizon.
    fn integrate(cos: f64, roughness: f64, n: usize) -> f64 {
        let power = 1.0 / (roughness * roughness);
        let sine = (1.0 - cos * cos).sqrt();
        let mut sum = 0.0;
        for k in 0..n * n {
            let (s, phi) = (((k / n) as f64 + 0.5) / n as f64, PI * ((k % n) as f64 + 0.5) / n as f64);
            let (z, measure) = (s.powi(3), 3.0 * s * s / n as f64 * 2.0 * PI / n as f64);
            let (sin_phi, cos_phi) = libm::sincos(phi);
            let r = (1.0 - z * z).sqrt();
            let across = (r * cos_phi + sine).powi(2) + (r * sin_phi).powi(2);
            let sine2 = across / (across + (z + cos).powi(2));
            let density = (2.0 + power) * libm::pow(sine2, 0.5 * power) / (2.0 * PI);
            sum += measure * density * z / (4.0 * (z + cos - z * cos));
        }
        sum
    }

    fn node(row: usize, column: usize, n: usize) -> f64 {
        let root = column as f64 / (COLUMNS - 1) as f64;
        integrate(root * root, 0.1 + 0.9 * row as f64 / (ROWS - 1) as f64, n)
    }

    #[test]
    #[ignore = "writes sheen.bin"]
    fn write() {
        let nodes = (0..ROWS * COLUMNS).map(|i| node(i / COLUMNS, i % COLUMNS, 400) as f32);
        let bytes: Vec<u8> = nodes.flat_map(f32::to_le_bytes).collect();
        std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/src/bsdf/sheen.bin"), bytes).unwrap();
    }

    #[test]
    fn the_table_is_the_integral() {
        for row in (0..ROWS).step_by(9) {
            for column in (0..COLUMNS).step_by(5) {
                let (got, expected) = (f64::from(NODES[row * COLUMNS + column]), node(row, column, 200));
                assert!((got - expected).abs() < 1e-4 * expected.max(1.0), "{row} {column}: {got} {expected}");
            }
        }
    }

    #[test]
    fn interpolation_is_within_three_thousandths() {
        for row in (0..ROWS - 1).step_by(6) {
            for column in 0..COLUMNS - 1 {
                let root = (column as f64 + 0.5) / (COLUMNS - 1) as f64;
                let roughness = 0.1 + 0.9 * (row as f64 + 0.5) / (ROWS - 1) as f64;
                let sheen = Sheen::new(Rgb::ONE, roughness as f32).unwrap();
                let got = f64::from(sheen.raw((root * root) as f32)).min(1.0);
                let expected = integrate(root * root, roughness, 150).min(1.0);
                assert!((got - expected).abs() < 3e-3, "{roughness} {root}: {got} {expected}");
            }
        }
    }
}

//! What a thin film over an interface reflects (Belcour and Barla 2017, as `KHR_materials_iridescence` writes it).
//!
//! Light that is reflected m times inside the film is delayed by m optical path differences; what the eye makes of the
//! interference is the Fourier transform of its sensitivity at that difference, taken for m up to 2. Colours are of an
//! illuminant of equal energy, as in the extension, and clamped to 0..=1: the truncated series and the conversion to
//! Rec.709 can leave that range.
//!
//! The reflectance is a function of the cosine with the facet's normal alone, so that lobes with it are reciprocal. It is
//! kept at [`NODES`] cosines and linear between them.

use crate::bsdf::fresnel::{Schlick, fifth_power};
use crate::math::colour::Rgb;
use core::f32::consts::TAU;
use glam::Mat3;
use std::sync::LazyLock;

const NODES: usize = 33;
/// Path differences of the table of interference, in nm: beyond, light of all colours averages out.
const FARTHEST: f32 = 6000.0;
const STEPS: usize = 1024;
/// CIE XYZ to linear Rec.709.
const TO_RGB: Mat3 = Mat3::from_cols_array(&[
    3.240_454_2,
    -0.969_266,
    0.055_643_4,
    -1.537_138_5,
    1.876_010_8,
    -0.204_025_9,
    -0.498_531_4,
    0.041_556,
    1.057_225_2,
]);

/// Interference by path difference.
static INTERFERENCE: LazyLock<Vec<Rgb>> =
    LazyLock::new(|| (0..=STEPS).map(|i| transformed(FARTHEST * i as f32 / STEPS as f32)).collect());

/// A film's dimensions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coating {
    /// Refractive index, at least 1.
    pub(super) ior: f32,
    /// In nm.
    pub(super) thickness: f32,
}

/// Reflectance by the cosine between a direction and the facet's normal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Film {
    nodes: [Rgb; NODES],
    /// Reflectance at grazing incidence.
    f90: f32,
}

impl Film {
    /// A film over the share `factor` of an interface that reflects `under`. What the interface reflects at grazing
    /// incidence (`specularFactor`) scales the film too.
    pub(super) fn new(factor: f32, coating: Coating, under: Schlick) -> Self {
        let f0 = if under.f90 > 0.0 { (under.f0 / under.f90).min(Rgb::ONE) } else { Rgb::ZERO };
        let nodes = core::array::from_fn(|i| {
            let cos = i as f32 / (NODES - 1) as f32;
            let filmed = reflectance(cos, coating, f0) * under.f90;
            under.at(cos).lerp(filmed, factor).clamp(Rgb::ZERO, Rgb::ONE)
        });
        Self { nodes, f90: under.f90 }
    }

    pub(super) fn at(&self, cos: f32) -> Rgb {
        let scaled = cos.clamp(0.0, 1.0) * (NODES - 1) as f32;
        let i = (scaled as usize).min(NODES - 2);
        self.nodes[i].lerp(self.nodes[i + 1], scaled - i as f32)
    }

    /// Cosine-weighted mean over the hemisphere, 2 ∫ F(μ) μ dμ of the linear pieces.
    pub(super) fn mean(&self) -> Rgb {
        let step = 1.0 / (NODES - 1) as f32;
        let piece = |(i, pair): (usize, &[Rgb])| {
            let low = i as f32 * step;
            let (first, second) = (low / 2.0 + step / 6.0, low / 2.0 + step / 3.0);
            2.0 * step * (pair[0] * first + pair[1] * second)
        };
        self.nodes.windows(2).enumerate().map(piece).sum()
    }

    /// A reflectance of Schlick's form that is nowhere less, but by 0.003 below the first cosine that is kept.
    pub(super) fn bound(&self) -> Schlick {
        let step = 1.0 / (NODES - 1) as f32;
        let f0 = self.nodes.iter().enumerate().skip(1).map(|(i, node)| {
            let (here, before) = (1.0 - i as f32 * step, 1.0 - (i - 1) as f32 * step);
            // A chord of (1 − μ)⁵ lies above it by no more than step² / 8 times the second derivative.
            let gap = 2.5 * step * step * before * before * before;
            let grazing = (fifth_power(here) - gap).max(0.0);
            (*node - Rgb::splat(self.f90 * grazing)) / (1.0 - grazing)
        });
        Schlick { f0: f0.fold(Rgb::ZERO, Rgb::max).min(Rgb::ONE), f90: self.f90 }
    }
}

fn schlick(f0: f32, cos: f32) -> f32 {
    f0 + (1.0 - f0) * fifth_power(1.0 - cos)
}

/// Reflectance at normal incidence of two indices.
fn normal_incidence(one: f32, other: f32) -> f32 {
    let ratio = (one - other) / (one + other);
    ratio * ratio
}

/// Of a film in air over an interface with the reflectance `f0` to air at normal incidence.
fn reflectance(cos: f32, coating: Coating, f0: Rgb) -> Rgb {
    // A film of no thickness is none.
    let there = (coating.thickness / 0.03).clamp(0.0, 1.0);
    let ior = 1.0 + (coating.ior - 1.0) * there * there * (3.0 - 2.0 * there);
    let inside = (1.0 - (1.0 - cos * cos) / (ior * ior)).max(0.0).sqrt();
    let outer = schlick(normal_incidence(ior, 1.0), cos);
    let (passed, difference) = (1.0 - outer, 2.0 * ior * coating.thickness * inside);
    let waves = [interference(difference), interference(2.0 * difference)];
    Rgb::from_array(core::array::from_fn(|channel| {
        let root = f0[channel].clamp(0.0, 0.9999).sqrt();
        let base = (1.0 + root) / (1.0 - root);
        let inner = schlick(normal_incidence(base, ior), inside);
        // The wave turns over where it is reflected by what is denser: always on the outside, so inside never.
        let sign = if base < ior { 1.0 } else { -1.0 };
        let both = (outer * inner).clamp(1e-5, 0.9999);
        let steady = passed * passed * inner / (1.0 - both);
        let first = (steady - passed) * both.sqrt();
        let second = first * both.sqrt();
        outer + steady + 2.0 * (sign * first * waves[0][channel] + second * waves[1][channel])
    }))
    .clamp(Rgb::ZERO, Rgb::ONE)
}

/// Interference at a path difference in nm.
fn interference(difference: f32) -> Rgb {
    let scaled = difference / FARTHEST * STEPS as f32;
    if scaled.is_nan() || scaled >= STEPS as f32 {
        return Rgb::ZERO;
    }
    let i = scaled as usize;
    INTERFERENCE[i].lerp(INTERFERENCE[i + 1], scaled - i as f32)
}

/// The Fourier transform of the eye's sensitivity, by the four Gaussians that the paper fits to it.
fn transformed(difference: f32) -> Rgb {
    let phase = TAU * difference * 1e-9;
    let wave = |value: f32, position: f32, variance: f32| {
        value * (TAU * variance).sqrt() * libm::cosf(position * phase) * libm::expf(-variance * phase * phase)
    };
    let x = wave(5.4856e-13, 1.681e6, 4.3278e9) + wave(9.747e-14, 2.2399e6, 4.5282e9);
    let y = wave(4.4201e-13, 1.7953e6, 9.3046e9);
    let z = wave(5.2481e-13, 2.2084e6, 6.6121e9);
    TO_RGB * (Rgb::new(x, y, z) / 1.0685e-7)
}

#[cfg(test)]
mod tests {
    use super::*;

    const COATING: Coating = Coating { ior: 1.3, thickness: 400.0 };

    /// Airy's sum for one wavelength of unpolarised light is not what the extension asks for; that for Schlick's
    /// reflectances is, and its mean over all phases is the steady part of the series.
    #[test]
    fn a_thick_film_reflects_the_mean_over_all_phases() {
        let f0 = Rgb::new(0.04, 0.3, 0.9);
        let thick = Coating { ior: 1.5, thickness: 1e5 };
        for cos in [0.05, 0.3, 0.7, 1.0_f32] {
            let found = reflectance(cos, thick, f0);
            let inside = (1.0 - (1.0 - cos * cos) / 2.25).sqrt();
            for channel in 0..3 {
                let root = f0[channel].sqrt();
                let outer = schlick(normal_incidence(1.5, 1.0), cos);
                let inner = schlick(normal_incidence((1.0 + root) / (1.0 - root), 1.5), inside);
                let mean: f64 = (0..4096)
                    .map(|i| {
                        let turn = libm::cos(f64::from(TAU) * (f64::from(i) + 0.5) / 4096.0);
                        let (a, b) = (f64::from(outer), f64::from(inner));
                        let cross = 2.0 * (a * b).sqrt() * turn;
                        (a + b + cross) / (1.0 + a * b + cross) / 4096.0
                    })
                    .sum();
                assert!((f64::from(found[channel]) - mean).abs() < 1e-4, "{cos} {channel}: {found} {mean}");
            }
        }
    }

    #[test]
    fn colours_change_with_thickness_and_angle_and_no_film_is_none() {
        let under = Schlick { f0: Rgb::splat(0.9), f90: 1.0 };
        let of = |thickness, cos| Film::new(1.0, Coating { thickness, ..COATING }, under).at(cos);
        assert!((of(400.0, 1.0) - of(250.0, 1.0)).abs().max_element() > 0.05);
        assert!((of(400.0, 1.0) - of(400.0, 0.4)).abs().max_element() > 0.05);
        let none = Film::new(0.0, COATING, under);
        for i in 0..=32 {
            let cos = i as f32 / 32.0;
            assert!((none.at(cos) - under.at(cos)).abs().max_element() < 1e-6);
        }
    }

    #[test]
    fn means_and_bounds_are_those_of_the_kept_reflectance() {
        for (ior, thickness, f0, factor) in
            [(1.3, 400.0, 0.04, 1.0), (2.0, 250.0, 0.5, 1.0), (1.8, 800.0, 0.95, 0.4), (1.0, 100.0, 0.0, 1.0)]
        {
            let film =
                Film::new(factor, Coating { ior, thickness }, Schlick { f0: Rgb::splat(f0), f90: 1.0 });
            let bound = film.bound();
            let n = 20_000;
            let mut mean = glam::DVec3::ZERO;
            for i in 0..n {
                let cos = ((i as f32 + 0.5) / n as f32).sqrt();
                let value = film.at(cos);
                assert!(value.min_element() >= 0.0 && value.max_element() <= 1.0);
                let margin = if cos < 1.0 / 32.0 { 3e-3 } else { 1e-6 };
                assert!((value - bound.at(cos)).max_element() < margin, "{ior} {thickness} {cos}: {value}");
                mean += value.as_dvec3() / f64::from(n);
            }
            assert!((mean.as_vec3() - film.mean()).abs().max_element() < 1e-4, "{mean} {}", film.mean());
        }
    }
}

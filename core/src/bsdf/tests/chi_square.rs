//! Sampled directions are distributed as the density says, over the whole sphere.

use super::chart::{Chart, Kind};
use super::*;
use crate::bsdf::event::{Letter, Letters, SampleKind, Transport};
use crate::bsdf::surface::{Finishing, Layers};

const RADIAL: usize = 36;
const AROUND: usize = 20;
const SAMPLES: usize = 60_000;

/// Expected numbers of samples in a chart's cells, for one sample: the midpoint rule, with more points in and
/// around cells where few and very few do not agree (the horizon, total internal reflection).
fn expected(bsdf: &Bsdf, wo: Vec3, chart: &Chart) -> Vec<f64> {
    let cell = |i: usize, j: usize, n: usize| {
        let (mut sum, mut outside) = (0.0, 0);
        for k in 0..n * n {
            let a = (i as f64 + ((k / n) as f64 + 0.5) / n as f64) / RADIAL as f64;
            let b = (j as f64 + ((k % n) as f64 + 0.5) / n as f64) / AROUND as f64;
            match chart.direction(a, b) {
                Some(wi) => sum += f64::from(bsdf.pdf(wo, wi.as_vec3())) * chart.solid_angle(a, b),
                None => outside += 1,
            }
        }
        (sum / (n * n * RADIAL * AROUND) as f64, outside)
    };
    let (mut cells, mut cut) = (vec![0.0; RADIAL * AROUND], vec![false; RADIAL * AROUND]);
    for (k, (value, cut)) in cells.iter_mut().zip(&mut cut).enumerate() {
        let ((coarse, _), (fine, outside)) =
            (cell(k / AROUND, k % AROUND, 5), cell(k / AROUND, k % AROUND, 11));
        *value = fine;
        *cut = (coarse - fine).abs() > 0.003 * fine + 1e-8 || (1..121).contains(&outside);
    }
    for i in 0..RADIAL {
        for j in 0..AROUND {
            let around = [(0, 0), (0, 1), (0, AROUND - 1), (1, 0), (RADIAL - 1, 0)];
            let near = |(di, dj)| cut[(i + di) % RADIAL * AROUND + (j + dj) % AROUND];
            if around.into_iter().any(near) {
                cells[i * AROUND + j] = cell(i, j, 24).0;
            }
        }
    }
    cells
}

/// The standard normal deviate of a χ² test of samples against densities.
fn deviate(bsdf: &Bsdf, wo: Vec3, alpha: f32, through: Kind, seed: u64) -> f64 {
    let kinds = match through {
        Kind::Refracted(eta) => vec![Kind::Mirrored, through, Kind::Beyond(eta)],
        _ => vec![Kind::Mirrored, through],
    };
    let charts: Vec<Chart> = kinds.into_iter().map(|kind| Chart::new(wo, alpha, kind)).collect();
    let mut wanted: Vec<f64> = charts.iter().flat_map(|chart| expected(bsdf, wo, chart)).collect();
    let cells = wanted.len();
    let mut counted = vec![0_u32; cells];
    let (mut specular, mut absorbed, mut chance_sum) = (0_u32, 0_u32, 0.0);
    let mut uniform = Uniform(seed);
    let mut seen: Vec<(Vec3, f32)> = Vec::new();
    for _ in 0..SAMPLES {
        let Some(sample) = bsdf.sample(wo, uniform.next(), uniform.pair(), Transport::Radiance) else {
            absorbed += 1;
            continue;
        };
        match sample.kind {
            SampleKind::Specular { probability, .. } => {
                specular += 1;
                if seen.iter().all(|(wi, p)| *wi != sample.wi || *p != probability) {
                    seen.push((sample.wi, probability));
                    chance_sum += f64::from(probability);
                }
            }
            SampleKind::Smooth { pdf, .. } => {
                assert!(pdf > 0.0);
                let wi = sample.wi.as_dvec3();
                let k = charts.iter().position(|chart| chart.covers(wi)).expect("the charts cover all");
                let (a, b) = charts[k].locate(sample.wi);
                // What has less slope than the chart's least is counted apart.
                if (0.0..1.0).contains(&a) {
                    let (i, j) = ((a * RADIAL as f64) as usize, (b * AROUND as f64) as usize);
                    counted[k * RADIAL * AROUND + i * AROUND + j.min(AROUND - 1)] += 1;
                } else {
                    absorbed += 1;
                }
            }
        }
    }
    let all: f64 = wanted.iter().sum::<f64>() + chance_sum;
    assert!(all < 1.0 + 2e-3, "the densities add up to {all}");
    wanted.extend([chance_sum, (1.0 - all).max(0.0)]);
    counted.extend([specular, absorbed]);
    chi_square(&wanted, &counted)
}

/// Pools cells until ten samples are expected in each; Wilson and Hilferty's transformation of χ².
fn chi_square(wanted: &[f64], counted: &[u32]) -> f64 {
    let (mut sum, mut degrees, mut pooled) = (0.0, -1.0, (0.0, 0.0));
    for (w, c) in wanted.iter().zip(counted) {
        pooled.0 += w * SAMPLES as f64;
        pooled.1 += f64::from(*c);
        if pooled.0 > 10.0 {
            sum += (pooled.1 - pooled.0) * (pooled.1 - pooled.0) / pooled.0;
            degrees += 1.0;
            pooled = (0.0, 0.0);
        }
    }
    assert!(pooled.1 < 30.0, "{} samples where {} are expected", pooled.1, pooled.0);
    if degrees < 1.0 {
        return 0.0;
    }
    let spread = 2.0 / (9.0 * degrees);
    (libm::cbrt(sum / degrees) - (1.0 - spread)) / spread.sqrt()
}

/// 206 tests at a level of 0.01 together (Šidák) allow each 4.9e-5, one-sided.
const LIMIT: f64 = 3.89;

fn check(name: &str, surface: SurfaceParameters, alphas: &[f32], angles: &[f64], through: Kind) {
    check_kept(name, surface, Letters::NATURAL, alphas, angles, through);
}

fn check_kept(
    name: &str,
    surface: SurfaceParameters,
    letters: Letters,
    alphas: &[f32],
    angles: &[f64],
    through: Kind,
) {
    for &alpha in alphas {
        let roughness = alpha.sqrt().next_up();
        let bsdf = Bsdf::keeping(&SurfaceParameters { roughness, ..surface }, letters);
        for (i, &angle) in angles.iter().enumerate() {
            let wo = tilted(angle, 0.7);
            let kind = match through {
                Kind::Refracted(eta) if wo.z < 0.0 => Kind::Refracted(1.0 / eta),
                other => other,
            };
            let deviate = deviate(&bsdf, wo, alpha.max(1e-3), kind, 17 + i as u64);
            assert!(deviate < LIMIT, "{name} α {alpha} at {angle}°: {deviate:.2} standard deviations");
        }
    }
}

const ALPHAS: [f32; 4] = [1e-3, 0.02, 0.3, 1.0];
const ABOVE: [f64; 4] = [1.0, 40.0, 80.0, 89.9];

#[test]
fn lambert() {
    check("Lambert", LAMBERT, &[0.5], &[10.0, 89.9, 130.0], Kind::Through);
}

#[test]
fn conductor() {
    check("metal", METAL, &ALPHAS, &ABOVE, Kind::Through);
    check("metal from behind", METAL, &[0.1], &[140.0], Kind::Through);
    check("mirror", METAL, &[0.0], &[30.0], Kind::Through);
}

#[test]
fn plastic() {
    check("plastic", PLASTIC, &ALPHAS, &ABOVE, Kind::Through);
    let bright = SurfaceParameters { ior: 3.0, base_color: Rgb::new(0.9, 0.2, 0.1), ..PLASTIC };
    check("bright plastic", bright, &[0.0, 0.6], &[1.0, 70.0, 100.0], Kind::Through);
}

#[test]
fn sheet() {
    check("sheet", SHEET, &ALPHAS, &[20.0, 89.9, 110.0], Kind::Through);
    let green = SurfaceParameters { base_color: Rgb::new(0.1, 0.8, 0.1), ..SHEET };
    check("green sheet", green, &[0.0, 0.4], &[60.0], Kind::Through);
}

#[test]
fn solid() {
    let angles = [1.0, 50.0, 89.9, 100.0, 130.0, 137.0, 175.0];
    check("glass", SOLID, &ALPHAS, &angles, Kind::Refracted(1.5));
    let dense = SurfaceParameters { ior: 2.4, base_color: Rgb::new(0.1, 0.5, 0.9), ..SOLID };
    check("dense glass", dense, &[0.0, 0.15, 0.6], &angles, Kind::Refracted(f64::from(2.4_f32)));
    let thin = SurfaceParameters { ior: 1.02, ..SOLID };
    check("hardly glass", thin, &[0.3], &angles, Kind::Refracted(f64::from(1.02_f32)));
}

#[test]
fn mixture() {
    let mixed = SurfaceParameters { metallic: 0.3, transmission: 0.5, ..SOLID };
    check("mixture", mixed, &[0.0, 0.05, 0.5], &[30.0, 85.0, 120.0], Kind::Refracted(1.5));
    let tinted =
        SurfaceParameters { metallic: 0.6, transmission: 0.3, base_color: Rgb::new(0.2, 0.9, 0.4), ..SHEET };
    check("tinted mixture", tinted, &[0.25], &[30.0, 100.0], Kind::Through);
}

#[test]
fn layers() {
    let layered = |surface, coat, coat_roughness, sheen: f32, sheen_roughness| {
        let sheen = Rgb::new(sheen, 0.5 * sheen, sheen);
        let layers = Layers { coat, coat_roughness, sheen, sheen_roughness, ..NO_LAYERS };
        SurfaceParameters { layers: Some(layers), ..surface }
    };
    let angles = [1.0, 60.0, 89.0];
    check("coated metal", layered(METAL, 1.0, 0.2, 0.0, 0.0), &[0.0, 0.3], &angles, Kind::Through);
    check("mirror on plastic", layered(PLASTIC, 0.7, 0.0, 0.0, 0.0), &[0.3], &angles, Kind::Through);
    check("cloth", layered(LAMBERT, 0.0, 0.0, 1.0, 0.1), &[0.5], &angles, Kind::Through);
    check("coated cloth", layered(PLASTIC, 0.5, 0.5, 0.8, 0.6), &[0.4], &[40.0, 130.0], Kind::Through);
    let angles = [30.0, 110.0, 150.0];
    check("coated glass", layered(SOLID, 1.0, 0.3, 0.5, 0.4), &[0.0, 0.2], &angles, Kind::Refracted(1.5));
    let all = layered(METAL, 0.8, 0.4, 0.5, 0.3);
    check_kept("coats and twins", all, Letters::ALL, &[0.3], &[50.0], Kind::Through);
    let mut leaf = layered(PLASTIC, 0.3, 0.2, 0.2, 0.5);
    if let Some(layers) = &mut leaf.layers {
        (layers.through, layers.through_color) = (0.7, Rgb::new(0.9, 0.6, 0.2));
    }
    check("leaf", leaf, &[0.0, 0.3], &[30.0, 140.0], Kind::Through);
    let prism = Layers { dispersion: 3.0, ..NO_LAYERS };
    let prism = SurfaceParameters { layers: Some(prism), ..SOLID };
    check("prism", prism, &[0.1], &[50.0, 150.0], Kind::Refracted(1.5));
    let mut tilted_coat = layered(METAL, 1.0, 0.3, 0.0, 0.0);
    if let Some(layers) = &mut tilted_coat.layers {
        layers.coat_normal = tilted(25.0, 1.0);
    }
    check("tilted coat", tilted_coat, &[0.4], &[20.0, 70.0], Kind::Through);
}

#[test]
fn finishes() {
    let finished = |surface, strength, film| {
        let finish = Finishing { strength, film, along: Vec2::from_angle(0.3), ..Finishing::NONE };
        SurfaceParameters { layers: Some(Layers { finish, ..NO_LAYERS }), ..surface }
    };
    let angles = [1.0, 50.0, 85.0];
    check("brushed metal", finished(METAL, 0.5, 0.0), &[0.02, 0.3], &angles, Kind::Through);
    check("wholly brushed metal", finished(METAL, 1.0, 0.0), &[0.1], &angles, Kind::Through);
    check("brushed plastic", finished(PLASTIC, 0.7, 0.0), &[0.1], &[30.0, 80.0, 140.0], Kind::Through);
    check("filmed metal", finished(METAL, 0.0, 1.0), &[0.0, 0.02, 0.5], &angles, Kind::Through);
    check("filmed plastic", finished(PLASTIC, 0.0, 1.0), &[0.0, 0.3], &angles, Kind::Through);
    check("brushed and filmed", finished(METAL, 0.4, 0.7), &[0.2], &angles, Kind::Through);
    check_kept("brushed twins", finished(PLASTIC, 0.5, 0.5), Letters::ALL, &[0.3], &[50.0], Kind::Through);
}

#[test]
fn lobes_that_are_kept() {
    let [diffuse, glossy, specular, mirrored] = Letter::ALL.map(Letters::of);
    check_kept("base", PLASTIC, diffuse, &[0.0, 0.02, 0.5], &[1.0, 85.0], Kind::Through);
    check_kept("interface", PLASTIC, glossy.union(specular), &[0.02, 0.5], &[40.0, 140.0], Kind::Through);
    check_kept("twin", PLASTIC, Letters::ALL, &[0.02, 0.5], &[60.0], Kind::Through);
    let mixed = SurfaceParameters { metallic: 0.3, transmission: 0.5, ..SOLID };
    let angles = [30.0, 120.0];
    let refracted = Kind::Refracted(1.5);
    check_kept("mixture without gloss", mixed, diffuse.union(mirrored), &[0.3], &angles, refracted);
    check_kept("mixture without base", mixed, glossy, &[0.1], &angles, refracted);
    check_kept("mixture and twins", mixed, Letters::ALL, &[0.3], &angles, refracted);
    let sheet = SurfaceParameters { metallic: 0.3, transmission: 0.5, ..SHEET };
    check_kept("sheet and twins", sheet, glossy.union(mirrored), &[0.3], &[50.0], Kind::Through);
}

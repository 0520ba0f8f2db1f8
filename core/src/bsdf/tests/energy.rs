//! Directional albedos: never above one, and one where nothing is absorbed.

use super::*;
use crate::bsdf::event::{SampleKind, Transport};
use crate::bsdf::surface::{Finishing, Layers};

/// Σ f |cos| / p over a rank-1 lattice; flux, so without the factor of radiance in refraction.
pub(super) fn albedo(bsdf: &Bsdf, wo: Vec3, points: u32) -> Rgb {
    // Irrational steps from the plastic number (Roberts's R₂), and equal ones.
    const STEP: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];
    let mut sum = glam::DVec3::ZERO;
    for i in 0..points {
        let [u, v] = STEP.map(|step| ((0.5 + f64::from(i) * step).fract() as f32).min(1.0_f32.next_down()));
        let w = (i as f32 + 0.5) / points as f32;
        let weight = match bsdf.sample(wo, u, Vec2::new(v, w), Transport::Importance) {
            None => continue,
            Some(sample) => match sample.kind {
                SampleKind::Smooth { value, pdf } => value.total() / pdf,
                SampleKind::Specular { weight, .. } => weight,
            },
        };
        sum += weight.as_dvec3();
    }
    (sum / f64::from(points)).as_vec3()
}

/// Mean square of f |cos| / p of a white surface.
fn mean_square(bsdf: &Bsdf, wo: Vec3) -> f64 {
    const SAMPLES: usize = 40_000;
    let mut uniform = Uniform(5);
    let mut square = || match bsdf.sample(wo, uniform.next(), uniform.pair(), Transport::Importance)?.kind {
        SampleKind::Smooth { value, pdf } => Some(f64::from(value.total().x / pdf).powi(2)),
        SampleKind::Specular { .. } => None,
    };
    (0..SAMPLES).map(|_| square().unwrap_or(0.0)).sum::<f64>() / SAMPLES as f64
}

/// What light is multiplied by at each of many scatterings between white metals: with a mean square of 1.13, that of facets alone at α = 1, thirty of
/// them make single samples of thousands of times the mean.
#[test]
fn weights_of_white_metal_vary_little() {
    for (alpha, most) in
        [(0.02, 1.06), (0.1, 1.06), (0.25, 1.07), (0.5, 1.09), (0.64, 1.07), (0.8, 1.04), (1.0, 1.02)]
    {
        for angle in [0.5, 25.0, 50.0, 65.0, 77.0, 88.0] {
            let square = mean_square(&rough(alpha, METAL), tilted(angle, 2.0));
            assert!((1.0 - 0.01..most).contains(&square), "α {alpha} at {angle}°: {square}");
        }
    }
}

const ALPHAS: [f32; 9] = [0.0, 1e-3, 0.01, 0.04, 0.1, 0.25, 0.5, 0.8, 1.0];
const ANGLES: [f64; 8] = [0.5, 25.0, 50.0, 65.0, 77.0, 85.0, 88.5, 89.9];

#[test]
fn white_opaque_surfaces_and_sheets_lose_nothing() {
    let coloured = SurfaceParameters { specular_color: Rgb::new(3.0, 1.0, 0.0), ior: 1.8, ..PLASTIC };
    let half = SurfaceParameters { specular: 0.5, ..PLASTIC };
    let thin = SurfaceParameters { specular_color: Rgb::new(3.0, 1.0, 0.0), specular: 0.7, ..SHEET };
    let mixture = SurfaceParameters { metallic: 0.4, transmission: 0.3, ..SHEET };
    for (name, surface) in
        [("Lambert", LAMBERT), ("metal", METAL), ("plastic", PLASTIC), ("coloured", coloured), ("half", half)]
            .into_iter()
            .chain([("sheet", SHEET), ("coloured sheet", thin), ("mixture", mixture)])
    {
        for alpha in ALPHAS {
            let bsdf = rough(alpha, surface);
            for angle in ANGLES {
                // Where one lobe is worth little and rarely drawn, the lattice needs more points.
                let error_of =
                    |points| (albedo(&bsdf, tilted(angle, 2.0), points) - Rgb::ONE).abs().max_element();
                let error = [1 << 12, 1 << 18].into_iter().map(error_of).find(|e| *e < 1e-3);
                assert!(error.is_some(), "{name} α {alpha} at {angle}°");
            }
        }
    }
}

#[test]
fn white_glass_gains_nothing() {
    for ior in [1.02, 1.1, 1.5, 2.4, 10.0] {
        let surface = SurfaceParameters { ior, ..SOLID };
        for alpha in ALPHAS {
            let bsdf = rough(alpha, surface);
            for angle in ANGLES.into_iter().flat_map(|angle| [angle, 180.0 - angle]) {
                let of = |points| albedo(&bsdf, tilted(angle, 2.0), points).max_element();
                // Where the lattice errs by more, it needs more points.
                let found = [1 << 13, 1 << 18].into_iter().map(of).find(|found| *found < 1.0 + 1e-3);
                let found = found.unwrap_or_else(|| panic!("η {ior} α {alpha} at {angle}° gains"));
                // The margins of the table; exact where nothing is tabulated. Of indices near one the table cannot
                // follow the last degree to the horizon.
                let grazing = if ior < 1.1 { 0.04 } else { 0.02 };
                let margin = if (angle - 90.0_f64).abs() < 2.0 { grazing } else { 0.01 };
                let least = if alpha < 1e-3 { 1.0 - 1e-5 } else { 1.0 - margin };
                assert!(found > least, "η {ior} α {alpha} at {angle}°: {found}");
            }
        }
    }
}

#[test]
fn no_surface_gains_energy() {
    let mut uniform = Uniform(5);
    for _ in 0..400 {
        let surface = uniform.surface();
        let bsdf = Bsdf::from_surface(&surface);
        let wo = uniform.direction();
        let found = albedo(&bsdf, wo, 1 << 12).max_element();
        // Two lobes are drawn in proportion to luminance: the worst channel's error is about 1 %.
        assert!(found < 1.0 + 1e-2, "{found} towards {wo} of {surface:?}");
    }
}

#[test]
fn no_layers_gain_energy() {
    let mut uniform = Uniform(6);
    for _ in 0..400 {
        let surface = uniform.layered();
        let bsdf = Bsdf::from_surface(&surface);
        let wo = uniform.direction();
        let found = albedo(&bsdf, wo, 1 << 12).max_element();
        // As above; cloth is drawn uniformly, which adds as much again.
        assert!(found < 1.0 + 2e-2, "{found} towards {wo} of {surface:?}");
    }
}

#[test]
fn no_finish_gains_energy() {
    let mut uniform = Uniform(7);
    for _ in 0..400 {
        let surface = uniform.finished();
        let bsdf = Bsdf::from_surface(&surface);
        let wo = uniform.direction();
        let found = albedo(&bsdf, wo, 1 << 12).max_element();
        assert!(found < 1.0 + 2e-2, "{found} towards {wo} of {surface:?}");
    }
}

fn finished(surface: SurfaceParameters, finish: Finishing) -> SurfaceParameters {
    SurfaceParameters { layers: Some(Layers { finish, ..NO_LAYERS }), ..surface }
}

/// White plastic and metal, over the grid of roughness, strength, azimuth and angle. Towards the horizon the base of plastic is
/// taken to be under the smoother of its two roughnesses, which lets less through.
#[test]
fn brushed_surfaces_gain_nothing_and_plastic_loses_little() {
    let bright = SurfaceParameters { ior: 2.4, ..PLASTIC };
    for strength in [0.2, 0.6, 1.0_f32] {
        for azimuth in [0.0, 0.8, 1.57_f32] {
            let finish = Finishing { strength, along: Vec2::from_angle(2.0 + azimuth), ..Finishing::NONE };
            for alpha in [0.0, 0.01, 0.1, 0.5, 1.0] {
                for angle in [0.5, 50.0, 77.0, 88.5] {
                    for (surface, least) in [(METAL, 0.3), (PLASTIC, 0.9), (bright, 0.8)] {
                        let bsdf = rough(alpha, finished(surface, finish));
                        let found = albedo(&bsdf, tilted(angle, 2.0), 1 << 14).max_element();
                        assert!(found < 1.0 + 2e-3, "{found}: {finish:?} α {alpha} at {angle}°");
                        let least = if angle < 60.0 { least } else { 0.05 };
                        assert!(found > least, "{found}: {finish:?} α {alpha} at {angle}° of {surface:?}");
                    }
                }
            }
        }
    }
}

/// Under a film too, and a film over a metal of reflectance 1 loses nothing but what clamping to 1 takes.
#[test]
fn films_gain_nothing() {
    let grey = SurfaceParameters { base_color: Rgb::splat(0.5), ..METAL };
    for (film_ior, film_thickness) in [(1.3, 400.0), (2.0, 250.0), (1.8, 1000.0)] {
        let finish = Finishing { film: 1.0, film_ior, film_thickness, ..Finishing::NONE };
        for alpha in [0.0, 1e-3, 0.1, 0.5, 1.0] {
            for angle in [0.5, 50.0, 77.0, 88.5] {
                for (surface, least) in [(METAL, 0.97), (PLASTIC, 0.5), (grey, -1.0)] {
                    let found = albedo(&rough(alpha, finished(surface, finish)), tilted(angle, 2.0), 1 << 14);
                    assert!(found.max_element() < 1.0 + 2e-3, "{found}: {finish:?} α {alpha} at {angle}°");
                    assert!(found.min_element() > least, "{found}: {finish:?} α {alpha} at {angle}°");
                }
            }
        }
    }
}

/// Without strength and with a film of no thickness over an index of its own it is the plain surface.
#[test]
fn a_finish_that_changes_nothing_is_none() {
    let nothing = Finishing { film: 1e-6, ..Finishing::NONE };
    for alpha in [0.01, 0.3, 1.0] {
        let (plain, other) = (rough(alpha, METAL), rough(alpha, finished(METAL, nothing)));
        for angle in [1.0, 50.0, 85.0] {
            let (wo, wi) = (tilted(angle, 2.0), tilted(angle * 0.9, 5.1));
            let [a, b] = [&plain, &other].map(|bsdf| bsdf.eval(wo, wi, Transport::Radiance).total().x);
            assert!((a - b).abs() < 1e-4 * a, "{a} {b}");
        }
    }
    // A little brushed is a little off what is not, but for what bounces on between the facets.
    let slightly = Finishing { strength: 1e-3, ..Finishing::NONE };
    let (wo, wi) = (tilted(40.0, 2.0), tilted(41.0, 2.0 + std::f64::consts::PI));
    for surface in [METAL, PLASTIC] {
        let of = |surface| rough(0.1, surface).eval(wo, wi, Transport::Radiance).glossy.x;
        assert!((of(surface) / of(finished(surface, slightly)) - 1.0).abs() < 0.02);
    }
}

/// A coat over a white base returns 1 − c² F (1 − F̄) at most, cloth the colour's albedo and what passes beside it.
#[test]
fn layers_reflect_what_they_take() {
    for (base, alpha) in [(PLASTIC, 0.3), (METAL, 0.3), (METAL, 0.0), (LAMBERT, 0.5)] {
        for (coat, sheen) in [(1.0, 0.0), (0.4, 0.0), (0.0, 1.0), (0.0, 0.5), (1.0, 0.7)] {
            for roughness in [0.0, 0.4, 1.0_f32] {
                let layers = Layers {
                    coat,
                    coat_roughness: roughness,
                    coat_normal: Vec3::Z,
                    sheen: Rgb::splat(sheen),
                    sheen_roughness: roughness,
                    through: 1.0 - coat,
                    through_color: Rgb::ONE,
                    dispersion: 0.0,
                    finish: Finishing::NONE,
                };
                let bsdf = rough(alpha, SurfaceParameters { layers: Some(layers), ..base });
                for angle in [0.5, 50.0, 77.0, 88.5] {
                    let found = albedo(&bsdf, tilted(angle, 2.0), 1 << 15);
                    assert!(found.max_element() < 1.0 + 4e-3, "{layers:?} at {angle}°: {found}");
                    // A coat of index 1.5 reflects 9.2 % of diffuse light, cloth of the least roughness up to all of it
                    // at the horizon: more than half is left of any.
                    let least = if angle < 80.0 { 0.5 } else { 0.1 };
                    assert!(found.min_element() > least, "{layers:?} at {angle}°: {found}");
                }
            }
        }
    }
}

#[test]
fn smooth_glass_obeys_fresnel() {
    for ior in [1.0 + 1e-7, 1.1, 1.5, 2.4, 0.0] {
        for angle in ANGLES.into_iter().flat_map(|angle| [angle, 180.0 - angle]) {
            let solid = rough(0.0, SurfaceParameters { ior, ..SOLID });
            let (reflected, transmitted) = both_sides(&solid, tilted(angle, 1.0));
            assert!((reflected + transmitted - 1.0).abs() < 1e-6, "η {ior} at {angle}°");
            if ior > 0.0 && angle < 90.0 {
                let sheet = rough(0.0, SurfaceParameters { ior, ..SHEET });
                let (summed, rest) = both_sides(&sheet, tilted(angle, 1.0));
                assert!((summed - 2.0 * reflected / (1.0 + reflected)).abs() < 1e-6, "η {ior} at {angle}°");
                assert!((summed + rest - 1.0).abs() < 1e-6);
            }
        }
    }
    let none = rough(0.0, SurfaceParameters { ior: 1.0 + 1e-7, ..SOLID });
    let straight = none.sample(tilted(70.0, 1.0), 0.0, Vec2::ZERO, Transport::Radiance).unwrap();
    assert_eq!(straight.wi, -tilted(70.0, 1.0));
}

/// What an ideally specular surface reflects and transmits, of flux.
fn both_sides(bsdf: &Bsdf, wo: Vec3) -> (f32, f32) {
    let mut shares = (0.0, 0.0);
    for u in [0.0, 1.0_f32.next_down()] {
        let sample = bsdf.sample(wo, u, Vec2::splat(0.3), Transport::Importance).unwrap();
        let SampleKind::Specular { weight, probability, .. } = sample.kind else { panic!("not specular") };
        if sample.wi.z * wo.z > 0.0 {
            shares.0 = weight.x * probability;
        } else {
            shares.1 = weight.x * probability;
        }
    }
    shares
}

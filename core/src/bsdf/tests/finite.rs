//! Nothing overflows, however grazing the direction and however odd the material.

use super::*;
use crate::bsdf::event::{SampleKind, Transport};
use crate::bsdf::surface::{Finishing, Layers};

fn directions() -> Vec<Vec3> {
    let mut all = vec![Vec3::X, Vec3::Z, -Vec3::Z];
    for z in [1e-38_f32, 1e-20, 1e-10, 1e-6, 1.7e-4, 0.01, 0.5, 0.999_999_9] {
        let r = (1.0 - z * z).sqrt();
        for sign in [1.0, -1.0] {
            all.push(Vec3::new(r, 0.0, sign * z));
            all.push(Vec3::new(-0.6 * r, 0.8 * r, sign * z));
            all.push(Vec3::new(-r, 0.0, sign * z));
        }
    }
    all
}

/// Surfaces at the ends of what a file may say, and beyond.
fn plain_extremes() -> Vec<SurfaceParameters> {
    let mut surfaces = Vec::new();
    for alpha in [0.0, 1e-3, 0.03, 0.4, 1.0_f32] {
        for base in [LAMBERT, METAL, PLASTIC, SHEET, SOLID] {
            for (base_color, ior) in [(Rgb::ZERO, 1.5), (Rgb::ONE, 0.0), (Rgb::ONE, 1.0), (Rgb::ONE, 1.0001)]
            {
                surfaces.push(SurfaceParameters { roughness: alpha.sqrt(), base_color, ior, ..base });
            }
        }
    }
    surfaces.push(SurfaceParameters { roughness: f32::NAN, ior: f32::INFINITY, ..SOLID });
    surfaces.push(SurfaceParameters { base_color: Rgb::splat(f32::NAN), metallic: -3.0, ..PLASTIC });
    surfaces.push(SurfaceParameters {
        specular_color: Rgb::splat(f32::INFINITY),
        transmission: 7.0,
        ..PLASTIC
    });
    surfaces
}

/// Such layers on surfaces.
fn layered_extremes() -> Vec<SurfaceParameters> {
    let mut surfaces = Vec::new();
    let layers = Layers {
        coat: 1.0,
        coat_roughness: 0.0,
        coat_normal: Vec3::Z,
        sheen: Rgb::ONE,
        sheen_roughness: 0.0,
        through: 0.5,
        through_color: Rgb::ONE,
        dispersion: 0.3,
        finish: Finishing::NONE,
    };
    for surface in [METAL, SOLID] {
        for (coat_roughness, sheen_roughness) in [(0.0, 0.0), (0.04, 0.3), (1.0, 1.0), (f32::NAN, f32::NAN)] {
            let layers = Some(Layers { coat_roughness, sheen_roughness, ..layers });
            surfaces.push(SurfaceParameters { layers, ..surface });
        }
    }
    surfaces
}

/// Such finishes of surfaces.
fn finished_extremes() -> Vec<SurfaceParameters> {
    let mut surfaces = Vec::new();
    let edges = [
        Finishing { strength: 1.0, ..Finishing::NONE },
        Finishing {
            strength: 1e-3,
            film: 1.0,
            film_ior: f32::MAX,
            film_thickness: f32::MAX,
            ..Finishing::NONE
        },
        Finishing { film: 0.5, film_ior: 1.0, film_thickness: 0.0, ..Finishing::NONE },
        Finishing {
            strength: f32::NAN,
            film: 1.0,
            film_ior: f32::NAN,
            film_thickness: f32::NAN,
            ..Finishing::NONE
        },
    ];
    for finish in edges {
        for (alpha, base) in [(0.0_f32, METAL), (1e-3, METAL), (1.0, PLASTIC), (0.0, PLASTIC), (0.1, METAL)] {
            let layers = Some(Layers { finish, ..NO_LAYERS });
            surfaces.push(SurfaceParameters { layers, roughness: alpha.sqrt(), ior: 0.0, ..base });
        }
    }
    surfaces
}

#[test]
fn values_are_finite_and_not_negative() {
    let one = 1.0_f32.next_down();
    let corners = [0.0, 1e-7, 0.5, one];
    for surface in [plain_extremes(), layered_extremes(), finished_extremes()].concat() {
        let bsdf = Bsdf::from_surface(&surface);
        for wo in directions() {
            for wi in directions() {
                let (value, pdf) = bsdf.eval_and_pdf(wo, wi, Transport::Radiance);
                let total = value.total();
                assert!(total.is_finite() && total.min_element() >= 0.0, "{total} {wo} {wi} {surface:?}");
                assert!(pdf.is_finite() && pdf >= 0.0, "{pdf} {wo} {wi} {surface:?}");
                assert!(
                    wo.z * wi.z != 0.0 || wo.z != 0.0 && wi.z != 0.0 || (total == Rgb::ZERO && pdf == 0.0)
                );
            }
            for i in 0..64 {
                let u = [corners[i % 4], corners[i / 4 % 4], corners[i / 16]];
                let sample = bsdf.sample(wo, u[0], Vec2::new(u[1], u[2]), Transport::Radiance);
                let Some(sample) = sample else { continue };
                assert!(wo.z != 0.0 && sample.wi.is_finite());
                let (weight, density) = match sample.kind {
                    SampleKind::Smooth { value, pdf } => (value.total(), pdf),
                    SampleKind::Specular { weight, probability, .. } => (weight, probability),
                };
                assert!(density > 0.0 && density.is_finite(), "{density} {wo} {u:?} {surface:?}");
                assert!(weight.is_finite() && weight.min_element() >= 0.0, "{weight} {wo} {u:?} {surface:?}");
            }
        }
    }
}

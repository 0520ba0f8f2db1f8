//! How much of the light that arrives the letter `D` alone sends back.

use crate::bsdf::Bsdf;
use crate::bsdf::event::{Letter, Transport};
use crate::math::colour::Rgb;
use core::f32::consts::PI;
use glam::Vec3;

/// Cosines and weights (of the cosine-weighted mean over a hemisphere, which add up to one): Gauss and Legendre's rule of
/// six points on 0..1, times 2 cos θ. Exact for Schlick's reflectance, a polynomial of degree five. `D` does not depend on azimuths.
const DIRECTIONS: [(f32, f32); 6] = [
    (0.033_765_24, 2.0 * 0.085_662_246 * 0.033_765_24),
    (0.169_395_31, 2.0 * 0.180_380_79 * 0.169_395_31),
    (0.380_690_4, 2.0 * 0.233_956_97 * 0.380_690_4),
    (0.619_309_6, 2.0 * 0.233_956_97 * 0.619_309_6),
    (0.830_604_7, 2.0 * 0.180_380_79 * 0.830_604_7),
    (0.966_234_76, 2.0 * 0.085_662_246 * 0.966_234_76),
];

/// A unit vector with a cosine.
fn direction(cos: f32) -> Vec3 {
    Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos)
}

/// Share of the light from a uniform hemisphere that leaves towards `wo` by the letter `D`. Exact for Lambert.
pub fn towards(bsdf: &Bsdf, wo: Vec3) -> Rgb {
    match bsdf {
        Bsdf::Lambert(part) => part.reflectance,
        other if !other.letters().has(Letter::Diffuse) => Rgb::ZERO,
        other => {
            let f = |cos: f32| {
                let wi = direction(cos);
                other.eval(wo, wi.with_z(cos.copysign(wo.z)), Transport::Radiance).diffuse / cos
            };
            DIRECTIONS.iter().map(|&(cos, weight)| f(cos) * (PI * weight)).sum()
        }
    }
}

/// Share of the light from a uniform hemisphere that leaves in all directions by the letter `D`: the reflectance of
/// a finite element. Exact for Lambert.
pub fn mean(bsdf: &Bsdf) -> Rgb {
    match bsdf {
        Bsdf::Lambert(part) => part.reflectance,
        other if !other.letters().has(Letter::Diffuse) => Rgb::ZERO,
        other => DIRECTIONS.iter().map(|&(cos, weight)| towards(other, direction(cos)) * weight).sum(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::surface::{SurfaceParameters, Walls};

    fn surface(roughness: f32, specular: f32) -> SurfaceParameters {
        SurfaceParameters {
            base_color: Vec3::new(0.8, 0.5, 0.2),
            metallic: 0.0,
            roughness,
            specular,
            specular_color: Vec3::ONE,
            ior: 1.5,
            transmission: 0.0,
            walls: Walls::Thin,
            layers: None,
        }
    }

    #[test]
    fn the_mean_of_plastic_is_that_of_many_directions() {
        for roughness in [0.0, 0.2, 1.0] {
            let bsdf = Bsdf::from_surface(&surface(roughness, 1.0));
            let n = 64;
            let at = |i: usize| {
                let squared = (i as f32 + 0.5) / n as f32;
                Vec3::new((1.0 - squared).sqrt(), 0.0, squared.sqrt())
            };
            let mut truth = glam::DVec3::ZERO;
            for (o, i) in (0..n * n).map(|k| (at(k / n), at(k % n))) {
                truth += (bsdf.eval(o, i, Transport::Radiance).diffuse * PI / i.z).as_dvec3();
            }
            truth /= (n * n) as f64;
            let found = mean(&bsdf).as_dvec3();
            assert!((found / truth - 1.0).abs().max_element() < 2e-3, "{roughness}: {found} is not {truth}");
            assert!(found.max_element() < 0.8);
        }
    }

    #[test]
    fn lambert_is_exact_and_metal_has_no_letter_d() {
        assert_eq!(mean(&Bsdf::from_surface(&surface(0.5, 0.0))), Vec3::new(0.8, 0.5, 0.2));
        let metal = SurfaceParameters { metallic: 1.0, ..surface(0.5, 1.0) };
        assert_eq!(mean(&Bsdf::from_surface(&metal)), Vec3::ZERO);
        let whole: f32 = DIRECTIONS.iter().map(|(_, weight)| weight).sum();
        assert!((whole - 1.0).abs() < 1e-6);
    }
}

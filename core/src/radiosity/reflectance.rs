//! How much of the light that arrives the letter `D` alone sends back.

use crate::bsdf::Bsdf;
use crate::bsdf::event::{Letter, Transport};
use crate::math::colour::Rgb;
use core::f32::consts::PI;
use glam::Vec3;

/// Directions on each side of the mean: their squared cosines are the middles of equal parts of 0..1.
const DIRECTIONS: usize = 6;

/// The unit vector whose squared cosine is the middle of the n-th part. `D` does not depend on azimuths.
fn direction(n: usize) -> Vec3 {
    let squared = (n as f32 + 0.5) / DIRECTIONS as f32;
    Vec3::new((1.0 - squared).sqrt(), 0.0, squared.sqrt())
}

/// Share of the light from a uniform hemisphere that leaves towards `wo` by the letter `D`. Exact for Lambert.
pub fn towards(bsdf: &Bsdf, wo: Vec3) -> Rgb {
    match bsdf {
        Bsdf::Lambert(part) => part.reflectance,
        other if !other.letters().has(Letter::Diffuse) => Rgb::ZERO,
        other => {
            let sum: Rgb = (0..DIRECTIONS)
                .map(|n| {
                    let wi = direction(n);
                    let wi = wi.with_z(wi.z.copysign(wo.z));
                    other.eval(wo, wi, Transport::Radiance).diffuse / wi.z.abs()
                })
                .sum();
            sum * (PI / DIRECTIONS as f32)
        }
    }
}

/// Share of the light from a uniform hemisphere that leaves in all directions by the letter `D`: the reflectance of
/// a finite element. Exact for Lambert.
pub fn mean(bsdf: &Bsdf) -> Rgb {
    match bsdf {
        Bsdf::Lambert(part) => part.reflectance,
        other if !other.letters().has(Letter::Diffuse) => Rgb::ZERO,
        other => (0..DIRECTIONS).map(|n| towards(other, direction(n))).sum::<Rgb>() / DIRECTIONS as f32,
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
            assert!((found / truth - 1.0).abs().max_element() < 4e-3, "{roughness}: {found} is not {truth}");
            assert!(found.max_element() < 0.8);
        }
    }

    #[test]
    fn lambert_is_exact_and_metal_has_no_letter_d() {
        assert_eq!(mean(&Bsdf::from_surface(&surface(0.5, 0.0))), Vec3::new(0.8, 0.5, 0.2));
        let metal = SurfaceParameters { metallic: 1.0, ..surface(0.5, 1.0) };
        assert_eq!(mean(&Bsdf::from_surface(&metal)), Vec3::ZERO);
    }
}

//! Glass whose refractive index differs by colour (`KHR_materials_dispersion`): three bands, red, green and blue, each
//! with a surface of its own. Light of a band scatters by its surface; one that is drawn carries that band alone.

use crate::bsdf::Bsdf;
use crate::bsdf::event::{Letters, Transport};
use crate::bsdf::lobe::{Drawn, Evaluated};
use crate::math::colour::Rgb;
use glam::{Vec2, Vec3};

/// A surface a band.
#[derive(Clone, Debug)]
pub struct Dispersed {
    bands: [Bsdf; 3],
}

/// Refractive indices of red, green and blue: 20 over the Abbe number is `dispersion`, as the extension has it.
pub fn indices(ior: f32, dispersion: f32) -> [f32; 3] {
    let half = (ior - 1.0).max(0.0) * 0.025 * dispersion;
    [(ior - half).max(ior.min(1.0)), ior, ior + half]
}

impl Dispersed {
    pub(super) fn new(bands: [Bsdf; 3]) -> Self {
        Self { bands }
    }

    pub(super) fn letters(&self) -> Letters {
        self.bands.iter().fold(Letters::NONE, |letters, band| letters.union(band.letters()))
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3, transport: Transport) -> Evaluated {
        let mut all = Evaluated::default();
        for (band, mask) in self.bands.iter().zip(Rgb::AXES) {
            let one = band.evaluate(wo, wi, transport);
            all.value.diffuse += one.value.diffuse * mask;
            all.value.glossy += one.value.glossy * mask;
            all.pdf += one.pdf / 3.0;
        }
        all
    }

    pub(super) fn draw(&self, wo: Vec3, u_lobe: f32, u: Vec2, transport: Transport) -> Option<Drawn> {
        let scaled = 3.0 * u_lobe;
        let band = (scaled as usize).min(2);
        let rest = (scaled - band as f32).clamp(0.0, 1.0_f32.next_down());
        let mut drawn = self.bands[band].draw(wo, rest, u, transport)?;
        if let Some(delta) = &mut drawn.delta {
            delta.value *= Rgb::AXES[band];
            delta.probability /= 3.0;
        }
        Some(drawn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::event::SampleKind;
    use crate::bsdf::surface::SurfaceParameters;
    use crate::bsdf::tests::{NO_LAYERS, SOLID, tilted};

    fn dispersive(roughness: f32) -> SurfaceParameters {
        let layers = Some(crate::bsdf::surface::Layers { dispersion: 2.0, ..NO_LAYERS });
        SurfaceParameters { roughness, layers, ..SOLID }
    }

    #[test]
    fn indices_are_those_of_the_abbe_number() {
        let [red, green, blue] = indices(1.5, 1.0);
        // (n_d − 1) / (n_F − n_C) = 20.
        assert!(((green - 1.0) / (blue - red) - 20.0).abs() < 1e-3);
        assert_eq!(indices(1.0, 5.0), [1.0; 3]);
    }

    #[test]
    fn each_band_is_refracted_by_its_own_index() {
        let bsdf = Bsdf::from_surface(&dispersive(0.0));
        let wo = tilted(50.0, 0.3);
        let mut sums = [Rgb::ZERO; 2];
        let n = 3000;
        for i in 0..n {
            let u = (i as f32 + 0.5) / n as f32;
            let sample = bsdf.sample(wo, u, Vec2::splat(0.5), Transport::Importance).unwrap();
            let SampleKind::Specular { weight, probability, .. } = sample.kind else { panic!("{sample:?}") };
            let band = (3.0 * u) as usize;
            assert_eq!(weight, weight * Rgb::AXES[band]);
            assert!(probability < 0.34);
            if sample.wi.z < 0.0 {
                let ratio = wo.truncate().length() / sample.wi.truncate().length();
                assert!((ratio - indices(1.5, 2.0)[band]).abs() < 1e-5, "{band}: {ratio}");
            }
            sums[usize::from(sample.wi.z < 0.0)] += weight / n as f32;
        }
        // What each band reflects and lets through is all of it.
        assert!((sums[0] + sums[1] - Rgb::ONE).abs().max_element() < 5e-3, "{sums:?}");
    }

    #[test]
    fn each_band_scatters_as_if_it_were_alone() {
        let bsdf = Bsdf::from_surface(&dispersive(0.5));
        let mut crossed = 0;
        for i in 0..2000 {
            let wo = tilted(f64::from(i % 40) * 4.4 + 1.0, 0.7);
            let u = [0.618, 0.414, 0.732].map(|step| (f64::from(i) * step).fract() as f32);
            let Some(sample) = bsdf.sample(wo, u[0], Vec2::new(u[1], u[2]), Transport::Radiance) else {
                continue;
            };
            let SampleKind::Smooth { value, pdf } = sample.kind else { panic!("{sample:?}") };
            let alone = |ior| {
                let one = Bsdf::from_surface(&SurfaceParameters { roughness: 0.5, ior, ..SOLID });
                one.eval_and_pdf(wo, sample.wi, Transport::Radiance)
            };
            let [r, g, b] = indices(1.5, 2.0).map(alone);
            assert_eq!(value.glossy, Rgb::new(r.0.glossy.x, g.0.glossy.y, b.0.glossy.z));
            assert!((pdf - (r.1 + g.1 + b.1) / 3.0).abs() <= 1e-5 * pdf);
            crossed += u32::from(sample.wi.z * wo.z < 0.0);
        }
        assert!(crossed > 500, "{crossed}");
    }
}

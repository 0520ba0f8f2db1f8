//! What arrives at elements, by particles from the lights instead of equations.
//!
//! A particle carries flux Φ; where it meets element i it adds Φ / (π Aᵢ) to Hᵢ, and goes on with ρ of it in a direction by the
//! cosine. There is no discretisation between bounces: only the result is a mean over elements.

use crate::bsdf::Bsdf;
use crate::math::colour::Rgb;
use crate::math::warp;
use crate::radiosity::element::Element;
use crate::radiosity::patch::Patches;
use crate::radiosity::reflectance;
use crate::sampler::{Dimension, Sampler, StartUse, Use};
use crate::scene::Scene;
use crate::scene::interaction::Side;
use crate::trace::moment::Moment;
use crate::trace::ray::Ray;
use core::f64::consts::PI;
use glam::DVec3;
use rayon::prelude::*;

/// Particles that are added up by one thread, in their order.
const CHUNK: u64 = 1 << 16;
/// Chunks whose sums are held at once.
const AT_ONCE: usize = 16;
/// Most scatterings of a particle: roulette ends it before where surfaces absorb at all.
const SCATTERINGS_MAX: u32 = 4096;

/// What particles left behind.
#[derive(Clone, Debug)]
pub struct Landed {
    /// Flux that arrived at each element, over π.
    pub flux: Vec<DVec3>,
    /// Rays traced.
    pub rays: u64,
}

/// Sends `count` particles from the lights, each scattered at most `scatterings` times where it lands included. The same
/// bits on any number of threads.
pub fn land(scene: &Scene, patches: &Patches, count: u64, scatterings: Option<u32>) -> Landed {
    let elements = 2 * patches.all().len();
    let mut all = Landed { flux: vec![DVec3::ZERO; elements], rays: 0 };
    let chunks: Vec<u64> = (0..count.div_ceil(CHUNK)).collect();
    let most = scatterings.unwrap_or(SCATTERINGS_MAX).min(SCATTERINGS_MAX);
    for some in chunks.chunks(AT_ONCE) {
        let landed: Vec<Landed> = (some.par_iter())
            .map(|chunk| {
                let mut landed = Landed { flux: vec![DVec3::ZERO; elements], rays: 0 };
                for index in chunk * CHUNK..((chunk + 1) * CHUNK).min(count) {
                    follow(scene, patches, &Sampler::light(0, u32::MAX, index), most, &mut landed);
                }
                landed
            })
            .collect();
        for part in landed {
            all.rays += part.rays;
            all.flux.iter_mut().zip(part.flux).for_each(|(sum, flux)| *sum += flux);
        }
    }
    for flux in &mut all.flux {
        *flux /= PI * count.max(1) as f64;
    }
    all
}

fn follow(scene: &Scene, patches: &Patches, sampler: &Sampler, most: u32, landed: &mut Landed) {
    let pair = |what| sampler.pair(Dimension::Start(what));
    let choice = pair(StartUse::Choice);
    let environment = scene.environment.as_ref();
    let origin =
        scene.lights.origin(&scene.data, environment, Moment::STILL, choice.x, pair(StartUse::Place));
    let Some(origin) = origin else { return };
    let Some(emission) = origin.place.emit(&scene.data, choice.y, pair(StartUse::Direction)) else { return };
    let density = f64::from(origin.pdf) * f64::from(emission.pdf);
    let mut flux: Rgb = emission.radiance * (emission.cos / density) as f32;
    let mut ray = emission.ray;
    for n in 0..most {
        landed.rays += 1;
        let dimension = |what| Dimension::Light(n, what);
        let Some(hit) = scene.closest(&ray, || sampler.key(dimension(Use::Alpha))) else { return };
        let at = scene.data.interaction(hit.instance, hit.triangle, hit.barycentric, Moment::STILL);
        let back = -ray.direction;
        let (side, sign) = match at.side(back) {
            Side::Front => (Side::Front, 1.0),
            Side::Back => (Side::Back, -1.0),
        };
        let (shading, geometric) = (at.shading.z.dot(back) * sign, at.ng.dot(back) * sign);
        if shading <= 0.0 || geometric <= 0.0 {
            return;
        }
        // Elements count light by the shading normal's cosine, particles arrive by the true one.
        flux *= shading / geometric;
        let (patch, _) = patches.at(hit.instance, hit.triangle, hit.barycentric);
        if flux.is_finite() {
            landed.flux[Element::new(patch, side).index()] += flux.as_dvec3();
        }
        let before = flux.max_element();
        flux *= reflectance::mean(&Bsdf::from_surface(&at.surface()));
        let survival = (flux.max_element() / before).min(1.0);
        if !(survival > 0.0 && sampler.pair(dimension(Use::Choice)).y < survival) {
            return;
        }
        flux /= survival;
        let wi = warp::cosine_hemisphere(sampler.pair(dimension(Use::Direction)));
        let direction = at.shading.to_world(wi.with_z(wi.z * sign)).normalize_or_zero();
        let leaving = direction.dot(at.ng) * sign;
        if wi.z <= 0.0 || leaving <= 0.0 {
            return;
        }
        // Veach's correction of adjoint scattering, |cos| of the true normal over that of the shading one.
        flux *= leaving / wi.z;
        ray = Ray::new(at.leave(direction), direction);
    }
}

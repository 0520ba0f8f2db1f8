//! Direct light at a vertex.

use crate::bsdf::event::Transport;
use crate::math::colour::Rgb;
use crate::path::media::Media;
use crate::path::vertex::Vertex;
use crate::sampler::{Dimension, Sampler, Use};
use crate::scene::Scene;
use crate::scene::light::{FoundBy, ShadowEnd};
use crate::settings::Shadows;
use crate::trace::ray::Ray;
use glam::Vec3;

/// Balance heuristic of two techniques of which each makes one path: p / (p + q).
#[inline]
pub fn balance(p: f32, q: f32) -> f32 {
    p / (p + q)
}

/// Light that reaches `vertex` from one sampled light and leaves towards the eye, weighted against finding it by
/// sampling the BSDF. `scattering` is the vertex's number along the path.
pub fn next_event(
    scene: &Scene,
    vertex: &Vertex<'_>,
    media: &Media,
    shadows: Shadows,
    sampler: &Sampler,
    scattering: u32,
    rays: &mut u64,
) -> Rgb {
    let choice = sampler.pair(Dimension::Eye(scattering, Use::Light)).x;
    let place = sampler.pair(Dimension::Eye(scattering, Use::LightPoint));
    let (point, moment) = (vertex.at.position, vertex.at.moment);
    let environment = scene.environment.as_ref();
    let Some(event) = scene.lights.sample(&scene.data, environment, moment, point, choice, place) else {
        return Vec3::ZERO;
    };
    let (value, bsdf_pdf) = vertex.evaluate(event.direction, Transport::Radiance);
    if value == Vec3::ZERO {
        return Vec3::ZERO;
    }
    let weight = match event.found_by {
        FoundBy::Both => balance(event.pdf, bsdf_pdf),
        FoundBy::NextEvent => 1.0,
    };
    let origin = vertex.leave(event.direction);
    let (ray, distance) = match event.end {
        ShadowEnd::Point(end) => {
            (Ray { origin, direction: end - origin, t_max: 1.0, moment }, (end - origin).length())
        }
        ShadowEnd::Infinity => (Ray::new(origin, event.direction).at(moment), 0.0),
    };
    let passes = match shadows {
        Shadows::On => {
            *rays += 1;
            scene.transmittance(&ray)
        }
        Shadows::Off => 1.0,
    };
    if passes == 0.0 {
        return Vec3::ZERO;
    }
    value * event.radiance * media.transmittance(distance) * (passes * weight / event.pdf)
}

//! What passes between two points.

use crate::math::colour::Rgb;
use crate::path::media::Media;
use crate::path::tally::Tally;
use crate::path::vertex::{Crossing, Vertex};
use crate::scene::Scene;
use crate::trace::ray::Ray;
use glam::Vec3;

/// Share of light that passes from a vertex to a point that is just off another surface; `media` are those that the
/// vertex' subpath arrived through.
pub fn between(scene: &Scene, vertex: &Vertex<'_>, media: &Media, end: Vec3, tally: &mut Tally) -> Rgb {
    let towards = end - vertex.at.position;
    let origin = vertex.leave(towards);
    let ray = Ray { origin, direction: end - origin, t_max: 1.0, moment: vertex.at.moment };
    let passes = along(scene, &ray, tally);
    if passes == 0.0 {
        return Vec3::ZERO;
    }
    faded(vertex, media, towards, (end - origin).length()) * passes
}

/// The same to a place on the lens, along the ray by which the eye sees the vertex: where that place lies on a surface, both
/// ways are not alike, but path and light are to agree.
pub fn seen(scene: &Scene, vertex: &Vertex<'_>, media: &Media, eye: Vec3, tally: &mut Tally) -> Rgb {
    let towards = eye - vertex.at.position;
    let end = vertex.at.arrive(eye);
    let ray = Ray { origin: eye, direction: end - eye, t_max: 1.0, moment: vertex.at.moment };
    let passes = along(scene, &ray, tally);
    if passes == 0.0 {
        return Vec3::ZERO;
    }
    faded(vertex, media, towards, (end - eye).length()) * passes
}

/// Share of light that passes from a vertex to infinity.
pub fn to_infinity(
    scene: &Scene,
    vertex: &Vertex<'_>,
    media: &Media,
    direction: Vec3,
    tally: &mut Tally,
) -> Rgb {
    let passes = along(scene, &vertex.ray(direction), tally);
    if passes == 0.0 {
        return Vec3::ZERO;
    }
    faded(vertex, media, direction, 0.0) * passes
}

/// Share of light that passes along a ray in vacuum.
pub fn along(scene: &Scene, ray: &Ray, tally: &mut Tally) -> f32 {
    tally.rays += 1;
    scene.transmittance(ray)
}

/// Share of light that solids leave over a distance from a vertex.
pub fn faded(vertex: &Vertex<'_>, media: &Media, direction: Vec3, distance: f32) -> Rgb {
    match vertex.crossing(direction) {
        Crossing::Stays => media.transmittance(distance),
        Crossing::Crosses => {
            let mut beyond = *media;
            beyond.cross(&vertex.at, direction);
            beyond.transmittance(distance)
        }
    }
}

//! The walk from the eye.

use crate::bsdf::event::Transport;
use crate::math::cosine::cosine;
use crate::path::connect::hit::{hit_environment, hit_surface};
use crate::path::connect::join::join;
use crate::path::connect::light_vertex::LightVertex;
use crate::path::connect::next_event::next_event;
use crate::path::expression::language::EyeState;
use crate::path::mis::exhaustive::Link;
use crate::path::mis::partial::Partial;
use crate::path::rules::{Rules, Weighing};
use crate::path::tally::Tally;
use crate::path::throughput::{Carriage, Throughput};
use crate::path::vertex::{Density, Vertex};
use crate::path::walk::{Edge, EdgeKind, Visitor, Walk};
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::scene::importance::Importance;
use crate::scene::interaction::Interaction;
use crate::scene::lit::Lit;
use crate::trace::ray::Ray;
use glam::Vec3;

/// A walk from the eye that hits lights, makes next events, and is joined to all vertices of a light subpath.
/// `TWO_WAY` where weights ask for the techniques of that subpath; without it, `light` is empty.
#[derive(Debug)]
pub struct FromEye<'v, 'a, C: Carriage, const TWO_WAY: bool> {
    /// Vertices of the light subpath.
    pub light: &'v [LightVertex<'a, C::Light>],
}

impl<'a, C: Carriage, const TWO_WAY: bool> Visitor<'a, EyeState, C::Eye> for FromEye<'_, 'a, C, TWO_WAY> {
    const TWO_WAY: bool = TWO_WAY;

    fn escapes(&mut self, walk: &Walk<'a, EyeState, C::Eye>, tally: &mut Tally) {
        hit_environment::<C::Eye, C::Light>(walk, tally);
    }

    fn arrives(
        &mut self,
        walk: &mut Walk<'a, EyeState, C::Eye>,
        at: &Interaction<'a>,
        triangle: (u32, u32),
        tally: &mut Tally,
    ) {
        hit_surface::<C::Eye, C::Light>(walk, at, triangle, tally);
    }

    fn scatters(&mut self, walk: &Walk<'a, EyeState, C::Eye>, vertex: &Vertex<'a>, tally: &mut Tally) {
        if vertex.is_smooth() {
            next_event::<C::Eye, C::Light>(walk, vertex, tally);
            for light in self.light {
                join(walk, vertex, light, tally);
            }
        }
    }
}

/// The walk along a camera ray.
pub fn from_eye<'a, C: Carriage>(
    scene: &'a Scene,
    rules: &'a Rules,
    sampler: &'a Sampler,
    ray: Ray,
) -> Walk<'a, EyeState, C::Eye> {
    let view = scene.view(ray.moment);
    let (pdf, kind) = match view.ray_pdf(ray.direction) {
        Importance::SolidAngle(pdf) => (pdf, EdgeKind::Directions),
        Importance::Area(pdf) => (pdf, EdgeKind::Parallel),
    };
    // Light subpaths that are joined to the lens reach every pixel.
    let near = match rules.weighing {
        Weighing::All(h) => h.of(rules.light_paths / pdf),
        Weighing::Caustics => rules.light_paths / pdf,
        _ => 0.0,
    };
    let carried = C::Eye::in_state(rules.language.eye_start(), Vec3::ONE);
    let cos = cosine(view.axis(), ray.direction);
    let density = Density::SolidAngle(pdf as f32);
    let edge = Edge { ray, from: Lit::in_space(ray.origin), cos, density, kind };
    let partial = Partial { near, far: 0.0 };
    let mut walk = Walk::new((scene, rules, sampler), Transport::Radiance, edge, carried, partial);
    walk.media = rules.media_of_eye(scene, &ray);
    if walk.keeps_links() {
        walk.links.push(Link { forward: 1.0, reverse: 0.0, jacobian: 0.0, specular: false });
    }
    walk
}

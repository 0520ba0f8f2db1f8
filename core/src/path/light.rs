//! The walk from a light.

use crate::bsdf::event::Transport;
use crate::math::colour::Rgb;
use crate::math::cosine::{cosine, squared_distance};
use crate::path::connect::lens::{Shown, hit_lens, light_to_lens, to_lens};
use crate::path::connect::light_vertex::{LightStart, LightVertex};
use crate::path::connect::unblocked;
use crate::path::expression::language::LightState;
use crate::path::media::Media;
use crate::path::mis::exhaustive::Link;
use crate::path::mis::partial::Partial;
use crate::path::rules::{Rules, Weighing};
use crate::path::tally::Tally;
use crate::path::throughput::{Carriage, Throughput};
use crate::path::vertex::{Cast, Density, Vertex};
use crate::path::walk::{Edge, EdgeKind, Visitor, Walk};
use crate::sampler::{Dimension, Sampler, StartUse};
use crate::scene::Scene;
use crate::scene::emission::{Emission, Origin, Place};
use crate::scene::interaction::Interaction;
use crate::scene::lit::Lit;
use crate::trace::moment::Moment;
use crate::trace::ray::Ray;
use glam::{Vec2, Vec3};

/// What a walk from a light leaves behind.
#[derive(Debug)]
pub struct FromLight<'a, C: Carriage> {
    /// Vertices that eye subpaths can be joined to, where they are kept.
    pub vertices: Vec<LightVertex<'a, C::Light>>,
    keeps: Keeps,
    pub(in crate::path) start: LightStart,
    /// What the first surface makes of light.
    cast: Cast,
    origin: Origin<'a>,
}

/// Whether vertices are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keeps {
    /// For joins.
    Vertices,
    /// The lens is all there is to join to.
    Nothing,
}

impl<'a, C: Carriage> Visitor<'a, LightState, C::Light> for FromLight<'a, C> {
    const TWO_WAY: bool = true;

    fn flies(&mut self, walk: &Walk<'a, LightState, C::Light>, t_max: f32, tally: &mut Tally) {
        hit_lens::<C::Eye, C::Light>(walk, t_max, self.start, tally);
    }

    fn arrives(
        &mut self,
        walk: &mut Walk<'a, LightState, C::Light>,
        at: &Interaction<'a>,
        _: (u32, u32),
        _: &mut Tally,
    ) {
        if walk.scatterings == 0 {
            self.learn(walk, at);
        }
    }

    fn leaves(&self, walk: &Walk<'a, LightState, C::Light>, vertex: &Vertex<'a>) -> bool {
        !matches!(walk.rules.weighing, Weighing::Caustics)
            || walk.scatterings > 0
            || vertex.cast() == Cast::Caustic
    }

    fn scatters(&mut self, walk: &Walk<'a, LightState, C::Light>, vertex: &Vertex<'a>, tally: &mut Tally) {
        if walk.scatterings == 0 {
            self.cast = vertex.cast();
        }
        if !vertex.is_smooth() || !self.leaves(walk, vertex) {
            return;
        }
        to_lens::<C::Eye, C::Light>(walk, vertex, (self.start, self.cast), tally);
        if self.keeps == Keeps::Vertices {
            self.vertices.push(LightVertex {
                vertex: vertex.clone(),
                carried: walk.carried.clone(),
                partial: walk.partial,
                media: walk.media,
                vertices: walk.scatterings as usize + 2,
                cast: self.cast,
                survival: walk.rules.tells_squares().then(|| Box::new(walk.survival.clone())),
                links: walk.links.clone(),
                start: self.start,
            });
        }
    }
}

impl<'a, C: Carriage> FromLight<'a, C> {
    /// At the second vertex: how next events there would have found the first. Lights, and places on their surfaces, are
    /// sampled differently by the two, so that 1 / p→ of the first edge alone is not yet what is behind.
    fn learn(&mut self, walk: &mut Walk<'a, LightState, C::Light>, at: &Interaction<'a>) {
        let (scene, light) = (walk.scene, self.origin.light);
        if !matches!(self.origin.place, Place::Surface(_)) && !scene.lights.are_by_tree() {
            return;
        }
        let towards = -walk.edge.ray.direction;
        let lit = at.lit(at.side(towards));
        self.start.next_event = match (&self.origin.place, &scene.environment) {
            (Place::Surface(from), _) => {
                let pdf = scene.lights.light_pdf(&scene.data, light, &lit, from, towards);
                f64::from(pdf) * walk.edge.cos / walk.squared(at.position)
            }
            (Place::Sky(..), Some(sky)) => f64::from(scene.lights.environment_pdf(sky, &lit, towards)),
            _ => f64::from(scene.lights.probability_at(&lit, light)),
        };
        let h = walk.rules.heuristic();
        walk.partial.near *= h.of(self.start.next_event / f64::from(self.origin.pdf));
    }
}

/// Samples a light subpath, joins it to the lens, and returns its vertices.
pub fn from_light<'a, C: Carriage>(
    scene: &'a Scene,
    rules: &'a Rules,
    (sampler, moment): (&'a Sampler, Moment),
    keeps: Keeps,
    tally: &mut Tally,
) -> Vec<LightVertex<'a, C::Light>> {
    let pair = |what| sampler.pair(Dimension::Start(what));
    let choice = pair(StartUse::Choice);
    let environment = scene.environment.as_ref();
    let origin = scene.lights.origin(&scene.data, environment, moment, choice.x, pair(StartUse::Place));
    let Some(origin) = origin else { return Vec::new() };
    let Some(state) = rules.language.light_start(rules.tag(origin.light)) else { return Vec::new() };
    if rules.uses((1, 1)) {
        show::<C>((scene, moment), rules, &origin, state, pair(StartUse::Lens), tally);
    }
    let Some(emission) = origin.place.emit(&scene.data, choice.y, pair(StartUse::Direction)) else {
        return Vec::new();
    };
    let is_near = !origin.place.is_distant();
    let (mut walk, mut visitor) =
        set_out::<C>((scene, rules), (sampler, moment), origin, &emission, state, keeps);
    if is_near {
        walk.media = Media::around(scene, emission.ray.origin, moment, &mut tally.rays);
    }
    walk.run(&mut visitor, tally);
    visitor.vertices
}

/// The walk along the first edge that light takes from `origin`, and what follows it.
pub(in crate::path) fn set_out<'a, C: Carriage>(
    (scene, rules): (&'a Scene, &'a Rules),
    (sampler, moment): (&'a Sampler, Moment),
    origin: Origin<'a>,
    emission: &Emission,
    state: LightState,
    keeps: Keeps,
) -> (Walk<'a, LightState, C::Light>, FromLight<'a, C>) {
    let is_hit = matches!(origin.place, Place::Surface(_) | Place::Sky(..));
    let kind = if origin.place.is_distant() { EdgeKind::Parallel } else { EdgeKind::Directions };
    let (place, direction) = (f64::from(origin.pdf), f64::from(emission.pdf));
    let h = rules.heuristic();
    let cos = emission.cos;
    let near = h.of(1.0 / direction);
    let far = if is_hit { h.of(cos / (place * direction)) } else { 0.0 };
    let throughput = emission.radiance * (cos / (place * direction)) as f32;
    let carried = C::Light::in_state(state, throughput);
    let from = match &origin.place {
        Place::Surface(at) => at.position,
        _ => emission.ray.origin,
    };
    let density = Density::SolidAngle(emission.pdf);
    let edge = Edge { ray: emission.ray.at(moment), from: Lit::in_space(from), cos, density, kind };
    let partial = Partial { near, far };
    let mut walk = Walk::new((scene, rules, sampler), Transport::Importance, edge, carried, partial);
    if walk.keeps_links() {
        walk.links.push(Link { forward: place, reverse: 0.0, jacobian: 0.0, specular: false });
    }
    let start = LightStart { next_event: place, is_hit };
    (walk, FromLight { vertices: Vec::new(), keeps, start, cast: Cast::Diffuse, origin })
}

/// Joins the place that light starts from to the lens itself.
fn show<C: Carriage>(
    (scene, moment): (&Scene, Moment),
    rules: &Rules,
    origin: &Origin<'_>,
    state: LightState,
    lens: Vec2,
    tally: &mut Tally,
) {
    let view = scene.view(moment);
    let (seen, radiance, ray, squared, cos) = match &origin.place {
        Place::Surface(at) => {
            let Some(seen) = view.see(at.position, lens) else { return };
            let radiance = at.emission(at.side(seen.direction)) * at.alpha();
            let ray = Ray { origin: seen.end, direction: at.arrive(seen.end) - seen.end, t_max: 1.0, moment };
            let squared = squared_distance(seen.end, at.position);
            (seen, radiance, ray, squared, cosine(seen.direction, at.ng))
        }
        Place::Sky(towards, radiance) => {
            let Some(seen) = view.see_far(*towards, lens) else { return };
            (seen, *radiance, Ray::new(seen.end, *towards).at(moment), 1.0, 1.0)
        }
        Place::Point(..) | Place::Sun(..) => return,
    };
    if radiance == Vec3::ZERO {
        return;
    }
    let passes = unblocked::along(scene, &ray, tally);
    if passes > 0.0 {
        let place = f64::from(origin.pdf);
        let media = match &origin.place {
            Place::Surface(at) => Media::around(scene, at.leave(seen.direction), moment, &mut tally.rays),
            _ => Media::VACUUM,
        };
        let left = media.transmittance(ray.direction.length());
        let radiance: Rgb = radiance / origin.pdf * left;
        let environment = scene.environment.as_ref();
        let towards = -seen.direction;
        let emission =
            scene.lights.emission_density(&scene.data, environment, moment, origin.light, towards, cos);
        let cos_lens = cosine(view.axis(), towards);
        let onto_lens = f64::from(emission.emission) * cos_lens / squared;
        let lens = view.lens_pdf();
        let shown = Shown { seen, radiance, place, squared, cos, onto_lens, lens, passes, state };
        light_to_lens::<C::Eye, C::Light>(rules, &shown, tally);
    }
}

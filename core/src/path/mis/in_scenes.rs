//! Random paths in random scenes: what the walks and joints say of every technique, against all densities written out from
//! positions, BSDFs, lights and the camera.
//!
//! A path is given by its vertices. Unit directions between them are in f32, as everywhere; all else is computed in f64.

mod world;

use crate::bsdf::Bsdf;
use crate::bsdf::event::{Scattered, Transport};
use crate::path::connect::hit::{self, Hit};
use crate::path::connect::join::{self, Between};
use crate::path::connect::lens::{self, LensEnd};
use crate::path::connect::light_vertex::{LightStart, LightVertex};
use crate::path::connect::next_event;
use crate::path::expression::language::{EyeState, LightState};
use crate::path::eye::{FromEye, from_eye};
use crate::path::light::{FromLight, Keeps, set_out};
use crate::path::mis::heuristic::Heuristic;
use crate::path::rules::Rules;
use crate::path::tally::Tally;
use crate::path::throughput::{Carriage, Everything};
use crate::path::vertex::{Continuation, Density, Vertex, Weight};
use crate::path::walk::{Visitor, Walk};
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::scene::emission::{Emission, EmissionDensity, Origin, Place};
use crate::scene::importance::{Importance, Seen};
use crate::scene::interaction::Interaction;
use crate::scene::light::{FoundBy, Light, NextEvent, ShadowEnd};
use crate::scene::material::Sides;
use crate::scene::punctual::PunctualKind;
use crate::settings::Weights;
use crate::trace::moment::Moment;
use crate::trace::ray::Ray;
use core::f64::consts::PI;
use glam::{DVec3, Vec2, Vec3};
use libm::log;
use world::{Kind, Numbers, scene, settings};

const NOW: Moment = Moment::STILL;

/// A vertex between light and lens.
#[derive(Clone, Copy)]
struct Point<'a> {
    at: Interaction<'a>,
    specular: bool,
    /// Unit directions to the light's side and to the eye's.
    to: [Vec3; 2],
}

/// A path from a light to the lens.
struct Path<'a> {
    scene: &'a Scene,
    origin: Origin<'a>,
    density: EmissionDensity,
    /// From the light on.
    vertices: Vec<Point<'a>>,
    seen: Seen,
}

/// Surfaces that a walk from the eye meets, from the eye on, and whether it goes through them by a Dirac delta: `most` and
/// on to one that is not ideally specular.
fn surfaces<'a>(
    scene: &'a Scene,
    rules: &Rules,
    most: usize,
    numbers: &mut Numbers,
) -> Option<(Vec<(Interaction<'a>, bool)>, Vec2)> {
    let lens = numbers.pair();
    let mut ray = scene.view(NOW).ray(numbers.pair() * 8.0, lens).at(NOW);
    let mut all = Vec::new();
    loop {
        let hit = scene.closest(&ray, || 0)?;
        let at = scene.data.interaction(hit.instance, hit.triangle, hit.barycentric, NOW);
        let vertex = Vertex::new(at, -ray.direction, rules)?;
        let next = vertex.sample(numbers.one(), numbers.pair(), Transport::Radiance)?;
        if all.len() + 1 >= most && vertex.is_smooth() {
            all.push((at, false));
            return Some((all, lens));
        }
        if all.len() > most + 40 {
            return None;
        }
        all.push((at, next.density == Density::Delta));
        ray = vertex.ray(next.direction);
    }
}

fn path<'a>(scene: &'a Scene, rules: &Rules, most: usize, numbers: &mut Numbers) -> Option<Path<'a>> {
    let (mut surfaces, lens) = surfaces(scene, rules, most, numbers)?;
    surfaces.reverse();
    let environment = scene.environment.as_ref();
    let origin = scene.lights.origin(&scene.data, environment, NOW, numbers.one(), numbers.pair())?;
    let first = surfaces[0].0.position;
    let to_light = match &origin.place {
        Place::Surface(at) => (at.position - first).try_normalize()?,
        Place::Point(_, position) => (position - first).try_normalize()?,
        Place::Sky(towards, _) | Place::Sun(towards, _) => *towards,
    };
    let cos = match &origin.place {
        Place::Surface(at) => {
            let lit = at.emission(at.side(-to_light)) != Vec3::ZERO;
            lit.then(|| cosine(to_light, at.ng)).filter(|cos| *cos > 1e-3)?
        }
        Place::Point(PunctualKind::Spot { direction, inner_cos, outer_cos, .. }, _) => {
            (PunctualKind::cone(*inner_cos, *outer_cos, -direction.dot(to_light)) > 0.0).then_some(1.0)?
        }
        _ => 1.0,
    };
    let density = scene.lights.emission_density(&scene.data, environment, NOW, origin.light, to_light, cos);
    let seen = scene.view(NOW).see(surfaces.last()?.0.position, lens)?;
    let mut vertices: Vec<Point<'a>> = Vec::new();
    for (i, (at, specular)) in surfaces.iter().enumerate() {
        let light = match i.checked_sub(1) {
            Some(before) => (surfaces[before].0.position - at.position).try_normalize()?,
            None => to_light,
        };
        let eye = match surfaces.get(i + 1) {
            Some((next, _)) => -(at.position - next.position).try_normalize()?,
            None => seen.direction,
        };
        vertices.push(Point { at: *at, specular: *specular, to: [light, eye] });
    }
    let origin = Origin { pdf: density.origin, ..origin };
    let path = Path { scene, origin, density, vertices, seen };
    path.vertices.iter().all(|v| v.specular || path_goes(v, rules)).then_some(path)
}

/// Whether a vertex scatters this way at all, seen from both sides.
fn path_goes(v: &Point<'_>, rules: &Rules) -> bool {
    v.to.into_iter().zip([v.to[1], v.to[0]]).all(|(back, direction)| {
        Vertex::new(v.at, back, rules)
            .is_some_and(|vertex| vertex.evaluate(direction, Transport::Radiance).1 > 0.0)
    })
}

fn cosine(a: Vec3, b: Vec3) -> f64 {
    a.as_dvec3().dot(b.as_dvec3()).abs()
}

fn squared(a: Vec3, b: Vec3) -> f64 {
    let off: DVec3 = a.as_dvec3() - b.as_dvec3();
    off.length_squared()
}

type EyeWalk<'a> = Walk<'a, EyeState, <Everything as Carriage>::Eye>;
type LightWalk<'a> = Walk<'a, LightState, <Everything as Carriage>::Light>;

/// What the walks have at each vertex, from the light on.
struct Walked<'a> {
    light: Vec<(LightWalk<'a>, Vertex<'a>)>,
    start: LightStart,
    eye: Vec<(EyeWalk<'a>, Vertex<'a>)>,
    /// The walk from the eye where it is at the light.
    end: EyeWalk<'a>,
}

fn continuation(vertex: &Vertex<'_>, v: &Point<'_>, direction: Vec3, transport: Transport) -> Continuation {
    let density = if v.specular {
        Density::Delta
    } else {
        Density::SolidAngle(vertex.evaluate(direction, transport).1)
    };
    let weight = Weight::Smooth(Scattered::default());
    Continuation { direction, weight, density, eta: 1.0, crossing: vertex.crossing(direction) }
}

impl<'a> Path<'a> {
    fn is_hit(&self) -> bool {
        matches!(self.origin.place, Place::Surface(_) | Place::Sky(..))
    }

    fn distant(&self) -> bool {
        self.origin.place.is_distant()
    }

    /// Follows the path from both ends, as renders do.
    fn walk(&'a self, rules: &'a Rules, sampler: &'a Sampler) -> Option<Walked<'a>> {
        let (scene, tally) = (self.scene, &mut Tally::new(1));
        let towards = -self.vertices[0].to[0];
        let from = match &self.origin.place {
            Place::Surface(at) => at.position,
            Place::Point(_, position) => *position,
            _ => self.vertices[0].at.position - towards,
        };
        let cos = match &self.origin.place {
            Place::Surface(at) => cosine(towards, at.ng),
            _ => 1.0,
        };
        let ray = Ray::new(from, towards);
        let emission = Emission { ray, radiance: Vec3::ONE, pdf: self.density.emission, cos };
        let state = rules.language.light_start(rules.tag(self.origin.light))?;
        let (mut walk, mut visitor) = set_out::<Everything>(
            (scene, rules),
            (sampler, NOW),
            self.origin,
            &emission,
            state,
            Keeps::Nothing,
        );
        let mut light = Vec::new();
        for v in &self.vertices {
            walk.arrive(&v.at);
            visitor.arrives(&mut walk, &v.at, (0, 0), tally);
            let vertex = Vertex::new(v.at, v.to[0], rules)?;
            light.push((walk.clone(), vertex.clone()));
            let next = continuation(&vertex, v, v.to[1], Transport::Importance);
            walk.scatterings += 1;
            walk.follow::<FromLight<'a, Everything>>(&vertex, &next);
        }
        let ray = Ray::new(self.seen.end, -self.seen.direction);
        let mut walk = from_eye::<Everything>(scene, rules, sampler, ray.at(NOW));
        let mut eye = Vec::new();
        for v in self.vertices.iter().rev() {
            walk.arrive(&v.at);
            let vertex = Vertex::new(v.at, v.to[1], rules)?;
            eye.push((walk.clone(), vertex.clone()));
            let next = continuation(&vertex, v, v.to[0], Transport::Radiance);
            walk.scatterings += 1;
            walk.follow::<FromEye<'a, 'a, Everything, true>>(&vertex, &next);
        }
        eye.reverse();
        if let Place::Surface(at) = &self.origin.place {
            walk.arrive(at);
        }
        Some(Walked { light, start: visitor.start, eye, end: walk })
    }

    /// Density of next events from the second vertex over solid angle, or the probability of the light.
    fn next_event_pdf(&self) -> f32 {
        let (lights, light) = (&self.scene.lights, self.origin.light);
        let v = &self.vertices[0];
        let lit = v.at.lit(v.at.side(v.to[0]));
        match (&self.origin.place, &self.scene.environment) {
            (Place::Surface(at), _) => lights.light_pdf(&self.scene.data, light, &lit, at, v.to[0]),
            (Place::Sky(..), Some(sky)) => lights.environment_pdf(sky, &lit, v.to[0]),
            _ => lights.probability_at(&lit, light),
        }
    }

    /// What the render would say of the technique with `s` vertices from the light.
    fn weight(&self, s: usize, walked: &Walked<'_>) -> f64 {
        let count = self.vertices.len();
        let first = &self.vertices[0];
        let (cos, off) = match &self.origin.place {
            Place::Surface(at) => (cosine(first.to[0], at.ng), squared(at.position, first.at.position)),
            Place::Point(_, position) => (1.0, squared(*position, first.at.position)),
            _ => (1.0, 1.0),
        };
        let pdf = self.next_event_pdf();
        if s == 0 {
            let next_event = if self.distant() { f64::from(pdf) } else { f64::from(pdf) * cos / off };
            let light = self.origin.light;
            let hit = Hit { light, radiance: Vec3::ONE, next_event, emission: self.density, jacobian: 0.0 };
            return hit::weight(&walked.end, &hit);
        }
        if s == 1 {
            let (walk, vertex) = &walked.eye[0];
            let found_by = if self.is_hit() { FoundBy::Both } else { FoundBy::NextEvent };
            let (direction, radiance) = (first.to[0], Vec3::ONE);
            let end = ShadowEnd::Infinity;
            let event = NextEvent { direction, radiance, pdf, cos, squared: off, found_by, end };
            let bsdf_pdf = vertex.evaluate(direction, Transport::Radiance).1;
            return next_event::weight(walk, vertex, self.origin.light, &event, bsdf_pdf);
        }
        let (light_walk, light) = &walked.light[s - 2];
        let to_eye = self.vertices[s - 2].to[1];
        let backward = light.evaluate(to_eye, Transport::Importance).1;
        if s == count + 1 {
            let off = squared(self.seen.end, light.at.position);
            let end = LensEnd::new(light_walk, light, &self.seen, off, backward);
            let reverse = f64::from(light.reverse_pdf(self.seen.direction));
            return lens::weight(light_walk, &end, walked.start, reverse);
        }
        let (eye_walk, eye) = &walked.eye[s - 1];
        let between = Between {
            direction: -to_eye,
            squared: squared(light.at.position, eye.at.position),
            pdfs: [eye.evaluate(-to_eye, Transport::Radiance).1, backward],
        };
        let kept = LightVertex {
            vertex: light.clone(),
            carried: light_walk.carried,
            partial: light_walk.partial,
            media: light_walk.media,
            vertices: s,
            cast: light.cast(),
            survival: None,
            links: Vec::new(),
            start: walked.start,
        };
        join::weight(eye_walk, eye, &kept, &between)
    }

    /// Density over solid angle of going on to one side (0: the light's, 1: the eye's), by the BSDF alone.
    fn pdf(&self, i: usize, side: usize, rules: &Rules) -> f64 {
        let Point { at, specular, to } = &self.vertices[i];
        if *specular {
            return 1.0;
        }
        let bsdf = Bsdf::keeping(&at.surface(), rules.letters);
        let [wi, wo] = [to[side], to[1 - side]].map(|d| at.shading.to_local(d));
        f64::from(bsdf.pdf(wo, wi))
    }

    /// Logarithms of the densities of all vertices from the light's side, the first also as a next event picks it, and from
    /// the eye's.
    fn densities(&self, rules: &Rules) -> (Vec<f64>, f64, Vec<f64>) {
        let (scene, count) = (self.scene, self.vertices.len());
        let chosen = f64::from(scene.lights.probability(self.origin.light));
        let first = &self.vertices[0];
        let disk = scene.data.bounds.radius() * 1.000_1;
        // The place, the first edge, one over the cosine and squared length of what leads back to the light.
        let (place, emitted, back, off) = match (&self.origin.place, scene.lights.light(self.origin.light)) {
            (Place::Surface(at), Light::Triangle { instance, triangle }) => {
                let [a, b, c] = scene.data.corners(*instance, *triangle, NOW).map(Vec3::as_dvec3);
                let area = 0.5 * (b - a).cross(c - a).length();
                let cos = cosine(first.to[0], at.ng);
                let sides = if at.material.sides == Sides::Both { 2.0 } else { 1.0 };
                (chosen / area, cos / (PI * sides), cos, squared(at.position, first.at.position))
            }
            (Place::Point(kind, position), _) => {
                let solid_angle = match kind {
                    PunctualKind::Spot { outer_cos, .. } => 2.0 * PI * (1.0 - f64::from(*outer_cos)),
                    _ => 4.0 * PI,
                };
                (chosen, 1.0 / solid_angle, 1.0, squared(*position, first.at.position))
            }
            (Place::Sky(towards, _), _) => {
                let sky = scene.environment.as_ref().unwrap();
                (chosen * f64::from(sky.pdf(*towards)), 1.0 / (PI * disk * disk), 1.0, 1.0)
            }
            _ => (chosen, 1.0 / (PI * disk * disk), 1.0, 1.0),
        };
        let picked = match &self.origin.place {
            Place::Surface(_) => f64::from(self.next_event_pdf()) * back / off,
            _ => f64::from(self.next_event_pdf()),
        };
        let mut from_light = vec![log(place), log(emitted * cosine(first.to[0], first.at.ng) / off)];
        let mut from_eye = vec![log(self.pdf(0, 0, rules) * back / off)];
        for i in 1..count {
            let [a, b] = [&self.vertices[i - 1], &self.vertices[i]];
            let off = squared(a.at.position, b.at.position);
            from_light.push(log(self.pdf(i - 1, 1, rules) * cosine(b.to[0], b.at.ng) / off));
            from_eye.push(log(self.pdf(i, 0, rules) * cosine(a.to[1], a.at.ng) / off));
        }
        let last = &self.vertices[count - 1];
        let cos = cosine(last.to[1], last.at.ng);
        from_eye.push(match self.seen.pdf {
            Importance::SolidAngle(pdf) => log(pdf * cos / squared(self.seen.end, last.at.position)),
            Importance::Area(pdf) => log(pdf * cos),
        });
        (from_light, log(picked), from_eye)
    }

    /// Logarithm of how often each technique makes the path, from s = 0 to all but the lens; minus infinity where it cannot.
    fn techniques(&self, rules: &Rules) -> Vec<f64> {
        let (from_light, picked, from_eye) = self.densities(rules);
        let count = self.vertices.len();
        let specular = |vertex: usize| (1..=count).contains(&vertex) && self.vertices[vertex - 1].specular;
        let of = |s: usize| {
            let joined = if s == 0 { self.is_hit() } else { !specular(s - 1) && !specular(s) };
            if !joined {
                return f64::NEG_INFINITY;
            }
            let light: f64 = if s == 1 { picked } else { from_light[..s].iter().sum() };
            let splats = if s == count + 1 { log(rules.light_paths) } else { 0.0 };
            light + from_eye[s..].iter().sum::<f64>() + splats
        };
        (0..count + 2).map(of).collect()
    }
}

/// How far off weights were.
#[derive(Debug, Default)]
struct Found {
    paths: u32,
    longest: usize,
    lights: [u32; 4],
    sum: f64,
    weight: f64,
}

fn check(kind: Kind, most: usize, seed: u32, tries: u32, found: &mut Found) {
    let mut numbers = Numbers { sampler: Sampler::new(11, 0, [most as u32, kind as u32], seed), next: 0 };
    let mut scene = scene(kind, &mut numbers);
    if seed % 2 == 1 {
        scene.lights = scene.lights.by_tree(&scene.data);
    }
    let heuristics = [(Heuristic::Balance, Weights::Balance), (Heuristic::Power, Weights::Power)];
    for (h, weights) in heuristics {
        let rules = Rules::new(&scene, &settings(weights), 64).unwrap();
        for _ in 0..tries {
            let Some(path) = path(&scene, &rules, most, &mut numbers) else { continue };
            let sampler = Sampler::new(1, 0, [0, 0], 0);
            let Some(walked) = path.walk(&rules, &sampler) else { continue };
            let densities = path.techniques(&rules);
            let able = |s: &usize| densities[*s] > f64::NEG_INFINITY;
            let mut sum = 0.0;
            for s in (0..densities.len()).filter(able) {
                let recursive = path.weight(s, &walked);
                let all = (0..densities.len()).filter(able);
                let written_out =
                    1.0 / all.map(|o| h.of(libm::exp(densities[o] - densities[s]))).sum::<f64>();
                let off = (recursive - written_out).abs() / written_out.max(1e-200);
                let what = || {
                    let (place, n) = (&path.origin.place, path.vertices.len());
                    format!(
                        "{kind:?} {seed}, {h:?}, {n} vertices, s = {s}: {recursive} {written_out} {place:?}"
                    )
                };
                assert!(off <= 1e-6, "{}", what());
                (found.weight, sum) = (found.weight.max(off), sum + recursive);
            }
            if densities.iter().any(|d| *d > f64::NEG_INFINITY) {
                assert!((sum - 1.0_f64).abs() <= 1e-9, "{kind:?} {seed}, {h:?}: {sum}");
                found.sum = found.sum.max((sum - 1.0).abs());
                found.paths += 1;
                found.longest = found.longest.max(path.vertices.len());
                found.lights[match path.origin.place {
                    Place::Surface(_) => 0,
                    Place::Point(..) => 1,
                    Place::Sky(..) => 2,
                    Place::Sun(..) => 3,
                }] += 1;
            }
        }
    }
}

#[test]
fn short_paths_in_random_scenes() {
    let mut found = Found::default();
    for seed in 0..300 {
        for most in 1..=6 {
            check(Kind::Any, most, seed, 4, &mut found);
        }
    }
    assert!(found.paths > 4000 && found.lights.iter().all(|n| *n > 200), "{found:?}");
}

#[test]
fn paths_of_two_hundred_vertices_between_narrow_and_matt_walls() {
    let mut found = Found::default();
    for seed in 0..20 {
        check(Kind::Tunnel, 198, seed, 3, &mut found);
    }
    assert!(found.paths > 60 && found.longest >= 198, "{found:?}");
}

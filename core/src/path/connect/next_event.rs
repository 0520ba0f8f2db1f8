//! Direct light at a vertex: one vertex of the path is from the light.

use crate::bsdf::event::Transport;
use crate::math::colour::Rgb;
use crate::path::connect::light_vertex::LightStart;
use crate::path::connect::squares::{self, Made};
use crate::path::connect::unblocked;
use crate::path::connect::whole::{Joint, whole};
use crate::path::expression::language::{EyeState, LightState};
use crate::path::mis::exhaustive::{Link, PathDensity};
use crate::path::mis::recursive::{self, NextEventDensities};
use crate::path::rules::Weighing;
use crate::path::survival::to_the_light;
use crate::path::tally::{Receiver, Tally};
use crate::path::throughput::Throughput;
use crate::path::vertex::{Cast, Vertex, Weight};
use crate::path::walk::Walk;
use crate::scene::emission::EmissionDensity;
use crate::scene::light::{FoundBy, NextEvent, ShadowEnd};
use crate::settings::Shadows;
use glam::Vec3;

/// Adds light that reaches `vertex` from one sampled light and leaves towards the eye.
pub fn next_event<S: Throughput<EyeState>, L: Throughput<LightState>>(
    walk: &Walk<'_, EyeState, S>,
    vertex: &Vertex<'_>,
    tally: &mut Tally,
) {
    let technique = (1, walk.scatterings as usize + 2);
    if !walk.rules.uses(technique) {
        return;
    }
    let (scene, rules) = (walk.scene, walk.rules);
    let (choice, place) = (walk.numbers.light(), walk.numbers.light_point());
    let (lit, moment) = (vertex.lit(), vertex.at.moment);
    let sampled = scene.lights.sample(&scene.data, scene.environment.as_ref(), moment, &lit, choice, place);
    let Some((light, event)) = sampled else { return };
    let Some(start) = rules.language.light_start(rules.tag(light)) else { return };
    let (value, bsdf_pdf) = vertex.evaluate(event.direction, Transport::Radiance);
    let eye = walk.carried.scattered(&rules.language, Weight::Smooth(value));
    if eye.total() == Vec3::ZERO {
        return;
    }
    let passes = match rules.shadows {
        Shadows::On => passes(walk, vertex, &event, tally),
        Shadows::Off => unshadowed(walk, vertex, &event),
    };
    if passes == Vec3::ZERO {
        return;
    }
    let weight = weight(walk, vertex, light, &event, bsdf_pdf);
    let from_light = L::in_state(start, event.radiance);
    let factor = passes * (weight as f32 / event.pdf);
    tally.deposit(rules, Receiver::Own, technique, &eye, &from_light, factor);
    squares::deposit(rules, (Receiver::Own, technique), (&eye, &from_light), factor, tally, || {
        let around = Around::new(walk, vertex, light, &event);
        let path = path(walk, vertex, &event, (&around, bsdf_pdf));
        let hits =
            to_the_light(walk.throughput(), walk.scatterings, walk.survival.now, [value.total() / bsdf_pdf]);
        Made {
            path,
            ends: walk.ends(around.start(&event)),
            s: technique.0,
            cast: vertex.cast(),
            weight,
            survival: walk.survival.now,
            from_eye: hits,
        }
    });
}

fn passes<S: Throughput<EyeState>>(
    walk: &Walk<'_, EyeState, S>,
    vertex: &Vertex<'_>,
    event: &NextEvent,
    tally: &mut Tally,
) -> Rgb {
    match event.end {
        ShadowEnd::Point(end) => unblocked::between(walk.scene, vertex, &walk.media, end, tally),
        ShadowEnd::Infinity => {
            unblocked::to_infinity(walk.scene, vertex, &walk.media, event.direction, tally)
        }
    }
}

fn unshadowed<S: Throughput<EyeState>>(
    walk: &Walk<'_, EyeState, S>,
    vertex: &Vertex<'_>,
    event: &NextEvent,
) -> Rgb {
    let distance = match event.end {
        ShadowEnd::Point(end) => (end - vertex.at.position).length(),
        ShadowEnd::Infinity => 0.0,
    };
    unblocked::faded(vertex, &walk.media, event.direction, distance)
}

pub(in crate::path) fn weight<S: Throughput<EyeState>>(
    walk: &Walk<'_, EyeState, S>,
    vertex: &Vertex<'_>,
    light: u32,
    event: &NextEvent,
    bsdf_pdf: f32,
) -> f64 {
    let hit = match event.found_by {
        FoundBy::Both => f64::from(bsdf_pdf) / f64::from(event.pdf),
        FoundBy::NextEvent => 0.0,
    };
    match &walk.rules.weighing {
        Weighing::FromEye if walk.rules.shadows == Shadows::Off => 1.0,
        Weighing::FromEye => 1.0 / (1.0 + hit),
        Weighing::ToLens => 0.0,
        Weighing::Caustics if vertex.cast() == Cast::Diffuse => 1.0 / (1.0 + hit),
        Weighing::Caustics | Weighing::All(_) => {
            let around = Around::new(walk, vertex, light, event);
            let picked = f64::from(around.emission.origin) / around.next_event;
            let reverse = f64::from(vertex.reverse_pdf(event.direction));
            let densities = NextEventDensities { hit, picked, first_edge: around.first_edge, reverse };
            let eye = match walk.rules.weighing {
                Weighing::Caustics => walk.without_inner_joints(),
                _ => walk.partial,
            };
            recursive::next_event(walk.rules.heuristic(), &eye, &densities)
        }
        Weighing::Chosen(chosen) => {
            let around = Around::new(walk, vertex, light, event);
            let path = path(walk, vertex, event, (&around, bsdf_pdf));
            chosen.weight(&path, &walk.ends(around.start(event)), 1)
        }
    }
}

fn path<S: Throughput<EyeState>>(
    walk: &Walk<'_, EyeState, S>,
    vertex: &Vertex<'_>,
    event: &NextEvent,
    (around, bsdf_pdf): (&Around, f32),
) -> Vec<PathDensity> {
    let reverse = f64::from(vertex.reverse_pdf(event.direction));
    let forward = f64::from(around.emission.origin);
    let light = Link { forward, reverse: 0.0, jacobian: 0.0, specular: false };
    let joint = Joint {
        eye_end: around.first_edge,
        before_eye_end: reverse * walk.links.last().map_or(0.0, |link| link.jacobian),
        light_end: f64::from(bsdf_pdf) * around.to_light,
        before_light_end: 0.0,
    };
    whole(&[light], &walk.links, joint)
}

/// Densities around a next event.
struct Around {
    emission: EmissionDensity,
    /// Of the next event, over the light's area (over solid angle from infinitely far; of lights without extent, the
    /// probability of the choice).
    next_event: f64,
    /// With which emission from there reaches the vertex, over area.
    first_edge: f64,
    /// Turns a density over solid angle at the vertex into the measure of `next_event`.
    to_light: f64,
}

impl Around {
    fn new<S: Throughput<EyeState>>(
        walk: &Walk<'_, EyeState, S>,
        vertex: &Vertex<'_>,
        light: u32,
        event: &NextEvent,
    ) -> Self {
        let scene = walk.scene;
        let (lights, environment) = (&scene.lights, scene.environment.as_ref());
        let emission = lights.emission_density(
            &scene.data,
            environment,
            vertex.at.moment,
            light,
            event.direction,
            event.cos,
        );
        let cos = vertex.cos(event.direction);
        let squared = event.squared;
        let to_light = event.cos / squared;
        let next_event = match event.found_by {
            FoundBy::Both => f64::from(event.pdf) * to_light,
            FoundBy::NextEvent => f64::from(event.pdf),
        };
        Self { emission, next_event, first_edge: f64::from(emission.emission) * cos / squared, to_light }
    }

    fn start(&self, event: &NextEvent) -> LightStart {
        LightStart { next_event: self.next_event, is_hit: event.found_by == FoundBy::Both }
    }
}

//! A vertex of an eye subpath joined to one of a light subpath.

use crate::bsdf::event::Transport;
use crate::math::colour::Rgb;
use crate::math::cosine::squared_distance;
use crate::path::connect::light_vertex::LightVertex;
use crate::path::connect::squares::{self, Made};
use crate::path::connect::unblocked;
use crate::path::connect::whole::{Joint, whole};
use crate::path::expression::language::{EyeState, LightState};
use crate::path::mis::exhaustive::PathDensity;
use crate::path::mis::recursive::{self, Bridge};
use crate::path::rules::Weighing;
use crate::path::survival::{Survival, to_the_light, turned};
use crate::path::tally::{Receiver, Tally};
use crate::path::throughput::Throughput;
use crate::path::vertex::{Vertex, Weight};
use crate::path::walk::Walk;
use glam::Vec3;

/// The edge between two vertices.
pub(in crate::path) struct Between {
    /// From the eye's vertex to the light's.
    pub(in crate::path) direction: Vec3,
    pub(in crate::path) squared: f64,
    /// Densities over solid angle of going over it, from the eye's vertex and from the light's.
    pub(in crate::path) pdfs: [f32; 2],
}

/// Adds light that goes from `light` to `vertex` and on to the eye.
pub fn join<S: Throughput<EyeState>, L: Throughput<LightState>>(
    walk: &Walk<'_, EyeState, S>,
    vertex: &Vertex<'_>,
    light: &LightVertex<'_, L>,
    tally: &mut Tally,
) {
    let technique = (light.vertices, walk.scatterings as usize + 2);
    let rules = walk.rules;
    let scatterings = technique.0 + technique.1 - 2;
    if scatterings as u64 > u64::from(rules.bounces) || !rules.uses(technique) {
        return;
    }
    let towards = light.vertex.at.position - vertex.at.position;
    let Some(direction) = towards.try_normalize() else { return };
    let (onto, forward) = vertex.evaluate(direction, Transport::Radiance);
    let eye = walk.carried.scattered(&rules.language, Weight::Smooth(onto));
    if eye.total() == Vec3::ZERO {
        return;
    }
    let (value, backward) = light.vertex.evaluate(-direction, Transport::Importance);
    let from_light = light.carried.scattered(&rules.language, Weight::Smooth(value));
    if from_light.total() == Vec3::ZERO {
        return;
    }
    let end = light.vertex.at.arrive(vertex.at.position);
    let passes = unblocked::between(walk.scene, vertex, &walk.media, end, tally);
    if passes == Vec3::ZERO {
        return;
    }
    let squared = squared_distance(light.vertex.at.position, vertex.at.position);
    let between = Between { direction, squared, pdfs: [forward, backward] };
    let weight = weight(walk, vertex, light, &between);
    // Cosines are in the values.
    let factor = passes * (weight / squared) as f32;
    tally.deposit(rules, Receiver::Own, technique, &eye, &from_light, factor);
    squares::deposit(rules, (Receiver::Own, technique), (&eye, &from_light), factor, tally, || {
        let (onto, onto_eye) = (onto.total() / forward, value.total());
        let (survival, from_eye) = survivals(walk, light, direction, [onto, onto_eye]);
        let path = path(walk, light, &bridge(vertex, light, &between));
        Made {
            path,
            ends: walk.ends(light.start),
            s: technique.0,
            cast: light.cast,
            weight,
            survival,
            from_eye,
        }
    });
}

/// Roulette's probabilities of both subpaths, and of a whole path from the eye, which is multiplied by `onto` at the vertex of the eye
/// subpath; `onto_eye` is f · |cos θ| of the light's vertex towards it.
fn survivals<S: Throughput<EyeState>, L>(
    walk: &Walk<'_, EyeState, S>,
    light: &LightVertex<'_, L>,
    direction: Vec3,
    [onto, onto_eye]: [Rgb; 2],
) -> (f64, [f64; 2]) {
    let sure = Survival::SURE;
    let behind = light.survival.as_deref().unwrap_or(&sure);
    let cos = [-direction, light.vertex.back()].map(|direction| light.vertex.cos(direction));
    let reverse = f64::from(light.vertex.reverse_pdf(-direction));
    let joints = [onto, turned(onto_eye, [1.0, reverse], cos)];
    let rest = joints.into_iter().chain(behind.turned.iter().rev().copied());
    let from_eye = to_the_light(walk.throughput(), walk.scatterings, walk.survival.now, rest);
    (walk.survival.now * behind.now, from_eye)
}

pub(in crate::path) fn weight<S: Throughput<EyeState>, L>(
    walk: &Walk<'_, EyeState, S>,
    vertex: &Vertex<'_>,
    light: &LightVertex<'_, L>,
    between: &Between,
) -> f64 {
    let bridge = bridge(vertex, light, between);
    match &walk.rules.weighing {
        Weighing::FromEye | Weighing::ToLens | Weighing::Caustics => 0.0,
        Weighing::All(h) => recursive::join(*h, &light.partial, &walk.partial, &bridge),
        Weighing::Chosen(chosen) => {
            chosen.weight(&path(walk, light, &bridge), &walk.ends(light.start), light.vertices)
        }
    }
}

fn bridge<L>(vertex: &Vertex<'_>, light: &LightVertex<'_, L>, between: &Between) -> Bridge {
    let Between { direction, squared, pdfs } = *between;
    let [forward, backward] = pdfs.map(f64::from);
    Bridge {
        onto_light: forward * light.vertex.cos(direction) / squared,
        light_reverse: f64::from(light.vertex.reverse_pdf(-direction)),
        onto_eye: backward * vertex.cos(direction) / squared,
        eye_reverse: f64::from(vertex.reverse_pdf(direction)),
    }
}

fn path<S: Throughput<EyeState>, L>(
    walk: &Walk<'_, EyeState, S>,
    light: &LightVertex<'_, L>,
    bridge: &Bridge,
) -> Vec<PathDensity> {
    let joint = Joint {
        eye_end: bridge.onto_eye,
        before_eye_end: bridge.eye_reverse * walk.links.last().map_or(0.0, |link| link.jacobian),
        light_end: bridge.onto_light,
        before_light_end: bridge.light_reverse * light.links.last().map_or(0.0, |link| link.jacobian),
    };
    whole(&light.links, &walk.links, joint)
}

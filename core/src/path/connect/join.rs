//! A vertex of an eye subpath joined to one of a light subpath.

use crate::bsdf::event::Transport;
use crate::math::cosine::squared_distance;
use crate::path::connect::light_vertex::LightVertex;
use crate::path::connect::unblocked;
use crate::path::connect::whole::{Joint, whole};
use crate::path::expression::language::{EyeState, LightState};
use crate::path::mis::recursive::{self, Bridge};
use crate::path::rules::Weighing;
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
    let (value, forward) = vertex.evaluate(direction, Transport::Radiance);
    let eye = walk.carried.scattered(&rules.language, Weight::Smooth(value));
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
}

pub(in crate::path) fn weight<S: Throughput<EyeState>, L>(
    walk: &Walk<'_, EyeState, S>,
    vertex: &Vertex<'_>,
    light: &LightVertex<'_, L>,
    between: &Between,
) -> f64 {
    let Between { direction, squared, pdfs } = *between;
    let [forward, backward] = pdfs.map(f64::from);
    let bridge = Bridge {
        onto_light: forward * light.vertex.cos(direction) / squared,
        light_reverse: f64::from(light.vertex.reverse_pdf(-direction)),
        onto_eye: backward * vertex.cos(direction) / squared,
        eye_reverse: f64::from(vertex.reverse_pdf(direction)),
    };
    match &walk.rules.weighing {
        Weighing::FromEye | Weighing::ToLens | Weighing::Caustics => 0.0,
        Weighing::All(h) => recursive::join(*h, &light.partial, &walk.partial, &bridge),
        Weighing::Chosen(chosen) => {
            let joint = Joint {
                eye_end: bridge.onto_eye,
                before_eye_end: bridge.eye_reverse * walk.links.last().map_or(0.0, |link| link.jacobian),
                light_end: bridge.onto_light,
                before_light_end: bridge.light_reverse * light.links.last().map_or(0.0, |link| link.jacobian),
            };
            chosen.weight(&whole(&light.links, &walk.links, joint), &walk.ends(light.start), light.vertices)
        }
    }
}

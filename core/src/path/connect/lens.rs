//! A light subpath joined to the lens: at most one vertex of the path is from the eye.

use crate::bsdf::event::Transport;
use crate::math::colour::Rgb;
use crate::math::cosine::{cosine, squared_distance};
use crate::path::connect::light_vertex::LightStart;
use crate::path::connect::squares::{self, Made};
use crate::path::connect::unblocked;
use crate::path::connect::whole::{Joint, whole};
use crate::path::expression::language::{EyeState, LightState};
use crate::path::mis::exhaustive::{Ends, Link, PathDensity};
use crate::path::mis::recursive;
use crate::path::rules::{Rules, Weighing};
use crate::path::survival::{to_the_light, turned};
use crate::path::tally::{Receiver, Tally};
use crate::path::throughput::Throughput;
use crate::path::vertex::{Cast, Vertex, Weight};
use crate::path::walk::{Sight, Walk};
use crate::sampler::Use;
use crate::scene::importance::{Importance, LensHit, Seen};
use glam::Vec3;

/// Adds light that goes from `vertex` to the lens.
pub fn to_lens<E: Throughput<EyeState>, L: Throughput<LightState>>(
    walk: &Walk<'_, LightState, L>,
    vertex: &Vertex<'_>,
    (start, cast): (LightStart, Cast),
    tally: &mut Tally,
) {
    let technique = (walk.scatterings as usize + 2, 1);
    let (scene, rules) = (walk.scene, walk.rules);
    if !rules.uses(technique) {
        return;
    }
    let lens = walk.sampler.pair(walk.dimension(Use::Lens));
    let Some(seen) = walk.view().see(vertex.at.position, lens) else { return };
    let (value, backward) = vertex.evaluate(seen.direction, Transport::Importance);
    let light = walk.carried.scattered(&rules.language, Weight::Smooth(value));
    if light.total() == Vec3::ZERO {
        return;
    }
    let passes = unblocked::seen(scene, vertex, &walk.media, seen.end, tally);
    if passes == Vec3::ZERO {
        return;
    }
    let squared = squared_distance(seen.end, vertex.at.position);
    // The cosine at the vertex is in `value`.
    let importance = seen.pdf.over_area(squared, 1.0);
    let end = LensEnd::new(walk, vertex, &seen, squared, backward);
    let reverse = f64::from(vertex.reverse_pdf(seen.direction));
    let weight = weight(walk, &end, start, reverse);
    let eye = E::in_state(rules.language.eye_start(), Vec3::ONE);
    let factor = passes * (weight * (importance / rules.light_paths)) as f32;
    let receiver = Receiver::Pixel(seen.pixel);
    tally.deposit(rules, receiver, technique, &eye, &light, factor);
    squares::deposit(rules, (receiver, technique), (&eye, &light), factor, tally, || Made {
        path: path(walk, &end, reverse),
        ends: walk.ends(start),
        s: technique.0,
        cast,
        weight,
        survival: walk.survival.now,
        from_eye: from_eye(walk, vertex, &seen, (value.total(), reverse)),
    });
}

/// Densities of an edge to the lens.
pub(in crate::path) struct LensEnd {
    /// With which a pixel's ray meets the vertex, over area.
    from_eye: f64,
    /// With which light from the vertex meets the lens, over area.
    from_light: f64,
}

impl LensEnd {
    pub(in crate::path) fn new<L: Throughput<LightState>>(
        walk: &Walk<'_, LightState, L>,
        vertex: &Vertex<'_>,
        seen: &Seen,
        squared: f64,
        pdf: f32,
    ) -> Self {
        let cos = cosine(walk.view().axis(), seen.direction);
        Self {
            from_eye: seen.pdf.over_area(squared, vertex.cos(seen.direction)),
            from_light: f64::from(pdf) * cos / squared,
        }
    }
}

pub(in crate::path) fn weight<L: Throughput<LightState>>(
    walk: &Walk<'_, LightState, L>,
    end: &LensEnd,
    start: LightStart,
    reverse: f64,
) -> f64 {
    match &walk.rules.weighing {
        Weighing::FromEye => 0.0,
        Weighing::ToLens => 1.0,
        Weighing::All(h) => {
            recursive::to_lens(*h, &walk.partial, end.from_eye / walk.rules.light_paths, reverse)
        }
        Weighing::Caustics => {
            let from_eye = end.from_eye / walk.rules.light_paths;
            recursive::to_lens(walk.rules.heuristic(), &walk.without_inner_joints(), from_eye, reverse)
        }
        Weighing::Chosen(chosen) => {
            chosen.weight(&path(walk, end, reverse), &walk.ends(start), walk.links.len())
        }
    }
}

/// Roulette's probabilities of a whole path from the eye, where `value` and `reverse` are f · |cos θ| at its first surface and the density
/// over solid angle with which it goes on from there.
fn from_eye<L: Throughput<LightState>>(
    walk: &Walk<'_, LightState, L>,
    vertex: &Vertex<'_>,
    seen: &Seen,
    (value, reverse): (Rgb, f64),
) -> [f64; 2] {
    let cos = [seen.direction, vertex.back()].map(|direction| vertex.cos(direction));
    let first = turned(value, [1.0, reverse], cos);
    let rest = walk.survival.turned.iter().rev().copied();
    to_the_light(Vec3::ONE, 0, 1.0, std::iter::once(first).chain(rest))
}

fn path<L: Throughput<LightState>>(
    walk: &Walk<'_, LightState, L>,
    end: &LensEnd,
    reverse: f64,
) -> Vec<PathDensity> {
    let lens = Link { forward: 1.0, reverse: 0.0, jacobian: 0.0, specular: false };
    let joint = Joint {
        eye_end: end.from_light,
        before_eye_end: 0.0,
        light_end: end.from_eye,
        before_light_end: reverse * walk.links.last().map_or(0.0, |link| link.jacobian),
    };
    whole(&walk.links, &[lens], joint)
}

/// A place that light starts from, seen by the lens itself.
#[derive(Clone, Copy, Debug)]
pub struct Shown {
    /// How.
    pub seen: Seen,
    /// Radiance towards the lens over the density of the place.
    pub radiance: Rgb,
    /// Density of the place: over area, or over solid angle from infinitely far.
    pub place: f64,
    /// Squared distance and cosine there; ones from infinitely far.
    pub squared: f64,
    /// See `squared`.
    pub cos: f64,
    /// Density over area with which light from there meets the place on the lens.
    pub onto_lens: f64,
    /// Density over area with which that place is picked, where a ray can hit it.
    pub lens: Option<f64>,
    /// What passes.
    pub passes: f32,
    /// Where light starts.
    pub state: LightState,
}

/// Adds light that goes from its light to the lens.
pub fn light_to_lens<E: Throughput<EyeState>, L: Throughput<LightState>>(
    rules: &Rules,
    shown: &Shown,
    tally: &mut Tally,
) {
    let technique = (1, 1);
    let from_eye = shown.seen.pdf.over_area(shown.squared, shown.cos);
    let weight = match &rules.weighing {
        Weighing::FromEye | Weighing::Caustics => 0.0,
        Weighing::ToLens => 1.0,
        Weighing::All(h) => recursive::light_to_lens(*h, from_eye / (rules.light_paths * shown.place)),
        Weighing::Chosen(chosen) => {
            let (path, ends) = shown.path(rules);
            chosen.weight(&path, &ends, 1)
        }
    };
    let factor = Rgb::splat((weight * from_eye / rules.light_paths * f64::from(shown.passes)) as f32);
    let eye = E::in_state(rules.language.eye_start(), Vec3::ONE);
    let light = L::in_state(shown.state, shown.radiance);
    let receiver = Receiver::Pixel(shown.seen.pixel);
    tally.deposit(rules, receiver, technique, &eye, &light, factor);
}

impl Shown {
    fn path(&self, rules: &Rules) -> (Vec<PathDensity>, Ends) {
        let light = Link { forward: self.place, reverse: 0.0, jacobian: 0.0, specular: false };
        let lens = Link { forward: 1.0, ..light };
        let light_end = self.seen.pdf.over_area(self.squared, self.cos);
        let joint = Joint { light_end, eye_end: self.onto_lens, ..Joint::default() };
        let light_paths = rules.light_paths;
        let ends = Ends { next_event: self.place, light_is_hit: true, lens: self.lens, light_paths };
        (whole(&[light], &[lens], joint), ends)
    }
}

/// Adds light that meets the lens by itself. The image of a light without extent, straight or by ideally specular
/// surfaces, is left out: no other technique makes it, so it is seen by none.
pub fn hit_lens<E: Throughput<EyeState>, L: Throughput<LightState>>(
    walk: &Walk<'_, LightState, L>,
    t_max: f32,
    start: LightStart,
    tally: &mut Tally,
) {
    let technique = (walk.scatterings as usize + 2, 0);
    let rules = walk.rules;
    let Weighing::Chosen(chosen) = &rules.weighing else { return };
    let is_image = !start.is_hit && walk.sight != Sight::Scattered;
    if is_image || !chosen.uses(technique.0, technique.1) {
        return;
    }
    let Some(hit) = walk.view().meet(&walk.edge.ray, t_max) else { return };
    let LensHit { pixel, t, position, cos, place_pdf, direction_pdf } = hit;
    let squared = walk.squared(position);
    let forward = walk.edge.density.over_solid_angle() * cos / squared;
    let jacobian = walk.edge.cos / squared;
    let mut links = walk.links.clone();
    links.push(Link { forward, reverse: 0.0, jacobian, specular: false });
    // From the eye: the lens' place is left out, and the pixel's ray reaches the vertex before.
    let before_light_end = Importance::SolidAngle(direction_pdf).over_area(1.0, 1.0) * jacobian;
    let joint = Joint { light_end: 1.0, before_light_end, ..Joint::default() };
    let weight = chosen.weight(&whole(&links, &[], joint), &walk.ends(start), technique.0);
    let importance = place_pdf * direction_pdf / (cos * rules.light_paths);
    let factor = walk.media.transmittance(t) * (weight * importance) as f32;
    let eye = E::in_state(rules.language.eye_start(), Vec3::ONE);
    tally.deposit(rules, Receiver::Pixel(pixel), technique, &eye, &walk.carried, factor);
}

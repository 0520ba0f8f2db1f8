//! Light that an eye subpath hits: no vertex of the path is from the light.

use crate::math::colour::Rgb;
use crate::math::cosine::cosine;
use crate::path::connect::light_vertex::LightStart;
use crate::path::connect::squares::{self, Made};
use crate::path::connect::whole::{Joint, whole};
use crate::path::expression::language::{EyeState, LightState};
use crate::path::mis::exhaustive::{Link, PathDensity};
use crate::path::mis::recursive;
use crate::path::rules::Weighing;
use crate::path::tally::{Receiver, Tally};
use crate::path::throughput::Throughput;
use crate::path::vertex::{Cast, Density};
use crate::path::walk::{EdgeKind, Sight, Walk};
use crate::scene::emission::EmissionDensity;
use crate::scene::interaction::Interaction;
use crate::settings::Shadows;
use glam::Vec3;

/// Light that was hit.
pub(in crate::path) struct Hit {
    pub(in crate::path) light: u32,
    pub(in crate::path) radiance: Rgb,
    /// Density of a next event from the vertex before, in the measure of the eye's density.
    pub(in crate::path) next_event: f64,
    pub(in crate::path) emission: EmissionDensity,
    /// Turns a density over solid angle at the light into one over area at the vertex before; for light from infinitely
    /// far, one over its disk.
    pub(in crate::path) jacobian: f64,
}

impl Hit {
    fn start(&self) -> LightStart {
        LightStart { next_event: self.next_event, is_hit: true }
    }
}

/// Light of the environment where the ray leaves the scene.
pub fn hit_environment<S: Throughput<EyeState>, L: Throughput<LightState>>(
    walk: &Walk<'_, EyeState, S>,
    tally: &mut Tally,
) {
    let (scene, direction) = (walk.scene, walk.edge.ray.direction);
    let Some(environment) = &scene.environment else { return };
    let Some(light) = scene.lights.of_environment() else { return };
    let radiance = environment.radiance(direction);
    if radiance == Vec3::ZERO {
        return;
    }
    let mut emission = scene.lights.emission_density(
        &scene.data,
        Some(environment),
        walk.edge.ray.moment,
        light,
        direction,
        1.0,
    );
    let mut next_event = if walk.scatterings > 0 && scene.lights.are_by_tree() {
        scene.lights.environment_pdf(environment, &walk.edge.from, direction)
    } else {
        emission.origin
    };
    if walk.edge.kind == EdgeKind::Parallel {
        // Parallel rays all meet the same point of the sky: no other technique does.
        (emission.origin, next_event) = (0.0, 0.0);
    }
    let next_event = f64::from(next_event);
    deposit::<S, L>(walk, &Hit { light, radiance, next_event, emission, jacobian: walk.edge.cos }, tally);
}

/// Light that the surface that was hit emits along the ray.
pub fn hit_surface<S: Throughput<EyeState>, L: Throughput<LightState>>(
    walk: &Walk<'_, EyeState, S>,
    at: &Interaction<'_>,
    triangle: (u32, u32),
    tally: &mut Tally,
) {
    if !at.material.emits() {
        if at.material.unlit.is_some() {
            see_unlit::<S, L>(walk, at, triangle, tally);
        }
        return;
    }
    let (scene, direction) = (walk.scene, walk.edge.ray.direction);
    let radiance = at.emission(at.side(-direction));
    let Some(light) = scene.lights.of_triangle(triangle) else { return };
    if radiance == Vec3::ZERO {
        return;
    }
    let cos = cosine(direction, at.ng);
    let squared = walk.squared(at.position);
    let emission = scene.lights.emission_density(&scene.data, None, at.moment, light, direction, cos);
    let next_event = if walk.scatterings == 0 {
        f64::from(emission.origin)
    } else {
        let pdf = scene.lights.triangle_pdf(&scene.data, triangle, &walk.edge.from, at, direction);
        f64::from(pdf) * cos / squared
    };
    let jacobian = walk.edge.cos / squared;
    deposit::<S, L>(walk, &Hit { light, radiance, next_event, emission, jacobian }, tally);
}

/// The colour of an unlit surface, where the walk is what the eye sees: there is no other technique.
pub fn see_unlit<S: Throughput<EyeState>, L: Throughput<LightState>>(
    walk: &Walk<'_, EyeState, S>,
    at: &Interaction<'_>,
    (instance, triangle): (u32, u32),
    tally: &mut Tally,
) {
    let (scene, rules) = (walk.scene, walk.rules);
    if walk.sight != Sight::Clear {
        return;
    }
    let technique = (0, walk.scatterings as usize + 2);
    let Some(radiance) = scene.unlit_on(&walk.edge.ray, at) else { return };
    let names = [scene.data.node_name(instance, triangle), &at.material.name];
    let Some(start) = rules.language.light_start(rules.language.tag_of(&names)) else { return };
    if rules.uses(technique) || rules.weighing == Weighing::ToLens {
        let light = L::in_state(start, radiance);
        tally.deposit(rules, Receiver::Own, technique, &walk.carried, &light, Rgb::ONE);
    }
}

fn deposit<S: Throughput<EyeState>, L: Throughput<LightState>>(
    walk: &Walk<'_, EyeState, S>,
    hit: &Hit,
    tally: &mut Tally,
) {
    let technique = (0, walk.scatterings as usize + 2);
    let rules = walk.rules;
    let Some(start) = rules.language.light_start(rules.tag(hit.light)) else { return };
    if !rules.uses(technique) {
        return;
    }
    let weight = weight(walk, hit);
    let light = L::in_state(start, hit.radiance);
    let factor = Rgb::splat(weight as f32);
    tally.deposit(rules, Receiver::Own, technique, &walk.carried, &light, factor);
    squares::deposit(rules, (Receiver::Own, technique), (&walk.carried, &light), factor, tally, || Made {
        path: path(walk, hit),
        ends: walk.ends(hit.start()),
        s: technique.0,
        cast: walk.cast,
        weight,
        survival: walk.survival.now,
        from_eye: [walk.survival.before, walk.survival.now],
    });
}

pub(in crate::path) fn weight<S: Throughput<EyeState>>(walk: &Walk<'_, EyeState, S>, hit: &Hit) -> f64 {
    match &walk.rules.weighing {
        // Next events that nothing blocks have found all of it.
        Weighing::FromEye if walk.rules.shadows == Shadows::Off && walk.edge.density != Density::Delta => {
            if walk.scatterings == 0 {
                1.0
            } else {
                0.0
            }
        }
        Weighing::FromEye => 1.0 / (1.0 + hit.next_event * walk.partial.near),
        Weighing::ToLens => 0.0,
        Weighing::Caustics if walk.scatterings == 0 => 1.0,
        Weighing::Caustics => {
            let emitted = match walk.cast {
                Cast::Diffuse => 0.0,
                Cast::Caustic => f64::from(hit.emission.origin) * f64::from(hit.emission.emission),
            };
            recursive::hit(walk.rules.heuristic(), &walk.partial, hit.next_event, emitted)
        }
        Weighing::All(h) => {
            let emitted = f64::from(hit.emission.origin) * f64::from(hit.emission.emission);
            recursive::hit(*h, &walk.partial, hit.next_event, emitted)
        }
        Weighing::Chosen(chosen) => chosen.weight(&path(walk, hit), &walk.ends(hit.start()), 0),
    }
}

fn path<S: Throughput<EyeState>>(walk: &Walk<'_, EyeState, S>, hit: &Hit) -> Vec<PathDensity> {
    let joint = Joint {
        eye_end: f64::from(hit.emission.origin),
        before_eye_end: f64::from(hit.emission.emission) * hit.jacobian,
        ..Joint::default()
    };
    let mut links = walk.links.clone();
    if links.len() < walk.scatterings as usize + 2 {
        let forward = walk.edge.density.over_solid_angle();
        links.push(Link { forward, reverse: 0.0, jacobian: hit.jacobian, specular: false });
    }
    whole(&[], &links, joint)
}

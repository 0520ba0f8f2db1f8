//! What each element receives: straight from lights, and by which shares from other elements.
//!
//! The form factor Fᵢⱼ is the share of an element's cosine-distributed rays that meets element j. So visibility, partial
//! coverage and touching patches need no case of their own, a row adds up to exactly one in a closed room, and what
//! is kept is one number for each pair that sees each other.

use crate::bsdf::Bsdf;
use crate::math::colour::Rgb;
use crate::math::warp;
use crate::radiosity::element::Element;
use crate::radiosity::hemisphere::{Numbers, Surroundings};
use crate::radiosity::patch::Patch;
use crate::radiosity::reflectance;
use crate::sampler::{Dimension, Sampler, Use};
use crate::scene::data::SceneData;
use crate::trace::moment::Moment;
use core::f32::consts::FRAC_1_PI;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Points of an element at which a reflectance that varies is looked up.
const REFLECTANCE_POINTS: u32 = 16;
/// The replicate that elements draw their numbers from, far from any of a picture. The seed is fixed, too: a worker
/// keeps the solution for every picture of a scene.
const REPLICATE: u32 = u32::MAX;

/// A share of what an element sends out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Who sends.
    pub from: Element,
    /// The form factor, from the receiver to the sender.
    pub share: f32,
}

/// What one element receives, and what it reflects.
#[derive(Clone, Debug)]
pub struct Row {
    /// Mean radiance straight from lights, by the cosine.
    pub direct: DVec3,
    /// Mean reflectance.
    pub reflectance: Rgb,
    /// Form factors, by the sender's number. They add up to one where nothing is open.
    pub links: Vec<Link>,
    /// Rays that were traced for it.
    pub rays: u64,
}

/// The rows of all elements, each from `rays` rays (a power of two). The same bits on any number of threads.
pub fn rows(surroundings: &Surroundings<'_>, rays: u32) -> Vec<Row> {
    let elements = 2 * surroundings.patches.all().len() as u32;
    (0..elements).into_par_iter().map(|e| row(surroundings, Element(e), rays)).collect()
}

fn row(surroundings: &Surroundings<'_>, element: Element, count: u32) -> Row {
    let data = &surroundings.scene.data;
    let patch = &surroundings.patches.all()[element.patch().index()];
    let (side, sign) = (element.side(), element.sign());
    let varies = reflectance_varies(surroundings, element);
    let mut direct = DVec3::ZERO;
    let mut met: Vec<Link> = Vec::with_capacity(count as usize);
    let (mut covered, mut rays) = (0.0_f64, 0);
    let (mut reflected, mut reflected_weight) = (DVec3::ZERO, 0.0_f64);
    for index in 0..count {
        let sampler = Sampler::new(0, REPLICATE, [element.0, 0], index);
        let pair = |what| sampler.pair(Dimension::Eye(0, what));
        let place = patch.on_triangle(warp::triangle(pair(Use::Choice)));
        let at = data.interaction(patch.instance, patch.triangle, place, Moment::STILL);
        let alpha = at.alpha();
        if alpha == 0.0 {
            continue;
        }
        if reflected_weight == 0.0 || (varies && index < REFLECTANCE_POINTS) {
            let here = reflectance::mean(&Bsdf::from_surface(&at.surface()));
            reflected += here.as_dvec3() * f64::from(alpha);
            reflected_weight += f64::from(alpha);
        }
        covered += f64::from(alpha);
        let numbers = Numbers {
            direction: pair(Use::Direction),
            light: pair(Use::Light),
            place: pair(Use::LightPoint),
            key: sampler.key(Dimension::Eye(0, Use::Alpha)),
        };
        let white = |wi: Vec3| Vec3::splat(wi.z * sign * FRAC_1_PI);
        let look = surroundings.look(&at, side, white, numbers, &mut rays);
        direct += look.direct.as_dvec3() * f64::from(alpha);
        met.extend(look.onward.map(|onward| Link { from: onward.element, share: alpha }));
    }
    if covered == 0.0 {
        return Row { direct: DVec3::ZERO, reflectance: Rgb::ZERO, links: Vec::new(), rays };
    }
    let reflectance = (reflected / reflected_weight).as_vec3();
    Row { direct: direct / covered, reflectance, links: added(met, covered), rays }
}

/// Share of an element that is there, and its mean reflectance, without tracing a ray.
pub fn look_at(data: &SceneData, patch: &Patch) -> (f64, Rgb) {
    let (mut covered, mut reflected) = (0.0, DVec3::ZERO);
    for index in 0..REFLECTANCE_POINTS {
        let sampler = Sampler::new(0, REPLICATE, [patch.triangle, patch.instance], index);
        let place = patch.on_triangle(warp::triangle(sampler.pair(Dimension::Eye(0, Use::Choice))));
        let at = data.interaction(patch.instance, patch.triangle, place, Moment::STILL);
        let alpha = f64::from(at.alpha());
        covered += alpha;
        reflected += reflectance::mean(&Bsdf::from_surface(&at.surface())).as_dvec3() * alpha;
    }
    let reflectance = if covered > 0.0 { (reflected / covered).as_vec3() } else { Rgb::ZERO };
    (covered / f64::from(REFLECTANCE_POINTS), reflectance)
}

/// One link for each sender, the shares over the whole.
fn added(mut met: Vec<Link>, whole: f64) -> Vec<Link> {
    met.sort_by_key(|link| link.from);
    met.chunk_by(|a, b| a.from == b.from)
        .map(|run| {
            let sum: f64 = run.iter().map(|link| f64::from(link.share)).sum();
            Link { from: run[0].from, share: (sum / whole) as f32 }
        })
        .collect()
}

/// Whether an element's reflectance may differ from point to point.
fn reflectance_varies(surroundings: &Surroundings<'_>, element: Element) -> bool {
    let data = &surroundings.scene.data;
    let patch = &surroundings.patches.all()[element.patch().index()];
    let mesh = &data.meshes[data.instances[patch.instance as usize].mesh.index()];
    !mesh.colours.is_empty() || data.material(patch.instance, patch.triangle).slots().next().is_some()
}

//! Paths from both ends, joined everywhere (Veach and Guibas 1995; Lafortune and Willems 1993).

use crate::path::eye::{FromEye, from_eye};
use crate::path::light::{Keeps, from_light};
use crate::path::rules::Rules;
use crate::path::tally::Tally;
use crate::path::throughput::Carriage;
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::trace::ray::Ray;

/// One light subpath, and one sample of a pixel joined to it.
pub fn sample<C: Carriage>(
    scene: &Scene,
    rules: &Rules,
    ray: Ray,
    [eye, light]: [&Sampler; 2],
    tally: &mut Tally,
) {
    let vertices = from_light::<C>(scene, rules, (light, ray.moment), Keeps::Vertices, tally);
    from_eye::<C>(scene, rules, eye, ray).run(&mut FromEye::<C, true> { light: &vertices }, tally);
}

//! Paths from the eye, with next event, and caustics also from the lights: light subpaths end at what is diffuse alone.

use crate::path::eye::{FromEye, from_eye};
use crate::path::light::{Keeps, from_light};
use crate::path::rules::Rules;
use crate::path::tally::Tally;
use crate::path::throughput::Carriage;
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::trace::ray::Ray;

/// One light subpath, and one sample of a pixel.
pub fn sample<C: Carriage>(
    scene: &Scene,
    rules: &Rules,
    ray: Ray,
    [eye, light]: [&Sampler; 2],
    tally: &mut Tally,
) {
    from_light::<C>(scene, rules, (light, ray.moment), Keeps::Nothing, tally);
    from_eye::<C>(scene, rules, eye, ray).run(&mut FromEye::<C, true> { light: &[] }, tally);
}

//! Paths from the eye, with next event.

use crate::path::eye::{FromEye, from_eye};
use crate::path::rules::Rules;
use crate::path::tally::Tally;
use crate::path::throughput::Carriage;
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::trace::ray::Ray;

/// One sample of a pixel.
pub fn sample<C: Carriage>(scene: &Scene, rules: &Rules, ray: Ray, sampler: &Sampler, tally: &mut Tally) {
    from_eye::<C>(scene, rules, sampler, ray).run(&mut FromEye::<C, false> { light: &[] }, tally);
}

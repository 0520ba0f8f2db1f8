//! Paths from the eye to a map of photons.

use crate::path::eye::from_eye;
use crate::path::photons::gather::Gather;
use crate::path::photons::map::PhotonMap;
use crate::path::rules::Rules;
use crate::path::tally::Tally;
use crate::path::throughput::Carriage;
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::trace::ray::Ray;

/// One sample of a pixel, from the photons of its pass.
pub fn sample<C: Carriage>(
    scene: &Scene,
    rules: &Rules,
    (sampler, ray): (&Sampler, Ray),
    map: &PhotonMap<C::Light>,
    tally: &mut Tally,
) where
    C::Light: Send,
{
    from_eye::<C>(scene, rules, sampler, ray).run(&mut Gather::<C> { map }, tally);
}

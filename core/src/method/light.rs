//! Paths from the lights, joined to the lens.

use crate::path::light::{Keeps, from_light};
use crate::path::rules::Rules;
use crate::path::tally::Tally;
use crate::path::throughput::Carriage;
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::trace::moment::Moment;

/// One light subpath.
pub fn sample<C: Carriage>(scene: &Scene, rules: &Rules, light: (&Sampler, Moment), tally: &mut Tally) {
    from_light::<C>(scene, rules, light, Keeps::Nothing, tally);
}

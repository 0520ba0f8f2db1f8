//! Paths from the lights, joined to the lens. What is unlit is seen from the eye: no light path ends there.

use crate::path::connect::hit::see_unlit;
use crate::path::expression::language::EyeState;
use crate::path::eye::from_eye;
use crate::path::light::{Keeps, from_light};
use crate::path::rules::Rules;
use crate::path::tally::Tally;
use crate::path::throughput::Carriage;
use crate::path::vertex::Vertex;
use crate::path::walk::{Sight, Visitor, Walk};
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::scene::interaction::Interaction;
use crate::trace::moment::Moment;
use crate::trace::ray::Ray;
use core::marker::PhantomData;

/// One light subpath.
pub fn sample<C: Carriage>(scene: &Scene, rules: &Rules, light: (&Sampler, Moment), tally: &mut Tally) {
    from_light::<C>(scene, rules, light, Keeps::Nothing, tally);
}

/// A walk that sees unlit surfaces and nothing else.
#[derive(Debug)]
struct SeesUnlit<C>(PhantomData<C>);

impl<'a, C: Carriage> Visitor<'a, EyeState, C::Eye> for SeesUnlit<C> {
    const TWO_WAY: bool = false;

    fn arrives(
        &mut self,
        walk: &mut Walk<'a, EyeState, C::Eye>,
        at: &Interaction<'a>,
        triangle: (u32, u32),
        tally: &mut Tally,
    ) {
        see_unlit::<C::Eye, C::Light>(walk, at, triangle, tally);
    }

    fn goes_on(&self, walk: &Walk<'a, EyeState, C::Eye>) -> bool {
        walk.sight == Sight::Clear
    }

    fn scatters(&mut self, _: &Walk<'a, EyeState, C::Eye>, _: &Vertex<'a>, _: &mut Tally) {}
}

/// What is unlit along a camera ray.
pub fn unlit<C: Carriage>(scene: &Scene, rules: &Rules, (sampler, ray): (&Sampler, Ray), tally: &mut Tally) {
    from_eye::<C>(scene, rules, sampler, ray).run(&mut SeesUnlit::<C>(PhantomData), tally);
}

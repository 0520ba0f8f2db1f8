//! What a subpath carries: throughput by state of the automaton that reads its letters.
//!
//! One vertex scatters by several letters at once, so one walk can be in several states, each with a throughput of its own
//! (a weighted automaton). Which directions are drawn never depends on them.

use crate::bsdf::event::{Letter, Scattered};
use crate::math::colour::Rgb;
use crate::path::expression::language::{EyeState, Language, LightState};
use crate::path::vertex::Weight;
use glam::Vec3;
use smallvec::SmallVec;

/// A state of one of the two automata: read from the eye, or from the light.
pub trait State: Copy + PartialEq {
    /// After a letter; `None` where no accepted word goes on like this.
    fn after(self, language: &Language, letter: Letter) -> Option<Self>;
}

impl State for EyeState {
    #[inline]
    fn after(self, language: &Language, letter: Letter) -> Option<Self> {
        language.eye_next(self, letter)
    }
}

impl State for LightState {
    #[inline]
    fn after(self, language: &Language, letter: Letter) -> Option<Self> {
        language.light_next(self, letter)
    }
}

/// Throughput by state.
pub trait Throughput<S: State>: Clone {
    /// All in one state.
    fn in_state(state: S, weight: Rgb) -> Self;
    /// Whether nothing can come of it: no accepted word begins like this, or nothing is carried.
    fn is_dead(&self) -> bool;
    /// Over all states.
    fn total(&self) -> Rgb;
    /// Multiplies all of it.
    fn scale(&mut self, factor: Rgb);
    /// After a scattering.
    #[must_use]
    fn scattered(&self, language: &Language, weight: Weight) -> Self;
    /// Calls `visit` with each state and its throughput; with no state where one is as good as another.
    fn each(&self, visit: impl FnMut(Option<S>, Rgb));
}

/// Throughput where every path counts and there is but one picture: nothing is looked up.
#[derive(Clone, Copy, Debug)]
pub struct Whole(Rgb);

impl<S: State> Throughput<S> for Whole {
    #[inline]
    fn in_state(_: S, weight: Rgb) -> Self {
        Self(weight)
    }

    #[inline]
    fn is_dead(&self) -> bool {
        self.0 == Vec3::ZERO
    }

    #[inline]
    fn total(&self) -> Rgb {
        self.0
    }

    #[inline]
    fn scale(&mut self, factor: Rgb) {
        self.0 *= factor;
    }

    #[inline]
    fn scattered(&self, _: &Language, weight: Weight) -> Self {
        Self(self.0 * weight.total())
    }

    #[inline]
    fn each(&self, mut visit: impl FnMut(Option<S>, Rgb)) {
        visit(None, self.0);
    }
}

/// Throughput by state, for expressions and layers.
#[derive(Clone, Debug)]
pub struct ByState<S>(SmallVec<[(S, Rgb); 4]>);

impl<S: State> ByState<S> {
    fn add(&mut self, state: S, weight: Rgb) {
        match self.0.iter_mut().find(|(one, _)| *one == state) {
            Some((_, sum)) => *sum += weight,
            None => self.0.push((state, weight)),
        }
    }
}

impl<S: State> Throughput<S> for ByState<S> {
    fn in_state(state: S, weight: Rgb) -> Self {
        Self(SmallVec::from_iter([(state, weight)]))
    }

    fn is_dead(&self) -> bool {
        self.0.is_empty()
    }

    fn total(&self) -> Rgb {
        self.0.iter().fold(Vec3::ZERO, |sum, (_, weight)| sum + *weight)
    }

    fn scale(&mut self, factor: Rgb) {
        for (_, weight) in &mut self.0 {
            *weight *= factor;
        }
    }

    fn scattered(&self, language: &Language, weight: Weight) -> Self {
        let mut after = Self(SmallVec::new());
        for (state, carried) in &self.0 {
            let mut go = |letter, factor: Rgb| {
                if factor != Vec3::ZERO
                    && let Some(next) = state.after(language, letter)
                {
                    after.add(next, *carried * factor);
                }
            };
            match weight {
                // Where letters lead to the same state they are added first, so that a language of one state rounds as
                // `Whole` does.
                Weight::Smooth(both)
                    if state.after(language, Letter::Diffuse) == state.after(language, Letter::Glossy) =>
                {
                    go(Letter::Diffuse, both.total());
                }
                Weight::Smooth(Scattered { diffuse, glossy }) => {
                    go(Letter::Diffuse, diffuse);
                    go(Letter::Glossy, glossy);
                }
                Weight::Specular(letter, factor) => go(letter, factor),
            }
        }
        after
    }

    fn each(&self, mut visit: impl FnMut(Option<S>, Rgb)) {
        for (state, weight) in &self.0 {
            visit(Some(*state), *weight);
        }
    }
}

/// How both kinds of subpath carry throughput.
pub trait Carriage {
    /// From the eye.
    type Eye: Throughput<EyeState>;
    /// From the light.
    type Light: Throughput<LightState>;
}

/// Every path, one picture.
#[derive(Clone, Copy, Debug, Default)]
pub struct Everything;

/// An expression, or layers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Filtered;

impl Carriage for Everything {
    type Eye = Whole;
    type Light = Whole;
}

impl Carriage for Filtered {
    type Eye = ByState<EyeState>;
    type Light = ByState<LightState>;
}

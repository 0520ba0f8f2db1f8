//! A reflecting interface, plain or with a finish, and the base below it.

use crate::bsdf::conductor::Conductor;
use crate::bsdf::event::Letter;
use crate::bsdf::finish::Finish;
use crate::bsdf::lobe::{Drawn, Evaluated};
use crate::bsdf::plastic::Plastic;
use crate::math::colour::Rgb;
use glam::{Vec2, Vec3};

/// The interface of a metal or of a plastic.
pub(super) enum Interface<'a> {
    /// Even, without a film.
    Plain(Conductor),
    /// Any other.
    Finished(&'a Finish),
}

impl Interface<'_> {
    pub(super) fn letter(&self) -> Letter {
        match self {
            Self::Plain(part) => part.letter(),
            Self::Finished(part) => part.letter(),
        }
    }

    pub(super) fn albedo(&self, wo: Vec3) -> Rgb {
        match self {
            Self::Plain(part) => part.albedo(wo),
            Self::Finished(part) => part.albedo(wo),
        }
    }

    /// What an ideally smooth one reflects.
    pub(super) fn mirror(&self, wo: Vec3) -> Rgb {
        match self {
            Self::Plain(part) => part.mirror(wo),
            Self::Finished(part) => part.mirror(wo),
        }
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluated {
        match self {
            Self::Plain(part) => part.evaluate(wo, wi),
            Self::Finished(part) => part.evaluate(wo, wi),
        }
    }

    pub(super) fn draw(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<Drawn> {
        match self {
            Self::Plain(part) => part.draw(wo, u_lobe, u),
            Self::Finished(part) => part.draw(wo, u_lobe, u),
        }
    }

    /// Reflects like an ideally smooth one, under a letter.
    pub(super) fn draw_mirror(&self, wo: Vec3, letter: Letter) -> Drawn {
        match self {
            Self::Plain(part) => part.draw_mirror(wo, letter),
            Self::Finished(part) => part.draw_mirror(wo, letter),
        }
    }
}

/// A diffuse base and what lies over it.
#[derive(Clone, Debug)]
pub(super) enum Base {
    /// A plain interface.
    Plain(Plastic),
    /// One with a finish.
    Finished(Box<Finish>),
}

impl Base {
    /// Of the base as it is seen through the interface.
    pub(super) fn albedo(&self, wo: Vec3) -> Rgb {
        match self {
            Self::Plain(part) => part.base_albedo(wo),
            Self::Finished(part) => part.base_albedo(wo),
        }
    }

    /// The base as it is seen through the interface, drawn by [`Plastic::draw_base`].
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluated {
        match self {
            Self::Plain(part) => part.evaluate_base(wo, wi),
            Self::Finished(part) => part.evaluate_base(wo, wi),
        }
    }
}

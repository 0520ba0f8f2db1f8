//! A point of a path on a surface, and what it does to light.

use crate::bsdf::Bsdf;
use crate::bsdf::event::{SampleKind, Transport};
use crate::math::colour::Rgb;
use crate::math::robust::offset_origin;
use crate::scene::interaction::Interaction;
use crate::trace::ray::Ray;
use glam::{Vec2, Vec3};

/// A point of a path on a surface. Directions are unit vectors away from it.
#[derive(Clone, Debug)]
pub struct Vertex<'s> {
    /// Where it is.
    pub at: Interaction<'s>,
    bsdf: Bsdf,
    /// Back along the path, in the shading frame.
    wo: Vec3,
    /// 1 where `wo` is on the front, else −1.
    side: f32,
}

/// How a sampled direction was chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Density {
    /// Density over solid angle.
    SolidAngle(f32),
    /// From a Dirac delta: no next event could have made this path.
    Delta,
}

/// A sampled continuation of a path.
#[derive(Clone, Copy, Debug)]
pub struct Continuation {
    /// Where to.
    pub direction: Vec3,
    /// f · |cos θ| / density.
    pub weight: Rgb,
    /// How it was chosen.
    pub density: Density,
    /// Refractive index of the side it leaves to over that of the side it came from.
    pub eta: f32,
    /// Whether it stays on the side of the surface it came from.
    pub crossing: Crossing,
}

/// On which side a path goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crossing {
    /// Reflected.
    Stays,
    /// Transmitted.
    Crosses,
}

impl<'s> Vertex<'s> {
    /// At a point that is seen along −`back`; `None` where the shading normal faces away though the surface
    /// does not: such a point scatters nothing.
    pub fn new(at: Interaction<'s>, back: Vec3) -> Option<Self> {
        let wo = at.shading.to_local(back);
        let side = 1.0_f32.copysign(back.dot(at.ng));
        let visible = wo.z * side > 0.0;
        visible.then(|| Self { bsdf: Bsdf::from_surface(&at.surface()), at, wo, side })
    }

    /// Whether a next event can contribute.
    pub fn is_smooth(&self) -> bool {
        self.bsdf.is_smooth_anywhere()
    }

    /// f · |cos θ| towards `direction` and the density with which it would have been sampled; zero where geometric
    /// and shading normal disagree on its side.
    pub fn evaluate(&self, direction: Vec3, transport: Transport) -> (Rgb, f32) {
        let wi = self.at.shading.to_local(direction);
        if wi.z * direction.dot(self.at.ng) <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let (value, pdf) = self.bsdf.eval_and_pdf(self.wo, wi, transport);
        (value.total(), pdf)
    }

    /// Samples a continuation; `None` where the path ends.
    pub fn sample(&self, choice: f32, u: Vec2, transport: Transport) -> Option<Continuation> {
        let sample = self.bsdf.sample(self.wo, choice, u, transport)?;
        let direction = self.at.shading.to_world(sample.wi).normalize_or_zero();
        let cos = direction.dot(self.at.ng);
        if sample.wi.z * cos <= 0.0 {
            return None;
        }
        let (weight, density) = match sample.kind {
            SampleKind::Smooth { value, pdf } => (value.total() / pdf, Density::SolidAngle(pdf)),
            SampleKind::Specular { weight, .. } => (weight, Density::Delta),
        };
        let crossing = if cos * self.side > 0.0 { Crossing::Stays } else { Crossing::Crosses };
        Some(Continuation { direction, weight, density, eta: sample.eta, crossing })
    }

    /// The point moved off the surface towards `direction`.
    pub fn leave(&self, direction: Vec3) -> Vec3 {
        offset_origin(self.at.position, self.at.error, self.at.ng, direction)
    }

    /// The ray that leaves towards `direction`.
    pub fn ray(&self, direction: Vec3) -> Ray {
        Ray::new(self.leave(direction), direction).at(self.at.moment)
    }
}

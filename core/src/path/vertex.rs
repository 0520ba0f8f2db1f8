//! A point of a path on a surface, and what it does to light.

use crate::bsdf::Bsdf;
use crate::bsdf::event::{Letter, Letters, SampleKind, Scattered, Transport};
use crate::math::colour::Rgb;
use crate::math::cosine::cosine;
use crate::path::rules::Rules;
use crate::scene::interaction::{Interaction, Side};
use crate::scene::lit::Lit;
use crate::trace::ray::Ray;
use glam::{Vec2, Vec3};
use std::borrow::Cow;

/// A point of a path on a surface. Directions are unit vectors away from it.
#[derive(Clone, Debug)]
pub struct Vertex<'s> {
    /// Where it is.
    pub at: Interaction<'s>,
    bsdf: Cow<'s, Bsdf>,
    /// Back along the path, in the shading frame.
    wo: Vec3,
    /// Cosine between the way back and the geometric normal: positive on the front.
    cos_back: f32,
}

/// How a sampled direction was chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Density {
    /// Density over solid angle.
    SolidAngle(f32),
    /// From a Dirac delta: no next event could have made this path.
    Delta,
}

impl Density {
    /// Its number; one for a Dirac delta, whose coefficient is the same from both sides.
    #[inline]
    pub fn over_solid_angle(self) -> f64 {
        match self {
            Self::SolidAngle(pdf) => f64::from(pdf),
            Self::Delta => 1.0,
        }
    }
}

/// A sampled continuation of a path.
#[derive(Clone, Copy, Debug)]
pub struct Continuation {
    /// Where to.
    pub direction: Vec3,
    /// What it counts, by letter.
    pub weight: Weight,
    /// How it was chosen.
    pub density: Density,
    /// Refractive index of the side it leaves to over that of the side it came from.
    pub eta: f32,
    /// Whether it stays on the side of the surface it came from.
    pub crossing: Crossing,
}

/// f · |cos θ| over the density, by letter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weight {
    /// Of smooth lobes, all of which can make any direction.
    Smooth(Scattered),
    /// Of an ideally specular lobe.
    Specular(Letter, Rgb),
}

impl Weight {
    /// Over all letters.
    #[inline]
    pub fn total(self) -> Rgb {
        match self {
            Self::Smooth(scattered) => scattered.total(),
            Self::Specular(_, weight) => weight,
        }
    }
}

/// What a surface makes of light that comes straight from its source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cast {
    /// It scatters it diffusely only.
    Diffuse,
    /// More than that: its lobes may throw it together somewhere.
    Caustic,
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
    /// does not: such a point scatters nothing. Scatters by no letter but those of the rules.
    #[inline(always)]
    pub fn new(at: Interaction<'s>, back: Vec3, rules: &'s Rules) -> Option<Self> {
        let wo = at.shading.to_local(back);
        let cos_back = back.dot(at.ng);
        let visible = wo.z * 1.0_f32.copysign(cos_back) > 0.0;
        if !visible {
            return None;
        }
        // Put together apart, because a BSDF on its way from a variable costs a copy.
        if let Some(even) = rules.even_bsdf(&at) {
            return Some(Self { at, bsdf: Cow::Borrowed(even), wo, cos_back });
        }
        let surface = at.surface();
        Some(Self { at, bsdf: Cow::Owned(Bsdf::keeping(&surface, rules.letters)), wo, cos_back })
    }

    /// Unit direction back along the path.
    pub fn back(&self) -> Vec3 {
        self.at.shading.to_world(self.wo)
    }

    /// Where light is looked for that it scatters back along the path.
    #[inline]
    pub fn lit(&self) -> Lit {
        self.at.lit(if self.cos_back < 0.0 { Side::Back } else { Side::Front })
    }

    /// Whether a next event can contribute.
    pub fn is_smooth(&self) -> bool {
        self.bsdf.is_smooth_anywhere()
    }

    /// What it makes of light that comes straight from its source: the same from wherever one looks.
    #[inline]
    pub fn cast(&self) -> Cast {
        if Letters::of(Letter::Diffuse).contains(self.bsdf.letters()) { Cast::Diffuse } else { Cast::Caustic }
    }

    /// f · |cos θ| towards `direction`, by letter, and the density with which it would have been sampled; zero where
    /// geometric and shading normal disagree on its side.
    pub fn evaluate(&self, direction: Vec3, transport: Transport) -> (Scattered, f32) {
        let wi = self.at.shading.to_local(direction);
        let cos = direction.dot(self.at.ng);
        if wi.z * cos <= 0.0 {
            return (Scattered::default(), 0.0);
        }
        let (value, pdf) = self.bsdf.eval_and_pdf(self.wo, wi, transport);
        (value * self.adjoint(wi, cos, transport), pdf)
    }

    /// Density over solid angle with which a path that arrives from `direction` would go on the way this one came.
    pub fn reverse_pdf(&self, direction: Vec3) -> f32 {
        self.bsdf.pdf(self.at.shading.to_local(direction), self.wo)
    }

    /// Samples a continuation; `None` where the path ends.
    pub fn sample(&self, choice: f32, u: Vec2, transport: Transport) -> Option<Continuation> {
        let sample = self.bsdf.sample(self.wo, choice, u, transport)?;
        let direction = self.at.shading.to_world(sample.wi).normalize_or_zero();
        let cos = direction.dot(self.at.ng);
        if sample.wi.z * cos <= 0.0 {
            return None;
        }
        let adjoint = self.adjoint(sample.wi, cos, transport);
        let (weight, density) = match sample.kind {
            SampleKind::Smooth { value, pdf } => {
                (Weight::Smooth(value * (adjoint / pdf)), Density::SolidAngle(pdf))
            }
            SampleKind::Specular { letter, weight, .. } => {
                (Weight::Specular(letter, weight * adjoint), Density::Delta)
            }
        };
        let crossing = self.crossing(direction);
        Some(Continuation { direction, weight, density, eta: sample.eta, crossing })
    }

    /// Whether a direction is on the side the path came from.
    pub fn crossing(&self, direction: Vec3) -> Crossing {
        if direction.dot(self.at.ng) * self.cos_back > 0.0 { Crossing::Stays } else { Crossing::Crosses }
    }

    /// |cos θ| of a direction and the geometric normal.
    #[inline]
    pub fn cos(&self, direction: Vec3) -> f64 {
        cosine(direction, self.at.ng)
    }

    /// The point moved off the surface towards `direction`.
    pub fn leave(&self, direction: Vec3) -> Vec3 {
        self.at.leave(direction)
    }

    /// The ray that leaves towards `direction`.
    pub fn ray(&self, direction: Vec3) -> Ray {
        Ray::new(self.leave(direction), direction).at(self.at.moment).at(self.at.moment)
    }

    /// Shading normals are no symmetric part of a BSDF: light that is carried from its source counts
    /// |wo·Ns| |wi·Ng| / (|wo·Ng| |wi·Ns|) times as much (Veach 1997, eq. 5.19).
    #[inline]
    fn adjoint(&self, wi: Vec3, cos: f32, transport: Transport) -> f32 {
        match transport {
            Transport::Radiance => 1.0,
            Transport::Importance => {
                let bent = (self.wo.z * cos / (self.cos_back * wi.z)).abs();
                if bent.is_finite() { bent } else { 0.0 }
            }
        }
    }
}

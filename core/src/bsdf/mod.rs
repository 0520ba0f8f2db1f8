//! One file a lobe, and the enum of what a surface does to light.
//!
//! Directions are unit vectors in the shading frame, z the shading normal on the front side, and point away
//! from the surface. Densities are over solid angle. Surfaces scatter on both sides. Every lobe is reciprocal
//! (refraction: f(o→i) / η² symmetric) and no albedo exceeds one.

pub mod albedo;
mod brushed;
pub mod conductor;
pub mod dispersed;
pub mod event;
mod film;
mod finish;
pub mod fresnel;
pub mod ggx;
pub mod glass;
mod gloss;
mod interface;
pub mod kept;
pub mod lambert;
pub mod layered;
mod lobe;
pub mod mixture;
pub mod plastic;
mod sheen;
mod sheet;
mod solid;
mod solid_albedo;
mod solid_between;
pub mod surface;

#[cfg(test)]
mod tests;

use crate::bsdf::conductor::Conductor;
use crate::bsdf::dispersed::{Dispersed, indices};
use crate::bsdf::event::{BsdfSample, Letter, Letters, SampleKind, Scattered, Transport};
use crate::bsdf::finish::Finish;
use crate::bsdf::fresnel::{Schlick, dielectric_at_normal};
use crate::bsdf::glass::Glass;
use crate::bsdf::interface::Base;
use crate::bsdf::kept::{Finishes, Kept};
use crate::bsdf::lambert::Lambert;
use crate::bsdf::layered::Layered;
use crate::bsdf::lobe::{Delta, Drawn, Evaluated};
use crate::bsdf::mixture::Mixture;
use crate::bsdf::plastic::Plastic;
use crate::bsdf::surface::{Finishing, Layers, SurfaceParameters, Walls};
use crate::math::colour::Rgb;
use glam::{Vec2, Vec3};

/// A direction with a smaller |cos θ| lies in the surface: products of two still are normal numbers.
const HORIZON: f32 = 1e-18;

/// What a surface does to light at one point. Built at every hit: no heap but for layers, which would make all others twice
/// as large, and only the variant's own part is written.
#[derive(Clone, Debug)]
pub enum Bsdf {
    /// Ideally diffuse.
    Lambert(Lambert),
    /// A metal.
    Conductor(Conductor),
    /// A reflecting interface over a diffuse base.
    Plastic(Plastic),
    /// A reflecting and transmitting interface.
    Glass(Glass),
    /// Several of them.
    Mixture(Mixture),
    /// Some lobes of any of them.
    Kept(Kept),
    /// Any of them under a coat or cloth.
    Layered(Box<Layered>),
    /// Any of them with an index for each colour.
    Dispersed(Box<Dispersed>),
}

impl Bsdf {
    /// metallic · conductor + (1 − metallic) · ((1 − transmission) · plastic + transmission · glass).
    pub fn from_surface(given: &SurfaceParameters) -> Self {
        if given.layers.is_some() {
            return Self::layered(given, Letters::NATURAL);
        }
        Self::whole(&clamped(given))
    }

    /// The same with no lobes but those of `letters`. With the letter `S_T` among them every glossy lobe has, beside itself
    /// if that is kept, an ideal twin: what it would be at roughness 0.
    pub fn keeping(given: &SurfaceParameters, letters: Letters) -> Self {
        if given.layers.is_some() {
            return Self::layered(given, letters);
        }
        let s = clamped(given);
        // Written where it is returned to: a copy of the whole costs as much as making it.
        if letters.contains(Letters::NATURAL) && !letters.has(Letter::Mirrored) {
            return Self::whole(&s);
        }
        let whole = Self::whole(&s);
        let own = whole.letters();
        let twins = letters.has(Letter::Mirrored) && own.has(Letter::Glossy);
        match whole {
            whole if letters.contains(own) && !twins => whole,
            // Nothing but diffuse.
            Self::Lambert(_) => Self::Kept(Kept::new(&Mixture::NONE, letters)),
            _ => Self::Kept(Kept::new(&mixture(&s), letters)),
        }
    }

    #[inline(never)]
    fn layered(given: &SurfaceParameters, letters: Letters) -> Self {
        let s = clamped(given);
        let mut below = mixture(&s);
        let Some(layers) = &s.layers else { return Self::Kept(Kept::new(&below, letters)) };
        if layers.dispersion > 0.0 && s.walls == Walls::Solid && below.glass.is_some() {
            let rest = Some(Layers { dispersion: 0.0, ..*layers }).filter(|rest| !rest.is_empty());
            let band = |ior| Self::keeping(&SurfaceParameters { ior, layers: rest, ..s }, letters);
            return Self::Dispersed(Box::new(Dispersed::new(indices(s.ior, layers.dispersion).map(band))));
        }
        let finish = &layers.finish;
        let alpha = s.roughness * s.roughness;
        let (metal, plastic) = (Schlick { f0: s.base_color, f90: 1.0 }, over_plastic(&s));
        let mut through = None;
        let mut base_color = s.base_color;
        if layers.through > 0.0
            && s.walls == Walls::Thin
            && let Some((weight, part)) = &mut below.plastic
        {
            base_color *= 1.0 - layers.through;
            *part = Plastic::new(alpha, plastic, base_color);
            let there = layers.through_color * layers.through;
            let base = if finish.is_none() {
                Base::Plain(Plastic::new(alpha, plastic, there))
            } else {
                Base::Finished(Box::new(Finish::new(finish, alpha, plastic, there)))
            };
            through = Some((*weight, base));
        }
        let finishes = (!finish.is_none()).then(|| Finishes {
            metal: Finish::new(finish, alpha, metal, Rgb::ZERO),
            plastic: Finish::new(finish, alpha, plastic, base_color),
        });
        let below = Kept::finished(&below, letters, finishes);
        Self::Layered(Box::new(Layered::new(layers, through, below, letters, s.walls)))
    }

    fn whole(s: &SurfaceParameters) -> Self {
        let [metal, plastic, glass] = weights(s);
        if metal >= 1.0 {
            Self::Conductor(new_conductor(s))
        } else if plastic >= 1.0 && s.specular == 0.0 {
            Self::Lambert(Lambert { reflectance: s.base_color })
        } else if plastic >= 1.0 {
            Self::Plastic(new_plastic(s))
        } else if glass >= 1.0 {
            Self::Glass(new_glass(s))
        } else {
            Self::Mixture(mixture(s))
        }
    }

    /// The letters that a scattering here can have.
    pub fn letters(&self) -> Letters {
        match self {
            Self::Lambert(_) => Letters::of(Letter::Diffuse),
            Self::Conductor(part) => part.letters(),
            Self::Plastic(part) => part.letters(),
            Self::Glass(part) => part.letters(),
            Self::Mixture(part) => part.letters(),
            Self::Kept(part) => part.letters(),
            Self::Layered(part) => part.letters(),
            Self::Dispersed(part) => part.letters(),
        }
    }

    /// Whether a lobe has a finite density, so that connecting to this point can be worth something.
    pub fn is_smooth_anywhere(&self) -> bool {
        let letters = self.letters();
        letters.has(Letter::Diffuse) || letters.has(Letter::Glossy)
    }

    /// f · |cos θᵢ| by letter, of the smooth lobes; zero where a direction lies in the surface.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3, transport: Transport) -> Scattered {
        self.evaluate(wo, wi, transport).value
    }

    /// The density over solid angle with which [`Self::sample`] draws `wi` given `wo` from the smooth
    /// lobes, their probabilities included; it integrates to what delta lobes and absorption leave of one.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.evaluate(wo, wi, Transport::Importance).pdf
    }

    /// [`Self::eval`] and [`Self::pdf`] for the price of one.
    #[inline]
    pub fn eval_and_pdf(&self, wo: Vec3, wi: Vec3, transport: Transport) -> (Scattered, f32) {
        let evaluated = self.evaluate(wo, wi, transport);
        (evaluated.value, evaluated.pdf)
    }

    /// Draws a direction; `u_lobe` and `u` are uniform in 0..1. `None`: absorbed.
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: Vec2, transport: Transport) -> Option<BsdfSample> {
        if wo.z.abs() < HORIZON {
            return None;
        }
        let Drawn { wi, eta, delta } = self.draw(wo, u_lobe, u, transport)?;
        let kind = if let Some(delta) = delta {
            let Delta { value, probability, letter } = delta;
            SampleKind::Specular { letter, weight: value / probability, probability }
        } else {
            let Evaluated { value, pdf } = self.evaluate(wo, wi, transport);
            if !(pdf > 0.0 && pdf.is_finite()) {
                return None;
            }
            SampleKind::Smooth { value, pdf }
        };
        Some(BsdfSample { wi, kind, eta })
    }

    #[inline]
    fn draw(&self, wo: Vec3, u_lobe: f32, u: Vec2, transport: Transport) -> Option<Drawn> {
        match self {
            Self::Lambert(_) => Some(Lambert::draw(wo, u)),
            Self::Conductor(part) => part.draw(wo, u_lobe, u),
            Self::Plastic(part) => part.draw(wo, u_lobe, u),
            Self::Glass(part) => part.draw(wo, u_lobe, u, transport),
            Self::Mixture(part) => part.draw(wo, u_lobe, u, transport),
            Self::Kept(part) => part.draw(wo, u_lobe, u, transport),
            Self::Layered(part) => part.draw(wo, u_lobe, u, transport),
            Self::Dispersed(part) => part.draw(wo, u_lobe, u, transport),
        }
    }

    #[inline]
    fn evaluate(&self, wo: Vec3, wi: Vec3, transport: Transport) -> Evaluated {
        if wo.z.abs() < HORIZON || wi.z.abs() < HORIZON {
            return Evaluated::default();
        }
        match self {
            Self::Lambert(part) => part.evaluate(wo, wi),
            Self::Conductor(part) => part.evaluate(wo, wi),
            Self::Plastic(part) => part.evaluate(wo, wi),
            Self::Glass(part) => part.evaluate(wo, wi, transport),
            Self::Mixture(part) => part.evaluate(wo, wi, transport),
            Self::Kept(part) => part.evaluate(wo, wi, transport),
            Self::Layered(part) => part.evaluate(wo, wi, transport),
            Self::Dispersed(part) => part.evaluate(wo, wi, transport),
        }
    }
}

/// Of conductor, plastic and glass.
fn weights(s: &SurfaceParameters) -> [f32; 3] {
    [s.metallic, (1.0 - s.metallic) * (1.0 - s.transmission), (1.0 - s.metallic) * s.transmission]
}

fn new_conductor(s: &SurfaceParameters) -> Conductor {
    Conductor::new(s.roughness * s.roughness, s.base_color)
}

fn new_plastic(s: &SurfaceParameters) -> Plastic {
    Plastic::new(s.roughness * s.roughness, over_plastic(s), s.base_color)
}

fn over_plastic(s: &SurfaceParameters) -> Schlick {
    let f0 = (dielectric_at_normal(s.ior) * s.specular_color).min(Rgb::ONE) * s.specular;
    Schlick { f0, f90: s.specular }
}

fn new_glass(s: &SurfaceParameters) -> Glass {
    Glass::new(s, s.roughness * s.roughness)
}

/// The parts that have a weight.
fn mixture(s: &SurfaceParameters) -> Mixture {
    let [metal, plastic, glass] = weights(s);
    Mixture {
        conductor: (metal > 0.0).then(|| (metal, new_conductor(s))),
        plastic: (plastic > 0.0).then(|| (plastic, new_plastic(s))),
        glass: (glass > 0.0).then(|| (glass, new_glass(s))),
    }
}

/// Every number within its range; not-a-number becomes zero.
#[expect(clippy::manual_clamp, reason = "clamp keeps what is not a number")]
fn clamped(s: &SurfaceParameters) -> SurfaceParameters {
    let unit = |v: f32| v.max(0.0).min(1.0);
    SurfaceParameters {
        base_color: Rgb::from_array(s.base_color.to_array().map(unit)),
        metallic: unit(s.metallic),
        roughness: unit(s.roughness),
        specular: unit(s.specular),
        specular_color: Rgb::from_array(s.specular_color.to_array().map(|v| v.max(0.0).min(f32::MAX))),
        ior: s.ior.max(0.0).min(f32::MAX),
        transmission: unit(s.transmission),
        walls: s.walls,
        layers: s.layers.map(|layers| Layers {
            coat: unit(layers.coat),
            coat_roughness: unit(layers.coat_roughness),
            coat_normal: layers.coat_normal,
            sheen: Rgb::from_array(layers.sheen.to_array().map(unit)),
            sheen_roughness: unit(layers.sheen_roughness),
            dispersion: layers.dispersion.max(0.0).min(f32::MAX),
            through: unit(layers.through),
            through_color: Rgb::from_array(layers.through_color.to_array().map(unit)),
            finish: Finishing {
                strength: unit(layers.finish.strength),
                along: layers.finish.along,
                film: unit(layers.finish.film),
                film_ior: layers.finish.film_ior.max(1.0).min(f32::MAX),
                film_thickness: layers.finish.film_thickness.max(0.0).min(f32::MAX),
            },
        }),
    }
}

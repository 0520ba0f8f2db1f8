//! A reflecting interface whose facets lie along a direction (`KHR_materials_anisotropy`) or carry a thin film
//! (`KHR_materials_iridescence`), and the coupling of a diffuse base to it.
//!
//! Brushed facets scatter once: what bounces on between them is lost, as the table of their albedo has one roughness only
//! (an interface of reflectance 1 loses up to half at strength 1). Under a film alone it is kept, as in `gloss`.
//!
//! The base is seen through T(w) = 1 − A(w), where A is no less than the albedo of the interface: that of Schlick's bound
//! of its reflectance, of facets that lose nothing, and under brushed ones with the grazing part of a smooth surface where
//! that is larger than those of both roughnesses. The base's
//! f is ρ T(o) T(i) / (π T̄) as in `plastic`, T̄ no less than the mean of T: reciprocal, and no albedo exceeds one.

use crate::bsdf::brushed::Brushed;
use crate::bsdf::conductor::upward;
use crate::bsdf::event::{Letter, Scattered};
use crate::bsdf::film::{Coating, Film};
use crate::bsdf::fresnel::{GRAZING_MEAN, Schlick, fifth_power};
use crate::bsdf::ggx::{Ggx, reflect};
use crate::bsdf::gloss::Between;
use crate::bsdf::lobe::{Delta, Drawn, Evaluated, split};
use crate::bsdf::surface::Finishing;
use crate::math::colour::{Rgb, luminance};
use core::f32::consts::FRAC_1_PI;
use glam::{Vec2, Vec3};

/// An interface with a finish. It lies on both sides.
#[derive(Clone, Copy, Debug)]
pub(super) struct Finish {
    facets: Option<Facets>,
    reflectance: Reflectance,
    /// Nowhere less than the reflectance.
    bound: Schlick,
    base: Rgb,
    /// ρ / (π T̄).
    coupled: Rgb,
}

/// Rough ones.
#[derive(Clone, Copy, Debug)]
struct Facets {
    shape: Brushed,
    /// Of each of the two roughnesses.
    evenly: [(Ggx, Between); 2],
    /// Fₘₛ; zero where facets are brushed.
    multiple: Rgb,
}

#[derive(Clone, Copy, Debug)]
#[expect(clippy::large_enum_variant, reason = "a surface is copied, not kept in a heap")]
enum Reflectance {
    Plain(Schlick),
    Filmed(Film),
}

impl Reflectance {
    fn at(&self, cos: f32) -> Rgb {
        match self {
            Self::Plain(schlick) => schlick.at(cos),
            Self::Filmed(film) => film.at(cos),
        }
    }
}

impl Finish {
    /// Over a base of reflectance `base`; α is `alpha` where nothing is brushed.
    pub(super) fn new(given: &Finishing, alpha: f32, schlick: Schlick, base: Rgb) -> Self {
        let (reflectance, bound, mean) = if given.film > 0.0 {
            let coating = Coating { ior: given.film_ior, thickness: given.film_thickness };
            let film = Film::new(given.film, coating, schlick);
            (Reflectance::Filmed(film), film.bound(), film.mean())
        } else {
            (Reflectance::Plain(schlick), schlick, schlick.mean())
        };
        let along = alpha + (1.0 - alpha) * given.strength * given.strength;
        let facets = Brushed::new(Vec2::new(along, alpha), given.along).and_then(|shape| {
            let of = |alpha| Ggx::new(alpha).map(|ggx| (ggx, Between::new(ggx)));
            let evenly = [of(shape.alphas.x)?, of(shape.alphas.y)?];
            let mut facets = Facets { shape, evenly, multiple: Rgb::ZERO };
            if !facets.is_brushed() {
                facets.multiple = evenly[0].1.reflected(mean);
            }
            Some(facets)
        });
        let mut all = Self { facets, reflectance, bound, base, coupled: Rgb::ZERO };
        all.coupled = base * FRAC_1_PI / (Rgb::ONE - all.least_mean()).max(Rgb::splat(1e-6));
        all
    }

    /// No more than the mean of [`Self::albedo`].
    fn least_mean(&self) -> Rgb {
        match &self.facets {
            None => self.bound.mean(),
            Some(facets) => {
                let [a, b] = facets.evenly.map(|(_, between)| between.means.grazing);
                let brushed = if facets.is_brushed() { GRAZING_MEAN } else { 0.0 };
                self.bound.split(1.0, a.max(b).max(brushed))
            }
        }
    }

    pub(super) fn letter(&self) -> Letter {
        if self.facets.is_some() { Letter::Glossy } else { Letter::Specular }
    }

    /// What an ideally smooth one reflects.
    pub(super) fn mirror(&self, wo: Vec3) -> Rgb {
        self.reflectance.at(wo.z.abs())
    }

    /// Reflects like an ideally smooth one, under a letter.
    pub(super) fn draw_mirror(&self, wo: Vec3, letter: Letter) -> Drawn {
        let delta = Delta { value: self.mirror(wo), probability: 1.0, letter };
        Drawn { wi: reflect(wo, Vec3::Z), eta: 1.0, delta: Some(delta) }
    }

    /// No less than the directional albedo of the interface.
    pub(super) fn albedo(&self, w: Vec3) -> Rgb {
        let w = upward(w);
        let Some(facets) = &self.facets else { return self.bound.at(w.z) };
        (self.bound.split(1.0, facets.grazing(w)) + facets.multiple * facets.missing(w)).min(Rgb::ONE)
    }

    /// Of the base as it is seen through the interface.
    pub(super) fn base_albedo(&self, wo: Vec3) -> Rgb {
        self.base * (Rgb::ONE - self.albedo(wo))
    }

    /// The base as it is seen through the interface, drawn by `Plastic::draw_base`.
    pub(super) fn evaluate_base(&self, wo: Vec3, wi: Vec3) -> Evaluated {
        if wo.z * wi.z <= 0.0 {
            return Evaluated::default();
        }
        let passed = (Rgb::ONE - self.albedo(wo)) * (Rgb::ONE - self.albedo(wi));
        let diffuse = self.coupled * passed * wi.z.abs();
        Evaluated { value: Scattered { diffuse, glossy: Rgb::ZERO }, pdf: wi.z.abs() * FRAC_1_PI }
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluated {
        let Some(facets) = &self.facets else { return Evaluated::default() };
        if wo.z * wi.z <= 0.0 {
            return Evaluated::default();
        }
        let (wo, wi) = (upward(wo), upward(wi));
        let (shape, mut pdf, dot) = facets.shape.reflected(wo, wi);
        let mut glossy = self.reflectance.at(dot) * shape;
        if facets.multiple != Rgb::ZERO {
            let between = &facets.evenly[0].1;
            let (missing_o, missing_i) = (facets.missing(wo), facets.missing(wi));
            glossy += facets.multiple * (missing_o * missing_i * wi.z * between.scale);
            let share = self.share_of_further_bounces(facets, missing_o);
            pdf += (between.pdf(wi.z) - pdf) * share;
        }
        Evaluated { value: Scattered { diffuse: Rgb::ZERO, glossy }, pdf }
    }

    pub(super) fn draw(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<Drawn> {
        let Some(facets) = &self.facets else { return Some(self.draw_mirror(wo, Letter::Specular)) };
        let above = upward(wo);
        let share = self.share_of_further_bounces(facets, facets.missing(above));
        let wi = match split(u_lobe, share) {
            Ok(_) => facets.evenly[0].1.draw(u),
            Err(_) => facets.shape.draw(above, u),
        };
        (wi.z > 0.0).then(|| Drawn::smooth(wi.with_z(wi.z.copysign(wo.z))))
    }

    /// The probability with which they are drawn.
    fn share_of_further_bounces(&self, facets: &Facets, missing: f32) -> f32 {
        let multiple = luminance(facets.multiple) * missing;
        let single = luminance(self.bound.mean()) * (1.0 - missing);
        if multiple > 0.0 { multiple / (multiple + single) } else { 0.0 }
    }
}

impl Facets {
    fn is_brushed(&self) -> bool {
        self.shape.alphas.x > self.shape.alphas.y
    }

    /// No less than the albedo of the (1 − v·h)⁵ part of the first bounce. Of brushed facets that is between those of both
    /// roughnesses and of none, or up to 0.004 above them all (over a grid of roughnesses and directions).
    fn grazing(&self, w: Vec3) -> f32 {
        let [a, b] = self.evenly.map(|(ggx, between)| between.grazing(w, ggx.stretched(w)));
        if self.is_brushed() { (a.max(b).max(fifth_power((1.0 - w.z).max(0.0))) + 0.006).min(1.0) } else { a }
    }

    /// 1 − E(w) of facets that are not brushed.
    fn missing(&self, w: Vec3) -> f32 {
        let (ggx, between) = self.evenly[0];
        between.missing(w, ggx.stretched(w))
    }
}

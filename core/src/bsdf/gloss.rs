//! A reflecting interface: one bounce off a microfacet, and what bounces on between them.
//!
//! The first is GGX times Schlick's reflectance. The second makes good the energy that it loses
//! (Kulla and Conty 2017): Fₘₛ (1 − E(v)) (1 − E(l)) / (π (1 − Ē)) with
//! Fₘₛ = F̄² Ē / (1 − F̄ (1 − Ē)), reciprocal, and with the directional albedo Fₘₛ (1 − E(v)). A white
//! interface loses nothing. Both carry the letter `S`: the compensation is broad, but it is light that the
//! microfacets reflect, and whoever asks for `D` means the base below them.

use crate::bsdf::albedo::{Means, Row};
use crate::bsdf::event::Letter;
use crate::bsdf::fresnel::{Schlick, fifth_power};
use crate::bsdf::ggx::{Ggx, Reach, reflect};
use crate::math::colour::{Rgb, luminance};
use crate::math::warp;
use core::f32::consts::FRAC_1_PI;
use glam::{Vec2, Vec3};

/// α² by so much over (1 − α)² is how evenly directions between the microfacets are drawn: of several such factors and functions the one with
/// the least mean square of a white interface's weights, or within 0.001 of it, at each of ten α from 0.02 to 1.
const EVENNESS: f32 = 10.0;
/// Nearly a cosine.
const EVENNESS_MAX: f32 = 100.0;

/// The interface of a conductor or of a plastic. All directions are above it: z > 0.
#[derive(Clone, Copy, Debug)]
pub(super) enum Gloss {
    Smooth(Schlick),
    Rough(RoughGloss),
}

/// An interface of finite roughness.
#[derive(Clone, Copy, Debug)]
pub(super) struct RoughGloss {
    pub(super) ggx: Ggx,
    schlick: Schlick,
    /// Fₘₛ.
    multiple: Rgb,
    pub(super) between: Between,
}

/// The table of one roughness, and the lobe between the microfacets when every one of them is white.
#[derive(Clone, Copy, Debug)]
pub(super) struct Between {
    row: Row,
    pub(super) means: Means,
    /// 1 / (π (1 − Ē)).
    pub(super) scale: f32,
    alpha2: f32,
    /// How little directions that are drawn favour the horizon, as in [`warp::horizon_hemisphere`].
    evenness: f32,
    /// ln(1 + 1 / evenness).
    ell: f32,
}

/// A direction and what the interface does to it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// σ(w).
    pub(super) stretched: f32,
    /// 1 − E.
    pub(super) missing: f32,
    /// Albedo of the first bounce.
    pub(super) single: Rgb,
    /// Albedo of the rest.
    pub(super) multiple: Rgb,
}

impl Gloss {
    pub(super) fn new(alpha: f32, schlick: Schlick) -> Self {
        match Ggx::new(alpha) {
            None => Self::Smooth(schlick),
            Some(ggx) => {
                let between = Between::new(ggx);
                Self::Rough(RoughGloss { ggx, schlick, multiple: between.reflected(schlick.mean()), between })
            }
        }
    }

    pub(super) fn letter(&self) -> Letter {
        match self {
            Self::Smooth(_) => Letter::Specular,
            Self::Rough(_) => Letter::Glossy,
        }
    }

    /// Reflectance of a facet.
    pub(super) fn schlick(&self) -> Schlick {
        match self {
            Self::Smooth(schlick) => *schlick,
            Self::Rough(rough) => rough.schlick,
        }
    }

    /// Directional albedo of everything above the base.
    #[inline]
    pub(super) fn albedo(&self, w: Vec3) -> Rgb {
        match self {
            Self::Smooth(schlick) => schlick.at(w.z),
            Self::Rough(rough) => {
                let seen = rough.see(w);
                seen.single + seen.multiple
            }
        }
    }

    /// Cosine-weighted mean of [`Self::albedo`].
    pub(super) fn mean_albedo(&self) -> Rgb {
        match self {
            Self::Smooth(schlick) => schlick.mean(),
            Self::Rough(rough) => {
                let means = rough.between.means;
                rough.schlick.split(1.0 - means.missing, means.grazing) + rough.multiple * means.missing
            }
        }
    }
}

impl RoughGloss {
    #[inline]
    pub(super) fn see(&self, w: Vec3) -> Seen {
        let stretched = self.ggx.stretched(w);
        let (missing, grazing) = self.between.row.missing_and_grazing(w, self.ggx.alpha2, stretched);
        let single = self.schlick.split(1.0 - missing, grazing);
        let multiple = self.multiple * missing;
        Seen { stretched, missing, single, multiple }
    }

    /// f · cos θᵢ of both lobes, and the density with which each draws `wi`: zero where the half
    /// vector vanishes.
    #[inline]
    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3, o: &Seen, i: &Seen) -> (Rgb, [f32; 2]) {
        let (shape, pdf, dot) = self.ggx.reflected(wo, o.stretched, wi, i.stretched);
        let single = self.schlick.split(1.0, fifth_power((1.0 - dot).max(0.0))) * shape;
        // `o.multiple` holds Fₘₛ (1 − E(v)) already.
        let multiple = o.multiple * (i.missing * wi.z * self.between.scale);
        (single + multiple, [pdf, self.between.pdf(wi.z)])
    }

    /// The probabilities of the two lobes before any other lobe takes part, not normalised.
    #[inline]
    pub(super) fn weights(o: &Seen) -> [f32; 2] {
        [luminance(o.single), luminance(o.multiple)]
    }

    /// How much of the first bounce is better drawn as [`Between::draw`] does: the more, the rougher the interface. Off an even distribution
    /// of facets light goes to the sides less than what is drawn of them does, and but for grazing directions nearly by the cosine.
    #[inline]
    pub(super) fn evenly(&self, o: &Seen) -> f32 {
        self.ggx.alpha2 * (o.missing / self.between.means.missing).min(1.0)
    }

    /// A direction off a microfacet; it may be below the horizon.
    pub(super) fn draw_single(&self, wo: Vec3, u: Vec2) -> Vec3 {
        reflect(wo, self.ggx.sample_visible(wo, u, Reach::Bounded))
    }
}

impl Between {
    pub(super) fn new(ggx: Ggx) -> Self {
        let alpha2 = ggx.alpha2;
        let row = Row::of(ggx.alpha);
        let means = row.means(alpha2, libm::log1pf(1.0 / alpha2));
        let evenness = (EVENNESS * alpha2 / (1.0 - ggx.alpha).powi(2)).min(EVENNESS_MAX);
        let ell = libm::log1pf(1.0 / evenness);
        Self { row, means, scale: FRAC_1_PI / means.missing, alpha2, evenness, ell }
    }

    /// 1 − E(w), for `w.z` > 0.
    #[inline]
    pub(super) fn missing(&self, w: Vec3, stretched: f32) -> f32 {
        self.row.missing_and_grazing(w, self.alpha2, stretched).0
    }

    /// The albedo of the (1 − v·h)⁵ part of the first bounce, for `w.z` > 0.
    pub(super) fn grazing(&self, w: Vec3, stretched: f32) -> f32 {
        self.row.missing_and_grazing(w, self.alpha2, stretched).1
    }

    /// Fₘₛ of a mean reflectance.
    #[inline]
    pub(super) fn reflected(&self, mean: Rgb) -> Rgb {
        let even = 1.0 - self.means.missing;
        mean * mean * even / (Rgb::ONE - mean * self.means.missing)
    }

    /// A direction drawn nearly in proportion to the lobe: by table at low roughness most of it is
    /// at the horizon, at high roughness hardly any.
    pub(super) fn draw(&self, u: Vec2) -> Vec3 {
        warp::horizon_hemisphere(u, self.evenness, self.ell)
    }

    /// The density of [`Self::draw`] over solid angle.
    #[inline]
    pub(super) fn pdf(&self, cos: f32) -> f32 {
        warp::horizon_hemisphere_pdf(cos, self.evenness, self.ell)
    }
}

//! A dielectric interface over an opaque diffuse base.
//!
//! What the interface does not reflect reaches the base and leaves again in proportion to what the
//! interface lets out: ρ (1 − Eₛ(v)) (1 − Eₛ(l)) / (π (1 − Ēₛ)), Eₛ the directional albedo of the interface by
//! channel (Kelemen and Szirmay-Kalos 2001). Reciprocal, and the albedo Eₛ(v) + ρ (1 − Eₛ(v)) is at most 1 in
//! every direction; the mix in appendix B of the glTF specification exceeds 1 by far at grazing angles.

use crate::bsdf::conductor::{Conductor, upward};
use crate::bsdf::event::{Letter, Letters, Scattered};
use crate::bsdf::fresnel::Schlick;
use crate::bsdf::ggx::reflect;
use crate::bsdf::gloss::{Gloss, RoughGloss};
use crate::bsdf::lobe::{Delta, Drawn, Evaluated, split};
use crate::math::colour::{Rgb, luminance};
use crate::math::warp;
use core::f32::consts::FRAC_1_PI;
use glam::{Vec2, Vec3};

/// Letters `D` from the base and `S` (or `S_M` when smooth) from the interface, on either side.
#[derive(Clone, Copy, Debug)]
pub struct Plastic {
    gloss: Gloss,
    base: Rgb,
    /// ρ / (π (1 − Ēₛ)).
    coupled: Rgb,
}

/// Probabilities of the lobes: first bounce or mirror, further bounces, base.
struct Shares {
    single: f32,
    multiple: f32,
    base: f32,
}

impl Plastic {
    pub(super) fn new(alpha: f32, schlick: Schlick, base: Rgb) -> Self {
        let gloss = Gloss::new(alpha, schlick);
        // A perfect mirror lets nothing through; rounding must not divide by that.
        let through = (Rgb::ONE - gloss.mean_albedo()).max(Rgb::splat(1e-6));
        Self { gloss, base, coupled: base * FRAC_1_PI / through }
    }

    pub(super) fn letters(&self) -> Letters {
        Letters::of(self.interface_letter()).union(Letters::of(Letter::Diffuse))
    }

    pub(super) fn interface_letter(&self) -> Letter {
        self.gloss.letter()
    }

    /// The interface alone, as if nothing were below it.
    pub(super) fn interface(&self) -> Conductor {
        Conductor::of(self.gloss)
    }

    pub(super) fn albedo(&self, wo: Vec3) -> Rgb {
        let interface = self.gloss.albedo(upward(wo));
        interface + self.base * (Rgb::ONE - interface)
    }

    /// Of the base as it is seen through the interface.
    pub(super) fn base_albedo(&self, wo: Vec3) -> Rgb {
        self.base * (Rgb::ONE - self.gloss.albedo(upward(wo))).max(Rgb::ZERO)
    }

    /// The base as it is seen through the interface, drawn by [`Self::draw_base`].
    pub(super) fn evaluate_base(&self, wo: Vec3, wi: Vec3) -> Evaluated {
        if wo.z * wi.z <= 0.0 {
            return Evaluated::default();
        }
        let (wo, wi) = (upward(wo), upward(wi));
        let diffuse = self.below(self.gloss.albedo(wo), self.gloss.albedo(wi)) * wi.z;
        Evaluated { value: Scattered { diffuse, glossy: Rgb::ZERO }, pdf: wi.z * FRAC_1_PI }
    }

    pub(super) fn draw_base(wo: Vec3, u: Vec2) -> Option<Drawn> {
        let wi = warp::cosine_hemisphere(u);
        (wi.z > 0.0).then(|| Drawn::smooth(wi.with_z(wi.z.copysign(wo.z))))
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3) -> Evaluated {
        if wo.z * wi.z <= 0.0 {
            return Evaluated::default();
        }
        let (wo, wi) = (upward(wo), upward(wi));
        let cosine = wi.z * FRAC_1_PI;
        match &self.gloss {
            Gloss::Smooth(schlick) => {
                let (o, i) = (schlick.at(wo.z), schlick.at(wi.z));
                let shares = self.shares(luminance(o), 0.0, o);
                let value = Scattered { diffuse: self.below(o, i) * wi.z, glossy: Rgb::ZERO };
                Evaluated { value, pdf: shares.base * cosine }
            }
            Gloss::Rough(rough) => {
                let (o, i) = (rough.see(wo), rough.see(wi));
                let [single, multiple] = RoughGloss::weights(&o);
                let shares = self.shares(single, multiple, o.single + o.multiple);
                let (glossy, [pdf_single, pdf_multiple]) = rough.evaluate(wo, wi, &o, &i);
                let diffuse = self.below(o.single + o.multiple, i.single + i.multiple) * wi.z;
                let pdf = shares.single * pdf_single + shares.multiple * pdf_multiple + shares.base * cosine;
                Evaluated { value: Scattered { diffuse, glossy }, pdf }
            }
        }
    }

    pub(super) fn draw(&self, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<Drawn> {
        let above = upward(wo);
        let wi = match &self.gloss {
            Gloss::Smooth(schlick) => {
                let mirrored = schlick.at(above.z);
                let shares = self.shares(luminance(mirrored), 0.0, mirrored);
                if u_lobe < shares.single {
                    let letter = Letter::Specular;
                    let delta = Delta { value: mirrored, probability: shares.single, letter };
                    return Some(Drawn { wi: reflect(wo, Vec3::Z), eta: 1.0, delta: Some(delta) });
                }
                warp::cosine_hemisphere(u)
            }
            Gloss::Rough(rough) => {
                let o = rough.see(above);
                let [single, multiple] = RoughGloss::weights(&o);
                let shares = self.shares(single, multiple, o.single + o.multiple);
                match split(u_lobe, shares.base) {
                    Ok(_) => warp::cosine_hemisphere(u),
                    Err(rest) if rest * (shares.single + shares.multiple) < shares.single => {
                        rough.draw_single(above, u)
                    }
                    Err(_) => rough.between.draw(u),
                }
            }
        };
        (wi.z > 0.0).then(|| Drawn::smooth(wi.with_z(wi.z.copysign(wo.z))))
    }

    /// The base's f, for the interface's albedo in both directions.
    #[inline]
    fn below(&self, o: Rgb, i: Rgb) -> Rgb {
        self.coupled * (Rgb::ONE - o).max(Rgb::ZERO) * (Rgb::ONE - i).max(Rgb::ZERO)
    }

    #[inline]
    fn shares(&self, single: f32, multiple: f32, interface: Rgb) -> Shares {
        let base = luminance(self.base * (Rgb::ONE - interface).max(Rgb::ZERO));
        let total = single + multiple + base;
        if total > 0.0 {
            Shares { single: single / total, multiple: multiple / total, base: base / total }
        } else {
            Shares { single: 1.0, multiple: 0.0, base: 0.0 }
        }
    }
}

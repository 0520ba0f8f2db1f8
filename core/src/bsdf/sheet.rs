//! A rough sheet of glass without thickness.
//!
//! Reflects like a rough interface and transmits the mirror image of that, so that both lobes have the albedo
//! table of the reflecting interface, and its compensation splits between the two sides.

use crate::bsdf::conductor::upward;
use crate::bsdf::event::Scattered;
use crate::bsdf::fresnel::dielectric_mean;
use crate::bsdf::ggx::{Ggx, Reach, reflect};
use crate::bsdf::glass::{Facet, Interface};
use crate::bsdf::gloss::Between;
use crate::bsdf::lobe::{Drawn, Evaluated, split};
use crate::math::colour::Rgb;
use glam::{Vec2, Vec3};

/// The rough sheet's own part of `Glass`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheet {
    ggx: Ggx,
    between: Between,
    /// Where light goes that has scattered between microfacets.
    mean: Facet,
}

impl Sheet {
    pub(super) fn new(ggx: Ggx, interface: &Interface) -> Self {
        let mean = interface.facet_of(dielectric_mean(interface.ior));
        Self { ggx, between: Between::new(ggx), mean }
    }

    pub(super) fn evaluate(&self, interface: &Interface, wo: Vec3, wi: Vec3) -> Evaluated {
        let same_side = wo.z * wi.z > 0.0;
        let (wo, wi) = (upward(wo), upward(wi));
        let (stretched_o, stretched_i) = (self.ggx.stretched(wo), self.ggx.stretched(wi));
        let (shape, pdf, dot) = self.ggx.reflected(wo, stretched_o, wi, stretched_i);
        let (missing_o, missing_i) =
            (self.between.missing(wo, stretched_o), self.between.missing(wi, stretched_i));
        let (single, chance) = of_side(&interface.facet(dot, interface.ior), same_side);
        let (multiple, chance_multiple) = of_side(&self.mean, same_side);
        let rest = missing_o * missing_i * self.between.scale * wi.z;
        let value = Scattered { diffuse: Rgb::ZERO, glossy: single * shape + multiple * rest };
        let pdf_multiple = chance_multiple * self.between.pdf(wi.z);
        Evaluated { value, pdf: (1.0 - missing_o) * chance * pdf + missing_o * pdf_multiple }
    }

    pub(super) fn draw(&self, interface: &Interface, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<Drawn> {
        let above = upward(wo);
        let missing = self.between.missing(above, self.ggx.stretched(above));
        let (wi, facet, rest) = match split(u_lobe, missing) {
            Ok(rest) => (self.between.draw(u), self.mean, rest),
            Err(rest) => {
                let half = self.ggx.sample_visible(above, u, Reach::Bounded);
                let facet = interface.facet(above.dot(half).max(0.0), interface.ior);
                (reflect(above, half), facet, rest)
            }
        };
        let side = if rest < facet.chance_of_reflection()? { wo.z } else { -wo.z };
        (wi.z > 0.0).then(|| Drawn::smooth(wi.with_z(wi.z.copysign(side))))
    }
}

/// The share of one side and the probability of choosing it.
#[inline]
fn of_side(facet: &Facet, same_side: bool) -> (Rgb, f32) {
    match (facet.chance_of_reflection(), same_side) {
        (None, _) => (Rgb::ZERO, 0.0),
        (Some(chance), true) => (facet.reflected, chance),
        (Some(chance), false) => (facet.transmitted, 1.0 - chance),
    }
}

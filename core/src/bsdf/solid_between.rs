//! What scatters on between the microfacets of rough glass.
//!
//! As on the other rough surfaces, what a single scattering loses comes back as a broad lobe (Kulla and Conty
//! 2017), here to both sides: with M and M' the missing albedos on the sides of v and l, the flux
//! x M(v) M'(l) / (π M̄') goes through and (1 − x) M(v) M(l) / (π M̄) back, so that together M(v) returns. That is
//! reciprocal if x M̄ from the rare side is η² x M̄ from the dense side: x is the mean transmittance from the
//! rare side, and follows from that on the dense side.

use crate::bsdf::fresnel::dielectric_mean;
use crate::bsdf::ggx::Ggx;
use crate::bsdf::glass::{Facet, Interface};
use crate::bsdf::solid_albedo::{Cell, Side};
use crate::math::colour::Rgb;
use crate::math::warp;
use core::f32::consts::FRAC_1_PI;
use glam::{Vec2, Vec3};

/// With a mean below this there is nothing to make up for.
const LEAST_MEAN: f32 = 1e-6;

/// The compensating lobe. Pairs are of the rare and of the dense side.
#[derive(Clone, Copy, Debug)]
pub(super) struct SolidBetween {
    cell: Cell,
    /// 1 / (π M̄).
    scale: [f32; 2],
    /// Where light goes from either side.
    facets: [Facet; 2],
    /// The side with z > 0.
    outside: Side,
    alpha2: f32,
    /// ln(1 + 1/α²).
    ell: f32,
}

impl SolidBetween {
    /// `None` where the reflectance is not Fresnel's own, for which the table is made.
    pub(super) fn new(ggx: Ggx, interface: &Interface) -> Option<Self> {
        if !interface.is_plain() {
            return None;
        }
        let (outside, ratio) = if interface.ior >= 1.0 {
            (Side::Rare, interface.ior)
        } else {
            (Side::Dense, 1.0 / interface.ior)
        };
        let cell = Cell::of(ggx.alpha, ratio);
        let alpha2 = ggx.alpha2;
        let ell = libm::log1pf(1.0 / alpha2);
        let means = [cell.mean(Side::Rare, ell), cell.mean(Side::Dense, ell)];
        if means[0].min(means[1]) < LEAST_MEAN {
            return None;
        }
        let back = means[0] / (means[1] * ratio * ratio);
        let through = (1.0 - dielectric_mean(ratio)).min(1.0 / back);
        let facets = [through, through * back].map(|through| Facet {
            reflected: Rgb::splat(1.0 - through),
            transmitted: interface.tint * through,
        });
        Some(Self { cell, scale: means.map(|mean| FRAC_1_PI / mean), facets, outside, alpha2, ell })
    }

    /// The side of a direction with this z.
    #[inline]
    pub(super) fn side(&self, z: f32) -> Side {
        if z > 0.0 { self.outside } else { self.outside.other() }
    }

    /// M of a direction on a side, by its cosine, which is positive on either.
    #[inline]
    pub(super) fn missing(&self, side: Side, cos: f32) -> f32 {
        self.cell.missing(side, cos)
    }

    /// Flux f · |cos θᵢ| and density for the sides, the M and the cosine of `wi`.
    #[inline]
    pub(super) fn evaluate(&self, sides: [Side; 2], missing: [f32; 2], cos: f32) -> (Rgb, f32) {
        let [from, to] = sides;
        let facet = &self.facets[from as usize];
        let Some(chance) = facet.chance_of_reflection() else { return (Rgb::ZERO, 0.0) };
        let (colour, chance) =
            if from == to { (facet.reflected, chance) } else { (facet.transmitted, 1.0 - chance) };
        let shape = missing[0] * missing[1] * self.scale[to as usize] * cos;
        (colour * shape, chance * warp::horizon_hemisphere_pdf(cos, self.alpha2, self.ell))
    }

    /// A direction relative to the side it comes from: z > 0 if it goes back there.
    pub(super) fn draw(&self, from: Side, u_side: f32, u: Vec2) -> Option<Vec3> {
        let wi = warp::horizon_hemisphere(u, self.alpha2, self.ell);
        let back = u_side < self.facets[from as usize].chance_of_reflection()?;
        Some(if back { wi } else { wi.with_z(-wi.z) })
    }
}

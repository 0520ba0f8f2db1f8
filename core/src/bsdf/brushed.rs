//! The GGX distribution of microfacet normals stretched along a direction (Burley 2012; Heitz 2014), as a brushed surface
//! has it.
//!
//! As in `ggx`, all is written with the stretched length σ(w) = √(cos² θ + α² sin² θ), where α is what w sees:
//! `αₜ² w.t² + α_b² w.b²`.

use crate::bsdf::ggx::{Ggx, SPECULAR_BELOW, reflect};
use crate::math::warp;
use core::f32::consts::FRAC_1_PI;
use glam::{Vec2, Vec3};

/// A distribution with a roughness along a direction and another across. Directions are above the surface: z > 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Brushed {
    /// α along `along` and across it, within 1e-3..=1.
    pub(super) alphas: Vec2,
    /// Of unit length, in the surface.
    along: Vec2,
}

impl Brushed {
    /// `None` where both roughnesses are below [`SPECULAR_BELOW`]; one of them alone is raised to it.
    pub(super) fn new(alphas: Vec2, along: Vec2) -> Option<Self> {
        let alphas = alphas.min(Vec2::ONE);
        (alphas.max_element() >= SPECULAR_BELOW)
            .then(|| Self { alphas: alphas.max(Vec2::splat(SPECULAR_BELOW)), along })
    }

    /// A direction of the shading frame by its parts along, across and up.
    #[inline]
    fn turned(self, w: Vec3) -> Vec3 {
        let flat = w.truncate();
        Vec3::new(self.along.dot(flat), self.along.perp_dot(flat), w.z)
    }

    #[inline]
    fn stretched(self, turned: Vec3) -> f32 {
        (self.alphas * turned.truncate()).extend(turned.z).length()
    }

    /// Of two directions: D G₂ / (4 cos θₒ), which is f · cos θᵢ for reflectance 1; the density over solid angle with
    /// which [`Self::draw`] draws `wi`; and the cosine between each and the half vector.
    #[inline]
    pub(super) fn reflected(self, wo: Vec3, wi: Vec3) -> (f32, f32, f32) {
        let half = self.turned(wo + wi);
        let length2 = half.length_squared();
        if length2 < f32::MIN_POSITIVE {
            return (0.0, 0.0, 0.0);
        }
        let (o, i) = (self.turned(wo), self.turned(wi));
        let (stretched_o, stretched_i) = (self.stretched(o), self.stretched(i));
        let ratio = length2 / (half.truncate() / self.alphas).extend(half.z).length_squared();
        let density = FRAC_1_PI / (self.alphas.x * self.alphas.y) * ratio * ratio;
        let value = density * wi.z * Ggx::visibility(wo.z, stretched_o, wi.z, stretched_i);
        let pdf = density * 0.5 / (self.bound(o) * o.z + stretched_o);
        (value, pdf, 0.5 * length2.sqrt())
    }

    /// Eto and Tokuyoshi's k (2023), with the lesser roughness.
    #[inline]
    fn bound(self, turned: Vec3) -> f32 {
        let alpha = self.alphas.min_element();
        let alpha2 = alpha * alpha;
        let s = 1.0 + turned.truncate().length();
        let s2 = s * s;
        (1.0 - alpha2) * s2 / (s2 + alpha2 * turned.z * turned.z)
    }

    /// The mirror direction of a normal that is visible from `wo`; it may be below the horizon.
    #[inline]
    pub(super) fn draw(self, wo: Vec3, u: Vec2) -> Vec3 {
        let o = self.turned(wo);
        let standard = (self.alphas * o.truncate()).extend(o.z) / self.stretched(o);
        let half = standard + warp::cap(u, -self.bound(o) * standard.z);
        let half = (self.alphas * half.truncate()).extend(half.z).normalize_or(Vec3::Z);
        reflect(wo, (self.along * half.x + self.along.perp() * half.y).extend(half.z))
    }
}

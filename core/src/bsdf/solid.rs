//! The rough surface of refracting glass (Walter et al. 2007).

use crate::bsdf::event::{Scattered, Transport};
use crate::bsdf::fresnel::dielectric_between;
use crate::bsdf::ggx::{Ggx, Reach, reflect};
use crate::bsdf::glass::{Interface, radiance_factor, refract};
use crate::bsdf::lobe::{Drawn, Evaluated};
use crate::math::colour::Rgb;
use glam::{Vec2, Vec3};

/// The rough solid's own part of `Glass`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solid {
    ggx: Ggx,
}

impl Solid {
    pub(super) fn new(ggx: Ggx) -> Self {
        Self { ggx }
    }

    pub(super) fn evaluate(
        self,
        interface: &Interface,
        wo: Vec3,
        wi: Vec3,
        transport: Transport,
    ) -> Evaluated {
        let eta = interface.eta(wo);
        // Mirrored so that `wo` is above.
        let side = wo.z.signum();
        let (wo, wi) = (wo.with_z(wo.z.abs()), wi.with_z(wi.z * side));
        if wi.z > 0.0 {
            self.reflected(interface, wo, wi, eta)
        } else {
            self.refracted(interface, wo, wi, eta, transport)
        }
    }

    fn reflected(self, interface: &Interface, wo: Vec3, wi: Vec3, eta: f32) -> Evaluated {
        let half = wo + wi;
        let length2 = half.length_squared();
        if length2 < f32::MIN_POSITIVE {
            return Evaluated::default();
        }
        let facet = interface.facet(0.5 * length2.sqrt(), eta);
        let Some(chance) = facet.chance_of_reflection() else { return Evaluated::default() };
        let (stretched_o, stretched_i) = (self.ggx.stretched(wo), self.ggx.stretched(wi));
        let density = self.ggx.density(half, length2);
        let shape = density * wi.z * Ggx::visibility(wo.z, stretched_o, wi.z, stretched_i);
        let value = Scattered { diffuse: Rgb::ZERO, glossy: facet.reflected * shape };
        Evaluated { value, pdf: 0.25 * chance * density * Ggx::visible(wo.z, stretched_o) }
    }

    fn refracted(
        self,
        interface: &Interface,
        wo: Vec3,
        wi: Vec3,
        eta: f32,
        transport: Transport,
    ) -> Evaluated {
        // The half vector of refraction; its length is |wo·h + η wi·h|.
        let half = wo + wi * eta;
        let length2 = half.length_squared();
        if length2 < f32::MIN_POSITIVE {
            return Evaluated::default();
        }
        let normal = half * (half.z.signum() / length2.sqrt());
        let (dot_o, dot_i) = (wo.dot(normal), -wi.dot(normal));
        if dot_o <= 0.0 || dot_i <= 0.0 {
            return Evaluated::default();
        }
        let facet = interface.facet_of(dielectric_between(dot_o, dot_i, eta));
        let Some(chance) = facet.chance_of_reflection() else { return Evaluated::default() };
        let (stretched_o, stretched_i) = (self.ggx.stretched(wo), self.ggx.stretched(wi));
        // D times the change of measure from normals to directions.
        let density = self.ggx.density(half, length2) * dot_o * dot_i * (eta * eta / length2);
        let shape = 4.0 * density * -wi.z * Ggx::visibility(wo.z, stretched_o, -wi.z, stretched_i);
        let glossy = facet.transmitted * (shape * radiance_factor(transport, eta));
        let pdf = (1.0 - chance) * density * Ggx::visible(wo.z, stretched_o);
        Evaluated { value: Scattered { diffuse: Rgb::ZERO, glossy }, pdf }
    }

    pub(super) fn draw(self, interface: &Interface, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<Drawn> {
        let eta = interface.eta(wo);
        let side = wo.z.signum();
        let above = wo.with_z(wo.z.abs());
        let half = self.ggx.sample_visible(above, u, Reach::Full);
        let chance = interface.facet(above.dot(half).max(0.0), eta).chance_of_reflection()?;
        let (wi, eta) =
            if u_lobe < chance { (reflect(above, half), 1.0) } else { (refract(above, half, eta)?, eta) };
        let right_side = if u_lobe < chance { wi.z > 0.0 } else { wi.z < 0.0 };
        right_side.then(|| Drawn { wi: wi.with_z(wi.z * side), eta, delta: None })
    }
}

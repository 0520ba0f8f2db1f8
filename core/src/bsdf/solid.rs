//! The rough surface of refracting glass (Walter et al. 2007).

use crate::bsdf::event::{Scattered, Transport};
use crate::bsdf::fresnel::dielectric_between;
use crate::bsdf::ggx::{Ggx, Reach, reflect};
use crate::bsdf::glass::{Interface, radiance_factor, refract};
use crate::bsdf::lobe::{Drawn, Evaluated, split};
use crate::bsdf::solid_between::SolidBetween;
use crate::math::colour::Rgb;
use glam::{Vec2, Vec3};

/// The rough solid's own part of `Glass`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Solid {
    ggx: Ggx,
    between: Option<SolidBetween>,
}

/// Two directions, mirrored so that `wo` is above.
struct Pair {
    wo: Vec3,
    wi: Vec3,
    /// Their stretched lengths.
    stretched: [f32; 2],
    /// Index of the far side over that of the side of `wo`.
    eta: f32,
    /// The same, in f64: its inverse seen from the other side.
    exact_eta: f64,
}

impl Solid {
    pub(super) fn new(ggx: Ggx, interface: &Interface) -> Self {
        Self { ggx, between: SolidBetween::new(ggx, interface) }
    }

    pub(super) fn evaluate(
        &self,
        interface: &Interface,
        wo: Vec3,
        wi: Vec3,
        transport: Transport,
    ) -> Evaluated {
        let stretched = [self.ggx.stretched(wo), self.ggx.stretched(wi)];
        let eta = interface.eta(wo);
        let exact_eta = interface.exact_eta(wo);
        let (above, other) = (wo.with_z(wo.z.abs()), wi.with_z(wi.z * wo.z.signum()));
        let pair = Pair { wo: above, wi: other, stretched, eta, exact_eta };
        let (mut glossy, mut pdf) =
            if pair.wi.z > 0.0 { self.reflected(interface, &pair) } else { self.refracted(interface, &pair) };
        if let Some(between) = &self.between {
            let sides = [between.side(wo.z), between.side(wi.z)];
            let missing_o = between.missing(sides[0], pair.wo.z);
            let missing_i = between.missing(sides[1], wi.z.abs());
            let (rest, pdf_rest) = between.evaluate(sides, [missing_o, missing_i], wi.z.abs());
            glossy += rest;
            pdf += (pdf_rest - pdf) * missing_o;
        }
        if pair.wi.z < 0.0 {
            glossy *= radiance_factor(transport, eta);
        }
        Evaluated { value: Scattered { diffuse: Rgb::ZERO, glossy }, pdf }
    }

    /// Flux f · cos θᵢ and density of a single scattering.
    fn reflected(&self, interface: &Interface, pair: &Pair) -> (Rgb, f32) {
        let &Pair { wo, wi, stretched: [stretched_o, stretched_i], eta, .. } = pair;
        let half = wo + wi;
        let length2 = half.length_squared();
        if length2 < f32::MIN_POSITIVE {
            return (Rgb::ZERO, 0.0);
        }
        let facet = interface.facet(0.5 * length2.sqrt(), eta);
        let Some(chance) = facet.chance_of_reflection() else { return (Rgb::ZERO, 0.0) };
        let density = self.ggx.density(half, length2);
        let shape = density * wi.z * Ggx::visibility(wo.z, stretched_o, wi.z, stretched_i);
        (facet.reflected * shape, 0.25 * chance * density * Ggx::visible(wo.z, stretched_o))
    }

    /// Flux f · |cos θᵢ| and density of a single refraction.
    fn refracted(&self, interface: &Interface, pair: &Pair) -> (Rgb, f32) {
        let &Pair { wo, wi, stretched: [stretched_o, stretched_i], eta, exact_eta } = pair;
        // The half vector of refraction; its length is |wo·h + η wi·h|. Where indices are nearly alike, or a direction is
        // nearly in the facet, f32 would know it to three digits only, and other ones from the other side.
        let (o, i) = (wo.as_dvec3(), wi.as_dvec3());
        let half = o + i * exact_eta;
        let length2 = half.length_squared();
        if length2 < f64::from(f32::MIN_POSITIVE) {
            return (Rgb::ZERO, 0.0);
        }
        let normal = half * (half.z.signum() / length2.sqrt());
        let (dot_o, dot_i) = (o.dot(normal) as f32, -i.dot(normal) as f32);
        if dot_o <= 0.0 || dot_i <= 0.0 {
            return (Rgb::ZERO, 0.0);
        }
        let facet = interface.facet_of(dielectric_between(dot_o, dot_i, eta));
        let Some(chance) = facet.chance_of_reflection() else { return (Rgb::ZERO, 0.0) };
        // D times the change of measure from normals to directions.
        let jacobian = (exact_eta * exact_eta / length2) as f32;
        let density = self.ggx.density(normal.as_vec3(), 1.0) * dot_o * dot_i * jacobian;
        let shape = 4.0 * density * -wi.z * Ggx::visibility(wo.z, stretched_o, -wi.z, stretched_i);
        (facet.transmitted * shape, (1.0 - chance) * density * Ggx::visible(wo.z, stretched_o))
    }

    pub(super) fn draw(&self, interface: &Interface, wo: Vec3, u_lobe: f32, u: Vec2) -> Option<Drawn> {
        let eta = interface.eta(wo);
        let above = wo.with_z(wo.z.abs());
        let wi = match &self.between {
            None => self.draw_single(interface, above, eta, u_lobe, u)?,
            Some(between) => {
                let side = between.side(wo.z);
                let missing = between.missing(side, above.z);
                match split(u_lobe, missing) {
                    Ok(rest) => between.draw(side, rest, u)?,
                    Err(rest) => self.draw_single(interface, above, eta, rest, u)?,
                }
            }
        };
        let eta = if wi.z > 0.0 { 1.0 } else { eta };
        Some(Drawn { wi: wi.with_z(wi.z * wo.z.signum()), eta, delta: None })
    }

    /// For `wo` above.
    fn draw_single(&self, interface: &Interface, wo: Vec3, eta: f32, u_side: f32, u: Vec2) -> Option<Vec3> {
        let half = self.ggx.sample_visible(wo, u, Reach::Full);
        let chance = interface.facet(wo.dot(half).max(0.0), eta).chance_of_reflection()?;
        if u_side < chance {
            let wi = reflect(wo, half);
            (wi.z > 0.0).then_some(wi)
        } else {
            refract(wo, half, eta).filter(|wi| wi.z < 0.0)
        }
    }
}

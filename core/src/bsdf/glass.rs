//! A transmitting dielectric: sheet or solid, smooth or rough.
//!
//! Fresnel's equations are exact here, so that reflection and refraction agree from both sides.
//! `KHR_materials_specular` rescales them linearly, to the same reflectance at normal incidence as in `Plastic`
//! and `specularFactor` at grazing; whatever is then not reflected is transmitted, times the base colour at
//! every crossing. Total internal reflection stays total. A sheet sums what is reflected between its faces,
//! R' = 2 R / (1 + R), and transmits the rest unbent.

use crate::bsdf::event::{Letter, Letters, Transport};
use crate::bsdf::fresnel::{dielectric, dielectric_at_normal, refracted_cos_squared};
use crate::bsdf::ggx::{Ggx, reflect};
use crate::bsdf::lobe::{Delta, Drawn, Evaluated};
use crate::bsdf::sheet::Sheet;
use crate::bsdf::solid::Solid;
use crate::bsdf::surface::{SurfaceParameters, Walls};
use crate::math::colour::{Rgb, luminance};
use glam::{Vec2, Vec3};

/// Refractive indices nearer to one than this are one: light passes straight through.
const SAME_MEDIUM: f32 = 1e-6;
/// Rough refraction with α |η − 1| below this is smooth: the lobe is narrower than the half vector
/// of refraction, which vanishes as η → 1, is known in f32.
const NARROWEST: f32 = 1e-5;
/// Stands for the infinite index that glTF writes as 0.
const INFINITE_INDEX: f32 = 1e4;

/// Letter `S`, or `S_M` when smooth.
#[derive(Clone, Copy, Debug)]
pub struct Glass {
    interface: Interface,
    kind: Kind,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    /// Nothing but the tint: no refractive index changes.
    Absent,
    Smooth(Walls),
    Sheet(Sheet),
    Solid(Solid),
}

/// What one (micro)facet reflects and lets through.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interface {
    /// Index of the inside over that of the outside.
    pub(super) ior: f32,
    walls: Walls,
    /// Factor of what is transmitted.
    pub(super) tint: Rgb,
    /// The reflectance is `offset` + `slope` F.
    offset: Rgb,
    slope: Rgb,
}

/// Shares of light at a facet, the tint included in `transmitted`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    pub(super) reflected: Rgb,
    pub(super) transmitted: Rgb,
}

impl Glass {
    pub(super) fn new(s: &SurfaceParameters, alpha: f32) -> Self {
        let given = if s.ior > 0.0 { s.ior.min(INFINITE_INDEX) } else { INFINITE_INDEX };
        let interface = Interface::new(s, given);
        let change = (given - 1.0).abs();
        let kind = match (Ggx::new(alpha), s.walls) {
            _ if change < SAME_MEDIUM => Kind::Absent,
            (Some(ggx), Walls::Thin) => Kind::Sheet(Sheet::new(ggx, &interface)),
            (Some(ggx), Walls::Solid) if alpha * change >= NARROWEST => {
                Kind::Solid(Solid::new(ggx, &interface))
            }
            _ => Kind::Smooth(s.walls),
        };
        Self { interface, kind }
    }

    pub(super) fn letter(&self) -> Letter {
        match self.kind {
            Kind::Absent | Kind::Smooth(_) => Letter::Specular,
            Kind::Sheet(_) | Kind::Solid(_) => Letter::Glossy,
        }
    }

    pub(super) fn letters(&self) -> Letters {
        Letters::of(self.letter())
    }

    /// Like the smooth surface, under the letter of a twin.
    pub(super) fn draw_twin(&self, wo: Vec3, u_lobe: f32, transport: Transport) -> Option<Drawn> {
        let mut drawn = self.draw_smooth(self.interface.walls, wo, u_lobe, transport)?;
        drawn.delta.iter_mut().for_each(|delta| delta.letter = Letter::Mirrored);
        Some(drawn)
    }

    /// That of the smooth surface: an estimate for choosing among lobes.
    pub(super) fn albedo(&self, wo: Vec3) -> Rgb {
        let facet = self.interface.facet(wo.z.abs(), self.interface.eta(wo));
        facet.reflected + facet.transmitted
    }

    pub(super) fn evaluate(&self, wo: Vec3, wi: Vec3, transport: Transport) -> Evaluated {
        match &self.kind {
            Kind::Absent | Kind::Smooth(_) => Evaluated::default(),
            Kind::Sheet(sheet) => sheet.evaluate(&self.interface, wo, wi),
            Kind::Solid(solid) => solid.evaluate(&self.interface, wo, wi, transport),
        }
    }

    pub(super) fn draw(&self, wo: Vec3, u_lobe: f32, u: Vec2, transport: Transport) -> Option<Drawn> {
        match &self.kind {
            Kind::Absent => Some(straight(wo, 1.0, self.interface.tint)),
            Kind::Smooth(walls) => self.draw_smooth(*walls, wo, u_lobe, transport),
            Kind::Sheet(sheet) => sheet.draw(&self.interface, wo, u_lobe, u),
            Kind::Solid(solid) => solid.draw(&self.interface, wo, u_lobe, u),
        }
    }

    fn draw_smooth(&self, walls: Walls, wo: Vec3, u_lobe: f32, transport: Transport) -> Option<Drawn> {
        let eta = self.interface.eta(wo);
        let facet = self.interface.facet(wo.z.abs(), eta);
        let mirrored = facet.chance_of_reflection()?;
        if u_lobe < mirrored {
            let delta = Delta { value: facet.reflected, probability: mirrored, letter: Letter::Specular };
            return Some(Drawn { wi: reflect(wo, Vec3::Z), eta: 1.0, delta: Some(delta) });
        }
        let probability = 1.0 - mirrored;
        if walls == Walls::Thin {
            return Some(straight(wo, probability, facet.transmitted));
        }
        let wi = refract(wo, Vec3::Z * wo.z.signum(), eta)?;
        let value = facet.transmitted * radiance_factor(transport, eta);
        let delta = Delta { value, probability, letter: Letter::Specular };
        Some(Drawn { wi, eta, delta: Some(delta) })
    }
}

fn straight(wo: Vec3, probability: f32, value: Rgb) -> Drawn {
    Drawn { wi: -wo, eta: 1.0, delta: Some(Delta { value, probability, letter: Letter::Specular }) }
}

impl Interface {
    fn new(s: &SurfaceParameters, ior: f32) -> Self {
        let f0 = dielectric_at_normal(ior);
        let wanted = (f0 * s.specular_color).min(Rgb::ONE);
        let slope = s.specular * (Rgb::ONE - wanted) / (1.0 - f0);
        Self { ior, walls: s.walls, tint: s.base_color, offset: s.specular * wanted - slope * f0, slope }
    }

    /// Whether the reflectance is Fresnel's own.
    pub(super) fn is_plain(&self) -> bool {
        (self.slope - Rgb::ONE).abs().max_element() < 1e-5 && self.offset.abs().max_element() < 1e-5
    }

    /// Index of the far side over that of the side of `wo`; a sheet is met from outside.
    #[inline]
    pub(super) fn eta(&self, wo: Vec3) -> f32 {
        if wo.z > 0.0 || self.walls == Walls::Thin { self.ior } else { 1.0 / self.ior }
    }

    /// The same without a rounding error: seen from the two sides, one is the inverse of the other.
    #[inline]
    pub(super) fn exact_eta(&self, wo: Vec3) -> f64 {
        let ior = f64::from(self.ior);
        if wo.z > 0.0 || self.walls == Walls::Thin { ior } else { 1.0 / ior }
    }

    /// For the cosine between `wo` and the facet's normal.
    #[inline]
    pub(super) fn facet(&self, cos: f32, eta: f32) -> Facet {
        let fresnel = dielectric(cos, eta);
        if fresnel >= 1.0 {
            return Facet { reflected: Rgb::ONE, transmitted: Rgb::ZERO };
        }
        self.facet_of(fresnel)
    }

    /// For Fresnel's reflectance, or a mean of it.
    #[inline]
    pub(super) fn facet_of(&self, fresnel: f32) -> Facet {
        let mut reflected = (self.offset + self.slope * fresnel).clamp(Rgb::ZERO, Rgb::ONE);
        if self.walls == Walls::Thin {
            reflected = 2.0 * reflected / (Rgb::ONE + reflected);
        }
        Facet { reflected, transmitted: (Rgb::ONE - reflected) * self.tint }
    }
}

impl Facet {
    /// In proportion to luminance; `None` where all is absorbed.
    #[inline]
    pub(super) fn chance_of_reflection(&self) -> Option<f32> {
        let (reflected, transmitted) = (luminance(self.reflected), luminance(self.transmitted));
        let total = reflected + transmitted;
        (total > 0.0).then(|| reflected / total)
    }
}

/// The direction refracted by a facet with normal `half` on the side of `wo`; `None` under total
/// internal reflection.
#[inline]
pub(super) fn refract(wo: Vec3, half: Vec3, eta: f32) -> Option<Vec3> {
    let cos = wo.dot(half);
    let squared = refracted_cos_squared(cos, eta);
    (squared > 0.0).then(|| half * (cos / eta - squared.sqrt()) - wo / eta)
}

/// Radiance is spread over a solid angle that refraction changes by η².
#[inline]
pub(super) fn radiance_factor(transport: Transport, eta: f32) -> f32 {
    match transport {
        Transport::Radiance => 1.0 / (eta * eta),
        Transport::Importance => 1.0,
    }
}

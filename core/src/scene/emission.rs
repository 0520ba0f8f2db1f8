//! Light that leaves a light: the start of a light subpath.

use crate::math::colour::Rgb;
use crate::math::frame::Frame;
use crate::math::warp;
use crate::scene::data::SceneData;
use crate::scene::emitter::mesh_order;
use crate::scene::environment::Environment;
use crate::scene::interaction::{Interaction, Side};
use crate::scene::light::Light;
use crate::scene::lights::Lights;
use crate::scene::material::Sides;
use crate::scene::punctual::PunctualKind;
use crate::trace::moment::Moment;
use crate::trace::ray::Ray;
use core::f32::consts::{FRAC_1_PI, PI};
use glam::{Vec2, Vec3};

/// A place that light starts from, chosen in proportion to the power of its light.
#[derive(Clone, Copy, Debug)]
pub struct Origin<'a> {
    /// Number of its light.
    pub light: u32,
    /// Density of the choice: of the light, times that of the place over its area (a surface) or of the direction over
    /// solid angle (an environment); the probability of the light alone otherwise.
    pub pdf: f32,
    /// Where.
    pub place: Place<'a>,
}

/// Where light starts.
#[derive(Clone, Copy, Debug)]
pub enum Place<'a> {
    /// On a surface.
    Surface(Interaction<'a>),
    /// At a point.
    Point(PunctualKind, Vec3),
    /// Infinitely far in a unit direction that was sampled, with this radiance.
    Sky(Vec3, Rgb),
    /// Infinitely far in the one direction that it has, with this irradiance at right angles.
    Sun(Vec3, Rgb),
}

/// The first edge of a light subpath.
#[derive(Clone, Copy, Debug)]
pub struct Emission {
    /// Where it goes.
    pub ray: Ray,
    /// Radiance along it, W/(sr·m²); of a point its intensity, W/sr; of a sun its irradiance, W/m².
    pub radiance: Rgb,
    /// Density of what [`Origin::pdf`] does not say: of the direction over solid angle (a surface, a point), or of the
    /// place over the area of a disk that the scene's sphere shows (light from infinitely far).
    pub pdf: f32,
    /// |cos θ| at the surface; one for other lights.
    pub cos: f64,
}

impl Lights {
    /// A place that light starts from at a moment; `None` where nothing shines there.
    pub fn origin<'a>(
        &self,
        data: &'a SceneData,
        environment: Option<&Environment>,
        moment: Moment,
        choice: f32,
        u: Vec2,
    ) -> Option<Origin<'a>> {
        let (light, probability) = self.choose(choice)?;
        let (pdf, place) = match *self.light(light) {
            Light::Triangle { instance, triangle } => {
                let barycentric = mesh_order(data, instance, warp::triangle(u));
                let at = data.emitter(instance, triangle, barycentric, moment);
                (1.0 / self.emitter(data, light, moment).area(), Place::Surface(at))
            }
            Light::Punctual(index) => match data.punctual[index as usize].at(moment) {
                kind @ (PunctualKind::Point { position, .. } | PunctualKind::Spot { position, .. }) => {
                    (1.0, Place::Point(kind, position))
                }
                PunctualKind::Directional { direction, irradiance } => {
                    (1.0, Place::Sun(-direction, irradiance))
                }
            },
            Light::Environment => {
                let environment = environment?;
                let (direction, pdf) = environment.sample(u);
                (pdf, Place::Sky(direction, environment.radiance(direction)))
            }
        };
        let pdf = pdf * probability;
        (pdf > 0.0 && pdf.is_finite()).then_some(Origin { light, pdf, place })
    }
}

/// Densities with which emission would start a path that was found otherwise.
#[derive(Clone, Copy, Debug)]
pub struct EmissionDensity {
    /// As [`Origin::pdf`].
    pub origin: f32,
    /// As [`Emission::pdf`].
    pub emission: f32,
}

impl Lights {
    /// For the light of a number at a moment, seen in the unit direction `towards`, whose surface light leaves at the cosine `cos`.
    pub fn emission_density(
        &self,
        data: &SceneData,
        environment: Option<&Environment>,
        moment: Moment,
        light: u32,
        towards: Vec3,
        cos: f64,
    ) -> EmissionDensity {
        let (origin, emission) = match *self.light(light) {
            Light::Triangle { instance, triangle } => {
                let sides = data.material(instance, triangle).sides;
                (1.0 / self.emitter(data, light, moment).area(), surface_direction_pdf(sides, cos))
            }
            Light::Punctual(index) => match &data.punctual[index as usize].kind {
                PunctualKind::Directional { .. } => (1.0, disk_pdf(data)),
                kind => (1.0, point_direction_pdf(kind)),
            },
            Light::Environment => (environment.map_or(0.0, |e| e.pdf(towards)), disk_pdf(data)),
        };
        EmissionDensity { origin: origin * self.probability(light), emission }
    }
}

impl Place<'_> {
    /// Light that leaves in a sampled direction; `None` where there is none. `lobe` is uniform in 0..1.
    pub fn emit(&self, data: &SceneData, lobe: f32, u: Vec2) -> Option<Emission> {
        let emission = match self {
            Self::Surface(at) => from_surface(at, lobe, u),
            Self::Point(kind, position) => from_point(kind, *position, u),
            Self::Sky(direction, radiance) | Self::Sun(direction, radiance) => {
                let (ray, pdf) = from_afar(data, *direction, u);
                Emission { ray, radiance: *radiance, pdf, cos: 1.0 }
            }
        };
        (emission.radiance != Vec3::ZERO && emission.pdf > 0.0 && emission.cos > 0.0).then_some(emission)
    }

    /// Whether light comes from infinitely far.
    pub fn is_distant(&self) -> bool {
        matches!(self, Self::Sky(..) | Self::Sun(..))
    }
}

/// Density of [`Place::emit`] over solid angle for a direction at the given cosine to a surface's normal.
fn surface_direction_pdf(sides: Sides, cos: f64) -> f32 {
    match sides {
        Sides::Front => warp::cosine_hemisphere_pdf(cos as f32),
        Sides::Both => 0.5 * cos as f32 * FRAC_1_PI,
    }
}

/// Density of [`Place::emit`] over the disk that the scene's sphere shows to light from infinitely far.
fn disk_pdf(data: &SceneData) -> f32 {
    let radius = disk_radius(data);
    1.0 / (PI * radius * radius)
}

/// A little more than the scene's own, so that its outermost vertices are inside.
fn disk_radius(data: &SceneData) -> f32 {
    (data.bounds.radius() * 1.000_1) as f32
}

fn from_surface(at: &Interaction<'_>, lobe: f32, u: Vec2) -> Emission {
    let side = match at.material.sides {
        Sides::Both if lobe < 0.5 => Side::Back,
        _ => Side::Front,
    };
    let normal = if side == Side::Back { -at.ng } else { at.ng };
    let local = warp::cosine_hemisphere(u);
    let direction = Frame::around(normal).to_world(local).normalize();
    // Not below: a direction that rounding turned to the other side carries nothing.
    let cos = direction.as_dvec3().dot(normal.as_dvec3());
    Emission {
        ray: Ray::new(at.leave(direction), direction),
        radiance: at.emission(side) * at.alpha(),
        pdf: surface_direction_pdf(at.material.sides, cos),
        cos,
    }
}

fn from_point(kind: &PunctualKind, position: Vec3, u: Vec2) -> Emission {
    let (direction, radiance, pdf) = match *kind {
        PunctualKind::Spot { direction: axis, intensity, inner_cos, outer_cos, .. } => {
            let local = warp::cap(u, outer_cos);
            let direction = Frame::around(axis).to_world(local).normalize();
            let share = PunctualKind::cone(inner_cos, outer_cos, direction.dot(axis));
            (direction, intensity * share, spot_pdf(outer_cos))
        }
        PunctualKind::Point { intensity, .. } => (warp::sphere(u).normalize(), intensity, 0.25 * FRAC_1_PI),
        PunctualKind::Directional { .. } => (Vec3::Z, Vec3::ZERO, 0.0),
    };
    Emission { ray: Ray::new(position, direction), radiance, pdf, cos: 1.0 }
}

/// Density of [`Place::emit`] over solid angle for light of a point or spot in a direction that it shines to.
fn point_direction_pdf(kind: &PunctualKind) -> f32 {
    match *kind {
        PunctualKind::Spot { outer_cos, .. } => spot_pdf(outer_cos),
        _ => 0.25 * FRAC_1_PI,
    }
}

fn spot_pdf(outer_cos: f32) -> f32 {
    1.0 / (2.0 * PI * (1.0 - outer_cos).max(f32::MIN_POSITIVE))
}

/// Parallel light through the scene's sphere.
fn from_afar(data: &SceneData, towards_light: Vec3, u: Vec2) -> (Ray, f32) {
    let radius = disk_radius(data);
    let frame = Frame::around(towards_light);
    let disk = warp::disk(u) * radius;
    let centre = data.bounds.centre().as_vec3();
    let origin = centre + towards_light * radius + frame.x * disk.x + frame.y * disk.y;
    (Ray::new(origin, -towards_light), disk_pdf(data))
}

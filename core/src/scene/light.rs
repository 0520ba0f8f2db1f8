//! One light, and next events towards it.

use crate::math::colour::Rgb;
use crate::math::cosine::{cosine, squared_distance};
use crate::math::spherical_triangle::SphericalTriangle;
use crate::math::warp;
use crate::scene::data::SceneData;
use crate::scene::environment::Environment;
use crate::scene::instance::Handedness;
use crate::scene::interaction::{Interaction, Side};
use crate::scene::punctual::PunctualKind;
use crate::trace::moment::Moment;
use glam::{Vec2, Vec3};

/// Below this many steradians a triangle is sampled by area: the density of directions hardly varies over it, and
/// its solid angle is no longer exact in f32.
const SOLID_ANGLE_MIN: f32 = 3e-4;
/// Above this many steradians, nearly half the sky, likewise: the arcs degenerate.
const SOLID_ANGLE_MAX: f32 = 6.22;

/// A light.
#[derive(Clone, Copy, Debug)]
pub enum Light {
    /// An emissive triangle of an instance.
    Triangle {
        /// The instance.
        instance: u32,
        /// The triangle of its mesh.
        triangle: u32,
    },
    /// A light without extent, by its place in the scene's list.
    Punctual(u32),
    /// All of the environment.
    Environment,
}

/// A next event: where light comes from, how much of it, and how likely the choice was.
#[derive(Clone, Copy, Debug)]
pub struct NextEvent {
    /// Unit direction to the light.
    pub direction: Vec3,
    /// Radiance towards the point; for a light without extent, irradiance at right angles (with `pdf` one).
    pub radiance: Rgb,
    /// Density over solid angle at the point; one for a light without extent.
    pub pdf: f32,
    /// |cos θ| at the light's surface; one for other lights.
    pub cos: f64,
    /// Squared distance; one for light from infinitely far.
    pub squared: f64,
    /// Whether directions sampled from a BSDF can find this light, too.
    pub found_by: FoundBy,
    /// Where the shadow ray ends.
    pub end: ShadowEnd,
}

/// How a light can be found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FoundBy {
    /// Next events only: it has no extent.
    NextEvent,
    /// Next events and sampled directions.
    Both,
}

/// Where a shadow ray ends.
#[derive(Clone, Copy, Debug)]
pub enum ShadowEnd {
    /// At a point that is just off the light's own surface.
    Point(Vec3),
    /// At infinity.
    Infinity,
}

impl Light {
    /// A next event from `point` at a moment with the numbers `u`; `None` where this light sends nothing there.
    pub fn sample(
        &self,
        data: &SceneData,
        environment: Option<&Environment>,
        moment: Moment,
        point: Vec3,
        u: Vec2,
    ) -> Option<NextEvent> {
        match *self {
            Self::Triangle { instance, triangle } => {
                sample_triangle(data, (instance, triangle), moment, point, u)
            }
            Self::Punctual(index) => sample_punctual(&data.punctual[index as usize].at(moment), point),
            Self::Environment => {
                let environment = environment?;
                let (direction, pdf) = environment.sample(u);
                let radiance = environment.radiance(direction);
                let found_by = FoundBy::Both;
                (pdf > 0.0 && radiance != Vec3::ZERO).then_some(NextEvent {
                    direction,
                    radiance,
                    pdf,
                    cos: 1.0,
                    squared: 1.0,
                    found_by,
                    end: ShadowEnd::Infinity,
                })
            }
        }
    }
}

/// Density over solid angle at `point` of next events towards `at`, a point of the given emissive triangle seen
/// in the unit direction `direction`.
pub fn triangle_pdf(
    data: &SceneData,
    instance: u32,
    triangle: u32,
    point: Vec3,
    at: &Interaction<'_>,
    direction: Vec3,
) -> f32 {
    let corners = data.corners(instance, triangle, at.moment);
    if let Some(spherical) = by_solid_angle(corners, point) {
        return 1.0 / spherical.solid_angle();
    }
    pdf_by_area(corners, point, at, direction)
}

/// Density over solid angle at `point` of a uniform choice over a triangle's area.
fn pdf_by_area(corners: [Vec3; 3], point: Vec3, at: &Interaction<'_>, direction: Vec3) -> f32 {
    let cos = at.ng.dot(direction).abs();
    (at.position - point).length_squared() / (cos * area(corners)).max(f32::MIN_POSITIVE)
}

fn by_solid_angle(corners: [Vec3; 3], point: Vec3) -> Option<SphericalTriangle> {
    SphericalTriangle::new(corners.map(|c| c - point))
        .filter(|s| (SOLID_ANGLE_MIN..SOLID_ANGLE_MAX).contains(&s.solid_angle()))
}

/// Area in scene units squared.
pub fn area(corners: [Vec3; 3]) -> f32 {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (0.5 * (b - a).cross(c - a).length()) as f32
}

fn sample_triangle(
    data: &SceneData,
    (instance, triangle): (u32, u32),
    moment: Moment,
    point: Vec3,
    u: Vec2,
) -> Option<NextEvent> {
    let corners = data.corners(instance, triangle, moment);
    let (barycentric, solid_angle) = match by_solid_angle(corners, point) {
        Some(spherical) => (meet(corners, point, spherical.sample(u))?, Some(spherical.solid_angle())),
        None => (warp::triangle(u), None),
    };
    let at = data.emitter(instance, triangle, mesh_order(data, instance, barycentric), moment);
    let direction = (at.position - point).try_normalize()?;
    let cos = -at.ng.dot(direction);
    let side = if cos > 0.0 { Side::Front } else { Side::Back };
    let radiance = at.emission(side) * at.alpha();
    if cos == 0.0 || radiance == Vec3::ZERO {
        return None;
    }
    let pdf = solid_angle.map_or_else(|| pdf_by_area(corners, point, &at, direction), |omega| 1.0 / omega);
    let end = ShadowEnd::Point(at.leave(-direction));
    (pdf.is_finite() && pdf > 0.0).then_some(NextEvent {
        direction,
        radiance,
        pdf,
        cos: cosine(direction, at.ng),
        squared: squared_distance(at.position, point),
        found_by: FoundBy::Both,
        end,
    })
}

/// Weights of the second and third corner as the mesh has them, from those of [`SceneData::corners`].
pub(super) fn mesh_order(data: &SceneData, instance: u32, barycentric: Vec2) -> Vec2 {
    match data.instances[instance as usize].placement.handedness() {
        Handedness::Kept => barycentric,
        Handedness::Mirrored => Vec2::new(barycentric.y, barycentric.x),
    }
}

/// Weights of the second and third corner where the line from `point` along `direction` meets the triangle's
/// plane, moved into the triangle where rounding left them outside.
fn meet(corners: [Vec3; 3], point: Vec3, direction: Vec3) -> Option<Vec2> {
    let [a, b, c] = corners;
    let (e1, e2, s) = (b - a, c - a, point - a);
    let p = direction.cross(e2);
    let determinant = e1.dot(p);
    let q = s.cross(e1);
    let w = Vec2::new(s.dot(p), direction.dot(q)) / determinant;
    let w = w.max(Vec2::ZERO);
    let sum = w.x + w.y;
    w.is_finite().then(|| if sum > 1.0 { w / sum } else { w })
}

fn sample_punctual(kind: &PunctualKind, point: Vec3) -> Option<NextEvent> {
    let towards = |position: Vec3, intensity: Rgb| {
        let to = position - point;
        let direction = to.try_normalize()?;
        let radiance = intensity / to.length_squared();
        Some((direction, radiance, ShadowEnd::Point(position)))
    };
    let squared = |end| match end {
        ShadowEnd::Point(position) => squared_distance(position, point),
        ShadowEnd::Infinity => 1.0,
    };
    let (direction, radiance, end) = match *kind {
        PunctualKind::Point { position, intensity } => towards(position, intensity)?,
        PunctualKind::Spot { position, direction: axis, intensity, inner_cos, outer_cos } => {
            let (direction, radiance, end) = towards(position, intensity)?;
            let share = PunctualKind::cone(inner_cos, outer_cos, -axis.dot(direction));
            (direction, radiance * share, end)
        }
        PunctualKind::Directional { direction, irradiance } => (-direction, irradiance, ShadowEnd::Infinity),
    };
    (radiance != Vec3::ZERO).then_some(NextEvent {
        direction,
        radiance,
        pdf: 1.0,
        cos: 1.0,
        squared: squared(end),
        found_by: FoundBy::NextEvent,
        end,
    })
}

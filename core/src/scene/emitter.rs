//! An emissive triangle as next events see it.

use crate::math::colour::Rgb;
use crate::math::cosine::{cosine, squared_distance};
use crate::math::spherical_triangle::SphericalTriangle;
use crate::math::warp;
use crate::scene::data::SceneData;
use crate::scene::instance::{Handedness, Placement};
use crate::scene::interaction::{Interaction, Side};
use crate::scene::light::{FoundBy, NextEvent, ShadowEnd};
use crate::scene::material::Sides;
use crate::trace::moment::Moment;
use crate::trace::surface_point::{Face, SurfacePoint};
use glam::{Vec2, Vec3};

/// Below this many steradians a triangle is sampled by area: the density of directions hardly varies over it, and
/// its solid angle is no longer exact in f32.
const SOLID_ANGLE_MIN: f32 = 3e-4;
/// Above this many steradians, nearly half the sky, likewise: the arcs degenerate.
const SOLID_ANGLE_MAX: f32 = 6.22;

/// An emissive triangle at a moment: all of it that does not depend on the point that is lit.
#[derive(Clone, Copy, Debug)]
pub struct Emitter {
    instance: u32,
    triangle: u32,
    /// In the scene's space, counter-clockwise seen from the front.
    corners: [Vec3; 3],
    /// The mesh's own, in its order.
    vertices: [Vec3; 3],
    face: Face,
    area: f32,
}

impl Emitter {
    /// A triangle of an instance.
    pub fn new(data: &SceneData, (instance, triangle): (u32, u32), moment: Moment) -> Self {
        let of = &data.instances[instance as usize];
        let corners = data.corners(instance, triangle, moment);
        let vertices = data.meshes[of.mesh.index()].corners(triangle, moment);
        let face = match &of.placement {
            Placement::World => Face::new(vertices, None),
            Placement::Moved(moved) => Face::new(vertices, Some(&moved.traced)),
            Placement::Moving(motion) => Face::new(vertices, Some(&motion.at(moment).traced)),
        };
        Self { instance, triangle, corners, vertices, face, area: area(corners) }
    }

    /// Area in scene units squared.
    pub fn area(&self) -> f32 {
        self.area
    }

    /// Density over solid angle at `point` of next events towards `at`, a point of the triangle seen in the unit direction
    /// `direction`.
    pub fn pdf(&self, point: Vec3, at: &Interaction<'_>, direction: Vec3) -> f32 {
        if let Some(spherical) = self.by_solid_angle(point) {
            return 1.0 / spherical.solid_angle();
        }
        self.pdf_by_area((at.position - point).length_squared(), at.ng.dot(direction).abs())
    }

    /// Density over solid angle of a uniform choice over its area, of what is seen from a squared distance under a cosine.
    fn pdf_by_area(&self, squared: f32, cos: f32) -> f32 {
        squared / (cos * self.area).max(f32::MIN_POSITIVE)
    }

    /// A next event from `point` with the numbers `u`, at the moment that the triangle is given for; `None` where nothing is
    /// sent there.
    pub fn sample(&self, data: &SceneData, moment: Moment, point: Vec3, u: Vec2) -> Option<NextEvent> {
        let (weights, solid_angle) = match self.by_solid_angle(point) {
            Some(spherical) => (self.meet(point, spherical.sample(u))?, Some(spherical.solid_angle())),
            None => (warp::triangle(u), None),
        };
        let weights = mesh_order(data, self.instance, weights);
        let at = self.at(data, weights, moment);
        let to = at.position - point;
        let direction = to.try_normalize()?;
        let cos = -at.normal.dot(direction);
        let side = if cos > 0.0 { Side::Front } else { Side::Back };
        let radiance = self.radiance(data, weights, side);
        if cos == 0.0 || radiance == Vec3::ZERO {
            return None;
        }
        let pdf =
            solid_angle.map_or_else(|| self.pdf_by_area(to.length_squared(), cos.abs()), |omega| 1.0 / omega);
        let event = NextEvent {
            direction,
            radiance,
            pdf,
            cos: cosine(direction, at.normal),
            squared: squared_distance(at.position, point),
            found_by: FoundBy::Both,
            end: ShadowEnd::Point(at.arrive(point)),
        };
        (pdf.is_finite() && pdf > 0.0).then_some(event)
    }

    fn by_solid_angle(&self, point: Vec3) -> Option<SphericalTriangle> {
        let [a, b, c] = self.corners;
        SphericalTriangle::new([a - point, b - point, c - point])
            .filter(|s| (SOLID_ANGLE_MIN..SOLID_ANGLE_MAX).contains(&s.solid_angle()))
    }

    /// The point with the given weights of the second and third vertex, in the mesh's order.
    #[inline]
    fn at(&self, data: &SceneData, weights: Vec2, moment: Moment) -> SurfacePoint {
        match &data.instances[self.instance as usize].placement {
            Placement::World => SurfacePoint::on(&self.face, self.vertices, weights, None),
            Placement::Moved(moved) => {
                SurfacePoint::on(&self.face, self.vertices, weights, Some(&moved.traced))
            }
            Placement::Moving(motion) => {
                SurfacePoint::on(&self.face, self.vertices, weights, Some(&motion.at(moment).traced))
            }
        }
    }

    /// What leaves there on a side, W/(sr·m²).
    #[inline]
    fn radiance(&self, data: &SceneData, weights: Vec2, side: Side) -> Rgb {
        let material = data.material(self.instance, self.triangle);
        if side == Side::Back && material.sides == Sides::Front {
            return Vec3::ZERO;
        }
        if material.emits_evenly() {
            return material.emission.factor;
        }
        let at = data.coordinates(self.instance, self.triangle, weights);
        material.radiance(&data.textures, &at) * material.alpha(&data.textures, &at)
    }

    /// Weights of the second and third corner where the line from `point` along `direction` meets the triangle's
    /// plane, moved into the triangle where rounding left them outside.
    fn meet(&self, point: Vec3, direction: Vec3) -> Option<Vec2> {
        let [a, b, c] = self.corners;
        let (e1, e2, s) = (b - a, c - a, point - a);
        let p = direction.cross(e2);
        let determinant = e1.dot(p);
        let q = s.cross(e1);
        let w = Vec2::new(s.dot(p), direction.dot(q)) / determinant;
        let w = w.max(Vec2::ZERO);
        let sum = w.x + w.y;
        w.is_finite().then(|| if sum > 1.0 { w / sum } else { w })
    }
}

/// Area of a triangle.
pub(super) fn area(corners: [Vec3; 3]) -> f32 {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    (0.5 * (b - a).cross(c - a).length()) as f32
}

/// Weights of the second and third corner as the mesh has them, from those of [`SceneData::corners`].
pub(super) fn mesh_order(data: &SceneData, instance: u32, barycentric: Vec2) -> Vec2 {
    match data.instances[instance as usize].placement.handedness() {
        Handedness::Kept => barycentric,
        Handedness::Mirrored => Vec2::new(barycentric.y, barycentric.x),
    }
}

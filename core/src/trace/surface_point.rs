//! Where on a surface, how exactly that is known, and which way the surface faces.

use super::instance::Instance;
use crate::math::robust::{gamma, offset_origin};
use glam::{DVec3, Vec2, Vec3};

/// A point on a triangle in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point, from barycentric weights: far more exact than origin + t · direction.
    pub position: Vec3,
    /// How far the point may be from the triangle's plane, absolute and per axis.
    pub error: Vec3,
    /// Unit normal of the triangle; counter-clockwise vertices face the viewer it points to.
    pub normal: Vec3,
}

impl SurfacePoint {
    /// The point of a mesh's triangle with these weights of its second and third vertex, as `instance` places it.
    ///
    /// The position's error is γ(7) Σ|bᵢvᵢ| (pbrt, 4th edition, eq. 6.27; that the weights are rounded moves the
    /// point within the triangle's plane but for a part of the same size, which the bound covers), carried
    /// through the transform. A normal that points to the front in the mesh does so in a mirrored instance.
    pub fn new(vertices: [Vec3; 3], barycentric: Vec2, instance: &Instance) -> Self {
        let weights = [1.0 - barycentric.x - barycentric.y, barycentric.x, barycentric.y];
        let [a, b, c] = [0, 1, 2].map(|i: usize| vertices[i] * weights[i]);
        let position = a + b + c;
        let error = gamma(7.0) * (a.abs() + b.abs() + c.abs());
        let edges = short_edges(vertices.map(Vec3::as_dvec3));
        match &instance.moved {
            None => Self { position, error, normal: unit(edges[0].cross(edges[1]), edges[0]) },
            Some(moved) => {
                let (position, error) = moved.point_outward(position, error);
                Self { position, error, normal: unit(moved.cross_outward(edges[0], edges[1]), edges[0]) }
            }
        }
    }

    /// Where a ray that leaves in `direction` must start so that it does not meet this surface again.
    pub fn leave(&self, direction: Vec3) -> Vec3 {
        offset_origin(self.position, self.error, self.normal, direction)
    }
}

/// Two edges from one corner whose cross product is the triangle's normal: those around the corner with the largest
/// angle are the shortest and lose least to cancellation.
fn short_edges([a, b, c]: [DVec3; 3]) -> [DVec3; 2] {
    let [ab, bc, ca] = [b - a, c - b, a - c];
    let [opposite_c, opposite_a, opposite_b] = [ab, bc, ca].map(DVec3::length_squared);
    if opposite_a >= opposite_b && opposite_a >= opposite_c {
        [ab, -ca]
    } else if opposite_b >= opposite_c {
        [bc, -ab]
    } else {
        [ca, -bc]
    }
}

/// The direction of `cross`; where that is zero, of anything orthogonal to `edge`: no ray meets such a triangle, but
/// nothing made of it may be NaN.
fn unit(cross: DVec3, edge: DVec3) -> Vec3 {
    let scale = cross.abs().max_element();
    if scale > 0.0 && scale.is_finite() {
        return (cross / scale).normalize().as_vec3();
    }
    edge.try_normalize().map_or(Vec3::Z, |e| e.any_orthonormal_vector().as_vec3())
}

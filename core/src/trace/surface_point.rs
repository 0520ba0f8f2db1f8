//! Where on a surface, how exactly that is known, which way the surface faces, and where rays leave it.

use super::instance::Moved;
use crate::math::robust::{gamma, offset_origin};
use glam::{DVec3, Vec2, Vec3};

/// Errors of a point that rays which leave a triangle keep away from its edges. A start is less than two of them above
/// the triangle, so a neighbour that folds back over it leaves the start on its right side if they meet at more than
/// atan(2 / 16) = 7°.
const FROM_EDGES: f64 = 16.0;

/// Most that a start is moved along its triangle, in the same unit: long thin triangles would ask for any distance.
const FARTHEST: f64 = 4.0 * FROM_EDGES;

/// Roundings of a ray's direction, which is the way to its end: in the difference, and three more where an instance is moved.
/// The distance of what lies at a ray's end is exact.
const ARRIVAL: f32 = 4.0;

/// A point on a triangle in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point, from barycentric weights: far more exact than origin + t · direction.
    pub position: Vec3,
    /// How far `position`, and where rays start, may be from the triangle's plane, absolute, on every axis.
    pub error: f32,
    /// Unit normal of the triangle; counter-clockwise vertices face the viewer it points to.
    pub normal: Vec3,
    /// `position` moved along the triangle, away from edges that are nearer than it is exact: there it may lie beyond a
    /// neighbouring triangle, and a ray from it would pass that without meeting it.
    start: Vec3,
}

impl SurfacePoint {
    /// The point of a mesh's triangle with these weights of its second and third vertex, as an instance moves it.
    ///
    /// The position's error is γ(7) Σ|bᵢvᵢ| (pbrt, 4th edition, eq. 6.27; that the weights are rounded moves the
    /// point within the triangle's plane but for a part of the same size, which the bound covers), carried through
    /// the transform. The largest axis counts for all: a triangle in the plane y = 0 has no error in y, but the
    /// distance along a ray is computed from all three, and with the axes apart 2 % of the light between a floor at
    /// 0 and a lamp near it was lost to hits on the floor itself. A normal that points to the front in the mesh does
    /// so in a mirrored instance.
    #[inline]
    pub fn new(vertices: [Vec3; 3], barycentric: Vec2, moved: Option<&Moved>) -> Self {
        Self::on(&Face::new(vertices, moved), vertices, barycentric, moved)
    }

    /// The same where the triangle's face is known.
    #[inline]
    pub fn on(face: &Face, vertices: [Vec3; 3], barycentric: Vec2, moved: Option<&Moved>) -> Self {
        let weights = Vec3::new(1.0 - barycentric.x - barycentric.y, barycentric.x, barycentric.y);
        let (position, error) = combine(vertices, weights, moved);
        let mut point = Self { position, error, normal: face.normal, start: position };
        if face.is_near_edge(weights, error) {
            point.keep_away(vertices, weights, moved);
        }
        point
    }

    #[cold]
    fn keep_away(&mut self, vertices: [Vec3; 3], weights: Vec3, moved: Option<&Moved>) {
        let weights = Edges::new(vertices, moved).moved_in(weights, f64::from(self.error));
        let (start, error) = combine(vertices, weights, moved);
        (self.start, self.error) = (start, error.max(self.error));
    }

    /// Where a ray that leaves in `direction` must start so that it does not meet this surface again and stays on this
    /// side of the neighbouring ones.
    #[inline]
    pub fn leave(&self, direction: Vec3) -> Vec3 {
        offset_origin(self.start, Vec3::splat(self.error), self.normal, direction)
    }

    /// Where a ray from `origin` must end so that it does not meet this surface: where one that goes back would start, and
    /// farther off by what rounds on the way. Without that, a lamp of a hundredth of the distance at a scene's centre, whose
    /// points are known far more exactly than rays end, hid itself from 27 % of the next events to it.
    #[inline]
    pub fn arrive(&self, origin: Vec3) -> Vec3 {
        let back = origin - self.start;
        let error = self.error + gamma(ARRIVAL) * back.abs().max_element();
        offset_origin(self.start, Vec3::splat(error), self.normal, back)
    }
}

/// A weighted mean of vertices in the world, and the bound on its error.
#[inline]
fn combine(vertices: [Vec3; 3], weights: Vec3, moved: Option<&Moved>) -> (Vec3, f32) {
    let (a, b, c) = (vertices[0] * weights.x, vertices[1] * weights.y, vertices[2] * weights.z);
    let position = a + b + c;
    let error = gamma(7.0) * (a.abs() + b.abs() + c.abs()).max_element();
    match moved {
        None => (position, error),
        Some(moved) => {
            let (position, error) = moved.point_outward(position, Vec3::splat(error));
            (position, error.max_element())
        }
    }
}

/// What all points of a triangle have in common: most of the work of finding one.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    normal: Vec3,
    /// [`FROM_EDGES`] over the height above each edge, opposite to the vertex of its index, squared.
    closeness: Vec3,
}

impl Face {
    /// That of a mesh's triangle as an instance moves it.
    #[inline]
    pub fn new(vertices: [Vec3; 3], moved: Option<&Moved>) -> Self {
        let edges = Edges::new(vertices, moved);
        let [a, b, c] = edges.squares;
        let over_area = FROM_EDGES * FROM_EDGES / edges.cross.length_squared();
        Self { normal: edges.normal(moved), closeness: (DVec3::new(a, b, c) * over_area).as_vec3() }
    }

    /// Whether a point that is known within `error` is nearer than [`FROM_EDGES`] errors to an edge.
    #[inline]
    fn is_near_edge(&self, weights: Vec3, error: f32) -> bool {
        let weights = weights.max(Vec3::ZERO);
        (weights * weights).cmplt(self.closeness * (error * error)).any()
    }
}

/// A triangle's edges in the world. Differences and transform are taken in f64, so slivers keep their shape.
struct Edges {
    /// Around the triangle, each opposite to the vertex of its index.
    around: [DVec3; 3],
    /// Squares of their lengths.
    squares: [f64; 3],
    /// Twice the triangle's area along its normal, which a mirror leaves on the other side.
    cross: DVec3,
}

impl Edges {
    #[inline]
    fn new(vertices: [Vec3; 3], moved: Option<&Moved>) -> Self {
        let [a, b, c] = vertices.map(Vec3::as_dvec3);
        let around = [c - b, a - c, b - a].map(|edge| moved.map_or(edge, |moved| moved.edge_outward(edge)));
        let squares = around.map(DVec3::length_squared);
        // The two edges around the largest angle are the shortest and lose least to cancellation.
        let longest = if squares[0] >= squares[1] && squares[0] >= squares[2] {
            0
        } else if squares[1] >= squares[2] {
            1
        } else {
            2
        };
        let cross = around[(longest + 1) % 3].cross(around[(longest + 2) % 3]);
        Self { around, squares, cross }
    }

    /// The unit normal; of a triangle without area, anything orthogonal to an edge: no ray meets such a triangle, but
    /// nothing made of it may be NaN.
    #[inline]
    fn normal(&self, moved: Option<&Moved>) -> Vec3 {
        let front = if moved.is_some_and(Moved::mirrors) { -1.0 } else { 1.0 };
        let squared = self.cross.length_squared();
        if squared.is_normal() {
            return (self.cross * (front / squared.sqrt())).as_vec3();
        }
        // The square of an area so small or so large is no number to divide by.
        let scale = self.cross.abs().max_element();
        if scale > 0.0 && scale.is_finite() {
            return (self.cross / (front * scale)).normalize().as_vec3();
        }
        let edge = self.around.iter().find_map(|edge| edge.try_normalize());
        edge.map_or(Vec3::Z, |edge| edge.any_orthonormal_vector().as_vec3())
    }

    /// Weights moved towards the triangle's centre until the point is [`FROM_EDGES`] errors from all edges; half way
    /// at most, so that the points of a small triangle do not all become one.
    fn moved_in(&self, weights: Vec3, error: f64) -> Vec3 {
        let weights = weights.as_dvec3();
        let to_centre = DVec3::splat(1.0 / 3.0) - weights;
        let area = self.cross.length();
        let mut share: f64 = 0.0;
        for i in 0..3 {
            // Distances from an edge are weights times the height above it, area / edge.
            let missing = FROM_EDGES * error * self.squares[i].sqrt() / area - weights[i];
            if missing > 0.0 {
                share = share.max(if to_centre[i] > 0.0 { missing / to_centre[i] } else { 1.0 });
            }
        }
        let way = (self.around[2] * to_centre.y - self.around[1] * to_centre.z).length();
        let share = share.min(0.5).min(FARTHEST * error / way);
        (weights + to_centre * share).as_vec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn starts_keep_away_from_edges_and_stay_in_the_triangle() {
        let vertices = [Vec3::new(8.0, 1.0, 0.0), Vec3::new(12.0, 1.0, 0.0), Vec3::new(8.0, 4.0, 0.0)];
        let error = f64::from(gamma(7.0) * 12.0);
        for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.0, 0.3), (1e-7, 0.3), (-1e-8, 0.5)]
        {
            let point = SurfacePoint::new(vertices, Vec2::new(u, v), None);
            let start = point.start.as_dvec3();
            let to_slope = (3.0 * (12.0 - start.x) - 4.0 * (start.y - 1.0)) / 5.0;
            let least = (start.x - 8.0).min(start.y - 1.0).min(to_slope);
            assert!(least > 0.5 * FROM_EDGES * error && least < 2.0 * FROM_EDGES * error, "{u} {v}: {least}");
            let moved = f64::from((point.start - point.position).length());
            assert!(moved > 0.0 && moved < 1.01 * FARTHEST * error);
            assert_eq!(point.normal, Vec3::Z);
        }
        let inside = SurfacePoint::new(vertices, Vec2::new(0.25, 0.25), None);
        assert_eq!(inside.start, inside.position);
    }

    #[test]
    fn triangles_of_no_area_give_no_nan() {
        let line = [Vec3::ZERO, Vec3::X, Vec3::X * 3.0];
        for vertices in [line, [Vec3::ZERO; 3], [Vec3::ONE; 3], [line[2], line[0], line[0]]] {
            let point = SurfacePoint::new(vertices, Vec2::new(0.1, 0.0), None);
            assert!((point.normal.length() - 1.0).abs() < 1e-6, "{vertices:?}");
            assert!(point.leave(Vec3::Y).is_finite(), "{vertices:?}");
        }
    }
}

//! Blocks of eight triangles, and the watertight test of a ray against one (Woop, Benthin, Wald 2013).

use super::lanes::{Lanes, Row, WIDTH};
use super::prepared::Prepared;
use crate::math::robust::UNIT_ROUNDOFF;
use glam::{DVec3, Vec3};

/// Up to eight triangles; lanes without one hold NaN, which no comparison lets through.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Block {
    /// Coordinates by vertex, axis and lane.
    vertices: [[Row; 3]; 3],
    /// Index of each triangle in its mesh.
    ids: [u32; WIDTH],
}

/// The lanes of a block that a ray hits, and where.
pub(super) struct Found {
    /// Bit `i` for lane `i`.
    pub(super) mask: u32,
    /// Distance in the prepared ray's units.
    pub(super) t: Row,
    /// Weights of the second vertices.
    pub(super) second: Row,
    /// Weights of the third vertices.
    pub(super) third: Row,
}

impl Block {
    /// A block of at most eight triangles, each an index and three vertices.
    pub(super) fn new(triangles: impl Iterator<Item = (u32, [Vec3; 3])>) -> Self {
        let mut block = Self { vertices: [[Row([f32::NAN; WIDTH]); 3]; 3], ids: [u32::MAX; WIDTH] };
        for (lane, (id, vertices)) in triangles.enumerate() {
            block.ids[lane] = id;
            for (rows, vertex) in block.vertices.iter_mut().zip(vertices) {
                for (row, coordinate) in rows.iter_mut().zip(vertex.to_array()) {
                    row.0[lane] = coordinate;
                }
            }
        }
        block
    }

    /// The triangle in a lane.
    #[inline]
    pub(super) fn id(&self, lane: usize) -> u32 {
        self.ids[lane]
    }

    /// The triangles hit with 0 < t ≤ `limit`.
    ///
    /// The shear sends the ray to the z axis. It may fuse, because a vertex is sheared alike in every triangle. The
    /// edge functions may not: an edge's value must be the exact negative of that in the triangle on its other side.
    #[inline(always)]
    pub(super) fn intersect<L: Lanes>(&self, ray: &Prepared, limit: f32) -> Option<Found> {
        let [kx, ky, kz] = ray.axes;
        let (ox, oy, oz) = (L::splat(ray.origin[kx]), L::splat(ray.origin[ky]), L::splat(ray.origin[kz]));
        let (sx, sy, sz) = (L::splat(ray.shear[0]), L::splat(ray.shear[1]), L::splat(ray.shear[2]));
        let sheared = |vertex: &[Row; 3]| {
            let z = L::load(&vertex[kz]).sub(oz);
            let x = sx.neg_mul_add(z, L::load(&vertex[kx]).sub(ox));
            let y = sy.neg_mul_add(z, L::load(&vertex[ky]).sub(oy));
            (x, y, z)
        };
        let (ax, ay, az) = sheared(&self.vertices[0]);
        let (bx, by, bz) = sheared(&self.vertices[1]);
        let (cx, cy, cz) = sheared(&self.vertices[2]);
        let mut u = cx.mul(by).sub(cy.mul(bx));
        let mut v = ax.mul(cy).sub(ay.mul(cx));
        let mut w = bx.mul(ay).sub(by.mul(ax));
        let zero = L::splat(0.0);
        let (least, most) = (u.min(v).min(w), u.max(v).max(w));
        let mut mask = zero.at_most(least) | most.at_most(zero);
        if mask == 0 {
            return None;
        }
        let strict = zero.below(least) | most.below(zero);
        if mask & !strict != 0 {
            let xy = [ax.store(), ay.store(), bx.store(), by.store(), cx.store(), cy.store()];
            let mut edges = [u.store(), v.store(), w.store()];
            mask &= !settle_zeros(mask & !strict, &xy, &mut edges);
            (u, v, w) = (L::load(&edges[0]), L::load(&edges[1]), L::load(&edges[2]));
        }
        let reciprocal = L::splat(1.0).div(u.add(v).add(w));
        let (first, second, third) = (u.mul(reciprocal), v.mul(reciprocal), w.mul(reciprocal));
        let mut t = third.mul_add(cz, second.mul_add(bz, first.mul(az))).mul(sz);
        let reach = |a: L, b: L, c: L| a.abs().max(b.abs()).max(c.abs());
        let volume = reach(ax, bx, cx).mul(reach(ay, by, cy)).mul(reach(az, bz, cz));
        let unsure = mask & t.abs().at_most(volume.mul(reciprocal.abs()).mul(L::splat(UNSURE)));
        if unsure != 0 {
            t = L::load(&self.settle_distances(unsure, ray, t.store()));
        }
        mask &= zero.below(t) & t.at_most(L::splat(limit));
        if mask == 0 {
            return None;
        }
        Some(Found { mask, t: t.store(), second: second.store(), third: third.store() })
    }

    /// Computes `t` of the lanes in `mask` again in f64, from the triangle's plane.
    #[cold]
    fn settle_distances(&self, mask: u32, ray: &Prepared, mut t: Row) -> Row {
        let origin = DVec3::from_array(ray.origin.map(f64::from));
        for lane in (0..WIDTH).filter(|lane| mask & (1 << lane) != 0) {
            let vertex = |v: usize| {
                DVec3::from_array([0, 1, 2].map(|axis: usize| f64::from(self.vertices[v][axis].0[lane])))
            };
            let normal = (vertex(1) - vertex(0)).cross(vertex(2) - vertex(0));
            let nearest = [vertex(0), vertex(1), vertex(2)]
                .map(|v| v - origin)
                .into_iter()
                .reduce(|a, b| if b.length_squared() < a.length_squared() { b } else { a })
                .expect("three vertices");
            let distance = normal.dot(nearest) / normal.dot(ray.direction.map(f64::from).into());
            t.0[lane] = distance as f32;
        }
        t
    }
}

/// Bound on the error of `t`, in products of the largest sheared coordinates over the sum of the edge functions: each
/// sheared coordinate is within 3 rounding errors of the largest, so an edge function is within 8 of the largest product,
/// and three of these times a depth make 24. A ray that leaves the surface is that close to it; a sliver's `t`
/// may be no better.
const UNSURE: f32 = 24.0 * UNIT_ROUNDOFF;

/// Computes the edge functions of the lanes in `mask` again in f64, where products of two floats are exact and so are
/// the signs. Returns the lanes that turn out to be missed.
#[cold]
fn settle_zeros(mask: u32, xy: &[Row; 6], edges: &mut [Row; 3]) -> u32 {
    let mut missed = 0;
    for lane in (0..WIDTH).filter(|lane| mask & (1 << lane) != 0) {
        let [ax, ay, bx, by, cx, cy] = [0, 1, 2, 3, 4, 5].map(|i: usize| f64::from(xy[i].0[lane]));
        let exact = [cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax];
        let outside = exact.iter().any(|e| *e < 0.0) && exact.iter().any(|e| *e > 0.0);
        missed |= u32::from(outside) << lane;
        for (edge, value) in edges.iter_mut().zip(exact) {
            edge.0[lane] = value as f32;
        }
    }
    missed
}

#[cfg(test)]
mod tests {
    use super::super::lanes::{Native, portable::Portable};
    use super::*;

    fn unit() -> Block {
        let vertices = [Vec3::ZERO, Vec3::X, Vec3::Y];
        Block::new([(7, vertices), (9, vertices.map(|v| v + 4.0 * Vec3::Z))].into_iter())
    }

    #[test]
    fn finds_distance_and_weights() {
        let ray = Prepared::new(Vec3::new(0.25, 0.5, -2.0), Vec3::Z).unwrap();
        let found = unit().intersect::<Native>(&ray, 10.0).unwrap();
        assert_eq!(found.mask, 0b11);
        assert_eq!((found.t.0[0], found.second.0[0], found.third.0[0]), (2.0, 0.25, 0.5));
        assert_eq!(found.t.0[1], 6.0);
        assert_eq!((unit().id(0), unit().id(1)), (7, 9));
        assert_eq!(unit().intersect::<Native>(&ray, 6.0).unwrap().mask, 0b11);
        assert_eq!(unit().intersect::<Native>(&ray, 5.0).unwrap().mask, 0b01);
        assert!(unit().intersect::<Native>(&ray, 1.0).is_none());
    }

    #[test]
    fn both_sides_edges_and_vertices_count() {
        for (x, y) in [(0.5, 0.0), (0.0, 0.5), (0.5, 0.5), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
            for side in [-1.0, 1.0] {
                let ray = Prepared::new(Vec3::new(x, y, -side), Vec3::new(0.0, 0.0, side)).unwrap();
                assert_eq!(unit().intersect::<Native>(&ray, 2.0).map(|f| f.mask), Some(1), "{x} {y} {side}");
                assert_eq!(unit().intersect::<Portable>(&ray, 2.0).map(|f| f.mask), Some(1));
            }
        }
    }

    #[test]
    fn degenerate_triangles_are_never_hit() {
        let points = [Vec3::ZERO, Vec3::ZERO, Vec3::ZERO];
        let line = [Vec3::ZERO, Vec3::X, Vec3::X * 2.0];
        let block = Block::new([(0, points), (1, line)].into_iter());
        for direction in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE, Vec3::new(-1.0, 0.5, 0.0)] {
            for target in [Vec3::ZERO, Vec3::X, Vec3::new(0.5, 0.0, 0.0)] {
                let ray = Prepared::new(target - direction * 4.0, direction).unwrap();
                assert!(block.intersect::<Native>(&ray, 100.0).is_none(), "{direction} at {target}");
            }
        }
    }
}

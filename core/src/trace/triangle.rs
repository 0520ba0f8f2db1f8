//! Blocks of eight triangles, and the watertight test of a ray against one (Woop, Benthin, Wald 2013).

use super::lanes::{Lanes, Row, WIDTH};
use super::moment::Moment;
use super::prepared::Prepared;
use crate::math::robust::UNIT_ROUNDOFF;
use glam::{DVec3, Vec3};
use std::cmp::Ordering;

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

    /// The block on its way from `before` to `after`, which hold the same triangles. Each coordinate is rounded like
    /// [`Moment::number`], so that triangles that share a vertex go on sharing it.
    #[inline(always)]
    pub(super) fn between<L: Lanes>(before: &Self, after: &Self, moment: Moment) -> Self {
        let passed = L::splat(moment.passed);
        let mut block = before.clone();
        for (rows, ends) in block.vertices.iter_mut().zip(&after.vertices) {
            for (row, end) in rows.iter_mut().zip(ends) {
                let start = L::load(row);
                *row = L::load(end).sub(start).mul_add(passed, start).store();
            }
        }
        block
    }

    /// The triangle in a lane.
    #[inline]
    pub(super) fn id(&self, lane: usize) -> u32 {
        self.ids[lane]
    }

    /// The triangles hit with 0 < t ≤ `limit`. A ray through a point that triangles share, on an edge or at a vertex,
    /// hits one of those around it (see [`settle_zeros`]).
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
        let error = volume.mul(reciprocal.abs()).mul(L::splat(UNSURE));
        let from_end = t.sub(L::splat(ray.end));
        let unsure = mask & (t.abs().at_most(error) | from_end.abs().at_most(error));
        if unsure != 0 {
            let mut row = t.store();
            let mut rest = unsure;
            while rest != 0 {
                let lane = rest.trailing_zeros() as usize & 7;
                rest &= rest - 1;
                row.0[lane] = self.exact_distance(lane, ray);
            }
            t = L::load(&row);
        }
        mask &= zero.below(t) & t.at_most(L::splat(limit));
        if mask == 0 {
            return None;
        }
        Some(Found { mask, t: t.store(), second: second.store(), third: third.store() })
    }

    /// `t` from the triangle's plane, in f64. Every ray that leaves a surface comes here once or twice, so it is
    /// written for speed.
    #[inline(never)]
    fn exact_distance(&self, lane: usize, ray: &Prepared) -> f32 {
        let lane = lane & 7;
        let origin = double(ray.origin[0], ray.origin[1], ray.origin[2]);
        let vertex = |v: &[Row; 3]| double(v[0].0[lane], v[1].0[lane], v[2].0[lane]) - origin;
        let (a, b, c) = (vertex(&self.vertices[0]), vertex(&self.vertices[1]), vertex(&self.vertices[2]));
        let normal = (b - a).cross(c - a);
        // The nearest vertex loses least to cancellation.
        let (aa, bb, cc) = (a.length_squared(), b.length_squared(), c.length_squared());
        let nearest = if aa <= bb && aa <= cc {
            a
        } else if bb <= cc {
            b
        } else {
            c
        };
        let direction = double(ray.direction[0], ray.direction[1], ray.direction[2]);
        (normal.dot(nearest) / normal.dot(direction)) as f32
    }
}

#[inline(always)]
fn double(x: f32, y: f32, z: f32) -> DVec3 {
    DVec3::new(f64::from(x), f64::from(y), f64::from(z))
}

/// Bound on the error of `t`, in products of the largest sheared coordinates over the sum of the edge functions: each
/// sheared coordinate is within 3 rounding errors of the largest, so an edge function is within 8 of the largest product,
/// and three of these times a depth make 24. A ray that leaves a surface, or ends right before one, is that close to it; a
/// sliver's `t` may be no better: of slivers a hundred-thousandth as wide as long, one lamp in four hid itself.
const UNSURE: f32 = 24.0 * UNIT_ROUNDOFF;

/// Computes the edge functions of the lanes in `mask` again in f64, where products of two floats are exact and so are
/// the signs. Returns the lanes that turn out to be missed.
///
/// What is zero even so counts as on the side where it would be if the ray passed a little beside where it does, by the
/// same (ε, −ε²) for all triangles (Edelsbrunner and Mücke 1990, "Simulation of Simplicity"). A ray in general
/// position crosses triangles that join without a gap exactly once, so this one does, wherever it passes. Positions
/// alone decide, so vertices may be listed twice. A triangle that is seen edge-on is missed.
#[cold]
fn settle_zeros(mask: u32, xy: &[Row; 6], edges: &mut [Row; 3]) -> u32 {
    let mut missed = 0;
    for lane in (0..WIDTH).filter(|lane| mask & (1 << lane) != 0) {
        let [ax, ay, bx, by, cx, cy] = [0, 1, 2, 3, 4, 5].map(|i: usize| f64::from(xy[i].0[lane]));
        let exact = [cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax];
        let around = [[bx, by, cx, cy], [cx, cy, ax, ay], [ax, ay, bx, by]];
        let sides = [0, 1, 2].map(|i: usize| side(exact[i], around[i]));
        let inside = sides[0] != Ordering::Equal && sides[0] == sides[1] && sides[1] == sides[2];
        missed |= u32::from(!inside) << lane;
        for (edge, value) in edges.iter_mut().zip(exact) {
            edge.0[lane] = value as f32;
        }
    }
    missed
}

/// The sign of an edge function, with the ray moved by (ε, −ε²) where it is zero; equal to zero where the edge is seen
/// as a point. The other way round, an edge has the other sign.
fn side(edge_function: f64, [from_x, from_y, to_x, to_y]: [f64; 4]) -> Ordering {
    let order = |a: f64, b: f64| a.partial_cmp(&b).unwrap_or(Ordering::Equal);
    order(edge_function, 0.0).then(order(to_y, from_y)).then(order(to_x, from_x))
}

#[cfg(test)]
#[expect(clippy::float_cmp, reason = "these values are exact")]
mod tests {
    use super::super::lanes::{Native, portable::Portable};
    use super::*;

    fn unit() -> Block {
        let vertices = [Vec3::ZERO, Vec3::X, Vec3::Y];
        Block::new([(7, vertices), (9, vertices.map(|v| v + 4.0 * Vec3::Z))].into_iter())
    }

    #[test]
    fn finds_distance_and_weights() {
        let ray = Prepared::new(Vec3::new(0.25, 0.5, -2.0), Vec3::Z, f32::INFINITY).unwrap();
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
    fn a_ray_through_an_edge_or_a_vertex_hits_one_of_the_triangles_around_it() {
        // Eight triangles around the origin, each with vertices of its own, that fill a square.
        let rim = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)]
            .map(|(x, y)| Vec3::new(x as f32, y as f32, 0.0));
        let mut fan = [0, 1, 2, 3, 4, 5, 6, 7].map(|i: usize| [Vec3::ZERO, rim[i], rim[(i + 1) % 8]]);
        for turns in 0..6 {
            for (i, corners) in fan.iter_mut().enumerate() {
                corners.rotate_left(usize::from(i % 3 == turns % 3));
                if turns == 3 && i % 2 == 0 {
                    corners.swap(0, 1);
                }
            }
            let block = Block::new((0..).zip(fan));
            for (x, y) in (-3..=3).flat_map(|x| (-3..=3).map(move |y| (x as f32 / 4.0, y as f32 / 4.0))) {
                for slant in [Vec3::ZERO, Vec3::new(0.5, -0.25, 0.0), Vec3::new(-0.75, 0.25, 0.0)] {
                    for direction in [Vec3::Z + slant, -Vec3::Z + slant] {
                        let ray =
                            Prepared::new(Vec3::new(x, y, 0.0) - direction * 2.0, direction, f32::INFINITY)
                                .unwrap();
                        let hits = |found: Option<Found>| found.map_or(0, |f| f.mask.count_ones());
                        let met = [
                            hits(block.intersect::<Native>(&ray, 9.0)),
                            hits(block.intersect::<Portable>(&ray, 9.0)),
                        ];
                        assert_eq!(met, [1, 1], "{x} {y} {direction}");
                    }
                }
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
                let ray = Prepared::new(target - direction * 4.0, direction, f32::INFINITY).unwrap();
                assert!(block.intersect::<Native>(&ray, 100.0).is_none(), "{direction} at {target}");
            }
        }
    }
}

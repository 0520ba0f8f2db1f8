//! What the trees answer, compared with trying every triangle; rays that other tracers lose.

use super::aggregate::Aggregate;
use super::bounds::Bounds;
use super::instance::Placement;
use super::lanes::{Lanes, Native, portable::Portable};
use super::mesh::MeshTree;
use super::prepared::Prepared;
use super::ray::{Hit, Ray};
use super::triangle::Block;
use glam::{Affine3A, EulerRot, Mat3A, Quat, Vec2, Vec3, Vec3A};
use std::cell::RefCell;

/// Numbers that look random (`SplitMix64`).
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn uniform(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1 << 24) as f32
    }

    pub(super) fn below(&mut self, n: usize) -> usize {
        ((self.uniform() * n as f32) as usize).min(n - 1)
    }

    pub(super) fn in_cube(&mut self) -> Vec3 {
        Vec3::new(self.uniform(), self.uniform(), self.uniform()) * 2.0 - 1.0
    }

    pub(super) fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.in_cube();
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }
}

/// Vertices and triangles.
#[derive(Clone)]
pub(super) struct Mesh {
    pub(super) positions: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Mesh {
    pub(super) fn corners(&self, triangle: u32) -> [Vec3; 3] {
        let corners = self.triangles.get(triangle as usize);
        corners.map_or([Vec3::ZERO; 3], |c| c.map(|v| self.positions[v as usize]))
    }

    pub(super) fn map(&self, f: impl Fn(Vec3) -> Vec3) -> Self {
        Self { positions: self.positions.iter().map(|p| f(*p)).collect(), triangles: self.triangles.clone() }
    }

    pub(super) fn tree(&self) -> MeshTree {
        MeshTree::build(&self.positions, &self.triangles).unwrap()
    }

    pub(super) fn alone(&self) -> Aggregate {
        Aggregate::build(vec![self.tree()], &[Placement { mesh: 0, to_world: Affine3A::IDENTITY }]).unwrap()
    }

    /// Triangles in no order; some without area, some twice.
    fn soup(count: usize, size: f32, random: &mut Random) -> Self {
        let mut mesh = Self { positions: Vec::new(), triangles: Vec::new() };
        for i in 0..count as u32 {
            let centre = random.in_cube();
            mesh.positions.extend([0; 3].map(|_| centre + random.in_cube() * size));
            mesh.triangles.push(match i % 40 {
                7 => [3 * i, 3 * i, 3 * i + 1],
                9 => mesh.triangles[i as usize - 1],
                _ => [3 * i, 3 * i + 1, 3 * i + 2],
            });
        }
        mesh
    }

    fn terrain(n: u32) -> Self {
        let height = |x: u32, z: u32| ((x * 7 + z * z * 3) % 11) as f32 * 0.02;
        let at =
            |x: u32, z: u32| Vec3::new(x as f32 / n as f32 - 0.5, height(x, z), z as f32 / n as f32 - 0.5);
        let positions = (0..=n).flat_map(|z| (0..=n).map(move |x| at(x, z) * 2.0)).collect();
        let quad = |x: u32, z: u32| {
            let i = z * (n + 1) + x;
            [[i, i + 1, i + n + 2], [i, i + n + 2, i + n + 1]]
        };
        Self { positions, triangles: (0..n).flat_map(|z| (0..n).flat_map(move |x| quad(x, z))).collect() }
    }

    /// A closed sphere of radius 1: an octahedron, each triangle halved in both directions `levels` times.
    pub(super) fn sphere(levels: u32) -> Self {
        let mut positions = vec![Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
        let mut triangles = Vec::new();
        for x in [0, 1] {
            for y in [2, 3] {
                triangles.extend([4, 5].map(|z| [x, y, z]));
            }
        }
        for _ in 0..levels {
            let mut middles = std::collections::BTreeMap::new();
            let mut finer = Vec::new();
            for [a, b, c] in triangles {
                let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(i, j): (u32, u32)| {
                    *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                        positions.push((positions[i as usize] + positions[j as usize]).normalize());
                        positions.len() as u32 - 1
                    })
                });
                finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
            }
            triangles = finer;
        }
        Self { positions, triangles }
    }

    pub(super) fn cube() -> Self {
        let positions =
            (0..8).map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32)).collect();
        let faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        Self { positions, triangles }
    }
}

/// Every hit on 0 < t < `t_max`, found by trying every triangle.
fn all_hits(meshes: &[Mesh], placed: &Aggregate, ray: &Ray) -> Vec<Hit> {
    let mut hits = Vec::new();
    for (instance, placement) in (0..).zip(placed.instances()) {
        let (origin, direction) = match &placement.moved {
            None => (ray.origin, ray.direction),
            Some(moved) => (moved.point_inward(ray.origin), moved.direction_inward(ray.direction)),
        };
        let Some(prepared) = Prepared::new(origin, direction, ray.t_max) else { continue };
        let mesh = &meshes[placement.mesh as usize];
        for triangle in 0..mesh.triangles.len() as u32 {
            let block = Block::new([(triangle, mesh.corners(triangle))].into_iter());
            let Some(found) = block.intersect::<Portable>(&prepared, prepared.inward(ray.t_max)) else {
                continue;
            };
            let barycentric = Vec2::new(found.second.0[0], found.third.0[0]);
            let t = prepared.outward(found.t.0[0]);
            if t < ray.t_max {
                hits.push(Hit { t, instance, triangle, barycentric });
            }
        }
    }
    hits.sort_by(|a, b| a.t.total_cmp(&b.t).then((a.instance, a.triangle).cmp(&(b.instance, b.triangle))));
    hits
}

fn odd(hit: &Hit) -> bool {
    (hit.triangle + hit.instance) % 2 == 1
}

/// All three questions, for everything and with every other triangle transparent, against `hits`.
fn check<L: Lanes>(placed: &Aggregate, ray: &Ray, hits: &[Hit]) {
    assert_eq!(placed.closest_with::<L>(ray, |_| true), hits.first().copied(), "{ray:?}");
    assert_eq!(placed.closest_with::<L>(ray, odd), hits.iter().copied().find(odd), "{ray:?}");
    assert_eq!(placed.occluded_with::<L>(ray, |_| true), !hits.is_empty(), "{ray:?}");
    assert_eq!(placed.occluded_with::<L>(ray, odd), hits.iter().any(odd), "{ray:?}");
    let met = RefCell::new(Vec::new());
    let passed = placed.transmittance_with::<L>(ray, |hit| {
        met.borrow_mut().push((hit.instance, hit.triangle));
        0.5
    });
    let mut met = met.into_inner();
    met.sort_unstable();
    let mut expected: Vec<_> = hits.iter().map(|h| (h.instance, h.triangle)).collect();
    expected.sort_unstable();
    assert_eq!(met, expected, "{ray:?}");
    assert_eq!(passed, 0.5_f32.powi(hits.len() as i32));
}

fn compare(meshes: &[Mesh], placements: &[Placement], rays: usize, random: &mut Random) {
    let placed = Aggregate::build(meshes.iter().map(Mesh::tree).collect(), placements).unwrap();
    let bounds = placed.bounds();
    let (mut some, mut none) = (0, 0);
    for _ in 0..rays {
        let reach = bounds.size().max_element();
        let origin = bounds.centre() + random.in_cube() * reach;
        let target = if random.uniform() < 0.5 {
            let placement = placements[random.below(placements.len())];
            let mesh = &meshes[placement.mesh as usize];
            let corners = mesh.corners(random.below(mesh.triangles.len().max(1)) as u32);
            placement.to_world.transform_point3((corners[0] + corners[1] + corners[2]) / 3.0)
        } else {
            bounds.centre() + random.in_cube() * reach * 0.4
        };
        let direction = target - origin;
        let length = [1.0, 1e-3, 1e5][random.below(3)];
        let t_max = if random.uniform() < 0.5 { f32::INFINITY } else { random.uniform() / length };
        let ray = Ray { t_max, ..Ray::new(origin, direction * length) };
        let hits = all_hits(meshes, &placed, &ray);
        check::<Native>(&placed, &ray, &hits);
        check::<Portable>(&placed, &ray, &hits);
        if hits.is_empty() { none += 1 } else { some += 1 }
    }
    assert!(some * 4 > rays && none * 50 > rays, "{some} rays hit, {none} do not: the test sees too little");
}

fn identity(mesh: u32) -> Placement {
    Placement { mesh, to_world: Affine3A::IDENTITY }
}

#[test]
fn soups_are_as_brute_force_finds() {
    let random = &mut Random(1);
    for (count, size) in [(1, 1.0), (5, 1.0), (60, 0.3), (2000, 0.05), (300, 1.0)] {
        let soup = Mesh::soup(count, size, random);
        compare(&[soup], &[identity(0)], 600, random);
    }
}

#[test]
fn terrain_is_as_brute_force_finds() {
    compare(&[Mesh::terrain(24)], &[identity(0)], 2000, &mut Random(2));
}

#[test]
fn instances_are_as_brute_force_finds() {
    let random = &mut Random(3);
    let meshes =
        [Mesh::soup(50, 0.3, random), Mesh::sphere(1), Mesh { positions: vec![], triangles: vec![] }];
    let mut placements = vec![identity(0), identity(2), identity(1), identity(0)];
    for i in 0..30 {
        let rotation =
            Quat::from_euler(EulerRot::XYZ, random.uniform() * 6.0, random.uniform(), random.uniform());
        let scale = (random.in_cube() + 1.5) * [0.1, 1.0, -0.3][i % 3];
        let shift = random.in_cube() * 3.0;
        let to_world = Affine3A::from_scale_rotation_translation(scale, rotation, shift);
        placements.push(Placement { mesh: (i % 2) as u32, to_world });
    }
    compare(&meshes, &placements, 1500, random);
    compare(&meshes, &placements[4..5], 300, random);
    compare(&meshes[..1], &placements[..1], 300, random);
}

#[test]
fn equally_near_hits_go_to_the_smallest_index() {
    let quad = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::ONE - Vec3::Z, Vec3::Y],
        triangles: [[0, 1, 2], [0, 2, 3]].repeat(40),
    };
    let moved = Placement { mesh: 0, to_world: Affine3A::from_translation(Vec3::new(0.0, 0.0, 4.0)) };
    let placed = Aggregate::build(vec![quad.tree()], &[moved, identity(0), identity(0)]).unwrap();
    let ray = Ray::new(Vec3::new(0.25, 0.5, -1.0), Vec3::Z);
    let hit = placed.closest(&ray, |_| true).unwrap();
    assert_eq!((hit.instance, hit.triangle), (1, 1));
    let hit = placed.closest(&ray, |h| h.triangle > 4 && h.instance != 1).unwrap();
    assert_eq!((hit.instance, hit.triangle), (2, 5));
    let diagonal = Ray::new(Vec3::new(0.5, 0.5, -1.0), Vec3::Z);
    assert!(placed.closest(&diagonal, |_| true).unwrap().triangle <= 1);
    assert_eq!(placed.transmittance(&ray, |_| 1.0), 1.0);
}

/// A sheet of triangles with diagonals in both directions, each triangle with vertices of its own: what rays find right
/// on the edges and at the vertices, where up to eight triangles meet.
#[test]
fn a_sheet_is_met_once_even_on_its_edges() {
    let (n, mut sheet) = (8, Mesh { positions: vec![], triangles: vec![] });
    let at = |x: i32, y: i32| Vec3::new(x as f32, y as f32, 0.0);
    for (x, y) in (-n..n).flat_map(|x| (-n..n).map(move |y| (x, y))) {
        let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
        let halves = if (x + y) % 2 == 0 { [[a, b, c], [c, a, d]] } else { [[d, a, b], [b, d, c]] };
        for mut half in halves {
            half.rotate_left((x + n) as usize % 3);
            let first = sheet.positions.len() as u32;
            sheet.positions.extend(half);
            sheet.triangles.push([first, first + 1, first + 2]);
        }
    }
    let turned = Affine3A::from_mat3(glam::Mat3::from_cols(Vec3::Z, -Vec3::X, Vec3::Y));
    for to_world in [Affine3A::IDENTITY, Affine3A::from_translation(Vec3::new(16.0, -2.0, 0.5)), turned] {
        let placed = Aggregate::build(vec![sheet.tree()], &[Placement { mesh: 0, to_world }]).unwrap();
        for (x, y) in (-28..=28).flat_map(|x| (-28..=28).map(move |y| (x, y))) {
            let target = Vec3::new(x as f32 / 4.0, y as f32 / 4.0, 0.0);
            for slant in
                [Vec3::ZERO, Vec3::new(0.5, 0.25, 0.0), Vec3::new(-1.0, 1.0, 0.0), Vec3::new(0.0, 4.0, 0.0)]
            {
                let direction =
                    to_world.transform_vector3(if x % 2 == 0 { Vec3::Z } else { -Vec3::Z } + slant);
                let ray = Ray::new(to_world.transform_point3(target) - direction, direction);
                let met = RefCell::new(Vec::new());
                let refuse = |hit: &Hit| {
                    met.borrow_mut().push(hit.triangle);
                    false
                };
                assert_eq!(placed.transmittance(&ray, |_| 0.6), 0.6, "{ray:?}");
                assert_eq!(placed.transmittance_with::<Portable>(&ray, |_| 0.6), 0.6, "{ray:?}");
                assert_eq!(placed.closest(&ray, refuse), None);
                assert_eq!(met.borrow().len(), 1, "{ray:?}");
                let hit = placed.closest(&ray, |_| true).unwrap();
                assert_eq!((hit.t, hit.triangle), (1.0, met.borrow()[0]), "{ray:?}");
            }
        }
    }
}

/// The triangle test beside a plain one in f64, where the ray passes clear of edges.
#[test]
fn hits_agree_with_double_precision() {
    let random = &mut Random(4);
    let mut compared = 0;
    for _ in 0..20_000 {
        let corners = [0; 3].map(|_| random.in_cube());
        let (origin, direction) = (random.in_cube() * 3.0, random.direction());
        let [a, b, c] = corners.map(|v| v.as_dvec3() - origin.as_dvec3());
        let d = direction.as_dvec3();
        let weights = [d.dot(c.cross(b)), d.dot(a.cross(c)), d.dot(b.cross(a))];
        let sum: f64 = weights.iter().sum();
        let weights = weights.map(|w| w / sum);
        let least = weights.iter().copied().fold(1.0, f64::min);
        let t = (a * weights[0] + b * weights[1] + c * weights[2]).dot(d);
        if least.abs() < 1e-4 || t.abs() < 1e-3 || sum.abs() < 1e-3 {
            continue;
        }
        compared += 1;
        let block = Block::new([(0, corners)].into_iter());
        let ray = Prepared::new(origin, direction, f32::INFINITY).unwrap();
        let found = block.intersect::<Native>(&ray, f32::MAX);
        assert_eq!(found.is_some(), least > 0.0 && t > 0.0);
        let Some(found) = found else { continue };
        // Sheared coordinates carry some 2⁻²² of the largest, 4; the division by the determinant magnifies them.
        let tolerance = 4e-6 / sum.abs();
        assert!((f64::from(ray.outward(found.t.0[0])) - t).abs() < tolerance);
        assert!((f64::from(found.second.0[0]) - weights[1]).abs() < tolerance);
        assert!((f64::from(found.third.0[0]) - weights[2]).abs() < tolerance);
    }
    assert!(compared > 15_000);
}

/// Rays from inside a closed mesh at its vertices, its edges and anywhere, of which every one must hit.
fn leaks(mesh: &Mesh, inside: impl Fn(&mut Random) -> Vec3, rays: usize, random: &mut Random) -> usize {
    let placed = mesh.alone();
    let mut leaked = 0;
    for i in 0..rays {
        let [a, b, c] = mesh.corners(random.below(mesh.triangles.len()) as u32);
        let (u, v) = (random.uniform(), random.uniform());
        let target = match i % 4 {
            0 => a,
            1 => a + (b - a) * u,
            2 => c + (a - c) * 0.5,
            _ => a + ((b - a) * u + (c - a) * (1.0 - u)) * v,
        };
        let origin = inside(random);
        let ray = Ray::new(origin, target - origin);
        if placed.closest(&ray, |_| true).is_none() || !placed.occluded(&ray, |_| true) {
            leaked += 1;
        }
    }
    leaked
}

#[test]
fn spheres_do_not_leak() {
    let random = &mut Random(5);
    let sphere = Mesh::sphere(5);
    for scale in [1e-15, 1e-6, 1.0, 1e6, 1e15] {
        let mesh = sphere.map(|p| p * scale);
        assert_eq!(
            leaks(&mesh, |r| r.direction() * r.uniform() * scale * 0.9, 300_000, random),
            0,
            "scale {scale}"
        );
        assert_eq!(leaks(&mesh, |_| Vec3::ZERO, 50_000, random), 0, "from the centre, scale {scale}");
    }
    // Coordinates at 10⁶ are multiples of 1/16: the triangles, 3 wide, keep some bits of their shape.
    for offset in [Vec3::splat(1e6), Vec3::new(-1e6, 3.0, 0.0), Vec3::new(0.0, 1e3, 1e5)] {
        let mesh = sphere.map(|p| p * 100.0 + offset);
        let inside = |r: &mut Random| r.direction() * r.uniform() * 80.0 + offset;
        assert_eq!(leaks(&mesh, inside, 300_000, random), 0, "offset {offset}");
    }
}

#[test]
fn cube_rooms_do_not_leak() {
    let random = &mut Random(6);
    for scale in [1e-6, 0.1, 1.0, 1e6] {
        for offset in [0.0, 1.0, 1000.0] {
            let room = Mesh::cube().map(|p| (p + offset) * scale);
            let inside = |r: &mut Random| ((r.in_cube() * 0.98 + 1.0) * 0.5 + offset) * scale;
            assert_eq!(leaks(&room, inside, 100_000, random), 0, "{scale} {offset}");
            // A regular grid of pixels from the middle: many rays run along the diagonals exactly.
            let (placed, eye) = (room.alone(), Vec3::splat((0.5 + offset) * scale));
            for i in 0..257 * 257 {
                let (x, y) = ((i % 257) as f32 / 128.0 - 1.0, (i / 257) as f32 / 128.0 - 1.0);
                for direction in [Vec3::new(x, y, 1.0), Vec3::new(-1.0, x, y)] {
                    assert!(placed.occluded(&Ray::new(eye, direction), |_| true), "{scale} {offset} {x} {y}");
                }
            }
        }
    }
}

#[test]
fn what_is_not_a_ray_hits_nothing() {
    let placed = Mesh::sphere(2).alone();
    let answer = |origin: Vec3, direction: Vec3, t_max: f32| {
        let ray = Ray { t_max, ..Ray::new(origin, direction) };
        let hit = placed.closest(&ray, |_| true);
        assert_eq!(hit.is_some(), placed.occluded(&ray, |_| true));
        assert_eq!(hit.is_some(), placed.transmittance(&ray, |_| 0.0) == 0.0);
        assert_eq!(hit, placed.closest_with::<Portable>(&ray, |_| true));
        hit
    };
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in 0..3 {
            let mut v = Vec3::ZERO;
            v[axis] = bad;
            assert_eq!(answer(v, Vec3::X, 10.0), None);
            assert_eq!(answer(Vec3::ZERO, v, 10.0), None);
        }
    }
    for t_max in [f32::NAN, 0.0, -0.0, -1.0, f32::NEG_INFINITY] {
        assert_eq!(answer(Vec3::ZERO, Vec3::X, t_max), None);
    }
    assert_eq!(answer(Vec3::ZERO, Vec3::new(-0.0, -0.0, -0.0), f32::INFINITY), None);
    assert_eq!(answer(Vec3::splat(1e38), Vec3::NEG_ONE, f32::INFINITY), None);
    for axis in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
        for nothing in [Vec3::ZERO, -Vec3::ZERO] {
            let hit = answer(nothing, axis + nothing, f32::INFINITY).unwrap();
            assert!((hit.t - 1.0).abs() < 1e-6);
            // Directions of any exponent, as long as t can be written.
            assert_eq!(answer(nothing, axis * 1e-37, f32::INFINITY).map(|h| h.triangle), Some(hit.triangle));
            assert_eq!(answer(nothing, axis * 3e38, f32::INFINITY).map(|h| h.triangle), Some(hit.triangle));
        }
    }
    // The surface is 10⁴⁰ lengths away, which is no float.
    assert_eq!(answer(Vec3::ZERO, Vec3::X * 1e-40, f32::INFINITY), None);
    assert!(answer(Vec3::X * (1.0 - 1e-6), Vec3::X * 1e-40, f32::INFINITY).is_some());
}

#[test]
fn nothing_is_hit_by_nothing() {
    let ray = Ray::new(Vec3::ZERO, Vec3::X);
    let empty = Mesh { positions: vec![], triangles: vec![] };
    for placed in [
        Aggregate::build(vec![], &[]).unwrap(),
        Aggregate::build(vec![empty.tree()], &[identity(0)]).unwrap(),
        Aggregate::build(vec![Mesh::cube().tree()], &[]).unwrap(),
    ] {
        assert_eq!(placed.closest(&ray, |_| true), None);
        assert!(!placed.occluded(&ray, |_| true));
        assert_eq!(placed.transmittance(&ray, |_| 0.0), 1.0);
        assert_eq!(placed.bounds(), Bounds::EMPTY);
    }
    assert!(Aggregate::build(vec![], &[identity(0)]).is_err());
    let flat = Placement { mesh: 0, to_world: Affine3A::from_scale(Vec3::new(1.0, 1.0, 0.0)) };
    assert!(Aggregate::build(vec![Mesh::cube().tree()], &[flat]).is_err());
}

#[test]
fn powers_of_two_change_no_bit() {
    let random = &mut Random(8);
    let meshes = [Mesh::soup(500, 0.2, random), Mesh::sphere(3)];
    let rotation = Mat3A::from_quat(Quat::from_rotation_y(0.3));
    let place = |scale: f32| {
        let to_world = Affine3A { matrix3: rotation, translation: Vec3A::new(0.3, 0.1, -0.2) * scale };
        let trees = meshes.iter().map(|m| m.map(|p| p * scale).tree()).collect();
        Aggregate::build(trees, &[identity(0), Placement { mesh: 1, to_world }]).unwrap()
    };
    let plain = place(1.0);
    for exponent in [-20, -3, 10, 20] {
        let scale = 2.0_f32.powi(exponent);
        let scaled = place(scale);
        for _ in 0..3000 {
            let (origin, direction) = (random.in_cube() * 2.0, random.direction());
            let ray = Ray::new(origin, direction);
            let expected = plain.closest(&ray, |_| true).map(|hit| Hit { t: hit.t * scale, ..hit });
            assert_eq!(scaled.closest(&Ray::new(origin * scale, direction), |_| true), expected);
            let stretched = Ray::new(origin * scale, direction * scale);
            assert_eq!(scaled.closest(&stretched, |_| true), plain.closest(&ray, |_| true));
            let weight = |hit: &Hit| hit.barycentric.x * 0.3 + 0.6;
            let passed = plain.transmittance(&ray, weight);
            assert_eq!(scaled.transmittance(&stretched, weight).to_bits(), passed.to_bits());
        }
    }
}

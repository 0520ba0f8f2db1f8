//! Rays that leave surfaces: they do not meet them again, and they do not get out of what is closed.

use super::aggregate::Aggregate;
use super::brute_force::{Mesh, Random};
use super::instance::Placement;
use super::ray::Ray;
use super::surface_point::SurfacePoint;
use crate::math::robust::offset_origin;
use glam::{Affine3A, EulerRot, Quat, Vec2, Vec3};

/// Leaves each of many triangles, slivers among them, from points found by rays, to both sides: how often that
/// triangle is met again, and how often it is not met by a ray that goes back.
fn wrong_departures(scale: f32, to_world: Affine3A, random: &mut Random) -> [usize; 2] {
    let mut wrong = [0, 0];
    let mut departures = 0;
    for i in 0..500 {
        let size = random.uniform() * scale;
        let shift = random.in_cube() * scale;
        let mut positions: Vec<Vec3> = (0..3).map(|_| random.in_cube() * size + shift).collect();
        if i % 3 == 0 {
            let middle = positions[0].lerp(positions[1], random.uniform());
            positions[2] = middle.lerp(positions[2], [1e-1, 1e-3, 1e-5][i % 9 / 3]);
        }
        let mesh = Mesh { positions, triangles: vec![[0, 1, 2]] };
        let placed = Aggregate::build(vec![mesh.tree()], &[Placement { mesh: 0, to_world }]).unwrap();
        let (u, v) = (random.uniform(), random.uniform());
        let [a, b, c] = mesh.corners(0);
        let target = to_world.transform_point3(a + ((b - a) * u + (c - a) * (1.0 - u)) * v);
        let start = to_world.transform_point3(random.in_cube() * scale * 4.0);
        let Some(hit) = placed.closest(&Ray::new(start, target - start), |_| true) else { continue };
        let point = SurfacePoint::new([a, b, c], hit.barycentric, placed.instances()[0].moved.as_ref());
        departures += 1;
        for i in 0..200 {
            let mut direction = random.direction();
            if i % 2 == 0 {
                // Grazing.
                direction = (direction - point.normal * direction.dot(point.normal) * 0.9999).normalize();
            }
            let ray = Ray::new(point.leave(direction), direction);
            wrong[0] += usize::from(placed.closest(&ray, |_| true).is_some());
        }
        let inside = hit.barycentric.min_element().min(1.0 - hit.barycentric.element_sum()) > 0.1;
        if inside && i % 3 != 0 {
            for side in [point.normal, -point.normal] {
                wrong[1] += usize::from(!placed.occluded(&Ray::new(point.leave(side), -side), |_| true));
            }
        }
    }
    assert!(departures > 200);
    wrong
}

#[test]
fn rays_do_not_meet_the_surface_they_leave() {
    let random = &mut Random(7);
    for scale in [1e-8, 1e-4, 1.0, 1e4, 1e8] {
        assert_eq!(wrong_departures(scale, Affine3A::IDENTITY, random), [0, 0], "scale {scale}");
        let rotation =
            Quat::from_euler(EulerRot::XYZ, random.uniform() * 6.0, random.uniform(), random.uniform());
        let scales = Vec3::new(0.7, -3.0, 1.3);
        let shift = random.in_cube() * scale * 5.0;
        let to_world = Affine3A::from_scale_rotation_translation(scales, rotation, shift);
        assert_eq!(wrong_departures(scale, to_world, random), [0, 0], "moved, scale {scale}");
    }
}

/// A solid around the origin, its triangles counter-clockwise from outside: a polygon that the origin sees all of, at two
/// heights, and middles above and below it. Where the heights are one, the polygon is an edge.
fn solid(rim: &[(f32, f32)], heights: [f32; 2], middles: [f32; 2]) -> Mesh {
    let n = rim.len() as u32;
    let flat = heights[0] == heights[1];
    let mut positions: Vec<Vec3> = rim.iter().map(|(x, y)| Vec3::new(*x, *y, heights[0])).collect();
    if !flat {
        positions.extend(rim.iter().map(|(x, y)| Vec3::new(*x, *y, heights[1])));
    }
    let upper = if flat { 0 } else { n };
    let [low, high] = [0, 1].map(|i| positions.len() as u32 + i);
    positions.extend(middles.map(|z| Vec3::Z * z));
    let mut triangles = Vec::new();
    for (i, j) in (0..n).map(|i| (i, (i + 1) % n)) {
        triangles.extend([[low, j, i], [high, upper + i, upper + j]]);
        if !flat {
            triangles.extend([[i, j, upper + j], [i, upper + j, upper + i]]);
        }
    }
    Mesh { positions, triangles }
}

/// A star whose points are this wide, in radians; its other corners are as far in as that takes.
fn star(points: u32, width: f32) -> Vec<(f32, f32)> {
    let half = std::f32::consts::PI / points as f32;
    // In the triangle of the middle, a point and the corner beside it.
    let inner = libm::sinf(width / 2.0) / libm::sinf(half + width / 2.0);
    let corner = |i: u32| {
        let (sin, cos) = libm::sincosf(i as f32 * half);
        let radius = if i.is_multiple_of(2) { 1.0 } else { inner };
        (radius * cos, radius * sin)
    };
    (0..2 * points).map(corner).collect()
}

/// Weights of a triangle's second and third vertex: anywhere, or beside an edge or a vertex as closely as floats reach.
fn weights_near_edges(random: &mut Random) -> Vec2 {
    let mut small = || {
        let size = [0.0, 1e-8, 1e-7, 1e-6, 1e-5, 1e-3][random.below(6)];
        size * random.uniform()
    };
    let (first, second) = (small(), small());
    let along = random.uniform();
    let mut weights = match random.below(4) {
        0 => [along, (1.0 - along) * random.uniform(), 0.0],
        1 => [1.0 - first - second, first, second],
        _ => [(1.0 - first) * along, (1.0 - first) * (1.0 - along), first],
    };
    weights[2] = 1.0 - weights[0] - weights[1];
    weights.rotate_left(random.below(3));
    Vec2::new(weights[1], weights[2])
}

/// Walks that start at edges on one side of a closed surface and are reflected by it again and again, and that
/// many steps in all: how many get to the other side.
fn walks_that_cross(
    mesh: &Mesh,
    to_world: Affine3A,
    leave: impl Fn(&SurfacePoint, Vec3) -> Vec3,
    steps: u32,
    random: &mut Random,
) -> u32 {
    let placed = Aggregate::build(vec![mesh.tree()], &[Placement { mesh: 0, to_world }]).unwrap();
    let moved = placed.instances()[0].moved.as_ref();
    let mut crossed = 0;
    let mut walked = 0;
    while walked < steps {
        let mut triangle = random.below(mesh.triangles.len()) as u32;
        let mut barycentric = weights_near_edges(random);
        let side = if random.uniform() < 0.8 { -1.0 } else { 1.0 };
        let mut incoming = random.direction();
        for _ in 0..12 {
            walked += 1;
            let point = SurfacePoint::new(mesh.corners(triangle), barycentric, moved);
            let normal = point.normal * side;
            let across = normal * incoming.dot(normal);
            let mut direction = match random.below(4) {
                0 => incoming - across * 1.999,
                1 => incoming - across * 2.0,
                _ => random.direction(),
            };
            direction =
                (direction + normal * (direction.dot(normal).abs() - direction.dot(normal))).normalize();
            if direction.dot(normal) < 1e-6 {
                break;
            }
            let ray = Ray::new(leave(&point, direction), direction);
            let hit = placed.closest(&ray, |_| true);
            let Some(hit) = hit else {
                crossed += u32::from(side < 0.0);
                break;
            };
            let met = SurfacePoint::new(mesh.corners(hit.triangle), hit.barycentric, moved);
            let cos = met.normal.as_dvec3().dot(direction.as_dvec3()) * f64::from(side);
            if cos.abs() < 1e-6 {
                break;
            }
            if cos > 0.0 {
                crossed += 1;
                break;
            }
            (triangle, barycentric, incoming) = (hit.triangle, hit.barycentric, direction);
        }
    }
    crossed
}

#[test]
fn walks_stay_on_their_side_of_closed_surfaces() {
    let random = &mut Random(9);
    let square = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
    let degrees = |angle: f32| angle.to_radians();
    let solids = [
        ("cube", solid(&square, [-1.0, 1.0], [-1.0, 1.0])),
        ("octahedron", solid(&square, [0.0, 0.0], [-1.0, 1.0])),
        ("hollowed cube", solid(&square, [-1.0, 1.0], [-0.1, 0.2])),
        ("star", solid(&star(5, degrees(36.0)), [-0.5, 0.5], [-0.5, 0.5])),
        ("sharp star", solid(&star(6, degrees(12.0)), [-0.5, 0.5], [-0.5, 0.5])),
        ("spindle", solid(&star(5, degrees(36.0)), [0.0, 0.0], [-2.0, 1.0])),
        ("lens", solid(&star(9, degrees(150.0)), [0.0, 0.0], [-0.2, 0.2])),
    ];
    let away = SurfacePoint::leave;
    for (name, mesh) in &solids {
        for offset in [Vec3::ZERO, Vec3::new(3.0, -20.0, 0.7)] {
            let turn = Quat::from_euler(EulerRot::XYZ, 0.3, 1.1, -0.7);
            let turned = mesh.map(|p| turn * p + offset);
            let shifted = mesh.map(|p| p + offset);
            let still = Affine3A::IDENTITY;
            assert_eq!(walks_that_cross(&shifted, still, away, 150_000, random), 0, "{name} at {offset}");
            assert_eq!(
                walks_that_cross(&turned, still, away, 150_000, random),
                0,
                "{name} at {offset}, turned"
            );
            let to_world = Affine3A::from_scale_rotation_translation(Vec3::new(1.1, 1.0, 1.3), turn, offset);
            assert_eq!(
                walks_that_cross(mesh, to_world, away, 150_000, random),
                0,
                "{name} at {offset}, moved"
            );
        }
    }
    // What these walks can find: they cross where they start right above the point that was hit.
    let above = |point: &SurfacePoint, direction: Vec3| {
        offset_origin(point.position, Vec3::splat(point.error), point.normal, direction)
    };
    for (name, mesh) in &solids {
        assert!(walks_that_cross(mesh, Affine3A::IDENTITY, above, 150_000, random) > 10, "{name}");
    }
}

/// Rays from anywhere to a triangle of the given size and distance from the origin, `width` as wide as long: how often one that
/// ends before the triangle meets it, and how often one that ends behind it does not.
fn wrong_arrivals([size, away, width]: [f32; 3], to_world: Affine3A, random: &mut Random) -> [usize; 2] {
    let mut wrong = [0, 0];
    for _ in 0..1000 {
        let shift = random.in_cube() * away;
        let mut positions: Vec<Vec3> = (0..3).map(|_| random.in_cube() * size + shift).collect();
        let middle = positions[0].lerp(positions[1], random.uniform());
        positions[2] = middle.lerp(positions[2], width);
        let mesh = Mesh { positions, triangles: vec![[0, 1, 2]] };
        let placed = Aggregate::build(vec![mesh.tree()], &[Placement { mesh: 0, to_world }]).unwrap();
        for _ in 0..20 {
            let (u, v) = (random.uniform(), random.uniform());
            let weights = Vec2::new(u * (1.0 - v), v);
            let point = SurfacePoint::new(mesh.corners(0), weights, placed.instances()[0].moved.as_ref());
            let origin = random.in_cube();
            let end = point.arrive(origin);
            let until = |end: Vec3| Ray { t_max: 1.0, ..Ray::new(origin, end - origin) };
            wrong[0] += usize::from(placed.occluded(&until(end), |_| true));
            let is_steep = (end - origin).normalize().dot(point.normal).abs() > 0.1;
            if is_steep && width == 1.0 && size == 1.0 && weights.min_element() > 0.1 && u < 0.9 {
                let behind = end + (point.position - end) * 2.5;
                wrong[1] += usize::from(!placed.occluded(&until(behind), |_| true));
            }
        }
    }
    wrong
}

#[test]
fn rays_do_not_meet_the_surface_they_end_at() {
    let random = &mut Random(11);
    for (size, away) in [(1.0, 1.0), (0.1, 1.0), (1e-3, 1.0), (1.0, 0.0), (0.01, 0.0), (1e-4, 0.0)] {
        for width in [1.0, 1e-2, 1e-4] {
            let still = wrong_arrivals([size, away, width], Affine3A::IDENTITY, random);
            assert_eq!(still, [0, 0], "size {size}, {away} away, width {width}");
            let turn = Quat::from_euler(EulerRot::XYZ, 0.3, 1.1, -0.7);
            let scales = Vec3::new(1.1, 0.3, -1.3);
            let to_world = Affine3A::from_scale_rotation_translation(scales, turn, random.in_cube() * away);
            let moved = wrong_arrivals([size, away, width], to_world, random);
            assert_eq!(moved, [0, 0], "size {size}, {away} away, width {width}, moved");
        }
    }
}

//! Tangents for normal maps of meshes that bring none.

use crate::gltf::geometry::Geometry;
use glam::{DVec2, DVec3, Vec3, Vec4};
use std::cmp::Ordering;

/// Computes tangents from positions, normals and the given texture coordinates.
///
/// As `MikkTSpace` has it, corners of the same position, normal and coordinates share a tangent if their
/// triangles are laid out the same way round; a vertex where the layout turns over is split in two. The
/// shared tangent is the mean of ∂position/∂u over the triangles around, weighted by the corner's angle.
/// What has no layout at all gets no tangent and no bump.
pub(crate) fn compute(geometry: &mut Geometry, set: usize) {
    split_mirrored(geometry, set);
    let group = weld(geometry, set);
    let groups = group.iter().max().map_or(0, |&g| g as usize + 1);
    let mut sums = vec![DVec3::ZERO; groups];
    let mut signs = vec![1.0_f32; groups];
    for triangle in &geometry.triangles {
        let Some(layout) = layout(geometry, set, *triangle) else {
            continue;
        };
        let p = triangle.map(|v| geometry.positions[v as usize].as_dvec3());
        for corner in 0..3 {
            let (a, b) = (p[(corner + 1) % 3] - p[corner], p[(corner + 2) % 3] - p[corner]);
            let angle = libm::atan2(a.cross(b).length(), a.dot(b));
            let into = group[triangle[corner] as usize] as usize;
            sums[into] += layout.tangent * angle;
            signs[into] = layout.sign;
        }
    }
    let normal = |v: usize| geometry.normals.get(v).copied().unwrap_or(Vec3::ZERO).as_dvec3();
    geometry.tangents = (0..geometry.positions.len())
        .map(|v| {
            let (sum, n) = (sums[group[v] as usize], normal(v));
            let tangent = (sum - n * n.dot(sum)).normalize_or_zero().as_vec3();
            if tangent == Vec3::ZERO { Vec4::ZERO } else { tangent.extend(signs[group[v] as usize]) }
        })
        .collect();
}

struct Layout {
    /// Unit ∂position/∂u.
    tangent: DVec3,
    /// −1 where u and v run the other way round. Texture v points down: a picture that is not mirrored has
    /// its bitangent along −v, and the sign is that of −det.
    sign: f32,
}

/// How a triangle is laid out; `None` where its coordinates span no area.
fn layout(geometry: &Geometry, set: usize, triangle: [u32; 3]) -> Option<Layout> {
    let [a, b, c] = triangle.map(|v| geometry.positions[v as usize].as_dvec3());
    let [u, v, w] = triangle.map(|v| {
        let uv = geometry.uvs[set][v as usize];
        DVec2::new(f64::from(uv.x), f64::from(uv.y))
    });
    let (e1, e2, d1, d2) = (b - a, c - a, v - u, w - u);
    let det = d1.x * d2.y - d2.x * d1.y;
    if det == 0.0 || !det.is_finite() {
        return None;
    }
    let sign = 1.0_f64.copysign(det);
    let tangent = ((e1 * d2.y - e2 * d1.y) * sign).try_normalize()?;
    Some(Layout { tangent, sign: -sign as f32 })
}

/// Gives triangles laid out the other way round vertices of their own.
fn split_mirrored(geometry: &mut Geometry, set: usize) {
    const PLAIN: u8 = 1;
    const MIRRORED: u8 = 2;
    let vertices = geometry.positions.len();
    let mut seen = vec![0_u8; vertices];
    let sides: Vec<u8> = (geometry.triangles.iter())
        .map(|t| match layout(geometry, set, *t) {
            Some(layout) if layout.sign < 0.0 => MIRRORED,
            Some(_) => PLAIN,
            None => 0,
        })
        .collect();
    for (triangle, side) in geometry.triangles.iter().zip(&sides) {
        for &v in triangle {
            seen[v as usize] |= side;
        }
    }
    let mut twin = vec![u32::MAX; vertices];
    for (i, side) in sides.iter().enumerate() {
        if *side != MIRRORED {
            continue;
        }
        for corner in 0..3 {
            let v = geometry.triangles[i][corner] as usize;
            if seen[v] == PLAIN | MIRRORED {
                if twin[v] == u32::MAX {
                    twin[v] = geometry.duplicate(v);
                }
                geometry.triangles[i][corner] = twin[v];
            }
        }
    }
}

/// A group for each vertex: same position, normal, coordinates and way round, same group. Vertices of the
/// other way round differ already.
fn weld(geometry: &Geometry, set: usize) -> Vec<u32> {
    let mut mirrored = vec![false; geometry.positions.len()];
    for triangle in &geometry.triangles {
        if layout(geometry, set, *triangle).is_some_and(|l| l.sign < 0.0) {
            for &v in triangle {
                mirrored[v as usize] = true;
            }
        }
    }
    let key = |v: u32| {
        let i = v as usize;
        let normal = geometry.normals.get(i).copied().unwrap_or(Vec3::ZERO);
        let uv = geometry.uvs[set][i];
        (geometry.positions[i].to_array(), normal.to_array(), uv.to_array(), mirrored[i])
    };
    let compare = |a: &u32, b: &u32| {
        let (a, b) = (key(*a), key(*b));
        let numbers = |k: &([f32; 3], [f32; 3], [f32; 2], bool)| {
            [k.0[0], k.0[1], k.0[2], k.1[0], k.1[1], k.1[2], k.2[0], k.2[1]]
        };
        let order = numbers(&a).iter().zip(numbers(&b)).map(|(x, y)| x.total_cmp(&y)).find(|o| o.is_ne());
        order.unwrap_or(Ordering::Equal).then(a.3.cmp(&b.3))
    };
    let mut order: Vec<u32> = (0..geometry.positions.len() as u32).collect();
    order.sort_unstable_by(compare);
    let mut group = vec![0; order.len()];
    let mut current = 0;
    for pair in 0..order.len() {
        if pair > 0 && compare(&order[pair - 1], &order[pair]).is_ne() {
            current += 1;
        }
        group[order[pair] as usize] = current;
    }
    group
}

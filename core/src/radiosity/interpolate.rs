//! From one value an element to one that varies over it without steps.
//!
//! Elements that meet in a point and lean about the same way there share a vertex, whose value is the mean of theirs.
//! Where finer elements put a vertex on the edge of a coarser one, it takes the mean of that edge's ends.

use crate::math::colour::Rgb;
use crate::radiosity::element::Element;
use crate::radiosity::patch::{Patch, Patches, midpoint};
use crate::scene::data::SceneData;
use crate::trace::moment::Moment;
use glam::{DVec3, Vec2, Vec3};

/// Cosine of the angle, 25°, up to which surfaces that meet count as one.
const ALIKE: f32 = 0.906;
/// Most vertices that are looked for on an edge, as a power of two.
const HALVINGS_MAX: u32 = 12;

/// The vertices of all elements.
#[derive(Clone, Debug)]
pub struct Vertices {
    /// The vertices of each element's corners.
    of: Vec<[u32; 3]>,
    /// Vertices by place, in ascending order of the place.
    places: Vec<Place>,
    /// Vertices on the edges of coarser elements, with the edges' ends, long edges first.
    hanging: Vec<[u32; 3]>,
    count: usize,
}

#[derive(Clone, Copy, Debug)]
struct Place {
    bits: [u32; 3],
    normal: Vec3,
    vertex: u32,
}

/// A place as what it is compared by; zero has one sign.
fn bits(place: Vec3) -> [u32; 3] {
    place.to_array().map(|v| (v + 0.0).to_bits())
}

/// The unit normal at a corner of an element, on its side. Bumps of a normal map do not count.
fn normal(data: &SceneData, patch: &Patch, corner: usize, sign: f32) -> Vec3 {
    let at = data.interaction(patch.instance, patch.triangle, patch.weights[corner], Moment::STILL);
    let normal = if at.material.normal.is_some() { at.ng } else { at.shading.z };
    normal * sign
}

impl Vertices {
    /// Finds them.
    pub fn new(data: &SceneData, patches: &Patches) -> Self {
        let elements = 2 * patches.all().len() as u32;
        let mut corners: Vec<([u32; 3], u32, usize)> = (0..elements)
            .flat_map(|e| {
                let patch = &patches.all()[Element(e).patch().index()];
                (0..3).map(move |c| (bits(patch.corners[c]), e, c))
            })
            .collect();
        corners.sort_unstable();
        let mut vertices =
            Self { of: vec![[0; 3]; elements as usize], places: Vec::new(), hanging: Vec::new(), count: 0 };
        for here in corners.chunk_by(|a, b| a.0 == b.0) {
            let first = vertices.places.len();
            for &(bits, e, c) in here {
                let element = Element(e);
                let normal = normal(data, &patches.all()[element.patch().index()], c, element.sign());
                let known = vertices.places[first..].iter().find(|p| p.normal.dot(normal) > ALIKE);
                let vertex = known.map_or(vertices.count as u32, |place| place.vertex);
                if known.is_none() {
                    vertices.places.push(Place { bits, normal, vertex });
                    vertices.count += 1;
                }
                vertices.of[e as usize][c] = vertex;
            }
        }
        vertices.find_hanging(data, patches);
        vertices
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The vertices of an element's corners, in the order of its patch's.
    pub fn of(&self, element: Element) -> [u32; 3] {
        self.of[element.index()]
    }

    fn at(&self, place: Vec3, normal: Vec3) -> Option<u32> {
        let wanted = bits(place);
        let first = self.places.partition_point(|p| p.bits < wanted);
        let here = self.places[first..].iter().take_while(|p| p.bits == wanted);
        here.into_iter().find(|p| p.normal.dot(normal) > ALIKE).map(|p| p.vertex)
    }

    fn find_hanging(&mut self, data: &SceneData, patches: &Patches) {
        let mut found: Vec<(f32, [u32; 3])> = Vec::new();
        for e in 0..self.of.len() as u32 {
            for edge in 0..3 {
                self.split(data, patches, Element(e), edge, &mut |length, vertices, _| {
                    found.push((length, vertices));
                });
            }
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        found.dedup();
        self.hanging = found.into_iter().map(|(_, vertices)| vertices).collect();
    }

    /// Calls `tell` with every vertex that finer elements put on an edge (from corner `edge` to the next): length of
    /// the part that it halves, itself and the part's ends, and where along the edge it is.
    fn split(
        &self,
        data: &SceneData,
        patches: &Patches,
        element: Element,
        edge: usize,
        tell: &mut impl FnMut(f32, [u32; 3], f32),
    ) {
        let patch = &patches.all()[element.patch().index()];
        let next = (edge + 1) % 3;
        let normals = [edge, next].map(|c| normal(data, patch, c, element.sign()));
        let ends = self.of[element.index()];
        let mut parts =
            vec![(patch.corners[edge], patch.corners[next], [ends[edge], ends[next]], [0.0_f32, 1.0], 0)];
        while let Some((a, b, [va, vb], [ta, tb], depth)) = parts.pop() {
            let (middle, t) = (midpoint(a, b), 0.5 * (ta + tb));
            let lean = normals[0].lerp(normals[1], t).normalize_or(normals[0]);
            let Some(vertex) = self.at(middle, lean).filter(|v| *v != va && *v != vb) else { continue };
            tell((b - a).length(), [vertex, va, vb], t);
            if depth < HALVINGS_MAX {
                parts.push((a, middle, [va, vertex], [ta, t], depth + 1));
                parts.push((middle, b, [vertex, vb], [t, tb], depth + 1));
            }
        }
    }

    /// Vertices along the three edges of an element, its corners included, in order around it, each with the weights of
    /// its second and third corner.
    pub fn around(&self, data: &SceneData, patches: &Patches, element: Element) -> Vec<(u32, Vec2)> {
        let corners = [Vec2::ZERO, Vec2::X, Vec2::Y];
        let mut around = Vec::new();
        for edge in 0..3 {
            let mut on_edge = vec![(0.0, self.of[element.index()][edge])];
            self.split(data, patches, element, edge, &mut |_, [vertex, _, _], t| on_edge.push((t, vertex)));
            on_edge.sort_by(|a, b| a.0.total_cmp(&b.0));
            let (from, to) = (corners[edge], corners[(edge + 1) % 3]);
            around.extend(on_edge.into_iter().map(|(t, vertex)| (vertex, from.lerp(to, t))));
        }
        around
    }

    /// The value of each vertex, from those of the elements.
    pub fn values(&self, patches: &Patches, elements: &[DVec3]) -> Vec<Rgb> {
        let mut sums = vec![(DVec3::ZERO, 0.0); self.count];
        for (e, (vertices, value)) in self.of.iter().zip(elements).enumerate() {
            let patch = &patches.all()[Element(e as u32).patch().index()];
            for (corner, vertex) in vertices.iter().enumerate() {
                let weight = weight(patch, corner);
                let (sum, whole) = &mut sums[*vertex as usize];
                *sum += *value * weight;
                *whole += weight;
            }
        }
        let mut values: Vec<Rgb> = sums.into_iter().map(|(sum, whole)| (sum / whole).as_vec3()).collect();
        for &[vertex, a, b] in &self.hanging {
            values[vertex as usize] = (values[a as usize] + values[b as usize]) * 0.5;
        }
        values
    }
}

/// What an element counts at its corner: the more the wider its angle there and the nearer its middle.
fn weight(patch: &Patch, corner: usize) -> f64 {
    let p = patch.corners.map(Vec3::as_dvec3);
    let (here, next, last) = (p[corner], p[(corner + 1) % 3], p[(corner + 2) % 3]);
    let (a, b) = (next - here, last - here);
    let angle = libm::atan2(a.cross(b).length(), a.dot(b));
    angle.max(1e-6) / (a + b).length().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::instance::{Instance, Placement};
    use crate::scene::material::{Material, MaterialId};
    use crate::scene::mesh::{Mesh, MeshId};

    /// A square and, at right angles on its edge x = 1, another.
    fn corner() -> SceneData {
        let p = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 1], [1, 1, 1]];
        let mesh = Mesh {
            positions: p.map(|p| Vec3::from_array(p.map(|v| v as f32))).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]],
            materials: vec![MaterialId(0); 4],
            ..Mesh::default()
        };
        let instance = Instance { mesh: MeshId(0), name: String::new(), placement: Placement::World };
        let materials = vec![Material::default()];
        SceneData { meshes: vec![mesh], instances: vec![instance], materials, ..SceneData::empty() }
    }

    #[test]
    fn sides_and_creases_are_kept_apart_and_coplanar_triangles_are_not() {
        let data = corner();
        let patches = Patches::of_triangles(&data);
        let vertices = Vertices::new(&data, &patches);
        // Four corners of each square on each of its sides.
        assert_eq!(vertices.count(), 16);
        let front = |p: u32| vertices.of(Element(2 * p));
        assert_eq!(front(0)[0], front(1)[0]);
        assert_eq!(front(0)[2], front(1)[1]);
        assert_ne!(front(0)[1], front(2)[0]);
        assert_ne!(front(0)[1], vertices.of(Element(1))[1]);
    }

    #[test]
    fn a_fine_patch_beside_a_coarse_one_leaves_no_step() {
        let data = corner();
        let mut patches = Patches::of_triangles(&data);
        patches.cut(&[true, false, false, false]);
        let first = patches.at(0, 0, Vec2::new(0.1, 0.1)).0.index();
        let chosen: Vec<bool> = (0..patches.all().len()).map(|i| i == first).collect();
        patches.cut(&chosen);
        let vertices = Vertices::new(&data, &patches);
        let elements: Vec<DVec3> =
            (0..2 * patches.all().len()).map(|e| DVec3::splat((e * e % 17) as f64)).collect();
        let values = vertices.values(&patches, &elements);
        let at = |triangle: u32, weights: Vec2| {
            let (patch, local) = patches.at(0, triangle, weights);
            let v = vertices.of(Element(2 * patch.0)).map(|v| values[v as usize]);
            v[0] * (1.0 - local.x - local.y) + v[1] * local.x + v[2] * local.y
        };
        // Along the diagonal from (0, 0) to (1, 1): the third corner's edge of triangle 0, the second's of triangle 1.
        for i in 0..=64 {
            let t = i as f32 / 64.0;
            let (a, b) = (at(0, Vec2::new(0.0, t)), at(1, Vec2::new(t, 0.0)));
            assert!((a - b).length() < 1e-4, "{t}: {a} {b}");
        }
        let coarse =
            Element::new(patches.at(0, 1, Vec2::new(0.5, 0.2)).0, crate::scene::interaction::Side::Front);
        let around = vertices.around(&data, &patches, coarse);
        // Three corners, the middle of the diagonal and that of its half.
        assert_eq!(around.len(), 5);
        let whole: f32 = (0..around.len())
            .map(|i| {
                let (a, b) = (around[i].1, around[(i + 1) % around.len()].1);
                a.perp_dot(b)
            })
            .sum();
        assert!((whole - 1.0).abs() < 1e-6, "they go around the triangle once");
    }

    #[test]
    fn what_is_the_same_everywhere_stays_so() {
        let data = corner();
        let patches = Patches::even(&data, 100);
        let vertices = Vertices::new(&data, &patches);
        let elements = vec![DVec3::splat(0.3); 2 * patches.all().len()];
        for value in vertices.values(&patches, &elements) {
            assert!((value - 0.3).abs().max_element() < 1e-6);
        }
    }
}

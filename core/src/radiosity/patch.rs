//! Triangles of a scene, cut into patches.

use crate::scene::data::SceneData;
use crate::trace::moment::Moment;
use glam::{Vec2, Vec3};

/// A triangle is halved at most this often: f32 then still tells the corners of its patches apart.
const LEVEL_MAX: u8 = 12;

/// Number of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PatchId(pub u32);

impl PatchId {
    /// As an index.
    #[inline]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A triangle of a scene, or a part of one that halving its edges has left.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// The instance.
    pub instance: u32,
    /// The triangle of its mesh.
    pub triangle: u32,
    /// Weights of the triangle's second and third corner (in the mesh's order) at the patch's corners.
    pub weights: [Vec2; 3],
    /// The patch's corners in the scene's space. Patches that share an edge of the mesh have the same bits there.
    pub corners: [Vec3; 3],
    /// How often the triangle's edges have been halved.
    pub level: u8,
}

/// A node of the tree over a triangle.
#[derive(Clone, Copy, Debug)]
enum Cell {
    Whole(PatchId),
    /// The first of four children: at the first, second and third corner, and the middle one.
    Cut(u32),
}

/// All patches of a scene, and which of them a point lies on.
#[derive(Clone, Debug)]
pub struct Patches {
    cells: Vec<Cell>,
    /// The cell of each instance's first triangle.
    roots: Vec<u32>,
    all: Vec<Patch>,
}

impl Patch {
    /// Area in scene units squared.
    pub fn area(&self) -> f64 {
        let [a, b, c] = self.corners.map(Vec3::as_dvec3);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Length of the longest edge in scene units.
    pub fn longest(&self) -> f64 {
        let [a, b, c] = self.corners.map(Vec3::as_dvec3);
        (b - a).length().max((c - b).length()).max((a - c).length())
    }

    /// Whether it may be cut once more.
    pub fn can_be_cut(&self) -> bool {
        self.level < LEVEL_MAX
    }

    /// Weights of the triangle's corners at a point of the patch given by weights of the patch's corners.
    #[inline]
    pub fn on_triangle(&self, local: Vec2) -> Vec2 {
        let [a, b, c] = self.weights;
        a + (b - a) * local.x + (c - a) * local.y
    }

    /// The four parts: at each corner, and the middle one, turned by half a circle.
    fn parts(&self) -> [Self; 4] {
        let part = |weights, corners| Self { weights, corners, level: self.level + 1, ..*self };
        let ([a, b, c], [p, q, r]) = (self.weights, self.corners);
        let (ab, bc, ca) = ((a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5);
        let (pq, qr, rp) = (midpoint(p, q), midpoint(q, r), midpoint(r, p));
        [
            part([a, ab, ca], [p, pq, rp]),
            part([ab, b, bc], [pq, q, qr]),
            part([ca, bc, c], [rp, qr, r]),
            part([bc, ca, ab], [qr, rp, pq]),
        ]
    }
}

/// The middle of an edge; the same bits from either end.
#[inline]
pub fn midpoint(a: Vec3, b: Vec3) -> Vec3 {
    (a + b) * 0.5
}

impl Patches {
    /// Every triangle as it is.
    pub fn of_triangles(data: &SceneData) -> Self {
        let mut patches = Self { cells: Vec::new(), roots: Vec::new(), all: Vec::new() };
        for (i, instance) in data.instances.iter().enumerate() {
            let mesh = &data.meshes[instance.mesh.index()];
            patches.roots.push(patches.cells.len() as u32);
            for triangle in 0..mesh.triangles.len() as u32 {
                let corners = mesh.corners(triangle, Moment::STILL).map(|p| instance.placement.point(p));
                patches.cells.push(Cell::Whole(PatchId(patches.all.len() as u32)));
                let weights = [Vec2::ZERO, Vec2::X, Vec2::Y];
                patches.all.push(Patch { instance: i as u32, triangle, weights, corners, level: 0 });
            }
        }
        patches
    }

    /// Cuts triangles until no edge is longer than one length for all, the smallest that leaves at most `count`
    /// patches; where there are more triangles, all stay whole.
    pub fn even(data: &SceneData, count: usize) -> Self {
        let mut patches = Self::of_triangles(data);
        let longest: Vec<f64> = patches.all.iter().map(Patch::longest).collect();
        let levels = |edge: f64| {
            longest.iter().map(move |l| {
                (0..LEVEL_MAX).take_while(|&n| l / f64::from(1_u32 << n) > edge * (1.0 + 1e-6)).count()
            })
        };
        let start = longest.iter().fold(0.0, |a: f64, b| a.max(*b));
        let mut edge = start;
        for halves in 1..=2 * u32::from(LEVEL_MAX) {
            let finer = start * libm::exp2(-0.5 * f64::from(halves));
            if levels(finer).map(|n| 1_u64 << (2 * n)).sum::<u64>() > count as u64 {
                break;
            }
            edge = finer;
        }
        loop {
            let chosen: Vec<bool> =
                (patches.all.iter()).map(|p| p.can_be_cut() && p.longest() > edge * (1.0 + 1e-6)).collect();
            if !chosen.contains(&true) {
                return patches;
            }
            patches.cut(&chosen);
        }
    }

    /// Cuts the chosen patches in four. All patches are numbered anew.
    pub fn cut(&mut self, chosen: &[bool]) {
        assert_eq!(chosen.len(), self.all.len(), "a choice for each patch");
        let mut all = Vec::new();
        for index in 0..self.cells.len() {
            let Cell::Whole(old) = self.cells[index] else { continue };
            let patch = self.all[old.index()];
            if chosen[old.index()] && patch.can_be_cut() {
                self.cells[index] = Cell::Cut(self.cells.len() as u32);
                for part in patch.parts() {
                    self.cells.push(Cell::Whole(PatchId(all.len() as u32)));
                    all.push(part);
                }
            } else {
                self.cells[index] = Cell::Whole(PatchId(all.len() as u32));
                all.push(patch);
            }
        }
        self.all = all;
    }

    /// The patches by their number.
    pub fn all(&self) -> &[Patch] {
        &self.all
    }

    /// The patch at a point of a triangle, given by the weights of its second and third corner, and the weights of
    /// the patch's second and third corner there.
    pub fn at(&self, instance: u32, triangle: u32, weights: Vec2) -> (PatchId, Vec2) {
        let (mut cell, mut w) = ((self.roots[instance as usize] + triangle) as usize, weights);
        loop {
            match self.cells[cell] {
                Cell::Whole(patch) => return (patch, w),
                Cell::Cut(first) => {
                    let child = if w.x > 0.5 {
                        w = Vec2::new(2.0 * w.x - 1.0, 2.0 * w.y);
                        1
                    } else if w.y > 0.5 {
                        w = Vec2::new(2.0 * w.x, 2.0 * w.y - 1.0);
                        2
                    } else if w.x + w.y < 0.5 {
                        w *= 2.0;
                        0
                    } else {
                        w = Vec2::ONE - 2.0 * w;
                        3
                    };
                    cell = first as usize + child;
                }
            }
        }
    }

    /// Sum of the areas.
    pub fn area(&self) -> f64 {
        self.all.iter().map(Patch::area).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::instance::{Instance, Placement};
    use crate::scene::material::{Material, MaterialId};
    use crate::scene::mesh::{Mesh, MeshId};

    fn square() -> SceneData {
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            materials: vec![MaterialId(0); 2],
            ..Mesh::default()
        };
        let instance = Instance { mesh: MeshId(0), name: String::new(), placement: Placement::World };
        let materials = vec![Material::default()];
        SceneData { meshes: vec![mesh], instances: vec![instance], materials, ..SceneData::empty() }
    }

    #[test]
    fn a_point_lies_on_the_patch_that_is_found_for_it() {
        let mut patches = Patches::even(&square(), 32);
        assert_eq!(patches.all().len(), 32);
        let chosen: Vec<bool> = (0..32).map(|i| i % 3 == 0).collect();
        patches.cut(&chosen);
        assert_eq!(patches.all().len(), 32 + 11 * 3);
        assert!((patches.area() - 1.0).abs() < 1e-6);
        let mut seen = vec![false; patches.all().len()];
        for i in 0..=40 {
            for j in 0..=40 - i {
                let weights = Vec2::new(i as f32, j as f32) / 40.0;
                let (id, local) = patches.at(0, 1, weights);
                let patch = &patches.all()[id.index()];
                seen[id.index()] = true;
                assert_eq!(patch.triangle, 1);
                assert!(local.min_element() >= -1e-6 && local.x + local.y <= 1.0 + 1e-6, "{weights} {local}");
                assert!((patch.on_triangle(local) - weights).length() < 1e-6);
                let [a, b, c] = patch.corners;
                let point = a + (b - a) * local.x + (c - a) * local.y;
                let truth = Vec3::new(1.0, 1.0, 0.0) * weights.x + Vec3::Y * weights.y;
                assert!((point - truth).length() < 1e-6);
            }
        }
        let of_second = patches.all().iter().zip(&seen).filter(|(p, _)| p.triangle == 1);
        assert!(of_second.into_iter().all(|(_, seen)| *seen));
    }

    #[test]
    fn winding_is_kept() {
        let patches = Patches::even(&square(), 128);
        for patch in patches.all() {
            let [a, b, c] = patch.corners;
            assert!((b - a).cross(c - a).z > 0.0);
        }
    }

    #[test]
    fn no_number_of_patches_cuts_without_end() {
        for count in [0, 1, 3, 1 << 16] {
            assert!(Patches::even(&square(), count).all().len() <= count.max(2));
        }
    }
}

//! Triangles with what is needed to shade them.

use crate::scene::material::MaterialId;
use glam::{Vec2, Vec3, Vec4};

/// Index of a mesh of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct MeshId(pub u32);

impl MeshId {
    /// As an index.
    #[inline]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// Triangles in structure-of-arrays. An attribute that no material of the mesh needs is an empty list;
/// any other has an entry for every vertex.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Corners.
    pub positions: Vec<Vec3>,
    /// Corners of each triangle; its front is where they run counter-clockwise (in an instance that
    /// mirrors: clockwise).
    pub triangles: Vec<[u32; 3]>,
    /// Material of each triangle.
    pub materials: Vec<MaterialId>,
    /// Unit shading normals; zero where the triangle is flat.
    pub normals: Vec<Vec3>,
    /// Unit tangents, with the sign of the bitangent `w · (normal × tangent)`; zero where there is none.
    pub tangents: Vec<Vec4>,
    /// Two sets of texture coordinates.
    pub uvs: [Vec<Vec2>; 2],
    /// Linear colour and alpha to multiply the base colour with.
    pub colours: Vec<Vec4>,
    /// Runs of triangles that come from one node, by their first triangle.
    pub parts: Vec<Part>,
}

/// A run of triangles, up to the next one's first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// The first triangle.
    pub first: u32,
    /// Name of the node (of the mesh, where several nodes share it); may be empty.
    pub name: String,
}

impl Mesh {
    /// Positions of a triangle's corners, in the mesh's space.
    #[inline]
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }

    /// Name of the node a triangle comes from; empty where it has none.
    pub fn part_name(&self, triangle: u32) -> &str {
        let after = self.parts.partition_point(|part| part.first <= triangle);
        after.checked_sub(1).map_or("", |i| &self.parts[i].name)
    }

    /// Memory that the lists take.
    pub fn bytes(&self) -> usize {
        self.positions.len() * size_of::<Vec3>()
            + self.triangles.len() * size_of::<[u32; 3]>()
            + self.materials.len() * size_of::<MaterialId>()
            + self.normals.len() * size_of::<Vec3>()
            + (self.tangents.len() + self.colours.len()) * size_of::<Vec4>()
            + (self.uvs[0].len() + self.uvs[1].len()) * size_of::<Vec2>()
    }
}

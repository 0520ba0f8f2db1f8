//! Triangles with what is needed to shade them.

use crate::scene::material::MaterialId;
use crate::trace::build_error::BuildError;
use crate::trace::mesh::MeshTree;
use crate::trace::moment::Moment;
use crate::trace::surface_point::Face;
use glam::{Vec2, Vec3, Vec4};
use rayon::prelude::*;

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
    /// Its shape at the second knot of the scene's motion and all further ones; empty where the shape stays. At the
    /// first knot it has the shape above.
    pub forms: Vec<Form>,
    /// Faces of the triangles; empty where they are found anew for every point. See [`Mesh::keep_faces`].
    pub faces: Vec<Face>,
}

/// A mesh's shape at a knot: as many entries as the mesh has, each.
#[derive(Clone, Debug, Default)]
pub struct Form {
    /// Corners.
    pub positions: Vec<Vec3>,
    /// Shading normals; zero where the triangle is flat.
    pub normals: Vec<Vec3>,
    /// Tangents, with the mesh's signs.
    pub tangents: Vec<Vec4>,
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
    /// Positions of a triangle's corners at a moment, in the mesh's space.
    #[inline]
    pub fn corners(&self, triangle: u32, moment: Moment) -> [Vec3; 3] {
        let corners = self.triangles[triangle as usize].map(|v| v as usize);
        if self.forms.is_empty() {
            return corners.map(|v| self.positions[v]);
        }
        let [a, b] = self.around(moment, |mesh| &mesh.positions, |form| &form.positions);
        corners.map(|v| moment.vector(a[v], b[v]))
    }

    /// Shading normals of three vertices at a moment, of any length; the mesh must have normals.
    #[inline]
    pub fn normals(&self, vertices: [usize; 3], moment: Moment) -> [Vec3; 3] {
        if self.forms.is_empty() {
            return vertices.map(|v| self.normals[v]);
        }
        let [a, b] = self.around(moment, |mesh| &mesh.normals, |form| &form.normals);
        vertices.map(|v| moment.vector(a[v], b[v]))
    }

    /// Tangents of three vertices at a moment, of any length; the mesh must have tangents.
    #[inline]
    pub fn tangents(&self, vertices: [usize; 3], moment: Moment) -> [Vec4; 3] {
        if self.forms.is_empty() {
            return vertices.map(|v| self.tangents[v]);
        }
        let [a, b] = self.around(moment, |mesh| &mesh.tangents, |form| &form.tangents);
        vertices.map(|v| moment.vector(a[v].truncate(), b[v].truncate()).extend(a[v].w))
    }

    /// An attribute at the knots before and after a moment.
    fn around<'a, T>(
        &'a self,
        moment: Moment,
        first: fn(&'a Self) -> &'a Vec<T>,
        later: fn(&'a Form) -> &'a Vec<T>,
    ) -> [&'a [T]; 2] {
        let knot = |index: usize| {
            let shape = index.min(self.forms.len()).checked_sub(1).map(|i| &self.forms[i]);
            shape.map_or(first(self).as_slice(), |shape| later(shape).as_slice())
        };
        [knot(moment.piece as usize), knot(moment.piece as usize + 1)]
    }

    /// The face of a triangle, where it is kept.
    #[inline]
    pub fn face(&self, triangle: u32) -> Option<&Face> {
        self.faces.get(triangle as usize)
    }

    /// Keeps the faces, 24 bytes a triangle, of a mesh that is the scene's own: neither moved nor bent.
    pub fn keep_faces(&mut self) {
        let face = |triangle: &[u32; 3]| Face::new(triangle.map(|v| self.positions[v as usize]), None);
        self.faces = self.triangles.par_iter().map(face).collect();
    }

    /// The tree that rays walk.
    pub fn tree(&self) -> Result<MeshTree, BuildError> {
        if self.forms.is_empty() {
            return MeshTree::build(&self.positions, &self.triangles);
        }
        let first = std::iter::once(self.positions.as_slice());
        let knots: Vec<&[Vec3]> = first.chain(self.forms.iter().map(|s| s.positions.as_slice())).collect();
        MeshTree::moving(&knots, &self.triangles)
    }

    /// Name of the node a triangle comes from; empty where it has none.
    pub fn part_name(&self, triangle: u32) -> &str {
        let after = self.parts.partition_point(|part| part.first <= triangle);
        after.checked_sub(1).map_or("", |i| &self.parts[i].name)
    }

    /// Memory that the lists take.
    pub fn bytes(&self) -> usize {
        let size = |s: &Form| {
            (s.positions.len() + s.normals.len()) * size_of::<Vec3>() + s.tangents.len() * size_of::<Vec4>()
        };
        self.forms.iter().map(size).sum::<usize>()
            + self.positions.len() * size_of::<Vec3>()
            + self.faces.len() * size_of::<Face>()
            + self.triangles.len() * size_of::<[u32; 3]>()
            + self.materials.len() * size_of::<MaterialId>()
            + self.normals.len() * size_of::<Vec3>()
            + (self.tangents.len() + self.colours.len()) * size_of::<Vec4>()
            + (self.uvs[0].len() + self.uvs[1].len()) * size_of::<Vec2>()
    }
}

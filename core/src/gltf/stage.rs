//! Where everything is at each knot of the motion.

use crate::gltf::accessor::Source;
use crate::gltf::animation::Animation;
use crate::gltf::error::LoadError;
use crate::gltf::geometry::{self, Geometry};
use crate::gltf::nodes::{Pose, Tree};
use crate::gltf::shapes::{Morphs, Shape, Skins};
use crate::scene::bounds::Bounds;
use crate::scene::knots::Knots;
use crate::scene::mesh::Form;
use glam::{DAffine3, Vec3, Vec4};
use std::collections::BTreeMap;

/// Where everything is at each knot of the motion; at the only one where nothing moves.
pub(crate) struct Stage<'a> {
    pub(crate) tree: &'a Tree<'a>,
    pub(crate) knots: Knots,
    poses: Vec<Pose>,
    /// Mesh to file for each joint of each skin, at each knot; of skins that rest, at the first.
    joints: BTreeMap<usize, Vec<Vec<DAffine3>>>,
}

/// A geometry's vertices at a knot.
#[derive(Clone, Copy)]
pub(crate) struct Vertices<'a> {
    pub(crate) positions: &'a [Vec3],
    pub(crate) normals: &'a [Vec3],
    pub(crate) tangents: &'a [Vec4],
}

/// Where a shape is at a knot.
#[derive(Clone, Copy)]
pub(crate) struct Setting<'a> {
    /// Node to file.
    pub(crate) world: DAffine3,
    /// Mesh to file for each joint, where the shape has a skin.
    pub(crate) joints: Option<&'a [DAffine3]>,
    pub(crate) knot: usize,
}

impl<'a> Stage<'a> {
    /// The stage of a tree in some poses, one a knot.
    pub(crate) fn new(tree: &'a Tree<'a>, skins: &Skins, knots: Knots, poses: Vec<Pose>) -> Self {
        let joints = |skin: &crate::gltf::skin::Skin| {
            let poses = if skin.moves(tree) { &poses[..] } else { &poses[..1] };
            poses.iter().map(|pose| skin.joints(tree, pose)).collect()
        };
        let joints = skins.iter().map(|(&index, skin)| (index, joints(skin))).collect();
        Self { tree, knots, poses, joints }
    }

    /// Morphs what morphs, to its form at each knot but the first.
    pub(crate) fn morph(
        &self,
        source: Source<'_>,
        animation: &Animation<'_>,
        shapes: &mut [Shape],
    ) -> Result<(), LoadError> {
        for shape in shapes.iter_mut().filter(|shape| shape.morphs == Morphs::Yes) {
            let primitives = source.document.item("meshes", shape.mesh)?.items("primitives")?;
            let node = self.tree.nodes[shape.places[0]].index;
            for pose in &self.poses[1..] {
                let weights = animation.weights(node, pose.instant.time, pose.instant.side);
                let weights = weights.unwrap_or_else(|| shape.weights.clone());
                for geometry in &mut shape.geometries {
                    let at = &primitives[geometry.primitive];
                    let mut form = geometry::morphed(at, source, &geometry.vertices, &weights)?;
                    if form.tangents.is_empty() {
                        form.tangents.clone_from(&geometry.tangents);
                    }
                    geometry.forms.push(form);
                }
            }
        }
        Ok(())
    }

    /// Whether a shape changes, other than by moving as a whole.
    pub(crate) fn deforms(&self, shape: &Shape) -> bool {
        shape.morphs == Morphs::Yes || shape.skin.is_some_and(|skin| self.joints[&skin].len() > 1)
    }

    /// Number of knots at which a shape differs at a place: one where it rests there.
    pub(crate) fn knots_of(&self, shape: &Shape, place: usize) -> usize {
        let hangs = |g: &Geometry| shape.skin.is_some() && g.influences.is_some();
        let moves = self.tree.moves(place) && !shape.geometries.iter().all(hangs);
        if moves || self.deforms(shape) { self.poses.len() } else { 1 }
    }

    /// Where a shape is at a place and a knot.
    pub(crate) fn setting(&self, shape: &Shape, place: usize, knot: usize) -> Setting<'_> {
        let joints = shape.skin.map(|skin| {
            let knots = &self.joints[&skin];
            knots[knot.min(knots.len() - 1)].as_slice()
        });
        Setting { world: self.tree.world(place, &self.poses[knot]), joints, knot }
    }

    /// Node to file at each knot; at the first where the node rests.
    pub(crate) fn worlds(&self, place: usize) -> impl Iterator<Item = DAffine3> + '_ {
        let count = if self.tree.moves(place) { self.poses.len() } else { 1 };
        self.poses[..count].iter().map(move |pose| self.tree.world(place, pose))
    }
}

impl Setting<'_> {
    /// Mesh to file for one vertex: a skin's vertices go by their joints alone.
    pub(crate) fn transform(&self, geometry: &Geometry, vertex: usize) -> DAffine3 {
        match (&geometry.influences, self.joints) {
            (Some(influences), Some(joints)) => influences.transform(vertex, joints),
            _ => self.world,
        }
    }

    /// A geometry's vertices, in the mesh's space.
    pub(crate) fn vertices<'g>(&self, geometry: &'g Geometry) -> Vertices<'g> {
        match self.knot.checked_sub(1).and_then(|i| geometry.forms.get(i)) {
            Some(Form { positions, normals, tangents }) => Vertices { positions, normals, tangents },
            None => Vertices {
                positions: &geometry.positions,
                normals: &geometry.normals,
                tangents: &geometry.tangents,
            },
        }
    }

    /// A box around a shape, in the file's space.
    pub(crate) fn bounds(&self, shape: &Shape, exact: Exact) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        for geometry in &shape.geometries {
            if exact == Exact::No {
                bounds = bounds.union(geometry.bounds().transformed(&self.world));
                continue;
            }
            for (v, p) in self.vertices(geometry).positions.iter().enumerate() {
                bounds.include(self.transform(geometry, v).transform_point3(p.as_dvec3()));
            }
        }
        bounds
    }
}

/// Whether a box is drawn around every vertex or around a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Exact {
    Yes,
    No,
}

//! Skins: joints, and what of each vertex hangs on them.

use crate::gltf::accessor::{Accessor, Source};
use crate::gltf::error::LoadError;
use crate::gltf::nodes::{Pose, Tree};
use glam::{DAffine3, DMat3, DMat4};

/// Sets of four joints that a vertex may have.
pub(crate) const SETS: usize = 4;

/// Whether joints and weights are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wanted {
    Yes,
    No,
}

/// Joints and weights of vertices, `width` a vertex. Weights sum to 1.
pub(crate) struct Influences {
    width: usize,
    joints: Vec<u16>,
    weights: Vec<f32>,
}

impl Influences {
    /// Of the used vertices.
    pub(crate) fn new(used: &[u32], sets: &[(Accessor<'_>, Accessor<'_>)]) -> Self {
        let width = 4 * sets.len();
        let mut joints = Vec::with_capacity(width * used.len());
        let mut weights = Vec::with_capacity(width * used.len());
        for &v in used {
            let first = weights.len();
            for (joint, weight) in sets {
                joints.extend(joint.get_joints(v as usize));
                weights.extend(
                    weight.get::<4>(v as usize).map(|w| if w > 0.0 && w.is_finite() { w } else { 0.0 }),
                );
            }
            let sum: f32 = weights[first..].iter().sum();
            if sum > 0.0 && sum.is_finite() {
                weights[first..].iter_mut().for_each(|w| *w /= sum);
            } else {
                weights[first] = 1.0;
            }
        }
        Self { width, joints, weights }
    }

    /// Only those of the vertices listed.
    pub(crate) fn keep(&mut self, used: &[u32]) {
        let range = |v: &u32| *v as usize * self.width..(*v as usize + 1) * self.width;
        let joints = used.iter().flat_map(|v| self.joints[range(v)].iter().copied()).collect();
        let weights = used.iter().flat_map(|v| self.weights[range(v)].iter().copied()).collect();
        (self.joints, self.weights) = (joints, weights);
    }

    /// Those of one vertex again.
    pub(crate) fn duplicate(&mut self, vertex: usize) {
        let range = vertex * self.width..(vertex + 1) * self.width;
        self.joints.extend_from_within(range.clone());
        self.weights.extend_from_within(range);
    }

    /// The transform of a vertex: the weighted mean of its joints'.
    pub(crate) fn transform(&self, vertex: usize, joints: &[DAffine3]) -> DAffine3 {
        let mut mean = DAffine3 { matrix3: DMat3::ZERO, translation: glam::DVec3::ZERO };
        for i in vertex * self.width..(vertex + 1) * self.width {
            let weight = f64::from(self.weights[i]);
            if weight > 0.0 {
                let joint = &joints[usize::from(self.joints[i])];
                mean.matrix3 += joint.matrix3 * weight;
                mean.translation += joint.translation * weight;
            }
        }
        mean
    }

    /// The greatest joint that has any weight.
    pub(crate) fn greatest(&self) -> usize {
        let used = self.joints.iter().zip(&self.weights).filter(|(_, w)| **w > 0.0);
        used.map(|(j, _)| usize::from(*j)).max().unwrap_or(0)
    }
}

/// A skin: the nodes that bend it, and the transform of the mesh into the space of each.
pub(crate) struct Skin {
    /// Places among the tree's nodes.
    joints: Vec<usize>,
    binds: Vec<DAffine3>,
}

/// Reads a skin.
pub(crate) fn read(source: Source<'_>, tree: &Tree<'_>, index: usize) -> Result<Skin, LoadError> {
    let item = source.document.item("skins", index)?;
    let list = item.elements("joints")?;
    if list.is_empty() {
        return Err(item.error("has no joints"));
    }
    let inverse = match item.index("inverseBindMatrices", "accessors", source.document.count("accessors"))? {
        Some(accessor) => {
            let matrices = source.accessor(accessor)?;
            if matrices.components != 16 || matrices.count < list.len() {
                let at = item.need("inverseBindMatrices")?;
                return Err(at.error(format!("must hold a 4×4 matrix for each of the {} joints", list.len())));
            }
            Some(matrices)
        }
        None => None,
    };
    let mut skin = Skin { joints: Vec::with_capacity(list.len()), binds: Vec::with_capacity(list.len()) };
    for (i, at) in list.iter().enumerate() {
        let node = at.as_index("nodes", tree.places.len())?;
        skin.joints.push(tree.places[node].ok_or_else(|| at.error("the joint is not part of the scene"))?);
        skin.binds.push(match &inverse {
            Some(matrices) => {
                let m = DMat4::from_cols_array(&matrices.get::<16>(i).map(f64::from));
                if !m.is_finite() {
                    return Err(item.error(format!("inverse bind matrix {i} is not finite")));
                }
                DAffine3::from_mat4(m)
            }
            None => DAffine3::IDENTITY,
        });
    }
    Ok(skin)
}

impl Skin {
    /// Number of joints.
    pub(crate) fn len(&self) -> usize {
        self.joints.len()
    }

    /// Whether a joint moves while the shutter is open.
    pub(crate) fn moves(&self, tree: &Tree<'_>) -> bool {
        self.joints.iter().any(|&place| tree.moves(place))
    }

    /// Mesh to file for each joint in a pose.
    pub(crate) fn joints(&self, tree: &Tree<'_>, pose: &Pose) -> Vec<DAffine3> {
        self.joints.iter().zip(&self.binds).map(|(&place, bind)| tree.world(place, pose) * *bind).collect()
    }
}

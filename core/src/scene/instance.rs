//! A mesh at a place.

use crate::scene::mesh::MeshId;
use crate::trace::instance::Moved as Traced;
use crate::trace::moment::Moment;
use glam::{Affine3A, DAffine3, DMat3, Mat3A, Vec3};

/// A mesh at a place.
#[derive(Clone, Debug)]
pub struct Instance {
    /// The mesh.
    pub mesh: MeshId,
    /// Name of the node; empty where the mesh's parts have names of their own.
    pub name: String,
    /// Where it stands.
    pub placement: Placement,
}

/// Where an instance stands.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "all instances are moved but one at most, the gathered mesh")]
pub enum Placement {
    /// The mesh's vertices are the scene's already.
    World,
    /// The mesh is moved into the scene.
    Moved(Moved),
    /// The mesh moves.
    Moving(Motion),
}

/// Transforms along which a mesh moves, none of which flattens space.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Mesh to scene at each knot.
    pub knots: Box<[Affine3A]>,
    /// Whether they mirror: all or none.
    pub handedness: Handedness,
}

/// An invertible transform and what follows from it.
#[derive(Clone, Copy, Debug)]
pub struct Moved {
    /// Mesh to scene.
    pub to_world: Affine3A,
    /// Normals of the mesh to normals of the scene, of any length: the cofactors with the determinant's sign.
    pub normal_to_world: Mat3A,
    /// Whether the transform mirrors.
    pub handedness: Handedness,
    /// What rays need of it.
    pub traced: Traced,
}

/// Whether a transform mirrors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Handedness {
    /// Positive determinant.
    Kept,
    /// Negative determinant: a front face winds clockwise, bitangents change sign.
    Mirrored,
}

impl Handedness {
    /// Of a matrix.
    pub fn of(matrix: &DMat3) -> Self {
        if matrix.determinant() < 0.0 { Self::Mirrored } else { Self::Kept }
    }

    /// 1 or −1.
    #[inline]
    pub fn sign(self) -> f32 {
        match self {
            Self::Kept => 1.0,
            Self::Mirrored => -1.0,
        }
    }
}

/// The matrix that takes normals along: the inverse transpose times |det|, which also exists where a
/// matrix flattens space.
pub fn normal_matrix(matrix: &DMat3) -> DMat3 {
    let (x, y, z) = (matrix.x_axis, matrix.y_axis, matrix.z_axis);
    let sign = if matrix.determinant() < 0.0 { -1.0 } else { 1.0 };
    DMat3::from_cols(y.cross(z) * sign, z.cross(x) * sign, x.cross(y) * sign)
}

impl Moved {
    /// From a transform; `None` where it cannot be inverted in single precision.
    pub fn new(to_world: &DAffine3) -> Option<Self> {
        let matrix = to_world.matrix3;
        let inverse = matrix.inverse();
        let rounded = Affine3A {
            matrix3: Mat3A::from_cols(
                matrix.x_axis.as_vec3a(),
                matrix.y_axis.as_vec3a(),
                matrix.z_axis.as_vec3a(),
            ),
            translation: to_world.translation.as_vec3a(),
        };
        let usable = matrix.determinant() != 0.0
            && inverse.is_finite()
            && inverse.as_mat3().is_finite()
            && rounded.is_finite()
            && rounded.inverse().is_finite();
        let normals = normal_matrix(&matrix);
        let longest = normals.x_axis.length().max(normals.y_axis.length()).max(normals.z_axis.length());
        let normals = normals * (1.0 / longest);
        if !usable {
            return None;
        }
        Some(Self {
            to_world: rounded,
            normal_to_world: Mat3A::from(normals.as_mat3()),
            handedness: Handedness::of(&matrix),
            traced: Traced::new(rounded)?,
        })
    }
}

impl Motion {
    /// From the transform at each knot; `None` where one cannot be inverted in single precision, or some mirror and
    /// others do not.
    pub fn new(knots: &[DAffine3]) -> Option<Self> {
        let moved = knots.iter().map(Moved::new).collect::<Option<Vec<_>>>()?;
        let handedness = moved.first()?.handedness;
        let knots = moved.iter().map(|m| m.to_world).collect();
        moved.iter().all(|m| m.handedness == handedness).then_some(Self { knots, handedness })
    }

    /// Where it has come to. The transform is that by which rays go, to the bit; normals go by its cofactors, which
    /// exist where it is flat.
    pub fn at(&self, moment: Moment) -> Moved {
        let to_world = moment.transform(&self.knots);
        let cofactors = normal_matrix(&glam::Mat3::from(to_world.matrix3).as_dmat3());
        let longest = cofactors.x_axis.length().max(cofactors.y_axis.length()).max(cofactors.z_axis.length());
        let normals = if longest > 0.0 { cofactors * (1.0 / longest) } else { cofactors };
        let normal_to_world = Mat3A::from(normals.as_mat3());
        // A transform between two knots may be flat, at a moment that has no length: no ray meets the mesh then.
        let traced = Traced::new(to_world).or_else(|| Traced::new(self.knots[0]));
        let traced = traced.expect("transforms at knots can be inverted");
        Moved { to_world, normal_to_world, handedness: self.handedness, traced }
    }
}

impl Placement {
    /// The transforms at the knots; none of what stands.
    pub fn knots(&self) -> &[Affine3A] {
        match self {
            Self::World | Self::Moved(_) => &[],
            Self::Moving(motion) => &motion.knots,
        }
    }

    /// Mesh to scene; of what moves, at the first knot.
    pub fn to_world(&self) -> Affine3A {
        match self {
            Self::World => Affine3A::IDENTITY,
            Self::Moved(moved) => moved.to_world,
            Self::Moving(motion) => motion.knots[0],
        }
    }

    /// A normal of the mesh in the scene, of unit length; zero where it vanishes. Like the rest below, of what moves
    /// this is at the first knot.
    #[inline]
    pub fn normal(&self, normal: Vec3) -> Vec3 {
        match self {
            Self::World => normal,
            Self::Moved(moved) => (moved.normal_to_world * normal).normalize_or_zero(),
            Self::Moving(motion) => (motion.at(Moment::STILL).normal_to_world * normal).normalize_or_zero(),
        }
    }

    /// A direction of the mesh in the scene; its length changes with the scale.
    #[inline]
    pub fn direction(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::World => direction,
            Self::Moved(moved) => moved.to_world.transform_vector3(direction),
            Self::Moving(motion) => motion.knots[0].transform_vector3(direction),
        }
    }

    /// A point of the mesh in the scene.
    #[inline]
    pub fn point(&self, point: Vec3) -> Vec3 {
        match self {
            Self::World => point,
            Self::Moved(moved) => moved.to_world.transform_point3(point),
            Self::Moving(motion) => motion.knots[0].transform_point3(point),
        }
    }

    /// Whether the front of a triangle winds the other way round.
    #[inline]
    pub fn handedness(&self) -> Handedness {
        match self {
            Self::World => Handedness::Kept,
            Self::Moved(moved) => moved.handedness,
            Self::Moving(motion) => motion.handedness,
        }
    }
}

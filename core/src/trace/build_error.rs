//! Why a tree cannot be built.

use thiserror::Error;

/// Coordinates must stay below this, 2⁶⁰, so that no product in a ray's test leaves the range of f32.
pub const LARGEST_COORDINATE: f32 = (1u64 << 60) as f32;

/// What is wrong with the geometry given, and where.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum BuildError {
    /// A triangle has a corner that the mesh does not have.
    #[error("triangle {triangle} uses vertex {vertex}, but the mesh has {vertices}: correct its index")]
    Index {
        /// The triangle.
        triangle: usize,
        /// The vertex it asks for.
        vertex: u32,
        /// How many there are.
        vertices: usize,
    },
    /// A position is NaN, infinite, or too far out.
    #[error("vertex {vertex} of triangle {triangle} is not finite or beyond 2^60: correct or remove it")]
    Position {
        /// The triangle.
        triangle: usize,
        /// The vertex.
        vertex: u32,
    },
    /// More triangles or placements than a tree can hold.
    #[error("{count} items in one tree, at most 2^30 are possible: split the mesh")]
    Count {
        /// How many were given.
        count: usize,
    },
    /// A placement names a mesh that is not there.
    #[error("placement {placement} uses mesh {mesh}, but there are {meshes}: correct its index")]
    Mesh {
        /// The placement.
        placement: usize,
        /// The mesh it asks for.
        mesh: u32,
        /// How many there are.
        meshes: usize,
    },
    /// A transform is not finite, cannot be inverted, or moves its mesh too far out.
    #[error(
        "the transform of placement {placement} is not invertible or leaves 2^60: transform the mesh's vertices instead, or remove it"
    )]
    Transform {
        /// The placement.
        placement: usize,
    },
}

/// Refuses more than 2³⁰ items: indices of nodes and leaves have 31 bits.
pub(super) fn check_count(count: usize) -> Result<(), BuildError> {
    if count > 1 << 30 { Err(BuildError::Count { count }) } else { Ok(()) }
}

//! A tree over the triangles of one mesh.

use super::bounds::Bounds;
use super::build_error::{BuildError, LARGEST_COORDINATE, check_count};
use super::collapse;
use super::lanes::WIDTH;
use super::triangle::Block;
use super::wide::Tree;
use glam::Vec3;

/// The triangles of a mesh in a tree, ready for rays. Positions are copied into it.
#[derive(Clone, Debug)]
pub struct MeshTree {
    pub(super) tree: Tree,
    /// One for each leaf of the tree.
    pub(super) blocks: Vec<Block>,
    bounds: Bounds,
}

impl MeshTree {
    /// Builds the tree: about a second a million triangles. No triangles make an empty tree. Triangles without area
    /// are kept; no ray hits them.
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> Result<Self, BuildError> {
        check_count(triangles.len())?;
        let boxes = (triangles.iter().enumerate())
            .map(|(triangle, corners)| Ok(Bounds::around(vertices(positions, triangle, corners)?)))
            .collect::<Result<Vec<_>, _>>()?;
        let (tree, leaves) = collapse::build(&boxes, WIDTH);
        let corners = |id: &u32| (*id, triangles[*id as usize].map(|v| positions[v as usize]));
        let blocks = leaves.iter().map(|items| Block::new(items.iter().map(corners))).collect();
        let bounds = boxes.iter().fold(Bounds::EMPTY, |all, b| all.union(*b));
        Ok(Self { tree, blocks, bounds })
    }

    /// The box around all triangles.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Bytes of memory that the tree takes.
    pub fn bytes(&self) -> usize {
        self.tree.nodes.len() * size_of::<super::wide::Node>() + self.blocks.len() * size_of::<Block>()
    }
}

fn vertices(positions: &[Vec3], triangle: usize, corners: &[u32; 3]) -> Result<[Vec3; 3], BuildError> {
    let mut vertices = [Vec3::ZERO; 3];
    for (place, &vertex) in vertices.iter_mut().zip(corners) {
        let position = positions.get(vertex as usize);
        *place = *position.ok_or(BuildError::Index { triangle, vertex, vertices: positions.len() })?;
        if !place.abs().cmple(Vec3::splat(LARGEST_COORDINATE)).all() {
            return Err(BuildError::Position { triangle, vertex });
        }
    }
    Ok(vertices)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn says_what_is_wrong() {
        let positions = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(0.0, f32::NAN, 0.0), Vec3::splat(1e19)];
        let build = |corners| MeshTree::build(&positions, &[[0, 1, 2], corners]).map(|_| ());
        assert_eq!(build([0, 1, 2]), Ok(()));
        assert_eq!(build([0, 1, 5]), Err(BuildError::Index { triangle: 1, vertex: 5, vertices: 5 }));
        assert_eq!(build([0, 3, 1]), Err(BuildError::Position { triangle: 1, vertex: 3 }));
        assert_eq!(build([4, 0, 1]), Err(BuildError::Position { triangle: 1, vertex: 4 }));
        assert!(MeshTree::build(&[], &[]).unwrap().bounds().is_empty());
    }
}

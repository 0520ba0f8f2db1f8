//! A tree over the triangles of one mesh.

use super::bounds::Bounds;
use super::build_error::{BuildError, LARGEST_COORDINATE, check_count};
use super::collapse;
use super::lanes::WIDTH;
use super::moment::Moment;
use super::triangle::Block;
use super::wide::Tree;
use glam::Vec3;
use rayon::prelude::*;

/// The triangles of a mesh in a tree, ready for rays. Positions are copied into it.
#[derive(Clone, Debug)]
pub struct MeshTree {
    pub(super) tree: Tree,
    /// One for each leaf of the tree.
    pub(super) blocks: Vec<Block>,
    bounds: Bounds,
    /// What a mesh that changes its shape has instead of `tree` and `blocks`: one for each piece of the motion.
    pieces: Vec<Piece>,
}

/// The triangles of a mesh between two knots.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// Over boxes that hold the triangles at both knots, and so all between.
    pub(super) tree: Tree,
    /// The leaves' triangles at the first knot.
    pub(super) before: Vec<Block>,
    /// The same triangles at the second.
    pub(super) after: Vec<Block>,
}

/// Room beside the box around two places of a vertex, relative to its largest coordinate, for the rounding of what lies
/// between: twice that of three operations.
const ROUNDING: f32 = 6.0 / (1 << 24) as f32;

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
        Ok(Self { tree, blocks, bounds, pieces: Vec::new() })
    }

    /// The tree of a mesh that changes its shape: `knots` holds its positions at each knot of the scene's motion, at
    /// least two. A tree for each piece of the motion, each as large as [`MeshTree::build`] makes it and half again.
    pub fn moving(knots: &[&[Vec3]], triangles: &[[u32; 3]]) -> Result<Self, BuildError> {
        check_count(triangles.len())?;
        let pieces = (knots.par_windows(2))
            .map(|ends| Piece::build([ends[0], ends[1]], triangles))
            .collect::<Result<Vec<_>, _>>()?;
        let bounds = pieces.iter().fold(Bounds::EMPTY, |all, piece| all.union(piece.1));
        let (tree, _) = collapse::build(&[], WIDTH);
        let pieces = pieces.into_iter().map(|piece| piece.0).collect();
        Ok(Self { tree, blocks: Vec::new(), bounds, pieces })
    }

    /// The piece of the motion that a moment falls into; `None` where the mesh keeps its shape.
    #[inline(always)]
    pub(super) fn piece(&self, moment: Moment) -> Option<&Piece> {
        self.pieces.get(moment.piece as usize)
    }

    /// The box around all triangles.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Bytes of memory that the tree takes.
    pub fn bytes(&self) -> usize {
        let of = |tree: &Tree, blocks: usize| {
            tree.nodes.len() * size_of::<super::wide::Node>() + blocks * size_of::<Block>()
        };
        let moving = self.pieces.iter().map(|p| of(&p.tree, p.before.len() + p.after.len()));
        of(&self.tree, self.blocks.len()) + moving.sum::<usize>()
    }
}

impl Piece {
    fn build(ends: [&[Vec3]; 2], triangles: &[[u32; 3]]) -> Result<(Self, Bounds), BuildError> {
        let boxes = (triangles.iter().enumerate())
            .map(|(triangle, corners)| {
                let [before, after] = ends.map(|positions| vertices(positions, triangle, corners));
                let around = Bounds::around(before?).union(Bounds::around(after?));
                let room = Vec3::splat(around.reach() * ROUNDING);
                Ok(Bounds { min: around.min - room, max: around.max + room })
            })
            .collect::<Result<Vec<_>, _>>()?;
        let (tree, leaves) = collapse::build(&boxes, WIDTH);
        let [before, after] = ends.map(|positions| {
            let corners = |id: &u32| (*id, triangles[*id as usize].map(|v| positions[v as usize]));
            leaves.iter().map(|items| Block::new(items.iter().map(corners))).collect()
        });
        let bounds = boxes.iter().fold(Bounds::EMPTY, |all, b| all.union(*b));
        Ok((Self { tree, before, after }, bounds))
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

//! The eight-wide tree that rays walk.

use super::bounds::Bounds;
use super::lanes::{Row, WIDTH};

/// Deepest tree that the stack of a walk has room for.
pub(super) const MAX_DEPTH: usize = 40;

/// A child of a node: another node or a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Child(pub(super) u32);

impl Child {
    const LEAF: u32 = 1 << 31;

    /// A child that is node `index`.
    pub(super) fn node(index: usize) -> Self {
        debug_assert!(index < Self::LEAF as usize);
        Self(index as u32)
    }

    /// A child that is leaf `index`.
    pub(super) fn leaf(index: usize) -> Self {
        debug_assert!(index < Self::LEAF as usize);
        Self(index as u32 | Self::LEAF)
    }

    #[inline(always)]
    pub(super) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// Index among the nodes or the leaves.
    #[inline(always)]
    pub(super) fn index(self) -> usize {
        (self.0 & !Self::LEAF) as usize
    }
}

/// Boxes of up to eight children. Lanes without a child hold a box that no ray meets.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Padded planes by axis, then least and greatest coordinate, then lane.
    pub(super) planes: [[Row; 2]; 3],
    pub(super) children: [Child; WIDTH],
}

impl Node {
    /// A node without children.
    pub(super) fn empty() -> Self {
        let nowhere = [Row([f32::INFINITY; WIDTH]), Row([f32::NEG_INFINITY; WIDTH])];
        Self { planes: [nowhere; 3], children: [Child(0); WIDTH] }
    }

    /// Puts a child and its box, padded here, into a lane.
    pub(super) fn set(&mut self, lane: usize, child: Child, bounds: Bounds) {
        let padded = bounds.padded();
        let (min, max) = (padded.min.to_array(), padded.max.to_array());
        for (axis, [low, high]) in self.planes.iter_mut().enumerate() {
            low.0[lane] = min[axis];
            high.0[lane] = max[axis];
        }
        self.children[lane] = child;
    }
}

/// An eight-wide tree over leaves that whoever built it keeps.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    pub(super) nodes: Vec<Node>,
    /// `None` where the tree is empty.
    pub(super) root: Option<Child>,
    /// Nodes on the longest way from the root to a leaf; at most [`MAX_DEPTH`].
    pub(super) depth: usize,
}

//! Collapsing a binary tree into an eight-wide one of least expected cost.
//!
//! The cost of a tree is the sum over its nodes and leaves of what a visit costs, times the area of the box: the
//! surface area heuristic. For every binary node and every k ≤ 7, dynamic programming finds the cheapest way to
//! cover the node by at most k wide children (Ylitie, Karras, Laine 2017, §2.2; Wald, Benthin, Boulos 2008).

use super::binary::{Binary, Branch};
use super::bounds::Bounds;
use super::lanes::WIDTH;
use super::wide::{Child, MAX_DEPTH, Node, Tree};

/// Cost of visiting a leaf, in visits of a node: between 0.8 and 1.2 rays were fastest, at 2.5 a third slower.
const LEAF_COST: f32 = 1.0;

/// The items of each leaf of a [`Tree`].
pub(super) struct Leaves {
    items: Vec<u32>,
    /// Where each leaf's items end.
    ends: Vec<u32>,
}

impl Leaves {
    /// The items of each leaf, in the order of the leaves' indices.
    pub(super) fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.items[start as usize..end as usize])
    }
}

/// A tree over `boxes` whose leaves hold at most `leaf_size` of them, and what they hold.
pub(super) fn build(boxes: &[Bounds], leaf_size: usize) -> (Tree, Leaves) {
    if boxes.is_empty() {
        let leaves = Leaves { items: Vec::new(), ends: Vec::new() };
        return (Tree { nodes: Vec::new(), root: None, depth: 0 }, leaves);
    }
    let (tree, leaves) = collapse(&Binary::build(boxes), boxes, leaf_size);
    if tree.depth <= MAX_DEPTH {
        return (tree, leaves);
    }
    // Halved trees over 2³¹ boxes are 31 deep.
    collapse(&Binary::halved(boxes), boxes, leaf_size)
}

fn collapse(binary: &Binary, boxes: &[Bounds], leaf_size: usize) -> (Tree, Leaves) {
    Collapse { binary, plans: plans(binary, boxes, leaf_size) }.emit()
}

/// The cheapest ways to cover one binary node.
#[derive(Clone, Copy)]
struct Plan {
    bounds: Bounds,
    /// Items below.
    count: u32,
    /// `costs[k − 1]`: cost of covering the node by at most k wide children.
    costs: [f32; WIDTH - 1],
    /// `splits[k − 1]`: how many of k ≤ 8 children the left side gets; zero where fewer than k are as good. For k = 8
    /// this is how to fill one wide node.
    splits: [u8; WIDTH],
    /// Whether one child means a leaf.
    leaf: bool,
}

impl Plan {
    const NONE: Self =
        Self { bounds: Bounds::EMPTY, count: 0, costs: [0.0; WIDTH - 1], splits: [0; WIDTH], leaf: true };

    fn item(bounds: Bounds, relative_area: f32) -> Self {
        Self { bounds, count: 1, costs: [LEAF_COST * relative_area; WIDTH - 1], ..Self::NONE }
    }

    fn fork(left: &Self, right: &Self, relative_area: f32, bounds: Bounds, leaf_size: usize) -> Self {
        let count = left.count + right.count;
        let mut plan = Self { bounds, count, ..Self::NONE };
        let divided = |k: usize| {
            (1..k)
                .filter(|&l| l < WIDTH && k - l < WIDTH)
                .map(|l| (left.costs[l - 1] + right.costs[k - l - 1], l))
                .fold((f32::INFINITY, 0), |best, next| if next.0 < best.0 { next } else { best })
        };
        let (filled, split) = divided(WIDTH);
        plan.splits[WIDTH - 1] = split as u8;
        let inner = filled + relative_area;
        let leaf = if count as usize <= leaf_size { LEAF_COST * relative_area } else { f32::INFINITY };
        plan.leaf = leaf <= inner;
        plan.costs[0] = leaf.min(inner);
        for k in 2..WIDTH {
            let (cost, split) = divided(k);
            let better = cost < plan.costs[k - 2];
            plan.costs[k - 1] = if better { cost } else { plan.costs[k - 2] };
            plan.splits[k - 1] = if better { split as u8 } else { 0 };
        }
        plan
    }
}

fn plans(binary: &Binary, boxes: &[Bounds], leaf_size: usize) -> Vec<Plan> {
    let whole = boxes.iter().fold(Bounds::EMPTY, |all, b| all.union(*b)).half_area();
    let relative = |bounds: &Bounds| if whole > 0.0 { (bounds.half_area() / whole) as f32 } else { 0.0 };
    let mut plans = vec![Plan::NONE; binary.len()];
    for node in binary.upward() {
        plans[node as usize] = match binary.branch(node) {
            Branch::Item(item) => {
                let bounds = boxes[item as usize];
                Plan::item(bounds, relative(&bounds))
            }
            Branch::Fork([left, right]) => {
                let (left, right) = (&plans[left as usize], &plans[right as usize]);
                let bounds = left.bounds.union(right.bounds);
                Plan::fork(left, right, relative(&bounds), bounds, leaf_size)
            }
        };
    }
    plans
}

/// A binary tree and the plan for each of its nodes.
struct Collapse<'a> {
    binary: &'a Binary,
    plans: Vec<Plan>,
}

impl Collapse<'_> {
    fn emit(&self) -> (Tree, Leaves) {
        let mut leaves = Leaves { items: Vec::new(), ends: Vec::new() };
        if self.plans[0].leaf {
            let root = Some(self.leaf(0, &mut leaves));
            return (Tree { nodes: Vec::new(), root, depth: 1 }, leaves);
        }
        let mut nodes = vec![Node::empty()];
        let mut deepest = 1;
        let mut open = vec![(0_u32, 0_usize, 1_usize)];
        while let Some((branch, wide, depth)) = open.pop() {
            deepest = deepest.max(depth + 1);
            for (lane, child) in self.children(branch).into_iter().enumerate() {
                let plan = &self.plans[child as usize];
                let entry = if plan.leaf {
                    self.leaf(child, &mut leaves)
                } else {
                    nodes.push(Node::empty());
                    open.push((child, nodes.len() - 1, depth + 1));
                    Child::node(nodes.len() - 1)
                };
                nodes[wide].set(lane, entry, plan.bounds);
            }
        }
        (Tree { nodes, root: Some(Child::node(0)), depth: deepest }, leaves)
    }

    /// The binary nodes that become the children of the wide node made of `branch`.
    fn children(&self, branch: u32) -> Vec<u32> {
        let mut children = Vec::with_capacity(WIDTH);
        let mut open = vec![(branch, WIDTH)];
        while let Some((node, k)) = open.pop() {
            let mut k = k;
            let splits = &self.plans[node as usize].splits;
            while k > 1 && splits[k - 1] == 0 {
                k -= 1;
            }
            match self.binary.branch(node) {
                Branch::Fork([left, right]) if k > 1 => {
                    let l = usize::from(splits[k - 1]);
                    open.extend([(right, k - l), (left, l)]);
                }
                _ => children.push(node),
            }
        }
        children
    }

    /// Makes a leaf of all items below a binary node.
    fn leaf(&self, branch: u32, leaves: &mut Leaves) -> Child {
        let mut open = vec![branch];
        while let Some(node) = open.pop() {
            match self.binary.branch(node) {
                Branch::Item(item) => leaves.items.push(item),
                Branch::Fork([left, right]) => open.extend([right, left]),
            }
        }
        leaves.ends.push(leaves.items.len() as u32);
        Child::leaf(leaves.ends.len() - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn cloud(count: usize) -> Vec<Bounds> {
        (0..count)
            .map(|i| {
                let p = Vec3::new((i * 37 % 101) as f32, (i * 53 % 97) as f32, (i * 71 % 89) as f32);
                Bounds::around([p, p + Vec3::splat(1.0 + (i % 7) as f32)])
            })
            .collect()
    }

    /// Walks the whole tree and counts how often each item is met; every box must hold what is below.
    fn items(tree: &Tree, leaves: &Leaves, boxes: &[Bounds]) -> Vec<u32> {
        let mut counts = vec![0; boxes.len()];
        let mut open = vec![(tree.root.unwrap(), Bounds { min: Vec3::MIN, max: Vec3::MAX })];
        let leaves: Vec<_> = leaves.iter().collect();
        while let Some((child, within)) = open.pop() {
            if child.is_leaf() {
                for &item in leaves[child.index()] {
                    counts[item as usize] += 1;
                    assert_eq!(boxes[item as usize].union(within), within);
                }
                continue;
            }
            let node = &tree.nodes[child.index()];
            for lane in 0..WIDTH {
                let corner =
                    |side: usize| Vec3::from_array([0, 1, 2].map(|a: usize| node.planes[a][side].0[lane]));
                let bounds = Bounds { min: corner(0), max: corner(1) };
                if !bounds.is_empty() {
                    open.push((node.children[lane], bounds));
                }
            }
        }
        counts
    }

    #[test]
    fn every_item_is_in_one_leaf() {
        for count in [1, 2, 8, 9, 100, 3000] {
            for leaf_size in [1, 8] {
                let boxes = cloud(count);
                for binary in [Binary::build(&boxes), Binary::halved(&boxes)] {
                    let (tree, leaves) = collapse(&binary, &boxes, leaf_size);
                    assert!(items(&tree, &leaves, &boxes).iter().all(|c| *c == 1), "{count} {leaf_size}");
                    assert!(leaves.iter().all(|l| l.len() <= leaf_size));
                    assert!(tree.depth <= MAX_DEPTH);
                }
            }
        }
    }

    #[test]
    fn leaves_and_nodes_are_well_filled() {
        let boxes = cloud(3000);
        let (tree, leaves) = build(&boxes, 8);
        assert!(leaves.ends.len() < 1000, "{} leaves", leaves.ends.len());
        assert!(tree.nodes.len() < leaves.ends.len() / 3, "{} nodes", tree.nodes.len());
    }

    #[test]
    fn nothing_is_an_empty_tree() {
        let (tree, leaves) = build(&[], 8);
        assert!(tree.root.is_none() && leaves.iter().next().is_none());
    }
}

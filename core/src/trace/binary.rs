//! Binary trees over boxes: built by obvhs, or by halving where that tree is of no use.

use super::bounds::Bounds;
use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// A binary tree with one item a leaf.
pub(super) struct Binary {
    /// The root first, then in any order.
    nodes: Vec<Branch>,
    /// Nodes so that each comes before its children.
    order: Vec<u32>,
}

/// A node of a binary tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Branch {
    /// Two children.
    Fork([u32; 2]),
    /// One item.
    Item(u32),
}

/// How much time a build may take.
#[derive(Clone, Copy)]
struct Effort {
    search: PlocSearchDistance,
    precision: SortPrecision,
    /// Share of the nodes that the first of sixteen passes of reinsertion looks at.
    reinsertion: f32,
}

impl Effort {
    /// Keeps a build near one second a million boxes on one core: small trees are worth more care.
    fn for_count(count: usize) -> Self {
        match count {
            0..200_000 => {
                Self { search: PlocSearchDistance::High, precision: SortPrecision::U128, reinsertion: 0.3 }
            }
            _ => {
                Self { search: PlocSearchDistance::Medium, precision: SortPrecision::U64, reinsertion: 0.05 }
            }
        }
    }
}

impl Binary {
    /// A tree of good quality over at least one box.
    pub(super) fn build(boxes: &[Bounds]) -> Self {
        if boxes.len() == 1 {
            return Self::halved(boxes);
        }
        let effort = Effort::for_count(boxes.len());
        let rough = roughened(boxes);
        let items = (0..boxes.len() as u32).collect();
        let mut tree =
            PlocBuilder::with_capacity(boxes.len()).build(effort.search, &rough, items, effort.precision, 2);
        ReinsertionOptimizer::default().run(&mut tree, effort.reinsertion, None);
        let nodes = (tree.nodes.iter())
            .map(|node| match node.prim_count {
                0 => Branch::Fork([node.first_index, node.first_index + 1]),
                _ => Branch::Item(tree.primitive_indices[node.first_index as usize]),
            })
            .collect();
        Self::checked(nodes, boxes.len()).unwrap_or_else(|| Self::halved(boxes))
    }

    /// A tree that halves the items along the longest axis of their centres, at most ⌈log₂ n⌉ deep.
    pub(super) fn halved(boxes: &[Bounds]) -> Self {
        let centres: Vec<_> = boxes.iter().map(Bounds::centre).collect();
        let mut items: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = vec![Branch::Item(0)];
        let mut open = vec![(0, 0, boxes.len())];
        while let Some((node, start, end)) = open.pop() {
            if end - start == 1 {
                nodes[node] = Branch::Item(items[start]);
                continue;
            }
            let range = &mut items[start..end];
            let axis = longest_axis(Bounds::around(range.iter().map(|&i| centres[i as usize])));
            let half = range.len() / 2;
            range.select_nth_unstable_by(half, |&a, &b| {
                centres[a as usize][axis].total_cmp(&centres[b as usize][axis]).then(a.cmp(&b))
            });
            let left = nodes.len();
            nodes[node] = Branch::Fork([left as u32, left as u32 + 1]);
            nodes.extend([Branch::Item(0); 2]);
            open.extend([(left, start, start + half), (left + 1, start + half, end)]);
        }
        Self::checked(nodes, boxes.len()).expect("halving puts every item in one leaf")
    }

    /// The tree, if it is one and holds every one of `count` items once. Traversal and collapse rely on that, and a
    /// stack that overflows in obvhs does so without a word.
    fn checked(nodes: Vec<Branch>, count: usize) -> Option<Self> {
        let mut seen = vec![false; count];
        let mut order = Vec::with_capacity(nodes.len());
        let mut open = vec![0];
        while let Some(node) = open.pop() {
            if order.len() == nodes.len() {
                return None;
            }
            order.push(node);
            match *nodes.get(node as usize)? {
                Branch::Fork(children) => open.extend(children),
                Branch::Item(item) => {
                    let seen = seen.get_mut(item as usize)?;
                    if std::mem::replace(seen, true) {
                        return None;
                    }
                }
            }
        }
        seen.iter().all(|s| *s).then_some(Self { nodes, order })
    }

    /// A node.
    pub(super) fn branch(&self, node: u32) -> Branch {
        self.nodes[node as usize]
    }

    /// How many nodes there are.
    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// All nodes, children before their parents.
    pub(super) fn upward(&self) -> impl Iterator<Item = u32> + '_ {
        self.order.iter().rev().copied()
    }
}

fn longest_axis(bounds: Bounds) -> usize {
    let size = bounds.size();
    if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    }
}

/// The boxes for obvhs: scaled by a power of two to coordinates below 2, so that areas stay in range and the tree does
/// not change with the scene's scale, and each grown by a small amount of its own. PLOC merges pairs that choose each
/// other; among equal boxes in a row or in one place all choose the next, and a pass would merge only one pair.
fn roughened(boxes: &[Bounds]) -> Vec<Aabb> {
    let reach = boxes.iter().map(Bounds::reach).fold(0.0, f32::max);
    let exponent = (reach.to_bits() >> 23).clamp(1, 253);
    let scale = f32::from_bits((254 - exponent) << 23);
    (boxes.iter().enumerate())
        .map(|(i, bounds)| {
            let (min, max) = (Vec3A::from(bounds.min * scale), Vec3A::from(bounds.max * scale));
            let noise = |side: u32| {
                let noise = [0, 1, 2].map(|axis| scrambled(i as u32 * 6 + side * 3 + axis));
                Vec3A::from_array(noise) * ((max - min) * (1.0 / 1024.0) + 1.0 / (1 << 22) as f32)
            };
            Aabb::new(min - noise(0), max + noise(1))
        })
        .collect()
}

/// A number in 0..1 that looks random (the finaliser of `MurmurHash3`).
fn scrambled(index: u32) -> f32 {
    let mut h = index.wrapping_add(0x9e37_79b9);
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    (h ^ (h >> 16)) as f32 * (1.0 / (1u64 << 32) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn row(count: usize) -> Vec<Bounds> {
        (0..count).map(|i| Bounds::around([Vec3::X * i as f32, Vec3::X * i as f32 + Vec3::ONE])).collect()
    }

    fn depth(tree: &Binary) -> usize {
        let mut depths = vec![0; tree.len()];
        for node in tree.upward() {
            if let Branch::Fork([a, b]) = tree.branch(node) {
                depths[node as usize] = 1 + depths[a as usize].max(depths[b as usize]);
            }
        }
        depths[0]
    }

    #[test]
    fn equal_boxes_do_not_make_chains() {
        for boxes in [row(50_000), vec![row(1)[0]; 50_000], vec![Bounds::around([Vec3::ZERO]); 50_000]] {
            let tree = Binary::build(&boxes);
            assert_eq!(tree.len(), 2 * boxes.len() - 1);
            assert!(depth(&tree) < 64, "{}", depth(&tree));
        }
    }

    #[test]
    fn halving_is_balanced() {
        for count in [1, 2, 3, 7, 1000] {
            let tree = Binary::halved(&row(count));
            assert_eq!(depth(&tree), count.next_power_of_two().ilog2() as usize);
        }
    }

    #[test]
    fn broken_trees_are_refused() {
        let twice = vec![Branch::Fork([1, 2]), Branch::Item(0), Branch::Item(0)];
        assert!(Binary::checked(twice, 1).is_none());
        assert!(Binary::checked(vec![Branch::Fork([0, 0])], 1).is_none());
        assert!(Binary::checked(vec![Branch::Item(0)], 2).is_none());
        assert!(Binary::checked(vec![Branch::Fork([1, 5]), Branch::Item(0)], 1).is_none());
    }
}

//! Walking an eight-wide tree along a ray.

use super::lanes::{Lanes, WIDTH};
use super::prepared::Prepared;
use super::wide::{Child, MAX_DEPTH, Node, Tree};
use std::mem::MaybeUninit;
use std::ops::ControlFlow;

/// Factor on the far end of an interval, for the rounding of both ends: at most 8 · 2⁻²⁴ in the slabs, a few units more
/// where the triangle test rounds otherwise.
const SLACK: f32 = 1.0 + 1.0 / (1 << 19) as f32;

/// Entries that a walk can have open: on each level all children but the one gone into.
const STACK: usize = MAX_DEPTH * (WIDTH - 1) + WIDTH;

/// In which order the children of a node are visited.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    /// Nearest first: for the closest hit.
    Nearest,
    /// As they lie: for any hit and for all hits.
    Stored,
}

/// Type-level [`Order`], for code made once for each.
pub(super) trait Ordering {
    const ORDER: Order;
}

/// [`Order::Nearest`].
pub(super) struct Nearest;
/// [`Order::Stored`].
pub(super) struct Stored;

impl Ordering for Nearest {
    const ORDER: Order = Order::Nearest;
}
impl Ordering for Stored {
    const ORDER: Order = Order::Stored;
}

/// Calls `leaf` with every leaf whose box the ray meets at 0 ≤ t ≤ `limit`, in a fixed order. It gets the limit as it
/// stands and returns the new one, or breaks off the walk.
#[inline(always)]
pub(super) fn walk<L: Lanes, O: Ordering>(
    tree: &Tree,
    ray: &Prepared,
    mut limit: f32,
    mut leaf: impl FnMut(usize, f32) -> ControlFlow<(), f32>,
) -> ControlFlow<()> {
    let Some(mut current) = tree.root else { return ControlFlow::Continue(()) };
    let slabs = Slabs::<L>::new(ray);
    let mut slots = [MaybeUninit::uninit(); STACK];
    let mut stack = Stack { slots: &mut slots, len: 0 };
    loop {
        let next = if current.is_leaf() {
            limit = leaf(current.index(), limit)?;
            None
        } else {
            let node = &tree.nodes[current.index()];
            let (mask, near) = slabs.meet(node, limit);
            match O::ORDER {
                Order::Nearest => stack.push_sorted(node, mask, near),
                Order::Stored => stack.push_stored(node, mask),
            }
        };
        current = match next.or_else(|| stack.pop_within(limit * SLACK)) {
            Some(child) => child,
            None => return ControlFlow::Continue(()),
        };
    }
}

/// What the test of eight boxes needs of a ray.
struct Slabs<L> {
    inverse: [L; 3],
    offset: [L; 3],
    nearer: [usize; 3],
}

impl<L: Lanes> Slabs<L> {
    #[inline(always)]
    fn new(ray: &Prepared) -> Self {
        Self { inverse: ray.inverse.map(L::splat), offset: ray.offset.map(L::splat), nearer: ray.nearer }
    }

    /// The children whose boxes the ray meets at 0 ≤ t ≤ `limit`, and where it enters them.
    #[inline(always)]
    fn meet(&self, node: &Node, limit: f32) -> (u32, L) {
        let enter = |axis: usize| {
            let plane = &node.planes[axis][self.nearer[axis] & 1];
            L::load(plane).mul_sub(self.inverse[axis], self.offset[axis])
        };
        let leave = |axis: usize| {
            let plane = &node.planes[axis][(self.nearer[axis] & 1) ^ 1];
            L::load(plane).mul_sub(self.inverse[axis], self.offset[axis])
        };
        let near = enter(0).max(enter(1)).max(enter(2).max(L::splat(0.0)));
        let far = leave(0).min(leave(1)).min(leave(2).min(L::splat(limit)));
        (near.at_most(far.mul(L::splat(SLACK))), near)
    }
}

/// Children still to visit, each with the distance at which the ray enters it in the upper half of a word. Distances
/// are not negative, so words compare as distances do, and then as children.
struct Stack<'a> {
    /// Lent, so that `len` can be kept in a register and nothing is filled in advance.
    slots: &'a mut [MaybeUninit<u64>; STACK],
    /// Slots below this are written.
    len: usize,
}

impl Stack<'_> {
    #[inline(always)]
    fn push(&mut self, word: u64) {
        // The index is checked: a tree too deep for the stack would panic, not go astray.
        self.slots[self.len].write(word);
        self.len += 1;
    }

    #[inline(always)]
    #[expect(unsafe_code, reason = "filling 2 KB with zeros for every ray costs a tenth of its time")]
    fn read(&self, index: usize) -> u64 {
        debug_assert!(index < self.len);
        // SAFETY: slots below `len` were written by `push` or `write`, and callers stay below `len`.
        unsafe { self.slots[index].assume_init() }
    }

    #[inline(always)]
    fn pop_within(&mut self, limit: f32) -> Option<Child> {
        while self.len > 0 {
            let word = self.read(self.len - 1);
            self.len -= 1;
            if f32::from_bits((word >> 32) as u32) <= limit {
                return Some(Child(word as u32));
            }
        }
        None
    }

    /// Pushes the children in `mask` but the nearest, farthest first; returns the nearest.
    #[inline(always)]
    fn push_sorted<L: Lanes>(&mut self, node: &Node, mask: u32, near: L) -> Option<Child> {
        if mask == 0 {
            return None;
        }
        let first = mask.trailing_zeros() as usize;
        let rest = mask & (mask - 1);
        if rest == 0 {
            return Some(node.children[first & 7]);
        }
        let near = near.store();
        let word = |lane: usize| {
            (u64::from(near.0[lane & 7].to_bits()) << 32) | u64::from(node.children[lane & 7].0)
        };
        let (a, b) = (word(first), word(rest.trailing_zeros() as usize));
        let mut rest = rest & (rest - 1);
        let mut nearest = a.min(b);
        let base = self.len;
        self.push(a.max(b));
        while rest != 0 {
            let new = word(rest.trailing_zeros() as usize);
            rest &= rest - 1;
            let pushed = new.max(nearest);
            nearest = new.min(nearest);
            self.insert(base, pushed);
        }
        Some(Child(nearest as u32))
    }

    /// Puts a word among those from `base` on, which are sorted with the largest first.
    #[inline(always)]
    fn insert(&mut self, base: usize, word: u64) {
        self.push(word);
        let mut place = self.len - 1;
        while place > base && self.read(place - 1) < word {
            let other = self.read(place - 1);
            self.slots[place].write(other);
            place -= 1;
        }
        self.slots[place].write(word);
    }

    /// Pushes the children in `mask` but the first; returns that.
    #[inline(always)]
    fn push_stored(&mut self, node: &Node, mask: u32) -> Option<Child> {
        if mask == 0 {
            return None;
        }
        let mut rest = mask & (mask - 1);
        while rest != 0 {
            self.push(u64::from(node.children[rest.trailing_zeros() as usize & 7].0));
            rest &= rest - 1;
        }
        Some(node.children[mask.trailing_zeros() as usize & 7])
    }
}

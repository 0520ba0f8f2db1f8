//! A tree over many lights, in which one is found with about the probability that it counts at a point (Conty and Kulla
//! 2018, without splitting: a next event takes one light).

use crate::scene::light_bounds::{Cluster, LightBounds};
use crate::scene::lit::Lit;
use glam::Vec3;

/// Places where a part is cut, along each axis, are this many less one.
const BINS: usize = 12;
/// Below this depth parts are halved, so that none is deeper than this and the logarithm of their number.
const DEEP: u32 = 32;
/// Parts of more lights are built on two threads.
const APART: usize = 4096;
/// Share of choices that take every light alike. What is in the way is not known to the tree: without this, light that
/// only a faint lamp brings would be found hardly ever where brighter ones nearby are hidden.
const ALIKE: f64 = 1.0 / 32.0;

/// A tree over some lights, known by their places in a list.
#[derive(Clone, Debug)]
pub struct LightTree {
    /// Each part before its own: the first right behind it.
    nodes: Vec<Node>,
    /// Which part each light is in, at every depth: the least bit at the root, one for the second.
    trails: Vec<u64>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    cluster: Cluster,
    then: Then,
}

#[derive(Clone, Copy, Debug)]
enum Then {
    /// The second part is so many nodes on.
    Parts(u32),
    /// It is one light.
    Light(u32),
}

/// A light in the making of a tree.
#[derive(Clone, Copy)]
struct Leaf {
    light: u32,
    bounds: LightBounds,
}

impl LightTree {
    /// Over at least one light, each with a positive and finite intensity.
    pub fn new(bounds: &[LightBounds]) -> Self {
        let leaves = bounds.iter().enumerate().map(|(i, b)| Leaf { light: i as u32, bounds: *b }).collect();
        let (nodes, _) = build(leaves, 0);
        let mut trails = vec![0; bounds.len()];
        let mut open = vec![(0, 0, 0)];
        while let Some((at, trail, depth)) = open.pop() {
            match nodes[at].then {
                Then::Light(light) => trails[light as usize] = trail,
                Then::Parts(on) => {
                    open.push((at + 1, trail, depth + 1));
                    open.push((at + on as usize, trail | 1 << depth, depth + 1));
                }
            }
        }
        Self { nodes, trails }
    }

    /// Number of lights.
    pub fn len(&self) -> usize {
        self.trails.len()
    }

    /// Whether there is no light; never true.
    pub fn is_empty(&self) -> bool {
        self.trails.is_empty()
    }

    /// A light for a point, and the probability of that, by a number in [0, 1).
    pub fn sample(&self, lit: &Lit, u: f64) -> (u32, f64) {
        if u < ALIKE {
            let light = ((u / ALIKE * self.len() as f64) as usize).min(self.len() - 1);
            return (light as u32, self.probability(lit, light as u32));
        }
        let (mut u, mut at, mut probability) = ((u - ALIKE) / (1.0 - ALIKE), 0, 1.0);
        loop {
            u = u.min(1.0_f64.next_down());
            match self.nodes[at].then {
                Then::Light(light) => return (light, self.with_alike(probability)),
                Then::Parts(on) => {
                    let [first, second] = self.shares(lit, at, on);
                    if u < first {
                        (u, at, probability) = (u / first, at + 1, probability * first);
                    } else {
                        (u, at) = ((u - first) / (1.0 - first), at + on as usize);
                        probability *= second;
                    }
                }
            }
        }
    }

    /// Probability with which a light is sampled for a point, the same number to the bit.
    pub fn probability(&self, lit: &Lit, light: u32) -> f64 {
        let (mut trail, mut at, mut probability) = (self.trails[light as usize], 0, 1.0);
        while let Then::Parts(on) = self.nodes[at].then {
            probability *= self.shares(lit, at, on)[(trail & 1) as usize];
            at += if trail & 1 == 0 { 1 } else { on as usize };
            trail >>= 1;
        }
        self.with_alike(probability)
    }

    fn with_alike(&self, probability: f64) -> f64 {
        (1.0 - ALIKE) * probability + ALIKE / self.len() as f64
    }

    /// How likely each part of a node is.
    #[inline]
    fn shares(&self, lit: &Lit, at: usize, on: u32) -> [f64; 2] {
        let of = |at: usize| self.nodes[at].cluster.importance(lit);
        let (first, second) = (of(at + 1), of(at + on as usize));
        let sum = first + second;
        [first / sum, second / sum]
    }
}

/// The nodes over some leaves, and their bounds.
fn build(leaves: Vec<Leaf>, depth: u32) -> (Vec<Node>, LightBounds) {
    if let [leaf] = leaves[..] {
        let node = Node { cluster: Cluster::new(&leaf.bounds), then: Then::Light(leaf.light) };
        return (vec![node], leaf.bounds);
    }
    let together = leaves.len() <= APART;
    let [first, second] = parts(leaves, depth);
    let ((first, a), (second, b)) = if together {
        (build(first, depth + 1), build(second, depth + 1))
    } else {
        rayon::join(|| build(first, depth + 1), || build(second, depth + 1))
    };
    let bounds = a.union(&b);
    let then = Then::Parts(first.len() as u32 + 1);
    let mut nodes = Vec::with_capacity(1 + first.len() + second.len());
    nodes.push(Node { cluster: Cluster::new(&bounds), then });
    nodes.extend(first);
    nodes.extend(second);
    (nodes, bounds)
}

/// Cuts leaves in two where both parts together cost least.
fn parts(leaves: Vec<Leaf>, depth: u32) -> [Vec<Leaf>; 2] {
    let far = Vec3::splat(f32::INFINITY);
    let centres = || leaves.iter().map(|leaf| leaf.bounds.centre());
    let (lower, upper) = centres().fold((far, -far), |(low, high), c| (low.min(c), high.max(c)));
    let extent = upper - lower;
    let best = (0..3)
        .filter(|axis| depth < DEEP && extent[*axis] > 0.0)
        .filter_map(|axis| {
            let scale = BINS as f32 / extent[axis];
            let bin = |leaf: &Leaf| {
                let at = (leaf.bounds.centre()[axis] - lower[axis]) * scale;
                (at as usize).min(BINS - 1)
            };
            let (cost, cut) = cheapest(&leaves, bin)?;
            // Long parts are cut across.
            let cost = cost * f64::from(extent.max_element() / extent[axis]);
            Some((cost, axis, scale, cut))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((_, axis, scale, cut)) = best else { return halves(leaves, extent) };
    let bin = |leaf: &Leaf| ((leaf.bounds.centre()[axis] - lower[axis]) * scale) as usize;
    let (first, second) = leaves.into_iter().partition(|leaf| bin(leaf).min(BINS - 1) < cut);
    [first, second]
}

/// The cut between bins that costs least, with its cost: those before it are the first part.
fn cheapest(leaves: &[Leaf], bin: impl Fn(&Leaf) -> usize) -> Option<(f64, usize)> {
    let mut bins: [Option<LightBounds>; BINS] = [None; BINS];
    let with = |a: Option<LightBounds>, b: LightBounds| Some(a.map_or(b, |a| a.union(&b)));
    for leaf in leaves {
        let bin = &mut bins[bin(leaf)];
        *bin = with(*bin, leaf.bounds);
    }
    let mut before = [None; BINS];
    let mut all: Option<LightBounds> = None;
    for (i, bin) in bins.iter().enumerate() {
        before[i] = all;
        all = bin.map_or(all, |bin| with(all, bin));
    }
    let (mut after, mut best): (Option<LightBounds>, Option<(f64, usize)>) = (None, None);
    for cut in (1..BINS).rev() {
        after = bins[cut].map_or(after, |bin| with(after, bin));
        if let (Some(before), Some(after)) = (before[cut], after) {
            let cost = before.cost() + after.cost();
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, cut));
            }
        }
    }
    best
}

/// Halves by place along the longest axis.
fn halves(mut leaves: Vec<Leaf>, extent: Vec3) -> [Vec<Leaf>; 2] {
    let axis = (0..3).max_by(|a, b| extent[*a].total_cmp(&extent[*b])).unwrap_or(0);
    let key = |leaf: &Leaf| leaf.bounds.centre()[axis];
    leaves.sort_by(|a, b| key(a).total_cmp(&key(b)));
    let second = leaves.split_off(leaves.len() / 2);
    [leaves, second]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{Dimension, Sampler};
    use crate::scene::light_bounds::tests::{lights, points};
    use crate::scene::lit::LitFrom;
    use crate::scene::material::Sides;

    #[test]
    fn probabilities_are_positive_and_add_up_to_one() {
        for (n, size, decades) in [
            (1, 1.0, 0.0),
            (2, 1.0, 60.0),
            (7, 1e-6, 1.0),
            (300, 1.0, 2.0),
            (300, 1e6, 60.0),
            (5000, 1.0, 13.0),
        ] {
            let all = lights(n, [size, 0.1 * size, decades]);
            let tree = LightTree::new(&all);
            for lit in
                points(20, size).chain([Lit { point: all[0].centre(), ..points(1, size).next().unwrap() }])
            {
                let each: Vec<f64> = (0..n).map(|light| tree.probability(&lit, light)).collect();
                assert!(each.iter().all(|p| *p > 0.999 * ALIKE / f64::from(n) && p.is_finite()));
                let sum: f64 = each.iter().sum();
                assert!((sum - 1.0).abs() < 1e-12, "{n} lights, size {size}, {lit:?}: {sum}");
            }
        }
    }

    #[test]
    fn lights_are_picked_as_often_as_their_probability_says() {
        let (n, picks) = (300_u32, 1 << 18);
        let tree = LightTree::new(&lights(n, [1.0, 0.1, 3.0]));
        for (k, lit) in points(6, 1.0).enumerate() {
            let mut counts = vec![0_u32; n as usize];
            for i in 0..picks {
                // Independent numbers, so that counts are Poisson's.
                let sampler = Sampler::new(7, k as u32, [i, 1], 0);
                let pair = sampler.pair(Dimension::Film);
                let (light, probability) =
                    tree.sample(&lit, f64::from(pair.x) + f64::from(pair.y) / 16_777_216.0);
                assert_eq!(probability, tree.probability(&lit, light), "the same number to the bit");
                counts[light as usize] += 1;
            }
            let wanted = |light: u32| tree.probability(&lit, light) * f64::from(picks);
            let chi: f64 =
                (0..n).map(|l| (f64::from(counts[l as usize]) - wanted(l)).powi(2) / wanted(l)).sum();
            // The least is expected 27 times. 299 degrees of freedom: the standard deviation is √(2 · 299).
            let sigmas = (chi - 299.0) / 598.0_f64.sqrt();
            assert!(sigmas.abs() < 5.0, "{lit:?}: χ² is {chi}, {sigmas} standard deviations off");
        }
    }

    #[test]
    fn trees_are_shallow_whatever_the_places() {
        let at_one_place = vec![LightBounds::of_point(&[Vec3::ONE], 1.0); 3000];
        // Each twice as far as the one before: cutting by cost takes them off one by one.
        let doubling: Vec<_> = (0..120)
            .map(|i| {
                LightBounds::of_point(&[Vec3::X * libm::exp2f(i as f32)], libm::exp2(-2.0 * f64::from(i)))
            })
            .collect();
        for all in [at_one_place, doubling, lights(3000, [1.0, 0.1, 60.0])] {
            let tree = LightTree::new(&all);
            assert_eq!(tree.nodes.len(), 2 * all.len() - 1);
            let depth = tree.trails.iter().map(|trail| 64 - trail.leading_zeros()).max().unwrap_or(0);
            assert!(depth <= DEEP + 12, "{depth} is deep");
        }
    }

    #[test]
    fn lamps_that_face_away_or_are_far_are_rarely_taken() {
        let lamp = |x: f32, up: bool| {
            let [a, b, c] = [Vec3::new(x, 1.0, 0.0), Vec3::new(x, 1.0, 0.1), Vec3::new(x + 0.1, 1.0, 0.0)];
            LightBounds::of_triangle(if up { [a, b, c] } else { [a, c, b] }, Sides::Front, 1.0)
        };
        // Above the floor: facing down, facing up, facing down far away.
        let tree = LightTree::new(&[lamp(0.0, false), lamp(0.2, true), lamp(9.0, false)]);
        let lit = Lit { point: Vec3::ZERO, normal: Vec3::Y, from: LitFrom::Above };
        let p = [0, 1, 2].map(|light| tree.probability(&lit, light));
        assert!(p[0] > 0.97 && p[1] < 0.011 && p[2] < 0.015, "{p:?}");
        let below = Lit { normal: -Vec3::Y, ..lit };
        assert!(tree.probability(&below, 0) < p[0], "nothing is above it");
    }
}

//! Everything that rays meet: one tree a mesh, and one over their placements.

use super::bounds::Bounds;
use super::build_error::{BuildError, check_count};
use super::collapse;
use super::instance::{Instance, Moved, Placement, STANDS};
use super::lanes::{Lanes, Native};
use super::mesh::{MeshTree, Piece};
use super::moment::Moment;
use super::prepared::Prepared;
use super::ray::{Hit, Ray};
use super::triangle::{Block, Found};
use super::walk::{Nearest, Ordering, Stored, walk};
use super::wide::Tree;
use glam::{Affine3A, Vec2};
use std::ops::ControlFlow;

/// Placed meshes. Answers depend on the geometry and the ray alone: not on threads, nor on what was asked before.
#[derive(Clone, Debug)]
pub struct Aggregate {
    meshes: Vec<MeshTree>,
    instances: Vec<Instance>,
    /// The transforms at each knot of the instances that move.
    motions: Vec<Box<[Affine3A]>>,
    top: Tree,
    /// The instance in each leaf of `top`.
    leaves: Vec<u32>,
    /// The instance where there is but one and it is not moved: rays then start in its mesh.
    only: Option<u32>,
    bounds: Bounds,
}

impl Aggregate {
    /// Places meshes; a placement's index is the `instance` of hits on it.
    pub fn build(meshes: Vec<MeshTree>, placements: &[Placement]) -> Result<Self, BuildError> {
        Self::moving(meshes, placements, |_| &[])
    }

    /// Places meshes of which some move: `knots` tells the transforms of a placement at each knot of the scene's motion,
    /// none of one that stands. Its `to_world` is the first of them. Every one of them can be inverted.
    pub fn moving<'k>(
        meshes: Vec<MeshTree>,
        placements: &[Placement],
        knots: impl Fn(usize) -> &'k [Affine3A],
    ) -> Result<Self, BuildError> {
        check_count(placements.len())?;
        let mut instances = Vec::with_capacity(placements.len());
        let mut motions = Vec::new();
        let (mut boxes, mut filled) = (Vec::new(), Vec::new());
        for (index, placement) in placements.iter().enumerate() {
            let mesh = meshes.get(placement.mesh as usize).ok_or(BuildError::Mesh {
                placement: index,
                mesh: placement.mesh,
                meshes: meshes.len(),
            })?;
            let bad = BuildError::Transform { placement: index };
            let path = knots(index);
            let (instance, bounds) = if path.is_empty() {
                let instance = Instance::new(*placement).ok_or_else(|| bad.clone())?;
                (instance, instance.world_bounds(mesh.bounds()).ok_or(bad)?)
            } else {
                let number = motions.len() as u32;
                motions.push(path.into());
                let instance =
                    Instance::moving(placement.mesh, path[0], number).ok_or_else(|| bad.clone())?;
                (instance, Instance::bounds_on(path, mesh.bounds()).ok_or(bad)?)
            };
            instances.push(instance);
            if !bounds.is_empty() {
                boxes.push(bounds);
                filled.push(index as u32);
            }
        }
        let (top, leaves) = collapse::build(&boxes, 1);
        let leaves: Vec<u32> = leaves.iter().map(|items| filled[items[0] as usize]).collect();
        let only = match leaves[..] {
            [one] if instances[one as usize].moved.is_none() => Some(one),
            _ => None,
        };
        let bounds = boxes.iter().fold(Bounds::EMPTY, |all, b| all.union(*b));
        Ok(Self { meshes, instances, motions, top, leaves, only, bounds })
    }

    /// The box around everything, in the world.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The placements, by [`Hit::instance`].
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// The nearest hit with 0 < t < `t_max` that `accept` takes; of hits at the same distance the one on the smallest
    /// instance, then triangle. `accept` is asked about some of the hits in any order, so it must depend on nothing
    /// but the hit.
    pub fn closest(&self, ray: &Ray, accept: impl Fn(&Hit) -> bool) -> Option<Hit> {
        self.closest_with::<Native>(ray, accept)
    }

    /// Whether anything that `accept` takes lies on 0 < t < `t_max`.
    pub fn occluded(&self, ray: &Ray, accept: impl Fn(&Hit) -> bool) -> bool {
        self.occluded_with::<Native>(ray, accept)
    }

    /// The product of `pass` over all hits on 0 < t < `t_max`, each triangle once; ended early at zero. The order
    /// of the factors is that of the tree, so the same geometry and ray give the same bits.
    pub fn transmittance(&self, ray: &Ray, pass: impl Fn(&Hit) -> f32) -> f32 {
        self.transmittance_with::<Native>(ray, pass)
    }

    pub(super) fn closest_with<L: Lanes>(&self, ray: &Ray, accept: impl Fn(&Hit) -> bool) -> Option<Hit> {
        let end = Hit { t: ray.t_max, instance: 0, triangle: 0, barycentric: Vec2::ZERO };
        let mut best = Best { hit: end, found: false, accept };
        let _: ControlFlow<()> = self.visit::<L, Nearest>(ray, &mut best);
        best.found.then_some(best.hit)
    }

    pub(super) fn occluded_with<L: Lanes>(&self, ray: &Ray, accept: impl Fn(&Hit) -> bool) -> bool {
        self.visit::<L, Stored>(ray, &mut Any { t_max: ray.t_max, accept }).is_break()
    }

    pub(super) fn transmittance_with<L: Lanes>(&self, ray: &Ray, pass: impl Fn(&Hit) -> f32) -> f32 {
        let mut product = Product { t_max: ray.t_max, value: 1.0, pass };
        let _: ControlFlow<()> = self.visit::<L, Stored>(ray, &mut product);
        product.value
    }

    #[inline(always)]
    fn visit<L: Lanes, O: Ordering>(&self, ray: &Ray, visitor: &mut impl Visitor) -> ControlFlow<()> {
        if ray.t_max.is_nan() || ray.t_max <= 0.0 {
            return ControlFlow::Continue(());
        }
        let Some(prepared) = Prepared::new(ray.origin, ray.direction, ray.t_max) else {
            return ControlFlow::Continue(());
        };
        if let Some(only) = self.only {
            return self.visit_mesh::<L, O>(only, ray.moment, &prepared, visitor);
        }
        walk::<L, O>(&self.top, &prepared, prepared.inward(visitor.limit()), |leaf, limit| {
            let id = self.leaves[leaf];
            let instance = &self.instances[id as usize];
            match &instance.moved {
                None => self.visit_mesh::<L, O>(id, ray.moment, &prepared, visitor)?,
                Some(moved) => {
                    let inner = if instance.motion == STANDS {
                        moved.ray_inward(ray)
                    } else {
                        self.inside_moving(instance.motion, ray)
                    };
                    match inner {
                        Some(inner) => self.visit_mesh::<L, O>(id, ray.moment, &inner, visitor)?,
                        None => return ControlFlow::Continue(limit),
                    }
                }
            }
            ControlFlow::Continue(prepared.inward(visitor.limit()))
        })
    }

    /// A ray in the space of an instance that moves; `None` where the instance is flat at that moment.
    #[inline(never)]
    fn inside_moving(&self, motion: u32, ray: &Ray) -> Option<Prepared> {
        let moved = Moved::new(ray.moment.transform(&self.motions[motion as usize]))?;
        moved.ray_inward(ray)
    }

    fn visit_mesh<L: Lanes, O: Ordering>(
        &self,
        instance: u32,
        moment: Moment,
        ray: &Prepared,
        visitor: &mut impl Visitor,
    ) -> ControlFlow<()> {
        let mesh = &self.meshes[self.instances[instance as usize].mesh as usize];
        if let Some(piece) = mesh.piece(moment) {
            return Self::visit_piece::<L, O>(piece, instance, moment, ray, visitor);
        }
        walk::<L, O>(&mesh.tree, ray, ray.inward(visitor.limit()), |leaf, limit| {
            let block = &mesh.blocks[leaf];
            let Some(found) = block.intersect::<L>(ray, limit) else { return ControlFlow::Continue(limit) };
            bring(&found, block, instance, ray, visitor)?;
            ControlFlow::Continue(ray.inward(visitor.limit()))
        })
    }

    #[inline(never)]
    fn visit_piece<L: Lanes, O: Ordering>(
        piece: &Piece,
        instance: u32,
        moment: Moment,
        ray: &Prepared,
        visitor: &mut impl Visitor,
    ) -> ControlFlow<()> {
        walk::<L, O>(&piece.tree, ray, ray.inward(visitor.limit()), |leaf, limit| {
            let block = Block::between::<L>(&piece.before[leaf], &piece.after[leaf], moment);
            let Some(found) = block.intersect::<L>(ray, limit) else { return ControlFlow::Continue(limit) };
            bring(&found, &block, instance, ray, visitor)?;
            ControlFlow::Continue(ray.inward(visitor.limit()))
        })
    }
}

/// Brings the hits found in a block to a visitor.
#[inline(always)]
fn bring(
    found: &Found,
    block: &Block,
    instance: u32,
    ray: &Prepared,
    visitor: &mut impl Visitor,
) -> ControlFlow<()> {
    let mut mask = found.mask;
    while mask != 0 {
        let lane = mask.trailing_zeros() as usize & 7;
        mask &= mask - 1;
        visitor.hit(Hit {
            t: ray.outward(found.t.0[lane]),
            instance,
            triangle: block.id(lane),
            barycentric: Vec2::new(found.second.0[lane], found.third.0[lane]),
        })?;
    }
    ControlFlow::Continue(())
}

/// What is done with the hits of one ray.
trait Visitor {
    /// Hits farther than this do not matter any more.
    fn limit(&self) -> f32;
    /// Takes a hit with 0 < t ≤ `limit`; breaks where no other matters.
    fn hit(&mut self, hit: Hit) -> ControlFlow<()>;
}

/// Keeps the nearest hit.
struct Best<A> {
    hit: Hit,
    found: bool,
    accept: A,
}

impl<A: Fn(&Hit) -> bool> Visitor for Best<A> {
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.hit.t
    }

    #[inline(always)]
    fn hit(&mut self, hit: Hit) -> ControlFlow<()> {
        if hit.precedes(&self.hit) && (self.accept)(&hit) {
            self.hit = hit;
            self.found = true;
        }
        ControlFlow::Continue(())
    }
}

/// Breaks at the first hit.
struct Any<A> {
    t_max: f32,
    accept: A,
}

impl<A: Fn(&Hit) -> bool> Visitor for Any<A> {
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.t_max
    }

    #[inline(always)]
    fn hit(&mut self, hit: Hit) -> ControlFlow<()> {
        if hit.t < self.t_max && (self.accept)(&hit) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

/// Multiplies what passes.
struct Product<P> {
    t_max: f32,
    value: f32,
    pass: P,
}

impl<P: Fn(&Hit) -> f32> Visitor for Product<P> {
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.t_max
    }

    #[inline(always)]
    fn hit(&mut self, hit: Hit) -> ControlFlow<()> {
        if hit.t < self.t_max {
            self.value *= (self.pass)(&hit);
        }
        if self.value == 0.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    /// Numbers that look random.
    fn noise(i: u32) -> f32 {
        let z = i.wrapping_mul(0x9e37_79b9) ^ 0x85eb_ca6b;
        let z = (z ^ (z >> 15)).wrapping_mul(0x2c1b_3c6d);
        (z ^ (z >> 12)) as f32 / u32::MAX as f32 * 2.0 - 1.0
    }

    fn cloud(seed: u32, count: u32, size: f32) -> Vec<Vec3> {
        let point = |i: u32| Vec3::new(noise(i), noise(i + 7919), noise(i + 104_729));
        (0..count).map(|i| point(seed + i / 3) + point(seed + i + 50_000) * size).collect()
    }

    fn rays(moment: Moment) -> impl Iterator<Item = Ray> {
        (0..400).map(move |i| {
            let origin = Vec3::new(noise(3 * i), noise(3 * i + 1), noise(3 * i + 2)) * 3.0;
            let target = Vec3::new(noise(5 * i + 9), noise(5 * i + 11), noise(5 * i + 12)) * 0.7;
            Ray::new(origin, target - origin).at(moment)
        })
    }

    /// A mesh that changes its shape has, at every moment, the hits of a mesh that always had that shape: the same bits.
    #[test]
    fn a_shape_between_knots_is_hit_as_if_it_stood_still() {
        let triangles: Vec<[u32; 3]> = (0..300).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let knots = [cloud(1, 900, 0.2), cloud(2, 900, 0.3), cloud(77, 900, 0.1)];
        let moving = MeshTree::moving(&[&knots[0], &knots[1], &knots[2]], &triangles).unwrap();
        let identity = [Placement { mesh: 0, to_world: Affine3A::IDENTITY }];
        let moving = Aggregate::build(vec![moving], &identity).unwrap();
        let mut hits = 0;
        for (piece, passed) in [(0, 0.0), (0, 0.37), (0, 0.999), (1, 0.0), (1, 0.5)] {
            let moment = Moment { piece, passed };
            let [a, b] = moment.ends(&knots);
            let now: Vec<Vec3> = a.iter().zip(b).map(|(a, b)| moment.vector(*a, *b)).collect();
            let still = MeshTree::build(&now, &triangles).unwrap();
            let still = Aggregate::build(vec![still], &identity).unwrap();
            for ray in rays(moment) {
                let hit = moving.closest(&ray, |_| true);
                assert_eq!(hit, still.closest(&ray, |_| true));
                assert_eq!(moving.occluded(&ray, |_| true), hit.is_some());
                hits += usize::from(hit.is_some());
            }
        }
        assert!((200..1800).contains(&hits), "{hits} hits: the test sees too little");
    }

    /// An instance that moves is hit, at every moment, as one that always stood there: the same bits.
    #[test]
    fn an_instance_between_knots_is_hit_as_if_it_stood_there() {
        let triangles: Vec<[u32; 3]> = (0..100).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let tree = MeshTree::build(&cloud(5, 300, 0.4), &triangles).unwrap();
        let knots: Vec<Affine3A> = (0..4)
            .map(|i| {
                let turn = Quat::from_rotation_z(0.6 * i as f32) * Quat::from_rotation_x(0.2 * i as f32);
                let scale = Vec3::new(0.5, 0.4 + 0.1 * i as f32, 0.3);
                Affine3A::from_scale_rotation_translation(scale, turn, Vec3::new(0.3 * i as f32, -0.2, 0.1))
            })
            .collect();
        let first = Placement { mesh: 0, to_world: knots[0] };
        let moving = Aggregate::moving(vec![tree.clone()], &[first, first], |i| {
            if i == 0 { knots.as_slice() } else { &[] }
        });
        let moving = moving.unwrap();
        let mut hits = 0;
        for (piece, passed) in [(0, 0.25), (1, 0.0), (2, 0.5), (2, 0.999)] {
            let moment = Moment { piece, passed };
            let there = Placement { mesh: 0, to_world: moment.transform(&knots) };
            let still = Aggregate::build(vec![tree.clone()], &[there, first]).unwrap();
            for ray in rays(moment) {
                let hit = moving.closest(&ray, |_| true);
                assert_eq!(hit, still.closest(&ray, |_| true));
                hits += usize::from(hit.is_some_and(|hit| hit.instance == 0));
            }
        }
        assert!(hits > 150, "{hits} hits: the test sees too little");
    }
}

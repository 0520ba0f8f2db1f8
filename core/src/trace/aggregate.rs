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
        let Some(prepared) = Prepared::new(ray.origin, ray.direction) else {
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
                        Prepared::new(moved.point_inward(ray.origin), moved.direction_inward(ray.direction))
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
        Prepared::new(moved.point_inward(ray.origin), moved.direction_inward(ray.direction))
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

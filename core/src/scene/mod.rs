//! What a render may ask of a scene: camera, meshes, materials, textures, lights, environment.

pub mod bounds;
pub mod camera;
pub mod data;
pub mod distribution;
pub mod emission;
pub mod emitter;
pub mod environment;
pub mod finish;
pub mod importance;
pub mod instance;
pub mod interaction;
pub mod knots;
pub mod light;
pub mod light_bounds;
pub mod light_names;
pub mod light_tree;
pub mod lights;
pub mod lit;
pub mod material;
pub mod mesh;
pub mod nearby;
pub mod normalisation;
pub mod punctual;
pub mod texture;
pub mod view;

use crate::math::colour::Rgb;
use crate::sampler::decide;
use crate::scene::data::SceneData;
use crate::scene::environment::Environment;
use crate::scene::interaction::{Interaction, Side};
use crate::scene::lights::Lights;
use crate::scene::material::{Coverage, Sides};
use crate::scene::mesh::Mesh;
use crate::scene::view::{View, Views};
use crate::trace::aggregate::Aggregate;
use crate::trace::build_error::BuildError;
use crate::trace::instance::Placement;
use crate::trace::moment::Moment;
use crate::trace::ray::{Hit, Ray};
use glam::Vec3;
use rayon::prelude::*;

/// A scene that is ready to be rendered: its trees are built, its lights are gathered.
#[derive(Clone, Debug)]
pub struct Scene {
    /// What the file says.
    pub data: SceneData,
    /// Light from infinitely far.
    pub environment: Option<Environment>,
    /// What next events are made to.
    pub lights: Lights,
    views: Views,
    aggregate: Aggregate,
    coverage: SceneCoverage,
    unlit: Unlit,
}

/// Surfaces lie back to back within this many error bounds of their points: those of both, along rays that meet them at
/// angles of up to 86°.
const BACK_TO_BACK: f32 = 32.0;

/// Whether anything in a scene can be looked through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum SceneCoverage {
    Opaque,
    Partly,
}

/// Whether a scene has unlit surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unlit {
    /// Some.
    Some,
    /// None.
    None,
}

impl Scene {
    /// Builds the trees, a mesh a thread, and gathers the lights.
    pub fn new(
        mut data: SceneData,
        environment: Option<Environment>,
        views: Views,
    ) -> Result<Self, BuildError> {
        let trees = data.meshes.par_iter().map(Mesh::tree).collect::<Result<Vec<_>, _>>()?;
        let placements: Vec<Placement> = (data.instances.iter())
            .map(|i| Placement { mesh: i.mesh.0, to_world: i.placement.to_world() })
            .collect();
        let aggregate = Aggregate::moving(trees, &placements, |i| data.instances[i].placement.knots())?;
        data.keep_faces();
        let opaque = data.materials.iter().all(|m| m.coverage == Coverage::Opaque);
        let coverage = if opaque { SceneCoverage::Opaque } else { SceneCoverage::Partly };
        let unlit = data.materials.iter().any(|m| m.unlit.is_some());
        let unlit = if unlit { Unlit::Some } else { Unlit::None };
        let lights = Lights::new(&data, environment.as_ref());
        Ok(Self { data, environment, lights, views, aggregate, coverage, unlit })
    }

    /// When a sample is taken: at the share of the shutter's time that `share` tells, which is not asked where nothing
    /// moves.
    #[inline]
    pub fn moment(&self, share: impl FnOnce() -> f32) -> Moment {
        if self.data.knots.is_still() { Moment::STILL } else { self.data.knots.moment(share()) }
    }

    /// From where it is seen at a moment.
    #[inline]
    pub fn view(&self, moment: Moment) -> View {
        self.views.at(moment)
    }

    /// Where all rays from the eye start at all moments, if that is one point.
    pub fn eye(&self) -> Option<Vec3> {
        if self.data.knots.is_still() { self.view(Moment::STILL).eye() } else { None }
    }

    /// The nearest surface on a ray. A surface of partial coverage is there with the probability of its alpha,
    /// decided by `key`.
    #[inline]
    pub fn closest(&self, ray: &Ray, key: impl FnOnce() -> u64) -> Option<Hit> {
        if self.coverage == SceneCoverage::Opaque {
            return self.aggregate.closest(ray, |_| true);
        }
        let key = key();
        self.aggregate.closest(ray, |hit| {
            let alpha = self.data.alpha(hit.instance, hit.triangle, hit.barycentric);
            alpha >= 1.0 || decide(key, u64::from(hit.instance) << 32 | u64::from(hit.triangle)) < alpha
        })
    }

    /// Whether it has unlit surfaces.
    #[inline]
    pub fn unlit(&self) -> Unlit {
        self.unlit
    }

    /// What is seen of the unlit surface that a ray met at a point. Where two lie back to back, as in baked scenes, each
    /// shows on its own side, whichever was met.
    pub fn unlit_on(&self, ray: &Ray, at: &Interaction<'_>) -> Option<Rgb> {
        let own = at.shown()?;
        if at.side(-ray.direction) == Side::Front || at.material.sides == Sides::Both {
            return Some(own);
        }
        let (distance, bound) = ((at.position - ray.origin).dot(ray.direction), BACK_TO_BACK * at.error());
        let fronts = |hit: &Hit| {
            let there = self.data.interaction(hit.instance, hit.triangle, hit.barycentric, ray.moment);
            hit.t >= distance - bound
                && there.material.unlit.is_some()
                && there.side(-ray.direction) == Side::Front
                && there.alpha() > 0.0
        };
        let until = Ray { t_max: distance + bound, ..*ray };
        let twin = self.aggregate.closest(&until, fronts);
        twin.map_or(Some(own), |twin| {
            self.data.interaction(twin.instance, twin.triangle, twin.barycentric, ray.moment).shown()
        })
    }

    /// Share of light that passes along a ray: the product of 1 − α of all surfaces on it.
    #[inline]
    pub fn transmittance(&self, ray: &Ray) -> f32 {
        if self.coverage == SceneCoverage::Opaque {
            return if self.aggregate.occluded(ray, |_| true) { 0.0 } else { 1.0 };
        }
        self.aggregate
            .transmittance(ray, |hit| 1.0 - self.data.alpha(hit.instance, hit.triangle, hit.barycentric))
    }
}

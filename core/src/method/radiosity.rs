//! Diffuse light from finite elements: `LD*E`.

use crate::bsdf::Bsdf;
use crate::bsdf::event::Transport;
use crate::math::colour::Rgb;
use crate::method::camera::camera_ray;
use crate::radiosity::element::Element;
use crate::radiosity::hemisphere::Numbers;
use crate::radiosity::reflectance;
use crate::radiosity::solution::Solution;
use crate::sampler::{Dimension, Sampler, Use};
use crate::scene::Scene;
use crate::scene::interaction::{Interaction, Side};
use crate::settings::Settings;
use crate::trace::moment::Moment;
use glam::Vec3;

/// How the solution becomes a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reconstruction {
    /// What is seen gathers light from its surroundings once more, and reads the solution there: patches are not seen.
    Gather,
    /// What is seen shows the solution, interpolated: without noise, as coarse as the patches.
    Interpolate,
}

impl Reconstruction {
    /// How often light may be scattered before the solution is read, for paths of at most `bounces` scatterings.
    pub fn scatterings(self, bounces: Option<u32>) -> Option<u32> {
        match self {
            Self::Gather => bounces.map(|n| n.saturating_sub(1)),
            Self::Interpolate => bounces,
        }
    }
}

/// One sample of the radiance that reaches a pixel by `LD*E`: emission, and diffuse light by the solution, which holds
/// as many scatterings as [`Reconstruction::scatterings`] says. Adds to `rays` what it traces.
pub fn sample(
    scene: &Scene,
    solution: &Solution,
    settings: &Settings,
    reconstruction: Reconstruction,
    pixel: [u32; 2],
    sampler: &Sampler,
    rays: &mut u64,
) -> Rgb {
    let ray = camera_ray(scene, settings, pixel, sampler, Moment::STILL);
    *rays += 1;
    let Some(hit) = scene.closest(&ray, || sampler.key(Dimension::Eye(0, Use::Alpha))) else {
        return scene.environment.as_ref().map_or(Rgb::ZERO, |e| e.radiance(ray.direction));
    };
    let at = scene.data.interaction(hit.instance, hit.triangle, hit.barycentric, Moment::STILL);
    let back = -ray.direction;
    let side = at.side(back);
    if let Some(shown) = scene.unlit_on(&ray, &at) {
        return shown;
    }
    let emission = if at.material.emits() { at.emission(side) } else { Rgb::ZERO };
    let wo = at.shading.to_local(back);
    let sign = if side == Side::Front { 1.0 } else { -1.0 };
    if settings.bounces == Some(0) || wo.z * sign <= 0.0 {
        return emission;
    }
    let bsdf = Bsdf::from_surface(&at.surface());
    emission
        + match reconstruction {
            Reconstruction::Gather => {
                gather(scene, solution, settings, &at, side, (&bsdf, wo), sampler, rays)
            }
            Reconstruction::Interpolate => {
                let (patch, local) = solution.patches().at(hit.instance, hit.triangle, hit.barycentric);
                reflectance::towards(&bsdf, wo) * solution.arriving(Element::new(patch, side), local)
            }
        }
}

#[expect(clippy::too_many_arguments, reason = "what a point is, and what is around it")]
fn gather(
    scene: &Scene,
    solution: &Solution,
    settings: &Settings,
    at: &Interaction<'_>,
    side: Side,
    (bsdf, wo): (&Bsdf, Vec3),
    sampler: &Sampler,
    rays: &mut u64,
) -> Rgb {
    let numbers = Numbers {
        direction: sampler.pair(Dimension::Eye(0, Use::Direction)),
        light: sampler.pair(Dimension::Eye(0, Use::Light)),
        place: sampler.pair(Dimension::Eye(0, Use::LightPoint)),
        key: sampler.key(Dimension::Eye(1, Use::Alpha)),
    };
    let diffuse = |wi: Vec3| bsdf.eval(wo, wi, Transport::Radiance).diffuse;
    let look = solution.surroundings(scene, settings.shadows).look(at, side, diffuse, numbers, rays);
    let onward = look.onward.map(|onward| onward.weight * solution.leaving(onward.element, onward.local));
    look.direct + onward.unwrap_or(Rgb::ZERO)
}

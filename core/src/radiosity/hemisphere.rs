//! One look around from a point: light straight from sources, and the diffuse surface behind one direction.

use crate::math::colour::Rgb;
use crate::math::warp;
use crate::radiosity::element::Element;
use crate::radiosity::patch::{Patch, Patches};
use crate::scene::Scene;
use crate::scene::interaction::{Interaction, Side};
use crate::scene::light::{FoundBy, ShadowEnd};
use crate::settings::Shadows;
use crate::trace::moment::Moment;
use crate::trace::ray::Ray;
use core::f32::consts::FRAC_1_PI;
use glam::{Vec2, Vec3};

/// Emitters that take up at least this share of all area are found by directions alone.
const WIDE: f64 = 0.125;

/// How light from sources that have an extent is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sources {
    /// By directions and by next events, weighted by the balance heuristic.
    Sampled,
    /// By directions alone, since sources are wide: what a closed room that shines everywhere holds is then exact.
    Met,
}

impl Sources {
    /// What suits a scene.
    pub fn of(scene: &Scene, patches: &Patches) -> Self {
        let shines = |p: &&Patch| scene.data.material(p.instance, p.triangle).emits();
        let emitting: f64 = patches.all().iter().filter(shines).map(Patch::area).sum();
        let uneven = scene.environment.as_ref().is_some_and(|e| e.size() != (1, 1));
        let narrow = emitting > 0.0 && emitting < WIDE * patches.area();
        if uneven || narrow { Self::Sampled } else { Self::Met }
    }
}

/// The numbers that a look takes.
#[derive(Clone, Copy, Debug)]
pub struct Numbers {
    /// For the direction.
    pub direction: Vec2,
    /// For the choice of light.
    pub light: Vec2,
    /// For the place on it.
    pub place: Vec2,
    /// For what is partly transparent.
    pub key: u64,
}

/// What a look finds.
#[derive(Clone, Copy, Debug)]
pub struct Look {
    /// Σ value · radiance / density straight from sources.
    pub direct: Rgb,
    /// The surface behind the sampled direction and value / density there; `None` where there is none.
    pub onward: Option<Onward>,
}

/// A point of an element that is seen.
#[derive(Clone, Copy, Debug)]
pub struct Onward {
    /// The element.
    pub element: Element,
    /// Weights of its second and third corner.
    pub local: Vec2,
    /// Value over density of the direction.
    pub weight: Rgb,
}

/// A scene and its patches, to look around in.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its patches.
    pub patches: &'a Patches,
    /// How sources are found.
    pub sources: Sources,
    /// Whether direct light is blocked.
    pub shadows: Shadows,
}

impl Surroundings<'_> {
    /// Looks around from `at` on one side. `value` is f · |cos θ| of a unit direction in the shading frame. Adds to
    /// `rays` what it traces.
    pub fn look(
        &self,
        at: &Interaction<'_>,
        side: Side,
        value: impl Fn(Vec3) -> Rgb,
        numbers: Numbers,
        rays: &mut u64,
    ) -> Look {
        let sign = if side == Side::Front { 1.0 } else { -1.0 };
        let value = |direction: Vec3| {
            let wi = at.shading.to_local(direction);
            let stays = wi.z * sign > 0.0 && direction.dot(at.ng) * sign > 0.0;
            if stays { (value(wi), wi.z.abs() * FRAC_1_PI) } else { (Rgb::ZERO, 0.0) }
        };
        let mut look = Look { direct: self.next_event(at, side, &value, numbers, rays), onward: None };
        let wi = warp::cosine_hemisphere(numbers.direction);
        let direction = at.shading.to_world(wi.with_z(wi.z * sign)).normalize_or_zero();
        let (f, pdf) = value(direction);
        if f != Rgb::ZERO && pdf > 0.0 {
            let (radiance, onward) = self.follow(at, side, direction, pdf, numbers.key, rays);
            look.direct += f / pdf * radiance;
            look.onward = onward.map(|(element, local)| Onward { element, local, weight: f / pdf });
        }
        look
    }

    /// Light from one sampled source.
    fn next_event(
        &self,
        at: &Interaction<'_>,
        side: Side,
        value: &impl Fn(Vec3) -> (Rgb, f32),
        numbers: Numbers,
        rays: &mut u64,
    ) -> Rgb {
        let scene = self.scene;
        if self.sources == Sources::Met && scene.data.punctual.is_empty() {
            return Rgb::ZERO;
        }
        let environment = scene.environment.as_ref();
        let sampled = scene.lights.sample(
            &scene.data,
            environment,
            Moment::STILL,
            &at.lit(side),
            numbers.light,
            numbers.place,
        );
        let Some((_, event)) = sampled else { return Rgb::ZERO };
        let (f, pdf) = value(event.direction);
        let weight = match (event.found_by, self.sources) {
            (FoundBy::NextEvent, _) => 1.0,
            (FoundBy::Both, Sources::Met) => 0.0,
            (FoundBy::Both, Sources::Sampled) => event.pdf / (event.pdf + pdf),
        };
        if f == Rgb::ZERO || weight == 0.0 {
            return Rgb::ZERO;
        }
        let origin = at.leave(event.direction);
        let ray = match event.end {
            ShadowEnd::Point(end) => {
                Ray { origin, direction: end - origin, t_max: 1.0, moment: Moment::STILL }
            }
            ShadowEnd::Infinity => Ray::new(origin, event.direction),
        };
        let passes = match self.shadows {
            Shadows::On => {
                *rays += 1;
                scene.transmittance(&ray)
            }
            Shadows::Off => 1.0,
        };
        f * event.radiance * (passes * weight / event.pdf)
    }

    /// Radiance straight from what is in a direction, weighted against next events, and the element there.
    fn follow(
        &self,
        at: &Interaction<'_>,
        side: Side,
        direction: Vec3,
        pdf: f32,
        key: u64,
        rays: &mut u64,
    ) -> (Rgb, Option<(Element, Vec2)>) {
        let scene = self.scene;
        let weight = |light_pdf: f32| match self.sources {
            Sources::Met => 1.0,
            Sources::Sampled => pdf / (pdf + light_pdf),
        };
        *rays += 1;
        let origin = at.leave(direction);
        let Some(hit) = scene.closest(&Ray::new(origin, direction), || key) else {
            let Some(environment) = &scene.environment else { return (Rgb::ZERO, None) };
            let light_pdf = scene.lights.environment_pdf(environment, &at.lit(side), direction);
            return (environment.radiance(direction) * weight(light_pdf), None);
        };
        let there = scene.data.interaction(hit.instance, hit.triangle, hit.barycentric, Moment::STILL);
        let side = there.side(-direction);
        let mut radiance = Rgb::ZERO;
        if there.material.emits() {
            let triangle = (hit.instance, hit.triangle);
            let light_pdf = match self.sources {
                Sources::Met => 0.0,
                Sources::Sampled => {
                    scene.lights.triangle_pdf(&scene.data, triangle, &at.lit(side), &there, direction)
                }
            };
            radiance = there.emission(side) * weight(light_pdf);
        }
        // As everywhere, a point whose shading normal faces away scatters nothing.
        let sign = if side == Side::Front { 1.0 } else { -1.0 };
        if there.shading.z.dot(-direction) * sign <= 0.0 {
            return (radiance, None);
        }
        let (patch, local) = self.patches.at(hit.instance, hit.triangle, hit.barycentric);
        (radiance, Some((Element::new(patch, side), local)))
    }
}

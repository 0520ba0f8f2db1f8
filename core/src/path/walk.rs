//! The walk from the eye: what each ray finds, and where it goes on.

use crate::bsdf::event::Transport;
use crate::math::colour::Rgb;
use crate::path::media::Media;
use crate::path::next_event::{balance, next_event};
use crate::path::vertex::{Continuation, Crossing, Density, Vertex};
use crate::sampler::{Dimension, Sampler, Use};
use crate::scene::Scene;
use crate::scene::interaction::Interaction;
use crate::settings::Shadows;
use crate::trace::ray::Ray;
use glam::Vec3;

/// Scatterings before which no walk is ended by roulette. Measured as error² · time, smaller is better, from 2, 5 and
/// 9 on: a Cornell box 70, 51, 50; a hall with many lamps 26, 25, 26; a textured helmet 24, 12, 13.
const ROULETTE_FROM: u32 = 5;

/// Scatterings from which on a walk is also ended with probability 2 / n at its n-th: a walk that clear glass has trapped
/// by total reflection loses nothing and would never end. The chance to reach n falls as n⁻², so a trapped walk ends after
/// about twice this number on average, and the variance stays finite for every albedo below one, which a constant
/// probability does not achieve.
const LONG: u32 = 2048;

/// What of a walk depends on the settings.
#[derive(Clone, Copy, Debug)]
pub struct WalkRules {
    /// Most scatterings.
    pub bounces: u32,
    /// Whether direct light is blocked.
    pub shadows: Shadows,
}

/// A walk from the eye, between two vertices.
struct Walk<'a> {
    scene: &'a Scene,
    sampler: &'a Sampler,
    ray: Ray,
    /// How the ray's direction was chosen, and the point it was chosen at.
    density: Density,
    from: Vec3,
    /// Light that arrives along the ray counts this much.
    throughput: Rgb,
    /// The part of `throughput` that is due to refraction: it comes back when the path leaves.
    eta_squared: f32,
    media: Media,
    scatterings: u32,
}

/// Radiance along `ray`, one sample of it: emission that is hit and next events at every vertex, weighted by the
/// balance heuristic. Adds to `rays` what it traces.
pub fn radiance(scene: &Scene, rules: WalkRules, ray: Ray, sampler: &Sampler, rays: &mut u64) -> Rgb {
    let mut walk = Walk {
        scene,
        sampler,
        from: ray.origin,
        ray,
        density: Density::Delta,
        throughput: Vec3::ONE,
        eta_squared: 1.0,
        media: Media::VACUUM,
        scatterings: 0,
    };
    let mut radiance = Vec3::ZERO;
    loop {
        *rays += 1;
        let key = || sampler.key(Dimension::Eye(walk.scatterings, Use::Alpha));
        let Some(hit) = scene.closest(&walk.ray, key) else {
            return radiance + walk.throughput * walk.environment_light();
        };
        let at = scene.data.interaction(hit.instance, hit.triangle, hit.barycentric, walk.ray.moment);
        let back = -walk.ray.direction;
        let distance = (at.position - walk.ray.origin).length();
        walk.throughput *= walk.media.transmittance_to(distance, &at, back);
        radiance += walk.throughput * walk.surface_light(&at, (hit.instance, hit.triangle));
        if walk.scatterings >= rules.bounces {
            return radiance;
        }
        let Some(vertex) = Vertex::new(at, back) else { return radiance };
        if vertex.is_smooth() {
            let direct =
                next_event(scene, &vertex, &walk.media, rules.shadows, sampler, walk.scatterings, rays);
            radiance += walk.throughput * direct;
        }
        if !walk.scatter(&vertex) {
            return radiance;
        }
    }
}

impl Walk<'_> {
    /// Environment light along the ray, weighted against next events.
    fn environment_light(&self) -> Rgb {
        let Some(environment) = &self.scene.environment else { return Vec3::ZERO };
        let direction = self.ray.direction;
        let weight = match self.density {
            Density::Delta => 1.0,
            Density::SolidAngle(pdf) => {
                balance(pdf, self.scene.lights.environment_pdf(environment, direction))
            }
        };
        environment.radiance(direction) * weight
    }

    /// Light that the surface that was hit emits along the ray, weighted against next events.
    fn surface_light(&self, at: &Interaction<'_>, triangle: (u32, u32)) -> Rgb {
        if !at.material.emits() {
            return Vec3::ZERO;
        }
        let emission = at.emission(at.side(-self.ray.direction));
        if emission == Vec3::ZERO {
            return Vec3::ZERO;
        }
        let weight = match self.density {
            Density::Delta => 1.0,
            Density::SolidAngle(pdf) => {
                let (data, lights) = (&self.scene.data, &self.scene.lights);
                balance(pdf, lights.triangle_pdf(data, triangle, self.from, at, self.ray.direction))
            }
        };
        emission * weight
    }

    /// Goes on from `vertex`; false where the walk ends. Roulette survives with min(1, throughput without the
    /// factors of refraction): never capped, since a cap below 1 has infinite variance where albedos are near one.
    fn scatter(&mut self, vertex: &Vertex<'_>) -> bool {
        let dimension = |what| Dimension::Eye(self.scatterings, what);
        let choice = self.sampler.pair(dimension(Use::Choice));
        let u = self.sampler.pair(dimension(Use::Direction));
        let Some(next) = vertex.sample(choice.x, u, Transport::Radiance) else { return false };
        let Continuation { direction, weight, density, eta, crossing } = next;
        self.throughput *= weight;
        self.eta_squared *= eta * eta;
        self.scatterings += 1;
        if self.scatterings >= ROULETTE_FROM {
            let mut survival = (self.throughput.max_element() * self.eta_squared).min(1.0);
            if self.scatterings >= LONG {
                survival *= 1.0 - 2.0 / self.scatterings as f32;
            }
            if choice.y >= survival {
                return false;
            }
            self.throughput /= survival;
        }
        if crossing == Crossing::Crosses {
            self.media.cross(&vertex.at, direction);
        }
        self.from = vertex.at.position;
        self.ray = vertex.ray(direction);
        self.density = density;
        true
    }
}

//! Paths from the eye, with next event: `L(D|S)*E`.

use crate::math::colour::Rgb;
use crate::path::walk::{WalkRules, radiance};
use crate::sampler::{Dimension, Sampler};
use crate::scene::Scene;
use crate::settings::Settings;
use glam::Vec2;

/// One sample of a pixel: a place in the pixel, a place on the lens, a moment of the shutter, a walk. The reconstruction filter is the pixel's
/// own square, sampled, so that a sample touches one pixel and nothing needs a border.
pub fn sample(scene: &Scene, settings: &Settings, pixel: [u32; 2], sampler: &Sampler, rays: &mut u64) -> Rgb {
    let rules = WalkRules { bounces: settings.bounces.unwrap_or(u32::MAX), shadows: settings.shadows };
    let corner = Vec2::new(pixel[0] as f32, pixel[1] as f32);
    let place = corner + sampler.pair(Dimension::Film);
    let lens = settings.lens.map_or(Vec2::splat(0.5), |_| sampler.pair(Dimension::Lens));
    let moment = scene.moment(|| sampler.pair(Dimension::Time).x);
    let ray = scene.view(moment).ray(place, lens).at(moment);
    radiance(scene, rules, ray, sampler, rays)
}

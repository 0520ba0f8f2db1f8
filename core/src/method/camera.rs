//! The camera ray of a sample.

use crate::sampler::{Dimension, Sampler};
use crate::scene::Scene;
use crate::settings::Settings;
use crate::trace::moment::Moment;
use crate::trace::ray::Ray;
use glam::Vec2;

/// A place in the pixel and a place on the lens at a moment of the shutter. The reconstruction filter is the pixel's own square, sampled, so that a sample
/// touches one pixel and nothing needs a border.
pub fn camera_ray(
    scene: &Scene,
    settings: &Settings,
    pixel: [u32; 2],
    sampler: &Sampler,
    moment: Moment,
) -> Ray {
    let corner = Vec2::new(pixel[0] as f32, pixel[1] as f32);
    let place = corner + sampler.pair(Dimension::Film);
    let lens = settings.lens.map_or(Vec2::splat(0.5), |_| sampler.pair(Dimension::Lens));
    scene.view(moment).ray(place, lens).at(moment)
}

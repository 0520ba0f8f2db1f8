//! One sample by the settings' method.

use crate::film::batch::Batch;
use crate::method::{bidirectional, camera::camera_ray, light, path};
use crate::path::rules::Rules;
use crate::path::tally::Tally;
use crate::path::throughput::Carriage;
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::settings::{Method, Settings};

/// All that a sample depends on beside its pixel and index.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampling<'a> {
    pub(super) scene: &'a Scene,
    pub(super) settings: &'a Settings,
    pub(super) rules: &'a Rules,
    pub(super) batch: Batch,
}

impl Sampling<'_> {
    /// Adds the sample of a pixel with an index to `tally`.
    pub(super) fn sample<C: Carriage>(&self, pixel: [u32; 2], index: u32, tally: &mut Tally) {
        let Self { scene, settings, rules, batch } = *self;
        let eye = Sampler::new(settings.seed, batch.replicate, pixel, index);
        let ray = || camera_ray(scene, settings, pixel, &eye);
        match settings.method {
            Method::Path => path::sample::<C>(scene, rules, ray(), &eye, tally),
            Method::Light => light::sample::<C>(scene, rules, &self.light(pixel, index), tally),
            Method::Bidirectional => {
                let light = self.light(pixel, index);
                bidirectional::sample::<C>(scene, rules, ray(), [&eye, &light], tally);
            }
            other => unreachable!("{} is refused when a job is submitted", other.name()),
        }
    }

    /// The numbers of the light subpath that goes with a pixel's sample.
    fn light(&self, [x, y]: [u32; 2], index: u32) -> Sampler {
        let region = self.batch.region;
        let place = u64::from(y - region.y) * u64::from(region.width) + u64::from(x - region.x);
        let id = u64::from(index) * region.pixels() as u64 + place;
        Sampler::light(self.settings.seed, self.batch.replicate, id)
    }
}

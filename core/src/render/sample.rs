//! One sample by the settings' method.

use crate::film::allocation::Allocation;
use crate::film::batch::Batch;
use crate::film::grid::Grid;
use crate::method::radiosity::Reconstruction;
use crate::method::{bidirectional, camera::camera_ray, caustics, light, path, radiosity};
use crate::path::rules::Rules;
use crate::path::tally::Tally;
use crate::path::throughput::Carriage;
use crate::radiosity::solution::Solution;
use crate::sampler::{Dimension, Sampler};
use crate::scene::{Scene, Unlit};
use crate::settings::{Distribution, Method, Settings};
use crate::trace::moment::Moment;
use crate::trace::ray::Ray;
use std::ops::Range;

/// All that a sample depends on beside its pixel and index.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sampling<'a> {
    pub(super) scene: &'a Scene,
    /// Where the method is radiosity.
    pub(super) radiosity: Option<&'a Solution>,
    pub(super) settings: &'a Settings,
    pub(super) rules: &'a Rules,
    pub(super) batch: Batch,
    /// How many samples of the batch each pixel has; all of them where there is none.
    pub(super) allocation: Option<&'a Allocation>,
}

impl Sampling<'_> {
    /// Sample indices of a pixel.
    pub(super) fn samples(&self, pixel: [u32; 2]) -> Range<u32> {
        match self.allocation {
            Some(allocation) => allocation.samples(allocation.grid().tile(pixel), self.batch.block),
            None => self.batch.block.samples(),
        }
    }

    /// The tiles whose rays are counted, if an allocation is to be made of this batch and its like.
    pub(super) fn counted(&self) -> Option<Grid> {
        let adaptive = self.settings.sampling == Distribution::Adaptive && self.allocation.is_none();
        adaptive.then(|| Grid::of(self.settings.size))
    }

    /// Adds the sample of a pixel with an index to `tally`.
    pub(super) fn sample<C: Carriage>(&self, pixel: [u32; 2], index: u32, tally: &mut Tally) {
        let Self { scene, settings, rules, .. } = *self;
        match settings.method {
            Method::Path => {
                let (eye, ray) = self.eye(pixel, index);
                path::sample::<C>(scene, rules, ray, &eye, tally);
            }
            Method::Light => {
                let moment = self.moment(&self.pixel(pixel, index));
                light::sample::<C>(scene, rules, (&self.light(pixel, index), moment), tally);
                if scene.unlit() == Unlit::Some {
                    let (eye, ray) = self.eye(pixel, index);
                    light::unlit::<C>(scene, rules, (&eye, ray), tally);
                }
            }
            Method::Bidirectional => {
                let (eye, ray) = self.eye(pixel, index);
                let light = self.light(pixel, index);
                bidirectional::sample::<C>(scene, rules, ray, [&eye, &light], tally);
            }
            Method::Caustics => {
                let (eye, ray) = self.eye(pixel, index);
                let light = self.light(pixel, index);
                caustics::sample::<C>(scene, rules, ray, [&eye, &light], tally);
            }
            Method::Radiosity => {
                let solution = self.radiosity.expect("prepared for this method");
                let eye = Sampler::new(settings.seed, self.batch.replicate, pixel, index);
                let how = Reconstruction::Gather;
                tally.planes[0] +=
                    radiosity::sample(scene, solution, settings, how, pixel, &eye, &mut tally.rays);
            }
            Method::Photon => unreachable!("photons are gathered in passes, not sample by sample"),
        }
    }

    /// The numbers of the light subpath that goes with a pixel's sample.
    fn light(&self, [x, y]: [u32; 2], index: u32) -> Sampler {
        let region = self.batch.region;
        let place = u64::from(y - region.y) * u64::from(region.width) + u64::from(x - region.x);
        self.light_path(index, place)
    }

    /// The numbers of a light subpath of an index.
    pub(super) fn light_path(&self, index: u32, number: u64) -> Sampler {
        let id = u64::from(index) * self.rules.light_paths as u64 + number;
        Sampler::light(self.settings.seed, self.batch.replicate, id)
    }

    /// The numbers of a pixel's sample, and its camera ray.
    fn eye(&self, pixel: [u32; 2], index: u32) -> (Sampler, Ray) {
        let eye = self.pixel(pixel, index);
        (eye, camera_ray(self.scene, self.settings, pixel, &eye, self.moment(&eye)))
    }

    /// The same at the moment of a pass.
    pub(super) fn eye_in_pass(&self, pixel: [u32; 2], index: u32, moment: Moment) -> (Sampler, Ray) {
        let eye = self.pixel(pixel, index);
        (eye, camera_ray(self.scene, self.settings, pixel, &eye, moment))
    }

    /// The moment of a pass of photons: photons and those who gather them have it in common.
    pub(super) fn moment_of_pass(&self, index: u32) -> Moment {
        self.moment(&self.pixel([u32::MAX; 2], index))
    }

    fn pixel(&self, pixel: [u32; 2], index: u32) -> Sampler {
        Sampler::new(self.settings.seed, self.batch.replicate, pixel, index)
    }

    fn moment(&self, eye: &Sampler) -> Moment {
        self.scene.moment(|| eye.pair(Dimension::Time).x)
    }
}

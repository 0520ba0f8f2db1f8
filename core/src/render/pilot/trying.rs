//! Small pictures by several methods.

use super::choice::{Choice, choice, halves};
use super::plan::{NoPilot, Plan, REPLICATES, SHARE};
use super::report::{Pilot, Trial};
use super::squares::{Seen, Squares, layers, spread, squares, teller};
use super::work::{AGAIN, TELLING, counted, work};
use crate::film::append::Prefix;
use crate::film::batch::{Batch, Block};
use crate::film::estimate::picture;
use crate::film::size::{Region, Size};
use crate::film::sketch::Sketch;
use crate::film::squares::RelativeTo;
use crate::render::batch::{RenderError, render};
use crate::render::prepare::{Prepared, prepare};
use crate::render::progress::Progress;
use crate::settings::{Method, Settings};
use rayon::prelude::*;
use std::sync::Arc;

/// Blocks of a sequence: each but the first doubles its samples.
const BLOCKS_MAX: u32 = 6;
/// Rays of a sample of the first method beyond which joining all vertices of two subpaths is not tried.
const PATH_RAYS_MAX: f64 = 64.0;
/// Work of a pilot, at most, in microseconds of a thread: one who submits a job waits for it, and sees its picture first.
const WORK_MAX: f64 = 2e6;

/// Renders the pilot of a job, and gives the picture of it by the method that is taken. `environment` holds the bytes of the image that
/// the settings name, if they do. Runs on the current rayon pool; the same arguments give the same pilot on any number of threads.
pub fn pilot(
    bytes: impl Into<Arc<[u8]>>,
    environment: Option<&[u8]>,
    plan: &Plan,
) -> Result<(Pilot, Sketch), NoPilot> {
    plan.check()?;
    let job = plan.job();
    let (settings, region) = plan.small();
    let prepared = prepare(bytes, environment, &settings)?;
    let mut trying = Trying { prepared: &prepared, region, plan, all: Vec::new() };
    for method in &plan.methods {
        let mut settings = Settings { method: *method, ..settings.clone() };
        settings.layers.extend(layers(*method));
        let planes = settings.layers.len() + 1;
        let lanes = (0..REPLICATES).map(|r| Prefix::empty(region, r, planes));
        trying.all.push((settings, lanes.collect()));
    }
    trying.run(job)?;
    let pilot = trying.finish(settings.size, job);
    let sketch = trying.sketch(settings.size, pilot.method);
    Ok((pilot, sketch))
}

/// Methods on trial: settings and replicates of each.
struct Trying<'a> {
    prepared: &'a Prepared,
    region: Region,
    plan: &'a Plan,
    all: Vec<(Settings, Vec<Prefix>)>,
}

impl Trying<'_> {
    /// Goes on while another block of all takes no more than its share of a job of so many samples.
    fn run(&mut self, job: f64) -> Result<(), NoPilot> {
        let mut start = 0;
        for index in 0..BLOCKS_MAX {
            let block = Block { index, start, count: start.max(1) };
            if index == 0 {
                self.append(0, 1, block)?;
                if self.rays(0) as f64 > PATH_RAYS_MAX * self.region.pixels() as f64 {
                    return Err(NoPilot::TooLong);
                }
                self.append(0, REPLICATES, block)?;
                (1..self.all.len()).try_for_each(|method| self.append(method, REPLICATES, block))?;
            } else if self.is_enough(job) {
                break;
            } else {
                (0..self.all.len()).try_for_each(|method| self.append(method, REPLICATES, block))?;
            }
            start += block.count;
        }
        Ok(())
    }

    /// Appends a block to the first `lanes` replicates of a method that do not have it.
    fn append(&mut self, method: usize, lanes: u32, block: Block) -> Result<(), RenderError> {
        let (prepared, region) = (self.prepared, self.region);
        let (settings, replicates) = &mut self.all[method];
        // A picture this small has hardly more tiles than threads: replicates, which do not know each other, keep them busy.
        let lanes = replicates.par_iter_mut().take(lanes as usize);
        lanes.filter(|prefix| prefix.blocks() == block.index).try_for_each(|prefix| {
            let batch = Batch { region, replicate: prefix.replicate(), block };
            let sum = render(prepared, settings, batch, &Progress::new())?;
            prefix.append(&sum).expect("blocks come in order");
            Ok(())
        })
    }

    fn rays(&self, method: usize) -> u64 {
        self.all[method].1.iter().map(Prefix::rays).sum()
    }

    /// Samples of one method, over all pixels and replicates.
    fn samples(&self, method: usize) -> f64 {
        self.all[method].1.iter().map(|p| f64::from(p.samples()) * self.region.pixels() as f64).sum()
    }

    /// The same of a pixel.
    fn samples_a_pixel(&self, method: usize) -> f64 {
        self.samples(method) / self.region.pixels() as f64
    }

    fn work(&self, method: usize) -> f64 {
        work(self.all[method].0.method, self.rays(method), self.samples(method))
    }

    /// Work of what was rendered.
    fn spent(&self) -> f64 {
        TELLING * (0..self.all.len()).map(|method| self.work(method)).sum::<f64>()
    }

    /// Whether another block of all takes too much of a job of so many samples, or too long.
    fn is_enough(&self, job: f64) -> bool {
        let then = AGAIN * self.spent();
        then > SHARE * self.least_work(job) || self.plan.reading() + then > WORK_MAX
    }

    /// Work of a job of so many samples by a method, or of as many as its error asks for.
    fn job_work(&self, job: f64, method: usize, squares: &[Squares]) -> f64 {
        let samples = match self.plan.error_target {
            None => job,
            Some(target) => {
                let a_pixel = squares[method].expected / (target * target);
                job.min(a_pixel * self.plan.region.pixels() as f64)
            }
        };
        self.work(method) / self.samples(method) * samples
    }

    /// The least work of a job, by any method.
    fn least_work(&self, job: f64) -> f64 {
        let seen = self.seen(|_| true);
        let squares = squares(&seen, &relative(&seen));
        (0..squares.len()).map(|method| self.job_work(job, method, &squares)).fold(f64::INFINITY, f64::min)
    }

    /// Every method, with some of its replicates.
    fn seen(&self, some: impl Fn(usize) -> bool) -> Vec<Seen<'_>> {
        let mut all = Vec::new();
        for (settings, lanes) in &self.all {
            let lanes = lanes.iter().enumerate().filter(|(r, _)| some(*r)).map(|(_, lane)| lane);
            all.push(Seen { settings, lanes: lanes.collect() });
        }
        all
    }

    /// The picture by a method that was tried, of the region only.
    fn sketch(&self, size: Size, method: Method) -> Sketch {
        let tried = self.all.iter().find(|(settings, _)| settings.method == method);
        let (_, lanes) = tried.expect("the method that is taken was tried");
        let planes = picture(size, self.region, std::slice::from_ref(lanes)).planes;
        let Region { width, height, .. } = self.region;
        Sketch::new(
            Size { width, height },
            planes.into_iter().next().expect("the picture is the first plane"),
        )
    }

    /// Which method to take by what was seen so far.
    fn choice(&self, relative: &RelativeTo) -> Choice {
        let works: Vec<f64> = (0..self.all.len()).map(|method| self.work(method)).collect();
        let costs = |half: Vec<usize>| -> Vec<f64> {
            let squares = squares(&self.seen(|r| half.contains(&r)), relative);
            let cost = |(i, of): (usize, &Squares)| {
                (of.expected / self.samples_a_pixel(i) + of.missed) * counted(self.all[i].0.method, works[i])
            };
            squares.iter().enumerate().map(cost).collect()
        };
        choice(&halves().map(costs).collect::<Vec<_>>(), &works)
    }

    fn finish(&self, size: Size, job: f64) -> Pilot {
        let seen = self.seen(|_| true);
        let relative = relative(&seen);
        let squares = squares(&seen, &relative);
        let Choice { taken, time_ratios } = self.choice(&relative);
        let trial = |(i, of): (usize, &Squares)| {
            let samples = self.samples_a_pixel(i);
            Trial {
                method: self.all[i].0.method,
                samples: samples as u32,
                rays: self.rays(i),
                work: self.work(i),
                relative_error: (of.variance / samples).sqrt(),
                square_error: spread(&seen[i], &relative) / samples,
                expected_error: (of.expected / samples).sqrt(),
                missed: of.missed.sqrt(),
                time_ratio: time_ratios[i],
            }
        };
        let trials = squares.iter().enumerate().map(trial).collect();
        let of_job = |work: f64| (work / self.job_work(job, taken, &squares)).min(f64::MAX);
        let (share, reading) = (of_job(self.spent()), of_job(self.plan.reading()));
        Pilot { method: self.all[taken].0.method, size, trials, share, reading }
    }
}

/// Errors are over the light in the picture that tells of others.
fn relative(seen: &[Seen<'_>]) -> RelativeTo {
    RelativeTo::new(&teller(seen).unwrap_or(&seen[0]).lanes)
}

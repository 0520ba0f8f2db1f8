//! A pilot: small pictures by several methods, which tell the one that needs the least work for an error.
//!
//! Work is counted and not timed, so that the choice is the same on every machine.

use crate::film::append::Prefix;
use crate::film::batch::{Batch, Block};
use crate::film::estimate::picture;
use crate::film::missed::missed;
use crate::film::size::{Region, Size};
use crate::film::sketch::Sketch;
use crate::film::squares::RelativeTo;
use crate::render::batch::{RenderError, render};
use crate::render::prepare::{PrepareError, Prepared, prepare};
use crate::render::progress::Progress;
use crate::settings::{Layer, Method, Settings, Shows};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use std::sync::Arc;

/// Share of a job's work that a pilot may take.
const SHARE: f64 = 0.02;
/// Sequences of each method.
const REPLICATES: u32 = 8;
/// Blocks of a sequence: each but the first doubles its samples.
const BLOCKS_MAX: u32 = 4;
/// Fewest pixels of a pilot's pictures: with 84 and a sample by each sequence, the edges of the lamp in a Cornell box spoke against `path`.
const PIXELS_MIN: f64 = 192.0;
/// Most pixels of a pilot's pictures. They should be as small as the job's: edges are noise that all methods share, and there is
/// the more of it the larger pixels are, which speaks for the method with the cheapest samples.
const PIXELS_MAX: f64 = 3600.0;
/// Reading a triangle and building its part of a tree, in samples of `path`.
const TRIANGLE: f64 = 0.5;
/// Samples of `path` that a second of run time is taken for.
const SAMPLES_A_SECOND: f64 = 1e5;
/// Triangles that are read, at most: they are in memory meanwhile.
const TRIANGLES_MAX: u64 = 1 << 20;
/// Rays of a sample of the first method beyond which joining all vertices of two subpaths is not tried.
const PATH_RAYS_MAX: f64 = 64.0;
/// Work of a pilot, at most, in microseconds of a thread: one who submits a job waits for it, and sees its picture first.
const WORK_MAX: f64 = 2e6;
/// Work over the least that is about the least, in pilots of so many pixels; smaller ones do not tell that well.
const ABOUT: f64 = 1.1;
const ABOUT_FROM: usize = 1000;
/// Methods that `bidirectional` tells of.
const TOLD: [Method; 3] = [Method::Path, Method::Caustics, Method::Light];
/// Time of a pilot over that of as many samples in a job: what it is told costs as much again as half of the paths (cornell-box: 1.5).
const TELLING: f64 = 1.5;
/// What the work of `path` counts: in a pilot it seems more than in a job, as with more samples of a sequence its error falls faster than
/// that of methods whose light subpaths go anywhere.
const SEQUENCE: f64 = 0.8;

/// How eye subpaths come to light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chance {
    /// By next events, which miss nothing.
    Never,
    /// Some of it by chance, behind glossy or specular surfaces.
    Sometimes,
}

/// What a job is, as far as a pilot has to know.
#[derive(Clone, Debug)]
pub struct Plan {
    /// What is rendered, by any method.
    pub settings: Settings,
    /// Pixels that are rendered.
    pub region: Region,
    /// Samples a pixel over all replicates, at most.
    pub samples: u32,
    /// Relative error to stop at.
    pub error_target: Option<f64>,
    /// Seconds of run time to stop after.
    pub seconds: Option<f64>,
    /// Triangles that are read.
    pub triangles: u64,
    /// Whether the first of the methods comes to some light by chance only.
    pub chance: Chance,
    /// Methods that make the picture; the first is taken where no other is better.
    pub methods: Vec<Method>,
}

impl Plan {
    /// Samples of the job over all pixels, at most.
    fn job(&self) -> f64 {
        let asked = self.region.pixels() as f64 * f64::from(self.samples);
        self.seconds.map_or(asked, |seconds| asked.min(seconds * SAMPLES_A_SECOND))
    }

    /// Pixels that may be tried: two blocks of them, so that there is something to go by.
    fn pixels(&self) -> f64 {
        let all: f64 = self.methods.iter().map(|method| dearness(*method)).sum();
        SHARE * self.job() / (2.0 * f64::from(REPLICATES) * all)
    }

    /// What is taken where nothing is tried: the first, or `caustics` where that one meets light by chance. It needs twice the work at
    /// most, and can need hundreds of times less.
    pub fn untried(&self) -> Method {
        match self.chance {
            Chance::Sometimes if self.methods.contains(&Method::Caustics) => Method::Caustics,
            _ => self.methods[0],
        }
    }

    /// Whether there is work enough for a pilot, before anything is read.
    pub fn check(&self) -> Result<(), NoPilot> {
        let reading = TRIANGLE * self.triangles as f64;
        if self.pixels() < PIXELS_MIN {
            Err(NoPilot::TooLittle)
        } else if self.triangles > TRIANGLES_MAX || reading > 0.5 * SHARE * self.job() {
            Err(NoPilot::TooLarge)
        } else {
            Ok(())
        }
    }
}

/// Why nothing was tried.
#[derive(Debug, thiserror::Error)]
pub enum NoPilot {
    /// Little is asked for.
    #[error("the job is too small for trying others in 2 % of it")]
    TooLittle,
    /// There is much to read for what is asked for.
    #[error("reading the scene once more for trying others would take too much of the job")]
    TooLarge,
    /// Paths go on and on.
    #[error("paths are too long here for trying to join them")]
    TooLong,
    /// The scene cannot be rendered.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// A batch gave no sum.
    #[error(transparent)]
    Render(#[from] RenderError),
}

/// What was tried.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pilot {
    /// Of the methods that need about the least work for an error, the one with the cheapest samples.
    pub method: Method,
    /// The size of the frames that were tried.
    pub size: Size,
    /// Each method that was tried.
    pub trials: Vec<Trial>,
    /// Work of the pilot over that of the job, as far as that is known before.
    pub share: f64,
}

/// A method that was tried.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Trial {
    /// The method.
    pub method: Method,
    /// Samples a pixel.
    pub samples: u32,
    /// Rays traced.
    pub rays: u64,
    /// What it took, counted: by how long a ray and a sample take by each method, in microseconds of one thread of the machine that this was
    /// measured on.
    pub work: f64,
    /// Relative error by the spread of the samples.
    pub relative_error: f64,
    /// Standard error of its square, by a jackknife over the sequences.
    pub square_error: f64,
    /// Relative error to be expected of as many samples. What `path`, `caustics` and `light` add to a pixel may be large and so rare that
    /// their own samples have not met it, or too much of it, where those of `bidirectional` meet it often.
    #[serde(default)]
    pub expected_error: f64,
    /// Relative error by light that another method has met and this one has not, where nothing else tells of it.
    pub missed: f64,
    /// Work for the same error, over that of the method that is taken.
    pub time_ratio: f64,
}

impl Trial {
    /// The work for an error is in proportion to it.
    fn cost(&self) -> f64 {
        let errors = [self.expected_error, self.missed];
        let work = match self.method {
            Method::Path => SEQUENCE * self.work,
            _ => self.work,
        };
        let cost = errors.map(|error| error * error).iter().sum::<f64>() * work;
        if cost.is_finite() { cost } else { f64::MAX }
    }
}

/// The trial to go by: of those that need about the least work, the first with the cheapest samples. What no pilot has met is the same for
/// all that come to it by chance, and costs those with dear samples the more.
fn chosen(trials: &[Trial], pixels: usize) -> &Trial {
    let least = trials.iter().map(Trial::cost).fold(f64::INFINITY, f64::min);
    let about = if pixels < ABOUT_FROM { least } else { ABOUT * least };
    let about_least = trials.iter().filter(|trial| trial.cost() <= about);
    about_least.min_by(|a, b| a.work.total_cmp(&b.work)).expect("each method of a plan was tried")
}

/// A sample in samples of `path`, where nothing is known yet.
fn dearness(method: Method) -> f64 {
    match method {
        Method::Bidirectional => 3.5,
        Method::Caustics => 2.0,
        Method::Path | Method::Light | Method::Photon | Method::Radiosity => 1.25,
    }
}

/// How long a batch takes, in microseconds of one thread: what `cargo run --release -p ovtigre-tests --bin auto` measured.
fn work(method: Method, rays: u64, samples: f64) -> f64 {
    let [a_ray, a_sample] = match method {
        Method::Light => [0.3, 1.2],
        Method::Bidirectional | Method::Caustics => [0.5, 0.0],
        Method::Path | Method::Photon | Method::Radiosity => [0.56, 0.0],
    };
    a_ray * rays as f64 + a_sample * samples
}

/// Renders the pilot of a job, and gives the picture of it by the method that is taken. `environment` holds the bytes of the image that
/// the settings name, if they do. Runs on the current rayon pool; the same arguments give the same pilot on any number of threads.
pub fn pilot(
    bytes: impl Into<Arc<[u8]>>,
    environment: Option<&[u8]>,
    plan: &Plan,
) -> Result<(Pilot, Sketch), NoPilot> {
    plan.check()?;
    let job = plan.job();
    let (settings, region) = small(plan, plan.pixels().min(PIXELS_MAX));
    let prepared = prepare(bytes, environment, &settings)?;
    let mut trying = Trying { prepared: &prepared, region, plan, all: Vec::new() };
    for method in &plan.methods {
        let mut settings = Settings { method: *method, ..settings.clone() };
        let told = match method {
            Method::Bidirectional => TOLD.to_vec(),
            own => TOLD.into_iter().filter(|told| told == own).collect(),
        };
        settings.layers.extend(told.into_iter().map(|of| {
            let shows = Shows::Squares(of);
            Layer { name: shows.to_string(), shows }
        }));
        let planes = settings.layers.len() + 1;
        let lanes = (0..REPLICATES).map(|r| Prefix::empty(region, r, planes));
        trying.all.push((settings, lanes.collect()));
    }
    trying.run(job)?;
    let pilot = trying.finish(settings.size, job);
    let sketch = trying.sketch(settings.size, pilot.method);
    Ok((pilot, sketch))
}

/// The same picture in about so many pixels.
fn small(plan: &Plan, pixels: f64) -> (Settings, Region) {
    let (Size { width, height }, region) = (plan.settings.size, plan.region);
    let scale = (pixels / region.pixels() as f64).sqrt().min(1.0);
    let length = |n: u32| (f64::from(n) * scale).round().max(1.0) as u32;
    let size = Size { width: length(width), height: length(height) };
    let start = |n: u32, of: u32, within: u32| {
        ((f64::from(n) / f64::from(of) * f64::from(within)) as u32).min(within - 1)
    };
    let (x, y) = (start(region.x, width, size.width), start(region.y, height, size.height));
    let region = Region {
        x,
        y,
        width: length(region.width).min(size.width - x),
        height: length(region.height).min(size.height - y),
    };
    (Settings { size, replicates: REPLICATES, ..plan.settings.clone() }, region)
}

/// Methods on trial: settings and replicates of each.
struct Trying<'a> {
    prepared: &'a Prepared,
    region: Region,
    plan: &'a Plan,
    all: Vec<Tried>,
}

/// Settings and replicates of a method.
type Tried = (Settings, Vec<Prefix>);

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
            } else if 2.0 * TELLING * self.spent() > WORK_MAX.min(SHARE * self.job_work(job)) {
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

    fn work(&self, method: usize) -> f64 {
        work(self.all[method].0.method, self.rays(method), self.samples(method))
    }

    fn spent(&self) -> f64 {
        (0..self.all.len()).map(|method| self.work(method)).sum()
    }

    /// Work of a job of so many samples, or of as many as its error asks for, by the method that needs the least.
    fn job_work(&self, job: f64) -> f64 {
        let trials = self.trials();
        let by = |(method, trial): (usize, &Trial)| {
            let samples = match self.plan.error_target {
                None => job,
                Some(target) => {
                    let a_pixel = f64::from(trial.samples) * (trial.expected_error / target).powi(2);
                    job.min(a_pixel * self.plan.region.pixels() as f64)
                }
            };
            self.work(method) / self.samples(method) * samples
        };
        trials.iter().enumerate().map(by).fold(f64::INFINITY, f64::min)
    }

    fn trials(&self) -> Vec<Trial> {
        let teller = self.all.iter().find(|(settings, _)| settings.method == Method::Bidirectional);
        let relative = RelativeTo::new(&teller.unwrap_or(&self.all[0]).1);
        let trial = |(method, tried): (usize, &Tried)| {
            let (settings, lanes) = tried;
            let samples: u32 = lanes.iter().map(Prefix::samples).sum();
            let variance = relative.variance(lanes);
            let told = teller.and_then(|teller| corrected(variance, &relative, [tried, teller]));
            let missed = if told.is_some() { 0.0 } else { self.missed(settings.method, lanes) };
            let error = |variance: f64| (variance / f64::from(samples)).sqrt();
            Trial {
                method: settings.method,
                samples,
                rays: self.rays(method),
                work: self.work(method),
                relative_error: error(variance),
                square_error: spread(&relative, lanes) / f64::from(samples),
                expected_error: error(told.unwrap_or(variance)),
                missed,
                time_ratio: 1.0,
            }
        };
        self.all.iter().enumerate().map(trial).collect()
    }

    /// Relative error of the replicates of a method by light that another one has met.
    fn missed(&self, method: Method, lanes: &[Prefix]) -> f64 {
        let others = self.all.iter().filter(|(other, _)| other.method != method);
        others.map(|(_, other)| missed(lanes, other)).fold(0.0, f64::max)
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

    fn finish(&self, size: Size, job: f64) -> Pilot {
        let share = (TELLING * self.spent() / self.job_work(job)).min(f64::MAX);
        let trials = self.trials();
        let (method, least) = {
            let chosen = chosen(&trials, self.region.pixels());
            (chosen.method, chosen.cost())
        };
        let mut pilot = Pilot { method, size, trials, share };
        for trial in &mut pilot.trials {
            trial.time_ratio = if least > 0.0 { (trial.cost() / least).min(f64::MAX) } else { 1.0 };
        }
        pilot
    }
}

/// The variance of a sample of a method, where its own samples say `variance` and others also tell of the squares of what it adds.
///
/// Own samples and others tell the mean of the same squares. What others tell of more than own samples have met counts as much as these
/// do: contributions to one sample come together, so that the variance is more than their squares. Where own samples have met too much,
/// they have too much variance in proportion; of `light` others tell too little, as they take its walks for sure.
fn corrected(variance: f64, relative: &RelativeTo, [own, others]: [&Tried; 2]) -> Option<f64> {
    let method = own.0.method;
    let told = Shows::Squares(method);
    let square = |(settings, lanes): &Tried| {
        let layer = settings.layers.iter().position(|layer| layer.shows == told)?;
        Some(relative.square(lanes, layer + 1))
    };
    let (own, others) = (square(own)?, square(others)?);
    let together = (variance / own).max(1.0);
    let corrected = match own.total_cmp(&others) {
        Ordering::Greater if method == Method::Light => variance,
        Ordering::Greater => variance * others / own,
        _ => variance + (others - own) * together,
    };
    Some(if corrected.is_nan() { variance } else { corrected })
}

/// Standard error of the variance of a sample: √((R − 1)/R · Σ (Vᵣ − V̄)²), Vᵣ the variance without replicate r.
fn spread(relative: &RelativeTo, lanes: &[Prefix]) -> f64 {
    let without: Vec<f64> =
        (0..lanes.len()).map(|one| relative.variance(&[&lanes[..one], &lanes[one + 1..]].concat())).collect();
    let r = without.len() as f64;
    let mean = without.iter().sum::<f64>() / r;
    ((r - 1.0) / r * without.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>()).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_methods_that_are_about_as_good_the_one_with_the_cheapest_samples_is_taken() {
        let trial = |method, work: f64, cost: f64| Trial {
            method,
            samples: 8,
            rays: 1,
            work,
            relative_error: 1.0,
            square_error: 0.1,
            expected_error: (cost / work).sqrt(),
            missed: 0.0,
            time_ratio: 1.0,
        };
        let with = |light: f64| {
            vec![
                trial(Method::Bidirectional, 4.0, 1.0),
                trial(Method::Caustics, 2.0, 1.09),
                trial(Method::Light, 1.0, light),
            ]
        };
        assert_eq!(chosen(&with(1.11), ABOUT_FROM).method, Method::Caustics);
        assert_eq!(chosen(&with(1.09), ABOUT_FROM).method, Method::Light);
        assert_eq!(chosen(&with(1.11), ABOUT_FROM - 1).method, Method::Bidirectional);
        assert_eq!(chosen(&with(f64::NAN), ABOUT_FROM).method, Method::Caustics);
    }
}

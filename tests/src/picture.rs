//! Renders without a farm: what `core` alone says.

use ovtigre_core::{
    film::{
        allocate::{allocate, decided_after},
        append::Prefix,
        certificate::Look,
        error::{ErrorEstimate, estimate},
        estimate::{Picture, picture},
        schedule::Schedule,
        size::{Region, Size},
    },
    render::{
        batch::render_allocated,
        prepare::{Prepared, prepare},
        progress::Progress,
    },
    settings::{
        CameraChoice, Distribution, Environment, EnvironmentSource, FULL, Gloss, Method, Settings, Shadows,
        Shutter, Weights,
    },
};

/// Mean of replicates, and its standard error.
pub fn mean_and_error(means: &[f64]) -> (f64, f64) {
    let r = means.len() as f64;
    let mean = means.iter().sum::<f64>() / r;
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (r * (r - 1.0));
    (mean, variance.sqrt())
}

/// Mean over its samples, summed over the pixels of a rectangle and all channels.
fn sum_within(prefix: &Prefix, plane: usize, within: Region) -> f64 {
    let (region, values) = (prefix.region(), prefix.layer(plane));
    let bottom = (within.y + within.height).min(region.y + region.height);
    let row = |y: u32| {
        let start = ((y - region.y) * region.width + within.x - region.x) as usize * 3;
        values[start..start + within.width as usize * 3].iter().sum::<f64>()
    };
    (within.y.max(region.y)..bottom).map(row).sum::<f64>() / f64::from(prefix.samples())
}

/// Settings with nothing special.
pub fn settings(width: u32, height: u32, replicates: u32) -> Settings {
    Settings {
        size: Size { width, height },
        camera: CameraChoice::Index(0),
        variant: None,
        method: Method::Path,
        paths: FULL.to_owned(),
        layers: Vec::new(),
        gloss: Gloss::AsItIs,
        strategies: Vec::new(),
        weights: Weights::Balance,
        bounces: None,
        lens: None,
        shutter: Shutter::default(),
        environment: None,
        shadows: Shadows::On,
        seed: 0,
        replicates,
        sampling: Distribution::Uniform,
    }
}

/// The same settings in a uniform environment.
pub fn in_environment(mut settings: Settings, radiance: f32) -> Settings {
    let source = EnvironmentSource::Uniform([radiance; 3]);
    settings.environment = Some(Environment { source, rotation_degrees: 0.0 });
    settings
}

/// A scene's trees and lights.
pub fn scene(glb: &[u8], settings: &Settings) -> Prepared {
    prepare(glb, None, settings).expect("a scene that can be rendered")
}

/// What a render gave: one region, all replicates.
#[derive(Debug)]
pub struct Rendered {
    settings: Settings,
    prefixes: Vec<Vec<Prefix>>,
}

/// Renders `samples` samples a pixel and replicate, in one process.
pub fn rendered(glb: &[u8], settings: &Settings, samples: u32) -> Rendered {
    rendered_of(&scene(glb, settings), settings, samples)
}

/// The same of a scene that is prepared already. Where the settings' sampling is adaptive, it is as a farm's.
pub fn rendered_of(scene: &Prepared, settings: &Settings, samples: u32) -> Rendered {
    let planes = settings.layers.len() + 1;
    let frame = settings.size.frame();
    let schedule = Schedule::new(frame, planes as u32, settings.replicates, samples);
    let empty = |region: &Region| {
        (0..settings.replicates).map(|replicate| Prefix::empty(*region, replicate, planes)).collect()
    };
    let mut prefixes: Vec<Vec<Prefix>> = schedule.regions().iter().map(empty).collect();
    let adaptive = settings.sampling == Distribution::Adaptive;
    let decided =
        adaptive.then(|| decided_after(&schedule, samples).expect("enough samples")).map(|n| n as usize);
    let mut allocations = None;
    for block in 0..schedule.blocks().len() {
        if decided == Some(block) {
            allocations = allocate(settings.size, frame, &prefixes);
            assert!(allocations.is_some(), "there are replicates with samples");
        }
        for (region, prefixes) in prefixes.iter_mut().enumerate() {
            for prefix in prefixes {
                let batch = schedule.batch(region, prefix.replicate(), block).expect("in the schedule");
                let allocation = allocations.as_ref().map(|both| both.of(prefix.replicate()));
                let sum = render_allocated(scene, settings, batch, allocation, &Progress::new());
                let sum = sum.expect("not stopped");
                let appended = match allocation {
                    Some(allocation) => prefix.append_allocated(&sum, allocation),
                    None => prefix.append(&sum),
                };
                appended.expect("in order");
            }
        }
    }
    Rendered { settings: settings.clone(), prefixes }
}

impl Rendered {
    /// Means and standard errors of the pixels.
    pub fn picture(&self) -> Picture {
        picture(self.settings.size, self.settings.size.frame(), &self.prefixes)
    }

    /// The error of the whole picture.
    pub fn error(&self) -> ErrorEstimate {
        estimate(self.settings.size.frame(), &self.prefixes, Look::at(1)).expect("more than one replicate")
    }

    /// Samples dropped.
    pub fn invalid(&self) -> u64 {
        self.prefixes.iter().flatten().map(|p| p.invalid().total()).sum()
    }

    /// Samples taken, of all pixels and replicates.
    pub fn samples(&self) -> u64 {
        let of = |p: &Prefix| u64::from(p.samples()) * p.region().pixels() as u64;
        self.prefixes.iter().flatten().map(of).sum()
    }

    /// Rays traced.
    pub fn rays(&self) -> u64 {
        self.prefixes.iter().flatten().map(Prefix::rays).sum()
    }

    /// Mean over all pixels and channels, and its standard error from the spread between replicates.
    pub fn mean(&self) -> (f64, f64) {
        self.mean_of(0)
    }

    /// The same of a plane: 0 for the picture, then the layers.
    pub fn mean_of(&self, plane: usize) -> (f64, f64) {
        mean_and_error(&self.means(plane, self.settings.size.frame()))
    }

    /// Mean of each replicate over the pixels of a rectangle and all channels.
    pub fn means(&self, plane: usize, within: Region) -> Vec<f64> {
        (0..self.settings.replicates as usize)
            .map(|replicate| {
                let sum: f64 = self.prefixes.iter().map(|r| sum_within(&r[replicate], plane, within)).sum();
                sum / (3.0 * within.pixels() as f64)
            })
            .collect()
    }

    /// The whole of a plane, then its 4×4 blocks of a quarter of each side.
    pub fn parts(&self, plane: usize) -> Parts {
        let frame = self.settings.size.frame();
        let (width, height) = (frame.width / 4, frame.height / 4);
        let blocks =
            (0..16).map(|block| Region { x: block % 4 * width, y: block / 4 * height, width, height });
        Parts(std::iter::once(frame).chain(blocks).map(|part| self.means(plane, part)).collect())
    }

    /// Asserts that `other` has the same mean over the whole picture and over its blocks, see [`Parts::assert_same`].
    pub fn assert_same(&self, other: &Self, power: f64, what: &str) {
        self.parts(0).assert_same(&other.parts(0), power, what);
        assert_eq!((self.invalid(), other.invalid()), (0, 0), "{what}: samples were dropped");
    }

    /// Asserts that the mean of the picture is `truth`: within 4.5 standard errors (15 degrees of freedom: once in
    /// 2,400), which must be at most `power` of it, and 1e-5 of it for rounding.
    pub fn assert_mean(&self, truth: f64, power: f64, what: &str) {
        assert_eq!(self.settings.replicates, 16, "tolerances are derived for 16 replicates");
        let (mean, error) = self.mean();
        assert!(error <= power * truth, "{what}: the error {error} of {mean} is too large to find a bias");
        let tolerance = 4.5 * error + 1e-5 * truth;
        assert!((mean - truth).abs() <= tolerance, "{what}: {mean} ± {error}, but it should be {truth}");
        assert_eq!(self.invalid(), 0, "{what}: samples were dropped");
    }
}

/// Means of each replicate over parts of a picture: over all of it, then over its 4×4 blocks. They do not depend on how
/// many pixels it has.
#[derive(Debug)]
pub struct Parts(Vec<Vec<f64>>);

impl Parts {
    /// Of each part and replicate, what `of` makes of the means that some pictures have there.
    pub fn combined<const N: usize>(all: [&Self; N], of: impl Fn([f64; N]) -> f64) -> Self {
        let parts = 0..all[0].0.len();
        let replicates = 0..all[0].0[0].len();
        Self(parts.map(|p| replicates.clone().map(|r| of(all.map(|a| a.0[p][r]))).collect()).collect())
    }

    /// Mean and standard error over the whole picture.
    pub fn whole(&self) -> (f64, f64) {
        mean_and_error(&self.0[0])
    }

    /// Asserts that `other` has the same means: within 4.5 standard errors of the difference for the whole and 6 for a
    /// block (15 degrees of freedom and more: once in 2,400 and in 40,000), the whole known to `power` of its mean.
    pub fn assert_same(&self, other: &Self, power: f64, what: &str) {
        for (part, (a, b)) in self.0.iter().zip(&other.0).enumerate() {
            let (a, b) = (mean_and_error(a), mean_and_error(b));
            let (error, sigmas) = (a.1.hypot(b.1), if part == 0 { 4.5 } else { 6.0 });
            let where_ = if part == 0 { "all of it".to_owned() } else { format!("block {}", part - 1) };
            let tolerance = sigmas * error + 1e-5 * a.0.abs();
            assert!((a.0 - b.0).abs() <= tolerance, "{what}, {where_}: {a:?} against {b:?}");
            assert!(
                part > 0 || error <= power * a.0,
                "{what}: the error {error} of {} is too large to find a bias",
                a.0
            );
        }
    }
}

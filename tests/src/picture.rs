//! Renders without a farm: what `core` alone says.

use ovtigre_core::{
    film::{
        append::Prefix,
        error::{ErrorEstimate, estimate},
        estimate::{Picture, picture},
        schedule::Schedule,
        size::{Region, Size},
    },
    render::{
        batch::render,
        prepare::{Prepared, prepare},
        progress::Progress,
    },
    settings::{
        CameraChoice, Environment, EnvironmentSource, FULL, Gloss, Method, Settings, Shadows, Shutter,
        Weights,
    },
};

fn mean_and_error(means: &[f64]) -> (f64, f64) {
    let r = means.len() as f64;
    let mean = means.iter().sum::<f64>() / r;
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (r * (r - 1.0));
    (mean, variance.sqrt())
}

/// Mean over its samples, summed over the pixels of a rectangle and all channels.
fn sum_within(prefix: &Prefix, plane: usize, within: Region) -> f64 {
    let region = prefix.region();
    let inside = |i: usize| {
        let (x, y) = (region.x + i as u32 % region.width, region.y + i as u32 / region.width);
        (within.x..within.x + within.width).contains(&x) && (within.y..within.y + within.height).contains(&y)
    };
    let pixels = prefix.layer(plane).chunks(3).enumerate().filter(|(i, _)| inside(*i));
    pixels.map(|(_, rgb)| rgb.iter().sum::<f64>()).sum::<f64>() / f64::from(prefix.samples())
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
    let scene = scene(glb, settings);
    let planes = settings.layers.len() + 1;
    let schedule = Schedule::new(settings.size.frame(), planes as u32, settings.replicates, samples);
    let prefixes = (0..schedule.regions().len())
        .map(|region| {
            (0..settings.replicates)
                .map(|replicate| {
                    let mut prefix = Prefix::empty(schedule.regions()[region], replicate, planes);
                    for block in 0..schedule.blocks().len() {
                        let batch = schedule.batch(region, replicate, block).expect("in the schedule");
                        let sum = render(&scene, settings, batch, &Progress::new()).expect("not stopped");
                        prefix.append(&sum).expect("in order");
                    }
                    prefix
                })
                .collect()
        })
        .collect();
    Rendered { settings: settings.clone(), prefixes }
}

impl Rendered {
    /// Means and standard errors of the pixels.
    pub fn picture(&self) -> Picture {
        picture(self.settings.size, self.settings.size.frame(), &self.prefixes)
    }

    /// The error of the whole picture.
    pub fn error(&self) -> ErrorEstimate {
        estimate(self.settings.size.frame(), &self.prefixes, 1).expect("more than one replicate")
    }

    /// Samples dropped.
    pub fn invalid(&self) -> u64 {
        self.prefixes.iter().flatten().map(|p| p.invalid().total()).sum()
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

    /// Asserts that `other` has the same mean over the whole picture and over blocks of a quarter of its sides: within 4.5
    /// and 6 standard errors of the difference (15 degrees of freedom and more: once in 2,400 and in 40,000), the whole
    /// known to `power` of its mean.
    pub fn assert_same(&self, other: &Self, power: f64, what: &str) {
        let frame = self.settings.size.frame();
        let compare = |within: Region, sigmas: f64| {
            let (a, b) = (mean_and_error(&self.means(0, within)), mean_and_error(&other.means(0, within)));
            let error = a.1.hypot(b.1);
            let tolerance = sigmas * error + 1e-5 * a.0.abs();
            assert!((a.0 - b.0).abs() <= tolerance, "{what}, {within}: {a:?} against {b:?}");
            (error, a.0)
        };
        let (error, mean) = compare(frame, 4.5);
        assert!(error <= power * mean, "{what}: the error {error} of {mean} is too large to find a bias");
        let (width, height) = (frame.width / 4, frame.height / 4);
        for block in 0..16 {
            compare(Region { x: block % 4 * width, y: block / 4 * height, width, height }, 6.0);
        }
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

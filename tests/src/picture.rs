//! Renders without a farm: what `core` alone says.

use ovtigre_core::{
    film::{
        append::Prefix,
        error::{ErrorEstimate, estimate},
        estimate::{Picture, picture},
        schedule::Schedule,
        size::Size,
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

/// Settings with nothing special.
pub fn settings(width: u32, height: u32, replicates: u32) -> Settings {
    Settings {
        size: Size { width, height },
        camera: CameraChoice::Index(0),
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
    let schedule = Schedule::new(settings.size.frame(), 1, settings.replicates, samples);
    let prefixes = (0..schedule.regions().len())
        .map(|region| {
            (0..settings.replicates)
                .map(|replicate| {
                    let mut prefix = Prefix::empty(schedule.regions()[region], replicate, 1);
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
        let r = f64::from(self.settings.replicates);
        let means: Vec<f64> = (0..self.settings.replicates as usize)
            .map(|replicate| {
                let of_region = |p: &Prefix| p.layer(0).iter().sum::<f64>() / f64::from(p.samples());
                let sum: f64 = self.prefixes.iter().map(|region| of_region(&region[replicate])).sum();
                sum / (3.0 * self.settings.size.pixels() as f64)
            })
            .collect();
        let mean = means.iter().sum::<f64>() / r;
        let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (r * (r - 1.0));
        (mean, variance.sqrt())
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

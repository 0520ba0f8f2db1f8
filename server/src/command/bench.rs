//! `ovtigre bench`: error against run time of methods over scenes.
//!
//! Methods run in this process on one pool, not on a farm: what is compared is how they estimate light, and leases and
//! uploads, which are the same for all of them, are left out.

use super::{
    bench_table::{Entry, Known, csv, markdown},
    exit::{CommandError, Outcome},
    interrupt::Interrupt,
    output, scene_file, terminal,
    trial::{Plan, Trial},
    truth, words,
};
use clap::Args;
use ovtigre::plot::{Trace, svg};
use ovtigre_core::{
    film::{reference::Reference, size::Size},
    gltf::limits::Limits,
    render::inspect::{Contents, by_chance, inspect},
    settings::{CameraChoice, Distribution, FULL, Gloss, Method, Settings, Shadows, Shutter, Weights},
};
use std::{
    num::NonZeroUsize,
    path::{Path, PathBuf},
    sync::Arc,
    thread::available_parallelism,
};

/// Samples of a reference for each of the longest trial.
const REFERENCE_SAMPLES: u32 = 100;
/// Sequences of a reference.
const REFERENCE_REPLICATES: u32 = 16;
/// Samples a pixel at most.
const SAMPLES_MAX: u32 = 1 << 30;

/// Measure error against run time of methods over scenes.
#[derive(Args, Debug)]
pub(crate) struct Bench {
    /// Scenes to render: .glb, or .gltf with its files beside it.
    #[arg(value_name = "SCENE", required = true)]
    scenes: Vec<PathBuf>,
    /// Methods to compare.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "path,light,bidirectional,caustics", value_parser = method)]
    methods: Vec<Method>,
    /// Run time of each method on each scene: 60, 60s, 2m.
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = seconds)]
    budget: f64,
    /// What the errors are measured against: a picture of the same size for all scenes, one that is rendered for each of them, or
    /// nothing but the spread of the samples.
    #[arg(long, value_name = "auto|none|FILE.exr", default_value = "auto")]
    reference: String,
    /// Run time of a reference at most; it ends with 100 times the samples of any method [default: 4 times the budget].
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    reference_budget: Option<f64>,
    /// Size of the pictures in pixels [default: 256 by the camera's aspect ratio].
    #[arg(long, value_name = "WxH")]
    size: Option<Size>,
    /// Path expression [default: L(D|S)*E].
    #[arg(long, value_name = "EXPR")]
    paths: Option<String>,
    /// Threads [default: one a core].
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Independently scrambled sequences.
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(3..=256))]
    replicates: u32,
    /// Chooses the random sequences.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Files to write: NAME.csv, NAME.json, NAME.md, and NAME-SCENE.svg for each scene.
    #[arg(short, long, value_name = "NAME", default_value = "bench")]
    output: PathBuf,
}

impl Bench {
    /// Measures.
    pub(crate) async fn run(self) -> Outcome {
        output::check_writable(&self.named("csv"))?;
        let interrupt = Interrupt::listen();
        let work = tokio::task::spawn_blocking(move || self.bench());
        tokio::select! {
            done = work => done.map_err(|e| CommandError::failed(format!("the bench failed: {e}")))?,
            () = interrupt.once() => Err(CommandError::stopped("stopped before done; nothing is written")),
        }
    }

    fn named(&self, end: &str) -> PathBuf {
        let mut name = self.output.clone().into_os_string();
        name.push(format!(".{end}"));
        name.into()
    }

    fn bench(&self) -> Outcome {
        let threads = self.threads.or_else(|| available_parallelism().ok()).map_or(1, NonZeroUsize::get);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let pool = pool.map_err(|e| CommandError::failed(format!("cannot start threads: {e}")))?;
        let mut entries = Vec::new();
        for scene in &self.scenes {
            entries.push(pool.install(|| self.scene(scene))?);
        }
        output::save_text(&csv(&entries), &self.named("csv"))?;
        let document = serde_json::to_string_pretty(&entries).expect("plain data");
        output::save_text(&(document + "\n"), &self.named("json"))?;
        let text = markdown(&entries, threads);
        output::save_text(&text, &self.named("md"))?;
        for entry in &entries {
            let traces: Vec<Trace> =
                entry.trials.iter().map(|(method, trial)| trace(*method, trial)).collect();
            let mut name = self.output.clone().into_os_string();
            name.push(format!("-{}.svg", entry.scene));
            output::save_text(&svg(&entry.scene, &traces, None), Path::new(&name))?;
        }
        text.lines().for_each(terminal::result);
        Ok(())
    }

    fn scene(&self, path: &Path) -> Outcome<Entry> {
        let bytes: Arc<[u8]> = scene_file::bytes(path)?.into();
        let contents =
            inspect(Arc::clone(&bytes), &Limits::default()).map_err(|e| scene_file::fault(path, &e))?;
        let name = path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let mut trials = Vec::new();
        for method in &self.methods {
            let plan = self.plan(&contents, *method);
            let trial = Trial::run(Arc::clone(&bytes), &plan).map_err(|e| scene_file::fault(path, &e))?;
            let last = trial.last();
            terminal::remark(&format!(
                "{name}, {}: {} samples, error ±{:.4}, {}",
                method.name(),
                last.samples,
                last.relative_error,
                words::duration(last.wall_seconds)
            ));
            trials.push((*method, trial));
        }
        let known = match self.reference.as_str() {
            "none" => None,
            "auto" => {
                let longest = trials.iter().map(|(_, trial)| trial.last().samples).max().unwrap_or(1);
                Some(self.reference(path, bytes, &contents, longest)?)
            }
            file => Some(given(Path::new(file), self.size(&contents))?),
        };
        let known = known.map(|(reference, known)| {
            for (_, trial) in &mut trials {
                trial.compare(&reference);
            }
            known
        });
        Ok(Entry { scene: name, reference: known, trials })
    }

    /// A reference by another method than the first that is compared.
    fn reference(
        &self,
        path: &Path,
        bytes: Arc<[u8]>,
        contents: &Contents,
        longest: u32,
    ) -> Outcome<(Reference, Known)> {
        let method = match self.methods.as_slice() {
            [Method::Bidirectional] => Method::Path,
            _ => Method::Bidirectional,
        };
        let mut plan = self.plan(contents, method);
        plan.settings.seed = !self.seed;
        plan.settings.replicates = REFERENCE_REPLICATES;
        plan.budget = self.reference_budget.unwrap_or(4.0 * self.budget);
        plan.samples = longest.saturating_mul(REFERENCE_SAMPLES).min(SAMPLES_MAX);
        let trial = Trial::run(bytes, &plan).map_err(|e| scene_file::fault(path, &e))?;
        let reference = Reference::of_picture(trial.picture());
        let known = Known {
            method: method.name().to_owned(),
            samples: Some(trial.last().samples),
            own_error: reference.own_error(),
        };
        terminal::remark(&format!("reference: {}", known.line()));
        Ok((reference, known))
    }

    fn size(&self, contents: &Contents) -> Size {
        self.size.unwrap_or_else(|| {
            let aspect = contents.aspects.first().copied().flatten().unwrap_or(16.0 / 9.0);
            Size { width: 256, height: (256.0 / aspect).round().clamp(1.0, 4096.0) as u32 }
        })
    }

    fn plan(&self, contents: &Contents, method: Method) -> Plan {
        let camera = if contents.aspects.is_empty() { CameraChoice::Framed } else { CameraChoice::Index(0) };
        let settings = Settings {
            size: self.size(contents),
            camera,
            variant: None,
            method,
            paths: self.paths.clone().unwrap_or_else(|| FULL.to_owned()),
            layers: Vec::new(),
            gloss: Gloss::AsItIs,
            strategies: Vec::new(),
            weights: Weights::Balance,
            bounces: None,
            lens: None,
            shutter: Shutter::default(),
            environment: None,
            shadows: Shadows::On,
            seed: self.seed,
            replicates: self.replicates,
            sampling: Distribution::Uniform,
        };
        let by_chance = by_chance(method, contents.letters, contents.brightest);
        Plan { settings, budget: self.budget, samples: SAMPLES_MAX, by_chance }
    }
}

fn given(path: &Path, size: Size) -> Outcome<(Reference, Known)> {
    let wrong = |reason: String| CommandError::wrong(format!("{}: {reason}", path.display()));
    let reference = Reference::of_layers(&truth::read(path)?).map_err(wrong)?;
    if reference.size() != size {
        let reason = format!("it has {} pixels and the pictures {size}: set --size", reference.size());
        return Err(wrong(reason));
    }
    let own_error = reference.own_error();
    Ok((reference, Known { method: path.display().to_string(), samples: None, own_error }))
}

fn trace(method: Method, trial: &Trial) -> Trace {
    let rows = &trial.rows;
    Trace {
        name: method.name().to_owned(),
        estimated: rows.iter().map(|row| [row.wall_seconds, row.relative_error]).collect(),
        upper: rows
            .iter()
            .filter_map(|row| row.relative_error_upper.map(|upper| [row.wall_seconds, upper]))
            .collect(),
        doubted: rows
            .iter()
            .filter(|row| row.doubted)
            .map(|row| [row.wall_seconds, row.relative_error])
            .collect(),
        truth: rows.iter().filter_map(|row| row.true_error.map(|error| [row.wall_seconds, error])).collect(),
        slope: trial.slope(),
    }
}

fn method(text: &str) -> Result<Method, String> {
    match text {
        "path" => Ok(Method::Path),
        "light" => Ok(Method::Light),
        "bidirectional" => Ok(Method::Bidirectional),
        "caustics" => Ok(Method::Caustics),
        "photon" => Ok(Method::Photon),
        "radiosity" => Ok(Method::Radiosity),
        _ => Err("methods are path, light, bidirectional, caustics, photon and radiosity".to_owned()),
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    let (number, scale) = match text.strip_suffix(['s', 'm', 'h']) {
        Some(number) if text.ends_with('m') => (number, 60.0),
        Some(number) if text.ends_with('h') => (number, 3600.0),
        Some(number) => (number, 1.0),
        None => (text, 1.0),
    };
    let number: f64 = number.parse().map_err(|_| "write seconds, such as 60, 60s or 2m".to_owned())?;
    if number > 0.0 && number.is_finite() { Ok(number * scale) } else { Err("it is not positive".to_owned()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_units() {
        assert_eq!([seconds("60"), seconds("1.5s"), seconds("2m")], [Ok(60.0), Ok(1.5), Ok(120.0)]);
        for text in ["", "s", "-1", "inf", "1d", "0"] {
            assert!(seconds(text).is_err(), "{text}");
        }
    }
}

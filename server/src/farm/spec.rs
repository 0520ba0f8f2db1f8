//! A job, resolved: what is kept of it in the store's `spec`.

use super::book::Wants;
use ovtigre_core::{
    film::{
        schedule::Schedule,
        size::{Region, Size},
    },
    path::reach::Unreachable,
    render::pilot::report::Pilot,
    settings::{CameraChoice, Distribution, FULL, Gloss, Method, Settings, Shadows, Shutter, Weights},
};
use ovtigre_proto::{id::BlobId, job::JobRequest, needs::Needs, pair::EnvironmentRequest};
use serde::{Deserialize, Deserializer, Serialize, de::Error as _};
use serde_json::Value;
use std::sync::LazyLock;

/// A job with every default resolved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JobSpec {
    /// What was asked for.
    pub request: JobRequest,
    /// What is rendered.
    #[serde(deserialize_with = "stored")]
    pub settings: Settings,
    /// Pixels that are rendered.
    pub region: Region,
    /// Samples a pixel in each replicate, at most.
    pub samples: u32,
    /// Relative error to stop at.
    pub error_target: Option<f64>,
    /// Seconds of run time to stop after.
    pub seconds: Option<f64>,
    /// Version of the program whose workers render it; any where it is empty.
    #[serde(default)]
    pub build: String,
    /// The id of the token that sent it.
    #[serde(default)]
    pub owner: Option<String>,
    /// Number of blocks after which samples are allocated; `None` where all pixels have the same number of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub decided_after: Option<u32>,
    /// The brightest that a sample can be which meets a light by chance only.
    #[serde(default)]
    pub by_chance: Option<f64>,
    /// What it needs, and what it leaves out.
    #[serde(default)]
    pub needs: Needs,
    /// Why the method was chosen.
    pub method_reason: String,
    /// What its workers fetch, where that is not the scene itself.
    #[serde(default)]
    pub fetched: Option<BlobId>,
    /// What was tried to choose it, if anything was.
    #[serde(default)]
    pub pilot: Option<Pilot>,
    /// Paths that are asked for and that no technique of the method makes.
    #[serde(default)]
    pub unreachable: Vec<Unreachable>,
    /// What the scene lacked or could not be read, and what was done about it.
    pub warnings: Vec<String>,
}

impl JobSpec {
    /// Who may render it; `class` is that of the processors that began it.
    pub fn wants(&self, class: Option<String>) -> Wants {
        Wants {
            build: self.build.clone(),
            class,
            tags: self.request.tags.clone(),
            max_workers: self.request.max_workers,
            weight: self.request.weight.unwrap_or(1).max(1),
        }
    }

    /// Its batches.
    pub fn schedule(&self) -> Schedule {
        let Settings { method, replicates, .. } = self.settings;
        if method.splats() {
            Schedule::whole(self.region, replicates, self.samples)
        } else {
            Schedule::new(self.region, self.settings.planes(), replicates, self.samples)
        }
    }

    /// Samples a pixel at most, over all replicates.
    pub fn samples_asked(&self) -> u32 {
        self.samples.saturating_mul(self.settings.replicates)
    }

    /// Bytes of its largest partial sum: three f32 a pixel and plane.
    pub fn partial_bytes(&self) -> u64 {
        let pixels = self.schedule().regions().iter().map(|region| region.pixels() as u64).max();
        pixels.unwrap_or(0) * u64::from(self.settings.planes()) * 12
    }

    /// Bytes of its sums in memory: three f64 a pixel, plane and replicate.
    pub fn sums_bytes(&self) -> u64 {
        self.region.pixels() as u64
            * u64::from(self.settings.planes())
            * u64::from(self.settings.replicates)
            * 24
    }

    /// The file that its workers fetch and render.
    pub fn fetched<'a>(&'a self, scene: &'a BlobId) -> &'a BlobId {
        self.fetched.as_ref().unwrap_or(scene)
    }

    /// Uploaded files that are needed to render it, and to render it once more.
    pub fn files(&self, scene: &BlobId) -> Vec<BlobId> {
        let mut files = vec![scene.clone()];
        files.extend(self.fetched.clone());
        if let Some(EnvironmentRequest::Image(image)) = &self.request.environment {
            files.push(image.clone());
        }
        files
    }

    /// Hash of all that a sum depends on beside its batch.
    pub fn identity(&self, scene: &BlobId) -> blake3::Hash {
        let mut hasher = blake3::Hasher::new();
        hasher.update(scene.as_str().as_bytes());
        hasher.update(&serde_json::to_vec(&self.settings).expect("settings are plain data"));
        for n in [self.region.x, self.region.y, self.region.width, self.region.height] {
            hasher.update(&n.to_le_bytes());
        }
        hasher.finalize()
    }
}

/// What a job's settings were where its document does not say: jobs of earlier versions were rendered so.
fn before() -> Settings {
    Settings {
        size: Size { width: 1, height: 1 },
        camera: CameraChoice::Framed,
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
        replicates: 1,
        sampling: Distribution::Uniform,
    }
}

/// Settings as this version or an earlier one stored them.
fn stored<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Settings, D::Error> {
    static BEFORE: LazyLock<Value> = LazyLock::new(|| serde_json::to_value(before()).unwrap_or_default());
    let mut says = serde_json::Map::<String, Value>::deserialize(deserializer)?;
    for (name, value) in BEFORE.as_object().into_iter().flatten() {
        if !says.contains_key(name) {
            says.insert(name.clone(), value.clone());
        }
    }
    serde_json::from_value(Value::Object(says)).map_err(D::Error::custom)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the first version stored it.
    const FIRST: &str = r#"{"request":{"scene":"0000000000000000000000000000000000000000000000000000000000000001",
        "samples":16},"settings":{"size":{"width":40,"height":30},"camera":"framed","method":"path","bounces":null,
        "lens":null,"environment":null,"shadows":"on","seed":7,"replicates":4},"region":{"x":0,"y":0,"width":40,
        "height":30},"samples":4,"error_target":null,"seconds":null,"paths":"L(D|S)*E","method_reason":"the only one",
        "warnings":[]}"#;

    #[test]
    fn a_job_that_the_first_version_took_is_read_as_it_was_meant() {
        let spec: JobSpec = serde_json::from_str(FIRST).unwrap();
        assert_eq!((spec.settings.seed, spec.settings.replicates, spec.samples), (7, 4, 4));
        assert_eq!((&*spec.settings.paths, spec.settings.layers.len()), (FULL, 0));
        let again: JobSpec = serde_json::from_str(&serde_json::to_string(&spec).unwrap()).unwrap();
        assert_eq!(again, spec);
    }

    #[test]
    fn settings_of_a_later_version_are_refused() {
        let later = FIRST.replace(r#""seed":7"#, r#""seed":7,"later":1"#);
        let error = serde_json::from_str::<JobSpec>(&later).unwrap_err().to_string();
        assert!(error.contains("later"), "{error}");
    }
}

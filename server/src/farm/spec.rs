//! A job, resolved: what is kept of it in the store's `spec`.

use super::book::Wants;
use ovtigre_core::{
    film::{schedule::Schedule, size::Region},
    path::reach::Unreachable,
    settings::Settings,
};
use ovtigre_proto::{id::BlobId, job::JobRequest};
use serde::{Deserialize, Serialize};

/// A job with every default resolved.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JobSpec {
    /// What was asked for.
    pub request: JobRequest,
    /// What is rendered.
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
    /// Why the method was chosen.
    pub method_reason: String,
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

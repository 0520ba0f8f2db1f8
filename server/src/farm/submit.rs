//! A request becomes a job: checked, every default resolved.

use super::{
    Farm, allocation,
    choice::candidates,
    error::{FarmError, Result, fault},
    light_groups::{expanded, unknown},
    needs::needs,
    numbers::numbers,
    paths::choose,
    reach::{letters, line, missing},
    rules::{PARTIAL_BYTES_MAX, Rules},
    spec::JobSpec,
};
use crate::{
    fail_point::FailPoint,
    store::{
        notice::Webhook,
        row::{Added, IdempotencyKey, NewJob},
    },
    webhook,
};
use ovtigre_core::{
    bsdf::event::Letters,
    film::{
        size::{Region, Size},
        sketch::Sketch,
    },
    path::expression::language::Language,
    render::inspect::{DEFAULT_SKY, by_chance},
    settings::{CameraChoice, Environment, EnvironmentSource, Lens, Settings, Shutter},
};
use ovtigre_proto::{
    id::BlobId,
    job::{JobRequest, REPLICATES_DEFAULT, SAMPLES_DEFAULT, WIDTH_DEFAULT},
    needs::Needs,
    pair::EnvironmentRequest,
    problem::Fault,
    scene::{SceneContent, SceneContents, SceneReport},
    status::JobStatus,
    telemetry::span::Place,
};
use std::{sync::Arc, time::SystemTime};

/// Samples a pixel of a job, at most.
pub(super) const SAMPLES_MAX: u32 = 1 << 22;
/// Replicates of a job, at most.
pub(super) const REPLICATES_MAX: u32 = 256;
/// Longest name.
const NAME_MAX: usize = 200;
/// Largest weight.
pub(super) const WEIGHT_MAX: u32 = 1000;
/// Tags of a job or a worker, at most.
pub(super) const TAGS_MAX: usize = 64;
/// Longest idempotency key.
const KEY_MAX: usize = 255;
/// Width over height where a camera does not say.
const ASPECT_DEFAULT: f64 = 16.0 / 9.0;

impl Farm {
    /// Checks a request; what it would become, or all its faults.
    pub async fn check(&self, request: JobRequest) -> Result<JobSpec> {
        Ok(self.sketched(request).await?.0)
    }

    /// The same, with a small picture of the job where one was made on the way.
    async fn sketched(&self, request: JobRequest) -> Result<(JobSpec, Option<Sketch>)> {
        self.webhook(&request)?;
        let scene = request.scene.clone();
        let scene = scene.ok_or_else(|| FarmError::Request(vec![fault("/scene", "'scene' is required")]))?;
        let mut contents = match self.upload_at("/scene", &scene).await?.content {
            SceneContent::Scene(contents) => contents,
            SceneContent::Environment { .. } => {
                let detail =
                    format!("'{scene}' is an image: give a scene here, and the image as 'environment'");
                return Err(FarmError::Request(vec![fault("/scene", detail)]));
            }
        };
        match &request.environment {
            None => {}
            Some(EnvironmentRequest::Uniform(radiance)) => {
                contents.brightest =
                    radiance.iter().copied().map(f64::from).fold(contents.brightest, f64::max);
            }
            Some(EnvironmentRequest::Image(id)) => match self.upload_at("/environment", id).await?.content {
                SceneContent::Environment { width, height, brightest } => {
                    contents.pixels += u64::from(width) * u64::from(height);
                    contents.brightest = contents.brightest.max(brightest);
                }
                SceneContent::Scene(_) => {
                    let detail = format!("'{id}' is a scene: give an uploaded image here");
                    return Err(FarmError::Request(vec![fault("/environment", detail)]));
                }
            },
        }
        let request = expanded(request, &contents).map_err(FarmError::Request)?;
        let candidates = candidates(&request, &contents, &self.rules).map_err(FarmError::Request)?;
        let (mut spec, sketch) = self.chosen_of(candidates, &contents).await?;
        spec.request.webhook = spec.request.webhook.as_ref().map(webhook::shown);
        Ok((spec, sketch))
    }

    /// Whom to tell of the job's changes.
    fn webhook(&self, request: &JobRequest) -> Result<Option<Webhook>> {
        let check = |wish| webhook::check(wish, self.messenger.reach());
        request.webhook.as_ref().map(check).transpose().map_err(FarmError::Request)
    }

    /// An error where the owner has as many jobs under way as one may have.
    fn has_room_for(&self, owner: Option<&str>) -> Result<()> {
        let most = self.rules.jobs_per_token;
        let its =
            |owner| self.lives().iter().filter(|live| live.spec.owner.as_deref() == Some(owner)).count();
        match owner {
            Some(owner) if its(owner) >= most => Err(FarmError::TooManyJobs { most }),
            _ => Ok(()),
        }
    }

    pub(super) async fn upload_at(&self, pointer: &str, id: &BlobId) -> Result<SceneReport> {
        self.uploaded(id).await?.ok_or_else(|| not_uploaded(pointer, id))
    }

    /// Takes a job of `owner`, a token's id. The same request of one owner under the same key is taken once.
    pub async fn submit(
        self: &Arc<Self>,
        request: JobRequest,
        key: Option<String>,
        owner: Option<String>,
    ) -> Result<JobStatus> {
        let came = SystemTime::now();
        if key.as_ref().is_some_and(|key| key.is_empty() || key.len() > KEY_MAX) {
            let detail = format!("the idempotency key has 1 to {KEY_MAX} bytes");
            return Err(FarmError::Request(vec![fault("", detail)]));
        }
        let asked = serde_json::to_vec(&request).map_err(|e| FarmError::Damaged(e.to_string()))?;
        let key = key.map(|key| IdempotencyKey {
            key: format!("{}/{key}", owner.as_deref().unwrap_or_default()),
            fingerprint: blake3::hash(&asked).to_hex().to_string(),
        });
        // A job that was taken before is told of, also where no further one would be taken.
        if let Some(key) = &key
            && let Some(before) = self.store.keyed(key).await?
        {
            return self.taken_before(before).await;
        }
        self.need_room()?;
        let webhook = self.webhook(&request)?;
        let (mut spec, sketch) = Box::pin(self.sketched(request)).await?;
        self.has_room_for(owner.as_deref())?;
        self.strip(&mut spec).await?;
        spec.owner = owner;
        let id = self.ids.job();
        let scene = spec.request.scene.clone().expect("checked: a scene is there");
        let new = NewJob {
            id: id.clone(),
            name: spec.request.name.clone().unwrap_or_else(|| scene.as_str()[..12].to_owned()),
            files: spec.files(&scene),
            scene,
            priority: spec.request.priority.unwrap_or(0),
            spec: serde_json::to_string(&spec).map_err(|e| FarmError::Damaged(e.to_string()))?,
            regions: spec.schedule().regions().len() as u32,
            replicates: spec.settings.replicates,
            webhook,
        };
        FailPoint::JobBeforeRow.pass();
        match self.store.add_job(new, key).await? {
            Added::New => {
                FailPoint::JobAfterRow.pass();
                let row = self.job_row(&id).await?;
                tracing::info!(job = %id, name = row.name, "job taken");
                let span = self.traces.span("submit", Place::OfJob(&id)).since(came);
                let _span = span.note("ovtigre.scene", row.scene.to_string());
                if let Some(sketch) = sketch {
                    self.sketches.keep(id, sketch);
                }
                self.take_up(&row).await?;
                self.status_of(&row).await
            }
            before => self.taken_before(before).await,
        }
    }

    async fn taken_before(&self, before: Added) -> Result<JobStatus> {
        match before {
            Added::New | Added::KeyTaken => Err(FarmError::KeyTaken),
            // It was there when the request was checked.
            Added::Lacks(file) => Err(not_uploaded("/scene", &file)),
            Added::Before(id) => self.status(&id).await,
        }
    }
}

pub(super) fn not_uploaded(pointer: &str, id: &BlobId) -> FarmError {
    let detail = format!("'{id}' was not uploaded: PUT its bytes to /v1/scenes/{id} first");
    FarmError::Request(vec![fault(pointer, detail)])
}

/// Whether samples can be split over replicates, and replicates tell an error.
fn shares(request: &JobRequest, samples: u32, replicates: u32, note: &mut impl FnMut(&str, String)) {
    if samples < replicates {
        let detail = format!(
            "{samples} samples cannot be split over {replicates} replicates: ask for more, or for fewer replicates"
        );
        note("/samples", detail);
    }
    if request.error.is_some() && replicates < 3 {
        note("/replicates", "an error target needs 3 replicates or more: fewer have no interval".to_owned());
    }
}

/// The size of the frame, and the region of it that is rendered.
fn frame(
    request: &JobRequest,
    scene: &SceneContents,
    camera: CameraChoice,
    note: &mut impl FnMut(&str, String),
) -> (Size, Region) {
    let size = request.size.unwrap_or_else(|| default_size(scene, camera));
    if size.width == 0 || size.height == 0 || size.width.max(size.height) > Size::SIDE_MAX {
        note("/size", format!("each side is 1 to {} pixels", Size::SIDE_MAX));
    }
    let region = request.region.unwrap_or(size.frame());
    if !region.is_in(size) {
        note("/region", format!("the region {region} does not lie in the frame of {size}"));
    }
    (size, region)
}

/// A request with every default resolved, or all its faults. An open method is `path`.
pub fn resolve(
    request: JobRequest,
    scene: &SceneContents,
    rules: &Rules,
) -> std::result::Result<JobSpec, Vec<Fault>> {
    let mut faults = Vec::new();
    let mut note = |pointer: &str, detail: String| faults.push(fault(pointer, detail));
    let (chosen, language) = choose(&request, &mut note);
    numbers(&request, &mut note);
    let camera = camera(&request, scene).unwrap_or_else(|detail| {
        note("/camera", detail);
        CameraChoice::Framed
    });
    if let Some(detail) = request.variant.as_ref().and_then(|wanted| no_variant(wanted, scene)) {
        note("/variant", detail);
    }
    let (size, region) = frame(&request, scene, camera, &mut note);
    let samples = request.samples.unwrap_or(SAMPLES_DEFAULT);
    let replicates = request.replicates.unwrap_or(REPLICATES_DEFAULT.min(samples));
    shares(&request, samples, replicates, &mut note);
    let sampling = allocation::wished(&request, chosen.method, replicates, &mut note);
    let lens = lens(&request).unwrap_or_else(|(pointer, detail)| {
        note(pointer, detail);
        None
    });
    if !faults.is_empty() {
        return Err(faults);
    }
    let lit = if request.environment.is_some() { Lit::ByRequest } else { Lit::ByScene };
    let words = language.as_ref().map_or(Letters::NONE, Language::letters);
    let unnamed = language.as_ref().and_then(|language| unknown(language, &request, scene));
    let unreachable = language
        .map(|language| missing(&language, chosen.method, &request, scene, camera, lens))
        .unwrap_or_default();
    let mut warnings = warnings(scene, lit, camera, samples, replicates);
    warnings.extend(unnamed.into_iter().chain(unreachable.iter().map(line)));
    let mut spec = JobSpec {
        settings: Settings {
            size,
            camera,
            variant: request.variant.clone(),
            method: chosen.method,
            paths: chosen.paths,
            layers: chosen.layers,
            gloss: chosen.gloss,
            strategies: chosen.strategies,
            weights: chosen.weights,
            bounces: request.bounces,
            lens,
            shutter: request.shutter.map_or_else(Shutter::default, |[open, close]| Shutter { open, close }),
            environment: environment(&request),
            shadows: request.shadows.unwrap_or_default(),
            seed: request.seed.unwrap_or(0),
            replicates,
            sampling,
        },
        region,
        samples: samples / replicates,
        error_target: request.error,
        seconds: request.seconds,
        build: rules.build.to_owned(),
        owner: None,
        decided_after: None,
        by_chance: by_chance(chosen.method, letters(scene), scene.brightest),
        needs: Needs::default(),
        fetched: None,
        method_reason: chosen.reason.to_owned(),
        pilot: None,
        unreachable,
        warnings,
        request,
    };
    spec.needs = needs(scene, &spec.settings, words);
    allocation::resolve(&mut spec);
    fits(&spec, rules).map(|()| spec)
}

/// What is wrong with a text for people.
pub(super) fn bad_text(text: &str) -> Option<String> {
    if text.is_empty() || text.len() > NAME_MAX {
        return Some(format!("a name has 1 to {NAME_MAX} bytes"));
    }
    text.chars().any(char::is_control).then(|| "a name has no control characters".to_owned())
}

/// A camera by its name, else by its number; the first, else one that frames the scene.
fn camera(request: &JobRequest, scene: &SceneContents) -> std::result::Result<CameraChoice, String> {
    let Some(wanted) = &request.camera else {
        return Ok(if scene.cameras.is_empty() { CameraChoice::Framed } else { CameraChoice::Index(0) });
    };
    let named = scene.cameras.iter().position(|name| name == wanted);
    let numbered = || wanted.parse().ok().filter(|n: &usize| *n < scene.cameras.len());
    match named.or_else(numbered) {
        Some(n) => Ok(CameraChoice::Index(n as u32)),
        None if scene.cameras.is_empty() => Err(format!(
            "the scene has no camera '{wanted}', and no other: leave 'camera' out to have it framed"
        )),
        None => {
            let called = |(n, name): (usize, &String)| match name.as_str() {
                "" => n.to_string(),
                name => format!("{n} '{name}'"),
            };
            let list: Vec<String> = scene.cameras.iter().enumerate().map(called).collect();
            Err(format!("the scene has no camera '{wanted}'; it has {}", list.join(", ")))
        }
    }
}

/// Why a scene has no variant of this name.
fn no_variant(wanted: &String, scene: &SceneContents) -> Option<String> {
    let list: Vec<String> = scene.variants.iter().map(|name| format!("'{name}'")).collect();
    match &list[..] {
        _ if scene.variants.contains(wanted) => None,
        [] => Some(format!("the scene has no variant '{wanted}', and no other: leave 'variant' out")),
        list => Some(format!("the scene has no variant '{wanted}'; it has {}", list.join(", "))),
    }
}

fn default_size(scene: &SceneContents, camera: CameraChoice) -> Size {
    let says = match camera {
        CameraChoice::Framed => None,
        CameraChoice::Index(n) => scene.camera_aspect_ratios.get(n as usize).copied().flatten(),
    };
    let aspect = says.filter(|a| a.is_finite() && *a > 0.0).unwrap_or(ASPECT_DEFAULT);
    let height = (f64::from(WIDTH_DEFAULT) / aspect).round().clamp(1.0, f64::from(Size::SIDE_MAX));
    Size { width: WIDTH_DEFAULT, height: height as u32 }
}

type At<T> = std::result::Result<T, (&'static str, String)>;

fn lens(request: &JobRequest) -> At<Option<Lens>> {
    let positive = |x: f64| x.is_finite() && x > 0.0;
    match (request.lens_radius, request.focus_distance) {
        (None | Some(0.0), None) => Ok(None),
        (Some(radius), _) if !(radius == 0.0 || positive(radius)) => {
            Err(("/lens_radius", "the lens' radius is a number of metres, 0 for a pinhole".to_owned()))
        }
        (_, Some(distance)) if !positive(distance) => {
            Err(("/focus_distance", "the distance in focus is a positive number of metres".to_owned()))
        }
        (None | Some(0.0), Some(_)) => Ok(None),
        (Some(_), None) => {
            Err(("/focus_distance", "a lens needs a distance in focus: give 'focus_distance'".to_owned()))
        }
        (Some(radius), Some(focus_distance)) => Ok(Some(Lens { radius, focus_distance })),
    }
}

fn environment(request: &JobRequest) -> Option<Environment> {
    let source = match request.environment.as_ref()? {
        EnvironmentRequest::Uniform(rgb) => EnvironmentSource::Uniform(*rgb),
        EnvironmentRequest::Image(id) => EnvironmentSource::Image(id.to_string()),
    };
    Some(Environment { source, rotation_degrees: request.environment_rotation.unwrap_or(0.0) })
}

/// Who says where light comes from.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Lit {
    ByScene,
    ByRequest,
}

fn warnings(
    scene: &SceneContents,
    lit: Lit,
    camera: CameraChoice,
    samples: u32,
    replicates: u32,
) -> Vec<String> {
    let mut warnings = Vec::new();
    if camera == CameraChoice::Framed {
        warnings.push("the scene has no camera: it is framed".to_owned());
    }
    if !samples.is_multiple_of(replicates) {
        let drawn = samples / replicates * replicates;
        warnings.push(format!(
            "{samples} samples are not a multiple of {replicates} replicates: {drawn} are drawn"
        ));
    }
    if lit == Lit::ByScene && scene.needs.iter().any(|need| need == DEFAULT_SKY) {
        warnings.push("the scene has no light of its own: it gets a default sky".to_owned());
    }
    warnings.extend(scene.warnings.iter().map(|w| {
        if w.pointer.is_empty() { w.detail.clone() } else { format!("{}: {}", w.pointer, w.detail) }
    }));
    warnings
}

pub(super) fn fits(spec: &JobSpec, rules: &Rules) -> std::result::Result<(), Vec<Fault>> {
    let Region { width, height, .. } = spec.region;
    let planes = spec.settings.planes();
    let (needs, has) = (spec.sums_bytes(), rules.sums_bytes);
    if needs > has {
        let detail = format!(
            "the sums of {width}x{height} pixels in {} replicates of {planes} planes need {} MiB, and this farm has {} MiB: ask for a smaller picture, a region of it, or fewer replicates or layers",
            spec.settings.replicates,
            needs >> 20,
            has >> 20
        );
        return Err(vec![fault("/size", detail)]);
    }
    let partial = spec.partial_bytes();
    if partial > PARTIAL_BYTES_MAX as u64 {
        let detail = format!(
            "method '{}' brings {width}x{height} pixels of {planes} planes as one sum of {} MiB, and {} MiB is taken: ask for a smaller picture, a region of it, or fewer layers",
            spec.settings.method.name(),
            partial >> 20,
            PARTIAL_BYTES_MAX >> 20
        );
        return Err(vec![fault("/size", detail)]);
    }
    Ok(())
}

//! What a job is asked to be: the flags of `render` and `submit`.

use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};
use ovtigre_core::{
    film::size::{Region, Size},
    path::expression::language::Language,
    settings::{Distribution, Shadows},
};
use ovtigre_proto::{
    id::BlobId,
    job::{JobRequest, LAYER_OF_EACH_LIGHT, MethodRequest, WeightsRequest},
    pair::EnvironmentRequest,
    webhook::WebhookRequest,
};
use serde::de::DeserializeOwned;
use std::path::PathBuf;

/// The flags of `render` and `submit`.
#[derive(Args, Clone, Debug)]
#[command(allow_negative_numbers = true)]
pub(crate) struct JobFlags {
    /// Picture to write [default: the scene's name with .exr]; .png also writes a developed picture.
    #[arg(short, long, value_name = "FILE.exr")]
    pub(crate) output: Option<PathBuf>,
    /// Frame in pixels [default: 1280 by the camera's aspect ratio].
    #[arg(long, value_name = "WxH")]
    pub(crate) size: Option<Size>,
    /// Camera, by its name or its number from 0 [default: the first; without one the scene is framed].
    #[arg(long, value_name = "NAME|INDEX")]
    pub(crate) camera: Option<String>,
    /// Variant of the scene's materials, by its name [default: the materials that the scene has without].
    #[arg(long, value_name = "NAME")]
    pub(crate) variant: Option<String>,
    /// Samples a pixel at most [default: 256].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) samples: Option<u32>,
    /// Stop when the relative error is certified at or under this, such as 0.01 [default: never].
    #[arg(long, value_name = "E", value_parser = positive)]
    pub(crate) error: Option<f64>,
    /// Stop after this many seconds of run time [default: never].
    #[arg(long, value_name = "S", value_parser = positive)]
    pub(crate) seconds: Option<f64>,
    /// Path expression: words from the light to the eye of `D`, `S` and `S_M` [default: L(D|S)*E].
    #[arg(long, value_name = "EXPR", conflicts_with = "preset", value_parser = paths)]
    pub(crate) paths: Option<String>,
    /// A path expression by its name [default: full].
    #[arg(long, value_name = "NAME", value_parser = ["phong", "whitted", "cook", "radiosity", "full"])]
    pub(crate) preset: Option<String>,
    /// How light is estimated [default: auto].
    #[arg(long, value_parser = named::<MethodRequest>(&["auto", "path", "light", "bidirectional", "caustics", "photon", "radiosity"]))]
    pub(crate) method: Option<MethodRequest>,
    /// A further picture of only those paths, or of a technique (s,t) of bidirectional; `lights` is one for each light that has a name; repeatable.
    #[arg(long = "layer", value_name = "NAME=EXPR", value_parser = layer)]
    pub(crate) layers: Vec<String>,
    /// Only these (s,t) techniques of bidirectional, such as "0,3;1,2" [default: all].
    #[arg(long, value_name = "LIST")]
    pub(crate) strategies: Option<String>,
    /// How techniques are weighed against each other [default: balance].
    #[arg(long, value_parser = named::<WeightsRequest>(&["balance", "power", "uniform", "single"]))]
    pub(crate) weights: Option<WeightsRequest>,
    /// Longest path in scattering events [default: none].
    #[arg(long, value_name = "N")]
    pub(crate) bounces: Option<u32>,
    /// Radius of a thin lens in metres [default: a pinhole].
    #[arg(long, value_name = "M", requires = "focus_distance", value_parser = positive)]
    pub(crate) lens_radius: Option<f64>,
    /// Distance of the plane in focus in metres.
    #[arg(long, value_name = "M", requires = "lens_radius", value_parser = positive)]
    pub(crate) focus_distance: Option<f64>,
    /// Seconds of the scene's animation at which the shutter opens and closes [default: 0,0].
    #[arg(long, value_name = "OPEN,CLOSE", value_parser = shutter, allow_hyphen_values = true)]
    pub(crate) shutter: Option<[f64; 2]>,
    /// Light from infinitely far: an image, or the same radiance from everywhere in W/(sr·m²) [default: the scene's].
    #[arg(long, value_name = "FILE.exr|R,G,B")]
    pub(crate) environment: Option<String>,
    /// Turn of the environment around the vertical axis in degrees [default: 0].
    #[arg(long, value_name = "DEG", requires = "environment", value_parser = finite, allow_hyphen_values = true)]
    pub(crate) environment_rotation: Option<f64>,
    /// Whether direct light is blocked [default: on].
    #[arg(long, value_parser = named::<Shadows>(&["on", "off"]))]
    pub(crate) shadows: Option<Shadows>,
    /// Which pixels get how many samples: all the same, or more where they lessen the error more [default: uniform].
    #[arg(long, value_parser = named::<Distribution>(&["uniform", "adaptive"]))]
    pub(crate) sampling: Option<Distribution>,
    /// Chooses the random sequences [default: 0].
    #[arg(long, value_name = "N")]
    pub(crate) seed: Option<u64>,
    /// Independently scrambled sequences; 1 gives no error bars [default: 4].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) replicates: Option<u32>,
    /// Render this part of the frame, in pixels from the top left [default: all].
    #[arg(long, value_name = "X,Y,W,H")]
    pub(crate) region: Option<Region>,
    /// Jobs of a higher priority go first [default: 0].
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub(crate) priority: Option<i32>,
    /// Share of batches among jobs of one priority, in proportion [default: 1].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) weight: Option<u32>,
    /// Only workers with this tag get batches; repeatable, all are needed.
    #[arg(long = "tag", value_name = "TAG")]
    pub(crate) tags: Vec<String>,
    /// Workers that hold batches of the job at a time, at most [default: any number].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) max_workers: Option<u32>,
    /// Address to tell of the job's changes of state; the secret that notices are signed with is in
    /// `OVTIGRE_WEBHOOK_SECRET`.
    #[arg(long, value_name = "URL")]
    pub(crate) webhook: Option<String>,
    /// Write error against run time and how the job ended to this file.
    #[arg(long, value_name = "FILE.json")]
    pub(crate) report: Option<PathBuf>,
    /// Draw error against run time into this file.
    #[arg(long, value_name = "FILE.svg")]
    pub(crate) plot: Option<PathBuf>,
    /// Picture that is much closer to the truth: the report and the plot show the errors against it, too.
    #[arg(long, value_name = "FILE.exr")]
    pub(crate) reference: Option<PathBuf>,
}

impl JobFlags {
    /// As a request, with what was uploaded for it.
    pub(crate) fn request(
        &self,
        name: String,
        scene: BlobId,
        environment: Option<EnvironmentRequest>,
    ) -> JobRequest {
        JobRequest {
            scene: Some(scene),
            name: Some(name),
            size: self.size,
            camera: self.camera.clone(),
            variant: self.variant.clone(),
            samples: self.samples,
            error: self.error,
            seconds: self.seconds,
            paths: self.paths.clone(),
            preset: self.preset.clone(),
            method: self.method,
            layers: self.layers.clone(),
            strategies: self.strategies.clone(),
            weights: self.weights,
            bounces: self.bounces,
            lens_radius: self.lens_radius,
            focus_distance: self.focus_distance,
            shutter: self.shutter,
            environment,
            environment_rotation: self.environment_rotation,
            shadows: self.shadows,
            sampling: self.sampling,
            seed: self.seed,
            replicates: self.replicates,
            region: self.region,
            priority: self.priority,
            weight: self.weight,
            tags: self.tags.clone(),
            max_workers: self.max_workers,
            webhook: self.webhook.clone().map(|url| WebhookRequest {
                url,
                // A secret in the environment is not in the list of processes.
                secret: std::env::var("OVTIGRE_WEBHOOK_SECRET").ok(),
            }),
        }
    }
}

/// One of `names`, each a variant of `T` as it is written in JSON.
fn named<T>(names: &'static [&'static str]) -> impl TypedValueParser<Value = T>
where
    T: DeserializeOwned + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(names)
        .map(|name| serde_json::from_value(name.into()).expect("every name is a variant"))
}

fn finite(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| "it is not a number".to_owned())?;
    if number.is_finite() { Ok(number) } else { Err("it is not finite".to_owned()) }
}

fn positive(text: &str) -> Result<f64, String> {
    finite(text).and_then(|n| if n > 0.0 { Ok(n) } else { Err("it is not positive".to_owned()) })
}

fn shutter(text: &str) -> Result<[f64; 2], String> {
    let (open, close) = text.split_once(',').ok_or("write OPEN,CLOSE in seconds, such as 0,0.02")?;
    let times = [finite(open.trim())?, finite(close.trim())?];
    if times[0] <= times[1] { Ok(times) } else { Err("it closes before it opens".to_owned()) }
}

fn paths(text: &str) -> Result<String, String> {
    Language::compile(&[text]).map(|_| text.to_owned()).map_err(|error| error.to_string())
}

/// What a technique makes of a layer is for the farm to judge.
fn layer(text: &str) -> Result<String, String> {
    match text.split_once('=') {
        None if text.trim() == LAYER_OF_EACH_LIGHT => Ok(text.to_owned()),
        Some((name, shows)) if !name.trim().is_empty() && !shows.trim().is_empty() => {
            let technique = shows.trim().starts_with('(') && shows.contains(',') && !shows.contains('{');
            if !technique {
                paths(shows)?;
            }
            Ok(text.to_owned())
        }
        _ => Err("write NAME=EXPR, such as direct=LDE, or lights".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        job: JobFlags,
    }

    fn parse(flags: &str) -> Result<JobRequest, clap::Error> {
        let line = Line::try_parse_from(std::iter::once("ovtigre").chain(flags.split_whitespace()))?;
        Ok(line.job.request("room".to_owned(), BlobId::of([0; 32]), None))
    }

    #[test]
    fn what_is_not_said_is_left_to_the_farm() {
        let plain = JobRequest {
            scene: Some(BlobId::of([0; 32])),
            name: Some("room".to_owned()),
            ..JobRequest::default()
        };
        assert_eq!(parse("").unwrap(), plain);
    }

    #[test]
    fn every_flag_arrives_in_the_request_and_survives_json() {
        let request = parse(
            "--size 640x480 --camera 2 --variant red --samples 64 --error 0.01 --seconds 60 --paths LDE --method light
             --layer a=LE --layer b=LDE --strategies 0,3;1,2 --weights power --bounces 3 --lens-radius 0.01
             --focus-distance 2 --shutter -1,0.5 --shadows off --sampling adaptive --seed 7 --replicates 8 --region 1,2,3,4",
        )
        .unwrap();
        assert_eq!(request.size, Some(Size { width: 640, height: 480 }));
        assert_eq!(
            (request.method, request.weights),
            (Some(MethodRequest::Light), Some(WeightsRequest::Power))
        );
        assert_eq!((request.shutter, request.shadows), (Some([-1.0, 0.5]), Some(Shadows::Off)));
        assert_eq!(request.variant.as_deref(), Some("red"));
        assert_eq!(request.sampling, Some(Distribution::Adaptive));
        assert_eq!((request.layers.len(), request.region.map(|r| r.height)), (2, Some(4)));
        let text = serde_json::to_string(&request).unwrap();
        assert_eq!(serde_json::from_str::<JobRequest>(&text).unwrap(), request);
        for field in serde_json::to_value(&request).unwrap().as_object().unwrap().values() {
            assert!(!field.is_null());
        }
    }

    #[test]
    fn nonsense_is_refused() {
        for flags in [
            "--size 640",
            "--size 0x1",
            "--samples 0",
            "--samples -1",
            "--error 0",
            "--error nan",
            "--seconds -1",
            "--preset fong",
            "--method magic",
            "--layer LDE",
            "--layer =LDE",
            "--layer a=LD",
            "--paths L(D",
            "--weights heavy",
            "--lens-radius 1",
            "--focus-distance 1",
            "--shutter 1",
            "--shutter 2,1",
            "--shutter 0,inf",
            "--environment-rotation 3",
            "--shadows maybe",
            "--replicates 0",
            "--region 1,2,3",
            "--paths LE --preset full",
        ] {
            assert!(parse(flags).is_err(), "{flags}");
        }
    }
}

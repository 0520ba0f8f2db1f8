//! Requests to jobs.

use super::bench::{Bench, rules};
use crate::farm::error::FarmError;
use ovtigre_core::settings::{CameraChoice, Distribution, Method};
use ovtigre_proto::{
    job::{JobRequest, MethodRequest},
    pair::EnvironmentRequest,
    problem::Fault,
};

#[tokio::test]
async fn every_default_is_resolved() {
    let bench = Bench::new(rules()).await;
    let scene = Some(bench.scene().await);
    let check = |request: JobRequest| bench.farm.check(JobRequest { scene: scene.clone(), ..request });
    let spec = check(JobRequest::default()).await.unwrap();
    assert_eq!(spec.settings.size.to_string(), "1280x640", "the first camera is twice as wide as high");
    assert_eq!(spec.settings.camera, CameraChoice::Index(0));
    assert_eq!((spec.samples_asked(), spec.settings.replicates, spec.settings.seed), (256, 4, 0));
    let spec = check(JobRequest { camera: Some("side".to_owned()), ..JobRequest::default() }).await.unwrap();
    assert_eq!(spec.settings.size.to_string(), "1280x720", "this camera does not say");
    let spec = check(JobRequest { samples: Some(1), ..JobRequest::default() }).await.unwrap();
    assert_eq!((spec.samples_asked(), spec.settings.replicates), (1, 1));
    let spec = check(JobRequest { samples: Some(10), ..JobRequest::default() }).await.unwrap();
    assert_eq!((spec.samples_asked(), spec.warnings.len()), (8, 1), "at most 10, and it is said");
}

const ADAPTIVE: Option<Distribution> = Some(Distribution::Adaptive);

#[tokio::test]
async fn too_few_samples_are_not_allocated_and_enough_are_by_a_method_that_can() {
    let bench = Bench::new(rules()).await;
    let scene = Some(bench.scene().await);
    let of =
        |samples| JobRequest { scene: scene.clone(), samples, sampling: ADAPTIVE, ..JobRequest::default() };
    let spec = bench.farm.check(of(Some(124))).await.unwrap();
    assert_eq!((spec.settings.sampling, spec.decided_after), (Distribution::Uniform, None));
    assert!(spec.warnings.iter().any(|warning| warning.contains("needs 128")), "{:?}", spec.warnings);
    let spec = bench.farm.check(of(Some(128))).await.unwrap();
    assert_eq!((spec.settings.sampling, spec.settings.method), (Distribution::Adaptive, Method::Path));
    let after = spec.decided_after.unwrap() as usize;
    assert_eq!(spec.schedule().samples_after(after), 16);
    assert!(spec.warnings.is_empty(), "{:?}", spec.warnings);
}

type Change<'a> = Box<dyn Fn(&mut JobRequest) + 'a>;

#[tokio::test]
async fn a_request_that_cannot_be_followed_is_refused_where_it_is_wrong() {
    let bench = Bench::new(rules()).await;
    let (scene, sky) = (bench.scene().await, bench.upload(b"sky").await);
    let cases: Vec<(&str, Change<'_>)> = vec![
        ("/scene", Box::new(|r| r.scene = None)),
        ("/scene", Box::new(|r| r.scene = Some(ovtigre_proto::id::BlobId::of([9; 32])))),
        ("/scene", Box::new(|r| r.scene = Some(sky.clone()))),
        ("/environment", Box::new(|r| r.environment = Some(EnvironmentRequest::Image(scene.clone())))),
        ("/environment", Box::new(|r| r.environment = Some(EnvironmentRequest::Uniform([-1.0, 0.0, 0.0])))),
        ("/environment_rotation", Box::new(|r| r.environment_rotation = Some(90.0))),
        ("/camera", Box::new(|r| r.camera = Some("2".to_owned()))),
        ("/variant", Box::new(|r| r.variant = Some("red".to_owned()))),
        ("/region", Box::new(|r| r.region = Some("1200,0,200,10".parse().unwrap()))),
        ("/samples", Box::new(|r| r.samples = Some(0))),
        ("/samples", Box::new(|r| r.samples = Some(u32::MAX))),
        ("/samples", Box::new(|r| (r.samples, r.replicates) = (Some(3), Some(4)))),
        ("/replicates", Box::new(|r| r.replicates = Some(0))),
        ("/replicates", Box::new(|r| (r.error, r.replicates) = (Some(0.1), Some(2)))),
        ("/error", Box::new(|r| r.error = Some(f64::NAN))),
        ("/seconds", Box::new(|r| r.seconds = Some(0.0))),
        ("/focus_distance", Box::new(|r| r.lens_radius = Some(0.1))),
        ("/lens_radius", Box::new(|r| r.lens_radius = Some(-0.1))),
        ("/size", Box::new(|r| r.size = Some("32768x32768".parse().unwrap()))),
        ("/shutter", Box::new(|r| r.shutter = Some([0.5, 0.0]))),
        ("/shutter", Box::new(|r| r.shutter = Some([0.0, f64::INFINITY]))),
        ("/name", Box::new(|r| r.name = Some("x".repeat(1000)))),
        ("/name", Box::new(|r| r.name = Some("a\u{7}".to_owned()))),
        ("/layers/0", Box::new(|r| r.layers = vec!["a\u{1b}=LE".to_owned()])),
        ("/weight", Box::new(|r| r.weight = Some(0))),
        ("/max_workers", Box::new(|r| r.max_workers = Some(0))),
        ("/sampling", Box::new(|r| (r.sampling, r.method) = (ADAPTIVE, Some(MethodRequest::Light)))),
        ("/sampling", Box::new(|r| (r.sampling, r.method) = (ADAPTIVE, Some(MethodRequest::Bidirectional)))),
        ("/replicates", Box::new(|r| (r.sampling, r.replicates) = (ADAPTIVE, Some(3)))),
        ("/tags/0", Box::new(|r| r.tags = vec![String::new()])),
    ];
    for (pointer, change) in cases {
        let mut request = JobRequest { scene: Some(scene.clone()), ..JobRequest::default() };
        change(&mut request);
        match bench.farm.check(request).await {
            Err(FarmError::Request(faults)) => {
                let at: Vec<&str> = faults.iter().map(|Fault { pointer, .. }| pointer.as_str()).collect();
                assert_eq!(at, [pointer], "one clear problem");
            }
            other => panic!("{pointer}: {other:?}"),
        }
    }
}

#[tokio::test]
async fn the_same_request_under_the_same_key_is_one_job() {
    let bench = Bench::new(rules()).await;
    let request = JobRequest { scene: Some(bench.scene().await), ..JobRequest::default() };
    let key = || Some("k1".to_owned());
    let first = bench.farm.submit(request.clone(), key(), None).await.unwrap();
    let again = bench.farm.submit(request.clone(), key(), None).await.unwrap();
    assert_eq!(first.id, again.id);
    let other = JobRequest { seed: Some(1), ..request.clone() };
    assert!(matches!(bench.farm.submit(other, key(), None).await, Err(FarmError::KeyTaken)));
    assert_ne!(bench.farm.submit(request, Some("k2".to_owned()), None).await.unwrap().id, first.id);
}

#[tokio::test]
async fn an_upload_is_named_by_its_bytes_and_a_bad_one_leaves_nothing() {
    let bench = Bench::new(rules()).await;
    let id = bench.scene().await;
    assert_eq!(id.as_str(), blake3::hash(b"a scene").to_hex().as_str());
    for (bytes, named) in [(&b"bad"[..], None), (b"", None), (b"a scene 2", Some(&id))] {
        let mut incoming = bench.farm.receive().await.unwrap();
        incoming.write(bytes::Bytes::from_static(bytes)).await.unwrap();
        assert!(bench.farm.take_in(incoming, named).await.is_err());
        let hash = ovtigre_proto::id::BlobId::of(*blake3::hash(bytes).as_bytes());
        assert!(bench.farm.scene(&hash).await.is_err());
    }
}

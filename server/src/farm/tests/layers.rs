//! What a job shows: expressions, layers, techniques.

use super::bench::{Bench, Spread, rules};
use crate::farm::{error::FarmError, picture::LayerName};
use ovtigre_core::{
    film::{
        compare::compare,
        develop::Develop,
        exr::{Layers, read_layers},
    },
    settings::{Gloss, Method, Shadows, Shows, Strategy, Weights},
};
use ovtigre_proto::{
    job::{JobRequest, MethodRequest, WeightsRequest},
    status::JobState,
};

const SAMPLES: u32 = 4000;

async fn faults(bench: &Bench, change: impl FnOnce(&mut JobRequest)) -> Vec<(String, String)> {
    let mut request = JobRequest { scene: Some(bench.scene().await), ..JobRequest::default() };
    change(&mut request);
    match bench.farm.check(request).await {
        Ok(spec) => panic!("taken: {:?}", spec.settings),
        Err(FarmError::Request(faults)) => faults.into_iter().map(|f| (f.pointer, f.detail)).collect(),
        Err(other) => panic!("{other}"),
    }
}

fn layers(texts: &[&str]) -> Vec<String> {
    texts.iter().map(|text| (*text).to_owned()).collect()
}

#[tokio::test]
async fn what_is_shown_is_resolved() {
    let bench = Bench::new(rules()).await;
    let scene = Some(bench.scene().await);
    let check = async |request: JobRequest| {
        bench.farm.check(JobRequest { scene: scene.clone(), ..request }).await.unwrap().settings
    };
    let plain = check(JobRequest::default()).await;
    assert_eq!((plain.paths.as_str(), plain.gloss, plain.method), ("L(D|S)*E", Gloss::AsItIs, Method::Path));
    let whitted = check(JobRequest { preset: Some("whitted".to_owned()), ..JobRequest::default() }).await;
    assert_eq!((whitted.paths.as_str(), whitted.gloss), ("L[(D|S)(S_M|S_T)*]E", Gloss::Mirror));
    let all = check(JobRequest {
        paths: Some("E.{0,2}L".to_owned()),
        method: Some(MethodRequest::Bidirectional),
        layers: layers(&["direct = LDE", "b2=L.{2}E", "C12= (1, 2)"]),
        strategies: Some("1,2; 0,3;1,2".to_owned()),
        weights: Some(WeightsRequest::Power),
        shutter: Some([-1.0, 0.5]),
        ..JobRequest::default()
    })
    .await;
    assert_eq!((all.paths.as_str(), all.planes(), all.weights), ("E.{0,2}L", 4, Weights::Power));
    assert_eq!(all.strategies, [Strategy { s: 1, t: 2 }, Strategy { s: 0, t: 3 }]);
    assert_eq!((all.layers[0].name.as_str(), &all.layers[0].shows), ("direct", &Shows::Paths(" LDE".into())));
    assert_eq!(all.layers[2].shows, Shows::Strategy(Strategy { s: 1, t: 2 }));
    assert_eq!((all.shutter.open, all.shutter.close), (-1.0, 0.5));
}

type Change = fn(&mut JobRequest);

#[tokio::test]
async fn each_fault_is_told_with_its_place() {
    let bench = Bench::new(rules()).await;
    let cases: [(&str, &str, Change); 24] = [
        ("/paths", "character 3: a path ends here", |r| r.paths = Some("LD".into())),
        ("/paths", "character 2: this '('", |r| r.paths = Some("L(DE".into())),
        ("/paths", "S_T is gloss", |r| r.paths = Some("L(S_T|D)E".into())),
        ("/preset", "there is no preset 'fong'", |r| r.preset = Some("fong".into())),
        ("/preset", "leave one out", |r| {
            (r.preset, r.paths) = (Some("cook".into()), Some("LDE".into()));
        }),
        ("/preset", "only by method 'path'", |r| {
            (r.preset, r.method) = (Some("whitted".into()), Some(MethodRequest::Bidirectional));
        }),
        ("/layers/1", "character 2: 'x' is no letter", |r| r.layers = layers(&["a=LE", "b=LxE"])),
        ("/layers/0", "S_T is gloss", |r| r.layers = layers(&["a=LS_TE"])),
        ("/layers/0", "written NAME=EXPR", |r| r.layers = layers(&["LDE"])),
        ("/layers/0", "a layer's name has", |r| r.layers = layers(&["=LDE"])),
        ("/layers/0", "a layer's name has", |r| r.layers = layers(&["a.b=LDE"])),
        ("/layers/0", "a layer's name has", |r| r.layers = vec![format!("{}=LDE", "a".repeat(65))]),
        ("/layers/0", "cannot be named 'R'", |r| r.layers = layers(&["R=LDE"])),
        ("/layers/0", "cannot be named 'error'", |r| r.layers = layers(&["error=LDE"])),
        ("/layers/1", "a layer 'a' already", |r| r.layers = layers(&["a=LDE", "a=LE"])),
        ("/layers", "at most 31", |r| r.layers = (0..32).map(|n| format!("b{n}=LE")).collect()),
        ("/layers/1", "more than 64 states", |r| r.layers = layers(&["a=LE", "b=L.{64}E"])),
        ("/layers/0", "need method 'bidirectional'", |r| r.layers = layers(&["a=(1,2)"])),
        ("/layers/0", "makes no path", |r| {
            (r.layers, r.method) = (layers(&["a=(0,1)"]), Some(MethodRequest::Bidirectional));
        }),
        ("/strategies", "need method 'bidirectional'", |r| r.strategies = Some("1,2".into())),
        ("/strategies", "'1;2' is no technique", |r| {
            (r.strategies, r.method) = (Some("1".into()), Some(MethodRequest::Bidirectional));
        }),
        ("/weights", "need method 'bidirectional'", |r| r.weights = Some(WeightsRequest::Power)),
        ("/layers/0", "a picture has that already", |r| r.layers = layers(&["narrow=LDE"])),
        ("/shadows", "only by method 'path'", |r| {
            (r.shadows, r.method) = (Some(Shadows::Off), Some(MethodRequest::Light));
        }),
    ];
    for (pointer, detail, change) in cases {
        let found = faults(&bench, change).await;
        let detail = detail.replace("'1;2'", "'1'");
        assert_eq!(found.len(), 1, "one clear problem: {found:?}");
        assert!(found[0].0 == pointer && found[0].1.contains(&detail), "{pointer} {detail}: {found:?}");
    }
    let radiosity = faults(&bench, |r| {
        (r.method, r.paths) = (Some(MethodRequest::Radiosity), Some("LD*S?E".into()));
    })
    .await;
    assert!(radiosity.iter().any(|(at, detail)| at == "/paths" && detail.contains("LD*E")), "{radiosity:?}");
    let layered = faults(&bench, |r| {
        (r.method, r.layers) = (Some(MethodRequest::Radiosity), vec!["direct=LDE".into()]);
    })
    .await;
    assert!(layered.len() == 1 && layered[0].0 == "/layers", "{layered:?}");
}

#[tokio::test]
async fn a_method_that_splats_is_never_cut() {
    let bench = Bench::new(rules()).await;
    let scene = Some(bench.scene().await);
    let check = async |method, layers: &[&str]| {
        let request = JobRequest {
            scene: scene.clone(),
            size: Some("3840x2160".parse().unwrap()),
            region: Some("0,10,3840,2000".parse().unwrap()),
            replicates: Some(2),
            layers: self::layers(layers),
            method: Some(method),
            ..JobRequest::default()
        };
        bench.farm.check(request).await
    };
    let path = check(MethodRequest::Path, &[]).await.unwrap();
    assert!(path.schedule().regions().len() > 1);
    for method in [MethodRequest::Light, MethodRequest::Bidirectional, MethodRequest::Photon] {
        let spec = check(method, &["direct=LDE"]).await.unwrap();
        assert_eq!(spec.schedule().regions(), [spec.region]);
    }
    // Three planes of 3840 × 2000 pixels have 264 MiB.
    match check(MethodRequest::Light, &["a=LE", "b=LDE"]).await {
        Err(FarmError::Request(faults)) => assert!(faults[0].detail.contains("263 MiB"), "{faults:?}"),
        other => panic!("{other:?}"),
    }
    assert!(check(MethodRequest::Path, &["a=LE", "b=LDE"]).await.is_ok());
}

/// A job with two layers, done by a worker that makes each plane half of the one before.
async fn done(bench: &Bench) -> ovtigre_proto::id::JobId {
    let job = bench.job(SAMPLES, |r| r.layers = layers(&["half=LDE", "quarter=L.{2}E"])).await;
    let worker = bench.worker().await;
    bench.work(&worker, Spread::Noisy).await;
    bench.until_settled(&job, JobState::Done).await;
    job
}

async fn read(bench: &Bench, job: &ovtigre_proto::id::JobId) -> Layers {
    read_layers(&bench.exr(job).await).unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn layers_come_with_their_own_error() {
    let bench = Bench::new(rules()).await;
    let job = done(&bench).await;
    let all = read(&bench, &job).await;
    assert_eq!(all.channels.len(), 18);
    for (name, scale) in [("", 1.0), ("half.", 0.5), ("quarter.", 0.25)] {
        for part in ["", "error."] {
            let (own, picture) =
                (&all.channels[&format!("{name}{part}G")], &all.channels[&format!("{part}G")]);
            assert!(own.iter().zip(picture).all(|(own, picture)| *own == scale * picture), "{name}{part}");
        }
    }
    assert_eq!(all.attributes["ovtigre.layer.half"], "LDE");
    assert_eq!(all.attributes["ovtigre.layer.quarter"], "L.{2}E");
    let same = compare(&all, &all).unwrap();
    assert_eq!(same.layers.keys().collect::<Vec<_>>(), ["half", "picture", "quarter"]);

    let status = bench.farm.status(&job).await.unwrap();
    let [half, quarter] = &status.layers[..] else { panic!("{:?}", status.layers) };
    assert_eq!((half.name.as_str(), half.shows.as_str()), ("half", "LDE"));
    let (half, quarter, whole) = (half.error.unwrap(), quarter.error.unwrap(), status.error.unwrap());
    // Powers of two change no bit of a relative error; JSON may change the last.
    let alike = |a: Option<f64>, b: Option<f64>| (a.unwrap() / b.unwrap() - 1.0).abs() < 1e-15;
    assert!(alike(half.relative_error, whole.relative_error), "{half:?}");
    assert!(alike(quarter.relative_error, whole.relative_error), "{quarter:?}");
    assert!(alike(half.rms_error, whole.rms_error.map(|e| 0.5 * e)), "{half:?}");
    assert!(alike(Some(quarter.mean_luminance), Some(0.5 * half.mean_luminance)), "{quarter:?}");
    // 4 800 000 samples of mean 1/2 and variance 1/12, three channels weighed by luminance.
    assert!((half.mean_luminance - 0.5).abs() < 5.0 * (1.0 / 12.0 / 4.8e6_f64).sqrt(), "{half:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn layers_are_developed_by_name() {
    let bench = Bench::new(rules()).await;
    let job = done(&bench).await;
    let develop = Develop { exposure: 0.0, width: None };
    let png = async |layer: &str| {
        let png = bench.farm.png(&job, LayerName::parse(Some(layer)), develop).await;
        png.map(|(_, bytes)| bytes)
    };
    let pictures = [png("picture").await, png("half").await, png("half.error").await, png("error").await];
    let pictures = pictures.map(|png| png.unwrap());
    for (i, a) in pictures.iter().enumerate() {
        assert!(pictures[..i].iter().all(|b| a != b), "{i} is like one before");
    }
    for missing in ["third", "third.error", "half.error.error"] {
        assert!(matches!(png(missing).await, Err(FarmError::NoLayer(name)) if name == missing));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn layers_survive_a_farm_that_is_killed() {
    let mut bench = Bench::new(crate::farm::rules::Rules { partials_kept: 2, ..rules() }).await;
    let job = bench.job(SAMPLES, |r| r.layers = layers(&["half=LDE", "quarter=L.{2}E"])).await;
    let mut n = 0;
    while bench.farm.live(&job).is_some() {
        let worker = bench.worker().await;
        let leases = bench.take(&worker, 6).await;
        for lease in &leases {
            bench.bring(lease, Spread::Noisy).await;
            n += 1;
        }
        // One that is killed while there is nothing to bring never gets to its end.
        if !leases.is_empty() {
            bench = bench.crash().await;
        }
        tokio::time::sleep(std::time::Duration::from_millis(5)).await;
    }
    assert!(n > 10, "the farm was hardly killed");
    let survived = bench.farm.status(&job).await.unwrap().layers;
    let calm = Bench::new(rules()).await;
    let other = done(&calm).await;
    assert_eq!(bench.pixels(&job).await, calm.pixels(&other).await);
    assert_eq!(survived, calm.farm.status(&other).await.unwrap().layers);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_sum_with_other_planes_than_the_job_s_is_refused() {
    let bench = Bench::new(rules()).await;
    bench.job(SAMPLES, |r| r.layers = layers(&["half=LDE"])).await;
    let worker = bench.worker().await;
    let lease = &bench.take(&worker, 1).await[0];
    let plain = super::bench::sum(lease.batch, Spread::Noisy);
    let refused = bench.bring_sum(lease, &plain).await.unwrap_err();
    assert!(refused.to_string().contains("1 planes, not 2"), "{refused}");
    assert_eq!(bench.bring(lease, Spread::Noisy).await, ovtigre_proto::lease::Commit::Accepted);
}

//! The doors, without a network: statuses, problems, tags, ranges, pages, events.

use super::{
    guard::{Guarding, WithoutTokens, hash},
    roles::{Access, DOORS},
    router,
};
use crate::farm::tests::bench::{Bench, Spread, partial, rules, sum};
use crate::{
    farm::error::FarmError,
    store::row::{Role, TokenRow},
};
use axum::{
    Router,
    body::Body,
    http::{Method, Request, Response, StatusCode, header},
};
use futures::StreamExt as _;
use ovtigre_core::film::exr::read_layers;
use ovtigre_proto::{
    id::JobId,
    job::{JobPatch, JobRequest},
    lease::{Committed, ExchangeReply, WorkerJoined},
    pixel::Pixel,
    problem::Problem,
    status::JobState,
};
use serde_json::{Value, json};
use std::{
    sync::{Arc, LazyLock},
    time::Duration,
};
use tower::ServiceExt as _;

struct Answer {
    status: StatusCode,
    headers: axum::http::HeaderMap,
    body: bytes::Bytes,
}

impl Answer {
    fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap()
    }

    fn head(&self, name: &str) -> &str {
        self.headers.get(name).map_or("", |v| v.to_str().unwrap())
    }

    /// The problem, which says the same as the status.
    fn problem(&self, status: u16, kind: &str) -> Problem {
        assert_eq!(self.head("content-type"), "application/problem+json", "{:?}", self.body);
        let problem: Problem = serde_json::from_slice(&self.body).unwrap();
        assert_eq!((self.status.as_u16(), problem.status), (status, status), "{problem:?}");
        assert_eq!(problem.kind, format!("/problems/{kind}"), "{problem:?}");
        problem
    }
}

/// Headers that say something to a client are in the interface's document.
fn heads_are_described(method: &Method, path: &str, status: StatusCode, headers: &axum::http::HeaderMap) {
    static DOCUMENT: LazyLock<Value> =
        LazyLock::new(|| serde_json::from_str(&super::openapi::DOCUMENT).unwrap());
    let path = path.split('?').next().unwrap();
    let parts = |path: &str| path.split('/').map(ToOwned::to_owned).collect::<Vec<_>>();
    let same = |door: &str| {
        let (door, path) = (parts(door), parts(path));
        door.len() == path.len() && door.iter().zip(&path).all(|(of, is)| of == is || of == "{id}")
    };
    let Some(door) = DOORS.iter().find(|(of, door, _)| of == method && same(door)) else { return };
    let operation = &DOCUMENT["paths"][door.1][method.as_str().to_ascii_lowercase()];
    let problem = &DOCUMENT["components"]["responses"]["Problem"];
    let response = operation["responses"].get(status.as_str()).unwrap_or(problem);
    let said: Vec<String> = response["headers"]
        .as_object()
        .map_or_else(Vec::new, |heads| heads.keys().map(|name| name.to_ascii_lowercase()).collect());
    for name in headers.keys().map(axum::http::HeaderName::as_str) {
        let of_page = ["/", "/docs", "/openapi.json"].contains(&door.1);
        let plain = matches!(name, "content-type" | "content-length" | "cache-control" | "allow");
        assert!(of_page || plain || said.iter().any(|one| one == name), "{method} {path} {status}: {name}");
    }
}

struct Doors {
    bench: Bench,
    router: Router,
}

impl Doors {
    async fn open() -> Self {
        Self::guarded(Guarding::default()).await
    }

    async fn guarded(guarding: Guarding) -> Self {
        let bench = Bench::new(rules()).await;
        let router = router(Arc::clone(&bench.farm), guarding);
        Self { bench, router }
    }

    async fn call(&self, request: Request<Body>) -> Response<Body> {
        self.router.clone().oneshot(request).await.unwrap()
    }

    async fn send(
        &self,
        method: Method,
        path: &str,
        heads: &[(&str, &str)],
        body: impl Into<Body>,
    ) -> Answer {
        let mut request = Request::builder().method(method.clone()).uri(path);
        for (name, value) in heads {
            request = request.header(*name, *value);
        }
        let response = self.call(request.body(body.into()).unwrap()).await;
        let (parts, body) = response.into_parts();
        let body = axum::body::to_bytes(body, usize::MAX).await.unwrap();
        heads_are_described(&method, path, parts.status, &parts.headers);
        Answer { status: parts.status, headers: parts.headers, body }
    }

    async fn get(&self, path: &str) -> Answer {
        self.send(Method::GET, path, &[], "").await
    }

    async fn post(&self, path: &str, json: &Value) -> Answer {
        self.send(Method::POST, path, &[("content-type", "application/json")], json.to_string()).await
    }

    /// A job of 40 × 30 pixels and its id.
    async fn job(&self, samples: u32) -> JobId {
        let scene = self.bench.scene().await;
        let made = self.post("/v1/jobs", &json!({"scene": scene, "size": "40x30", "samples": samples})).await;
        assert_eq!(made.status, StatusCode::ACCEPTED, "{:?}", made.body);
        made.json()["id"].as_str().unwrap().parse().unwrap()
    }

    async fn finish(&self, job: &JobId) {
        let worker = self.bench.worker().await;
        self.bench.work(&worker, Spread::Noisy).await;
        self.bench.until_settled(job, JobState::Done).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_is_rendered_over_http_alone() {
    let doors = Doors::open().await;
    let scene = blake3::hash(b"a scene").to_hex();
    let put = doors.send(Method::PUT, &format!("/v1/scenes/{scene}"), &[], "a scene").await;
    assert_eq!((put.status, put.json()["id"].as_str().unwrap()), (StatusCode::CREATED, scene.as_str()));
    let again = doors.send(Method::POST, "/v1/scenes", &[], "a scene").await;
    assert_eq!(again.status, StatusCode::OK);
    assert_eq!(doors.get(&format!("/v1/scenes/{scene}/bytes")).await.body, "a scene");
    assert_eq!(doors.get(&format!("/v1/scenes/{scene}")).await.json()["kind"], "scene");

    let made =
        doors.post("/v1/jobs", &json!({"scene": scene.as_str(), "size": [40, 30], "samples": 400})).await;
    let job = made.json()["id"].as_str().unwrap().to_owned();
    assert_eq!(made.head("location"), format!("/v1/jobs/{job}"));
    let image = format!("/v1/jobs/{job}/image.exr");
    doors.get(&image).await.problem(404, "no-picture-yet");

    let join =
        json!({"name": "w", "threads": 1, "build": env!("CARGO_PKG_VERSION"), "instruction_set": "any"});
    let joined = doors.post("/v1/workers", &join).await;
    assert_eq!(joined.status, StatusCode::CREATED);
    let worker = serde_json::from_slice::<WorkerJoined>(&joined.body).unwrap().id;
    let exchange = format!("/v1/workers/{worker}/exchange");
    while doors.bench.farm.live(&job.parse().unwrap()).is_some() {
        let reply = doors.post(&exchange, &json!({"wants": 4})).await;
        for lease in serde_json::from_slice::<ExchangeReply>(&reply.body).unwrap().leases {
            let path = format!("/v1/leases/{}/sum", lease.id);
            let heads = [("ovtigre-seconds", "0.25"), ("content-type", "image/x-exr")];
            let bytes = partial(&lease, &sum(lease.batch, Spread::Noisy));
            let told = doors.send(Method::PUT, &path, &heads, bytes).await;
            let told: Committed = serde_json::from_slice(&told.body).unwrap();
            assert_eq!(told.commit, ovtigre_proto::lease::Commit::Accepted);
        }
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    let status = doors.get(&format!("/v1/jobs/{job}")).await.json();
    assert_eq!((status["state"].as_str(), status["samples_done"].as_f64()), (Some("done"), Some(400.0)));
    assert_eq!(doors.get(&image).await.status, StatusCode::OK);
    let svg = doors.get(&format!("/v1/jobs/{job}/error.svg")).await;
    assert_eq!((svg.status, svg.head("content-type")), (StatusCode::OK, "image/svg+xml"));
    assert!(svg.body.starts_with(b"<svg") && svg.body.windows(7).any(|part| part == b"<circle"));
    let csv = String::from_utf8(doors.get(&format!("/v1/jobs/{job}/error.csv")).await.body.to_vec()).unwrap();
    let rows = doors.get(&format!("/v1/jobs/{job}/error.json")).await.json();
    assert_eq!(csv.lines().count(), 1 + rows["rows"].as_array().unwrap().len());
    let workers = doors.get("/v1/workers").await.json();
    assert_eq!(workers["items"][0]["batches_done"], status["batches_done"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn an_upload_that_was_cut_off_goes_on_where_it_was() {
    let doors = Doors::open().await;
    let bytes = "a scene in three parts";
    let path = format!("/v1/scenes/{}", blake3::hash(bytes.as_bytes()).to_hex());
    let put = async |range: &str, body: &'static str| {
        doors.send(Method::PUT, &path, &[("content-range", range)], body).await
    };
    let received = |answer: &Answer| {
        assert_eq!(answer.status, StatusCode::ACCEPTED, "{:?}", answer.body);
        (answer.json()["received"].as_u64().unwrap(), answer.json()["bytes"].as_u64().unwrap())
    };
    assert_eq!(received(&put("bytes */22", "").await), (0, 22));
    assert_eq!(received(&put("bytes 0-6/22", &bytes[..7]).await), (7, 22));
    // Cut off: fewer bytes than the range says are not kept.
    put("bytes 7-13/22", &bytes[7..10]).await.problem(422, "invalid-job");
    assert_eq!(received(&put("bytes */22", "").await), (7, 22));
    for (range, status, kind) in [
        ("bytes 9-3/22", 416, "range-not-satisfiable"),
        ("bytes 9-22/22", 416, "range-not-satisfiable"),
        ("9-12", 400, "invalid-header"),
        ("bytes 0-6/99999999999999", 413, "too-large"),
    ] {
        put(range, &bytes[..7]).await.problem(status, kind);
    }
    assert_eq!(received(&put("bytes 14-21/22", &bytes[14..]).await), (7, 22), "as far as there is no gap");
    let whole = put("bytes 7-13/22", &bytes[7..14]).await;
    assert_eq!(whole.status, StatusCode::CREATED, "{:?}", whole.body);
    assert_eq!(doors.get(&format!("{path}/bytes")).await.body, bytes);
    assert_eq!(put("bytes 0-6/22", &bytes[..7]).await.status, StatusCode::OK, "it is there");
}

#[tokio::test(flavor = "multi_thread")]
async fn every_error_is_a_problem_document() {
    let doors = Doors::open().await;
    let json = ("content-type", "application/json");
    doors.get("/v1/nothing").await.problem(404, "not-found");
    let wrong = doors.send(Method::DELETE, "/v1/jobs", &[], "").await;
    wrong.problem(405, "method-not-allowed");
    assert!(wrong.head("allow").contains("GET") && wrong.head("allow").contains("POST"));
    doors.get("/v1/jobs/none").await.problem(404, "not-found");
    doors.get("/v1/jobs/..%2f..").await.problem(404, "not-found");
    doors.get("/v1/jobs/none/image.exr").await.problem(404, "not-found");
    doors.get("/v1/jobs/none/events").await.problem(404, "not-found");
    doors.get("/v1/scenes/zz").await.problem(404, "not-found");
    doors.get("/v1/jobs/%ff").await.problem(400, "invalid-path");
    doors.get("/v1/scenes/%c3%28/bytes").await.problem(400, "invalid-path");
    doors.send(Method::PUT, "/v1/leases/%fe/sum", &[], "x").await.problem(400, "invalid-path");
    doors.get("/v1/jobs?limit=0").await.problem(400, "invalid-parameter");
    doors.get("/v1/jobs?limit=many").await.problem(400, "invalid-parameter");
    doors.get("/v1/jobs?cursor=x").await.problem(400, "invalid-parameter");
    doors.get("/v1/jobs?sort=colour").await.problem(400, "invalid-parameter");
    doors.get("/v1/jobs?sort=name&cursor=17").await.problem(422, "invalid-cursor");
    doors.get("/v1/jobs?sort=-priority&cursor=17.7a").await.problem(422, "invalid-cursor");
    doors.get("/v1/jobs?colour=red").await.problem(400, "invalid-parameter");
    doors.send(Method::POST, "/v1/jobs", &[], "{}").await.problem(415, "unsupported-media-type");
    let multipart = [("content-type", "multipart/form-data; boundary=x")];
    doors.send(Method::POST, "/v1/scenes", &multipart, "x").await.problem(415, "unsupported-media-type");
    doors.send(Method::POST, "/v1/jobs", &[json], "{").await.problem(400, "malformed-json");
    doors.send(Method::POST, "/v1/jobs", &[json], "{} {}").await.problem(400, "malformed-json");
    doors.send(Method::POST, "/v1/jobs", &[json], " ".repeat(2 << 20)).await.problem(413, "too-large");
    let far = [json, ("content-length", "99999999")];
    doors.send(Method::POST, "/v1/jobs", &far, "{}").await.problem(413, "too-large");
    for (document, pointer) in [
        (r#"{"samples": "many"}"#, "/samples"),
        (r#"{"colour": 1}"#, "/colour"),
        (r#"{"size": "0x0"}"#, "/size"),
        (r#"{"layers": ["a", 3]}"#, "/layers/1"),
        (r#"{"scene": "xyz"}"#, "/scene"),
        (r#""x""#, ""),
        ("[]", ""),
        (r#"["abc"]"#, ""),
        ("null", ""),
        (r#"{"method": 3}"#, "/method"),
        (r#"{"weights": [1]}"#, "/weights"),
        (r#"{"shadows": {"a": 1}}"#, "/shadows"),
    ] {
        let answer = doors.send(Method::POST, "/v1/jobs", &[json], document).await;
        let problem = answer.problem(422, "invalid-document");
        assert_eq!(problem.errors[0].pointer, pointer, "{problem:?}");
    }
    let problem = doors.post("/v1/jobs", &json!({})).await.problem(422, "invalid-job");
    assert_eq!(problem.errors[0].pointer, "/scene");
    let other = blake3::hash(b"other").to_hex();
    doors.send(Method::PUT, &format!("/v1/scenes/{other}"), &[], "bytes").await.problem(422, "hash-mismatch");
    doors.send(Method::PUT, "/v1/scenes/abc", &[], "bytes").await.problem(400, "invalid-hash");
    let problem = doors.send(Method::POST, "/v1/scenes", &[], "bad").await.problem(422, "invalid-scene");
    assert_eq!(problem.errors[0].pointer, "/meshes/0");
    doors.send(Method::POST, "/v1/scenes", &[], "").await.problem(422, "invalid-scene");
    doors.post("/v1/workers/none/exchange", &json!({})).await.problem(404, "not-found");
    doors.send(Method::PUT, "/v1/leases/x_0_0_0_1/sum", &[], "x").await.problem(404, "not-found");
    let failure = json!({"reason": "r", "kind": "worker"});
    doors.post("/v1/leases/x/failure", &failure).await.problem(404, "not-found");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_sum_that_is_none_is_refused() {
    let doors = Doors::open().await;
    doors.job(400).await;
    let worker = doors.bench.worker().await;
    let lease = doors.bench.take(&worker, 1).await.remove(0);
    let path = format!("/v1/leases/{}/sum", lease.id);
    doors.send(Method::PUT, &path, &[], "not an EXR").await.problem(422, "invalid-sum");
    let seconds = [("ovtigre-seconds", "soon")];
    doors.send(Method::PUT, &path, &seconds, "x").await.problem(400, "invalid-header");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_picture_has_a_strong_tag_and_ranges() {
    let doors = Doors::open().await;
    let job = doors.job(400).await;
    let worker = doors.bench.worker().await;
    let path = format!("/v1/jobs/{job}/image.exr");
    for lease in doors.bench.take(&worker, 4).await {
        doors.bench.bring(&lease, Spread::Noisy).await;
    }
    doors.bench.until(&job, |s| s.batches_done == 4).await;
    let first = doors.get(&path).await;
    let tag = first.head("etag").to_owned();
    assert!(tag.starts_with('"') && tag.ends_with('"'), "{tag}");
    assert_eq!(doors.get(&path).await.body, first.body, "the same tag, the same bytes");
    let same = doors.send(Method::GET, &path, &[("if-none-match", &tag)], "").await;
    assert_eq!(
        (same.status, same.body.len(), same.head("etag")),
        (StatusCode::NOT_MODIFIED, 0, tag.as_str())
    );

    doors.finish(&job).await;
    let whole = doors.get(&path).await;
    let size = whole.body.len();
    assert_ne!(whole.head("etag"), tag);
    assert_eq!((whole.head("content-type"), whole.head("accept-ranges")), ("image/x-exr", "bytes"));
    assert_eq!(whole.head("content-length"), size.to_string());
    let part = doors.send(Method::GET, &path, &[("range", "bytes=4-9")], "").await;
    assert_eq!((part.status, &part.body), (StatusCode::PARTIAL_CONTENT, &whole.body.slice(4..10)));
    assert_eq!(part.head("content-range"), format!("bytes 4-9/{size}"));
    let beyond = doors.send(Method::GET, &path, &[("range", "bytes=999999999-")], "").await;
    beyond.problem(416, "range-not-satisfiable");
    assert_eq!(beyond.head("content-range"), format!("bytes */{size}"));
    let old = doors.send(Method::GET, &path, &[("range", "bytes=4-9"), ("if-range", &tag)], "").await;
    assert_eq!(old.status, StatusCode::OK, "of another version: all of it");
    let head = doors.send(Method::HEAD, &path, &[], "").await;
    assert_eq!((head.status, head.body.len(), head.head("etag")), (StatusCode::OK, 0, whole.head("etag")));

    let png = doors.get(&format!("/v1/jobs/{job}/image.png?width=20&exposure=-1")).await;
    assert_eq!((png.status, &png.body[1..4]), (StatusCode::OK, &b"PNG"[..]));
    let error = doors.get(&format!("/v1/jobs/{job}/image.png?layer=error")).await;
    assert_eq!(error.status, StatusCode::OK);
    assert_ne!(png.head("etag"), error.head("etag"));
    doors.get(&format!("/v1/jobs/{job}/image.png?layer=none")).await.problem(404, "no-layer");
    doors.get(&format!("/v1/jobs/{job}/image.png?exposure=NaN")).await.problem(400, "invalid-parameter");
    doors.get(&format!("/v1/jobs/{job}/image.png?width=0")).await.problem(400, "invalid-parameter");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_wait_ends_with_the_next_version_or_in_time() {
    let doors = Arc::new(Doors::open().await);
    let job = doors.job(400).await;
    let worker = doors.bench.worker().await;
    let path = format!("/v1/jobs/{job}/image.exr");
    let early = doors.send(Method::GET, &path, &[("prefer", "wait=0")], "").await;
    early.problem(404, "no-picture-yet");
    let waiting = {
        let (doors, path) = (Arc::clone(&doors), path.clone());
        tokio::spawn(async move { doors.send(Method::GET, &path, &[("prefer", "wait=20")], "").await })
    };
    tokio::time::sleep(Duration::from_millis(50)).await;
    for lease in doors.bench.take(&worker, 1).await {
        doors.bench.bring(&lease, Spread::Noisy).await;
    }
    let first = tokio::time::timeout(Duration::from_secs(10), waiting).await.unwrap().unwrap();
    assert_eq!((first.status, first.head("preference-applied")), (StatusCode::OK, "wait"));
    let heads = [("prefer", "wait=1"), ("if-none-match", first.head("etag"))];
    let begun = std::time::Instant::now();
    assert_eq!(doors.send(Method::GET, &path, &heads, "").await.status, StatusCode::NOT_MODIFIED);
    assert!(begun.elapsed() >= Duration::from_millis(950));
}

#[tokio::test(flavor = "multi_thread")]
async fn lists_are_read_page_by_page() {
    let doors = Doors::open().await;
    let mut made = Vec::new();
    for _ in 0..5 {
        made.push(doors.job(400).await.to_string());
    }
    made.reverse();
    let mut seen = Vec::new();
    let mut path = "/v1/jobs?limit=2".to_owned();
    loop {
        let page = doors.get(&path).await.json();
        let items = page["items"].as_array().unwrap();
        assert!(items.len() <= 2);
        seen.extend(items.iter().map(|job| job["id"].as_str().unwrap().to_owned()));
        match page["next"].as_str() {
            Some(next) => path = format!("/v1/jobs?limit=2&cursor={next}"),
            None => break,
        }
    }
    assert_eq!(seen, made);
    doors.bench.farm.cancel(&made[0].parse().unwrap()).await.unwrap();
    let cancelled = doors.get("/v1/jobs?state=cancelled").await.json();
    assert_eq!(cancelled["items"].as_array().unwrap().len(), 1);
    assert_eq!(doors.get("/v1/jobs?state=queued").await.json()["items"].as_array().unwrap().len(), 4);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_job_is_sent_once_checked_changed_and_cancelled() {
    let doors = Doors::open().await;
    let scene = doors.bench.scene().await;
    let request = json!({"scene": scene, "size": "40x30"});
    let heads = [("content-type", "application/json"), ("idempotency-key", "k")];
    let send = async |body: &Value| doors.send(Method::POST, "/v1/jobs", &heads, body.to_string()).await;
    let (first, again) = (send(&request).await, send(&request).await);
    assert_eq!((first.status, again.status), (StatusCode::ACCEPTED, StatusCode::ACCEPTED));
    assert_eq!(first.json()["id"], again.json()["id"]);
    send(&json!({"scene": scene})).await.problem(422, "idempotency-key-taken");
    let dry = doors.post("/v1/jobs?dry_run=true", &request).await;
    assert_eq!((dry.status, dry.json()["samples_asked"].as_u64()), (StatusCode::OK, Some(256)));
    assert_eq!(doors.get("/v1/jobs").await.json()["items"].as_array().unwrap().len(), 1);

    let path = first.head("location").to_owned();
    let tag = doors.get(&path).await.head("etag").to_owned();
    let patch = async |tag: &str, body: Value| {
        let heads = [("content-type", "application/json"), ("if-match", tag)];
        doors.send(Method::PATCH, &path, &heads, body.to_string()).await
    };
    let changed = patch(&tag, json!({"priority": 3})).await;
    assert_eq!((changed.status, changed.json()["priority"].as_i64()), (StatusCode::OK, Some(3)));
    assert_ne!(changed.head("etag"), tag);
    patch(&tag, json!({"priority": 4})).await.problem(412, "changed-since");
    patch("*", json!({"state": "done"})).await.problem(422, "invalid-job");
    patch("3", json!({})).await.problem(400, "invalid-header");
    let weak = format!("W/{}", changed.head("etag"));
    patch(&weak, json!({"priority": 4})).await.problem(412, "changed-since");
    patch("\"of something else\"", json!({"priority": 4})).await.problem(412, "changed-since");
    let several = format!("\"0\", {}", changed.head("etag"));
    assert_eq!(patch(&several, json!({"priority": 3})).await.status, StatusCode::OK);
    patch("*", json!({"samples": "many"})).await.problem(422, "invalid-document");
    let fewer = patch("*", json!({"samples": 1})).await.problem(422, "invalid-job");
    assert_eq!(fewer.errors[0].pointer, "/samples");
    assert_eq!(patch("*", json!({"state": "paused"})).await.json()["state"], "paused");

    let cancelled = doors.send(Method::DELETE, &path, &[], "").await;
    assert_eq!((cancelled.status, cancelled.json()["state"].as_str()), (StatusCode::OK, Some("cancelled")));
    patch("*", json!({"priority": 4})).await.problem(409, "job-over");
    doors.bench.until_settled(&path[9..].parse().unwrap(), JobState::Cancelled).await;
    let never = doors.get(&format!("{path}/image.exr")).await;
    assert!(!never.problem(404, "no-picture").detail.contains("later"));
    assert_eq!(never.head("retry-after"), "");
    let purged = doors.send(Method::DELETE, &format!("{path}?purge=true"), &[], "").await;
    assert_eq!(purged.status, StatusCode::NO_CONTENT);
    doors.get(&path).await.problem(404, "not-found");
}

/// Events of a stream until it ends: id and name.
async fn events(doors: &Doors, path: &str, last: Option<&str>) -> (StatusCode, Vec<(String, String)>) {
    let mut request = Request::builder().uri(path);
    if let Some(last) = last {
        request = request.header("last-event-id", last);
    }
    let response = doors.call(request.body(Body::empty()).unwrap()).await;
    let status = response.status();
    if status == StatusCode::OK {
        assert_eq!(response.headers()[header::CONTENT_TYPE], "text/event-stream");
    }
    let mut text = String::new();
    let mut body = response.into_body().into_data_stream();
    while let Some(piece) = body.next().await {
        text.push_str(std::str::from_utf8(&piece.unwrap()).unwrap());
    }
    let field = |event: &str, name: &str| {
        let line = event.lines().find_map(|line| line.strip_prefix(name).map(str::to_owned));
        line.unwrap_or_default().trim_start_matches(": ").to_owned()
    };
    let events = text.split("\n\n").filter(|event| event.contains("data:"));
    (status, events.map(|event| (field(event, "id"), field(event, "event"))).collect())
}

#[tokio::test(flavor = "multi_thread")]
async fn events_tell_each_checkpoint_once_and_go_on_where_a_client_was() {
    let doors = Arc::new(Doors::open().await);
    let job = doors.job(4000).await;
    let path = format!("/v1/jobs/{job}/events");
    let live = {
        let (doors, path) = (Arc::clone(&doors), path.clone());
        tokio::spawn(async move { events(&doors, &path, None).await })
    };
    tokio::time::sleep(Duration::from_millis(30)).await;
    doors.finish(&job).await;
    let (_, seen) = tokio::time::timeout(Duration::from_secs(20), live).await.unwrap().unwrap();
    let rows = doors.bench.farm.curve_rows(&job).await.unwrap().len();
    let checkpoints =
        |events: &[(String, String)]| events.iter().filter(|(_, name)| name == "checkpoint").count();
    assert_eq!(checkpoints(&seen), rows);
    assert_eq!(seen.first().unwrap().1, "status");
    assert_eq!(seen.last().unwrap().1, "status", "the last word is how the job ended");

    // Whatever a client saw last, nothing is told twice and nothing is missed.
    for cut in 0..seen.len() - 1 {
        let (status, rest) = events(&doors, &path, Some(&seen[cut].0)).await;
        assert_eq!(status, StatusCode::OK);
        assert_eq!(checkpoints(&seen[..=cut]) + checkpoints(&rest), rows, "after {:?}", seen[cut]);
        assert_eq!(rest.last(), seen.last());
    }
    let (status, rest) = events(&doors, &path, Some(&seen.last().unwrap().0)).await;
    assert_eq!((status, rest.len()), (StatusCode::NO_CONTENT, 0));
    for bogus in ["x", "1.2", "1.2.99999999999999999999", "-1.0.0"] {
        let answer = doors.send(Method::GET, &path, &[("last-event-id", bogus)], "").await;
        answer.problem(400, "invalid-header");
    }
    let (status, _) = events(&doors, &path, Some("9.999.9")).await;
    assert_eq!(status, StatusCode::OK, "one that is not yet is no reason to fall");
}

#[tokio::test(flavor = "multi_thread")]
async fn probes_and_numbers_are_told() {
    let doors = Doors::open().await;
    doors.job(400).await;
    assert_eq!(doors.get("/healthz").await.body, "ok\n");
    assert_eq!(doors.get("/readyz").await.status, StatusCode::OK);
    let scaling = doors.get("/v1/scaling").await.json();
    assert_eq!((scaling["batches_waiting"].as_u64(), scaling["active_workers"].as_u64()), (Some(4), Some(0)));
    let metrics = String::from_utf8(doors.get("/metrics").await.body.to_vec()).unwrap();
    assert!(metrics.contains("\novtigre_jobs{state=\"queued\"} 1\n"), "{metrics}");
    for line in metrics.lines().filter(|line| !line.starts_with('#')) {
        assert!(line.rsplit_once(' ').unwrap().1.parse::<f64>().is_ok(), "{line}");
    }
    assert!(doors.get("/").await.head("content-type").starts_with("text/html"));
    doors.bench.farm.stopping.cancel();
    doors.get("/readyz").await.problem(503, "stopping");
}

impl Doors {
    async fn token(&self, role: Role) -> String {
        let token = format!("secret-{}", role.name());
        let row = TokenRow {
            id: format!("t-{}", role.name()),
            name: role.name().to_owned(),
            role,
            hash: hash(&token),
            created_at: None,
        };
        self.bench.farm.store.add_token(row).await.unwrap();
        token
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_door_is_open_to_its_roles_and_to_nobody_else() {
    let doors = Doors::guarded(Guarding { requests_per_second: 1e6, ..Guarding::default() }).await;
    let mut tokens = Vec::new();
    for role in Role::ALL {
        tokens.push((role, doors.token(role).await));
    }
    for (method, path, access) in DOORS {
        // Of things that are not there: whoever is let in hears that, and nothing is changed.
        let path = path.replace("{id}", &"0".repeat(64));
        let send = async |head: &[(&str, &str)]| doors.send(method.clone(), &path, head, "").await;
        let strangers =
            [vec![], vec![("authorization", "Bearer wrong")], vec![("authorization", "Basic c2VjcmV0")]];
        for head in strangers {
            let answer = send(&head).await;
            if access == Access::Open {
                assert!(answer.status.is_success(), "{method} {path}");
            } else {
                answer.problem(401, "unauthorized");
                assert!(answer.head("www-authenticate").starts_with("Bearer"));
            }
        }
        for (role, token) in &tokens {
            let bearer = format!("Bearer {token}");
            let answer = send(&[("authorization", &bearer)]).await;
            if path == "/v1/caller" {
                assert_eq!(answer.json(), json!({"role": role.name()}));
            }
            if access.allows(*role) {
                assert!(![401, 403, 500].contains(&answer.status.as_u16()), "{method} {path} {role:?}");
            } else {
                answer.problem(403, "forbidden");
            }
        }
    }
    // A table of its own, so that a slip in the list of doors is seen.
    let expected = [
        (Role::Submit, "submit read files"),
        (Role::Read, "read files"),
        (Role::Work, "work files"),
        (Role::Admin, "submit read files work admin"),
    ];
    let may = |role, method: Method, path: &str| super::roles::access(&method, path).allows(role);
    for (role, words) in expected {
        for (word, method, path) in [
            ("submit", Method::POST, "/v1/jobs"),
            ("submit", Method::DELETE, "/v1/jobs/{id}"),
            ("submit", Method::PUT, "/v1/scenes/{id}"),
            ("read", Method::GET, "/v1/jobs/{id}/image.exr"),
            ("read", Method::GET, "/metrics"),
            ("files", Method::GET, "/v1/scenes/{id}/bytes"),
            ("work", Method::POST, "/v1/workers/{id}/exchange"),
            ("work", Method::PUT, "/v1/leases/{id}/sum"),
            ("admin", Method::DELETE, "/v1/workers/{id}"),
            ("admin", Method::PUT, "/v1/jobs"),
        ] {
            let listed = words.split(' ').any(|w| w == word);
            assert_eq!(may(role, method, path), listed, "{role:?} {path}");
        }
    }
    assert!(doors.bench.farm.store.remove_token("t-read").await.unwrap());
    tokio::time::sleep(Duration::from_millis(1100)).await;
    let revoked = [("authorization", "Bearer secret-read")];
    doors.send(Method::GET, "/v1/jobs", &revoked, "").await.problem(401, "unauthorized");
}

#[tokio::test(flavor = "multi_thread")]
async fn every_route_is_in_the_list_of_doors() {
    let source = include_str!("mod.rs");
    let mut routes = 0;
    for line in source.lines().filter_map(|line| line.trim().strip_prefix(".route(\"")) {
        let (path, verbs) = line.split_once('"').unwrap();
        for (verb, method) in [
            ("get(", Method::GET),
            ("post(", Method::POST),
            ("put(", Method::PUT),
            ("patch(", Method::PATCH),
            ("delete(", Method::DELETE),
        ] {
            let there = verbs.contains(&format!(" {verb}")) || verbs.contains(&format!(".{verb}"));
            assert_eq!(there, DOORS.iter().any(|(m, p, _)| *m == method && *p == path), "{method} {path}");
            routes += usize::from(there);
        }
    }
    assert_eq!(routes, DOORS.len());
}

#[tokio::test(flavor = "multi_thread")]
async fn a_farm_that_all_can_reach_lets_nobody_in_without_a_token() {
    let doors =
        Doors::guarded(Guarding { without_tokens: WithoutTokens::Refuse, ..Guarding::default() }).await;
    doors.get("/v1/jobs").await.problem(401, "unauthorized");
    assert_eq!(doors.get("/healthz").await.status, StatusCode::OK);
    doors.get("/v1/nothing").await.problem(404, "not-found");
}

#[tokio::test(flavor = "multi_thread")]
async fn calls_by_foreign_names_and_from_foreign_pages_are_refused() {
    let hosts = vec!["farm.example".to_owned()];
    let doors = Doors::guarded(Guarding { hosts, ..Guarding::default() }).await;
    for (host, let_in) in [
        ("127.0.0.1:7700", true),
        ("localhost", true),
        ("[::1]:7700", true),
        ("FARM.example:80", true),
        ("evil.example:7700", false),
        ("localhost.evil.example", false),
    ] {
        let answer = doors.send(Method::GET, "/v1/jobs", &[("host", host)], "").await;
        assert_eq!(answer.status.is_success(), let_in, "{host}");
        if !let_in {
            answer.problem(421, "wrong-host");
        }
    }
    let post = async |origin: &str| {
        let heads = [("host", "localhost:7700"), ("origin", origin), ("content-type", "application/json")];
        doors.send(Method::POST, "/v1/jobs", &heads, "{}").await
    };
    post("http://localhost:7700").await.problem(422, "invalid-job");
    for origin in ["http://evil.example", "null", "http://localhost:7701", ""] {
        post(origin).await.problem(403, "other-origin");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn one_token_may_not_have_it_all() {
    let doors = Doors::guarded(Guarding { requests_per_second: 5.0, ..Guarding::default() }).await;
    let submit = format!("Bearer {}", doors.token(Role::Submit).await);
    let read = format!("Bearer {}", doors.token(Role::Read).await);
    let work = format!("Bearer {}", doors.token(Role::Work).await);
    let get = async |token: &str| doors.send(Method::GET, "/v1/jobs", &[("authorization", token)], "").await;
    let mut statuses = Vec::new();
    for _ in 0..12 {
        statuses.push(get(&submit).await);
    }
    let late = statuses.iter().find(|answer| answer.status == StatusCode::TOO_MANY_REQUESTS).unwrap();
    late.problem(429, "too-many-requests");
    assert_eq!(late.head("retry-after"), "1");
    assert!(statuses.iter().filter(|answer| answer.status == StatusCode::OK).count() >= 5);
    assert_eq!(get(&read).await.status, StatusCode::OK, "another token has its own");
    let beat = "/v1/workers/none/exchange";
    for _ in 0..12 {
        let heads = [("authorization", work.as_str()), ("content-type", "application/json")];
        doors.send(Method::POST, beat, &heads, "{}").await.problem(404, "not-found");
    }
    tokio::time::sleep(Duration::from_millis(1100)).await;
    assert_eq!(get(&submit).await.status, StatusCode::OK, "and later it may again");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_token_has_a_number_of_jobs_and_keys_of_its_own() {
    let bench = Bench::new(crate::farm::rules::Rules { jobs_per_token: 2, ..rules() }).await;
    let scene = Some(bench.scene().await);
    let request =
        || JobRequest { scene: scene.clone(), size: Some("8x8".parse().unwrap()), ..Default::default() };
    let submit = async |key: &str, owner: &str| {
        bench.farm.submit(request(), Some(key.to_owned()), Some(owner.to_owned())).await
    };
    let first = submit("a", "anna").await.unwrap();
    assert_eq!(submit("a", "anna").await.unwrap().id, first.id);
    submit("b", "anna").await.unwrap();
    let refused = submit("c", "anna").await.unwrap_err();
    assert!(matches!(refused, FarmError::TooManyJobs { most: 2 }), "{refused}");
    assert_eq!(submit("a", "anna").await.unwrap().id, first.id, "one that was taken is told of all the same");
    assert_ne!(submit("a", "otto").await.unwrap().id, first.id, "another's keys are another's");
    bench.farm.cancel(&first.id).await.unwrap();
    bench.until_settled(&first.id, JobState::Cancelled).await;
    submit("c", "anna").await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_pixel_is_that_of_the_picture_while_it_is_made_and_after() {
    let doors = Doors::open().await;
    let job = doors.job(4000).await;
    let path = format!("/v1/jobs/{job}");
    doors.get(&format!("{path}/pixel?x=0&y=0")).await.problem(404, "no-picture-yet");
    let worker = doors.bench.worker().await;
    let leases = doors.bench.take(&worker, 6).await;
    for lease in &leases {
        doors.bench.bring(lease, Spread::Noisy).await;
    }
    doors.bench.until(&job, |status| status.batches_done == 6).await;
    for step in ["while it is made", "after"] {
        if step == "after" {
            doors.bench.work(&worker, Spread::Noisy).await;
            doors.bench.until_settled(&job, JobState::Done).await;
        }
        let exr = doors.get(&format!("{path}/image.exr")).await;
        let layers = read_layers(&exr.body).unwrap();
        for (x, y) in [(0, 0), (17, 9), (39, 29)] {
            let told = doors.get(&format!("{path}/pixel?x={x}&y={y}")).await;
            let pixel: Pixel = serde_json::from_slice(&told.body).unwrap();
            assert_eq!(exr.head("etag"), format!("\"{}\"", pixel.manifest));
            let [plane] = pixel.planes.as_slice() else { panic!("{} planes", pixel.planes.len()) };
            assert_eq!(plane.name, "picture");
            for (c, channel) in ["R", "G", "B"].into_iter().enumerate() {
                let of = |name: &str| layers.channels[name][y * 40 + x];
                assert_eq!(plane.value[c], of(channel), "{step} at {x},{y}");
                assert_eq!(plane.error.unwrap()[c], of(&format!("error.{channel}")), "{step} at {x},{y}");
            }
        }
    }
    doors.get(&format!("{path}/pixel?x=40&y=0")).await.problem(404, "no-pixel");
    doors.get(&format!("{path}/pixel?x=0")).await.problem(400, "invalid-parameter");
    doors.get(&format!("{path}/pixel?x=-1&y=0")).await.problem(400, "invalid-parameter");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_list_that_is_as_before_is_not_sent_again() {
    let doors = Doors::open().await;
    let job = doors.job(400).await;
    let list = async |query: &str, tag: &str| {
        doors.send(Method::GET, &format!("/v1/jobs{query}"), &[("if-none-match", tag)], "").await
    };
    let first = list("", "").await;
    let tag = first.head("etag").to_owned();
    assert_eq!((first.status, tag.len()), (StatusCode::OK, 66));
    let again = list("", &tag).await;
    assert_eq!((again.status, again.body.len()), (StatusCode::NOT_MODIFIED, 0));
    doors.bench.farm.cancel(&job).await.unwrap();
    assert_eq!(list("", &tag).await.status, StatusCode::OK);
    for (query, found) in
        [(format!("?text={job}"), 1), ("?text=nothing".to_owned(), 0), ("?text=".to_owned(), 1)]
    {
        assert_eq!(list(&query, "").await.json()["items"].as_array().unwrap().len(), found, "{query}");
    }
    list(&format!("?text={}", "x".repeat(201)), "").await.problem(400, "invalid-parameter");
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_are_listed_page_by_page_in_the_order_asked_for() {
    let doors = Doors::open().await;
    let mut expected = Vec::new();
    for priority in [1, 3, 3] {
        let job = doors.job(4).await;
        let patch = JobPatch { priority: Some(priority), ..JobPatch::default() };
        doors.bench.farm.patch(&job, &patch, None).await.unwrap();
        expected.insert(0, job.to_string());
    }
    for (sort, order) in [("", [0, 1, 2]), ("&sort=created", [2, 1, 0]), ("&sort=priority", [2, 1, 0])] {
        let (mut found, mut query) = (Vec::new(), format!("?limit=2{sort}"));
        while let Some(next) = {
            let page = doors.get(&format!("/v1/jobs{query}")).await.json();
            let items = page["items"].as_array().unwrap();
            found.extend(items.iter().map(|job| job["id"].as_str().unwrap().to_owned()));
            page["next"].as_str().map(ToOwned::to_owned)
        } {
            query = format!("?limit=2{sort}&cursor={next}");
        }
        assert_eq!(found, order.map(|i| expected[i].clone()), "{sort}");
    }
}

/// What jobs are listed by, as it is shown of them.
fn shown(job: &Value, sort: &str) -> f64 {
    let endless = |value: &Value| value.as_f64().unwrap_or(f64::INFINITY);
    match sort {
        "error" => endless(&job["error"]["relative_error"]),
        "eta" => endless(&job["eta_seconds"]),
        "workers" => job["workers"].as_f64().unwrap(),
        _ if job["state"] == "done" => 1.0,
        _ => job["samples_done"].as_f64().unwrap() / job["samples_asked"].as_f64().unwrap(),
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_are_listed_by_what_changes_while_they_are_rendered() {
    let doors = Doors::open().await;
    let done = doors.job(4).await;
    doors.finish(&done).await;
    let running = doors.job(1 << 12).await;
    let worker = doors.bench.worker().await;
    let leases = doors.bench.take(&worker, 5).await;
    for lease in &leases[..4] {
        doors.bench.bring(lease, Spread::Noisy).await;
    }
    doors.bench.until(&running, |status| status.samples_done > 0.0 && status.error.is_some()).await;
    doors.job(4).await;
    for sort in ["error", "progress", "eta", "workers"] {
        // They follow about once a second.
        for tries in 0.. {
            assert!(tries < 200, "{sort}");
            let mut pages = Vec::new();
            for (minus, cursor) in [("", ""), ("-", ""), ("", "&limit=1")] {
                let page = doors.get(&format!("/v1/jobs?sort={minus}{sort}{cursor}")).await.json();
                pages.push(page);
            }
            let next = pages[2]["next"].as_str().unwrap();
            pages[2] = doors.get(&format!("/v1/jobs?sort={sort}&cursor={next}")).await.json();
            let values = |page: &Value| -> Vec<f64> {
                page["items"].as_array().unwrap().iter().map(|job| shown(job, sort)).collect()
            };
            let ids = |page: &Value| -> Vec<Value> {
                page["items"].as_array().unwrap().iter().map(|job| job["id"].clone()).collect()
            };
            let (up, rest) = (values(&pages[0]), ids(&pages[0])[1..].to_vec());
            let down: Vec<_> = ids(&pages[1]).into_iter().rev().collect();
            if up.is_sorted() && up[0] < up[2] && ids(&pages[0]) == down && ids(&pages[2]) == rest {
                break;
            }
            // A worker that is not heard of loses what it holds.
            doors.bench.beat(&worker, &leases[4]).await;
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn the_page_runs_nothing_from_elsewhere() {
    let doors = Doors::open().await;
    for path in ["/", "/docs", "/page/app.js", "/page/style.css", "/openapi.json"] {
        let file = doors.get(path).await;
        assert_eq!(file.status, StatusCode::OK, "{path}");
        assert!(
            file.head("content-security-policy").starts_with("default-src 'none'; script-src 'self'"),
            "{path}"
        );
        assert_eq!(file.head("x-content-type-options"), "nosniff");
        let text = String::from_utf8(file.body.to_vec()).unwrap();
        let named = text.matches("http://").count() - text.matches("http://www.w3.org/").count();
        assert_eq!((named, text.matches("innerHTML").count()), (0, 0), "{path}");
        let again = doors.send(Method::GET, path, &[("if-none-match", file.head("etag"))], "").await;
        assert_eq!(again.status, StatusCode::NOT_MODIFIED, "{path}");
    }
    doors.get("/page/nothing.js").await.problem(404, "not-found");
}

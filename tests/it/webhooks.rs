//! Webhooks: signed, in order, again until they are taken, whatever becomes of the farm.

use axum::{
    Router,
    body::Bytes,
    extract::State,
    http::{HeaderMap, StatusCode},
    routing::post,
};
use base64::{Engine as _, prelude::BASE64_STANDARD};
use ovtigre_proto::{
    client::{farm::Client, file::Upload},
    job::{JobPatch, JobRequest},
    status::JobState,
    webhook::{Notice, WebhookRequest},
};
use ovtigre_tests::{program::Farm, room::room};
use ring::hmac;
use std::{
    path::Path,
    sync::{
        Arc, Mutex,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant, SystemTime},
};

const KEY: [u8; 32] = [42; 32];
const FLAGS: [&str; 3] = ["--private-webhooks", "--reserve", "0"];

/// A notice as it came, and whether it was taken.
struct Came {
    heads: HeaderMap,
    body: Bytes,
    taken: bool,
}

impl Came {
    fn head(&self, name: &str) -> &str {
        self.heads[name].to_str().unwrap()
    }

    fn notice(&self) -> Notice {
        serde_json::from_slice(&self.body).unwrap()
    }

    fn is_signed_with(&self, key: &[u8]) -> bool {
        let signed = format!("{}.{}.", self.head("webhook-id"), self.head("webhook-timestamp"));
        let signed = [signed.as_bytes(), &self.body].concat();
        let tag =
            BASE64_STANDARD.decode(self.head("webhook-signature").strip_prefix("v1,").unwrap()).unwrap();
        hmac::verify(&hmac::Key::new(hmac::HMAC_SHA256, key), &signed, &tag).is_ok()
    }
}

/// A service that is told.
#[derive(Clone, Default)]
struct Service {
    takes: Arc<AtomicBool>,
    came: Arc<Mutex<Vec<Came>>>,
}

async fn tell(State(service): State<Service>, heads: HeaderMap, body: Bytes) -> StatusCode {
    let taken = service.takes.load(Ordering::Relaxed);
    service.came.lock().unwrap().push(Came { heads, body, taken });
    if taken { StatusCode::NO_CONTENT } else { StatusCode::INTERNAL_SERVER_ERROR }
}

impl Service {
    /// Listens; returns its address.
    async fn listen(&self) -> String {
        let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
        let url = format!("http://{}/secret/path?key=1", listener.local_addr().unwrap());
        let doors = Router::new().route("/secret/path", post(tell)).with_state(self.clone());
        tokio::spawn(async move { axum::serve(listener, doors).await });
        url
    }

    async fn until(&self, what: &str, reached: impl Fn(&[Came]) -> bool) {
        let begun = Instant::now();
        while !reached(&self.came.lock().unwrap()) {
            assert!(begun.elapsed() < Duration::from_mins(1), "{what}");
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    }
}

async fn request(client: &Client, place: &Path, url: &str) -> JobRequest {
    let scene = place.join("scene.glb");
    std::fs::write(&scene, room()).unwrap();
    let upload = Upload::file(scene).await.unwrap();
    client.upload(&upload).await.unwrap();
    let secret = Some(format!("whsec_{}", BASE64_STANDARD.encode(KEY)));
    JobRequest {
        scene: Some(upload.id().clone()),
        webhook: Some(WebhookRequest { url: url.to_owned(), secret }),
        ..JobRequest::default()
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn every_change_is_told_once_it_can_be_though_the_farm_was_killed() {
    let place = tempfile::tempdir().unwrap();
    let service = Service::default();
    let url = service.listen().await;
    let farm = Farm::start_with(place.path(), &FLAGS);
    let client = Client::new(&farm.url, 1).unwrap();
    let job = client.submit(&request(&client, place.path(), &url).await, "one").await.unwrap();
    let change = |state| JobPatch { state: Some(state), ..JobPatch::default() };
    client.change(&job.id, &change(JobState::Paused)).await.unwrap();
    service.until("the pause is told", |came| !came.is_empty()).await;
    // Meanwhile there is more to tell: it waits for its turn, and for a farm that lives.
    client.change(&job.id, &change(JobState::Running)).await.unwrap();
    client.cancel(&job.id).await.unwrap();
    tokio::time::sleep(Duration::from_millis(500)).await;
    farm.kill();
    service.takes.store(true, Ordering::Relaxed);
    let farm = Farm::start_with(place.path(), &FLAGS);
    let over = |came: &[Came]| came.last().unwrap().notice().data.state == JobState::Cancelled;
    service.until("the end is told", over).await;

    let came = std::mem::take(&mut *service.came.lock().unwrap());
    let refused: Vec<&Came> = came.iter().filter(|one| !one.taken).collect();
    let taken: Vec<&Came> = came.iter().filter(|one| one.taken).collect();
    let states: Vec<JobState> = taken.iter().map(|one| one.notice().data.state).collect();
    assert_eq!((states[0], states.len()), (JobState::Paused, 3), "{states:?}");
    assert!(
        refused.iter().all(|one| one.head("webhook-id") == taken[0].head("webhook-id")),
        "the same notice again"
    );
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap().as_secs();
    for one in &came {
        assert!(one.is_signed_with(&KEY));
        assert!(!one.is_signed_with(&[43; 32]));
        assert_eq!(one.notice().data.id, job.id);
        assert!(now.abs_diff(one.head("webhook-timestamp").parse().unwrap()) < 120);
    }
    assert_eq!(taken[2].notice().data.reason.as_deref(), Some("cancelled"));
    let client = Client::new(&farm.url, 1).unwrap();
    let shown = serde_json::to_string(&client.job(&job.id).await.unwrap()).unwrap();
    assert!(
        !shown.contains("whsec_") && !shown.contains("/secret/path") && shown.contains("\"webhook\""),
        "{shown}"
    );
    let metrics = reqwest::get(format!("{}/metrics", farm.url)).await.unwrap().text().await.unwrap();
    assert!(metrics.contains("ovtigre_notices_total{fate=\"taken\"} 3"), "{metrics}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_farm_posts_to_no_private_address_unless_it_is_allowed_to() {
    let place = tempfile::tempdir().unwrap();
    let service = Service::default();
    let url = service.listen().await;
    let farm = Farm::start_with(place.path(), &FLAGS[1..]);
    let client = Client::new(&farm.url, 1).unwrap();
    let refused =
        client.submit(&request(&client, place.path(), &url).await, "one").await.unwrap_err().to_string();
    assert!(refused.contains("not public"), "{refused}");
    assert!(service.came.lock().unwrap().is_empty());
}

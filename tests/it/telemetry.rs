//! What happens to a job can be followed from outside: by spans at a collector, by ids in the log.

use ovtigre_tests::{
    collector::{Collector, Told},
    program::{Farm, command},
    room::room,
};
use serde_json::Value;
use std::{
    collections::BTreeSet,
    fs,
    path::Path,
    time::{Duration, Instant},
};

/// Submits a small job; its name when it is done, and how many batches were brought.
fn job_of(farm: &Farm, folder: &Path) -> (String, usize) {
    let scene = folder.join("room.glb");
    fs::write(&scene, room()).unwrap();
    let job = farm.client(&["submit", scene.to_str().unwrap(), "--size", "32x18", "--samples", "64"]);
    let job = job.trim().to_owned();
    let done = farm.wait(&job, |job| job["state"] == "done");
    (job, done["batches_done"].as_u64().unwrap() as usize)
}

/// Names of a process' threads.
fn threads(farm: &Farm) -> Vec<String> {
    let tasks = fs::read_dir(format!("/proc/{}/task", farm.process_id())).unwrap();
    tasks.map(|task| fs::read_to_string(task.unwrap().path().join("comm")).unwrap_or_default()).collect()
}

fn named<'s>(spans: &'s [Told], name: &str) -> Vec<&'s Told> {
    spans.iter().filter(|span| span.name == name).collect()
}

#[test]
fn a_collector_sees_a_job_from_its_submission_to_its_last_sum() {
    let folder = tempfile::tempdir().unwrap();
    let collector = Collector::start();
    let environment = [("OTEL_EXPORTER_OTLP_ENDPOINT", &*collector.url), ("OTEL_BSP_SCHEDULE_DELAY", "100")];
    let farm = Farm::start_among(&environment, &folder.path().join("data"), &["--workers", "1"]);
    assert!(threads(&farm).iter().any(|name| name.starts_with("OpenTelemetry")));
    let (job, batches) = job_of(&farm, folder.path());
    let all = |spans: &[Told]| {
        let enough = |name| named(spans, name).len() >= batches;
        !named(spans, "job").is_empty()
            && ["hand out", "lease", "render", "bring", "commit"].into_iter().all(enough)
    };
    let spans = collector.wait(&job, all);
    assert_eq!(
        spans.iter().map(|span| &*span.trace).collect::<BTreeSet<_>>().len(),
        1,
        "one job is one trace"
    );
    let [life] = named(&spans, "job")[..] else { panic!("one life") };
    assert_eq!((&*life.parent, &*life.says["ovtigre.state"]), ("", "done"));
    assert_eq!(named(&spans, "submit").len(), 1);
    assert!(!named(&spans, "checkpoint").is_empty());
    let workers: Value = serde_json::from_str(&farm.client(&["workers", "--json"])).unwrap();
    for lease in named(&spans, "lease") {
        assert_eq!((&*lease.service, &lease.parent), ("ovtigre-worker", &life.number));
        assert_eq!(lease.says["ovtigre.job"], job);
        assert!(lease.says["ovtigre.batch"].starts_with("region 0 replicate "), "{lease:?}");
        assert!(workers.to_string().contains(&lease.says["ovtigre.worker"]), "{lease:?}");
    }
    for (name, service) in [
        ("hand out", "ovtigre-server"),
        ("fetch", "ovtigre-worker"),
        ("render", "ovtigre-worker"),
        ("bring", "ovtigre-worker"),
        ("commit", "ovtigre-server"),
    ] {
        for part in named(&spans, name) {
            let lease = named(&spans, "lease").into_iter().find(|lease| lease.number == part.parent);
            // A batch that was not wanted any more has no end at its worker.
            let Some(lease) = lease else { continue };
            assert_eq!(part.service, service);
            for key in ["ovtigre.job", "ovtigre.batch", "ovtigre.lease", "ovtigre.worker"] {
                assert_eq!(part.says[key], lease.says[key], "{name}");
            }
            assert!(life.time[0] <= part.time[0] && part.time[0] <= part.time[1]);
        }
    }
    let committed: BTreeSet<&str> = named(&spans, "commit").iter().map(|span| &*span.parent).collect();
    let leased: BTreeSet<&str> = named(&spans, "lease").iter().map(|span| &*span.number).collect();
    assert!(committed.intersection(&leased).count() >= batches, "{batches} batches were brought");
}

#[test]
fn without_a_collector_no_thread_waits_for_one_and_an_unknown_protocol_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let farm = Farm::start(folder.path());
    assert!(!threads(&farm).iter().any(|name| name.starts_with("OpenTelemetry")));
    let mut serve = command();
    serve.args(["work", "--server", &farm.url, "--threads", "1"]);
    serve
        .env("OTEL_EXPORTER_OTLP_ENDPOINT", "http://127.0.0.1:4317")
        .env("OTEL_EXPORTER_OTLP_PROTOCOL", "grpc");
    let refused = serve.output().unwrap();
    let said = String::from_utf8(refused.stderr).unwrap();
    assert_eq!((refused.status.code(), said.lines().count()), (Some(2), 1), "{said}");
    assert!(said.contains("OTEL_EXPORTER_OTLP_PROTOCOL is 'grpc'"), "{said}");
}

#[test]
fn lines_of_the_log_say_which_job_batch_lease_and_worker() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("log");
    let flags = ["--workers", "1", "--log", "ovtigre=debug", "--log-format", "json"];
    let farm = Farm::start_logged(&log, &folder.path().join("data"), &flags);
    let (job, batches) = job_of(&farm, folder.path());
    let start = Instant::now();
    let mut text = String::new();
    // The worker hears of its last sum after the farm has taken it.
    while text.matches("\"brought\"").count() < batches && start.elapsed() < Duration::from_secs(30) {
        text = fs::read_to_string(&log).unwrap();
    }
    farm.kill();
    let lines: Vec<Value> = text
        .lines()
        .filter(|line| line.ends_with('}'))
        .map(|line| serde_json::from_str(line).expect(line))
        .collect();
    let about = |target: &str, message: &str| -> Vec<[String; 4]> {
        let one =
            |line: &&Value| line["target"] == target && line["message"] == message && line["job"] == *job;
        let ids = ["job", "batch", "lease", "worker"];
        lines.iter().filter(one).map(|line| ids.map(|id| line[id].as_str().expect(id).to_owned())).collect()
    };
    let brought = about("ovtigre_worker::bring", "brought");
    assert!(brought.len() >= batches, "{text}");
    let handed_out = about("ovtigre::farm::lease", "a batch was handed out");
    let came = about("ovtigre::farm::commit", "a sum came");
    for ids in &brought {
        assert!(handed_out.contains(ids), "{ids:?} in {handed_out:?}");
        assert!(came.contains(ids), "{ids:?} in {came:?}");
    }
    assert!(lines.iter().all(|line| line["timestamp"].is_string() && line["level"].is_string()));
    assert!(lines.iter().any(|line| line["message"] == "job is over" && line["job"] == *job));
}

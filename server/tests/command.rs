//! The program `ovtigre`, as its users run it.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on ends")]

use ovtigre_core::film::exr::{Layers, read_layers};
use serde_json::{Value, json};
use std::{
    fs,
    io::{BufRead as _, BufReader},
    path::Path,
    process::{Child, Command, Output, Stdio},
    time::{Duration, Instant},
};
use tempfile::TempDir;

/// A lamp over a floor, as a `.gltf` with its buffer beside it.
fn scene() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let corners: [[f32; 3]; 4] = [[-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 0.0, -1.0]];
    let mut bytes: Vec<u8> = corners.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    fs::write(folder.path().join("square.bin"), &bytes).unwrap();
    let square = |material: u32| json!({"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": material}]});
    let document = json!({
        "asset": {"version": "2.0"},
        "buffers": [{"uri": "square.bin", "byteLength": bytes.len()}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 12},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, 0, -1], "max": [1, 0, 1]},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "materials": [
            {"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0}},
            {"emissiveFactor": [1, 1, 1], "doubleSided": true},
        ],
        "meshes": [square(0), square(1)],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1, "aspectRatio": 1.5}}],
        "nodes": [
            {"mesh": 0, "scale": [3, 1, 3]},
            {"mesh": 1, "translation": [0, 2, 0], "scale": [0.5, 1, 0.5]},
            {"camera": 0, "translation": [0, 1, 5]},
        ],
        "scenes": [{"nodes": [0, 1, 2]}],
        "scene": 0,
    });
    fs::write(folder.path().join("lamp.gltf"), document.to_string()).unwrap();
    folder
}

fn command(folder: &Path, arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ovtigre"));
    command.current_dir(folder).args(arguments.split_whitespace());
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn run(folder: &Path, arguments: &str) -> Output {
    command(folder, arguments).output().unwrap()
}

/// What it prints; it must end well.
fn prints(folder: &Path, arguments: &str) -> String {
    let output = run(folder, arguments);
    let remarks = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments}: {:?}: {remarks}", output.status);
    String::from_utf8(output.stdout).unwrap()
}

/// The one line with which it must be refused.
fn refusal(folder: &Path, arguments: &str, code: i32) -> String {
    let output = run(folder, arguments);
    let remarks = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments}: {remarks}");
    let errors: Vec<&str> = remarks.lines().filter(|line| line.starts_with("error: ")).collect();
    assert_eq!(errors.len(), 1, "{arguments}: {remarks}");
    assert!(!remarks.contains("panicked"), "{remarks}");
    errors[0].to_owned()
}

fn picture(path: &Path) -> Layers {
    read_layers(&fs::read(path).unwrap()).unwrap()
}

fn signal(child: &Child, name: &str) {
    assert!(
        Command::new("kill").args([format!("-{name}"), child.id().to_string()]).status().unwrap().success()
    );
}

/// A process that ends with this value.
struct Process(Child);

impl Process {
    fn worker(folder: &Path, farm: &str, cache: &str) -> Self {
        let mut command =
            command(folder, &format!("work --server {farm} --threads 1 --cache {cache} --log error"));
        Self(command.stderr(Stdio::inherit()).spawn().unwrap())
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.0.kill().ok();
        self.0.wait().ok();
    }
}

/// A farm, and its address.
struct Farm {
    address: String,
    process: Process,
}

impl Farm {
    fn start(folder: &Path, listen: &str, workers: u32) -> Self {
        let arguments =
            format!("serve --listen {listen} --data farm --workers {workers} --threads 1 --log error");
        let mut child = command(folder, &arguments).stderr(Stdio::null()).spawn().unwrap();
        let mut address = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut address).unwrap();
        Self { address: address.trim().to_owned(), process: Process(child) }
    }
}

#[test]
fn one_command_renders_a_scene() {
    let folder = scene();
    let at = |name: &str| folder.path().join(name);
    let arguments = "render lamp.gltf --size 48x32 --samples 16 --threads 1 -o lamp.png --report report.json";
    let printed = prints(folder.path(), arguments);
    assert_eq!(printed.lines().count(), 1, "{printed}");
    assert!(printed.starts_with("lamp.png, 16/16 samples, error ±"), "{printed}");
    assert!(fs::read(at("lamp.png")).unwrap().starts_with(b"\x89PNG"));
    let layers = picture(&at("lamp.exr"));
    assert_eq!((layers.width, layers.height), (48, 32));
    assert!(
        layers.channels["G"].iter().all(|x| x.is_finite()) && layers.channels["G"].iter().any(|x| *x > 0.01)
    );
    assert!(layers.channels.contains_key("error.G"));
    let report: Value = serde_json::from_slice(&fs::read(at("report.json")).unwrap()).unwrap();
    let rows = report["rows"].as_array().unwrap();
    assert_eq!(rows.last().unwrap()["samples"], 16);
    assert_eq!(report["job"]["state"], "done");
    assert_eq!(report["invalid_samples"], 0);
    prints(folder.path(), "render lamp.gltf --size 48x32 --samples 16 --workers 2 --threads 2 -o again.exr");
    prints(folder.path(), "compare lamp.exr again.exr --tolerance 0");
}

#[test]
fn a_farm_is_asked_from_the_command_line() {
    let folder = scene();
    let farm = Farm::start(folder.path(), "127.0.0.1:0", 1);
    let ask = |arguments: &str| prints(folder.path(), &format!("{arguments} --server {}", farm.address));
    let job = ask("submit lamp.gltf --size 16x16 --samples 8").trim().to_owned();
    let watched = ask(&format!("watch {job} --json"));
    let last: Value = serde_json::from_str(watched.lines().last().unwrap()).unwrap();
    assert_eq!((last["event"].as_str(), last["state"].as_str()), (Some("status"), Some("done")));
    let status: Value = serde_json::from_str(&ask(&format!("status {job} --json"))).unwrap();
    assert_eq!(status["samples_done"], 8.0);
    assert!(ask("status").contains(&job));
    assert!(ask(&format!("status {job}")).contains("done"));
    assert!(ask("workers").contains("local-1"));
    ask(&format!("fetch {job} -o fetched.exr"));
    assert_eq!(picture(&folder.path().join("fetched.exr")).width, 16);
    ask(&format!("fetch {job} -o fetched.png --exposure -1 --width 8"));
    let endless = ask("submit lamp.gltf --size 64x64 --samples 1000000").trim().to_owned();
    ask(&format!("pause {endless}"));
    assert!(ask(&format!("status {endless}")).contains("paused"));
    ask(&format!("resume {endless}"));
    ask(&format!("cancel {endless}"));
    assert!(ask(&format!("status {endless}")).contains("cancelled"));
    ask("render lamp.gltf --size 16x16 --samples 8 -o there.exr");
    prints(folder.path(), "compare fetched.exr there.exr --tolerance 0");
    assert!(
        refusal(folder.path(), &format!("status nobody --server {}", farm.address), 2).contains("nobody")
    );
}

#[test]
fn interrupted_once_it_keeps_the_picture_so_far() {
    let folder = scene();
    let child = command(folder.path(), "render lamp.gltf --size 64x64 --samples 4000000 --threads 1")
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_secs(4));
    signal(&child, "INT");
    let began = Instant::now();
    let output = child.wait_with_output().unwrap();
    let remarks = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(5), "{remarks}");
    assert!(began.elapsed() < Duration::from_secs(20));
    assert_eq!(picture(&folder.path().join("lamp.exr")).width, 64);
}

#[test]
fn killed_workers_and_a_restarted_farm_change_no_bit() {
    let folder = scene();
    let flags = "lamp.gltf --size 96x64 --samples 512";
    prints(folder.path(), &format!("render {flags} --threads 2 -o calm.exr"));
    let farm = Farm::start(folder.path(), "127.0.0.1:0", 0);
    let address = farm.address.clone();
    let ask = |arguments: &str| prints(folder.path(), &format!("{arguments} --server {address}"));
    let job = ask(&format!("submit {flags}")).trim().to_owned();
    let samples = || {
        let status: Value = serde_json::from_str(&ask(&format!("status {job} --json"))).unwrap();
        status["samples_done"].as_f64().unwrap()
    };
    let reaches = |count: f64| {
        let began = Instant::now();
        while samples() < count {
            assert!(began.elapsed() < Duration::from_mins(1), "{} of {count} samples", samples());
            std::thread::sleep(Duration::from_millis(20));
        }
    };
    let first = Process::worker(folder.path(), &address, "cache-1");
    reaches(8.0);
    drop(first);
    let watching = command(folder.path(), &format!("watch {job} --server {address}")).spawn().unwrap();
    let _second = Process::worker(folder.path(), &address, "cache-2");
    reaches(64.0);
    drop(farm);
    std::thread::sleep(Duration::from_millis(300));
    let _again = Farm::start(folder.path(), address.trim_start_matches("http://"), 0);
    let _third = Process::worker(folder.path(), &address, "cache-2");
    let watched = watching.wait_with_output().unwrap();
    assert!(watched.status.success(), "{}", String::from_utf8_lossy(&watched.stderr));
    ask(&format!("fetch {job} -o stormy.exr"));
    let (calm, stormy) =
        (picture(&folder.path().join("calm.exr")), picture(&folder.path().join("stormy.exr")));
    assert_eq!(calm.channels, stormy.channels);
}

#[test]
fn a_worker_told_to_leave_leaves_in_peace() {
    let folder = scene();
    let farm = Farm::start(folder.path(), "127.0.0.1:0", 0);
    let mut worker = Process::worker(folder.path(), &farm.address, "cache");
    prints(folder.path(), &format!("render lamp.gltf --size 16x16 --samples 8 --server {}", farm.address));
    signal(&worker.0, "TERM");
    assert!(worker.0.wait().unwrap().success());
    let workers = prints(folder.path(), &format!("workers --server {}", farm.address));
    assert!(workers.contains("gone") && !workers.contains("active"), "{workers}");
}

#[test]
fn a_farm_whose_terminal_is_closed_leaves_in_peace() {
    let folder = scene();
    let mut farm = Farm::start(folder.path(), "127.0.0.1:0", 1);
    prints(folder.path(), &format!("status --server {}", farm.address));
    signal(&farm.process.0, "HUP");
    let began = Instant::now();
    while farm.process.0.try_wait().unwrap().is_none() && began.elapsed() < Duration::from_secs(20) {
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(farm.process.0.try_wait().unwrap().is_some_and(|ended| ended.success()));
    assert!(!folder.path().join("farm/farm.sqlite-wal").exists(), "the log is folded into the file");
}

#[cfg(target_os = "linux")]
#[test]
fn no_worker_outlives_a_killed_render() {
    let folder = scene();
    let data = folder.path().join("farm");
    let arguments =
        format!("render lamp.gltf --size 64x64 --samples 4000000 --threads 1 --data {}", data.display());
    let mut child = command(folder.path(), &arguments).spawn().unwrap();
    let workers = || {
        let processes = fs::read_dir("/proc").unwrap().filter_map(Result::ok);
        let lines = processes.filter_map(|process| fs::read_to_string(process.path().join("cmdline")).ok());
        lines
            .filter(|line| line.contains("--until-stdin-closes") && line.contains(data.to_str().unwrap()))
            .count()
    };
    let within = |seconds: u64, holds: &dyn Fn() -> bool| {
        let began = Instant::now();
        while !holds() && began.elapsed() < Duration::from_secs(seconds) {
            std::thread::sleep(Duration::from_millis(50));
        }
        holds()
    };
    assert!(within(20, &|| workers() == 1), "it has a worker");
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(within(20, &|| workers() == 0), "its worker is gone");
}

#[test]
fn what_cannot_be_done_is_one_clear_line() {
    let folder = scene();
    let refused = |arguments: &str, code: i32| refusal(folder.path(), arguments, code);
    fs::write(folder.path().join("empty.glb"), "").unwrap();
    fs::write(folder.path().join("cut.glb"), b"glTF\x02\0\0\0\xff\0\0\0").unwrap();
    fs::write(folder.path().join("text.gltf"), "{\"asset\": nothing}").unwrap();
    let lost = fs::read_to_string(folder.path().join("lamp.gltf")).unwrap().replace("square.bin", "lost.bin");
    fs::write(folder.path().join("lost.gltf"), lost).unwrap();
    for verb in ["render", "check"] {
        assert!(refused(&format!("{verb} nothing.glb"), 2).contains("nothing.glb"));
        assert!(refused(&format!("{verb} empty.glb"), 2).contains("empty"));
        refused(&format!("{verb} cut.glb"), 2);
        assert!(refused(&format!("{verb} text.gltf"), 2).contains("text.gltf"));
        assert!(refused(&format!("{verb} lost.gltf"), 2).contains("lost.bin"));
    }
    for flags in [
        "-o x.jpg",
        "-o no/x.exr",
        "--camera 7",
        "--environment nothing.exr",
        "--layer a=LD",
        "--layer R=LE",
        "--layer a=LE --layer a=LDE",
        "--layer a=(1,2)",
        "--paths LD(E",
        "--paths LS_TE",
        "--preset whitted --method light",
        "--method radiosity --paths LDE",
        "--strategies 1,2",
        "--weights power",
        "--shutter 1,0",
        "--region 0,0,99999,1",
    ] {
        refused(&format!("render lamp.gltf --size 16x16 --samples 1 {flags}"), 2);
    }
    refused("render lamp.gltf --samples many", 2);
    refused("serve --listen 0.0.0.0:0", 2);
    for data in ["empty.glb", "empty.glb/below", "/dev/null/below"] {
        assert!(refused(&format!("serve --listen 127.0.0.1:0 --data {data}"), 2).contains(data));
    }
    refused("compare nothing.exr nothing.exr", 2);
    assert!(refused("status --server http://127.0.0.1:1", 3).contains("127.0.0.1:1"));
}

#[test]
fn a_scene_is_described_without_a_farm() {
    let folder = scene();
    let printed = prints(folder.path(), "check lamp.gltf");
    assert!(printed.contains("emissive triangles"), "{printed}");
    let document: Value = serde_json::from_str(&prints(folder.path(), "check lamp.gltf --json")).unwrap();
    assert_eq!(document["contents"]["placed_triangles"], 4);
}

#[test]
fn shells_complete_and_man_has_a_page_for_each_command() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish"] {
        let script = prints(folder.path(), &format!("completions {shell}"));
        assert!(script.contains("ovtigre") && script.contains("samples"), "{shell}");
    }
    refusal(folder.path(), "completions nushell", 2);
    prints(folder.path(), "manual man1");
    let pages: Vec<String> = fs::read_dir(folder.path().join("man1"))
        .unwrap()
        .map(|page| page.unwrap().file_name().into_string().unwrap())
        .collect();
    for command in ["ovtigre", "ovtigre-render", "ovtigre-serve", "ovtigre-compare"] {
        assert!(pages.contains(&format!("{command}.1")), "{pages:?}");
        let page = fs::read_to_string(folder.path().join(format!("man1/{command}.1"))).unwrap();
        assert!(page.contains(".TH ") && page.contains(".SH SYNOPSIS"), "{command}");
    }
    let page = fs::read_to_string(folder.path().join("man1/ovtigre-render.1")).unwrap();
    assert!(page.contains("\\-\\-samples"), "{page}");
    assert!(!pages.iter().any(|page| page.contains("help")), "{pages:?}");
}

//! What the farm costs: wall time of `ovtigre render` with one worker over that of the same samples in one call
//! of `core`. `cargo bench -p ovtigre-tests --bench overhead -- [SAMPLES [PAIRS]]`, with 480 and 3 where nothing is said.

use ovtigre_core::{
    film::{append::Prefix, schedule::Schedule},
    render::{batch::render, progress::Progress},
};
use ovtigre_tests::{
    picture::{scene, settings},
    program::run,
    room::room,
};
use std::{fs, time::Instant};

fn main() {
    let numbers: Vec<u32> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let (samples, pairs) = (numbers.first().copied().unwrap_or(480), numbers.get(1).copied().unwrap_or(3));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("room.glb");
    fs::write(&path, room()).expect("written");
    let mut ratios = Vec::new();
    for _ in 0..pairs {
        let (alone, farm) = (in_core(samples), in_a_farm(&path, samples));
        print(&format!("core {alone:.2} s, farm {farm:.2} s, ratio {:.3}", farm / alone));
        ratios.push(farm / alone);
    }
    ratios.sort_by(f64::total_cmp);
    print(&format!("median ratio {:.3} of {pairs}", ratios[ratios.len() / 2]));
}

#[expect(clippy::print_stdout, reason = "a benchmark's result")]
fn print(line: &str) {
    println!("{line}");
}

/// Seconds to prepare the scene and to render every batch, on all cores.
fn in_core(samples: u32) -> f64 {
    let start = Instant::now();
    let settings = settings(480, 270, 4);
    let scene = scene(&room(), &settings);
    let schedule = Schedule::new(settings.size.frame(), 1, 4, samples / 4);
    for replicate in 0..4 {
        let mut prefix = Prefix::empty(settings.size.frame(), replicate, 1);
        for block in 0..schedule.blocks().len() {
            let batch = schedule.batch(0, replicate, block).expect("in the schedule");
            let sum = render(&scene, &settings, batch, &Progress::new()).expect("not stopped");
            prefix.append(&sum).expect("in order");
        }
    }
    start.elapsed().as_secs_f64()
}

/// Seconds from starting the command to its end, the picture written.
fn in_a_farm(scene: &std::path::Path, samples: u32) -> f64 {
    let start = Instant::now();
    let out = scene.with_extension("exr");
    let samples = samples.to_string();
    let (scene, out) = (scene.to_str().expect("UTF-8"), out.to_str().expect("UTF-8"));
    let output = run([
        "render",
        scene,
        "-o",
        out,
        "--size",
        "480x270",
        "--samples",
        &samples,
        "--workers",
        "1",
        "--method",
        "path",
    ]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    start.elapsed().as_secs_f64()
}

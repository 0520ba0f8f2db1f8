//! Samples a second of one thread, and bytes a second that a farm merges: `cargo bench -p ovtigre-tests --bench render`.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use ovtigre_core::{
    film::{
        append::Prefix,
        exr::{PartialAttributes, read_partial, write_partial},
        invalid::InvalidSamples,
        schedule::Schedule,
        size::Size,
        sum::Sum,
    },
    render::{batch::render, progress::Progress},
    settings::Settings,
};
use ovtigre_tests::{
    picture::{in_environment, scene, settings},
    room::room,
    scenes::{body_alone, furnace, lambert, sphere},
};
use std::{hint::black_box, time::Duration};

/// Samples a second, the trees built beforehand.
fn samples(c: &mut Criterion) {
    let mut group = c.benchmark_group("samples");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(5));
    let scenes: [(&str, Vec<u8>, Settings); 3] = [
        ("room", room(), settings(64, 36, 1)),
        ("white room, reflectance 0.9", furnace(0.9, 1.0), settings(64, 36, 1)),
        (
            "ball in an environment",
            body_alone(lambert(0.7, 0.0), sphere(Vec3::ZERO, 1.0, 64)),
            in_environment(settings(64, 36, 1), 1.0),
        ),
    ];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    for (name, glb, settings) in scenes {
        let scene = scene(&glb, &settings);
        let batch = Schedule::new(settings.size.frame(), 1, 1, 4).batch(0, 0, 0).expect("a first batch");
        group.throughput(Throughput::Elements(settings.size.pixels() * u64::from(batch.block.count)));
        group.bench_function(name, |b| {
            b.iter(|| pool.install(|| black_box(render(&scene, &settings, batch, &Progress::new()))));
        });
    }
    group.finish();
}

/// Bytes of partial EXRs a second: decoded and checked, hashed, appended.
fn merge(c: &mut Criterion) {
    let mut group = c.benchmark_group("merge");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(3));
    let size = Size { width: 1280, height: 720 };
    let batch = Schedule::new(size.frame(), 1, 1, 4).batch(0, 0, 0).expect("a first batch");
    let plane = (0..size.frame().pixels()).map(|i| [i as f32, 0.5, 1e-3 * i as f32]).collect();
    let sum = Sum {
        batch,
        planes: vec![plane],
        invalid: InvalidSamples::default(),
        rays: 1,
        tile_rays: Vec::new(),
    };
    let says = PartialAttributes {
        job: "j".to_owned(),
        scene: "s".to_owned(),
        method: "path".to_owned(),
        solution: None,
        allocation: None,
    };
    let bytes = write_partial(&sum, size, &says);
    group.throughput(Throughput::Bytes(bytes.len() as u64));
    group.bench_function("decode", |b| b.iter(|| black_box(read_partial(&bytes, size.frame().pixels()))));
    group.bench_function("hash", |b| b.iter(|| black_box(sum.hash())));
    let empty = Prefix::empty(size.frame(), 0, 1);
    group.bench_function("append", |b| {
        b.iter_batched_ref(
            || empty.clone(),
            |prefix| prefix.append(&sum).expect("the first block"),
            criterion::BatchSize::LargeInput,
        );
    });
    group.finish();
}

criterion_group!(benches, samples, merge);
criterion_main!(benches);

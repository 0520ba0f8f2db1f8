//! How error falls with the number of samples.

use glam::Vec3;
use ovtigre_core::{
    film::{
        batch::{Batch, Block},
        error::slope,
        sum::Plane,
    },
    render::{batch::render, prepare::Prepared, progress::Progress},
    settings::{Method, Settings, Strategy},
};
use ovtigre_tests::{
    picture::{scene, settings},
    scenes::{lambert, over_floor},
};

/// Each pixel is a trial: they all see the same point.
const SIDE: u32 = 32;
/// Numbers of samples, each four times the one before.
const COUNTS: [u32; 5] = [1, 4, 16, 64, 256];

/// Sums of the first `samples` of a sequence.
fn sums(prepared: &Prepared, settings: &Settings, replicate: u32, samples: u32) -> Plane {
    let block = Block { index: 0, start: 0, count: samples };
    let batch = Batch { region: settings.size.frame(), replicate, block };
    render(prepared, settings, batch, &Progress::new()).unwrap().planes.remove(0)
}

/// Root of the mean square distance of the pixels' means from the truth, over the truth.
fn error(sums: impl Iterator<Item = f64>, samples: u32, truth: f64) -> f64 {
    let square = |sum: f64| (sum / f64::from(samples) / truth - 1.0).powi(2);
    (sums.map(square).sum::<f64>() / f64::from(SIDE * SIDE)).sqrt()
}

#[test]
fn the_error_of_independent_samples_falls_as_their_root_and_that_of_a_sequence_faster() {
    // One triangle shines on a floor, nothing between: next events alone integrate a smooth function of two numbers. Rays that hit the
    // lamp or pass it would be a step.
    let glb = over_floor(0.5, |glb| {
        let lamp = glb.material(lambert(0.0, 5.0));
        let corners = [Vec3::new(-0.6, 1.0, -0.4), Vec3::new(1.2, 1.3, -0.5), Vec3::new(0.3, 0.9, 1.1)];
        let mesh = glb.mesh(&corners, &[[0, 1, 2]], lamp);
        glb.place(mesh);
    });
    let most = COUNTS[COUNTS.len() - 1];
    let next_event = vec![Strategy { s: 1, t: 2 }];
    let settings = Settings {
        method: Method::Bidirectional,
        strategies: next_event,
        bounces: Some(1),
        ..settings(SIDE, SIDE, most)
    };
    let prepared = scene(&glb, &settings);
    let red = |plane: Plane| plane.into_iter().map(|pixel| f64::from(pixel[0]));
    let all = 1 << 10;
    // 1024 sequences of as many samples: known far better than any mean below.
    let truth =
        red(sums(&prepared, &settings, most, all)).sum::<f64>() / f64::from(all) / f64::from(SIDE * SIDE);
    assert!(truth > 0.0);

    // The first samples of independently scrambled sequences are independent: plain Monte Carlo.
    let mut independent = vec![0.0; (SIDE * SIDE) as usize];
    let (mut plain, mut sequence) = (Vec::new(), Vec::new());
    for drawn in 1..=most {
        for (sum, sample) in independent.iter_mut().zip(red(sums(&prepared, &settings, drawn - 1, 1))) {
            *sum += sample;
        }
        if COUNTS.contains(&drawn) {
            plain.push((f64::from(drawn), error(independent.iter().copied(), drawn, truth)));
            sequence.push((f64::from(drawn), error(red(sums(&prepared, &settings, 0, drawn)), drawn, truth)));
        }
    }
    // 1024 trials know each error to 2.2 %, the slope to 0.008.
    let [plain_slope, sequence_slope] = [&plain, &sequence].map(|points| slope(points).unwrap());
    assert!((plain_slope + 0.5).abs() < 0.05, "{plain_slope}: {plain:?}");
    assert!(sequence_slope < -0.8, "{sequence_slope}: {sequence:?}");
}

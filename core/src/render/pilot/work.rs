//! Work, counted: constants that were measured on one machine.

use crate::settings::Method;

/// Reading a triangle and building its part of a tree, in microseconds of one thread.
const TRIANGLE: f64 = 1.0;
/// The same of a pixel of an image.
const PIXEL: f64 = 0.007;
/// The same of a sample of `path`, where nothing is known yet.
pub(super) const SAMPLE: f64 = 1.5;
/// Samples of `path` that a second of run time is taken for.
pub(super) const SAMPLES_A_SECOND: f64 = 1e5;
/// Time of a pilot over that of as many samples in a job: what it is told costs two thirds of the paths again (cornell-box: 1.7).
pub(super) const TELLING: f64 = 1.7;
/// Times what was spent, with another block: it doubles the samples, and their rays may be a few more.
pub(super) const AGAIN: f64 = 2.1;
/// What the work of `path` counts: in a pilot it seems more than in a job, as with more samples of a sequence its error falls faster than
/// that of methods whose light subpaths go anywhere.
const SEQUENCE: f64 = 0.88;

/// Reading so much, in microseconds of one thread.
pub(super) fn reading(triangles: u64, pixels: u64) -> f64 {
    TRIANGLE * triangles as f64 + PIXEL * pixels as f64
}

/// A sample in samples of `path`, where nothing is known yet: a little more than in most scenes.
pub(super) fn dearness(method: Method) -> f64 {
    match method {
        Method::Bidirectional => 3.8,
        Method::Caustics => 1.7,
        Method::Light => 1.5,
        Method::Path | Method::Photon | Method::Radiosity => 1.15,
    }
}

/// How long a batch takes, in microseconds of one thread: what `cargo run --release -p ovtigre-tests --bin auto` measured.
pub(super) fn work(method: Method, rays: u64, samples: f64) -> f64 {
    let [a_ray, a_sample] = match method {
        Method::Light => [0.3, 1.2],
        Method::Bidirectional | Method::Caustics => [0.5, 0.0],
        Method::Path | Method::Photon | Method::Radiosity => [0.56, 0.0],
    };
    a_ray * rays as f64 + a_sample * samples
}

/// What so much work counts for an error that a pilot tells of.
pub(super) fn counted(method: Method, work: f64) -> f64 {
    match method {
        Method::Path => SEQUENCE * work,
        _ => work,
    }
}

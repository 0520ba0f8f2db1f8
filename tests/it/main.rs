//! All integration tests, one binary.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on panics")]

mod bad_input;
mod caustics;
mod closed_forms;
mod expressions;
mod faults;
mod gltf;
mod lens;
mod methods;
mod motion;
mod photons;
mod radiosity;
mod same_bits;
mod stability;
mod techniques;
mod tidy;
mod weights;

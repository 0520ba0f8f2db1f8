//! The words that the farm, its workers and its clients share: data, and a client that speaks them. No rules.

pub mod client;
pub mod curve;
pub mod id;
pub mod job;
pub mod lease;
pub mod needs;
pub mod pair;
pub mod pixel;
pub mod problem;
pub mod route;
pub mod scene;
pub mod status;
pub mod telemetry;
pub mod webhook;

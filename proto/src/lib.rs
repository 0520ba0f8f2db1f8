//! The words that the farm, its workers and its clients share: data, and a client that speaks them. No rules.

pub mod id;
pub mod pair;
pub mod job;
pub mod status;
pub mod curve;
pub mod scene;
pub mod lease;
pub mod problem;
pub mod route;
pub mod client;

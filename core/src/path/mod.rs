//! What all methods share: expressions, vertices, walks from both ends, joints and their weights.

pub mod connect;
pub mod expression;
pub mod eye;
pub mod light;
pub mod media;
pub mod mis;
pub mod photons;
pub mod reach;
pub mod rules;
pub mod survival;
pub mod tally;
pub mod throughput;
pub mod vertex;
pub mod walk;

//! A batch of samples to its sum, on any number of threads.

pub mod batch;
pub mod inspect;
mod passes;
pub mod pilot;
pub mod prepare;
pub mod profile;
pub mod progress;
mod sample;
mod splats;
mod tile;

//! Leases batches, renders them and sends back their sums.

pub mod beat;
pub mod bring;
pub mod config;
pub mod desk;
pub mod errand;
pub mod flags;
pub mod labour;
pub mod leave;
pub mod log;
pub mod prepared;
pub mod processor;
pub mod renderer;
pub mod run;
pub mod scenes;

#[cfg(test)]
mod mock;

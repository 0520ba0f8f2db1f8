//! A typed HTTP client of the farm: calls, retries, events, files.

pub mod address;
pub mod answer;
pub mod backoff;
pub mod call;
pub mod error;
pub mod events;
pub mod farm;
pub mod file;
pub mod jobs;
pub mod pages;
pub mod scenes;
pub mod sse;
pub mod tls;
pub mod workers;

#[cfg(test)]
mod mock;

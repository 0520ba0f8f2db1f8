//! What a worker is told at its start.

use ovtigre_proto::telemetry::traces::Traces;
use std::path::PathBuf;

/// What a worker is told at its start.
#[derive(Clone, Debug)]
pub struct Config {
    /// The farm's address.
    pub server: String,
    /// What lets it in, where that is needed.
    pub token: Option<String>,
    /// A name for people.
    pub name: String,
    /// Threads to render with, at least 1.
    pub threads: usize,
    /// What it offers.
    pub tags: Vec<String>,
    /// Folder in which scenes are kept; made where it is not there.
    pub cache: PathBuf,
    /// Bytes of scenes that are kept; the longest unused go first.
    pub cache_bytes: u64,
    /// Spreads the waits of many workers; nothing else depends on it.
    pub seed: u64,
    /// Where spans go.
    pub traces: Traces,
}

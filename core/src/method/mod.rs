//! The ways to estimate light, each short, because `path` does the work.

pub mod path;
pub mod radiosity;

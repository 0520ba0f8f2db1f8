//! The command line: one file a command, and what they share.

pub(crate) mod exit;
pub(crate) mod line;
pub(crate) mod terminal;

mod bake;
mod bench;
mod bench_table;
mod cancel;
mod check;
mod compare;
mod completions;
mod embedded;
mod farm_flags;
mod fetch;
mod follow;
mod interrupt;
mod job_flags;
mod keep;
mod local_workers;
mod manual;
mod output;
mod pause;
mod progress;
#[cfg(test)]
mod reference;
mod render;
mod report;
mod resume;
mod scene_file;
mod secret;
mod serve;
mod status;
mod submission;
mod submit;
mod table;
mod token;
mod trial;
mod truth;
mod watch;
mod words;
mod work;
mod workers;

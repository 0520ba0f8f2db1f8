//! A worker's flags, on both command lines that start one.

use crate::{config::Config, leave::Leave};
use clap::Args;
use ovtigre_proto::telemetry::traces::Traces;
use std::{num::NonZeroUsize, path::PathBuf, thread::available_parallelism};

const GIB: u64 = 1 << 30;
/// Threads of a worker, at most.
const THREADS_MAX: usize = 4096;

/// A worker's flags.
#[derive(Args, Clone, Debug)]
pub struct WorkFlags {
    /// The farm's address.
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:7700")]
    pub server: String,
    /// Token that the farm knows [default: `OVTIGRE_TOKEN` of the environment].
    #[arg(long, value_name = "TOKEN")]
    pub token: Option<String>,
    /// Threads to render with [default: one a core].
    #[arg(long, value_name = "N", value_parser = threads)]
    pub threads: Option<NonZeroUsize>,
    /// A name for people [default: the machine's name].
    #[arg(long, value_name = "NAME")]
    pub name: Option<String>,
    /// What this worker offers; repeatable.
    #[arg(long = "tag", value_name = "TAG")]
    pub tags: Vec<String>,
    /// Folder in which scenes are kept [default: ovtigre in the user's cache folder].
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Scenes kept in that folder at most, in GiB.
    #[arg(long, value_name = "GIB", default_value_t = 16)]
    pub cache_size: u64,
    /// On the first SIGTERM, hand back at once what is being rendered instead of finishing it.
    #[arg(long)]
    pub fast: bool,
    /// Leave at once when standard input closes: for a program that starts workers and may be killed.
    #[arg(long)]
    pub until_stdin_closes: bool,
}

impl WorkFlags {
    /// What the first signal means.
    pub fn first_signal(&self) -> Leave {
        if self.fast { Leave::Now } else { Leave::AfterBatch }
    }

    /// What they say, with what the machine says where they do not. `seed` spreads the waits of many
    /// workers.
    pub fn config(&self, seed: u64, traces: Traces) -> Config {
        let cores = available_parallelism().unwrap_or(NonZeroUsize::MIN);
        Config {
            server: self.server.clone(),
            token: self
                .token
                .clone()
                .or_else(|| std::env::var("OVTIGRE_TOKEN").ok())
                .filter(|t| !t.is_empty()),
            name: self.name.clone().unwrap_or_else(machine),
            threads: self.threads.unwrap_or(cores).get(),
            tags: self.tags.clone(),
            cache: self.cache.clone().unwrap_or_else(cache_folder),
            cache_bytes: self.cache_size.saturating_mul(GIB),
            seed,
            traces,
        }
    }
}

/// A number of threads.
pub fn threads(text: &str) -> Result<NonZeroUsize, String> {
    let number = text.parse().ok().filter(|n| (1..=THREADS_MAX).contains(n)).and_then(NonZeroUsize::new);
    number.ok_or_else(|| format!("threads are 1 to {THREADS_MAX}"))
}

/// What is wrong with a command line, as one line: without the usage that follows. Empty where it is help
/// that was asked for.
pub fn usage(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let Some(text) = text.strip_prefix("error: ") else { return String::new() };
    let end = text.find("\n\nUsage:").or_else(|| text.find("\n\nFor more information"));
    let words: Vec<&str> = text[..end.unwrap_or(text.len())].split_whitespace().collect();
    words.join(" ")
}

fn machine() -> String {
    let named = |file| std::fs::read_to_string(file).ok().map(|name: String| name.trim().to_owned());
    named("/proc/sys/kernel/hostname")
        .or_else(|| std::env::var("HOSTNAME").ok())
        .filter(|name| !name.is_empty())
        .unwrap_or_else(|| "worker".to_owned())
}

fn cache_folder() -> PathBuf {
    let set = |name| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    set("XDG_CACHE_HOME")
        .or_else(|| set("HOME").map(|home| home.join(".cache")))
        .unwrap_or_else(std::env::temp_dir)
        .join("ovtigre")
}

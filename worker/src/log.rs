//! The log of a worker or of a farm: for people, or for programs.

use clap::{Args, ValueEnum};
use std::{
    fmt,
    io::{IsTerminal as _, stderr},
};
use tracing_subscriber::EnvFilter;

/// What is logged to standard error, and how.
#[derive(Args, Clone, Debug)]
pub struct LogFlags {
    /// What is logged to stderr: error, warn, info, debug or trace, also for one part such as `ovtigre_worker=debug`.
    #[arg(long = "log", value_name = "FILTER", default_value = "info")]
    pub filter: String,
    /// How it is logged: lines for people, or one JSON object a line for programs, with `job`, `batch`, `lease` and
    /// `worker` where a line is about one.
    #[arg(long = "log-format", value_name = "FORMAT", default_value_t = LogFormat::Text)]
    pub format: LogFormat,
}

/// How the log is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LogFormat {
    /// A line for people.
    Text,
    /// A JSON object.
    Json,
}

impl fmt::Display for LogFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Text => "text",
            Self::Json => "json",
        })
    }
}

impl LogFlags {
    /// Logs from now on. A second call, as in tests, changes nothing.
    pub fn start(&self) {
        let log = tracing_subscriber::fmt().with_env_filter(EnvFilter::new(&self.filter)).with_writer(stderr);
        // Where nobody reads it any more, there is nobody to be told, and no reason to fall.
        let log = log.with_ansi(stderr().is_terminal()).log_internal_errors(false);
        match self.format {
            LogFormat::Text => log.try_init().ok(),
            LogFormat::Json => {
                let log = log.json().flatten_event(true).with_current_span(false).with_span_list(false);
                log.with_ansi(false).try_init().ok()
            }
        };
    }
}

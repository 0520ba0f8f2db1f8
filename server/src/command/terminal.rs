//! Where results and remarks go. A reader that has gone away is no error.

use serde::Serialize;
use std::io::{IsTerminal as _, Write as _, stderr, stdout};

/// A result: a line on standard output.
pub(crate) fn result(line: &str) {
    let mut out = stdout().lock();
    writeln!(out, "{line}").and_then(|()| out.flush()).ok();
}

/// A result as JSON.
pub(crate) fn json<T: Serialize>(document: &T) {
    result(&serde_json::to_string_pretty(document).expect("what is printed is plain data"));
}

/// A remark: a line on standard error.
pub(crate) fn remark(line: &str) {
    writeln!(stderr().lock(), "{line}").ok();
}

/// What went wrong: a line on standard error.
pub(crate) fn error(line: &str) {
    remark(&format!("error: {}", line.replace('\n', " ")));
}

/// Whether remarks are read by a person at a terminal.
pub(crate) fn is_watched() -> bool {
    stderr().is_terminal()
}

/// Logs what `filter` lets through to standard error.
pub(crate) fn log(filter: &str) {
    let filter = tracing_subscriber::EnvFilter::new(filter);
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_ansi(is_watched()).with_writer(stderr);
    // Where nobody reads it any more, there is nobody to be told, and no reason to fall.
    let log = log.log_internal_errors(false);
    // A second call, as in tests, changes nothing.
    log.try_init().ok();
}

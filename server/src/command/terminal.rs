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

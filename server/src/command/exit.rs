//! How a command ends, and why.

use ovtigre_proto::{client::error::ClientError, telemetry::traces::TracesError};
use std::process::ExitCode;

/// How a command ends where it does not end well.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Exit {
    /// Pictures differ by more than is tolerated.
    Different = 1,
    /// Wrong usage or bad scene.
    Wrong = 2,
    /// The farm cannot be reached.
    Unreachable = 3,
    /// The job failed.
    Failed = 4,
    /// Stopped before done.
    Stopped = 5,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// Why a command did not do what it should: one line for the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct CommandError {
    pub(crate) exit: Exit,
    pub(crate) line: String,
}

/// How a command's function ends.
pub(crate) type Outcome<T = ()> = Result<T, CommandError>;

impl CommandError {
    /// Wrong usage or bad scene.
    pub(crate) fn wrong(line: impl Into<String>) -> Self {
        Self { exit: Exit::Wrong, line: line.into() }
    }

    /// The job failed, or what should carry it out.
    pub(crate) fn failed(line: impl Into<String>) -> Self {
        Self { exit: Exit::Failed, line: line.into() }
    }

    /// Stopped before done.
    pub(crate) fn stopped(line: impl Into<String>) -> Self {
        Self { exit: Exit::Stopped, line: line.into() }
    }
}

impl From<TracesError> for CommandError {
    fn from(error: TracesError) -> Self {
        Self::wrong(error.to_string())
    }
}

impl From<ClientError> for CommandError {
    fn from(error: ClientError) -> Self {
        let exit = match &error {
            ClientError::Unreachable { .. }
            | ClientError::Unexpected { .. }
            | ClientError::Damaged { .. } => Exit::Unreachable,
            ClientError::Problem(problem) if problem.status >= 500 => Exit::Failed,
            ClientError::Problem(_) | ClientError::Address { .. } | ClientError::File { .. } => Exit::Wrong,
        };
        Self { exit, line: error.to_string() }
    }
}

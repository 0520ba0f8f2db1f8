//! Why a call of the farm brought nothing.

use crate::problem::Problem;
use std::{error::Error, path::PathBuf};

/// Why a call of the farm brought nothing.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// Nobody answered, or the connection broke, as often as it was tried.
    #[error("the farm at {farm} cannot be reached: {reason}")]
    Unreachable {
        /// Its address.
        farm: String,
        /// What the last try met.
        reason: String,
    },
    /// The farm said no, and why.
    #[error("{}", .0.line())]
    Problem(Box<Problem>),
    /// The answer is not one of a farm's.
    #[error("unexpected answer to {call}: {reason}; is there an ovtigre farm at this address?")]
    Unexpected {
        /// Method and address.
        call: String,
        /// Its HTTP status, where that is what was unexpected.
        status: Option<u16>,
        /// What is wrong with it.
        reason: String,
    },
    /// The address is not one that can be called.
    #[error("'{text}' is not a farm's address: {reason}")]
    Address {
        /// As given.
        text: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A file on this side cannot be read or written.
    #[error("{}: {reason}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// Bytes arrived that are not those that were asked for.
    #[error("the bytes from {call} do not have the hash they were asked for by")]
    Damaged {
        /// Method and address.
        call: String,
    },
}

impl ClientError {
    /// The HTTP status of a refusal, where it is one.
    pub fn status(&self) -> Option<u16> {
        match self {
            Self::Problem(problem) => Some(problem.status),
            Self::Unexpected { status, .. } => *status,
            _ => None,
        }
    }

    /// Whether the same call may succeed later without anything being changed on this side.
    pub fn may_pass(&self) -> bool {
        match self {
            Self::Unreachable { .. } | Self::Damaged { .. } => true,
            Self::Problem(_) | Self::Unexpected { .. } => {
                self.status().is_some_and(|status| status == 429 || status >= 500)
            }
            Self::Address { .. } | Self::File { .. } => false,
        }
    }
}

/// The innermost cause: the outer layers only say that sending failed.
pub(super) fn innermost(error: &dyn Error) -> String {
    let mut cause = error;
    while let Some(inner) = cause.source() {
        cause = inner;
    }
    cause.to_string()
}

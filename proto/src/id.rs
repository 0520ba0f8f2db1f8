//! Names of things: newtypes, checked when made.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// A text that names nothing of its kind.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("'{text}' is not {kind}")]
pub struct IdError {
    text: String,
    kind: &'static str,
}

macro_rules! id {
    ($(#[$doc:meta])* $name:ident, $kind:literal, $pattern:literal, $check:expr) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
        #[serde(try_from = "String", into = "String")]
        #[schemars(with = "String", extend("pattern" = $pattern))]
        pub struct $name(String);

        impl $name {
            /// The name as text.
            pub fn as_str(&self) -> &str {
                &self.0
            }
        }

        impl FromStr for $name {
            type Err = IdError;

            fn from_str(text: &str) -> Result<Self, IdError> {
                let check: fn(&str) -> bool = $check;
                if check(text) { Ok(Self(text.to_owned())) } else { Err(IdError { text: text.chars().take(80).collect(), kind: $kind }) }
            }
        }

        impl TryFrom<String> for $name {
            type Error = IdError;

            fn try_from(text: String) -> Result<Self, IdError> {
                text.parse()
            }
        }

        impl From<$name> for String {
            fn from(id: $name) -> Self {
                id.0
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&self.0)
            }
        }
    };
}

fn is_hex(text: &str, length: usize) -> bool {
    text.len() == length && text.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'))
}

fn is_short(text: &str) -> bool {
    (1..=64).contains(&text.len())
        && text.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-' || b == b'_')
}

id!(
    /// The BLAKE3 hash of an uploaded file's bytes, 64 hexadecimal digits.
    BlobId, "a BLAKE3 hash of 64 hexadecimal digits", "^[0-9a-f]{64}$", |t| is_hex(t, 64)
);
id!(
    /// A job.
    JobId, "a job's id", "^[A-Za-z0-9_-]{1,64}$", is_short
);
id!(
    /// A worker, from its joining until it leaves.
    WorkerId, "a worker's id", "^[A-Za-z0-9_-]{1,64}$", is_short
);
id!(
    /// A batch handed to a worker for a while.
    LeaseId, "a lease's id", "^[A-Za-z0-9_-]{1,64}$", is_short
);

impl LeaseId {
    /// The job, and the numbers of region, replicate and block, that a farm's lease was handed out for: they are in its
    /// name, `JOB_REGION_REPLICATE_BLOCK_NONCE`.
    pub fn batch(&self) -> Option<(JobId, [u32; 3])> {
        let mut parts = self.0.rsplitn(5, '_').skip(1);
        let mut number = || parts.next()?.parse().ok();
        let (block, replicate, region) = (number()?, number()?, number()?);
        Some((parts.next()?.parse().ok()?, [region, replicate, block]))
    }
}

impl BlobId {
    /// The name of `bytes`.
    pub fn of(hash: [u8; 32]) -> Self {
        use fmt::Write as _;
        let mut text = String::with_capacity(64);
        for byte in hash {
            write!(text, "{byte:02x}").expect("writing to a string cannot fail");
        }
        Self(text)
    }
}

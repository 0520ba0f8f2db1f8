//! What a render needs, and what it leaves out.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Of what the program can do, what a render needs, and what it leaves out.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Needs {
    /// What it needs.
    pub needed: Vec<String>,
    /// What it leaves out.
    pub left_out: Vec<LeftOut>,
}

/// Something that a render leaves out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct LeftOut {
    /// What.
    pub what: String,
    /// Why it is not needed.
    pub why: String,
}

//! How a solution was found.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a solution was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RadiosityReport {
    /// `radiosity` for equations, `light` for particles from the lights.
    pub method: String,
    /// Patches; each has two sides, which are the elements.
    pub patches: usize,
    /// Pairs of elements that see each other; none for particles.
    pub links: usize,
    /// Rays that were traced, those of coarser patches before included.
    pub rays: u64,
    /// How often patches were cut where light varies.
    pub refinements: u32,
    /// Iterations of the last system.
    pub iterations: usize,
    /// For each of them, how much radiosity it added, relative to what is there.
    pub residuals: Vec<f64>,
    /// Always false: patches of finite size have an error that no spread between replicates shows.
    pub certified: bool,
}

//! A vertex of a light subpath that eye subpaths can be joined to.

use crate::path::media::Media;
use crate::path::mis::exhaustive::Link;
use crate::path::mis::partial::Partial;
use crate::path::survival::Survival;
use crate::path::vertex::{Cast, Vertex};

/// A vertex of a light subpath that eye subpaths can be joined to.
#[derive(Clone, Debug)]
pub struct LightVertex<'a, T> {
    /// Where.
    pub vertex: Vertex<'a>,
    /// What arrives.
    pub carried: T,
    /// What techniques are behind it.
    pub partial: Partial,
    /// The solids that light arrived through.
    pub media: Media,
    /// Vertices of the light subpath up to here, the light included.
    pub vertices: usize,
    /// What the first surface makes of light.
    pub cast: Cast,
    /// What roulette has done up to here, where squares are told.
    pub survival: Option<Box<Survival>>,
    /// All of them, where weights need that.
    pub links: Vec<Link>,
    /// How its light is found otherwise.
    pub start: LightStart,
}

/// How the light that a subpath starts from is found otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightStart {
    /// Density of a next event from the second vertex to the first.
    pub next_event: f64,
    /// Whether it has extent, so that a ray can hit it.
    pub is_hit: bool,
}

//! The weight of each kind of joint from the partial sums of its subpaths.

use crate::path::mis::heuristic::Heuristic;
use crate::path::mis::partial::Partial;

/// Of light that an eye subpath hits. `next_event` is the density with which a next event at the vertex before picks the
/// point, `emitted` that with which light starts there and goes to the vertex before, both in the measure of the eye's own
/// density (see [`Partial`]).
#[inline]
pub fn hit(h: Heuristic, eye: &Partial, next_event: f64, emitted: f64) -> f64 {
    1.0 / (1.0 + h.of(next_event) * eye.near + h.of(emitted) * eye.far)
}

/// Densities around a next event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextEventDensities {
    /// With which the vertex's own sampling hits the light, over that of the next event; 0 for a light without extent.
    pub hit: f64,
    /// With which emission picks the place, over that of the next event.
    pub picked: f64,
    /// Over area, with which emission from there reaches the vertex.
    pub first_edge: f64,
    /// Over solid angle, with which light from there goes on the way the eye subpath came.
    pub reverse: f64,
}

/// Of a next event at a vertex of an eye subpath.
#[inline]
pub fn next_event(h: Heuristic, eye: &Partial, d: &NextEventDensities) -> f64 {
    let longer = h.of(d.picked) * eye.behind(h, d.first_edge, d.reverse);
    1.0 / (h.of(d.hit) + 1.0 + longer)
}

/// Densities of two joined vertices as seen from each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bridge {
    /// Over area, with which the eye subpath would make the light's vertex.
    pub onto_light: f64,
    /// Over solid angle, with which it would go on from there the way the light subpath came.
    pub light_reverse: f64,
    /// Over area, with which the light subpath would make the eye's vertex.
    pub onto_eye: f64,
    /// Over solid angle, with which it would go on from there the way the eye subpath came.
    pub eye_reverse: f64,
}

/// Of two subpaths joined between surfaces.
#[inline]
pub fn join(h: Heuristic, light: &Partial, eye: &Partial, bridge: &Bridge) -> f64 {
    let shorter = light.behind(h, bridge.onto_light, bridge.light_reverse);
    let longer = eye.behind(h, bridge.onto_eye, bridge.eye_reverse);
    1.0 / (shorter + 1.0 + longer)
}

/// Of a light subpath joined to the lens. `from_eye` is the density over area with which a pixel's ray meets its last
/// vertex, divided by the number of light subpaths; `reverse` that over solid angle with which it goes on to the one before.
#[inline]
pub fn to_lens(h: Heuristic, light: &Partial, from_eye: f64, reverse: f64) -> f64 {
    1.0 / (1.0 + light.behind(h, from_eye, reverse))
}

/// Of a light joined to the lens. `from_eye` is the density with which a pixel's ray hits the place, over that of the place
/// and the number of light subpaths.
#[inline]
pub fn light_to_lens(h: Heuristic, from_eye: f64) -> f64 {
    1.0 / (1.0 + h.of(from_eye))
}

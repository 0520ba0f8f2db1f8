//! A photon, and the walk that leaves it.

use crate::path::light::{Keeps, from_light};
use crate::path::rules::Rules;
use crate::path::tally::Tally;
use crate::path::throughput::Carriage;
use crate::sampler::Sampler;
use crate::scene::Scene;
use crate::trace::moment::Moment;
use glam::Vec3;

/// Light that arrived at a surface.
#[derive(Clone, Debug)]
pub struct Photon<T> {
    /// Where.
    pub position: Vec3,
    /// Unit direction it came from.
    pub from: Vec3,
    /// Unit geometric normal there.
    pub ng: Vec3,
    /// Flux, W, by state.
    pub carried: T,
    /// Scatterings before.
    pub scatterings: u32,
}

/// Photons of one light subpath where it met rough surfaces; direct light is left to next events.
pub fn photons<'a, C: Carriage>(
    scene: &'a Scene,
    rules: &'a Rules,
    sampler: (&'a Sampler, Moment),
    tally: &mut Tally,
) -> Vec<Photon<C::Light>> {
    let vertices = from_light::<C>(scene, rules, sampler, Keeps::Vertices, tally);
    let indirect = vertices.into_iter().filter(|v| v.vertices > 2);
    indirect
        .map(|v| Photon {
            position: v.vertex.at.position,
            from: v.vertex.back(),
            ng: v.vertex.at.ng,
            carried: v.carried,
            scatterings: v.vertices as u32 - 2,
        })
        .collect()
}

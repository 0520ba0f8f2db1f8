//! The walk from the eye that gathers photons.

use crate::bsdf::event::Transport;
use crate::path::connect::hit::{hit_environment, hit_surface};
use crate::path::connect::next_event::next_event;
use crate::path::expression::language::EyeState;
use crate::path::photons::map::PhotonMap;
use crate::path::tally::{Receiver, Tally};
use crate::path::throughput::{Carriage, Throughput};
use crate::path::vertex::{Density, Vertex, Weight};
use crate::path::walk::{Visitor, Walk};
use crate::scene::interaction::Interaction;
use core::f32::consts::PI;
use glam::Vec3;

/// Photons on surfaces whose normals differ by more than 45° are not gathered: they lie around an edge.
const ALIGNED: f32 = 0.7;

/// Direct light by next events and hits, all other light from photons at rough surfaces. Goes on through ideally specular
/// lobes, and by one ray from others to hit lights.
#[derive(Debug)]
pub struct Gather<'m, C: Carriage> {
    /// The photons of this pass.
    pub map: &'m PhotonMap<C::Light>,
}

impl<'a, C: Carriage> Visitor<'a, EyeState, C::Eye> for Gather<'_, C>
where
    C::Light: Send,
{
    const TWO_WAY: bool = false;

    fn escapes(&mut self, walk: &Walk<'a, EyeState, C::Eye>, tally: &mut Tally) {
        hit_environment::<C::Eye, C::Light>(walk, tally);
    }

    fn arrives(
        &mut self,
        walk: &mut Walk<'a, EyeState, C::Eye>,
        at: &Interaction<'a>,
        triangle: (u32, u32),
        tally: &mut Tally,
    ) {
        hit_surface::<C::Eye, C::Light>(walk, at, triangle, tally);
    }

    fn goes_on(&self, walk: &Walk<'a, EyeState, C::Eye>) -> bool {
        walk.scatterings == 0 || walk.edge.density == Density::Delta
    }

    fn scatters(&mut self, walk: &Walk<'a, EyeState, C::Eye>, vertex: &Vertex<'a>, tally: &mut Tally) {
        if vertex.is_smooth() {
            next_event::<C::Eye, C::Light>(walk, vertex, tally);
            self.gather(walk, vertex, tally);
        }
    }
}

impl<C: Carriage> Gather<'_, C>
where
    C::Light: Send,
{
    /// Light of the photons within the radius: flux over the area of the disk, times f. What `evaluate` says has a cosine in
    /// it, which photons have by arriving: it is divided by that of their own surface, which says how many of them come.
    /// Where normals are smooth, that of the vertex can be next to nothing for many.
    fn gather(&self, walk: &Walk<'_, EyeState, C::Eye>, vertex: &Vertex<'_>, tally: &mut Tally) {
        let rules = walk.rules;
        let squared_radius = self.map.radius() * self.map.radius();
        let density = 1.0 / (PI * squared_radius * rules.light_paths as f32);
        self.map.around(vertex.at.position, |photon, squared| {
            let scatterings = walk.scatterings + 1 + photon.scatterings;
            let cos = photon.from.dot(photon.ng).abs();
            if scatterings > rules.bounces || vertex.at.ng.dot(photon.ng) < ALIGNED || cos == 0.0 {
                return;
            }
            let (value, _) = vertex.evaluate(photon.from, Transport::Radiance);
            let eye = walk.carried.scattered(&rules.language, Weight::Smooth(value));
            let factor = Vec3::splat(density / cos);
            let technique = (photon.scatterings as usize + 2, walk.scatterings as usize + 2);
            let narrow = if 2.0 * squared < squared_radius { 2.0 * factor } else { Vec3::ZERO };
            let carried = &photon.carried;
            tally.deposit_gathered(rules, Receiver::Own, technique, &eye, carried, [factor, narrow]);
        });
    }
}

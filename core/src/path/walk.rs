//! A walk from the eye or from a light: what each ray finds, and where it goes on.

use crate::bsdf::event::Transport;
use crate::math::colour::Rgb;
use crate::math::cosine::{cosine, squared_distance};
use crate::path::connect::light_vertex::LightStart;
use crate::path::media::Media;
use crate::path::mis::exhaustive::{Ends, Link};
use crate::path::mis::partial::Partial;
use crate::path::rules::{Rules, Weighing};
use crate::path::survival::{ROULETTE_FROM, Survival, turned};
use crate::path::tally::Tally;
use crate::path::throughput::{State, Throughput};
use crate::path::vertex::{Cast, Continuation, Crossing, Density, Vertex};
use crate::sampler::{Dimension, Sampler, ScatteringNumbers, Use};
use crate::scene::Scene;
use crate::scene::interaction::Interaction;
use crate::scene::lit::Lit;
use crate::scene::view::View;
use crate::trace::ray::Ray;
use core::marker::PhantomData;
use glam::Vec3;

/// Ideally specular scatterings in a row from which on a walk is also ended with probability 2 / n at its n-th: a walk that
/// clear glass has trapped by total reflection loses nothing and would never end. The chance to reach n falls as n⁻², so a
/// trapped walk ends after about twice this number on average, and the variance stays finite for every albedo below one,
/// which a constant probability does not achieve.
const TRAPPED: u32 = 2048;

/// The same for scatterings of any kind, which end where nothing is lost at all, as in a closed white room. Mean walks of a
/// room of reflectance ρ have 1 / (1 − ρ) scatterings; those that are much longer than this number have a relative error
/// of 2 / (LONG (1 − ρ)) instead of one, 0.6 for ρ = 0.9999; from 2,048 on it would be 9.8.
const LONG: u32 = 1 << 15;

/// A walk, between two vertices.
#[derive(Clone, Debug)]
pub struct Walk<'a, S: State, T: Throughput<S>> {
    /// Where it is.
    pub scene: &'a Scene,
    /// What counts.
    pub rules: &'a Rules,
    /// Its numbers.
    pub sampler: &'a Sampler,
    /// Its numbers at the vertex that it is at.
    pub numbers: ScatteringNumbers,
    /// Where it goes.
    pub edge: Edge,
    /// What a unit of light (from the eye) or of importance (from a light) at its end counts at its start.
    pub carried: T,
    /// What techniques are behind it.
    pub partial: Partial,
    /// The solids it is inside of.
    pub media: Media,
    /// Scatterings so far.
    pub scatterings: u32,
    /// The last of them that were ideally specular, in a row.
    mirrored: u32,
    /// Whether all of them were ideally specular.
    pub sight: Sight,
    /// Its vertices so far, where weights are computed from all of them.
    pub links: Vec<Link>,
    /// What the surface behind makes of light, where weights ask for that.
    pub cast: Cast,
    /// What roulette has done to it.
    pub survival: Survival,
    transport: Transport,
    /// The part of its throughput that is due to refraction: it comes back when the path leaves.
    eta_squared: f32,
    /// One over the throughput it began with.
    scale: f32,
    state: PhantomData<S>,
}

/// Whether a walk goes as one looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sight {
    /// Straight, or by ideally specular lobes only.
    Clear,
    /// A smooth lobe has scattered it.
    Scattered,
}

/// The edge that a walk is on.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// The ray.
    pub ray: Ray,
    /// The point that its direction was chosen at.
    pub from: Lit,
    /// |cos θ| there; one at points and for light from infinitely far.
    pub cos: f64,
    /// How it was chosen.
    pub density: Density,
    /// Over what.
    pub kind: EdgeKind,
}

/// What the density of an edge is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeKind {
    /// Directions at a point.
    Directions,
    /// Places of parallel rays: the first edge from infinitely far, or from an orthographic camera.
    Parallel,
}

/// What happens on a walk.
pub trait Visitor<'a, S: State, T: Throughput<S>> {
    /// Whether weights need the densities of the way back.
    const TWO_WAY: bool;

    /// The ray goes as far as `t_max`; nothing of what it meets there counts yet.
    fn flies(&mut self, _: &Walk<'a, S, T>, _t_max: f32, _: &mut Tally) {}

    /// The ray left the scene.
    fn escapes(&mut self, _: &Walk<'a, S, T>, _: &mut Tally) {}

    /// The ray met a surface. `walk.partial` counts up to here.
    fn arrives(
        &mut self,
        walk: &mut Walk<'a, S, T>,
        at: &Interaction<'a>,
        triangle: (u32, u32),
        tally: &mut Tally,
    );

    /// Whether the surface's scattering is of interest.
    fn goes_on(&self, _: &Walk<'a, S, T>) -> bool {
        true
    }

    /// The surface scatters.
    fn scatters(&mut self, walk: &Walk<'a, S, T>, vertex: &Vertex<'a>, tally: &mut Tally);

    /// Whether where the walk goes on from there is of interest.
    fn leaves(&self, _: &Walk<'a, S, T>, _: &Vertex<'a>) -> bool {
        true
    }
}

impl<'a, S: State, T: Throughput<S>> Walk<'a, S, T> {
    /// A walk along its first edge.
    pub fn new(
        (scene, rules, sampler): (&'a Scene, &'a Rules, &'a Sampler),
        transport: Transport,
        edge: Edge,
        carried: T,
        partial: Partial,
    ) -> Self {
        let scale = 1.0 / carried.total().max_element().max(f32::MIN_POSITIVE);
        Self {
            scene,
            rules,
            sampler,
            numbers: ScatteringNumbers::default(),
            edge,
            carried,
            partial,
            media: Media::VACUUM,
            scatterings: 0,
            mirrored: 0,
            sight: Sight::Clear,
            links: Vec::new(),
            cast: Cast::Diffuse,
            survival: Survival::SURE,
            transport,
            eta_squared: 1.0,
            scale,
            state: PhantomData,
        }
    }

    /// Goes on until roulette, the rules or the scene end it.
    pub fn run(mut self, visitor: &mut impl Visitor<'a, S, T>, tally: &mut Tally) {
        loop {
            tally.rays += 1;
            let key = || self.sampler.key(self.dimension(Use::Alpha));
            let Some(hit) = self.scene.closest(&self.edge.ray, key) else {
                visitor.flies(&self, f32::INFINITY, tally);
                visitor.escapes(&self, tally);
                return;
            };
            let at = self.scene.data.interaction(
                hit.instance,
                hit.triangle,
                hit.barycentric,
                self.edge.ray.moment,
            );
            visitor.flies(&self, (at.position - self.edge.ray.origin).length(), tally);
            self.arrive(&at);
            visitor.arrives(&mut self, &at, (hit.instance, hit.triangle), tally);
            if self.scatterings >= self.rules.bounces || !visitor.goes_on(&self) {
                return;
            }
            let Some(vertex) = Vertex::new(at, -self.edge.ray.direction, self.rules) else { return };
            self.numbers = self.sampler.scattering(|what| self.dimension(what));
            visitor.scatters(&self, &vertex, tally);
            if !visitor.leaves(&self, &vertex) || !self.scatter(&vertex, visitor) {
                return;
            }
        }
    }

    /// The dimension of a number at the next scattering.
    pub fn dimension(&self, what: Use) -> Dimension {
        match self.transport {
            Transport::Radiance => Dimension::Eye(self.scatterings, what),
            Transport::Importance => Dimension::Light(self.scatterings, what),
        }
    }

    /// What is behind the surface that the walk is at where two surfaces are never joined: only the techniques of its first two vertices.
    pub fn without_inner_joints(&self) -> Partial {
        let near = if self.scatterings == 0 { self.partial.near } else { 0.0 };
        Partial { near, ..self.partial }
    }

    /// Whether weights are computed from all densities.
    pub fn keeps_links(&self) -> bool {
        matches!(self.rules.weighing, Weighing::Chosen(_)) || self.rules.tells_squares()
    }

    /// From where the scene is seen at the walk's moment.
    pub fn view(&self) -> View {
        self.scene.view(self.edge.ray.moment)
    }

    /// Density of a place on the lens, where it has extent.
    pub fn lens(&self) -> Option<f64> {
        self.view().lens_pdf()
    }

    /// What the ends of a path admit that begins at a light like this.
    pub fn ends(&self, start: LightStart) -> Ends {
        Ends {
            next_event: start.next_event,
            light_is_hit: start.is_hit,
            lens: self.lens(),
            light_paths: self.rules.light_paths,
        }
    }

    /// Squared length of the edge up to `position`, or one where its density is over places.
    pub fn squared(&self, position: Vec3) -> f64 {
        match self.edge.kind {
            EdgeKind::Directions => squared_distance(position, self.edge.from.point),
            EdgeKind::Parallel => 1.0,
        }
    }

    /// Reaches a surface.
    pub(in crate::path) fn arrive(&mut self, at: &Interaction<'_>) {
        let back = -self.edge.ray.direction;
        let distance = (at.position - self.edge.ray.origin).length();
        self.carried.scale(self.media.transmittance_to(distance, at, back));
        let (squared, cos) = (self.squared(at.position), cosine(back, at.ng));
        self.partial.arrive(self.rules.heuristic(), squared, cos);
        if self.keeps_links() {
            let forward = self.edge.density.over_solid_angle() * cos / squared;
            let jacobian = self.edge.cos / squared;
            self.links.push(Link { forward, reverse: 0.0, jacobian, specular: false });
        }
    }

    /// Goes on from `vertex`; false where the walk ends. Roulette survives with min(1, throughput without the
    /// factors of refraction): never capped, since a cap below 1 has infinite variance where albedos are near one.
    fn scatter<V: Visitor<'a, S, T>>(&mut self, vertex: &Vertex<'_>, _: &V) -> bool {
        let (choice, u) = (self.numbers.choice(), self.numbers.direction());
        let Some(next) = vertex.sample(choice.x, u, self.transport) else { return false };
        self.carried = self.carried.scattered(&self.rules.language, next.weight);
        if self.carried.is_dead() {
            return false;
        }
        self.eta_squared *= match self.transport {
            Transport::Radiance => next.eta * next.eta,
            Transport::Importance => 1.0,
        };
        self.scatterings += 1;
        if next.density == Density::Delta {
            self.mirrored += 1;
        } else {
            (self.sight, self.mirrored) = (Sight::Scattered, 0);
        }
        if self.scatterings < ROULETTE_FROM {
            self.survival.scatter(1.0);
        } else if !self.survives(choice.y) {
            return false;
        }
        self.follow::<V>(vertex, &next);
        true
    }

    /// Takes the edge that a continuation leads to.
    pub(in crate::path) fn follow<V: Visitor<'a, S, T>>(&mut self, vertex: &Vertex<'_>, next: &Continuation) {
        let Continuation { direction, density, crossing, weight, .. } = *next;
        let cos = vertex.cos(direction);
        let reverse = self.look_back::<V>(vertex, direction, density, cos);
        if self.rules.tells_squares() {
            self.survival.turned.push(match density {
                Density::SolidAngle(forward) => {
                    turned(weight.total(), [f64::from(forward), reverse], [cos, vertex.cos(vertex.back())])
                }
                Density::Delta => weight.total(),
            });
        }
        if crossing == Crossing::Crosses {
            self.media.cross(&vertex.at, direction);
        }
        let ray = vertex.ray(direction);
        self.edge = Edge { ray, from: vertex.lit(), cos, density, kind: EdgeKind::Directions };
    }

    /// What it carries over what it began with, without the factors of refraction.
    pub fn throughput(&self) -> Rgb {
        self.carried.total() * (self.eta_squared * self.scale)
    }

    fn survives(&mut self, u: f32) -> bool {
        let throughput = self.carried.total().max_element() * self.eta_squared * self.scale;
        let mut survival = throughput.min(1.0);
        for (count, most) in [(self.mirrored, TRAPPED), (self.scatterings, LONG)] {
            if count >= most {
                survival *= 1.0 - 2.0 / count as f32;
            }
        }
        // What is beyond the range of numbers is so after every loss, too, and would go on to the last scattering.
        if u >= survival || !throughput.is_finite() {
            return false;
        }
        self.carried.scale(Rgb::splat(1.0 / survival));
        self.survival.scatter(survival);
        true
    }

    /// What weights keep of a scattering. Returns the density over solid angle of the way it came, where weights ask for that.
    fn look_back<V: Visitor<'a, S, T>>(
        &mut self,
        vertex: &Vertex<'_>,
        direction: Vec3,
        density: Density,
        cos: f64,
    ) -> f64 {
        let h = self.rules.heuristic();
        if self.rules.tells_squares() {
            self.cast = vertex.cast();
        }
        if matches!(self.rules.weighing, Weighing::Caustics) {
            self.cast = vertex.cast();
            if self.scatterings > 1 {
                self.partial.near = 0.0;
            }
        }
        let Density::SolidAngle(forward) = density else {
            self.partial.scatter_specular(h, cos);
            self.remember(1.0, density);
            return 1.0;
        };
        let reverse = if V::TWO_WAY { f64::from(vertex.reverse_pdf(direction)) } else { 0.0 };
        self.partial.scatter(h, f64::from(forward), reverse, cos);
        self.remember(reverse, density);
        reverse
    }

    fn remember(&mut self, reverse: f64, density: Density) {
        let Some(last) = self.links.len().checked_sub(1) else { return };
        self.links[last].specular = density == Density::Delta;
        if let Some(before) = last.checked_sub(1) {
            self.links[before].reverse = reverse * self.links[last].jacobian;
        }
    }
}

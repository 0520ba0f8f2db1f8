//! Random paths: the recursion against all densities written out.

use super::exhaustive::{Chosen, Ends, PathDensity, is_able, log_densities, log_density};
use super::heuristic::Heuristic;
use super::partial::Partial;
use super::recursive::{self, Bridge, NextEventDensities};
use crate::sampler::{Dimension, Sampler, Use};
use crate::settings::Weights;

/// A vertex of a random path, from the light to the lens, with densities over solid angle.
#[derive(Clone, Copy, Debug)]
struct Random {
    /// Squared distance to the next vertex.
    squared: f64,
    /// |cos θ| towards the light and towards the eye.
    cos: [f64; 2],
    /// Density of going on to the eye, and to the light.
    pdf: [f64; 2],
    specular: bool,
}

/// How the light of a random path is found.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Light {
    Surface,
    Point,
    Sky,
    Sun,
}

struct Path {
    light: Light,
    vertices: Vec<Random>,
    /// Density of the place on the light, of a next event to it from the second vertex, and of the first edge.
    place: f64,
    next_event: f64,
    emission: f64,
    light_paths: f64,
}

struct Numbers {
    sampler: Sampler,
    next: u32,
}

impl Numbers {
    fn uniform(&mut self) -> f64 {
        self.next += 1;
        f64::from(self.sampler.pair(Dimension::Eye(self.next, Use::Choice)).x)
    }

    /// Between 10⁻ᵈ and 10ᵈ.
    fn wide(&mut self, d: f64) -> f64 {
        libm::exp10((2.0 * self.uniform() - 1.0) * d)
    }
}

/// A path of `count` vertices; every second one is narrow as a mirror of α = 10⁻³ where `narrow` says so.
fn random(count: usize, narrow: bool, numbers: &mut Numbers) -> Path {
    let light = [Light::Surface, Light::Point, Light::Sky, Light::Sun][(numbers.uniform() * 4.0) as usize];
    let vertices = (0..count)
        .map(|i| {
            let glossy = narrow && i % 2 == 1;
            let specular = !narrow && i > 0 && i + 1 < count && numbers.uniform() < 0.3;
            let pdf = if glossy { 3e5 * numbers.wide(0.5) } else { numbers.wide(1.0) };
            let pdf = if specular { [1.0; 2] } else { [pdf, pdf * numbers.wide(0.3)] };
            let cos = [0; 2].map(|_| 1e-3 + numbers.uniform());
            Random { squared: numbers.wide(2.0), cos, pdf, specular }
        })
        .collect();
    let place = numbers.wide(3.0);
    let next_event = match light {
        Light::Surface => place * numbers.wide(1.0),
        _ => place,
    };
    Path { light, vertices, place, next_event, emission: numbers.wide(1.0), light_paths: 1e4 }
}

impl Path {
    fn distant(&self) -> bool {
        matches!(self.light, Light::Sky | Light::Sun)
    }

    fn is_hit(&self) -> bool {
        matches!(self.light, Light::Surface | Light::Sky)
    }

    /// Cosine at the light.
    fn light_cos(&self) -> f64 {
        if self.light == Light::Surface { self.vertices[0].cos[1] } else { 1.0 }
    }

    /// Squared length of the edge from vertex `i` to the next; 1 where it comes from infinitely far.
    fn squared(&self, i: usize) -> f64 {
        if i == 0 && self.distant() { 1.0 } else { self.vertices[i].squared }
    }

    /// Density over area of vertex `i` from the light's side.
    fn density_from_light(&self, i: usize) -> f64 {
        if i == 0 {
            return self.place;
        }
        let pdf = if i == 1 { self.emission } else { self.vertices[i - 1].pdf[0] };
        pdf * self.vertices[i].cos[0] / self.squared(i - 1)
    }

    /// Density over area of vertex `i` from the eye's side.
    fn density_from_eye(&self, i: usize) -> f64 {
        let cos = if i == 0 { self.light_cos() } else { self.vertices[i].cos[1] };
        self.vertices[i + 1].pdf[1] * cos / self.squared(i)
    }

    fn densities(&self) -> (Vec<PathDensity>, Ends) {
        let last = self.vertices.len() - 1;
        let one = |i: usize| PathDensity {
            from_light: self.density_from_light(i),
            from_eye: if i == last { 1.0 } else { self.density_from_eye(i) },
            specular: self.vertices[i].specular,
        };
        let ends = Ends {
            next_event: self.next_event,
            light_is_hit: self.is_hit(),
            lens: None,
            light_paths: self.light_paths,
        };
        ((0..=last).map(one).collect(), ends)
    }

    /// What the walk from the light has at each of its vertices from the second on.
    fn light_partials(&self, h: Heuristic) -> Vec<Partial> {
        let far = if self.is_hit() { h.of(self.light_cos() / (self.place * self.emission)) } else { 0.0 };
        let near = h.of(self.next_event / self.place) * h.of(1.0 / self.emission);
        let mut partial = Partial { near, far };
        let mut all = vec![Partial::default()];
        for i in 1..self.vertices.len() - 1 {
            let v = self.vertices[i];
            partial.arrive(h, self.squared(i - 1), v.cos[0]);
            all.push(partial);
            if v.specular {
                partial.scatter_specular(h, v.cos[1]);
            } else {
                partial.scatter(h, v.pdf[0], v.pdf[1], v.cos[1]);
            }
        }
        all
    }

    /// What the walk from the eye has at each of its vertices, numbered from the light; it arrives at the first, too.
    fn eye_partials(&self, h: Heuristic) -> Vec<Partial> {
        let last = self.vertices.len() - 1;
        let mut partial = Partial { near: h.of(self.light_paths / self.vertices[last].pdf[1]), far: 0.0 };
        let mut all = vec![Partial::default(); last + 1];
        for i in (0..last).rev() {
            let v = self.vertices[i];
            if i > 0 || !self.distant() {
                let cos = if i == 0 { self.light_cos() } else { v.cos[1] };
                partial.arrive(h, self.squared(i), cos);
            }
            all[i] = partial;
            if v.specular {
                partial.scatter_specular(h, v.cos[0]);
            } else {
                partial.scatter(h, v.pdf[1], v.pdf[0], v.cos[0]);
            }
        }
        all
    }

    /// The weight by recursion of the technique with `s` vertices from the light.
    fn recursive(&self, h: Heuristic, s: usize, light: &[Partial], eye: &[Partial]) -> f64 {
        let (n, v) = (self.vertices.len(), &self.vertices);
        if s == 0 {
            // What the eye's last density is over: solid angle from infinitely far.
            return recursive::hit(h, &eye[0], self.next_event, self.place * self.emission);
        }
        if n - s == 1 {
            let from_eye = self.density_from_eye(s - 1) / self.light_paths;
            return recursive::to_lens(h, &light[s - 1], from_eye, v[s - 1].pdf[1]);
        }
        if s == 1 {
            let densities = NextEventDensities {
                hit: if self.is_hit() { self.density_from_eye(0) / self.next_event } else { 0.0 },
                picked: self.place / self.next_event,
                first_edge: self.density_from_light(1),
                reverse: v[1].pdf[0],
            };
            return recursive::next_event(h, &eye[1], &densities);
        }
        let bridge = Bridge {
            onto_light: self.density_from_eye(s - 1),
            light_reverse: v[s - 1].pdf[1],
            onto_eye: self.density_from_light(s),
            eye_reverse: v[s].pdf[0],
        };
        recursive::join(h, &light[s - 1], &eye[s], &bridge)
    }
}

fn check(count: usize, narrow: bool, seed: u32) {
    let mut numbers =
        Numbers { sampler: Sampler::new(5, 0, [count as u32, u32::from(narrow)], seed), next: 0 };
    let path = random(count, narrow, &mut numbers);
    let (densities, ends) = path.densities();
    for (s, at_once) in log_densities(&densities, &ends).into_iter().enumerate() {
        let able = is_able(&densities, &ends, s);
        let one = if able { log_density(&densities, &ends, s) } else { f64::NEG_INFINITY };
        let close = (at_once - one).abs() <= 1e-12 * (1.0 + one.abs()) || at_once == one;
        assert!(close, "{count} s = {s}: {at_once} {one}");
    }
    for (h, weights) in [(Heuristic::Balance, Weights::Balance), (Heuristic::Power, Weights::Power)] {
        let chosen = Chosen::new(Vec::new(), weights);
        let (light, eye) = (path.light_partials(h), path.eye_partials(h));
        let (mut sum, mut able) = (0.0, 0);
        for s in (0..count).filter(|s| is_able(&densities, &ends, *s)) {
            let recursive = path.recursive(h, s, &light, &eye);
            let exhaustive = chosen.weight(&densities, &ends, s);
            let close = (recursive - exhaustive).abs() <= 1e-6 * exhaustive + 1e-300;
            assert!(recursive.is_finite() && close, "{h:?} {count} s = {s}: {recursive} {exhaustive}");
            sum += recursive;
            able += 1;
        }
        assert!(able == 0 || (sum - 1.0).abs() < 1e-9, "{h:?} {count}: {sum}");
    }
}

#[test]
fn weights_of_short_paths_are_those_of_all_densities_and_add_up_to_one() {
    for count in 3..=8 {
        for seed in 0..500 {
            check(count, false, seed);
        }
    }
}

#[test]
fn weights_of_paths_of_two_hundred_vertices_between_narrow_lobes_are_finite_and_add_up_to_one() {
    for seed in 0..12 {
        check(200, true, seed);
        check(200, false, seed);
    }
}

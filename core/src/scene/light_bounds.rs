//! Where some lights are, which way they shine and how strongly, and what they may count at a point (Conty and Kulla 2018,
//! "Importance Sampling of Many Lights with Adaptive Tree Splitting", §4).

use crate::scene::lit::{Lit, LitFrom};
use crate::scene::material::Sides;
use core::f64::consts::{FRAC_PI_2, PI};
use glam::{DVec3, Vec3};

/// A direction is outside a cone, or below a surface, by more than this cosine: far more than what rounding makes of it.
const MARGIN: f64 = 1e-3;
/// What lights that seem to count nothing are taken for, as a cosine: their probability stays positive.
const OUTSIDE: f64 = 1e-6;
/// The least cosine of what may count: bent normals and gloss may show light at grazing angles.
const LEAST: f64 = 1.0 / 32.0;
/// The nearest of some lights is taken to be at least this share of their sphere's radius away.
const NEAREST: f64 = 1.0 / 16.0;
/// Triangles whose normal is less certain than this many radians may face anywhere.
const UNCERTAIN: f64 = 0.1;

/// Directions around an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cone {
    /// Unit length.
    axis: DVec3,
    /// Largest angle between it and a normal of a light.
    spread: f64,
    /// Largest angle between the normal of a light and the directions it shines in.
    reach: f64,
    /// Whether lights shine likewise in the opposite directions.
    sides: Sides,
}

/// Where some lights are, which way they shine and how strongly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    lower: Vec3,
    upper: Vec3,
    cone: Cone,
    intensity: f64,
}

impl Cone {
    /// Every direction from every normal.
    const ALL: Self = Self { axis: DVec3::Z, spread: PI, reach: FRAC_PI_2, sides: Sides::Front };

    /// A cone around both.
    fn union(self, other: Self) -> Self {
        let (mut wide, mut slim) = if self.spread >= other.spread { (self, other) } else { (other, self) };
        if wide.axis.dot(slim.axis) < 0.0 {
            match (wide.sides, slim.sides) {
                (_, Sides::Both) => slim.axis = -slim.axis,
                (Sides::Both, _) => wide.axis = -wide.axis,
                _ => {}
            }
        }
        let sides = if slim.sides == Sides::Both { Sides::Both } else { wide.sides };
        let reach = wide.reach.max(slim.reach);
        let apart = libm::acos(wide.axis.dot(slim.axis).clamp(-1.0, 1.0));
        if (apart + slim.spread).min(PI) <= wide.spread {
            return Self { reach, sides, ..wide };
        }
        // A little more than half of all, so that rounding leaves both inside.
        let spread = 0.5 * (wide.spread + apart + slim.spread) + 1e-9;
        let turn = spread - wide.spread;
        let axis = wide.axis * libm::sin(apart - turn) + slim.axis * libm::sin(turn);
        match axis.try_normalize() {
            Some(axis) if spread < PI && libm::sin(apart) > 1e-6 => Self { axis, spread, reach, sides },
            // The same direction but for rounding.
            Some(_) if apart < 1.0 && spread < PI => Self { spread: spread + apart, reach, sides, ..wide },
            _ => Self { reach, sides, ..Self::ALL },
        }
    }

    /// Size of the set of directions that it shines in, weighted by cosines (equation 1).
    fn measure(self) -> f64 {
        let (o, w) = (self.spread, (self.spread + self.reach).min(PI));
        let (sin, cos) = libm::sincos(o);
        let rest = 2.0 * w * sin - libm::cos(o - 2.0 * w) - 2.0 * o * sin + cos;
        let one = 2.0 * PI * (1.0 - cos) + FRAC_PI_2 * rest;
        if self.sides == Sides::Both { 2.0 * one } else { one }
    }
}

impl LightBounds {
    /// A light that shines the same everywhere from some of `places`.
    pub fn of_point(places: &[Vec3], intensity: f64) -> Self {
        let far = Vec3::splat(f32::INFINITY);
        let lower = places.iter().copied().fold(far, Vec3::min);
        let upper = places.iter().copied().fold(-far, Vec3::max);
        Self { lower, upper, cone: Cone::ALL, intensity }
    }

    /// A light that shines up to an angle of the cosine `outer_cos` around `direction`.
    pub fn of_spot(place: Vec3, direction: Vec3, outer_cos: f32, intensity: f64) -> Self {
        let all = Self::of_point(&[place], intensity);
        let Some(axis) = direction.as_dvec3().try_normalize() else { return all };
        let reach = libm::acos(f64::from(outer_cos).clamp(-1.0, 1.0));
        Self { cone: Cone { axis, spread: 0.0, reach, sides: Sides::Front }, ..all }
    }

    /// A triangle, corners counter-clockwise seen from its front; `intensity` is that at right angles.
    pub fn of_triangle(corners: [Vec3; 3], sides: Sides, intensity: f64) -> Self {
        let all = Self::of_point(&corners, intensity);
        let [a, b, c] = corners.map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a);
        let Some(axis) = normal.try_normalize() else { return all };
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        let largest = all.lower.abs().max(all.upper.abs()).max_element();
        let spread = 8.0 * f64::from(f32::EPSILON * largest) * longest / normal.length();
        if spread > UNCERTAIN {
            return all;
        }
        Self { cone: Cone { axis, spread, reach: FRAC_PI_2, sides }, ..all }
    }

    /// Bounds of both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            lower: self.lower.min(other.lower),
            upper: self.upper.max(other.upper),
            cone: self.cone.union(other.cone),
            intensity: self.intensity + other.intensity,
        }
    }

    /// Radiant intensity where it is greatest, added up.
    pub fn intensity(&self) -> f64 {
        self.intensity
    }

    /// The same with its intensity over another one, no less than `least`.
    #[must_use]
    pub fn relative_to(&self, intensity: f64, least: f64) -> Self {
        Self { intensity: (self.intensity / intensity).max(least), ..*self }
    }

    /// The middle.
    pub fn centre(&self) -> Vec3 {
        self.lower * 0.5 + self.upper * 0.5
    }

    /// What a part of a tree with these bounds costs: intensity · directions · size (equation 3). The squared diagonal
    /// stands for the area, which lights on a line have none of.
    pub fn cost(&self) -> f64 {
        let diagonal = self.upper.as_dvec3() - self.lower.as_dvec3();
        self.intensity * self.cone.measure() * diagonal.length_squared()
    }
}

/// Bounds of some lights as a sphere and a cone, ready to be asked.
#[derive(Clone, Copy, Debug)]
pub struct Cluster {
    centre: Vec3,
    radius: f32,
    /// Half the edges of their box.
    half: Vec3,
    axis: Vec3,
    /// Cosine and sine of the spread.
    spread: [f32; 2],
    /// Cosine of the reach.
    reach: f32,
    sides: Sides,
    intensity: f64,
}

impl Cluster {
    /// Of some bounds.
    pub fn new(of: &LightBounds) -> Self {
        let LightBounds { lower, upper, cone, intensity } = *of;
        let centre = of.centre();
        let rounding = 4.0 * f32::EPSILON * lower.abs().max(upper.abs()).max_element();
        let radius = (upper - centre).max(centre - lower).length() * (1.0 + 4.0 * f32::EPSILON) + rounding;
        let (sin, cos) = libm::sincos(cone.spread);
        Self {
            centre,
            radius,
            half: (upper - centre).max(centre - lower),
            axis: cone.axis.as_vec3(),
            spread: [cos as f32, sin.max(0.0) as f32],
            reach: libm::cos(cone.reach) as f32,
            sides: cone.sides,
            intensity,
        }
    }

    /// What these lights may count at a point, nothing in the way: intensity · cosines / distance² (equation 2 and §5.3),
    /// always positive. The cosines are the greatest of any of them; the square is the least distance times the greatest: the
    /// mean of 1 / distance² of lights spread over a line that leads away from the point. With the distance to the middle,
    /// parts all around a point would count alike.
    #[inline]
    pub fn importance(&self, lit: &Lit) -> f64 {
        let to = self.centre.as_dvec3() - lit.point.as_dvec3();
        let (squared, near) = (to.length_squared(), f64::from(self.radius) * f64::from(self.radius));
        let beyond = (to.abs() - self.half.as_dvec3()).max(DVec3::ZERO).length();
        let radius = f64::from(self.radius);
        let over = self.intensity / (beyond.max(NEAREST * radius) * (squared.sqrt() + radius)).max(1e-100);
        if squared <= near {
            return over;
        }
        let direction = to / squared.sqrt();
        let sin_squared = near / squared;
        let around = [(1.0 - sin_squared).sqrt(), sin_squared.sqrt()];
        let leaves = -self.axis.as_dvec3().dot(direction);
        let leaves = if self.sides == Sides::Both { leaves.abs() } else { leaves };
        let emitted = nearer(nearer(leaves, self.spread.map(f64::from)), around);
        let along = lit.normal.as_dvec3().dot(direction);
        let arrives = match lit.from {
            LitFrom::Above => along,
            LitFrom::BothSides => along.abs(),
            LitFrom::Everywhere => 1.0,
        };
        over * counted(emitted, f64::from(self.reach)) * counted(nearer(arrives, around), 0.0)
    }
}

/// Cosine of an angle that is smaller by another, of the given cosine and sine, but not below zero.
#[inline]
fn nearer(cos: f64, [by_cos, by_sin]: [f64; 2]) -> f64 {
    if cos >= by_cos {
        return 1.0;
    }
    cos * by_cos + (1.0 - cos * cos).max(0.0).sqrt() * by_sin
}

/// What a cosine counts where nothing does below `limit`.
#[inline]
fn counted(cos: f64, limit: f64) -> f64 {
    if cos < limit - MARGIN { OUTSIDE } else { cos.max(LEAST) }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::sampler::{Dimension, Sampler, Use};

    /// Lights of every kind in a cube of side 2 `size`, whose triangles have about the given length and whose intensities
    /// have some decades.
    pub(in crate::scene) fn lights(n: u32, [size, length, decades]: [f32; 3]) -> Vec<LightBounds> {
        (0..n)
            .map(|i| {
                let sampler = Sampler::new(1, 0, [i, 0], 0);
                let place = around(&sampler, 0) * 2.0 * size;
                let choice = sampler.pair(Dimension::Film);
                let intensity = libm::exp2(-3.32 * f64::from(decades * choice.x));
                let [a, b] = [1, 2].map(|k| around(&sampler, k) * length);
                match i % 4 {
                    0 => LightBounds::of_point(&[place], intensity),
                    1 => LightBounds::of_spot(place, a.normalize(), choice.y, intensity),
                    2 => LightBounds::of_triangle([place, place + a, place + b], Sides::Front, intensity),
                    _ => LightBounds::of_triangle([place, place + a, place + b], Sides::Both, intensity),
                }
            })
            .collect()
    }

    /// Of length up to √3 / 2.
    fn around(sampler: &Sampler, k: u32) -> Vec3 {
        let at = |what| sampler.pair(Dimension::Eye(k, what)) - 0.5;
        at(Use::Direction).extend(at(Use::Light).x)
    }

    /// Points in and around a cube of side 2 `size`.
    pub(in crate::scene) fn points(n: u32, size: f32) -> impl Iterator<Item = Lit> {
        let froms = [LitFrom::Above, LitFrom::BothSides, LitFrom::Everywhere];
        (0..n).map(move |i| {
            let sampler = Sampler::new(99, 0, [i, 0], 0);
            let (point, normal) = (around(&sampler, 0) * 3.0 * size, around(&sampler, 1).normalize());
            Lit { point, normal, from: froms[i as usize % 3] }
        })
    }

    /// Importance without intensity and distance: the cosines.
    fn cosines(cluster: &Cluster, lit: &Lit) -> f64 {
        let alone = Cluster { spread: [-1.0, 0.0], reach: 0.0, ..*cluster };
        cluster.importance(lit) / alone.importance(&Lit { from: LitFrom::Everywhere, ..*lit })
    }

    #[test]
    fn bounds_of_some_lights_count_what_each_of_them_counts() {
        // Lights that are nearly points, so that the sphere of all holds theirs.
        let all = lights(1000, [1.0, 1e-4, 0.0]);
        let (mut some, mut all_but_none) = (0, 0);
        for (k, group) in all.chunks(5).chain(all.chunks(2)).enumerate() {
            // The fifth part of them are close together and alike, as in a lamp of many triangles.
            let group: Vec<_> = match k % 5 {
                0 => group
                    .iter()
                    .map(|one| LightBounds { lower: one.lower * 1e-2, upper: one.upper * 1e-2, ..*one })
                    .collect(),
                _ => group.to_vec(),
            };
            let whole = Cluster::new(&group.iter().skip(1).fold(group[0], |a, b| a.union(b)));
            for lit in points(40, 1.0) {
                let of_whole = cosines(&whole, &lit);
                for one in &group {
                    let of_one = cosines(&Cluster::new(one), &lit);
                    assert!(of_whole >= of_one * 0.99, "{lit:?}: {of_whole} for {of_one} of {one:?}");
                    some += u32::from(of_one > 0.1);
                    all_but_none += u32::from(of_whole < 0.5 && of_one > 0.1);
                }
            }
        }
        assert!(some > 10_000 && all_but_none > 100, "{some}, {all_but_none}");
    }

    #[test]
    fn a_single_light_counts_what_it_sends() {
        let lit = Lit { point: Vec3::ZERO, normal: Vec3::Y, from: LitFrom::Above };
        let place = Vec3::new(0.3, 0.4, 0.0);
        let point = Cluster::new(&LightBounds::of_point(&[place], 3.0));
        // Intensity · cos / distance².
        assert!((point.importance(&lit) - 3.0 * 0.8 / 0.25).abs() < 1e-5);
        // Around the place; its size lets it count a little more.
        let corners = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]];
        let corners = corners.map(|[x, z]| place + 1e-3 * Vec3::new(x, 0.0, z));
        let down = Cluster::new(&LightBounds::of_triangle(corners, Sides::Front, 3.0));
        let more = down.importance(&lit) - 3.0 * 0.8 * 0.8 / 0.25;
        assert!((0.0..0.06).contains(&more), "{more}");
        let up = LightBounds::of_triangle([corners[0], corners[2], corners[1]], Sides::Front, 3.0);
        assert!(Cluster::new(&up).importance(&lit) < 1e-4);
        let both = LightBounds::of_triangle([corners[0], corners[2], corners[1]], Sides::Both, 3.0);
        assert_eq!(Cluster::new(&both).importance(&lit), down.importance(&lit));
        let below = Lit { normal: -Vec3::Y, ..lit };
        assert!(down.importance(&below) < 1e-4);
        let through = Lit { from: LitFrom::BothSides, ..below };
        assert_eq!(down.importance(&through), down.importance(&lit));
        let aside = LightBounds::of_spot(place, Vec3::X, 0.5, 3.0);
        assert!(Cluster::new(&aside).importance(&lit) < 1e-4);
        let here = LightBounds::of_spot(place, -place.normalize(), 0.5, 3.0);
        assert!((Cluster::new(&here).importance(&lit) - 3.0 * 0.8 / 0.25).abs() < 1e-5);
    }
}

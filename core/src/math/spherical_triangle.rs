//! Triangles seen from a point: solid angle, and directions uniform over it.

use core::f64::consts::PI;
use glam::{DVec3, Vec2, Vec3};

/// Where 1 + cos of the arc between two corners is below this, its great circle is hardly known in f32: then all is computed in
/// f64. Next to a square lamp 10⁴ times as large as it is far, 3 % of the light was lost.
const OPPOSITE: f32 = 1e-2;

/// A triangle projected on the unit sphere around a point.
#[derive(Clone, Copy, Debug)]
pub struct SphericalTriangle {
    corners: [Vec3; 3],
    /// |det(a, b, c)|, (a + b)·c and 1 + a·b: tan(Ω/2) is the first over the sum of the others
    /// (van Oosterom and Strackee 1983).
    g: [f32; 3],
    solid_angle: f32,
    /// The directions that it was made of, where two of them are nearly opposite.
    opposite: Option<[Vec3; 3]>,
}

impl SphericalTriangle {
    /// Of three directions of any length above zero; `None` where one vanishes.
    pub fn new(directions: [Vec3; 3]) -> Option<Self> {
        let [a, b, c] = directions;
        let corners = [a.try_normalize()?, b.try_normalize()?, c.try_normalize()?];
        let [u, v, w] = corners;
        // Differences of the corners keep the determinant exact for small triangles.
        let determinant = u.dot((v - u).cross(w - u)).abs();
        let g = [determinant, (u + v).dot(w), 1.0 + u.dot(v)];
        if g[2].min(1.0 + u.dot(w)).min(1.0 + v.dot(w)) < OPPOSITE {
            let solid_angle = Wide::new(directions).solid_angle as f32;
            return Some(Self { corners, g, solid_angle, opposite: Some(directions) });
        }
        let half = libm::atan2f(g[0], g[1] + g[2]);
        let solid_angle = 2.0 * if half < 0.0 { half + core::f32::consts::PI } else { half };
        Some(Self { corners, g, solid_angle, opposite: None })
    }

    /// In steradians, 0 to 2π for a plane triangle.
    pub fn solid_angle(&self) -> f32 {
        self.solid_angle
    }

    /// A unit direction, uniform over the solid angle: `u.x` chooses a triangle of the same first
    /// two corners and that share of the area, `u.y` a point on the arc that it ends with (Arvo
    /// 1995, without inverse trigonometry as in Peters 2021, "BRDF Importance Sampling for
    /// Polygonal Lights", §4).
    pub fn sample(&self, u: Vec2) -> Vec3 {
        if let Some(directions) = self.opposite {
            return Wide::new(directions).sample(u);
        }
        let [a, b, c] = self.corners;
        let (sin, cos) = libm::sincosf(0.5 * u.x * self.solid_angle);
        // The direction half way between `a` and the third corner of the smaller triangle.
        let half = a * (self.g[0] * cos - self.g[1] * sin) + c * (self.g[2] * sin);
        let third = half * (2.0 * a.dot(half) / half.length_squared()) - a;
        let cos_arc = b.dot(third);
        let s = 1.0 + u.y * (cos_arc - 1.0);
        let t = ((1.0 - s * s).max(0.0) / (1.0 - cos_arc * cos_arc).max(f32::MIN_POSITIVE)).sqrt();
        (b * (s - t * cos_arc) + third * t).normalize_or(a)
    }
}

/// The same in f64.
struct Wide {
    corners: [DVec3; 3],
    g: [f64; 3],
    solid_angle: f64,
}

impl Wide {
    #[cold]
    fn new(directions: [Vec3; 3]) -> Self {
        let corners = directions.map(|d| d.as_dvec3().normalize());
        let [u, v, w] = corners;
        let determinant = u.dot((v - u).cross(w - u)).abs();
        let g = [determinant, (u + v).dot(w), 1.0 + u.dot(v)];
        let half = libm::atan2(g[0], g[1] + g[2]);
        Self { corners, g, solid_angle: 2.0 * if half < 0.0 { half + PI } else { half } }
    }

    #[cold]
    fn sample(&self, u: Vec2) -> Vec3 {
        let [a, b, c] = self.corners;
        let (sin, cos) = libm::sincos(0.5 * f64::from(u.x) * self.solid_angle);
        let half = a * (self.g[0] * cos - self.g[1] * sin) + c * (self.g[2] * sin);
        let third = half * (2.0 * a.dot(half) / half.length_squared()) - a;
        let cos_arc = b.dot(third);
        let s = 1.0 + f64::from(u.y) * (cos_arc - 1.0);
        let t = ((1.0 - s * s).max(0.0) / (1.0 - cos_arc * cos_arc).max(f64::MIN_POSITIVE)).sqrt();
        (b * (s - t * cos_arc) + third * t).normalize_or(a).as_vec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::warp;

    /// Mean of (x, y², xyz…) over the solid angle, by area sampling in f64.
    fn reference(t: [Vec3; 3]) -> ([f64; 4], f64) {
        let n = 400;
        let [a, b, c] = t.map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a);
        let (mut sums, mut total) = ([0.0; 4], 0.0);
        for i in 0..n * n {
            let u = Vec2::new(((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32);
            let w = warp::triangle(u).as_dvec2();
            let p = a + (b - a) * w.x + (c - a) * w.y;
            let weight = 0.5 * normal.dot(p).abs() / p.length().powi(3) / f64::from(n * n);
            let d = p.normalize();
            for (sum, f) in sums.iter_mut().zip([d.x, d.y * d.y, d.z, d.x * d.y]) {
                *sum += f * weight;
            }
            total += weight;
        }
        (sums.map(|s| s / total), total)
    }

    #[test]
    fn solid_angle_and_moments_are_those_of_the_area() {
        let triangles = [
            [Vec3::new(1.0, 0.0, 1.0), Vec3::new(0.0, 1.0, 1.0), Vec3::new(-0.5, -0.5, 1.0)],
            [Vec3::new(0.02, 0.0, 1.0), Vec3::new(0.0, 0.03, 1.0), Vec3::new(0.01, -0.02, 1.1)],
            [Vec3::new(5.0, 0.0, 0.1), Vec3::new(-4.0, 3.0, 0.1), Vec3::new(-4.0, -4.0, 0.2)],
        ];
        for t in triangles {
            let (moments, total) = reference(t);
            let triangle = SphericalTriangle::new(t).unwrap();
            // The midpoint rule is off by about 1e-3 for the triangle that fills half the sky.
            assert!((f64::from(triangle.solid_angle()) / total - 1.0).abs() < 2e-3, "{t:?} {total}");
            let n = 512;
            let mut sums = [0.0; 4];
            for i in 0..n * n {
                let u = Vec2::new(((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32);
                let d = triangle.sample(u).as_dvec3();
                for (sum, f) in sums.iter_mut().zip([d.x, d.y * d.y, d.z, d.x * d.y]) {
                    *sum += f / f64::from(n * n);
                }
            }
            for (a, b) in sums.iter().zip(moments) {
                assert!((a - b).abs() < 2e-3, "{sums:?} {moments:?}");
            }
        }
    }
}

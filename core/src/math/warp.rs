//! The unit square onto disks, hemispheres and triangles, and the densities that result.

use core::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4};
use glam::{Vec2, Vec3};

/// The unit disk, area-preserving and with little distortion (Shirley and Chiu 1997).
pub fn disk(u: Vec2) -> Vec2 {
    let p = 2.0 * u - Vec2::ONE;
    if p == Vec2::ZERO {
        return Vec2::ZERO;
    }
    let (radius, angle) = if p.x.abs() > p.y.abs() {
        (p.x, FRAC_PI_4 * (p.y / p.x))
    } else {
        (p.y, FRAC_PI_2 - FRAC_PI_4 * (p.x / p.y))
    };
    let (sin, cos) = libm::sincosf(angle);
    radius * Vec2::new(cos, sin)
}

/// A direction of the upper hemisphere with density cos θ / π over solid angle.
pub fn cosine_hemisphere(u: Vec2) -> Vec3 {
    let p = disk(u);
    let z = (1.0 - p.length_squared()).max(0.0).sqrt();
    p.extend(z)
}

/// Density of [`cosine_hemisphere`] over solid angle; zero below the horizon.
#[inline]
pub fn cosine_hemisphere_pdf(cos: f32) -> f32 {
    cos.max(0.0) * FRAC_1_PI
}

/// A direction of the whole sphere with density 1 / 4π over solid angle.
pub fn sphere(u: Vec2) -> Vec3 {
    let z = 1.0 - 2.0 * u.x;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = libm::sincosf(core::f32::consts::TAU * u.y);
    Vec3::new(r * cos, r * sin, z)
}

/// Barycentric weights of the second and third vertex of a triangle, uniform over its area
/// (Heitz 2019, "A Low-Distortion Map Between Triangle and Square").
pub fn triangle(u: Vec2) -> Vec2 {
    if u.y > u.x {
        let x = u.x * 0.5;
        Vec2::new(x, u.y - x)
    } else {
        let y = u.y * 0.5;
        Vec2::new(u.x - y, y)
    }
}

/// The part of the unit sphere with z above `lowest`, uniformly.
#[inline]
pub fn cap(u: Vec2, lowest: f32) -> Vec3 {
    let z = 1.0 - u.y * (1.0 - lowest);
    let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    let (sin, cos) = libm::sincosf(core::f32::consts::TAU * u.x);
    Vec3::new(r * cos, r * sin, z)
}

/// A direction of the upper hemisphere that favours the horizon: the squared cosine has density
/// 1 / ((c + cos² θ) ℓ) with ℓ = ln(1 + 1/c), which the caller keeps.
pub fn horizon_hemisphere(u: Vec2, c: f32, ell: f32) -> Vec3 {
    let squared = (c * libm::expm1f(u.y * ell)).clamp(0.0, 1.0);
    let r = (1.0 - squared).sqrt();
    let (sin, cos) = libm::sincosf(core::f32::consts::TAU * u.x);
    Vec3::new(r * cos, r * sin, squared.sqrt())
}

/// Density of [`horizon_hemisphere`] over solid angle; zero below the horizon.
#[inline]
pub fn horizon_hemisphere_pdf(cos: f32, c: f32, ell: f32) -> f32 {
    cos.max(0.0) * FRAC_1_PI / ((c + cos * cos) * ell)
}

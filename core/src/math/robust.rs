//! Arithmetic with known error bounds.

use glam::Vec3;

/// Half the distance between 1 and the next float: the unit round-off.
pub const UNIT_ROUNDOFF: f32 = f32::EPSILON * 0.5;

/// Bound on the relative error of `n` rounded operations in a row (Higham's γₙ; pbrt §6.8.1).
#[inline]
pub const fn gamma(n: f32) -> f32 {
    n * UNIT_ROUNDOFF / (1.0 - n * UNIT_ROUNDOFF)
}

/// Moves a point that is known within `error` (absolute, per axis) off its surface along
/// `normal`, to the side that `direction` leaves to, so that a ray from there cannot hit the
/// surface it starts on (Ize 2013; pbrt §6.8.6).
#[inline]
pub fn offset_origin(point: Vec3, error: Vec3, normal: Vec3, direction: Vec3) -> Vec3 {
    let distance = normal.abs().dot(error);
    let offset = if direction.dot(normal) < 0.0 { -normal * distance } else { normal * distance };
    let moved = point + offset;
    // The sum is rounded; step each coordinate once more, away from the surface.
    Vec3::new(away(moved.x, offset.x), away(moved.y, offset.y), away(moved.z, offset.z))
}

#[inline]
fn away(value: f32, offset: f32) -> f32 {
    if offset > 0.0 {
        value.next_up()
    } else if offset < 0.0 {
        value.next_down()
    } else {
        value
    }
}

/// `a·b − c·d` with an error of at most 1.5 ulp (Kahan; Jeannerod et al. 2013). One fused
/// multiply-add and its exact residual: the same bits on every machine.
#[inline]
pub fn difference_of_products(a: f32, b: f32, c: f32, d: f32) -> f32 {
    let cd = c * d;
    let difference = f32::mul_add(a, b, -cd);
    let residual = f32::mul_add(-c, d, cd);
    difference + residual
}

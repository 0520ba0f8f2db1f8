//! Irradiance in closed form, and what interfaces leave of it.

use glam::DVec3;

/// Irradiance at the origin of the plane y = 0 from a polygon of radiance one above it (Lambert 1760):
/// E = ½ Σ θᵢ (vᵢ × vᵢ₊₁)/|…| · n.
pub fn of_polygon(corners: &[DVec3]) -> f64 {
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    let sum: f64 = edges
        .map(|(a, b)| {
            let (a, b) = (a.normalize(), b.normalize());
            let across = a.cross(b);
            across.length().atan2(a.dot(b)) * across.normalize_or_zero().y
        })
        .sum();
    0.5 * sum.abs()
}

/// Irradiance of a horizontal plane from a point of intensity one, `light` away from where it is looked at: E = h / d³.
pub fn of_point(light: DVec3) -> f64 {
    light.y / light.length().powi(3)
}

/// What a metal of colour `f0` reflects at a cosine (Schlick 1994).
pub fn schlick(f0: f64, cos: f64) -> f64 {
    f0 + (1.0 - f0) * (1.0 - cos).powi(5)
}

/// What an interface to a medium of relative index `eta` reflects of unpolarised light at a cosine (Fresnel).
pub fn fresnel(eta: f64, cos: f64) -> f64 {
    let inside = (1.0 - (1.0 - cos * cos) / (eta * eta)).sqrt();
    let (s, p) = ((cos - eta * inside) / (cos + eta * inside), (eta * cos - inside) / (eta * cos + inside));
    // Light is not tracked by polarisation: an interface reflects the mean of both.
    0.5 * (s * s + p * p)
}

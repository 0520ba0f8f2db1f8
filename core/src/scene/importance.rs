//! Where in the frame a point is seen: the end of a path that comes from a light.
//!
//! A pixel's value is ∫ L(o, ω) p(o) p(ω | o) dω do over the lens and the directions through the pixel, with the densities
//! of [`View::ray`]. So the weight of light that meets the lens is the density with which the pixel's own rays go there.

use crate::math::warp;
use crate::scene::view::{View, ViewProjection};
use crate::trace::ray::Ray;
use core::f32::consts::PI;
use glam::{Vec2, Vec3};

/// How a point or a direction is seen.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// By which pixel.
    pub pixel: [u32; 2],
    /// Unit direction to the lens.
    pub direction: Vec3,
    /// Where on the lens (of an orthographic camera: on its plane).
    pub end: Vec3,
    /// Density of the pixel's rays: over solid angle at `end`, or over the plane's area of an orthographic camera.
    pub pdf: Importance,
}

/// The density of a pixel's rays, given the place on the lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Importance {
    /// Over solid angle.
    SolidAngle(f64),
    /// All parallel: over area at right angles to them.
    Area(f64),
}

impl Importance {
    /// Density over area at a point in `distance`, seen at the cosine `cos` to its surface's normal.
    #[inline]
    pub fn over_area(self, distance_squared: f64, cos: f64) -> f64 {
        match self {
            Self::SolidAngle(pdf) => pdf * cos / distance_squared,
            Self::Area(pdf) => pdf * cos,
        }
    }
}

/// A lens met by light.
#[derive(Clone, Copy, Debug)]
pub struct LensHit {
    /// By which pixel it is seen.
    pub pixel: [u32; 2],
    /// How far along the ray.
    pub t: f32,
    /// Where on the lens.
    pub position: Vec3,
    /// Cosine between the ray and the lens' axis.
    pub cos: f64,
    /// Density of a pixel's rays over the lens' area.
    pub place_pdf: f64,
    /// Density of a pixel's rays over solid angle there.
    pub direction_pdf: f64,
}

impl View {
    /// How `point` is seen through a place on the lens (unit square); `None` where it is not.
    pub fn see(&self, point: Vec3, lens: Vec2) -> Option<Seen> {
        if let ViewProjection::Orthographic = self.projection {
            let off = point - self.position;
            let end = point - self.forward * off.dot(self.forward);
            let pixel = self.pixel(self.across(off))?;
            let seen = Seen { pixel, direction: -self.forward, end, pdf: Importance::Area(self.parallel()) };
            return (off.dot(self.forward) > 0.0).then_some(seen);
        }
        let end = self.position + self.on_lens(lens);
        let direction = (end - point).try_normalize()?;
        self.seen(end, -direction)
    }

    /// How light from infinitely far in the unit direction `towards` is seen; `None` where it is not, and by a camera
    /// whose rays are parallel.
    pub fn see_far(&self, towards: Vec3, lens: Vec2) -> Option<Seen> {
        match self.projection {
            ViewProjection::Orthographic => None,
            _ => self.seen(self.position + self.on_lens(lens), towards),
        }
    }

    /// Density of the ray that [`Self::ray`] gives a pixel.
    pub fn ray_pdf(&self, direction: Vec3) -> Importance {
        match self.projection {
            ViewProjection::Orthographic => Importance::Area(self.parallel()),
            _ => Importance::SolidAngle(self.direction_pdf(direction.dot(self.forward))),
        }
    }

    /// Density of a place on the lens over its area; `None` for a lens without extent.
    pub fn lens_pdf(&self) -> Option<f64> {
        match self.projection {
            ViewProjection::Lens { radius, .. } => Some(1.0 / f64::from(PI * radius * radius)),
            _ => None,
        }
    }

    /// Axis of the camera, a unit vector into the scene.
    pub fn axis(&self) -> Vec3 {
        self.forward
    }

    /// Where a ray of light meets the lens before `t_max`.
    pub fn meet(&self, ray: &Ray, t_max: f32) -> Option<LensHit> {
        let ViewProjection::Lens { radius, .. } = self.projection else { return None };
        let cos = -ray.direction.dot(self.forward);
        let t = (self.position - ray.origin).dot(self.forward) / -cos;
        if !(cos > 0.0 && t > 0.0 && t < t_max) {
            return None;
        }
        let position = ray.origin + ray.direction * t;
        if (position - self.position).length_squared() >= radius * radius {
            return None;
        }
        let seen = self.seen(position, -ray.direction)?;
        let (pixel, place_pdf) = (seen.pixel, self.lens_pdf()?);
        let direction_pdf = self.direction_pdf(cos);
        Some(LensHit { pixel, t, position, cos: f64::from(cos), place_pdf, direction_pdf })
    }

    fn on_lens(&self, lens: Vec2) -> Vec3 {
        match self.projection {
            ViewProjection::Lens { radius, across, .. } => {
                let disk = warp::disk(lens) * radius;
                across[0] * disk.x + across[1] * disk.y
            }
            _ => Vec3::ZERO,
        }
    }

    /// What a point of the lens sees in a direction.
    fn seen(&self, end: Vec3, direction: Vec3) -> Option<Seen> {
        let cos = direction.dot(self.forward);
        if cos <= 0.0 {
            return None;
        }
        let focus_distance = match self.projection {
            ViewProjection::Lens { focus_distance, .. } => focus_distance,
            _ => 1.0,
        };
        let in_focus = (end - self.position) + direction * (focus_distance / cos);
        let pixel = self.pixel(self.across(in_focus / focus_distance))?;
        let pdf = Importance::SolidAngle(self.direction_pdf(cos));
        Some(Seen { pixel, direction: -direction, end, pdf })
    }

    /// Place in the frame, −1 to 1 each way, of a vector from the eye to a point at distance one along the axis (of an
    /// orthographic camera: at any).
    fn across(&self, v: Vec3) -> Vec2 {
        let along = |axis: Vec3| v.dot(axis) / axis.length_squared();
        Vec2::new(along(self.right), -along(self.up))
    }

    fn pixel(&self, at: Vec2) -> Option<[u32; 2]> {
        let place = (at + Vec2::ONE) * 0.5 * self.size;
        let inside = place.cmpge(Vec2::ZERO).all() && place.cmplt(self.size).all();
        inside.then_some([place.x as u32, place.y as u32])
    }

    /// 1 / (A cos³ θ), A the area of a pixel at distance one.
    fn direction_pdf(&self, cos: f32) -> f64 {
        let cos = f64::from(cos);
        self.parallel() / (cos * cos * cos)
    }

    /// One over the area of a pixel at distance one; of an orthographic camera, over its area.
    fn parallel(&self) -> f64 {
        let area = f64::from(self.right.length()) * f64::from(self.up.length()) * 4.0;
        f64::from(self.size.x) * f64::from(self.size.y) / area
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::size::Size;
    use crate::scene::camera::{Camera, Projection};
    use crate::scene::view::LensInScene;

    fn views() -> [View; 3] {
        let camera = |projection| Camera {
            name: String::new(),
            position: Vec3::new(1.0, 2.0, 3.0),
            right: Vec3::new(0.6, 0.0, 0.8),
            up: Vec3::Y,
            backward: Vec3::new(-0.8, 0.0, 0.6),
            projection,
            knots: Vec::new(),
        };
        let perspective = camera(Projection::Perspective { tan_half_y: 0.7, aspect: None });
        let orthographic = camera(Projection::Orthographic { half_width: 4.0, half_height: 3.0 });
        let size = Size { width: 40, height: 30 };
        let lens = LensInScene { radius: 0.3, focus_distance: 5.0 };
        [
            View::new(&perspective, size, None),
            View::new(&perspective, size, Some(lens)),
            View::new(&orthographic, size, None),
        ]
    }

    #[test]
    fn what_a_ray_meets_is_seen_by_the_pixel_that_sent_it() {
        for view in views() {
            for (i, place) in [(3.25, 7.5), (0.1, 0.2), (39.9, 29.7), (20.5, 15.25)].into_iter().enumerate() {
                let lens = Vec2::new(0.2 + 0.1 * i as f32, 0.7);
                let ray = view.ray(Vec2::new(place.0, place.1), lens);
                let seen = view.see(ray.origin + ray.direction * 7.0, lens).unwrap();
                assert_eq!(seen.pixel, [place.0 as u32, place.1 as u32]);
                assert!((seen.direction + ray.direction).length() < 1e-5);
                assert!((seen.end - ray.origin).length() < 1e-4, "{} {}", seen.end, ray.origin);
                assert_eq!(view.see(ray.origin - ray.direction * 7.0, lens).map(|s| s.pixel), None);
            }
        }
    }

    #[test]
    fn the_density_of_a_pixels_directions_is_one_over_its_solid_angle() {
        let view = &views()[0];
        let corner = |x: f32, y: f32| view.ray(Vec2::new(x, y), Vec2::splat(0.5)).direction.as_dvec3();
        let [a, b, c, d] = [corner(3.0, 7.0), corner(3.1, 7.0), corner(3.1, 7.1), corner(3.0, 7.1)];
        let solid_angle = 0.5 * (c - a).cross(d - b).length();
        let Importance::SolidAngle(pdf) = view.ray_pdf(corner(3.05, 7.05).as_vec3()) else { panic!() };
        // A hundredth of the pixel.
        assert!((pdf * solid_angle * 100.0 - 1.0).abs() < 1e-3, "{}", pdf * solid_angle);
    }

    #[test]
    fn light_meets_the_lens_where_the_pixels_ray_starts() {
        let view = &views()[1];
        let ray = view.ray(Vec2::new(11.5, 21.5), Vec2::new(0.3, 0.6));
        let back = Ray::new(ray.origin + ray.direction * 4.0, -ray.direction);
        let hit = view.meet(&back, f32::INFINITY).unwrap();
        assert_eq!(hit.pixel, [11, 21]);
        assert!((hit.t - 4.0).abs() < 1e-4 && (hit.position - ray.origin).length() < 1e-4);
        assert!(view.meet(&back, 3.9).is_none());
        assert!(views()[0].meet(&back, f32::INFINITY).is_none());
    }
}

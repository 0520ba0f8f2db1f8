//! The solids that a walk is inside of.

use crate::math::colour::Rgb;
use crate::scene::Scene;
use crate::scene::interaction::Interaction;
use crate::trace::moment::Moment;
use crate::trace::ray::Ray;
use glam::Vec3;

/// Deepest nesting of solids that is kept; what is entered below is taken for the last.
const DEPTH_MAX: usize = 16;
/// Most surfaces that are looked at on the way out from where a walk starts.
const WAY_OUT_MAX: usize = 1024;
/// A direction along no axis, in which solids are looked for.
const WAY_OUT: Vec3 = Vec3::new(0.393_7, 0.771_3, 0.500_1);

/// The solids that a walk is inside of, innermost last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Media {
    absorptions: [Rgb; DEPTH_MAX],
    depth: usize,
}

impl Media {
    /// In vacuum.
    pub const VACUUM: Self = Self { absorptions: [Vec3::ZERO; DEPTH_MAX], depth: 0 };

    /// The solids around a point, where any solid of the scene absorbs: those that straight ways out of the scene leave and
    /// have not entered. Where two opposite ways do not agree, as around a solid that is not closed, there are none.
    pub fn around(scene: &Scene, point: Vec3, moment: Moment, rays: &mut u64) -> Self {
        if !scene.data.absorbs() {
            return Self::VACUUM;
        }
        let ways =
            [WAY_OUT, -WAY_OUT].map(|way| Self::left_along(scene, Ray::new(point, way).at(moment), rays));
        match ways {
            [Some(one), Some(other)] if one == other => one,
            _ => Self::VACUUM,
        }
    }

    /// The solids that a ray leaves and has not entered; `None` where there is no end to them.
    fn left_along(scene: &Scene, mut ray: Ray, rays: &mut u64) -> Option<Self> {
        let (mut entered, mut left) = (Vec::new(), Vec::new());
        for _ in 0..WAY_OUT_MAX {
            *rays += 1;
            let Some(hit) = scene.closest(&ray, || 0) else {
                // The last that is left is the outermost.
                let mut media = Self::VACUUM;
                left.into_iter().rev().for_each(|absorption| media.enter(absorption));
                return Some(media);
            };
            let at = scene.data.interaction(hit.instance, hit.triangle, hit.barycentric, ray.moment);
            if let Some(volume) = at.material.volume {
                let own = |other: &Rgb| *other == volume.absorption;
                if ray.direction.dot(at.ng) < 0.0 {
                    entered.push(volume.absorption);
                } else if let Some(place) = entered.iter().rposition(own) {
                    entered.remove(place);
                } else {
                    left.push(volume.absorption);
                }
            }
            ray.origin = at.leave(ray.direction);
        }
        None
    }

    fn enter(&mut self, absorption: Rgb) {
        self.absorptions[self.depth.min(DEPTH_MAX - 1)] = absorption;
        self.depth = (self.depth + 1).min(DEPTH_MAX);
    }

    /// Solids that stand in each other are not left in the order they were entered in.
    fn leave(&mut self, absorption: Rgb) {
        let inside = &mut self.absorptions[..self.depth];
        if let Some(place) = inside.iter().rposition(|one| *one == absorption) {
            inside[place..].rotate_left(1);
        }
        self.depth = self.depth.saturating_sub(1);
        self.absorptions[self.depth] = Vec3::ZERO;
    }

    /// Share of light left after `distance` (scene units) that ends at `end`, whose front may be on the other side:
    /// then the way was inside of its solid.
    pub fn transmittance_to(&self, distance: f32, end: &Interaction<'_>, back: Vec3) -> Rgb {
        if self.depth == 0 {
            let inside = back.dot(end.ng) < 0.0;
            return match end.material.volume {
                Some(volume) if inside => fade(volume.absorption, distance),
                _ => Vec3::ONE,
            };
        }
        self.transmittance(distance)
    }

    /// Share of light left after `distance` (scene units) in the innermost solid.
    pub fn transmittance(&self, distance: f32) -> Rgb {
        match self.depth.checked_sub(1) {
            Some(innermost) => fade(self.absorptions[innermost], distance),
            None => Vec3::ONE,
        }
    }

    /// Follows a transmission through `at` towards `direction`.
    pub fn cross(&mut self, at: &Interaction<'_>, direction: Vec3) {
        let Some(volume) = at.material.volume else { return };
        if direction.dot(at.ng) < 0.0 {
            self.enter(volume.absorption);
        } else {
            self.leave(volume.absorption);
        }
    }
}

/// Beer and Lambert: exp(−σ d).
fn fade(absorption: Rgb, distance: f32) -> Rgb {
    if absorption == Vec3::ZERO {
        return Vec3::ONE;
    }
    let channel = |sigma: f32| if sigma == 0.0 { 1.0 } else { libm::expf(-sigma * distance) };
    Vec3::new(channel(absorption.x), channel(absorption.y), channel(absorption.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_what_was_entered_whatever_else_was() {
        let [a, b, c] = [1.0, 2.0, 3.0].map(Vec3::splat);
        let mut media = Media::VACUUM;
        let inside = |media: &Media| media.absorptions[..media.depth].to_vec();
        for one in [a, b, c] {
            media.enter(one);
        }
        media.leave(a);
        assert_eq!(inside(&media), [b, c]);
        media.leave(c);
        assert_eq!(inside(&media), [b]);
        // Something that was never entered: the innermost ends.
        media.leave(a);
        assert_eq!(media, Media::VACUUM);
        media.leave(b);
        assert_eq!(media, Media::VACUUM);
        (0..2 * DEPTH_MAX).for_each(|_| media.enter(b));
        assert_eq!(media.depth, DEPTH_MAX);
        assert_eq!(media.transmittance(0.5), Vec3::splat(libm::expf(-1.0)));
    }
}

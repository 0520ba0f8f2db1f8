//! A camera and a film: from a place in the frame to a ray.

use crate::film::size::Size;
use crate::math::warp;
use crate::scene::camera::{Camera, Projection, Stand};
use crate::trace::moment::Moment;
use crate::trace::ray::Ray;
use glam::{Vec2, Vec3};

/// A camera with a frame to fill and a lens.
#[derive(Clone, Copy, Debug)]
pub struct View {
    pub(super) position: Vec3,
    /// To the right edge, the top edge and the middle of the frame, from the eye (of an orthographic camera: the
    /// first two from the middle, the third a unit vector).
    pub(super) right: Vec3,
    pub(super) up: Vec3,
    pub(super) forward: Vec3,
    pub(super) projection: ViewProjection,
    pub(super) size: Vec2,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum ViewProjection {
    Pinhole,
    /// Radius of the lens and distance of the plane in focus, in scene units, along unit axes.
    Lens {
        radius: f32,
        focus_distance: f32,
        across: [Vec3; 2],
    },
    Orthographic,
}

/// A thin lens in scene units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensInScene {
    /// Radius of the aperture.
    pub radius: f32,
    /// Distance of the plane in focus.
    pub focus_distance: f32,
}

impl View {
    /// Fills a frame of `size`. The vertical angle of view is the camera's; the horizontal one follows from the
    /// frame. An orthographic camera ignores the lens. A camera that moves is taken where it is at the first knot.
    pub fn new(camera: &Camera, size: Size, lens: Option<LensInScene>) -> Self {
        Self::from(camera.stand(), camera.projection, size, lens)
    }

    fn from(stand: Stand, projection: Projection, size: Size, lens: Option<LensInScene>) -> Self {
        let Stand { position, axes: [right, up, backward] } = stand;
        let aspect = size.width as f32 / size.height as f32;
        let (half_width, half_height, projection) = match projection {
            Projection::Perspective { tan_half_y, .. } => {
                let projection = lens.map_or(ViewProjection::Pinhole, |lens| ViewProjection::Lens {
                    radius: lens.radius,
                    focus_distance: lens.focus_distance,
                    across: [right, up],
                });
                (tan_half_y * aspect, tan_half_y, projection)
            }
            Projection::Orthographic { half_height, .. } => {
                (half_height * aspect, half_height, ViewProjection::Orthographic)
            }
        };
        Self {
            position,
            right: right * half_width,
            up: up * half_height,
            forward: -backward,
            projection,
            size: Vec2::new(size.width as f32, size.height as f32),
        }
    }

    /// Where all rays start, if that is one point.
    pub fn eye(&self) -> Option<Vec3> {
        matches!(self.projection, ViewProjection::Pinhole).then_some(self.position)
    }

    /// The ray through a place in the frame (pixels from the upper left corner) and, with a lens, a place on it
    /// (unit square). Its direction has unit length.
    pub fn ray(&self, place: Vec2, lens: Vec2) -> Ray {
        let at = place / self.size * 2.0 - Vec2::ONE;
        let off = self.right * at.x - self.up * at.y;
        match self.projection {
            ViewProjection::Pinhole => Ray::new(self.position, (self.forward + off).normalize()),
            ViewProjection::Lens { radius, focus_distance, across } => {
                let disk = warp::disk(lens) * radius;
                let on_lens = across[0] * disk.x + across[1] * disk.y;
                let in_focus = (self.forward + off) * focus_distance;
                Ray::new(self.position + on_lens, (in_focus - on_lens).normalize())
            }
            ViewProjection::Orthographic => Ray::new(self.position + off, self.forward),
        }
    }
}

/// A camera with a frame and a lens, at all moments of the shutter.
#[derive(Clone, Debug)]
pub struct Views {
    first: View,
    /// What the views of a camera that moves are made of.
    moving: Option<(Camera, Size, Option<LensInScene>)>,
}

impl Views {
    /// Those of a camera.
    pub fn new(camera: &Camera, size: Size, lens: Option<LensInScene>) -> Self {
        let moving = (!camera.knots.is_empty()).then(|| (camera.clone(), size, lens));
        Self { first: View::new(camera, size, lens), moving }
    }

    /// What is seen at a moment.
    #[inline]
    pub fn at(&self, moment: Moment) -> View {
        match &self.moving {
            None => self.first,
            Some((camera, size, lens)) => {
                View::from(camera.stand_at(moment), camera.projection, *size, *lens)
            }
        }
    }
}

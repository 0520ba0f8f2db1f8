//! Where a picture is taken from.

use crate::scene::bounds::Bounds;
use crate::trace::moment::Moment;
use glam::{DAffine3, DMat3, DVec3, Vec3};

/// Where a picture is taken from, in the scene's space.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name of its node, or its own where the node has none.
    pub name: String,
    /// The eye.
    pub position: Vec3,
    /// To the right of the picture. The axes are unit vectors and at right angles unless the node shears,
    /// scales unevenly or mirrors; `backward` always has unit length.
    pub right: Vec3,
    /// To the top of the picture.
    pub up: Vec3,
    /// Away from what is seen.
    pub backward: Vec3,
    /// How directions spread.
    pub projection: Projection,
    /// Where it is at each knot; empty of one that stands. The first is that above.
    pub knots: Vec<Stand>,
}

/// Where a camera stands and looks: as in [`Camera`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// The eye.
    pub position: Vec3,
    /// To the right, to the top and away from what is seen.
    pub axes: [Vec3; 3],
}

/// How directions spread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// From one point.
    Perspective {
        /// Tangent of half the vertical angle of view.
        tan_half_y: f32,
        /// Width over height; the picture decides where it is `None`.
        aspect: Option<f32>,
    },
    /// All parallel.
    Orthographic {
        /// Half the width, in scene units.
        half_width: f32,
        /// Half the height, in scene units.
        half_height: f32,
    },
}

impl Camera {
    /// From a node's transform in the scene's space; `None` where it flattens space or is not finite.
    /// A perspective camera does not depend on the scale; an orthographic one's size is multiplied by
    /// that along its axis.
    pub fn placed(name: String, to_world: &DAffine3, projection: Projection) -> Option<Self> {
        let matrix = to_world.matrix3;
        let length = matrix.z_axis.length();
        let unit = DMat3::from_cols(matrix.x_axis / length, matrix.y_axis / length, matrix.z_axis / length);
        let position = to_world.translation.as_vec3();
        if !(unit.is_finite() && position.is_finite() && unit.determinant().abs() > 1e-12) {
            return None;
        }
        let projection = match projection {
            Projection::Orthographic { half_width, half_height } => Projection::Orthographic {
                half_width: (f64::from(half_width) * length) as f32,
                half_height: (f64::from(half_height) * length) as f32,
            },
            perspective @ Projection::Perspective { .. } => perspective,
        };
        let [right, up, backward] = [unit.x_axis, unit.y_axis, unit.z_axis].map(DVec3::as_vec3);
        Some(Self { name, position, right, up, backward, projection, knots: Vec::new() })
    }

    /// Where it stands, at the first knot.
    pub fn stand(&self) -> Stand {
        Stand { position: self.position, axes: [self.right, self.up, self.backward] }
    }

    /// Where it stands at a moment. Between knots the eye goes straight; axes turn along the chord, with lengths
    /// between those at the knots.
    pub fn stand_at(&self, moment: Moment) -> Stand {
        if self.knots.is_empty() {
            return self.stand();
        }
        let [a, b] = moment.ends(&self.knots);
        let axis = |i: usize| {
            let length = moment.number(a.axes[i].length(), b.axes[i].length());
            let chord = moment.vector(a.axes[i], b.axes[i]);
            chord.try_normalize().map_or(a.axes[i], |unit| unit * length)
        };
        Stand { position: moment.vector(a.position, b.position), axes: [axis(0), axis(1), axis(2)] }
    }

    /// A camera that sees all of `bounds` (in scene units) from in front, a little right and above, for
    /// scenes without one.
    pub fn framed(bounds: &Bounds) -> Self {
        let tan_half_y = 0.414_213_57_f64; // 45° from bottom to top
        let (centre, radius) = if bounds.is_empty() {
            (DVec3::ZERO, 1.0)
        } else {
            (bounds.centre(), bounds.radius().max(1e-30))
        };
        let backward = DVec3::new(0.45, 0.35, 1.0).normalize();
        let right = DVec3::Y.cross(backward).normalize();
        let up = backward.cross(right);
        // The sphere touches the upper and lower edge of the picture at sin = radius / distance.
        let sin_half = tan_half_y / (1.0 + tan_half_y * tan_half_y).sqrt();
        let position = centre + backward * (radius / sin_half);
        Self {
            name: "framed".to_owned(),
            position: position.as_vec3(),
            right: right.as_vec3(),
            up: up.as_vec3(),
            backward: backward.as_vec3(),
            projection: Projection::Perspective { tan_half_y: tan_half_y as f32, aspect: None },
            knots: Vec::new(),
        }
    }

    /// Width over height that the camera asks for.
    pub fn aspect(&self) -> Option<f32> {
        match self.projection {
            Projection::Perspective { aspect, .. } => aspect,
            Projection::Orthographic { half_width, half_height } => Some(half_width / half_height),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_framed_camera_sees_every_corner() {
        let bounds = Bounds { lower: DVec3::new(-3.0, 1.0, 5.0), upper: DVec3::new(4.0, 2.0, 6.0) };
        let camera = Camera::framed(&bounds);
        let Projection::Perspective { tan_half_y, .. } = camera.projection else { panic!() };
        for corner in 0..8 {
            let pick = |a: usize| if corner >> a & 1 == 0 { bounds.lower[a] } else { bounds.upper[a] } as f32;
            let d = Vec3::new(pick(0), pick(1), pick(2)) - camera.position;
            let depth = -d.dot(camera.backward);
            assert!(depth > 0.0 && d.dot(camera.up).abs() <= depth * tan_half_y);
        }
    }

    #[test]
    fn a_flattening_node_is_no_camera() {
        let flat = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
        let projection = Projection::Perspective { tan_half_y: 0.5, aspect: None };
        assert_eq!(Camera::placed(String::new(), &flat, projection), None);
    }
}

//! Orthonormal frames around a normal.

use glam::Vec3;

/// A right-handed orthonormal frame; `z` is the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First tangent.
    pub x: Vec3,
    /// Second tangent, `z × x`.
    pub y: Vec3,
    /// Normal.
    pub z: Vec3,
}

impl Frame {
    /// The frame around a unit normal, continuous but at `z = 0` (Duff et al. 2017, "Building an
    /// Orthonormal Basis, Revisited").
    pub fn around(z: Vec3) -> Self {
        let sign = 1.0_f32.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        let x = Vec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x);
        let y = Vec3::new(b, sign + z.y * z.y * a, -z.y);
        Self { x, y, z }
    }

    /// The frame around a unit normal whose `x` is `tangent` made orthogonal; any frame around
    /// `z` where `tangent` is parallel to it.
    pub fn with_tangent(z: Vec3, tangent: Vec3) -> Self {
        let across = tangent - z * z.dot(tangent);
        match across.try_normalize() {
            Some(x) => Self { x, y: z.cross(x), z },
            None => Self::around(z),
        }
    }

    /// World to frame.
    #[inline]
    pub fn to_local(self, v: Vec3) -> Vec3 {
        Vec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Frame to world.
    #[inline]
    pub fn to_world(self, v: Vec3) -> Vec3 {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        for z in
            [Vec3::Z, -Vec3::Z, Vec3::X, Vec3::new(0.6, -0.0, -0.8), Vec3::new(1e-4, 0.0, -1.0).normalize()]
        {
            for frame in [Frame::around(z), Frame::with_tangent(z, Vec3::new(0.3, 0.4, 0.5))] {
                assert!((frame.x.cross(frame.y) - frame.z).length() < 1e-6, "{frame:?}");
                assert!((frame.x.length() - 1.0).abs() < 1e-6 && (frame.y.length() - 1.0).abs() < 1e-6);
                let v = Vec3::new(0.1, -0.7, 0.4);
                assert!((frame.to_world(frame.to_local(v)) - v).length() < 1e-6);
            }
        }
    }
}

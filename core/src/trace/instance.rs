//! A mesh put into the world.

use super::bounds::Bounds;
use super::build_error::LARGEST_COORDINATE;
use super::prepared::Prepared;
use super::ray::Ray;
use crate::math::robust::gamma;
use glam::{Affine3A, DMat3, DVec3, Vec3};

/// Which mesh stands where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Index of the mesh.
    pub mesh: u32,
    /// From the mesh's space to the world's. Exactly the identity costs no ray anything.
    pub to_world: Affine3A,
}

/// A placement with what rays need of it.
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    /// Index of the mesh.
    pub mesh: u32,
    /// From the mesh's space to the world's.
    pub to_world: Affine3A,
    /// `None` where `to_world` is the identity and stays so.
    pub moved: Option<Moved>,
    /// Its number among those that move, or [`STANDS`].
    pub(super) motion: u32,
}

/// No motion has this number.
pub(super) const STANDS: u32 = u32::MAX;

/// What follows from a transform that is not the identity. Matrices are rows.
#[derive(Clone, Copy, Debug)]
pub struct Moved {
    /// The linear part of `to_world`.
    linear: [Vec3; 3],
    /// Its inverse, made in f64.
    inverse: [Vec3; 3],
    /// |linear| · |inverse|: how an error made on the way into the mesh's space looks in the world.
    round_trip: [Vec3; 3],
    translation: Vec3,
    /// Whether the transform is a mirror.
    mirrored: bool,
}

impl Instance {
    /// `None` where the transform is not finite or cannot be inverted.
    pub(super) fn new(placement: Placement) -> Option<Self> {
        let Placement { mesh, to_world } = placement;
        let moved = if to_world == Affine3A::IDENTITY { None } else { Some(Moved::new(to_world)?) };
        Some(Self { mesh, to_world, moved, motion: STANDS })
    }

    /// What goes from transform to transform, of which `first` is one and `motion` its number among those that move.
    pub(super) fn moving(mesh: u32, first: Affine3A, motion: u32) -> Option<Self> {
        Some(Self { mesh, to_world: first, moved: Some(Moved::new(first)?), motion })
    }

    /// The box around the mesh's box on its way along the transforms of `knots`, rounded outward; `None` where it leaves
    /// 2⁶⁰ or a transform cannot be inverted.
    pub(super) fn bounds_on(knots: &[Affine3A], mesh: Bounds) -> Option<Bounds> {
        if mesh.is_empty() {
            return Some(mesh);
        }
        let mut all = Bounds::EMPTY;
        for &knot in knots {
            all = all.union(Moved::new(knot)?.bounds(mesh));
        }
        // Halfway between knots the inverse may be larger than at them, and so its rounding, which is 2⁻²² of the way
        // from the origin at a knot.
        let room = Vec3::splat(all.reach() * (1.0 / (1 << 19) as f32));
        let all = Bounds { min: all.min - room, max: all.max + room };
        (all.reach() <= LARGEST_COORDINATE).then_some(all)
    }

    /// The box around the mesh's box in the world, rounded outward; `None` where it leaves 2⁶⁰.
    pub(super) fn world_bounds(&self, mesh: Bounds) -> Option<Bounds> {
        let bounds = match &self.moved {
            Some(moved) if !mesh.is_empty() => moved.bounds(mesh),
            _ => return Some(mesh),
        };
        (bounds.reach() <= LARGEST_COORDINATE).then_some(bounds)
    }
}

impl Moved {
    /// `None` where the transform is not finite or cannot be inverted.
    pub fn new(to_world: Affine3A) -> Option<Self> {
        let matrix = DMat3::from_cols(
            to_world.matrix3.x_axis.as_dvec3(),
            to_world.matrix3.y_axis.as_dvec3(),
            to_world.matrix3.z_axis.as_dvec3(),
        );
        let determinant = matrix.determinant();
        if determinant == 0.0 || !determinant.is_finite() || !to_world.translation.is_finite() {
            return None;
        }
        let linear = rows(matrix);
        let inverse = rows(matrix.inverse());
        if !inverse.iter().all(|row| row.is_finite()) || inverse.contains(&Vec3::ZERO) {
            return None;
        }
        let columns = [0, 1, 2].map(|c| Vec3::from_array([0, 1, 2].map(|r: usize| inverse[r][c].abs())));
        let round_trip = linear.map(|row| Vec3::from_array(columns.map(|column| row.abs().dot(column))));
        let translation = Vec3::from(to_world.translation);
        Some(Self { linear, inverse, round_trip, translation, mirrored: determinant < 0.0 })
    }

    /// A ray's origin in the mesh's space.
    #[inline]
    pub(super) fn point_inward(&self, point: Vec3) -> Vec3 {
        product(&self.inverse, point - self.translation)
    }

    /// A ray's direction in the mesh's space, not normalised: `t` stays what it is.
    #[inline]
    pub(super) fn direction_inward(&self, direction: Vec3) -> Vec3 {
        product(&self.inverse, direction)
    }

    /// A ray in the mesh's space; `None` where it cannot hit anything.
    #[inline]
    pub(super) fn ray_inward(&self, ray: &Ray) -> Option<Prepared> {
        Prepared::new(self.point_inward(ray.origin), self.direction_inward(ray.direction), ray.t_max)
    }

    /// A point of the mesh, known within `error`, in the world, and how far from there a ray must start so that
    /// it is on the right side after [`Moved::point_inward`] rounds it.
    pub(super) fn point_outward(&self, point: Vec3, error: Vec3) -> (Vec3, Vec3) {
        let turned = product(&self.linear, point);
        let magnitude = self.linear.map(|row| row.abs().dot(point.abs()));
        let carried = self.linear.map(|row| row.abs().dot(error));
        let back = self.round_trip.map(|row| row.dot(turned.abs()));
        let rounding = gamma(4.0) * (Vec3::from_array(magnitude) + self.translation.abs());
        let error = Vec3::from_array(carried) + rounding + gamma(7.0) * Vec3::from_array(back);
        // The bound itself was rounded.
        (turned + self.translation, error * (1.0 + gamma(8.0)))
    }

    /// An edge of the mesh in the world.
    #[inline]
    pub(super) fn edge_outward(&self, edge: DVec3) -> DVec3 {
        DVec3::from_array(self.linear.map(|row| row.as_dvec3().dot(edge)))
    }

    /// Whether the transform is a mirror.
    #[inline]
    pub(super) fn mirrors(&self) -> bool {
        self.mirrored
    }

    /// The box around the mesh's box, rounded outward.
    pub(super) fn bounds(&self, mesh: Bounds) -> Bounds {
        let (mut min, mut max) = (Vec3::ZERO, Vec3::ZERO);
        for axis in 0..3 {
            let row = self.linear[axis].as_dvec3();
            let (a, b) = (row * mesh.min.as_dvec3(), row * mesh.max.as_dvec3());
            let shift = f64::from(self.translation[axis]);
            // Rays go into the mesh's space by the rounded inverse, at some units of these magnitudes.
            let magnitude =
                f64::from(self.round_trip[axis].dot(Vec3::ONE)) * a.abs().max(b.abs()).element_sum();
            let rounding = (magnitude + shift.abs()) * (1.0 / (1 << 22) as f64);
            min[axis] = (a.min(b).element_sum() + shift - rounding) as f32;
            max[axis] = (a.max(b).element_sum() + shift + rounding) as f32;
        }
        Bounds { min, max }
    }
}

fn rows(matrix: DMat3) -> [Vec3; 3] {
    [0, 1, 2].map(|r| matrix.row(r).as_vec3())
}

#[inline]
fn product(rows: &[Vec3; 3], v: Vec3) -> Vec3 {
    // Spelt out: glam's dot product rounds differently with and without SIMD.
    let dot = |row: &Vec3| row.z.mul_add(v.z, row.y.mul_add(v.y, row.x * v.x));
    Vec3::new(dot(&rows[0]), dot(&rows[1]), dot(&rows[2]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Quat;

    fn instance(to_world: Affine3A) -> Option<Instance> {
        Instance::new(Placement { mesh: 0, to_world })
    }

    #[test]
    fn only_the_identity_is_free() {
        assert!(instance(Affine3A::IDENTITY).unwrap().moved.is_none());
        assert!(instance(Affine3A::from_translation(Vec3::X)).unwrap().moved.is_some());
    }

    #[test]
    fn refuses_what_cannot_be_inverted() {
        assert!(instance(Affine3A::from_scale(Vec3::new(1.0, 0.0, 1.0))).is_none());
        assert!(instance(Affine3A::from_scale(Vec3::splat(f32::NAN))).is_none());
        assert!(instance(Affine3A::from_translation(Vec3::splat(f32::INFINITY))).is_none());
        assert!(instance(Affine3A::from_scale(Vec3::splat(1e-12))).is_some());
    }

    #[test]
    fn points_go_out_and_back_within_the_error() {
        let rotation = Quat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
        let to_world = Affine3A::from_scale_rotation_translation(
            Vec3::new(3.0, 0.01, -2.0),
            rotation,
            Vec3::new(1000.0, -30.0, 0.5),
        );
        let moved = instance(to_world).unwrap().moved.unwrap();
        let point = Vec3::new(0.3, -40.0, 7.0);
        let (world, error) = moved.point_outward(point, Vec3::ZERO);
        let exact = to_world.matrix3.as_dmat3() * point.as_dvec3() + to_world.translation.as_dvec3();
        assert!((world.as_dvec3() - exact).abs().cmple(error.as_dvec3()).all());
        let back = moved.point_inward(world);
        let difference = to_world.matrix3.as_dmat3() * (back.as_dvec3() - point.as_dvec3());
        assert!(difference.abs().cmple(error.as_dvec3()).all(), "{difference} {error}");
        assert!(error.max_element() < 1e-3);
    }
}

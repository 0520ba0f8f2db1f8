//! Charts of the sphere in which microfacet lobes are smooth, however narrow.

use glam::{DVec3, Vec3};
use std::f64::consts::TAU;

/// Directions on one side of the surface by the facet normal that sends `wo` there: the logarithm of its slope
/// and its azimuth, both over 0..1. All in f64 and with derivatives by differences, so that no
/// density formula of the room is used to test itself.
pub(super) struct Chart {
    /// With z > 0; `flip` is the sign of the z that it has.
    wo: DVec3,
    flip: f64,
    kind: Kind,
    /// Logarithms of the least and the greatest slope.
    range: (f64, f64),
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Kind {
    /// The side of `wo`.
    Mirrored,
    /// The other side, as through a thin sheet.
    Through,
    /// The other side, refracted with this relative index.
    Refracted(f64),
    /// What of the other side no facet refracts to; by the normal as for `Through`.
    Beyond(f64),
}

impl Chart {
    pub(super) fn new(wo: Vec3, alpha: f32, kind: Kind) -> Self {
        let wo = wo.as_dvec3().normalize();
        let range = (libm::log(f64::from(alpha) * 1e-2), libm::log(1e3));
        Self { wo: wo.with_z(wo.z.abs()), flip: wo.z.signum(), kind, range }
    }

    /// `None` where the facet sends nothing to this side.
    pub(super) fn direction(&self, a: f64, b: f64) -> Option<DVec3> {
        let wi = self.unlimited(a, b)?;
        let refracted = matches!(self.kind, Kind::Refracted(_));
        let turned = if refracted || self.kind == Kind::Mirrored { self.flip } else { -self.flip };
        let direction = wi.with_z(wi.z * turned);
        ((wi.z < 0.0) == refracted && self.covers(direction)).then_some(direction)
    }

    fn unlimited(&self, a: f64, b: f64) -> Option<DVec3> {
        let slope = libm::exp(self.range.0 + (self.range.1 - self.range.0) * a);
        let (sin, cos) = libm::sincos(TAU * b);
        let normal = DVec3::new(slope * cos, slope * sin, 1.0).normalize();
        let dot = self.wo.dot(normal);
        if dot <= 0.0 {
            return None;
        }
        match self.kind {
            Kind::Mirrored | Kind::Through | Kind::Beyond(_) => Some(2.0 * dot * normal - self.wo),
            Kind::Refracted(eta) => {
                let squared = 1.0 - (1.0 - dot * dot) / (eta * eta);
                (squared > 0.0).then(|| normal * (dot / eta - squared.sqrt()) - self.wo / eta)
            }
        }
    }

    /// Solid angle of a unit of the chart.
    pub(super) fn solid_angle(&self, a: f64, b: f64) -> f64 {
        let step = 1e-6;
        let along = |a0, b0, a1, b1| Some((self.unlimited(a1, b1)? - self.unlimited(a0, b0)?) / (2.0 * step));
        match (along(a - step, b, a + step, b), along(a, b - step, a, b + step)) {
            (Some(da), Some(db)) => da.cross(db).length(),
            _ => 0.0,
        }
    }

    /// The inverse of [`Self::direction`], of a direction on its side; the first number may be
    /// outside 0..1.
    pub(super) fn locate(&self, wi: Vec3) -> (f64, f64) {
        let wi = wi.as_dvec3().normalize();
        let normal = match self.kind {
            Kind::Mirrored | Kind::Through | Kind::Beyond(_) => self.wo + wi.with_z(wi.z.abs()),
            Kind::Refracted(eta) => {
                let normal = self.wo + wi.with_z(-wi.z.abs()) * eta;
                normal * normal.z.signum()
            }
        };
        let slope = libm::hypot(normal.x, normal.y) / normal.z;
        let a = (libm::log(slope) - self.range.0) / (self.range.1 - self.range.0);
        (a, (libm::atan2(normal.y, normal.x) / TAU).rem_euclid(1.0))
    }

    /// Whether a direction is of this chart.
    pub(super) fn covers(&self, wi: DVec3) -> bool {
        let wi = wi.with_z(wi.z * self.flip);
        match self.kind {
            Kind::Mirrored => wi.z > 0.0,
            Kind::Through => wi.z < 0.0,
            Kind::Refracted(eta) => wi.z < 0.0 && self.is_refracted(wi, eta),
            Kind::Beyond(eta) => wi.z < 0.0 && !self.is_refracted(wi, eta),
        }
    }

    fn is_refracted(&self, wi: DVec3, eta: f64) -> bool {
        let half = self.wo + wi * eta;
        let normal = half * half.z.signum();
        self.wo.dot(normal) > 0.0 && wi.dot(normal) < 0.0
    }
}

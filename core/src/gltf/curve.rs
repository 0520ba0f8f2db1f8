//! A value over time: an animation's sampler.

use crate::gltf::accessor::Accessor;
use glam::{DQuat, DVec3, DVec4};

/// How values between key frames are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Interpolation {
    Step,
    Linear,
    CubicSpline,
}

/// Which value counts at the very time of a jump.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Before,
    After,
}

/// Key frames and their values, left where they are in the buffers. Times are finite and rise strictly, there is at least
/// one, and there are as many values as they need.
#[derive(Clone)]
pub(crate) struct Curve<'a> {
    pub(crate) times: Accessor<'a>,
    pub(crate) values: Accessor<'a>,
    pub(crate) interpolation: Interpolation,
    /// Elements of `values` that make one value: as many as there are morph targets, else one.
    pub(crate) width: usize,
}

/// Where a time falls among key frames.
#[derive(Clone, Copy)]
enum Place {
    /// A key frame's value holds.
    At(usize),
    /// Between `key` and the next: the share of the `span` in seconds that has passed.
    Between { key: usize, share: f64, span: f64 },
}

/// The parts of a key frame, in the order of a cubic spline's elements.
#[derive(Clone, Copy)]
enum Part {
    InTangent,
    Value,
    OutTangent,
}

impl Interpolation {
    /// Values a key frame.
    pub(crate) fn parts(self) -> usize {
        if self == Self::CubicSpline { 3 } else { 1 }
    }
}

impl Curve<'_> {
    /// The time of a key frame, in seconds.
    pub(crate) fn time(&self, key: usize) -> f64 {
        f64::from(self.times.get::<1>(key)[0])
    }

    /// Times of the key frames between two times, without these.
    pub(crate) fn between(&self, open: f64, close: f64) -> impl Iterator<Item = f64> + '_ {
        (self.passed(open, Side::After)..self.passed(close, Side::Before)).map(|key| self.time(key))
    }

    /// Key frames before `time`, or up to it.
    fn passed(&self, time: f64, side: Side) -> usize {
        let (mut low, mut high) = (0, self.times.count);
        while low < high {
            let middle = low.midpoint(high);
            let at = self.time(middle);
            if at < time || (at <= time && side == Side::After) { low = middle + 1 } else { high = middle }
        }
        low
    }

    fn place(&self, time: f64, side: Side) -> Place {
        let passed = self.passed(time, side);
        if passed == 0 || passed == self.times.count {
            return Place::At(passed.saturating_sub(1));
        }
        let (start, end) = (self.time(passed - 1), self.time(passed));
        match self.interpolation {
            Interpolation::Step => Place::At(passed - 1),
            Interpolation::Linear | Interpolation::CubicSpline => {
                let span = end - start;
                Place::Between { key: passed - 1, share: (time - start) / span, span }
            }
        }
    }

    /// Four numbers of a value, from its element `element` on; those it does not have are zero.
    fn element(&self, key: usize, part: Part, element: usize) -> DVec4 {
        let part = match self.interpolation {
            Interpolation::CubicSpline => part as usize,
            Interpolation::Step | Interpolation::Linear => 0,
        };
        let index = (key * self.interpolation.parts() + part) * self.width + element;
        DVec4::from(self.values.get::<4>(index).map(f64::from))
    }

    /// Appendix C.5 of glTF 2.0: Hermite's spline, its tangents multiplied by the span.
    fn cubic(&self, key: usize, t: f64, span: f64, element: usize) -> DVec4 {
        let (t2, t3) = (t * t, t * t * t);
        self.element(key, Part::Value, element) * (2.0 * t3 - 3.0 * t2 + 1.0)
            + self.element(key, Part::OutTangent, element) * (span * (t3 - 2.0 * t2 + t))
            + self.element(key + 1, Part::Value, element) * (3.0 * t2 - 2.0 * t3)
            + self.element(key + 1, Part::InTangent, element) * (span * (t3 - t2))
    }

    fn at(&self, time: f64, side: Side, element: usize) -> DVec4 {
        match self.place(time, side) {
            Place::At(key) => self.element(key, Part::Value, element),
            Place::Between { key, share, span } if self.interpolation == Interpolation::CubicSpline => {
                self.cubic(key, share, span, element)
            }
            Place::Between { key, share, .. } => {
                let (a, b) =
                    (self.element(key, Part::Value, element), self.element(key + 1, Part::Value, element));
                a * (1.0 - share) + b * share
            }
        }
    }

    /// A vector at a time.
    pub(crate) fn vector(&self, time: f64, side: Side) -> DVec3 {
        self.at(time, side, 0).truncate()
    }

    /// A weight for each morph target at a time.
    pub(crate) fn weights(&self, time: f64, side: Side) -> Vec<f64> {
        (0..self.width).map(|i| self.at(time, side, i).x).collect()
    }

    /// A unit quaternion at a time: linear is the shorter arc at constant speed.
    pub(crate) fn rotation(&self, time: f64, side: Side) -> DQuat {
        let unit = |v: DVec4| DQuat::from_vec4(v.try_normalize().unwrap_or(DVec4::W));
        match self.place(time, side) {
            Place::Between { key, share, .. } if self.interpolation == Interpolation::Linear => slerp(
                unit(self.element(key, Part::Value, 0)),
                unit(self.element(key + 1, Part::Value, 0)),
                share,
            ),
            _ => unit(self.at(time, side, 0)),
        }
    }

    /// Whether the value is the same at all times between two.
    pub(crate) fn is_still(&self, open: f64, close: f64) -> bool {
        let first = self.passed(open, Side::After).saturating_sub(1);
        let last = match self.interpolation {
            Interpolation::Step => self.passed(close, Side::Before).saturating_sub(1).max(first),
            _ => self.passed(close, Side::Before).min(self.times.count - 1),
        };
        let elements = || 0..self.width;
        let same = |key: usize| {
            elements().all(|i| self.element(key, Part::Value, i) == self.element(first, Part::Value, i))
        };
        let flat = |key: usize| {
            let zero = |part| elements().all(|i| self.element(key, part, i) == DVec4::ZERO);
            self.interpolation != Interpolation::CubicSpline
                || (zero(Part::InTangent) && zero(Part::OutTangent))
        };
        open >= close || first >= last || (first..=last).all(|key| same(key) && flat(key))
    }
}

/// Appendix C.4 of glTF 2.0; nearly the same rotations are mixed, because the angle between them is lost.
fn slerp(a: DQuat, b: DQuat, share: f64) -> DQuat {
    let dot = a.dot(b);
    let (b, dot) = if dot < 0.0 { (-b, -dot) } else { (b, dot) };
    if dot > 1.0 - 1e-12 {
        return (a * (1.0 - share) + b * share).normalize();
    }
    let angle = libm::acos(dot.min(1.0));
    let mix = a * libm::sin(angle * (1.0 - share)) + b * libm::sin(angle * share);
    mix.normalize()
}

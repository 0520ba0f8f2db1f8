//! Weights by recursion along both subpaths (Georgiev 2012, "Implementing Vertex Connection and Merging", eqs. 31–55,
//! without merging).
//!
//! With p→ the density with which a subpath made a vertex and p← that with which it is made from the other end, a vertex
//! keeps two numbers which together give the sum over all techniques that end further back on its own side, relative to
//! the one that ends here. Distances and cosines enter step by step; cosines are those of geometric normals. In f64: the
//! numbers are areas, and products over whole paths.

use crate::path::mis::heuristic::Heuristic;

/// Smaller cosines are taken for this: the reciprocal of its square is still a number.
const COS_MIN: f64 = 1e-30;

/// What is behind a vertex of a subpath.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Partial {
    /// Georgiev's dVCM: of the technique that ends one vertex back, 1 / p→ of this vertex.
    pub near: f64,
    /// Georgiev's dVC: of all that end further back, still to be multiplied with p← of the vertex before.
    pub far: f64,
}

impl Partial {
    /// The subpath reaches a surface at the cosine `cos`, over the squared distance `squared` (1 for light from infinitely
    /// far, whose density is one over area already).
    #[inline]
    pub fn arrive(&mut self, h: Heuristic, squared: f64, cos: f64) {
        let over_cos = h.of(1.0 / cos.max(COS_MIN));
        self.near *= h.of(squared) * over_cos;
        self.far *= over_cos;
    }

    /// It goes on at the cosine `cos` by a choice of density `forward` over solid angle; `reverse` is the density of the
    /// way it came, seen from there.
    #[inline]
    pub fn scatter(&mut self, h: Heuristic, forward: f64, reverse: f64, cos: f64) {
        self.far = h.of(cos / forward) * (self.far * h.of(reverse) + self.near);
        self.near = h.of(1.0 / forward);
    }

    /// It goes on by a Dirac delta: no technique can end here, and both directions are alike.
    #[inline]
    pub fn scatter_specular(&mut self, h: Heuristic, cos: f64) {
        self.far *= h.of(cos);
        self.near = 0.0;
    }

    /// All techniques that end further back than here, relative to the one that joins this vertex to another: `onto` is
    /// the density over area with which that other side would make this vertex, `reverse` that over solid angle with which
    /// it would go on from here the way this subpath came.
    #[inline]
    pub fn behind(&self, h: Heuristic, onto: f64, reverse: f64) -> f64 {
        h.of(onto) * (self.near + self.far * h.of(reverse))
    }
}

//! The tree of a path expression.

use crate::bsdf::event::{Letter, Letters};

/// `S`: a mirror is glossy, too.
pub(super) const GLOSSY_OR_SPECULAR: Letters =
    Letters::of(Letter::Glossy).union(Letters::of(Letter::Specular));

/// A part of an expression.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Node {
    /// One letter, written at the character `at`.
    Letter { symbol: Symbol, at: usize },
    /// One after the other.
    Sequence(Vec<Node>),
    /// One of them.
    Choice(Vec<Node>),
    /// `least` times or more, `most` times at most; written at the character `at`.
    Repeat { inner: Box<Node>, least: u32, most: Option<u32>, at: usize },
}

/// What a letter stands for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Symbol {
    /// Any light, or the lights of a name.
    Light(Option<String>),
    /// The eye.
    Eye,
    /// A scattering with one of these letters.
    Scattering(Letters),
}

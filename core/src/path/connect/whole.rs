//! A whole path's densities from those of its two subpaths and their joint.

use crate::path::mis::exhaustive::{Link, PathDensity};

/// Densities that only the joint of two subpaths decides.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Joint {
    /// Of the last eye vertex, from the light's side.
    pub eye_end: f64,
    /// Of the eye vertex before.
    pub before_eye_end: f64,
    /// Of the last light vertex, from the eye's side.
    pub light_end: f64,
    /// Of the light vertex before.
    pub before_light_end: f64,
}

/// The path from the light to the lens.
pub fn whole(light: &[Link], eye: &[Link], joint: Joint) -> Vec<PathDensity> {
    let one =
        |link: &Link, from_light, from_eye| PathDensity { from_light, from_eye, specular: link.specular };
    let turned = |i: usize, n: usize, link: &Link, [end, before]: [f64; 2]| match n - i {
        1 => end,
        2 => before,
        _ => link.reverse,
    };
    let lights = light.iter().enumerate().map(|(i, link)| {
        one(link, link.forward, turned(i, light.len(), link, [joint.light_end, joint.before_light_end]))
    });
    let eyes = eye.iter().enumerate().rev().map(|(i, link)| {
        one(link, turned(i, eye.len(), link, [joint.eye_end, joint.before_eye_end]), link.forward)
    });
    lights.chain(eyes).collect()
}

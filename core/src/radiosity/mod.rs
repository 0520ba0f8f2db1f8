//! Light that is only scattered diffusely, by finite elements: the words `LD*E`.
//!
//! Triangles are cut into patches; each side of a patch is an element. With Hᵢ the light that arrives at element i,
//! as the mean of the radiance over directions by their cosine, and ρᵢ its reflectance,
//!
//! Hᵢ = Dᵢ + Σⱼ Fᵢⱼ ρⱼ Hⱼ,
//!
//! D straight from lights and F the form factors. An element's radiance is its emission and ρ H; its radiosity is π times that.

pub mod element;
pub mod fineness;
pub mod form_factor;
pub mod hemisphere;
pub mod interpolate;
pub mod particles;
pub mod patch;
pub mod refine;
pub mod reflectance;
pub mod report;
pub mod solution;
pub mod solve;

//! What a point of an element looks like when its light is solved.

use crate::bsdf::Bsdf;
use crate::math::colour::Rgb;
use crate::radiosity::element::Element;
use crate::radiosity::reflectance;
use crate::radiosity::solution::Solution;
use crate::scene::data::SceneData;
use crate::scene::material::SurfaceCoordinates;
use crate::trace::moment::Moment;
use glam::{Vec2, Vec4};

/// What a point of an element looks like.
#[derive(Clone, Copy, Debug)]
pub struct Appearance {
    /// Radiance that leaves it, emission included.
    pub radiance: Rgb,
    /// What to multiply the material's base colour (factor and texture, not that of vertices) with to get the
    /// scattered part of it; with the alpha of the vertex colour.
    pub over_base: Vec4,
    /// Share of what is behind that it covers.
    pub alpha: f32,
    /// Where on its textures it lies.
    pub at: SurfaceCoordinates,
}

impl Appearance {
    /// Of the point of an element with the given weights of its second and third corner.
    pub fn at(data: &SceneData, solution: &Solution, element: Element, local: Vec2) -> Self {
        let patch = &solution.patches().all()[element.patch().index()];
        let at = data.interaction(patch.instance, patch.triangle, patch.on_triangle(local), Moment::STILL);
        let arriving = solution.arriving(element, local);
        let mut surface = at.surface();
        let own = reflectance::mean(&Bsdf::from_surface(&surface));
        surface.base_color = Rgb::ONE;
        let white = reflectance::mean(&Bsdf::from_surface(&surface));
        let colour = at.at.colour;
        if let Some(shown) = at.shown() {
            let over_base = colour.truncate().extend(colour.w.clamp(0.0, 1.0));
            return Self { radiance: shown, over_base, alpha: at.alpha(), at: at.at };
        }
        Self {
            radiance: at.emission(element.side()) + own * arriving,
            over_base: (white * arriving * colour.truncate()).extend(colour.w.clamp(0.0, 1.0)),
            alpha: at.alpha(),
            at: at.at,
        }
    }
}

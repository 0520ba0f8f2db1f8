//! Light goes both ways, and both ways through one function.

use super::*;
use crate::bsdf::event::{SampleKind, Scattered, Transport};

fn assert_same(a: Scattered, scale_a: f32, b: Scattered, scale_b: f32, what: &str) {
    for (a, b) in [(a.diffuse, b.diffuse), (a.glossy, b.glossy)] {
        let (a, b) = (a * scale_a, b * scale_b);
        let error = (a - b).abs().max_element();
        assert!(error <= 2e-4 * a.max_element().max(b.max_element()) + 1e-12, "{a} and {b}: {what}");
    }
}

#[test]
fn every_surface_is_reciprocal() {
    let mut uniform = Uniform(11);
    let mut transmitted = 0;
    for i in 0..40_000 {
        let surface = if i % 2 == 0 { uniform.surface() } else { uniform.layered() };
        let bsdf = Bsdf::from_surface(&surface);
        let (wo, wi) = (uniform.direction(), uniform.direction());
        let what = format!("{wo} {wi} {surface:?}");
        let there = bsdf.eval(wo, wi, Transport::Radiance);
        let back = bsdf.eval(wi, wo, Transport::Radiance);
        let index = |w: Vec3| if w.z < 0.0 && surface.walls == Walls::Solid { surface.ior } else { 1.0 };
        let squared = |w: Vec3| index(w) * index(w);
        assert_same(there, squared(wi) / wi.z.abs(), back, squared(wo) / wo.z.abs(), &what);
        let adjoint = bsdf.eval(wi, wo, Transport::Importance);
        assert_same(there, 1.0 / wi.z.abs(), adjoint, 1.0 / wo.z.abs(), &what);
        transmitted += u32::from(wo.z * wi.z < 0.0 && there.glossy.max_element() > 0.0);
    }
    assert!(transmitted > 2000, "{transmitted}");
}

#[test]
fn a_sample_carries_what_eval_and_pdf_say() {
    let mut uniform = Uniform(3);
    let mut smooth = 0;
    for i in 0..40_000 {
        let bsdf = Bsdf::from_surface(&if i % 2 == 0 { uniform.surface() } else { uniform.layered() });
        let wo = uniform.direction();
        let Some(sample) = bsdf.sample(wo, uniform.next(), uniform.pair(), Transport::Radiance) else {
            continue;
        };
        assert!((sample.wi.length() - 1.0).abs() < 1e-5);
        let SampleKind::Smooth { value, pdf } = sample.kind else { continue };
        assert_eq!(value, bsdf.eval(wo, sample.wi, Transport::Radiance));
        assert_eq!(pdf, bsdf.pdf(wo, sample.wi));
        assert!(bsdf.pdf(sample.wi, wo) > 0.0, "no way back from {} to {wo} on {bsdf:?}", sample.wi);
        smooth += 1;
    }
    assert!(smooth > 20_000, "{smooth}");
}

/// A coat with a normal of its own is adjoint to itself, once light that is carried from its source is corrected for the
/// shading normal as [`crate::path::vertex::Vertex`] does it: by |wo·n wi·g| / |wo·g wi·n|, here for g = n.
#[test]
fn a_tilted_coat_is_its_own_adjoint() {
    let mut uniform = Uniform(12);
    let mut seen = 0;
    for _ in 0..20_000 {
        let mut surface = uniform.layered();
        if let Some(layers) = &mut surface.layers {
            layers.coat_normal = tilted(f64::from(uniform.next()) * 60.0, 1.0);
        }
        let bsdf = Bsdf::from_surface(&surface);
        let (wo, wi) = (uniform.direction(), uniform.direction());
        let there = bsdf.eval(wo, wi, Transport::Radiance);
        let adjoint = bsdf.eval(wi, wo, Transport::Importance);
        assert_same(there, 1.0 / wi.z.abs(), adjoint, 1.0 / wo.z.abs(), &format!("{wo} {wi} {surface:?}"));
        seen += u32::from(there.glossy.max_element() > 0.0);
    }
    assert!(seen > 5000, "{seen}");
}

#[test]
fn letters_are_those_that_occur() {
    use crate::bsdf::event::{Letter, Letters};
    assert_eq!(rough(0.2, LAMBERT).letters(), Letters::of(Letter::Diffuse));
    assert_eq!(rough(0.2, METAL).letters(), Letters::of(Letter::Glossy));
    assert_eq!(rough(9e-4, METAL).letters(), Letters::of(Letter::Specular));
    assert!(!rough(9e-4, SOLID).is_smooth_anywhere() && !rough(9e-4, SHEET).is_smooth_anywhere());
    assert!(rough(1e-3, SOLID).is_smooth_anywhere() && rough(9e-4, PLASTIC).is_smooth_anywhere());
    let mixed = rough(0.0, SurfaceParameters { metallic: 0.5, ..PLASTIC });
    assert_eq!(mixed.letters(), Letters::of(Letter::Specular).union(Letters::of(Letter::Diffuse)));
}

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

fn assert_reciprocal(surface: &SurfaceParameters, wo: Vec3, wi: Vec3) -> Scattered {
    let bsdf = Bsdf::from_surface(surface);
    let what = format!("{wo} {wi} {surface:?}");
    let there = bsdf.eval(wo, wi, Transport::Radiance);
    let back = bsdf.eval(wi, wo, Transport::Radiance);
    let index = |w: Vec3| if w.z < 0.0 && surface.walls == Walls::Solid { surface.ior } else { 1.0 };
    let squared = |w: Vec3| index(w) * index(w);
    assert_same(there, squared(wi) / wi.z.abs(), back, squared(wo) / wo.z.abs(), &what);
    let adjoint = bsdf.eval(wi, wo, Transport::Importance);
    assert_same(there, 1.0 / wi.z.abs(), adjoint, 1.0 / wo.z.abs(), &what);
    there
}

#[test]
fn every_surface_is_reciprocal() {
    let mut uniform = Uniform(11);
    let mut transmitted = 0;
    for _ in 0..20_000 {
        let surface = uniform.surface();
        let (wo, wi) = (uniform.direction(), uniform.direction());
        let there = assert_reciprocal(&surface, wo, wi);
        transmitted += u32::from(wo.z * wi.z < 0.0 && there.glossy.max_element() > 0.0);
    }
    assert!(transmitted > 1000, "{transmitted}");
}

/// Rough glass whose index is hardly another than that around it, or far from it.
#[test]
fn glass_of_any_index_is_reciprocal() {
    let mut uniform = Uniform(17);
    let mut transmitted = 0;
    for i in 0..40_000 {
        let ior = [1.0001, 1.01, 1.05, 1.1, 2.4, 10.0][i % 6];
        let surface = SurfaceParameters { roughness: 0.032 + 0.968 * uniform.next(), ior, ..SOLID };
        let (wo, wi) = (uniform.direction(), uniform.direction());
        let there = assert_reciprocal(&surface, wo, wi);
        transmitted += u32::from(wo.z * wi.z < 0.0 && there.glossy.max_element() > 0.0);
    }
    assert!(transmitted > 1000, "{transmitted}");
}

/// What lies on a surface, and what shines through it.
#[test]
fn every_layer_is_reciprocal() {
    let mut uniform = Uniform(13);
    let (mut transmitted, mut through) = (0, 0);
    for _ in 0..20_000 {
        let surface = uniform.layered();
        let (wo, wi) = (uniform.direction(), uniform.direction());
        let there = assert_reciprocal(&surface, wo, wi);
        transmitted += u32::from(wo.z * wi.z < 0.0 && there.glossy.max_element() > 0.0);
        through += u32::from(wo.z * wi.z < 0.0 && there.diffuse.max_element() > 0.0);
    }
    assert!(transmitted > 1000 && through > 500, "{transmitted} {through}");
}

/// Brushed facets and thin films.
#[test]
fn every_finish_is_reciprocal() {
    let mut uniform = Uniform(14);
    let mut reflected = 0;
    for _ in 0..20_000 {
        let surface = uniform.finished();
        let (wo, wi) = (uniform.direction(), uniform.direction());
        let there = assert_reciprocal(&surface, wo, wi);
        reflected += u32::from(wo.z * wi.z > 0.0 && there.glossy.max_element() > 1e-6);
    }
    assert!(reflected > 3000, "{reflected}");
}

#[test]
fn a_sample_carries_what_eval_and_pdf_say() {
    let mut uniform = Uniform(3);
    let mut smooth = 0;
    for i in 0..40_000 {
        let bsdf = Bsdf::from_surface(&match i % 3 {
            0 => uniform.surface(),
            1 => uniform.layered(),
            _ => uniform.finished(),
        });
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

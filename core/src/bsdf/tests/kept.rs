//! Surfaces of which only some letters are kept.

use super::energy::albedo;
use super::*;
use crate::bsdf::event::{Letter, Letters, SampleKind, Scattered, Transport};

/// Any set of letters.
fn any(uniform: &mut Uniform) -> Letters {
    let pick = |set: Letters, letter| if uniform.next() < 0.5 { set } else { set.union(Letters::of(letter)) };
    Letter::ALL.into_iter().fold(Letters::NONE, pick)
}

#[test]
fn the_parts_of_a_surface_make_the_whole() {
    let mut uniform = Uniform(21);
    for _ in 0..20_000 {
        let surface = uniform.surface();
        let (wo, wi) = (uniform.direction(), uniform.direction());
        let whole = Bsdf::from_surface(&surface).eval(wo, wi, Transport::Radiance);
        let [diffuse, glossy, specular, mirrored] = Letter::ALL
            .map(|letter| Bsdf::keeping(&surface, Letters::of(letter)).eval(wo, wi, Transport::Radiance));
        for (part, value) in [(diffuse.diffuse, whole.diffuse), (glossy.glossy, whole.glossy)] {
            let error = (part - value).abs().max_element();
            assert!(error <= 1e-5 * value.max_element(), "{part}, not {value}: {surface:?}");
        }
        assert_eq!((diffuse.glossy, glossy.diffuse), (Rgb::ZERO, Rgb::ZERO));
        assert_eq!((specular, mirrored), (Scattered::default(), Scattered::default()));
    }
}

#[test]
fn letters_are_those_of_the_surface_that_are_kept() {
    let mut uniform = Uniform(22);
    for _ in 0..2000 {
        let mut surface = uniform.surface();
        if uniform.next() < 0.3 {
            surface.roughness = 0.0;
        }
        let (own, letters) = (Bsdf::from_surface(&surface).letters(), any(&mut uniform));
        let twin = if own.has(Letter::Glossy) { Letters::of(Letter::Mirrored) } else { Letters::NONE };
        let kept = Bsdf::keeping(&surface, letters).letters();
        assert_eq!(kept, own.union(twin).intersection(letters), "{surface:?}");
    }
}

#[test]
fn a_surface_that_keeps_all_its_letters_is_the_same() {
    let mut uniform = Uniform(23);
    for _ in 0..2000 {
        let surface = uniform.surface();
        let (a, b) = (Bsdf::from_surface(&surface), Bsdf::keeping(&surface, Letters::NATURAL));
        assert_eq!(format!("{a:?}"), format!("{b:?}"));
    }
}

#[test]
fn a_sample_carries_what_the_kept_lobes_say() {
    let mut uniform = Uniform(24);
    let (mut smooth, mut specular) = (0, 0);
    for _ in 0..20_000 {
        let mut surface = uniform.surface();
        if uniform.next() < 0.3 {
            surface.roughness = 0.0;
        }
        let letters = any(&mut uniform);
        let bsdf = Bsdf::keeping(&surface, letters);
        let wo = uniform.direction();
        let Some(sample) = bsdf.sample(wo, uniform.next(), uniform.pair(), Transport::Radiance) else {
            continue;
        };
        match sample.kind {
            SampleKind::Smooth { value, pdf } => {
                smooth += 1;
                assert_eq!(value, bsdf.eval(wo, sample.wi, Transport::Radiance));
                assert_eq!(pdf, bsdf.pdf(wo, sample.wi));
                assert!(letters.has(Letter::Diffuse) || value.diffuse == Rgb::ZERO);
                assert!(letters.has(Letter::Glossy) || value.glossy == Rgb::ZERO);
            }
            SampleKind::Specular { letter, weight, probability } => {
                specular += 1;
                assert!(letters.has(letter) && letter.is_delta(), "{letter:?}");
                assert!(weight.is_finite() && probability > 0.0 && probability <= 1.0 + 1e-6);
            }
        }
    }
    assert!(smooth > 3000 && specular > 3000, "{smooth} {specular}");
}

/// Σ over letters of the albedos that are left with one letter is the albedo of the whole.
#[test]
fn no_light_is_lost_or_made_by_keeping_a_letter() {
    let mixed = SurfaceParameters { metallic: 0.3, transmission: 0.5, ..SOLID };
    let red = SurfaceParameters { base_color: Rgb::new(0.9, 0.4, 0.2), ior: 2.0, ..PLASTIC };
    let sheet = SurfaceParameters { metallic: 0.2, transmission: 0.3, ..SHEET };
    for (name, surface) in [("plastic", PLASTIC), ("red", red), ("mixture", mixed), ("sheet", sheet)] {
        for alpha in [0.0, 0.01, 0.3, 1.0] {
            let surface = SurfaceParameters { roughness: f32::sqrt(alpha).next_up(), ..surface };
            for angle in [1.0, 60.0, 85.0, 130.0] {
                let wo = tilted(angle, 0.4);
                let of = |letters| albedo(&Bsdf::keeping(&surface, letters), wo, 1 << 14);
                let parts = [Letter::Diffuse, Letter::Glossy, Letter::Specular].map(|l| of(Letters::of(l)));
                let (sum, whole) = (parts.into_iter().sum::<Rgb>(), of(Letters::NATURAL));
                // The lattice knows each albedo to about 1e-3.
                assert!((sum - whole).abs().max_element() < 4e-3, "{name} {alpha} {angle}: {sum}, {whole}");
            }
        }
    }
}

/// A twin is what the surface would be at roughness 0, but for its letter.
#[test]
fn a_twin_is_the_smooth_surface() {
    let mut uniform = Uniform(25);
    let (mut drawn, mut crossed) = (0, 0);
    for _ in 0..4000 {
        let mut surface = uniform.surface();
        // Where the index hardly changes, a solid is smooth whatever its roughness.
        surface.ior = surface.ior.max(1.2);
        let smooth = SurfaceParameters { roughness: 0.0, ..surface };
        let twin = Bsdf::keeping(&surface, Letters::of(Letter::Mirrored));
        let mirror = Bsdf::keeping(&smooth, Letters::of(Letter::Specular));
        let (wo, u) = (uniform.direction(), uniform.next());
        let draw = |bsdf: &Bsdf| bsdf.sample(wo, u, Vec2::splat(0.5), Transport::Radiance);
        match (draw(&twin), draw(&mirror)) {
            (None, None) => {}
            (Some(a), Some(b)) => {
                let SampleKind::Specular { letter, weight, probability } = a.kind else { panic!("{a:?}") };
                let SampleKind::Specular { weight: w, probability: p, .. } = b.kind else { panic!("{b:?}") };
                assert_eq!(letter, Letter::Mirrored);
                assert_eq!((a.wi, a.eta, weight, probability), (b.wi, b.eta, w, p), "{surface:?}");
                drawn += 1;
                crossed += u32::from(a.wi.z * wo.z < 0.0);
            }
            other => panic!("{other:?} of {surface:?}"),
        }
    }
    assert!(drawn > 2000 && crossed > 100, "{drawn} {crossed}");
}

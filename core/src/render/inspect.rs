//! What is in a scene, what a render of it needs and what it leaves out.

use crate::bsdf::Bsdf;
use crate::bsdf::event::{Letter, Letters};
use crate::bsdf::surface::SurfaceParameters;
use crate::gltf::bundle::Bundle;
use crate::gltf::error::{LoadError, Problem};
use crate::gltf::limits::Limits;
use crate::gltf::load::load;
use crate::gltf::report::Report;
use crate::math::colour::Rgb;
use crate::path::expression::language::LightTag;
use crate::path::reach::{EyeKind, LightKind, Surroundings};
use crate::scene::camera::{Camera, Projection};
use crate::scene::data::SceneData;
use crate::scene::environment::Environment;
use crate::scene::light_names::LightNames;
use crate::scene::material::{Coverage, Material, RoughnessMap};
use crate::scene::nearby::is_worth_a_tree;
use crate::scene::punctual::PunctualKind;
use crate::settings::Method;
use std::sync::Arc;

/// What a scene without light needs.
pub const DEFAULT_SKY: &str = "default sky";
/// What a scene with light from infinitely far of its own needs.
pub const IMAGE_BASED: &str = "image-based light";

/// What a scene of many lights needs.
pub const LIGHT_TREE: &str = "light tree";

/// What is in a scene.
#[derive(Clone, Debug)]
pub struct Contents {
    /// Counts.
    pub report: Report,
    /// Punctual lights: points, spots, directional ones.
    pub punctual: [u32; 3],
    /// How its lights are called.
    pub light_names: LightNames,
    /// Width over height that each camera asks for.
    pub aspects: Vec<Option<f32>>,
    /// Whether each camera's rays are parallel.
    pub parallel: Vec<bool>,
    /// Letters that its surfaces can have, by the factors of their materials.
    pub letters: Letters,
    /// The largest radiance that a channel of an emissive surface or of the sky has, in W/(sr·m²).
    pub brightest: f64,
    /// What a render needs.
    pub needs: Vec<String>,
    /// What a render leaves out.
    pub leaves_out: Vec<String>,
    /// What is odd.
    pub warnings: Vec<Problem>,
}

/// Reads a scene without building anything.
pub fn inspect(bytes: impl Into<Arc<[u8]>>, limits: &Limits) -> Result<Contents, LoadError> {
    let loaded = load(&Bundle::open(bytes)?, limits)?;
    let data = &loaded.scene;
    let count = |of: fn(&PunctualKind) -> bool| data.punctual.iter().filter(|p| of(&p.kind)).count() as u32;
    let punctual = [
        count(|k| matches!(k, PunctualKind::Point { .. })),
        count(|k| matches!(k, PunctualKind::Spot { .. })),
        count(|k| matches!(k, PunctualKind::Directional { .. })),
    ];
    let (mut needs, mut leaves_out) = (Vec::new(), Vec::new());
    for (name, needed) in features(&loaded.report, data) {
        let list = if needed { &mut needs } else { &mut leaves_out };
        list.push(name.to_owned());
    }
    Ok(Contents {
        punctual,
        light_names: LightNames::of(data),
        aspects: data.cameras.iter().map(Camera::aspect).collect(),
        parallel: (data.cameras.iter())
            .map(|camera| matches!(camera.projection, Projection::Orthographic { .. }))
            .collect(),
        letters: data.materials.iter().map(letters).fold(Letters::NONE, Letters::union),
        brightest: brightest(data),
        needs,
        leaves_out,
        report: loaded.report,
        warnings: loaded.warnings,
    })
}

fn brightest(data: &SceneData) -> f64 {
    if !data.is_lit() {
        return f64::from(Environment::default_sky().brightest());
    }
    let sky = data.environment.as_ref().map_or(0.0, |sky| f64::from(sky.brightest()));
    data.materials.iter().map(|m| f64::from(m.emission.factor.max_element())).fold(sky, f64::max)
}

/// Whether some of these surfaces are more than diffuse: what they make of light is met by chance, and a caustic.
pub fn casts(letters: Letters) -> bool {
    letters != Letters::of(Letter::Diffuse) && letters != Letters::NONE
}

/// The brightest that a sample can be which meets a light by chance only: as bright as the brightest light, where eye subpaths may
/// come to it by a glossy or specular surface. Lights without extent are never met by chance.
pub fn by_chance(method: Method, letters: Letters, brightest: f64) -> Option<f64> {
    let met = match method {
        Method::Path | Method::Bidirectional | Method::Caustics => casts(letters),
        Method::Light | Method::Photon | Method::Radiosity => false,
    };
    (met && brightest > 0.0).then_some(brightest)
}

impl Contents {
    /// What of it matters to techniques, seen by its first camera under its own light; `tags` are those of any light.
    pub fn surroundings(&self, tags: &[LightTag]) -> Surroundings {
        let sky = self.needs.iter().any(|need| need == DEFAULT_SKY || need == IMAGE_BASED);
        let kinds = [
            (LightKind::Surface, self.report.emissive_triangles > 0),
            (LightKind::Environment, sky),
            (LightKind::Punctual, self.punctual != [0; 3]),
        ];
        let there = kinds.into_iter().filter(|(_, there)| *there);
        let parallel = self.parallel.first() == Some(&true);
        Surroundings {
            letters: self.letters,
            lights: there.flat_map(|(kind, _)| tags.iter().map(move |tag| (kind, *tag))).collect(),
            eye: if parallel { EyeKind::Parallel } else { EyeKind::Pinhole },
        }
    }
}

/// Letters that a material can have: textures can take metallic, transmission and specular down to nothing; roughness
/// is taken by its factor.
fn letters(material: &Material) -> Letters {
    let textured_metal = matches!(material.roughness_map, Some(RoughnessMap::MetallicRoughness(_)));
    let choices = |factor: f32, textured: bool| [factor, if textured { 0.0 } else { factor }];
    let mut letters = Letters::NONE;
    if material.unlit.is_some() {
        return letters;
    }
    for metallic in choices(material.metallic, textured_metal) {
        for transmission in choices(material.transmission.factor, material.transmission.texture.is_some()) {
            for specular in choices(material.specular.factor, material.specular.texture.is_some()) {
                let surface = SurfaceParameters {
                    base_color: Rgb::ONE,
                    metallic,
                    roughness: material.roughness,
                    specular,
                    specular_color: material.specular_color.factor,
                    ior: material.ior,
                    transmission,
                    walls: material.walls(),
                    layers: None,
                };
                letters = letters.union(Bsdf::from_surface(&surface).letters());
                if let Some(layers) = &material.layers {
                    let layers = Some(layers.without_textures());
                    letters =
                        letters.union(Bsdf::from_surface(&SurfaceParameters { layers, ..surface }).letters());
                }
            }
        }
    }
    letters
}

/// Each feature that a scene may need, and whether this one does.
fn features(report: &Report, data: &SceneData) -> [(&'static str, bool); 19] {
    let any = |of: fn(&Material) -> bool| data.materials.iter().any(of);
    [
        ("triangles", data.meshes.iter().any(|m| !m.triangles.is_empty())),
        ("instances", data.instances.len() > 1),
        ("textures", !data.textures.is_empty()),
        ("normal maps", any(|m| m.normal.is_some())),
        ("vertex colours", data.meshes.iter().any(|m| !m.colours.is_empty())),
        ("alpha", any(|m| m.coverage != Coverage::Opaque)),
        ("transmission", any(|m| m.transmission.factor > 0.0)),
        ("volumes", any(|m| m.volume.is_some())),
        ("brushed surfaces", any(|m| m.layers.as_ref().is_some_and(|l| l.finish.brush.factor > 0.0))),
        ("thin films", any(|m| m.layers.as_ref().is_some_and(|l| l.finish.film.factor > 0.0))),
        ("emissive surfaces", any(Material::emits)),
        ("unlit surfaces", any(|m| m.unlit.is_some())),
        ("punctual lights", !data.punctual.is_empty()),
        (LIGHT_TREE, is_worth_a_tree(data)),
        (IMAGE_BASED, data.environment.is_some()),
        (DEFAULT_SKY, !data.is_lit()),
        ("animation", report.animated.nodes > 0),
        ("skins", report.animated.skins > 0),
        ("morph targets", report.animated.morphs > 0),
    ]
}

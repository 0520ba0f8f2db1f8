//! What a walk has to know of the settings.

use crate::bsdf::Bsdf;
use crate::bsdf::event::Letters;
use crate::path::expression::error::ExpressionError;
use crate::path::expression::language::{Language, LightTag};
use crate::path::media::Media;
use crate::path::mis::exhaustive::Chosen;
use crate::path::mis::heuristic::Heuristic;
use crate::path::tally::Technique;
use crate::scene::Scene;
use crate::scene::interaction::Interaction;
use crate::scene::light::Light;
use crate::scene::light_names::ENVIRONMENT;
use crate::scene::material::Material;
use crate::settings::{Gloss, Method, Settings, Shadows, Shows, Strategy, Weights};
use crate::trace::moment::Moment;
use crate::trace::ray::Ray;
use glam::Vec4;

/// Most light subpaths of a pass of photons.
const PHOTON_PATHS_MAX: usize = 1 << 18;

/// What a walk has to know of the settings.
#[derive(Clone, Debug)]
pub struct Rules {
    /// Which words count, for which picture.
    pub language: Language,
    /// Letters of words that count; surfaces scatter by no other.
    pub letters: Letters,
    /// How gloss is taken.
    pub gloss: Gloss,
    /// Most scatterings of a path.
    pub bounces: u32,
    /// Whether direct light is blocked.
    pub shadows: Shadows,
    /// How techniques share a path.
    pub weighing: Weighing,
    /// Light subpaths for every eye subpath of a pixel.
    pub light_paths: f64,
    /// Names of the lights, by number.
    tags: Vec<LightTag>,
    /// The plane of each rule.
    rule_planes: Vec<usize>,
    /// The plane of each technique that has one.
    technique_planes: Vec<(Technique, usize)>,
    narrow_plane: Option<usize>,
    scattered_plane: Option<usize>,
    square_planes: Vec<(Method, usize)>,
    /// What a material does to light, by its number; `None` where textures tell.
    even: Vec<Option<Bsdf>>,
    /// The solids around the eye, where all its rays start at one point.
    media_of_eye: Option<Media>,
}

/// How techniques share a path.
#[derive(Clone, Debug, PartialEq)]
pub enum Weighing {
    /// Light that is hit, and next events.
    FromEye,
    /// Only joins to the lens.
    ToLens,
    /// Everything but light that hits the lens.
    All(Heuristic),
    /// Chosen techniques.
    Chosen(Chosen),
    /// Light that is hit, next events, and, of light whose first surface is more than diffuse, joins to the lens. Whether it is one
    /// can be told from both ends of a path.
    Caustics,
}

impl Rules {
    /// From the settings of a picture of `pixels` pixels.
    pub fn new(scene: &Scene, settings: &Settings, pixels: usize) -> Result<Self, ExpressionError> {
        let mut expressions = vec![settings.paths.as_str()];
        let (mut rule_planes, mut technique_planes) = (vec![0], Vec::new());
        let (mut narrow_plane, mut scattered_plane, mut square_planes) = (None, None, Vec::new());
        for (i, layer) in settings.layers.iter().enumerate() {
            match &layer.shows {
                Shows::Paths(paths) => {
                    expressions.push(paths);
                    rule_planes.push(i + 1);
                }
                Shows::Strategy(Strategy { s, t }) => {
                    technique_planes.push(((*s as usize, *t as usize), i + 1));
                }
                Shows::Narrow => narrow_plane = Some(i + 1),
                Shows::Scattered => scattered_plane = Some(i + 1),
                Shows::Squares(method) => square_planes.push((*method, i + 1)),
            }
        }
        let language = Language::compile(&expressions)?;
        let tags = tags(scene, &language);
        let letters = language.letters();
        let even = |material: &Material| Some(Bsdf::keeping(&material.even_surface()?, letters));
        Ok(Self {
            letters,
            language,
            even: scene.data.materials.iter().map(even).collect(),
            gloss: settings.gloss,
            bounces: settings.bounces.unwrap_or(u32::MAX),
            shadows: settings.shadows,
            weighing: weighing(settings),
            light_paths: light_paths(settings.method, pixels) as f64,
            tags,
            rule_planes,
            technique_planes,
            narrow_plane,
            scattered_plane,
            square_planes,
            media_of_eye: scene.eye().map(|eye| Media::around(scene, eye, Moment::STILL, &mut 0)),
        })
    }

    /// The solids around the start of a ray from the eye.
    pub fn media_of_eye(&self, scene: &Scene, ray: &Ray) -> Media {
        self.media_of_eye.unwrap_or_else(|| Media::around(scene, ray.origin, ray.moment, &mut 0))
    }

    /// What the surface does to light at a point, where that is the same all over its material.
    #[inline]
    pub fn even_bsdf(&self, at: &Interaction<'_>) -> Option<&Bsdf> {
        self.even[at.material_id.index()].as_ref().filter(|_| at.at.colour == Vec4::ONE)
    }

    /// Number of pictures.
    pub fn planes(&self) -> usize {
        let single = [self.narrow_plane, self.scattered_plane];
        let further = single.iter().flatten().count() + self.square_planes.len();
        self.rule_planes.len() + self.technique_planes.len() + further
    }

    /// The plane that shows the picture with half the area of gathering.
    pub fn narrow_plane(&self) -> Option<usize> {
        self.narrow_plane
    }

    /// The plane that shows the picture without light that comes straight from where it is made.
    pub fn scattered_plane(&self) -> Option<usize> {
        self.scattered_plane
    }

    /// The planes of squares of what methods add.
    pub fn square_planes(&self) -> &[(Method, usize)] {
        &self.square_planes
    }

    /// Whether squares are told of other methods than the one that renders.
    pub fn tells_squares(&self) -> bool {
        !self.square_planes.is_empty() && matches!(self.weighing, Weighing::All(_))
    }

    /// Whether every path counts, for one picture.
    pub fn is_everything(&self) -> bool {
        self.planes() == 1 && self.language.is_everything()
    }

    /// The plane of a rule.
    pub fn rule_plane(&self, rule: usize) -> usize {
        self.rule_planes[rule]
    }

    /// The plane of a technique, where it has one.
    pub fn technique_plane(&self, technique: Technique) -> Option<usize> {
        self.technique_planes.iter().find(|(one, _)| *one == technique).map(|(_, plane)| *plane)
    }

    /// The name of a light.
    pub fn tag(&self, light: u32) -> LightTag {
        self.tags[light as usize]
    }

    /// Whether a technique is used.
    pub fn uses(&self, (s, t): Technique) -> bool {
        match &self.weighing {
            Weighing::FromEye => s <= 1 && t >= 2,
            Weighing::ToLens => t == 1,
            Weighing::All(_) => t >= 1,
            Weighing::Chosen(chosen) => chosen.uses(s, t),
            Weighing::Caustics => s <= 1 && t >= 2 || s >= 2 && t == 1,
        }
    }

    /// How the recursion of weights counts ratios.
    pub fn heuristic(&self) -> Heuristic {
        match self.weighing {
            Weighing::All(heuristic) => heuristic,
            _ => Heuristic::Balance,
        }
    }
}

/// Light subpaths for every eye subpath of a pixel: as many as a picture has pixels, but photons have to be kept.
fn light_paths(method: Method, pixels: usize) -> usize {
    match method {
        Method::Photon => pixels.min(PHOTON_PATHS_MAX),
        _ => pixels,
    }
}

fn weighing(settings: &Settings) -> Weighing {
    match (settings.method, settings.weights) {
        (Method::Light, _) => Weighing::ToLens,
        (Method::Bidirectional, Weights::Balance) if settings.strategies.is_empty() => {
            Weighing::All(Heuristic::Balance)
        }
        (Method::Bidirectional, Weights::Power) if settings.strategies.is_empty() => {
            Weighing::All(Heuristic::Power)
        }
        (Method::Caustics, _) => Weighing::Caustics,
        (Method::Bidirectional, weights) => {
            Weighing::Chosen(Chosen::new(settings.strategies.clone(), weights))
        }
        _ => Weighing::FromEye,
    }
}

/// The names of each light: those of its node and its material.
fn tags(scene: &Scene, language: &Language) -> Vec<LightTag> {
    let data = &scene.data;
    (0..scene.lights.len() as u32)
        .map(|light| match *scene.lights.light(light) {
            Light::Triangle { instance, triangle } => {
                let names = [data.node_name(instance, triangle), &data.material(instance, triangle).name];
                language.tag_of(&names)
            }
            Light::Punctual(index) => language.tag_of(&[&data.punctual[index as usize].name]),
            Light::Environment => language.tag_of(&[ENVIRONMENT]),
        })
        .collect()
}

//! Which asked paths a job's picture will not have.

use ovtigre_core::{
    bsdf::event::{Letter, Letters},
    path::{
        expression::language::Language,
        reach::{EyeKind, LightKind, Surroundings, Unreachable, unreachable},
    },
    render::inspect::{DEFAULT_SKY, IMAGE_BASED},
    settings::{CameraChoice, Lens, Method},
};
use ovtigre_proto::{job::JobRequest, scene::SceneContents};

/// Whether what a scene needs is light from infinitely far.
pub fn is_sky(need: &str) -> bool {
    [DEFAULT_SKY, IMAGE_BASED].contains(&need)
}

/// Paths of `language` that `method` does not make of a scene as it is asked for.
pub fn missing(
    language: &Language,
    method: Method,
    request: &JobRequest,
    scene: &SceneContents,
    camera: CameraChoice,
    lens: Option<Lens>,
) -> Vec<Unreachable> {
    let sky = request.environment.is_some() || scene.needs.iter().any(|need| is_sky(need));
    let lights = scene.lights;
    let kinds = [
        (LightKind::Surface, lights.emissive_triangles > 0),
        (LightKind::Environment, sky),
        (LightKind::Punctual, lights.point + lights.spot + lights.directional > 0),
    ];
    let parallel = match camera {
        CameraChoice::Framed => false,
        CameraChoice::Index(n) => scene.camera_rays_parallel.get(n as usize) == Some(&true),
    };
    // Which light has which name is not known here: each may have any.
    let there = kinds.into_iter().filter(|(_, there)| *there);
    let around = Surroundings {
        letters: letters(scene),
        lights: there.flat_map(|(kind, _)| language.tags().map(move |tag| (kind, tag))).collect(),
        eye: match lens {
            Some(_) => EyeKind::Lens,
            None if parallel => EyeKind::Parallel,
            None => EyeKind::Pinhole,
        },
    };
    unreachable(language, method, &around, request.bounces)
}

/// Letters that a scene's surfaces can have.
pub fn letters(scene: &SceneContents) -> Letters {
    let letter = |name: &String| Letter::ALL.into_iter().find(|letter| letter.symbol() == name);
    scene.letters.iter().filter_map(letter).map(Letters::of).fold(Letters::NONE, Letters::union)
}

/// One line of it for people.
pub fn line(missing: &Unreachable) -> String {
    let Unreachable { light, paths, why, reached_by, shares } = missing;
    let from = match light {
        LightKind::Surface => "emissive surfaces",
        LightKind::Environment => "the environment",
        LightKind::Punctual => "points, spots and suns",
    };
    let methods: Vec<&str> = reached_by.iter().map(|method| method.name()).collect();
    let instead = match &methods[..] {
        [] => "no method makes them".to_owned(),
        some => format!("method {} makes them", some.join(" or ")),
    };
    let shown: Vec<&str> = paths.iter().take(3).map(String::as_str).collect();
    let share = match missing.counts() {
        [_, 0] => String::new(),
        [lost, asked] => {
            let longest = shares.last().map_or(0, |share| share.scatterings);
            let percent = 100.0 * lost as f64 / asked as f64;
            format!(" ({percent:.2} % of the words of up to {longest} scatterings)")
        }
    };
    let shown = shown.join(", ");
    format!("paths such as {shown} from {from}{share} are not in the picture: {why}; {instead}")
}

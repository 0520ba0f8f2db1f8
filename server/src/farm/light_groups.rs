//! Light by light: a layer for each that has a name, and names that no light has.

use super::error::fault;
use ovtigre_core::{
    path::expression::{
        language::{Language, RULES_MAX},
        presets::preset,
    },
    scene::light_names::ENVIRONMENT,
    settings::FULL,
};
use ovtigre_proto::{
    job::{JobRequest, LAYER_OF_EACH_LIGHT},
    problem::Fault,
    scene::SceneContents,
};
use std::collections::BTreeSet;

/// Names that a message lists, at most.
const LISTED: usize = 12;
/// Longest part of a light's name in that of its layer.
const PART_MAX: usize = 48;

/// The request with a layer `light_NAME` for each light instead of the word `lights` among its layers: the picture's paths from that
/// light.
pub(super) fn expanded(request: JobRequest, scene: &SceneContents) -> Result<JobRequest, Vec<Fault>> {
    let Some(place) = request.layers.iter().position(|layer| layer.trim() == LAYER_OF_EACH_LIGHT) else {
        return Ok(request);
    };
    let refused = |detail: String| vec![fault(format!("/layers/{place}"), detail)];
    let paths = paths(&request);
    if paths.contains('\'') {
        let detail = "the picture's paths are of some lights only already: write the layers as NAME=EXPR";
        return Err(refused(detail.to_owned()));
    }
    let names = groups(&request, scene).ok_or_else(|| {
        refused("an earlier version looked into this scene, and did not note how its lights are called: write the layers as NAME=EXPR".to_owned())
    })?;
    if names.is_empty() {
        return Err(refused("no light of the scene has a name".to_owned()));
    }
    let room = RULES_MAX - request.layers.len();
    if names.len() > room {
        let detail = format!(
            "{} lights have names, and there is room for {room} layers: write those you want as NAME=EXPR",
            names.len()
        );
        return Err(refused(detail));
    }
    let mut taken = BTreeSet::new();
    let layers = names.iter().map(|name| format!("{}={}", layer_name(name, &mut taken), of(&paths, name)));
    let mut request = request;
    request.layers.splice(place..=place, layers.collect::<Vec<_>>());
    Ok(request)
}

/// A line where an expression takes the light of a name that no light has.
pub(super) fn unknown(language: &Language, request: &JobRequest, scene: &SceneContents) -> Option<String> {
    let all: BTreeSet<&str> = scene.light_names.as_ref()?.iter().map(String::as_str).collect();
    let sky = request.environment.as_ref().map(|_| ENVIRONMENT);
    let is_there = |name: &String| all.contains(&**name) || sky == Some(name);
    let missing: Vec<_> = language.light_names().iter().filter(|name| !is_there(name)).collect();
    let quoted = |names: &mut dyn Iterator<Item = &str>| {
        names.map(|name| format!("'{name}'")).collect::<Vec<_>>().join(", ")
    };
    if missing.is_empty() {
        return None;
    }
    let wanted = quoted(&mut missing.iter().map(|name| name.as_str()).take(LISTED));
    let there = all.into_iter().chain(sky).collect::<BTreeSet<_>>();
    let more = if there.len() > LISTED { " and more" } else { "" };
    let there = match &*quoted(&mut there.into_iter().take(LISTED)) {
        "" => "none has a name".to_owned(),
        some => format!("there are {some}{more}"),
    };
    Some(format!("no light is called {wanted}, and what is asked of it stays black: {there}"))
}

/// The picture's expression.
fn paths(request: &JobRequest) -> String {
    let by_name = request.preset.as_deref().and_then(preset).map(|preset| preset.paths.to_owned());
    request.paths.clone().or(by_name).unwrap_or_else(|| FULL.to_owned())
}

/// A name of each light.
fn groups(request: &JobRequest, scene: &SceneContents) -> Option<BTreeSet<String>> {
    let mut names: BTreeSet<String> = scene.light_groups.as_ref()?.iter().cloned().collect();
    if request.environment.is_some() {
        names.insert(ENVIRONMENT.to_owned());
    }
    Some(names)
}

/// The paths from the light of a name, of paths that are from any.
fn of(paths: &str, name: &str) -> String {
    paths.replace('L', &format!("L'{}'", name.replace('\'', "''")))
}

/// A name for a light's layer that has only what such names may have, and that no other has.
fn layer_name(light: &str, taken: &mut BTreeSet<String>) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
    let part: String = light.chars().map(plain).take(PART_MAX).collect();
    let numbered = (2..).map(|n| format!("light_{part}-{n}"));
    let mut names = std::iter::once(format!("light_{part}")).chain(numbered);
    names.find(|name| taken.insert(name.clone())).expect("there is always a further number")
}

#[cfg(test)]
mod tests {
    use super::*;
    use ovtigre_proto::pair::EnvironmentRequest;

    fn scene(names: &[&str]) -> SceneContents {
        let names = || Some(names.iter().map(|name| (*name).to_owned()).collect());
        SceneContents { light_names: names(), light_groups: names(), ..SceneContents::default() }
    }

    fn asked(layers: &[&str]) -> JobRequest {
        JobRequest {
            layers: layers.iter().map(|layer| (*layer).to_owned()).collect(),
            ..JobRequest::default()
        }
    }

    #[test]
    fn each_light_gets_the_picture_s_paths_from_it() {
        let scene = scene(&["Bob's lamp", "Bob_s lamp", "key"]);
        let whole = expanded(asked(&["a=LE", "lights", "b=LDE"]), &scene).unwrap();
        let layers = [
            "a=LE",
            "light_Bob_s_lamp=L'Bob''s lamp'(D|S)*E",
            "light_Bob_s_lamp-2=L'Bob_s lamp'(D|S)*E",
            "light_key=L'key'(D|S)*E",
            "b=LDE",
        ];
        assert_eq!(whole.layers, layers);
        let mut of_some = asked(&["lights"]);
        of_some.paths = Some("ED{1,2}L | LE".to_owned());
        of_some.environment = Some(EnvironmentRequest::Uniform([1.0; 3]));
        let of_some = expanded(of_some, &super::tests::scene(&["key"])).unwrap();
        assert_eq!(
            of_some.layers,
            [
                "light_environment=ED{1,2}L'environment' | L'environment'E",
                "light_key=ED{1,2}L'key' | L'key'E"
            ]
        );
        for layer in whole.layers.iter().chain(&of_some.layers) {
            Language::compile(&[layer.split_once('=').unwrap().1]).unwrap();
        }
        assert_eq!(expanded(asked(&["a=LE"]), &scene).unwrap(), asked(&["a=LE"]));
    }

    #[test]
    fn where_that_cannot_be_it_is_said_why() {
        let refused = |request: JobRequest, scene: &SceneContents| {
            let fault = expanded(request, scene).unwrap_err().remove(0);
            assert_eq!(fault.pointer, "/layers/1");
            fault.detail
        };
        let two = || asked(&["a=LE", "lights"]);
        assert!(refused(two(), &SceneContents::default()).contains("an earlier version"));
        assert!(refused(two(), &scene(&[])).contains("no light of the scene has a name"));
        let names: Vec<String> = (0..31).map(|n| n.to_string()).collect();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        assert!(expanded(two(), &scene(&names[..30])).is_ok(), "with the picture and one more they are 32");
        assert!(refused(two(), &scene(&names)).contains("31 lights have names, and there is room for 30"));
        let of_one = JobRequest { paths: Some("L'0'.*E".to_owned()), ..two() };
        assert!(refused(of_one, &scene(&names)).contains("some lights only already"));
    }

    #[test]
    fn a_name_that_no_light_has_is_told_with_those_that_there_are() {
        let language = Language::compile(&["L'key'.*E | L'kee'.*E | L'environment'E"]).unwrap();
        let plain = JobRequest::default();
        let line = unknown(&language, &plain, &scene(&["key", "fill"])).unwrap();
        assert_eq!(
            line,
            "no light is called 'environment', 'kee', and what is asked of it stays black: there are 'fill', 'key'"
        );
        let sky =
            JobRequest { environment: Some(EnvironmentRequest::Uniform([1.0; 3])), ..JobRequest::default() };
        assert!(unknown(&language, &sky, &scene(&[])).unwrap().ends_with("there are 'environment'"));
        assert_eq!(unknown(&language, &sky, &scene(&["kee", "key"])), None);
        assert_eq!(unknown(&language, &plain, &SceneContents::default()), None, "nothing is known of it");
        assert!(unknown(&language, &plain, &scene(&[])).unwrap().ends_with("none has a name"));
    }
}

//! Which paths a job shows and how they are estimated: every wish checked, alone and with the others.

use ovtigre_core::{
    bsdf::event::Letter,
    path::expression::{
        error::ExpressionError,
        language::{Language, RULES_MAX},
        presets::{PRESETS, preset},
    },
    settings::{FULL, Gloss, Layer, Method, Shadows, Shows, Strategy, Weights},
};
use ovtigre_proto::job::{JobRequest, MethodRequest, WeightsRequest};
use std::collections::BTreeSet;

/// Layers of a job.
const LAYERS_MAX: usize = RULES_MAX - 1;
/// Longest name of a layer.
const NAME_MAX: usize = 64;
/// Names that a picture's channels or its parts have already.
const TAKEN: [&str; 6] = ["R", "G", "B", "error", "picture", NARROW];
/// The layer that tells the bias of photons.
const NARROW: &str = "narrow";
/// Vertices of either subpath of a technique.
const VERTICES_MAX: u32 = 255;
/// Methods that this version renders by.
const RENDERED: [Method; 6] =
    [Method::Path, Method::Light, Method::Bidirectional, Method::Caustics, Method::Photon, Method::Radiosity];
/// What method `radiosity` solves.
const DIFFUSE: &str = "LD*E";

/// What a job shows, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Chosen {
    /// The picture's expression, as it is compiled.
    pub paths: String,
    /// The layers.
    pub layers: Vec<Layer>,
    /// How gloss is taken.
    pub gloss: Gloss,
    /// The method.
    pub method: Method,
    /// Why that one.
    pub reason: &'static str,
    /// Techniques of `bidirectional`; empty for all.
    pub strategies: Vec<Strategy>,
    /// How techniques are weighed.
    pub weights: Weights,
}

/// Resolves what a request says of paths, and their language; tells `note` of each fault and its JSON pointer.
pub fn choose(request: &JobRequest, note: &mut impl FnMut(&str, String)) -> (Chosen, Option<Language>) {
    let (pointer, paths, gloss) = picture(request, note);
    let method = method(request, note);
    let mut chosen = Chosen {
        layers: layers(request, note),
        strategies: strategies(request, note),
        weights: weights(request),
        reason: reason(request.method),
        paths,
        gloss,
        method,
    };
    if chosen.method == Method::Photon && chosen.layers.len() < LAYERS_MAX {
        chosen.layers.push(Layer { name: NARROW.to_owned(), shows: Shows::Narrow });
    }
    let language = compile(&chosen, pointer, note);
    if language.is_some() {
        fits(request, &chosen, pointer, note);
    }
    (chosen, language)
}

/// Where the picture's expression is written, the expression, and what it does to gloss.
fn picture(request: &JobRequest, note: &mut impl FnMut(&str, String)) -> (&'static str, String, Gloss) {
    let Some(name) = request.preset.as_deref() else {
        let default = match request.method {
            Some(MethodRequest::Radiosity) => DIFFUSE,
            _ => FULL,
        };
        let paths = request.paths.clone().unwrap_or_else(|| default.to_owned());
        return ("/paths", paths, Gloss::AsItIs);
    };
    if request.paths.is_some() {
        note("/preset", "'paths' and 'preset' both say what is shown: leave one out".to_owned());
    }
    if let Some(preset) = preset(name) {
        ("/preset", preset.paths.to_owned(), preset.gloss)
    } else {
        let names = PRESETS.map(|preset| preset.name).join(", ");
        note("/preset", format!("there is no preset '{name}': there are {names}"));
        ("/preset", FULL.to_owned(), Gloss::AsItIs)
    }
}

fn method(request: &JobRequest, note: &mut impl FnMut(&str, String)) -> Method {
    let method = match request.method {
        None | Some(MethodRequest::Auto | MethodRequest::Path) => Method::Path,
        Some(MethodRequest::Light) => Method::Light,
        Some(MethodRequest::Bidirectional) => Method::Bidirectional,
        Some(MethodRequest::Caustics) => Method::Caustics,
        Some(MethodRequest::Photon) => Method::Photon,
        Some(MethodRequest::Radiosity) => Method::Radiosity,
    };
    if !RENDERED.contains(&method) {
        let names = RENDERED.map(Method::name).join(", ");
        note("/method", format!("'{}' is not supported yet: use {names}", method.name()));
    }
    method
}

fn reason(asked: Option<MethodRequest>) -> &'static str {
    match asked {
        None | Some(MethodRequest::Auto) => "samples the asked paths from the eye, with next event",
        Some(_) => "asked for",
    }
}

fn weights(request: &JobRequest) -> Weights {
    match request.weights {
        None | Some(WeightsRequest::Balance) => Weights::Balance,
        Some(WeightsRequest::Power) => Weights::Power,
        Some(WeightsRequest::Uniform) => Weights::Uniform,
        Some(WeightsRequest::Single) => Weights::Single,
    }
}

fn layers(request: &JobRequest, note: &mut impl FnMut(&str, String)) -> Vec<Layer> {
    if request.layers.len() > LAYERS_MAX {
        note("/layers", format!("there are {} layers, and at most {LAYERS_MAX}", request.layers.len()));
        return Vec::new();
    }
    let mut names = BTreeSet::new();
    let mut layers = Vec::new();
    for (i, text) in request.layers.iter().enumerate() {
        match layer(text) {
            Ok(layer) if names.insert(layer.name.clone()) => layers.push(layer),
            Ok(layer) => note(&at_layer(i), format!("there is a layer '{}' already", layer.name)),
            Err(detail) => note(&at_layer(i), detail),
        }
    }
    layers
}

fn at_layer(number: usize) -> String {
    format!("/layers/{number}")
}

/// `NAME=EXPR` or `NAME=(s,t)`.
fn layer(text: &str) -> Result<Layer, String> {
    let (name, shows) =
        text.split_once('=').ok_or_else(|| "a layer is written NAME=EXPR, such as direct=LDE".to_owned())?;
    let name = name.trim();
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-');
    if name.is_empty() || name.len() > NAME_MAX || !name.chars().all(plain) {
        return Err(format!("a layer's name has 1 to {NAME_MAX} letters, digits, '_' or '-'"));
    }
    if TAKEN.contains(&name) {
        return Err(format!("a layer cannot be named '{name}': a picture has that already"));
    }
    let inside = shows.trim().strip_prefix('(').and_then(|rest| rest.strip_suffix(')'));
    let shows = match inside.filter(|inside| inside.trim_start().starts_with(|c: char| c.is_ascii_digit())) {
        Some(pair) => Shows::Strategy(strategy(pair)?),
        None => Shows::Paths(shows.to_owned()),
    };
    Ok(Layer { name: name.to_owned(), shows })
}

fn strategies(request: &JobRequest, note: &mut impl FnMut(&str, String)) -> Vec<Strategy> {
    let Some(text) = &request.strategies else { return Vec::new() };
    let mut all = Vec::new();
    for pair in text.split(';') {
        match strategy(pair) {
            Ok(pair) if all.contains(&pair) => {}
            Ok(pair) => all.push(pair),
            Err(detail) => {
                note("/strategies", detail);
                break;
            }
        }
    }
    all
}

/// `s,t`.
fn strategy(text: &str) -> Result<Strategy, String> {
    let number = |text: &str| text.trim().parse().ok().filter(|n: &u32| *n <= VERTICES_MAX);
    let pair = text.split_once(',').and_then(|(s, t)| Some((number(s)?, number(t)?)));
    match pair {
        Some((s, t)) if s + t >= 2 => Ok(Strategy { s, t }),
        Some(_) => Err(format!("'{}' makes no path: light and eye are two vertices", text.trim())),
        None => Err(format!(
            "'{}' is no technique: write the numbers of light and eye vertices, such as 1,2",
            text.trim()
        )),
    }
}

/// The language of a picture and its layers; faults are those of the text that has them.
fn compile(chosen: &Chosen, picture: &str, note: &mut impl FnMut(&str, String)) -> Option<Language> {
    let layers = chosen.layers.iter().enumerate().filter_map(|(i, layer)| match &layer.shows {
        Shows::Paths(paths) => Some((at_layer(i), paths.as_str())),
        Shows::Strategy(_) | Shows::Narrow | Shows::Scattered | Shows::Squares(_) => None,
    });
    let rules: Vec<(String, &str)> =
        std::iter::once((picture.to_owned(), chosen.paths.as_str())).chain(layers).collect();
    let mut good = true;
    for (pointer, text) in &rules {
        match Language::compile(&[text]) {
            Ok(language) => {
                if chosen.gloss == Gloss::AsItIs && language.letters().has(Letter::Mirrored) {
                    good = false;
                    let detail = "S_T is gloss taken as a mirror's, which only the preset 'whitted' has";
                    note(pointer, detail.to_owned());
                }
            }
            Err(error) => {
                good = false;
                note(pointer, error.to_string());
            }
        }
    }
    if !good {
        return None;
    }
    let texts: Vec<&str> = rules.iter().map(|(_, text)| *text).collect();
    let together = Language::compile(&texts);
    together.map_err(|error: ExpressionError| note(&rules[error.rule].0, error.fault.to_string())).ok()
}

/// What needs a certain method, and what a method needs.
fn fits(request: &JobRequest, chosen: &Chosen, picture: &str, note: &mut impl FnMut(&str, String)) {
    let method = chosen.method;
    if method != Method::Bidirectional {
        let needs = |what: &str| format!("{what} need method 'bidirectional', this is '{}'", method.name());
        if request.strategies.is_some() {
            note("/strategies", needs("strategies"));
        }
        if request.weights.is_some() {
            note("/weights", needs("weights"));
        }
        for (i, layer) in chosen.layers.iter().enumerate() {
            if matches!(layer.shows, Shows::Strategy(_)) {
                note(&at_layer(i), needs("layers of a technique"));
            }
        }
    }
    if method != Method::Path {
        let only = |what: &str| format!("{what} only by method 'path', this is '{}'", method.name());
        if chosen.gloss == Gloss::Mirror {
            note("/preset", only("gloss is taken as a mirror's"));
        }
        if request.shadows == Some(Shadows::Off) {
            note("/shadows", only("light is let through"));
        }
    }
    if method == Method::Radiosity {
        if chosen.paths.split_whitespace().collect::<String>() != DIFFUSE {
            note(
                picture,
                format!(
                    "method 'radiosity' solves '{DIFFUSE}' as a whole: ask for that, or for another method"
                ),
            );
        }
        if !chosen.layers.is_empty() {
            note("/layers", "method 'radiosity' has no layers: leave 'layers' out".to_owned());
        }
    }
}

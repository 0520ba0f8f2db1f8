//! `ovtigre check`: what is in a scene, without rendering it.

use super::{exit::Outcome, scene_file, table, terminal, words};
use clap::Args;
use ovtigre::farm::reach::{line, lost};
use ovtigre_core::{
    gltf::limits::Limits,
    path::{
        expression::language::Language,
        reach::{Unreachable, unreachable},
    },
    render::inspect::{Contents, casts, inspect},
    settings::{FULL, Method},
};
use serde::Serialize;
use std::path::PathBuf;

/// Say what is in a scene.
#[derive(Args, Debug)]
pub(crate) struct Check {
    /// Scene to look at: .glb, or .gltf with its files beside it.
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Names of lights that are shown, at most.
const NAMES_SHOWN: usize = 32;

/// As JSON.
#[derive(Serialize)]
struct Document<'a> {
    contents: &'a ovtigre_core::gltf::report::Report,
    light_names: &'a std::collections::BTreeSet<String>,
    needs: &'a [String],
    leaves_out: &'a [String],
    /// What a render with default flags chooses from.
    methods: Vec<&'static str>,
    /// By any of them.
    unreachable: Vec<Unreachable>,
    warnings: Vec<Warning<'a>>,
}

#[derive(Serialize)]
struct Warning<'a> {
    pointer: &'a str,
    detail: &'a str,
}

impl Check {
    /// Looks.
    pub(crate) fn run(self) -> Outcome {
        let bytes = scene_file::bytes(&self.scene)?;
        let contents = inspect(bytes, &Limits::default()).map_err(|e| scene_file::fault(&self.scene, &e))?;
        if self.json {
            terminal::json(&document(&contents));
        } else {
            show(&contents);
        }
        Ok(())
    }
}

fn document(contents: &Contents) -> Document<'_> {
    let (open, unreachable) = methods(contents);
    Document {
        contents: &contents.report,
        light_names: &contents.light_names.all,
        needs: &contents.needs,
        leaves_out: &contents.leaves_out,
        methods: open.into_iter().map(Method::name).collect(),
        unreachable,
        warnings: (contents.warnings.iter())
            .map(|w| Warning { pointer: &w.pointer, detail: &w.detail })
            .collect(),
    }
}

/// Methods that a render with default flags chooses from.
const OPEN: [Method; 4] = [Method::Path, Method::Bidirectional, Method::Caustics, Method::Light];

/// Of them those that make the most of the paths that are asked for, and what they do not make.
fn methods(contents: &Contents) -> (Vec<Method>, Vec<Unreachable>) {
    let language = Language::compile(&[FULL]).expect("the default is an expression");
    let around = contents.surroundings(&language.tags().collect::<Vec<_>>());
    let open = OPEN.into_iter().filter(|method| *method != Method::Caustics || casts(contents.letters));
    let by: Vec<_> = open.map(|method| (method, unreachable(&language, method, &around, None))).collect();
    let (_, fewest) = by.iter().min_by_key(|(_, missing)| lost(missing)).expect("there are methods");
    let best = by.iter().filter(|(_, missing)| lost(missing) == lost(fewest));
    (best.map(|(method, _)| *method).collect(), fewest.clone())
}

/// What a render with default flags is made by.
fn method(open: &[Method]) -> String {
    match open {
        [one] => format!("{}: it makes paths that no other method makes", one.name()),
        some => {
            let names: Vec<&str> = some.iter().map(|method| method.name()).collect();
            format!("{}: a trial tells, where the job is large enough", names.join(" or "))
        }
    }
}

fn show(contents: &Contents) {
    let report = &contents.report;
    let (open, not_made) = methods(contents);
    let [points, spots, suns] = contents.punctual;
    let some = |count: u64, what: &str| if count > 0 { format!("{count} {what}") } else { String::new() };
    let or_none = |list: String, none: &str| if list.is_empty() { none.to_owned() } else { list };
    let lights = words::list(&[
        some(report.emissive_triangles, "emissive triangles"),
        some(points.into(), "points"),
        some(spots.into(), "spots"),
        some(suns.into(), "suns"),
    ]);
    let dropped = words::list(&[
        some(report.dropped.degenerate_triangles, "triangles without area"),
        some(report.dropped.lines_and_points, "primitives of lines or points"),
        some(report.dropped.instances, "places without extent"),
    ]);
    table::facts(&[
        ("triangles", format!("{} placed, {} in memory", report.placed_triangles, report.triangles)),
        ("meshes", format!("{} at {} places", report.meshes, report.instances)),
        ("materials", report.materials.to_string()),
        ("textures", format!("{}, {} pixels", report.textures, report.pixels)),
        ("lights", or_none(lights, "none: a default sky lights it")),
        ("light names", light_names(contents)),
        ("cameras", or_none(cameras(contents), "none: the whole scene is framed")),
        ("variants", variants(contents)),
        ("memory", words::bytes(report.bytes)),
        ("needs", words::list(&contents.needs)),
        ("leaves out", words::list(&contents.leaves_out)),
        ("dropped", dropped),
        ("method", method(&open)),
    ]);
    for missing in &not_made {
        terminal::result(&format!("warning: {}", line(missing)));
    }
    for warning in &contents.warnings {
        let pointer = if warning.pointer.is_empty() { "/" } else { &warning.pointer };
        terminal::result(&format!("warning: {pointer}: {}", warning.detail));
    }
}

/// How the lights are called, for `L'name'`.
fn light_names(contents: &Contents) -> String {
    let all = &contents.light_names.all;
    let mut some: Vec<String> = all.iter().take(NAMES_SHOWN).map(|name| format!("'{name}'")).collect();
    if all.len() > NAMES_SHOWN {
        some.push(format!("and {} more", all.len() - NAMES_SHOWN));
    }
    words::list(&some)
}

fn variants(contents: &Contents) -> String {
    words::list(&contents.report.variants.iter().map(|name| format!("'{name}'")).collect::<Vec<_>>())
}

fn cameras(contents: &Contents) -> String {
    let names = contents.report.camera_names.iter().enumerate();
    let shown: Vec<String> = names
        .map(|(i, name)| {
            let called = if name.is_empty() { format!("number {i}") } else { format!("number {i} '{name}'") };
            match contents.aspects.get(i).copied().flatten() {
                Some(aspect) => format!("{called} ({aspect:.3}:1)"),
                None => called,
            }
        })
        .collect();
    words::list(&shown)
}

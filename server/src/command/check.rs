//! `ovtigre check`: what is in a scene, without rendering it.

use super::{exit::Outcome, scene_file, table, terminal, words};
use clap::Args;
use ovtigre::farm::reach::line;
use ovtigre_core::{
    gltf::limits::Limits,
    path::{
        expression::language::Language,
        reach::{Unreachable, unreachable},
    },
    render::inspect::{Contents, inspect},
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

/// As JSON.
#[derive(Serialize)]
struct Document<'a> {
    contents: &'a ovtigre_core::gltf::report::Report,
    needs: &'a [String],
    leaves_out: &'a [String],
    /// By a render with default flags.
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
    Document {
        contents: &contents.report,
        needs: &contents.needs,
        leaves_out: &contents.leaves_out,
        unreachable: not_made(contents),
        warnings: (contents.warnings.iter())
            .map(|w| Warning { pointer: &w.pointer, detail: &w.detail })
            .collect(),
    }
}

/// Paths that a render with default flags asks for and does not make.
fn not_made(contents: &Contents) -> Vec<Unreachable> {
    let language = Language::compile(&[FULL]).expect("the default is an expression");
    let around = contents.surroundings(&language.tags().collect::<Vec<_>>());
    unreachable(&language, Method::Path, &around, None)
}

fn show(contents: &Contents) {
    let report = &contents.report;
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
        ("cameras", or_none(cameras(contents), "none: the whole scene is framed")),
        ("variants", variants(contents)),
        ("memory", words::bytes(report.bytes)),
        ("needs", words::list(&contents.needs)),
        ("leaves out", words::list(&contents.leaves_out)),
        ("dropped", dropped),
    ]);
    for missing in not_made(contents) {
        terminal::result(&format!("warning: {}", line(&missing)));
    }
    for warning in &contents.warnings {
        let pointer = if warning.pointer.is_empty() { "/" } else { &warning.pointer };
        terminal::result(&format!("warning: {pointer}: {}", warning.detail));
    }
}

fn variants(contents: &Contents) -> String {
    words::list(&contents.report.variants.iter().map(|name| format!("'{name}'")).collect::<Vec<_>>())
}

fn cameras(contents: &Contents) -> String {
    let names = contents.report.camera_names.iter().enumerate();
    let shown: Vec<String> = names
        .map(|(i, name)| {
            let called = if name.is_empty() { i.to_string() } else { format!("{i} '{name}'") };
            match contents.aspects.get(i).copied().flatten() {
                Some(aspect) => format!("{called} ({aspect:.3}:1)"),
                None => called,
            }
        })
        .collect();
    words::list(&shown)
}

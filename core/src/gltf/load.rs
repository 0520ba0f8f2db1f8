//! A bundle to a scene.

use crate::gltf::accessor::Source;
use crate::gltf::animation::{self, Animation};
use crate::gltf::assemble::{Assembled, assemble};
use crate::gltf::buffers::Buffers;
use crate::gltf::bundle::Bundle;
use crate::gltf::document::Document;
use crate::gltf::error::{LoadError, Problem, Problems};
use crate::gltf::gather::MaterialIds;
use crate::gltf::limits::Limits;
use crate::gltf::nodes::Tree;
use crate::gltf::report::{Animated, Dropped, Report};
use crate::gltf::shapes::{Materials, Shape};
use crate::gltf::textures::TextureTable;
use crate::gltf::{
    cameras, draco, extensions, image_based, instancing, knots, lights, materials, nodes, pictures, shapes,
    survey, variants,
};
use crate::scene::data::SceneData;
use crate::scene::material::{Coverage, Material, MaterialId};
use crate::scene::texture::Texture;
use std::collections::BTreeMap;

/// A scene, and what is to be said about how it was read.
#[derive(Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: SceneData,
    /// What is odd about the file.
    pub warnings: Vec<Problem>,
    /// What is in the scene, in numbers.
    pub report: Report,
}

/// Reads a scene: glTF 2.0 with the extensions that [`Bundle`]'s document may require. The result depends on
/// nothing but the bytes and the limits.
/// The scene is as its animations have it at 0 s.
pub fn load(bundle: &Bundle, limits: &Limits) -> Result<Loaded, LoadError> {
    load_as(bundle, limits, &Choice::default())
}

/// What of a file is to be shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Choice<'a> {
    /// Seconds at which the shutter opens and closes. Where both are the same, nothing moves.
    pub times: [f64; 2],
    /// Name of a variant of materials (`KHR_materials_variants`); `None` for the materials that the file has without.
    pub variant: Option<&'a str>,
}

/// What of a document was looked at to read its scene.
pub(crate) struct Used {
    /// Of each buffer view, whether it was.
    pub(crate) views: Vec<bool>,
    /// The pictures, by index.
    pub(crate) images: Vec<usize>,
    /// Whether there are compressed buffer views.
    pub(crate) compressed: bool,
}

/// Reads a scene as [`load`] does, as it moves while the shutter is open. All animations of the file play together.
pub fn load_as(bundle: &Bundle, limits: &Limits, choice: &Choice<'_>) -> Result<Loaded, LoadError> {
    Ok(load_and_note(bundle, limits, choice)?.0)
}

/// The same, and what was looked at.
pub(crate) fn load_and_note(
    bundle: &Bundle,
    limits: &Limits,
    choice: &Choice<'_>,
) -> Result<(Loaded, Used), LoadError> {
    let times = choice.times;
    let parts = bundle.parts()?;
    let document = Document::parse(bundle.name(), &parts.json, limits)?;
    let mut problems = Problems::default();
    if parts.ignored > 0 {
        problems.add("", format!("{} bytes of the container mean nothing to glTF 2.0", parts.ignored));
    }
    check_version(&document)?;
    extensions::check(&document, &mut problems)?;
    let mut buffers = Buffers::read(bundle, &document, parts.binary, limits)?;
    let filled = draco::fill(&document, &buffers, limits, &mut problems)?;
    buffers.fill(filled);
    let variant = choice.variant.map(|name| variants::find(&document, name)).transpose()?;
    let source = Source { document: &document, buffers: &buffers, limits, variant };

    let animation = animation::read(source, &mut problems)?;
    let mut tree = nodes::read(&document, &animation, times, &mut problems)?;
    instancing::expand(source, &mut tree)?;
    let tree = tree;
    let (mut table, mut dropped) = (TextureTable::default(), Dropped::default());
    let (mut shapes, skins) = shapes::find(source, &tree, &animation, times)?;
    let read = shapes::read(source, &mut shapes, &skins, &mut table, &mut dropped, &mut problems)?;
    let stage = knots::stage(source, &tree, &animation, &shapes, &skins, times, &mut problems)?;
    stage.morph(source, &animation, &mut shapes)?;
    let animated = count_animated(&animation, &tree, &shapes);
    let (meshes, instances) = count_uses(&shapes);
    let pictures = pictures::read(bundle, source, &table.images(), &mut problems)?;
    let (environment, faces) = (image_based::read(bundle, source, &mut problems)?)
        .map(|light| (light.environment, light.pictures))
        .unzip();
    let images = table.images().into_iter().chain(faces.into_iter().flatten()).collect();
    let used = Used { views: source.buffers.seen(), images, compressed: source.buffers.are_compressed() };
    survey::survey(bundle, source, &table.images(), &mut problems);
    let textures = table.finish(&pictures);
    let (materials, ids) = number_materials(&document, read, &shapes, &textures)?;
    let Assembled { meshes: lists, instances: placed, bounds, normalisation } =
        assemble(&document, &stage, shapes, &ids, &mut dropped, &mut problems)?;
    let mut scene = SceneData {
        meshes: lists,
        instances: placed,
        materials,
        textures,
        cameras: cameras::read(&document, &stage, &normalisation, &mut problems)?,
        punctual: lights::read(&document, &stage, &normalisation, &mut problems)?,
        environment,
        bounds,
        normalisation,
        knots: stage.knots.clone(),
    };
    let metres = normalisation.metres(1.0);
    for volume in scene.materials.iter_mut().filter_map(|m| m.volume.as_mut()) {
        volume.absorption = (volume.absorption.as_dvec3() * metres).as_vec3();
    }
    let variants = variants::names(&document)?;
    let report = Report { variants, animated, ..Report::of(&scene, meshes, instances, dropped) };
    point_out_what_is_missing(&scene, &report, &mut problems);
    Ok((Loaded { scene, warnings: problems.finish(), report }, used))
}

fn check_version(document: &Document) -> Result<(), LoadError> {
    let root = document.root();
    let asset =
        root.object("asset")?.ok_or_else(|| root.error("\"asset\" is missing: this is no glTF 2.0"))?;
    for key in ["minVersion", "version"] {
        let Some(text) = asset.text(key)? else {
            continue;
        };
        let mut numbers = text.split('.').map(str::parse::<u32>);
        match (key, numbers.next(), numbers.next(), numbers.next()) {
            ("version", Some(Ok(2)), Some(Ok(_)), None)
            | ("minVersion", Some(Ok(2)), Some(Ok(0)), None)
            | ("minVersion", Some(Ok(0 | 1)), Some(Ok(_)), None) => {}
            (_, Some(Ok(major)), Some(Ok(minor)), None) => {
                return Err(asset
                    .error(format!("glTF {major}.{minor} is not supported; convert the scene to glTF 2.0")));
            }
            _ => return Err(asset.error(format!("\"{key}\" is not a version such as 2.0"))),
        }
    }
    match asset.text("version")? {
        Some(_) => Ok(()),
        None => Err(asset.error("\"version\" is missing: this is no glTF 2.0")),
    }
}

/// Meshes with anything in them, and the places at which they stand.
fn count_uses(shapes: &[Shape]) -> (u64, u64) {
    let mut meshes: Vec<usize> = shapes.iter().filter(|s| !s.is_empty()).map(|s| s.mesh).collect();
    meshes.sort_unstable();
    meshes.dedup();
    let places = shapes.iter().filter(|s| !s.is_empty()).map(|s| s.places.len() as u64).sum();
    (meshes.len() as u64, places)
}

/// What of a scene can move.
fn count_animated(animation: &Animation<'_>, tree: &Tree<'_>, shapes: &[Shape]) -> Animated {
    let driven = |node: &&nodes::Node<'_>| animation.channels(node.index).is_some();
    let count = |of: fn(&&Shape) -> bool| shapes.iter().filter(|s| !s.is_empty()).filter(of).count() as u64;
    Animated {
        nodes: tree.nodes.iter().filter(driven).count() as u64,
        skins: count(|shape| shape.skin.is_some()),
        morphs: count(|shape| !shape.weights.is_empty()),
    }
}

/// Materials that triangles have, in the order of the document, the default one first.
fn number_materials(
    document: &Document,
    read: Materials,
    shapes: &[Shape],
    textures: &[Texture],
) -> Result<(Vec<Material>, MaterialIds), LoadError> {
    let mut least_alpha: BTreeMap<Option<usize>, f32> = BTreeMap::new();
    for geometry in shapes.iter().flat_map(|shape| &shape.geometries).filter(|g| !g.triangles.is_empty()) {
        let least = least_alpha.entry(geometry.material).or_insert(1.0);
        *least = geometry.colours.iter().fold(*least, |least, colour| least.min(colour.w));
    }
    let mut opaque: Vec<Option<bool>> = vec![None; textures.len()];
    let (mut materials, mut ids) = (Vec::new(), BTreeMap::new());
    for (index, material) in read {
        let mut material = material.material;
        if material.coverage != Coverage::Opaque {
            let texture_is_opaque = material.base_color.texture.is_none_or(|slot| {
                let known = &mut opaque[slot.texture.index()];
                *known.get_or_insert_with(|| textures[slot.texture.index()].picture.is_opaque())
            });
            let least = least_alpha.get(&index).copied().unwrap_or(1.0);
            materials::simplify(&mut material, least, texture_is_opaque);
        }
        let Ok(id) = u16::try_from(materials.len()) else {
            let (file, pointer) = (document.file().to_owned(), "/materials".to_owned());
            let found = document.count("materials") as u64;
            return Err(LoadError::Limit { file, pointer, what: "materials", found, limit: 1 << 16 });
        };
        ids.insert(index, MaterialId(id));
        materials.push(material);
    }
    Ok((materials, ids))
}

fn point_out_what_is_missing(scene: &SceneData, report: &Report, problems: &mut Problems) {
    if report.triangles == 0 {
        problems.add("", "there are no triangles: nothing can be seen but the background");
    }
    if scene.cameras.is_empty() {
        problems.add("", "there is no camera: the scene is framed");
    }
    let dark = scene.materials.iter().all(|m| m.unlit.is_some());
    if !scene.is_lit() && (!dark || report.triangles == 0) {
        let light = if report.emissive_triangles == 0 { "there is no light" } else { "only textures glow" };
        problems
            .add("", format!("{light}: the scene is lit by a default sky unless an environment is given"));
    }
    let degenerate = report.dropped.degenerate_triangles;
    if degenerate > 0 {
        problems.add("", format!("{degenerate} triangles have no area and are left out"));
    }
}

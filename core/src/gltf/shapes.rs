//! Which meshes the scene uses, where, and their geometry.

use crate::gltf::accessor::Source;
use crate::gltf::animation::Animation;
use crate::gltf::curve::Side;
use crate::gltf::document::At;
use crate::gltf::error::{LoadError, Problems};
use crate::gltf::geometry::{self, Geometry, Wanted};
use crate::gltf::nodes::{Carries, Tree};
use crate::gltf::report::Dropped;
use crate::gltf::skin::{self, Skin};
use crate::gltf::textures::{TextureTable, UvSets};
use crate::gltf::topology::Mode;
use crate::gltf::{materials, variants};
use crate::scene::bounds::Bounds;
use crate::scene::material::Material;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

/// A mesh in one form: with its skin and weights.
pub(crate) struct Shape {
    /// Name of the mesh.
    pub(crate) name: String,
    /// Index of the mesh in the document.
    pub(crate) mesh: usize,
    /// Of its morph targets, when the shutter opens.
    pub(crate) weights: Vec<f64>,
    /// Whether its weights change while the shutter is open.
    pub(crate) morphs: Morphs,
    /// Index of its skin in the document.
    pub(crate) skin: Option<usize>,
    pub(crate) geometries: Vec<Geometry>,
    /// Where it stands: indices into the tree's nodes. One where it has a skin or weights of its own.
    pub(crate) places: Vec<usize>,
}

/// Whether morph weights change while the shutter is open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Morphs {
    Yes,
    No,
}

/// The skins that shapes have, by their index in the document.
pub(crate) type Skins = BTreeMap<usize, Skin>;

/// The materials of all shapes, by their index in the document.
pub(crate) type Materials = BTreeMap<Option<usize>, materials::Read>;

/// Finds the meshes that nodes of the tree have. Nodes share a shape if they have the same mesh, no skin, and
/// the same morph weights.
pub(crate) fn find(
    source: Source<'_>,
    tree: &Tree<'_>,
    animation: &Animation<'_>,
    times: [f64; 2],
) -> Result<(Vec<Shape>, Skins), LoadError> {
    let document = source.document;
    let (mut shapes, mut skins): (Vec<Shape>, Skins) = (Vec::new(), Skins::new());
    let mut plain: BTreeMap<usize, usize> = BTreeMap::new();
    let mut places = 0_u64;
    let meshes = tree.nodes.iter().enumerate().filter(|(_, node)| node.carries != Carries::AllButMesh);
    for (place, node) in meshes {
        let Some(mesh) = node.at.index("mesh", "meshes", document.count("meshes"))? else {
            continue;
        };
        places += 1;
        if places > source.limits.instances {
            return Err(LoadError::Limit {
                file: document.file().to_owned(),
                pointer: node.at.pointer.clone(),
                what: "instances",
                found: places,
                limit: source.limits.instances,
            });
        }
        let item = document.item("meshes", mesh)?;
        let skin = node.at.index("skin", "skins", document.count("skins"))?;
        let curve = animation.channels(node.index).and_then(|channels| channels.weights.as_ref());
        let own = match curve {
            Some(curve) => Some(curve.weights(times[0], Side::After)),
            None => weights(&node.at)?,
        };
        let still = curve.is_none_or(|curve| curve.is_still(times[0], times[1]));
        let morphs = if still { Morphs::No } else { Morphs::Yes };
        if skin.is_none()
            && own.is_none()
            && let Some(&known) = plain.get(&mesh)
        {
            shapes[known].places.push(place);
            continue;
        }
        if skin.is_none() && own.is_none() {
            plain.insert(mesh, shapes.len());
        }
        let weights = match own {
            Some(weights) => weights,
            None => weights_or_none(&item)?,
        };
        if let Some(index) = skin
            && let Entry::Vacant(new) = skins.entry(index)
        {
            new.insert(skin::read(source, tree, index)?);
        }
        let (name, geometries) = (item.name(), Vec::new());
        shapes.push(Shape { name, mesh, weights, morphs, skin, geometries, places: vec![place] });
    }
    Ok((shapes, skins))
}

fn weights(at: &At<'_>) -> Result<Option<Vec<f64>>, LoadError> {
    if at.get("weights").is_none() {
        return Ok(None);
    }
    let number = |w: &At<'_>| w.value.as_f64().ok_or_else(|| w.error("should be a number"));
    at.elements("weights")?.iter().map(number).collect::<Result<_, _>>().map(Some)
}

fn weights_or_none(at: &At<'_>) -> Result<Vec<f64>, LoadError> {
    Ok(weights(at)?.unwrap_or_default())
}

/// Reads the geometry of all shapes and the materials they have.
pub(crate) fn read(
    source: Source<'_>,
    shapes: &mut [Shape],
    skins: &Skins,
    table: &mut TextureTable,
    dropped: &mut Dropped,
    problems: &mut Problems,
) -> Result<Materials, LoadError> {
    check_promised(source, shapes)?;
    let mut read = Materials::new();
    for shape in shapes {
        let item = source.document.item("meshes", shape.mesh)?;
        let primitives = item.items("primitives")?;
        if primitives.is_empty() {
            problems.add(&item.pointer, "has no primitives");
        }
        for (number, primitive) in primitives.iter().enumerate() {
            let (mode, _) = geometry::promised(primitive, source)?;
            if mode == Mode::NoSurface {
                dropped.lines_and_points += 1;
                problems.add(&primitive.pointer, "points and lines have no surface and are left out");
                continue;
            }
            let index = variants::material(source, primitive)?;
            let material = match read.entry(index) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(new) => new.insert(materials::read(source.document, index, table, problems)?),
            };
            let wanted = wanted(material, shape);
            let Some(mut geometry) = geometry::read(primitive, source, wanted, &shape.weights, problems)?
            else {
                continue;
            };
            geometry.primitive = number;
            dropped.degenerate_triangles += geometry.degenerate;
            let joints = shape.skin.map(|skin| skins[&skin].len());
            check_joints(&geometry, joints, &primitive.pointer, source)?;
            if is_brushed(&material.material) && geometry.tangents.is_empty() {
                let detail = "is brushed, but has no tangents and nothing that tells of them (normals and texture \
                              coordinates): it is not brushed";
                problems.add(&primitive.pointer, detail);
            }
            point_out_thin_glass(&geometry, material, problems);
            shape.geometries.push(geometry);
        }
    }
    Ok(read)
}

fn is_brushed(material: &Material) -> bool {
    material.layers.as_ref().is_some_and(|layers| layers.finish.brush.factor > 0.0)
}

fn wanted(read: &materials::Read, shape: &Shape) -> Wanted {
    let material = &read.material;
    // A set that only textures left out would have used is not read.
    let mut sets = UvSets::default();
    for slot in material.slots() {
        let list = slot.set as usize;
        sets.0[list] = read.sets.0[list];
    }
    let coat = material.layers.as_ref().and_then(|layers| layers.coat_normal);
    let mut normal_map = material.normal.or(coat).map(|(slot, _)| slot.set as usize);
    if is_brushed(material) && normal_map.is_none() {
        let brush = material.layers.as_ref().and_then(|layers| layers.finish.brush.texture);
        // Without a texture of its own, tangents are along the first set that the material has.
        normal_map = Some(brush.map_or(0, |slot| slot.set as usize));
        sets.0[0] = sets.0[0].or(Some(0));
    }
    let influences = if shape.skin.is_some() { skin::Wanted::Yes } else { skin::Wanted::No };
    Wanted { sets, normal_map, influences, morphs: shape.morphs }
}

/// Counts triangles and vertices to morph before any is read.
fn check_promised(source: Source<'_>, shapes: &[Shape]) -> Result<(), LoadError> {
    let (mut total, mut morphed) = (0_u64, 0_u64);
    for shape in shapes {
        for primitive in source.document.item("meshes", shape.mesh)?.items("primitives")? {
            total = total.saturating_add(geometry::promised(&primitive, source)?.1);
            morphed = morphed.saturating_add(shape.morphed_vertices(&primitive, source)?);
            for (what, found, limit) in [
                ("triangles", total, source.limits.triangles),
                ("vertices of morph targets", morphed, source.limits.morphed_vertices),
            ] {
                if found > limit {
                    let (file, pointer) = (source.document.file().to_owned(), primitive.pointer);
                    return Err(LoadError::Limit { file, pointer, what, found, limit });
                }
            }
        }
    }
    Ok(())
}

fn check_joints(
    geometry: &Geometry,
    joints: Option<usize>,
    pointer: &str,
    source: Source<'_>,
) -> Result<(), LoadError> {
    let greatest = geometry.influences.as_ref().map_or(0, skin::Influences::greatest);
    let Some(joints) = joints.filter(|joints| greatest >= *joints) else {
        return Ok(());
    };
    Err(source
        .document
        .error(pointer, format!("a vertex hangs on joint {greatest}, but its skin has only {joints}")))
}

fn point_out_thin_glass(geometry: &Geometry, read: &materials::Read, problems: &mut Problems) {
    let material = &read.material;
    let thin = material.transmission.factor > 0.0 && material.volume.is_none();
    if thin && geometry.looks_closed() {
        problems.add(
            &read.pointer,
            "transmits light through the closed surface of a solid, but is thin-walled and does not refract; \
             if a solid is meant, add KHR_materials_volume with a thicknessFactor above 0",
        );
    }
}

impl Shape {
    /// Whether anything is left of it.
    pub(crate) fn is_empty(&self) -> bool {
        self.geometries.iter().all(|g| g.triangles.is_empty())
    }

    /// Vertices that a primitive's morph targets move, each target counted, to give it one form.
    pub(crate) fn morphed_vertices(&self, primitive: &At<'_>, source: Source<'_>) -> Result<u64, LoadError> {
        let targets = primitive.elements("targets")?.len();
        let weighted = match self.morphs {
            Morphs::Yes => targets,
            Morphs::No => self.weights.iter().take(targets).filter(|w| **w != 0.0).count(),
        };
        let accessors = source.document.count("accessors");
        let vertices =
            match primitive.object("attributes")?.map(|a| a.index("POSITION", "accessors", accessors)) {
                Some(index) if weighted > 0 => {
                    index?.map_or(Ok(0), |index| source.accessor(index).map(|a| a.count))?
                }
                _ => 0,
            };
        Ok(weighted as u64 * vertices as u64)
    }

    /// A box around it, in the mesh's space.
    pub(crate) fn bounds(&self) -> Bounds {
        self.geometries.iter().map(Geometry::bounds).fold(Bounds::EMPTY, Bounds::union)
    }
}

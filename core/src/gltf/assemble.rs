//! Geometry to the scene's meshes and instances.

use crate::gltf::document::Document;
use crate::gltf::error::{LoadError, Problems};
use crate::gltf::geometry::{Geometry, has_area};
use crate::gltf::nodes::Tree;
use crate::gltf::report::Dropped;
use crate::gltf::shapes::{Exact, Shape};
use crate::scene::bounds::Bounds;
use crate::scene::instance::{Handedness, Instance, Moved, Placement, normal_matrix};
use crate::scene::material::MaterialId;
use crate::scene::mesh::{Mesh, MeshId, Part};
use crate::scene::normalisation::Normalisation;
use glam::{DAffine3, DVec3, Vec3, Vec4};
use std::collections::BTreeMap;

/// The scene's materials by their index in the document; `None` is the default one.
pub(crate) type MaterialIds = BTreeMap<Option<usize>, MaterialId>;

/// Meshes and instances of a scene.
pub(crate) struct Assembled {
    pub(crate) meshes: Vec<Mesh>,
    pub(crate) instances: Vec<Instance>,
    /// In the scene's space.
    pub(crate) bounds: Bounds,
    pub(crate) normalisation: Normalisation,
}

/// What geometry is moved by on its way into a mesh.
struct Route<'a> {
    shape: &'a Shape,
    world: DAffine3,
    normalisation: Normalisation,
}

/// Puts shapes into the scene: those at one place are gathered in one mesh in the scene's space, those at
/// several become instances of a mesh that is centred and scaled for itself.
pub(crate) fn assemble(
    document: &Document,
    tree: &Tree<'_>,
    mut shapes: Vec<Shape>,
    ids: &MaterialIds,
    dropped: &mut Dropped,
    problems: &mut Problems,
) -> Result<Assembled, LoadError> {
    shapes.retain(|shape| !shape.is_empty());
    let normalisation = Normalisation::around(&bounds(document, tree, &shapes)?);
    let mut gathered = Mesh::default();
    let (mut meshes, mut instances) = (vec![Mesh::default()], Vec::new());
    for mut shape in shapes {
        let mut moved = Vec::new();
        let local = Normalisation::around(&local_bounds(&shape));
        if shape.places.len() > 1 {
            shape.places.retain(|&place| {
                let to_world = from_local(&normalisation.apply(&tree.nodes[place].world), &local);
                let placement = Moved::new(&to_world);
                moved.extend(placement.map(|placement| (place, placement)));
                placement.is_none()
            });
        }
        // What no single-precision matrix can place, flattened or far too small, is gathered like the rest.
        for &place in &shape.places {
            let node = &tree.nodes[place];
            let before = gathered.triangles.len();
            let name = if node.name.is_empty() { &shape.name } else { &node.name };
            let route = Route { shape: &shape, world: node.world, normalisation };
            gather(&mut gathered, &route, name, ids, dropped);
            if gathered.triangles.len() == before {
                dropped.instances += 1;
                problems
                    .add(&node.at.pointer, "its transform leaves nothing of its mesh that light could meet");
            }
        }
        if moved.is_empty() {
            continue;
        }
        let mut mesh = Mesh::default();
        let route = Route { shape: &shape, world: DAffine3::IDENTITY, normalisation: local };
        gather(&mut mesh, &route, &shape.name, ids, dropped);
        if mesh.triangles.is_empty() {
            dropped.instances += moved.len() as u64;
            let pointer = format!("/meshes/{}", shape.mesh);
            problems.add(pointer, "all its triangles vanish in single precision: it is left out");
            continue;
        }
        let id = MeshId(meshes.len() as u32);
        meshes.push(mesh);
        instances.extend(moved.into_iter().map(|(place, placement)| Instance {
            mesh: id,
            name: tree.nodes[place].name.clone(),
            placement: Placement::Moved(placement),
        }));
    }
    place_gathered(gathered, &mut meshes, &mut instances);
    let bounds = scene_bounds(&meshes, &instances);
    Ok(Assembled { meshes, instances, bounds, normalisation })
}

/// Puts the gathered mesh first, or closes the gap where there is none.
fn place_gathered(gathered: Mesh, meshes: &mut Vec<Mesh>, instances: &mut Vec<Instance>) {
    if gathered.triangles.is_empty() {
        meshes.remove(0);
        for instance in instances.iter_mut() {
            instance.mesh.0 -= 1;
        }
    } else {
        meshes[0] = gathered;
        instances.insert(0, Instance { mesh: MeshId(0), name: String::new(), placement: Placement::World });
    }
}

/// A box around everything, in the file's space.
fn bounds(document: &Document, tree: &Tree<'_>, shapes: &[Shape]) -> Result<Bounds, LoadError> {
    let mut all = Bounds::EMPTY;
    for shape in shapes {
        let exact = if shape.places.len() == 1 { Exact::Yes } else { Exact::No };
        for &place in &shape.places {
            let node = &tree.nodes[place];
            let bounds = shape.bounds_at(&node.world, exact);
            if !bounds.is_finite() || !bounds.radius().is_finite() {
                return Err(document.error(&node.at.pointer, "its mesh exceeds the range of numbers there"));
            }
            all = all.union(bounds);
        }
    }
    Ok(all)
}

fn local_bounds(shape: &Shape) -> Bounds {
    shape.geometries.iter().map(Geometry::bounds).fold(Bounds::EMPTY, Bounds::union)
}

/// The transform of points that `local` was applied to already.
fn from_local(to_scene: &DAffine3, local: &Normalisation) -> DAffine3 {
    DAffine3 {
        matrix3: to_scene.matrix3 * (1.0 / local.scale()),
        translation: to_scene.transform_point3(local.centre),
    }
}

fn scene_bounds(meshes: &[Mesh], instances: &[Instance]) -> Bounds {
    let of: Vec<Bounds> = (meshes.iter())
        .map(|mesh| {
            let mut bounds = Bounds::EMPTY;
            mesh.positions.iter().for_each(|p| bounds.include(p.as_dvec3()));
            bounds
        })
        .collect();
    let mut all = Bounds::EMPTY;
    for instance in instances {
        let to_world = instance.placement.to_world();
        let matrix = glam::Mat3::from(to_world.matrix3).as_dmat3();
        let transform =
            DAffine3 { matrix3: matrix, translation: Vec3::from(to_world.translation).as_dvec3() };
        all = all.union(of[instance.mesh.index()].transformed(&transform));
    }
    all
}

/// Appends a shape to a mesh.
fn gather(mesh: &mut Mesh, route: &Route<'_>, name: &str, ids: &MaterialIds, dropped: &mut Dropped) {
    let first = mesh.triangles.len() as u32;
    for geometry in &route.shape.geometries {
        let base = mesh.positions.len() as u32;
        let mut mirrored = Handedness::of(&route.world.matrix3);
        append_vertices(mesh, route, geometry, &mut mirrored);
        let material = ids[&geometry.material];
        for triangle in &geometry.triangles {
            let [a, b, c] = triangle.map(|v| v + base);
            let corners = [a, b, c].map(|v| mesh.positions[v as usize]);
            if corners.iter().all(|p| p.is_finite()) && has_area(corners) {
                mesh.triangles.push(if mirrored == Handedness::Mirrored { [a, c, b] } else { [a, b, c] });
                mesh.materials.push(material);
            } else {
                dropped.degenerate_triangles += 1;
            }
        }
    }
    if mesh.triangles.len() as u32 > first {
        mesh.parts.push(Part { first, name: name.to_owned() });
    }
}

fn append_vertices(mesh: &mut Mesh, route: &Route<'_>, geometry: &Geometry, handedness: &mut Handedness) {
    let before = mesh.positions.len();
    let after = before + geometry.positions.len();
    let rigid = geometry.influences.is_none();
    let normals = normal_matrix(&route.world.matrix3);
    let transform =
        |v: usize| if rigid { route.world } else { route.shape.transform(geometry, v, &route.world) };
    if let Some(influences) = &geometry.influences {
        *handedness = Handedness::of(&influences.transform(0, &route.shape.joints).matrix3);
    }
    mesh.positions.extend(
        (geometry.positions.iter().enumerate())
            .map(|(v, p)| route.normalisation.point(transform(v).transform_point3(p.as_dvec3()))),
    );
    let normal = |(v, n): (usize, &Vec3)| {
        let matrix = if rigid { normals } else { normal_matrix(&transform(v).matrix3) };
        (matrix * n.as_dvec3()).normalize_or_zero().as_vec3()
    };
    extend(&mut mesh.normals, before, after, Vec3::ZERO, geometry.normals.iter().enumerate().map(normal));
    let sign = handedness.sign();
    let tangent = |(v, t): (usize, &Vec4)| {
        let direction: DVec3 = transform(v).matrix3 * t.truncate().as_dvec3();
        direction.normalize_or_zero().as_vec3().extend(t.w * sign)
    };
    extend(&mut mesh.tangents, before, after, Vec4::ZERO, geometry.tangents.iter().enumerate().map(tangent));
    for (list, uvs) in mesh.uvs.iter_mut().zip(&geometry.uvs) {
        extend(list, before, after, glam::Vec2::ZERO, uvs.iter().copied());
    }
    extend(&mut mesh.colours, before, after, Vec4::ONE, geometry.colours.iter().copied());
}

/// Appends an attribute to a list that may not have been needed so far, or is not brought now.
fn extend<T: Copy>(
    list: &mut Vec<T>,
    before: usize,
    after: usize,
    default: T,
    values: impl ExactSizeIterator<Item = T>,
) {
    if values.len() > 0 {
        list.resize(before, default);
        list.extend(values);
    } else if !list.is_empty() {
        list.resize(after, default);
    }
}

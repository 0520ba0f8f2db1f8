//! Geometry to the scene's meshes and instances.

use crate::gltf::document::Document;
use crate::gltf::error::{LoadError, Problems};
use crate::gltf::gather::{MaterialIds, Moving, Route, gather};
use crate::gltf::report::Dropped;
use crate::gltf::shapes::Shape;
use crate::gltf::stage::{Exact, Stage};
use crate::scene::bounds::Bounds;
use crate::scene::instance::{Instance, Motion, Moved, Placement};
use crate::scene::mesh::{Mesh, MeshId};
use crate::scene::normalisation::Normalisation;
use glam::{DAffine3, Vec3};

/// Meshes and instances of a scene.
pub(crate) struct Assembled {
    pub(crate) meshes: Vec<Mesh>,
    pub(crate) instances: Vec<Instance>,
    /// In the scene's space.
    pub(crate) bounds: Bounds,
    pub(crate) normalisation: Normalisation,
}

/// Puts shapes into the scene: those that rest at one place are gathered in one mesh in the scene's space, those at
/// several, or that move, become instances of a mesh that is centred and scaled for itself. What changes its shape is
/// gathered in a mesh of its own.
pub(crate) fn assemble(
    document: &Document,
    stage: &Stage<'_>,
    mut shapes: Vec<Shape>,
    ids: &MaterialIds,
    dropped: &mut Dropped,
    problems: &mut Problems,
) -> Result<Assembled, LoadError> {
    shapes.retain(|shape| !shape.is_empty());
    let normalisation = Normalisation::around(&bounds(document, stage, &shapes)?);
    let (mut gathered, mut moving) = (Mesh::default(), Moving::new(stage));
    let (mut meshes, mut instances) = (vec![Mesh::default()], Vec::new());
    for mut shape in shapes {
        let local = Normalisation::around(&shape.bounds());
        let placed = place(stage, &mut shape, &normalisation, &local);
        // What no single-precision matrix can place, flattened or far too small, is gathered like the rest.
        for &place in &shape.places {
            let node = &stage.tree.nodes[place];
            let name = if node.name.is_empty() { &shape.name } else { &node.name };
            let found = if stage.knots_of(&shape, place) > 1 {
                moving.gather(&shape, place, normalisation, name, ids, dropped)
            } else {
                let route = Route { shape: &shape, setting: stage.setting(&shape, place, 0), normalisation };
                gather(&mut gathered, &route, name, ids, dropped)
            };
            if found == 0 {
                dropped.instances += 1;
                problems
                    .add(&node.at.pointer, "its transform leaves nothing of its mesh that light could meet");
            }
        }
        if placed.is_empty() {
            continue;
        }
        let mut mesh = Mesh::default();
        let route = Route::in_itself(stage, &shape, placed[0].0, local);
        if gather(&mut mesh, &route, &shape.name, ids, dropped) == 0 {
            dropped.instances += placed.len() as u64;
            let pointer = format!("/meshes/{}", shape.mesh);
            problems.add(pointer, "all its triangles vanish in single precision: it is left out");
            continue;
        }
        let id = MeshId(meshes.len() as u32);
        meshes.push(mesh);
        instances.extend(placed.into_iter().map(|(place, placement)| Instance {
            mesh: id,
            name: stage.tree.nodes[place].name.clone(),
            placement,
        }));
    }
    if let Some(mesh) = moving.finish() {
        let mesh_id = MeshId(meshes.len() as u32);
        meshes.push(mesh);
        instances.push(Instance { mesh: mesh_id, name: String::new(), placement: Placement::World });
    }
    place_gathered(gathered, &mut meshes, &mut instances);
    let bounds = scene_bounds(&meshes, &instances);
    Ok(Assembled { meshes, instances, bounds, normalisation })
}

/// The places of a shape that become instances; they are taken out of the shape's list.
fn place(
    stage: &Stage<'_>,
    shape: &mut Shape,
    normalisation: &Normalisation,
    local: &Normalisation,
) -> Vec<(usize, Placement)> {
    let moves = |place: &usize| stage.tree.moves(*place);
    let instanced = shape.places.len() > 1 || shape.places.iter().any(moves);
    if !instanced || shape.skin.is_some() || stage.deforms(shape) {
        return Vec::new();
    }
    let mut placed = Vec::new();
    shape.places.retain(|&place| {
        let knots: Vec<DAffine3> =
            stage.worlds(place).map(|world| from_local(&normalisation.apply(&world), local)).collect();
        let placement = match knots[..] {
            [ref one] => Moved::new(one).map(Placement::Moved),
            _ => Motion::new(&knots).map(Placement::Moving),
        };
        let stays = placement.is_none();
        placed.extend(placement.map(|placement| (place, placement)));
        stays
    });
    placed
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

/// A box around everything at all knots, in the file's space.
fn bounds(document: &Document, stage: &Stage<'_>, shapes: &[Shape]) -> Result<Bounds, LoadError> {
    let mut all = Bounds::EMPTY;
    for shape in shapes {
        for &place in &shape.places {
            let rigid = stage.tree.moves(place) && !stage.deforms(shape) && shape.skin.is_none();
            let exact = if shape.places.len() == 1 && !rigid { Exact::Yes } else { Exact::No };
            for knot in 0..stage.knots_of(shape, place) {
                let bounds = stage.setting(shape, place, knot).bounds(shape, exact);
                if !bounds.is_finite() || !bounds.radius().is_finite() {
                    let pointer = &stage.tree.nodes[place].at.pointer;
                    return Err(document.error(pointer, "its mesh exceeds the range of numbers there"));
                }
                all = all.union(bounds);
            }
        }
    }
    Ok(all)
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
            let forms = mesh.forms.iter().flat_map(|form| &form.positions);
            mesh.positions.iter().chain(forms).for_each(|p| bounds.include(p.as_dvec3()));
            bounds
        })
        .collect();
    let mut all = Bounds::EMPTY;
    for instance in instances {
        let one = [instance.placement.to_world()];
        let knots = instance.placement.knots();
        for to_world in if knots.is_empty() { &one[..] } else { knots } {
            let matrix = glam::Mat3::from(to_world.matrix3).as_dmat3();
            let transform =
                DAffine3 { matrix3: matrix, translation: Vec3::from(to_world.translation).as_dvec3() };
            all = all.union(of[instance.mesh.index()].transformed(&transform));
        }
    }
    all
}

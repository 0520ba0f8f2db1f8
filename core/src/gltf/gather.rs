//! Geometry appended to meshes.

use crate::gltf::geometry::{Geometry, has_area};
use crate::gltf::report::Dropped;
use crate::gltf::shapes::Shape;
use crate::gltf::stage::{Setting, Stage};
use crate::scene::instance::{Handedness, normal_matrix};
use crate::scene::material::MaterialId;
use crate::scene::mesh::{Form, Mesh, Part};
use crate::scene::normalisation::Normalisation;
use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use std::collections::BTreeMap;

/// The scene's materials by their index in the document; `None` is the default one.
pub(crate) type MaterialIds = BTreeMap<Option<usize>, MaterialId>;

/// What geometry is moved by on its way into a mesh.
pub(crate) struct Route<'a> {
    pub(crate) shape: &'a Shape,
    pub(crate) setting: Setting<'a>,
    pub(crate) normalisation: Normalisation,
}

impl<'a> Route<'a> {
    /// Into a mesh in the shape's own space, centred and scaled by `local`.
    pub(crate) fn in_itself(
        stage: &'a Stage<'_>,
        shape: &'a Shape,
        place: usize,
        local: Normalisation,
    ) -> Self {
        let setting = Setting { world: DAffine3::IDENTITY, ..stage.setting(shape, place, 0) };
        Self { shape, setting, normalisation: local }
    }
}

/// Appends a shape to a mesh; the number of its triangles comes back.
pub(crate) fn gather(
    mesh: &mut Mesh,
    route: &Route<'_>,
    name: &str,
    ids: &MaterialIds,
    dropped: &mut Dropped,
) -> usize {
    let first = mesh.triangles.len();
    for geometry in &route.shape.geometries {
        let base = mesh.positions.len();
        let handedness = append_form(&mut lists(mesh), route, geometry);
        append_rest(mesh, base, geometry);
        append_triangles(mesh, base, geometry, handedness, ids, dropped);
    }
    name_part(mesh, first, name)
}

/// What changes its shape, in the scene's space.
pub(crate) struct Moving<'a> {
    stage: &'a Stage<'a>,
    mesh: Mesh,
    /// Forms at the second knot and all further ones.
    forms: Vec<Form>,
}

impl<'a> Moving<'a> {
    pub(crate) fn new(stage: &'a Stage<'a>) -> Self {
        let forms = vec![Form::default(); stage.knots.count() - 1];
        Self { stage, mesh: Mesh::default(), forms }
    }

    /// Appends a shape at a place; the number of its triangles comes back. A triangle stays if it has an area at any
    /// knot.
    pub(crate) fn gather(
        &mut self,
        shape: &Shape,
        place: usize,
        normalisation: Normalisation,
        name: &str,
        ids: &MaterialIds,
        dropped: &mut Dropped,
    ) -> usize {
        let first = self.mesh.triangles.len();
        let route = |knot| Route { shape, setting: self.stage.setting(shape, place, knot), normalisation };
        for geometry in &shape.geometries {
            let base = self.mesh.positions.len();
            let handedness = append_form(&mut lists(&mut self.mesh), &route(0), geometry);
            append_rest(&mut self.mesh, base, geometry);
            for (i, form) in self.forms.iter_mut().enumerate() {
                let Form { positions, normals, tangents } = form;
                append_form(&mut Lists { positions, normals, tangents }, &route(i + 1), geometry);
            }
            let all: Vec<&[Vec3]> = std::iter::once(self.mesh.positions.as_slice())
                .chain(self.forms.iter().map(|form| form.positions.as_slice()))
                .collect();
            let usable = |triangle: [u32; 3]| {
                let corners = |list: &&[Vec3]| triangle.map(|v| list[v as usize]);
                all.iter().all(|list| corners(list).iter().all(|p| p.is_finite()))
                    && all.iter().any(|list| has_area(corners(list)))
            };
            let usable: Vec<bool> =
                geometry.triangles.iter().map(|t| usable(t.map(|v| v + base as u32))).collect();
            append_usable(&mut self.mesh, base, geometry, handedness, ids, dropped, |i| usable[i]);
        }
        name_part(&mut self.mesh, first, name)
    }

    /// The mesh, if there is anything in it.
    pub(crate) fn finish(self) -> Option<Mesh> {
        let mesh = Mesh { forms: self.forms, ..self.mesh };
        (!mesh.triangles.is_empty()).then_some(mesh)
    }
}

fn name_part(mesh: &mut Mesh, first: usize, name: &str) -> usize {
    let found = mesh.triangles.len() - first;
    if found > 0 {
        mesh.parts.push(Part { first: first as u32, name: name.to_owned() });
    }
    found
}

/// The lists of a mesh or a form that motion changes.
struct Lists<'m> {
    positions: &'m mut Vec<Vec3>,
    normals: &'m mut Vec<Vec3>,
    tangents: &'m mut Vec<Vec4>,
}

fn lists(mesh: &mut Mesh) -> Lists<'_> {
    Lists { positions: &mut mesh.positions, normals: &mut mesh.normals, tangents: &mut mesh.tangents }
}

/// Appends a geometry's vertices; whether they were mirrored comes back.
fn append_form(into: &mut Lists<'_>, route: &Route<'_>, geometry: &Geometry) -> Handedness {
    let setting = &route.setting;
    let vertices = setting.vertices(geometry);
    let before = into.positions.len();
    let after = before + vertices.positions.len();
    let rigid = geometry.influences.is_none();
    let normals = normal_matrix(&setting.world.matrix3);
    let transform = |v: usize| if rigid { setting.world } else { setting.transform(geometry, v) };
    let handedness = match vertices.positions.len() {
        0 => Handedness::Kept,
        _ => Handedness::of(&transform(0).matrix3),
    };
    into.positions.extend(
        (vertices.positions.iter().enumerate())
            .map(|(v, p)| route.normalisation.point(transform(v).transform_point3(p.as_dvec3()))),
    );
    let normal = |(v, n): (usize, &Vec3)| {
        let matrix = if rigid { normals } else { normal_matrix(&transform(v).matrix3) };
        (matrix * n.as_dvec3()).normalize_or_zero().as_vec3()
    };
    extend(into.normals, before, after, Vec3::ZERO, vertices.normals.iter().enumerate().map(normal));
    let sign = handedness.sign();
    let tangent = |(v, t): (usize, &Vec4)| {
        let direction: DVec3 = transform(v).matrix3 * t.truncate().as_dvec3();
        direction.normalize_or_zero().as_vec3().extend(t.w * sign)
    };
    extend(into.tangents, before, after, Vec4::ZERO, vertices.tangents.iter().enumerate().map(tangent));
    handedness
}

/// Appends what of a geometry's vertices no motion changes.
fn append_rest(mesh: &mut Mesh, before: usize, geometry: &Geometry) {
    let after = mesh.positions.len();
    for (list, uvs) in mesh.uvs.iter_mut().zip(&geometry.uvs) {
        extend(list, before, after, Vec2::ZERO, uvs.iter().copied());
    }
    extend(&mut mesh.colours, before, after, Vec4::ONE, geometry.colours.iter().copied());
}

/// Appends the triangles that have an area.
fn append_triangles(
    mesh: &mut Mesh,
    base: usize,
    geometry: &Geometry,
    handedness: Handedness,
    ids: &MaterialIds,
    dropped: &mut Dropped,
) {
    let positions = &mesh.positions;
    let usable = |triangle: &[u32; 3]| {
        let corners = triangle.map(|v| positions[v as usize + base]);
        corners.iter().all(|p| p.is_finite()) && has_area(corners)
    };
    let usable: Vec<bool> = geometry.triangles.iter().map(usable).collect();
    append_usable(mesh, base, geometry, handedness, ids, dropped, |i| usable[i]);
}

fn append_usable(
    mesh: &mut Mesh,
    base: usize,
    geometry: &Geometry,
    handedness: Handedness,
    ids: &MaterialIds,
    dropped: &mut Dropped,
    usable: impl Fn(usize) -> bool,
) {
    let material = ids[&geometry.material];
    for (i, triangle) in geometry.triangles.iter().enumerate() {
        if !usable(i) {
            dropped.degenerate_triangles += 1;
            continue;
        }
        let [a, b, c] = triangle.map(|v| v + base as u32);
        mesh.triangles.push(if handedness == Handedness::Mirrored { [a, c, b] } else { [a, b, c] });
        mesh.materials.push(material);
    }
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

//! One primitive's triangles, in the mesh's space.

use crate::gltf::accessor::{Accessor, Component, Source};
use crate::gltf::document::At;
use crate::gltf::error::{LoadError, Problems};
use crate::gltf::shapes::Morphs;
use crate::gltf::skin::Influences;
use crate::gltf::textures::UvSets;
use crate::gltf::topology::Mode;
use crate::gltf::{skin, tangents, variants};
use crate::scene::bounds::Bounds;
use crate::scene::mesh::Form;
use glam::{Vec2, Vec3, Vec4};

/// Triangles of one material. Attributes that are absent or not needed are empty lists.
#[derive(Default)]
pub(crate) struct Geometry {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    pub(crate) normals: Vec<Vec3>,
    pub(crate) tangents: Vec<Vec4>,
    pub(crate) uvs: [Vec<Vec2>; 2],
    pub(crate) colours: Vec<Vec4>,
    pub(crate) influences: Option<Influences>,
    /// Index of its material in the document.
    pub(crate) material: Option<usize>,
    /// Triangles without area that were left out.
    pub(crate) degenerate: u64,
    /// Its number among the mesh's primitives.
    pub(crate) primitive: usize,
    /// Where its vertices are in the primitive's accessors; empty unless it morphs.
    pub(crate) vertices: Vec<u32>,
    /// What it has morphed to at the second knot and all further ones; empty unless it morphs.
    pub(crate) forms: Vec<Form>,
}

/// What a primitive's material asks of its geometry.
#[derive(Clone, Copy)]
pub(crate) struct Wanted {
    pub(crate) sets: UvSets,
    /// The list of coordinates that a normal map is laid out by.
    pub(crate) normal_map: Option<usize>,
    pub(crate) influences: skin::Wanted,
    pub(crate) morphs: Morphs,
}

/// The vertices `vertices` of a primitive (as its accessors count them), morphed by `weights`. Tangents are empty where
/// the primitive has none.
pub(crate) fn morphed<'a>(
    at: &'a At<'a>,
    source: Source<'a>,
    vertices: &[u32],
    weights: &[f64],
) -> Result<Form, LoadError> {
    let attributes = at.object("attributes")?.ok_or_else(|| at.error("\"attributes\" is missing"))?;
    let position = accessor(source, &attributes, "POSITION")?;
    let position = position.ok_or_else(|| attributes.error("\"POSITION\" is missing"))?;
    let (used, targets) = (vertices.to_vec(), morph_targets(at, weights)?);
    let primitive = Primitive { at, attributes, source, vertices: position.count, used, targets };
    Ok(Form {
        positions: primitive.positions(&position)?,
        normals: primitive.normals(&mut Problems::default())?,
        tangents: primitive.tangents()?,
    })
}

/// The accessors of a primitive, looked up but not read.
struct Primitive<'a> {
    at: &'a At<'a>,
    attributes: At<'a>,
    source: Source<'a>,
    vertices: usize,
    /// Vertices that triangles have, in rising order: what is read.
    used: Vec<u32>,
    targets: Vec<(At<'a>, f32)>,
}

/// Reads a primitive that has a surface. `weights` are those of its morph targets.
pub(crate) fn read<'a>(
    at: &'a At<'a>,
    source: Source<'a>,
    wanted: Wanted,
    weights: &[f64],
    problems: &mut Problems,
) -> Result<Option<Geometry>, LoadError> {
    let attributes = at.object("attributes")?.ok_or_else(|| at.error("\"attributes\" is missing"))?;
    let Some(position) = accessor(source, &attributes, "POSITION")? else {
        problems.add(&attributes.pointer, "there is no POSITION: the primitive is left out");
        return Ok(None);
    };
    check_shape(&attributes, "POSITION", &position, &[3])?;
    let targets = morph_targets(at, weights)?;
    let mut triangles = corners(at, source, position.count, problems)?;
    let mut primitive =
        Primitive { at, attributes, source, vertices: position.count, used: Vec::new(), targets };
    primitive.used = renumber(&mut triangles, position.count);
    let mut geometry = Geometry { triangles, ..Geometry::default() };
    geometry.material = variants::material(source, at)?;
    geometry.positions = primitive.positions(&position)?;
    geometry.normals = primitive.normals(problems)?;
    geometry.colours = primitive.colours()?;
    for (list, number) in geometry.uvs.iter_mut().zip(wanted.sets.0) {
        if let Some(number) = number {
            *list = primitive.uvs(number, problems)?;
        }
    }
    if wanted.influences == skin::Wanted::Yes {
        geometry.influences = primitive.influences()?;
    }
    match wanted.morphs {
        // What has no area now may have one later.
        Morphs::Yes => geometry.vertices.clone_from(&primitive.used),
        Morphs::No => geometry.drop_degenerate(),
    }
    if let Some(set) = wanted.normal_map {
        geometry.tangents = primitive.tangents()?;
        let usable = !geometry.normals.is_empty() && geometry.tangents.len() == geometry.positions.len();
        if !usable && !geometry.uvs[set].is_empty() {
            tangents::compute(&mut geometry, set);
        }
    }
    geometry.compact();
    Ok(Some(geometry))
}

/// Number of triangles that a primitive promises, and whether it has a surface at all.
pub(crate) fn promised(at: &At<'_>, source: Source<'_>) -> Result<(Mode, u64), LoadError> {
    let code = at.whole("mode")?.unwrap_or(4);
    let mode = Mode::from_code(code)
        .ok_or_else(|| at.error(format!("the mode {code} does not exist in glTF 2.0")))?;
    let accessors = source.document.count("accessors");
    let index = match at.index("indices", "accessors", accessors)? {
        Some(index) => Some(index),
        None => match at.object("attributes")? {
            Some(attributes) => attributes.index("POSITION", "accessors", accessors)?,
            None => None,
        },
    };
    let count = match index {
        Some(index) => source.accessor(index)?.count,
        None => 0,
    };
    Ok((mode, mode.count(count) as u64))
}

fn accessor<'a>(
    source: Source<'a>,
    attributes: &At<'_>,
    name: &str,
) -> Result<Option<Accessor<'a>>, LoadError> {
    match attributes.index(name, "accessors", source.document.count("accessors"))? {
        Some(index) => source.accessor(index).map(Some),
        None => Ok(None),
    }
}

fn check_shape(
    attributes: &At<'_>,
    name: &str,
    accessor: &Accessor<'_>,
    allowed: &[usize],
) -> Result<(), LoadError> {
    if allowed.contains(&accessor.components) {
        return Ok(());
    }
    let have = accessor.components;
    Err(attributes.need(name)?.error(format!("has {have} numbers a vertex instead of {}", allowed[0])))
}

/// Targets whose weight is not zero.
fn morph_targets<'a>(at: &At<'a>, weights: &[f64]) -> Result<Vec<(At<'a>, f32)>, LoadError> {
    let targets = at.items("targets")?;
    Ok(targets.into_iter().zip(weights).filter(|(_, w)| **w != 0.0).map(|(t, w)| (t, *w as f32)).collect())
}

/// The primitive's triangles, by vertex.
fn corners(
    at: &At<'_>,
    source: Source<'_>,
    vertices: usize,
    problems: &mut Problems,
) -> Result<Vec<[u32; 3]>, LoadError> {
    let (mode, _) = promised(at, source)?;
    let indices = match at.index("indices", "accessors", source.document.count("accessors"))? {
        Some(index) => Some(source.accessor(index)?),
        None => None,
    };
    if let Some(indices) = &indices {
        let wrong = indices.components != 1
            || !matches!(indices.component, Component::U8 | Component::U16 | Component::U32);
        if wrong {
            return Err(at.need("indices")?.error("must be scalars of 8, 16 or 32 unsigned bits"));
        }
    }
    let count = indices.as_ref().map_or(vertices, |i| i.count);
    let leftover = match mode {
        Mode::Triangles => count % 3,
        Mode::Strip | Mode::Fan if count < 3 => count,
        _ => 0,
    };
    if leftover > 0 {
        problems.add(
            &at.pointer,
            format!("{leftover} of its {count} corners make no whole triangle and are left out"),
        );
    }
    let corner = |i: usize| -> Result<u32, LoadError> {
        let vertex = indices.as_ref().map_or(i as u32, |indices| indices.get_index(i));
        if (vertex as usize) < vertices {
            return Ok(vertex);
        }
        Err(at
            .need("indices")?
            .error(format!("element {i} is {vertex}, but POSITION has only {vertices} vertices")))
    };
    // Every index is checked, also those of corners that make no triangle.
    for i in mode.count(count) * 3..if mode == Mode::Triangles { count } else { 0 } {
        corner(i)?;
    }
    let triangle = |i| {
        let [a, b, c] = mode.triangle(i);
        Ok([corner(a)?, corner(b)?, corner(c)?])
    };
    (0..mode.count(count)).map(triangle).collect()
}

/// Numbers the vertices that triangles have from 0 on; the old numbers come back, in rising order.
fn renumber(triangles: &mut [[u32; 3]], vertices: usize) -> Vec<u32> {
    let corners = triangles.len() * 3;
    // A table over all vertices, unless a few triangles look at a huge shared accessor.
    if vertices / 8 <= corners {
        let mut place = vec![u32::MAX; vertices];
        for v in triangles.iter().flatten() {
            place[*v as usize] = 0;
        }
        let used: Vec<u32> = (0..vertices as u32).filter(|&v| place[v as usize] == 0).collect();
        for (new, &old) in used.iter().enumerate() {
            place[old as usize] = new as u32;
        }
        triangles.iter_mut().flatten().for_each(|v| *v = place[*v as usize]);
        return used;
    }
    let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    triangles.iter_mut().flatten().for_each(|v| *v = used.partition_point(|u| u < v) as u32);
    used
}

fn not_finite(attributes: &At<'_>, name: &str, vertex: u32) -> LoadError {
    match attributes.need(name) {
        Ok(at) => at.error(format!("vertex {vertex} is not a finite number")),
        Err(error) => error,
    }
}

impl<'a> Primitive<'a> {
    /// An attribute of the shape wanted, as many elements as positions.
    fn attribute(
        &self,
        attributes: &At<'_>,
        name: &str,
        allowed: &[usize],
    ) -> Result<Option<Accessor<'a>>, LoadError> {
        let Some(accessor) = accessor(self.source, attributes, name)? else {
            return Ok(None);
        };
        check_shape(attributes, name, &accessor, allowed)?;
        if accessor.count < self.vertices {
            let (have, vertices) = (accessor.count, self.vertices);
            return Err(attributes.need(name)?.error(format!(
                "has {have} elements, but POSITION has {vertices}: all attributes must have as many"
            )));
        }
        Ok(Some(accessor))
    }

    /// Finite vectors of the used vertices.
    fn vectors<const N: usize>(
        &self,
        attributes: &At<'_>,
        name: &str,
        accessor: &Accessor<'_>,
    ) -> Result<Vec<[f32; N]>, LoadError> {
        (self.used.iter())
            .map(|&v| {
                let numbers = accessor.get::<N>(v as usize);
                if numbers.iter().all(|x| x.is_finite()) {
                    Ok(numbers)
                } else {
                    Err(not_finite(attributes, name, v))
                }
            })
            .collect()
    }

    fn positions(&self, accessor: &Accessor<'_>) -> Result<Vec<Vec3>, LoadError> {
        let read = self.vectors::<3>(&self.attributes, "POSITION", accessor)?;
        let mut positions: Vec<Vec3> = read.into_iter().map(Vec3::from).collect();
        self.morph("POSITION", &mut positions)?;
        if let Some(i) = positions.iter().position(|p| !p.is_finite()) {
            return Err(self
                .at
                .error(format!("vertex {} is morphed beyond the range of numbers", self.used[i])));
        }
        Ok(positions)
    }

    /// Adds what the targets move.
    fn morph(&self, name: &str, vectors: &mut [Vec3]) -> Result<(), LoadError> {
        for (target, weight) in &self.targets {
            if let Some(accessor) = self.attribute(target, name, &[3])? {
                let moves = self.vectors::<3>(target, name, &accessor)?;
                for (vector, by) in vectors.iter_mut().zip(moves) {
                    *vector += Vec3::from(by) * *weight;
                }
            }
        }
        Ok(())
    }

    /// Unit normals; zero, which means flat, for those that are not usable.
    fn normals(&self, problems: &mut Problems) -> Result<Vec<Vec3>, LoadError> {
        let Some(accessor) = self.attribute(&self.attributes, "NORMAL", &[3])? else {
            return Ok(Vec::new());
        };
        let mut normals: Vec<Vec3> =
            self.used.iter().map(|&v| Vec3::from(accessor.get::<3>(v as usize))).collect();
        self.morph("NORMAL", &mut normals)?;
        let mut unusable = 0_usize;
        for normal in &mut normals {
            // Normals as short as 1e-30 still say where they point.
            let unit =
                if normal.is_finite() { normal.as_dvec3().normalize_or_zero().as_vec3() } else { Vec3::ZERO };
            unusable += usize::from(unit == Vec3::ZERO);
            *normal = unit;
        }
        if unusable > 0 {
            let detail = format!("{unusable} normals are zero or not finite: the surface is flat there");
            problems.add(self.attributes.pointer_to("NORMAL"), detail);
        }
        Ok(normals)
    }

    fn tangents(&self) -> Result<Vec<Vec4>, LoadError> {
        let Some(accessor) = self.attribute(&self.attributes, "TANGENT", &[4])? else {
            return Ok(Vec::new());
        };
        let read: Vec<Vec4> = self.used.iter().map(|&v| Vec4::from(accessor.get::<4>(v as usize))).collect();
        let mut directions: Vec<Vec3> = read.iter().map(|t| t.truncate()).collect();
        self.morph("TANGENT", &mut directions)?;
        let tangent = |(direction, read): (Vec3, &Vec4)| {
            let unit = if direction.is_finite() { direction.normalize_or_zero() } else { Vec3::ZERO };
            unit.extend(if read.w < 0.0 { -1.0 } else { 1.0 })
        };
        Ok(directions.into_iter().zip(&read).map(tangent).collect())
    }

    fn uvs(&self, number: u64, problems: &mut Problems) -> Result<Vec<Vec2>, LoadError> {
        let name = format!("TEXCOORD_{number}");
        let Some(accessor) = self.attribute(&self.attributes, &name, &[2])? else {
            problems.add(
                &self.attributes.pointer,
                format!("there is no {name}, which its material needs: its textures show their first pixel"),
            );
            return Ok(Vec::new());
        };
        Ok(self.vectors::<2>(&self.attributes, &name, &accessor)?.into_iter().map(Vec2::from).collect())
    }

    /// Colours; none where all are white.
    fn colours(&self) -> Result<Vec<Vec4>, LoadError> {
        let Some(accessor) = self.attribute(&self.attributes, "COLOR_0", &[4, 3])? else {
            return Ok(Vec::new());
        };
        let mut colours: Vec<Vec4> = (self.vectors::<4>(&self.attributes, "COLOR_0", &accessor)?.into_iter())
            .map(|c| Vec4::from(c).max(Vec4::ZERO))
            .collect();
        if accessor.components == 3 {
            for colour in &mut colours {
                colour.w = 1.0;
            }
        }
        if colours.iter().all(|c| *c == Vec4::ONE) {
            colours.clear();
        }
        Ok(colours)
    }

    /// Joints and weights of the used vertices; `None` where there are none.
    fn influences(&self) -> Result<Option<Influences>, LoadError> {
        let mut sets = Vec::new();
        for number in 0..skin::SETS {
            let joints = self.attribute(&self.attributes, &format!("JOINTS_{number}"), &[4])?;
            let weights = self.attribute(&self.attributes, &format!("WEIGHTS_{number}"), &[4])?;
            let (Some(joints), Some(weights)) = (joints, weights) else {
                break;
            };
            if matches!(joints.component, Component::F32 | Component::U32) {
                return Err(self.attributes.error(format!("JOINTS_{number} must be 8 or 16 unsigned bits")));
            }
            sets.push((joints, weights));
        }
        Ok((!sets.is_empty()).then(|| Influences::new(&self.used, &sets)))
    }
}

fn keep<T: Copy>(list: &mut Vec<T>, used: &[u32]) {
    if !list.is_empty() {
        *list = used.iter().map(|&v| list[v as usize]).collect();
    }
}

fn again<T: Copy>(list: &mut Vec<T>, vertex: usize) {
    if let Some(&value) = list.get(vertex) {
        list.push(value);
    }
}

impl Geometry {
    /// Leaves out triangles without area. Differences of floats and their products are nearly exact in double
    /// precision, so what remains has a normal.
    fn drop_degenerate(&mut self) {
        let before = self.triangles.len();
        let positions = &self.positions;
        self.triangles.retain(|t| has_area(t.map(|v| positions[v as usize])));
        self.degenerate += (before - self.triangles.len()) as u64;
    }

    /// Leaves out vertices that no triangle has.
    fn compact(&mut self) {
        let vertices = self.positions.len();
        let used = renumber(&mut self.triangles, vertices);
        if used.len() == vertices {
            return;
        }
        keep(&mut self.positions, &used);
        keep(&mut self.normals, &used);
        keep(&mut self.tangents, &used);
        keep(&mut self.uvs[0], &used);
        keep(&mut self.uvs[1], &used);
        keep(&mut self.colours, &used);
        keep(&mut self.vertices, &used);
        if let Some(influences) = &mut self.influences {
            influences.keep(&used);
        }
    }

    /// A copy of a vertex, by its number.
    pub(crate) fn duplicate(&mut self, vertex: usize) -> u32 {
        let new = self.positions.len() as u32;
        again(&mut self.positions, vertex);
        again(&mut self.normals, vertex);
        again(&mut self.tangents, vertex);
        again(&mut self.uvs[0], vertex);
        again(&mut self.uvs[1], vertex);
        again(&mut self.colours, vertex);
        again(&mut self.vertices, vertex);
        if let Some(influences) = &mut self.influences {
            influences.duplicate(vertex);
        }
        new
    }

    /// A box around its vertices, in the mesh's space.
    pub(crate) fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        self.positions.iter().for_each(|p| bounds.include(p.as_dvec3()));
        bounds
    }

    /// Whether its faces cancel out: the vector area of a closed surface is zero.
    pub(crate) fn looks_closed(&self) -> bool {
        let mut vector = glam::DVec3::ZERO;
        let mut area = 0.0;
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|v| self.positions[v as usize].as_dvec3());
            let cross = (b - a).cross(c - a);
            vector += cross;
            area += cross.length();
        }
        area > 0.0 && vector.length() < 1e-3 * area
    }
}

/// Whether three corners span an area, and so have a normal.
pub(crate) fn has_area(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let cross = (b - a).cross(c - a);
    cross.is_finite() && cross != glam::DVec3::ZERO && cross.length_squared() > 0.0
}

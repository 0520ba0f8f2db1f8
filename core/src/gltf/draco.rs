//! Primitives that are compressed with Draco: their accessors are filled before anything reads them.

use crate::gltf::accessor::{Component, Filled, Layout};
use crate::gltf::buffers::Buffers;
use crate::gltf::document::{At, Document};
use crate::gltf::error::{LoadError, Problems};
use crate::gltf::guard::guarded;
use crate::gltf::limits::Limits;
use draco_core::decode_limits::DecodeLimits;
use draco_core::decoder_buffer::DecoderBuffer;
use draco_core::draco_types::DataType;
use draco_core::geometry_attribute::PointAttribute;
use draco_core::geometry_indices::PointIndex;
use draco_core::mesh::Mesh;
use draco_core::mesh_decoder::MeshDecoder;
use std::collections::BTreeMap;

const DRACO: &str = "KHR_draco_mesh_compression";

/// Vertices and triangles that a byte may stand for. What exporters write takes more than a bit for each.
const ELEMENTS_A_BYTE: u64 = 64;

/// What fills the accessors of compressed primitives that have no buffer view of their own, by index.
pub(crate) fn fill(
    document: &Document,
    buffers: &Buffers<'_>,
    limits: &Limits,
    problems: &mut Problems,
) -> Result<BTreeMap<usize, Filled>, LoadError> {
    let (mut filled, mut total) = (BTreeMap::new(), 0_u64);
    for mesh in document.list("meshes")? {
        for primitive in mesh.items("primitives")? {
            let Some(at) = primitive.extension(DRACO)? else { continue };
            let wanted = wanted(document, &primitive, &at)?;
            if wanted.iter().all(|w| filled.contains_key(&w.accessor)) {
                continue;
            }
            let mesh = decode(document, buffers, &at, limits)?;
            for Wanted { accessor, source } in wanted {
                let item = document.item("accessors", accessor)?;
                let elements = elements(&item, &at, &mesh, source)?;
                let says = Layout::of(&item)?.count;
                if says != elements.count {
                    let (count, pointer) = (elements.count, &at.pointer);
                    problems.add(
                        format!("{}/count", item.pointer),
                        format!("says {says} elements, but {pointer} holds {count}, which are taken"),
                    );
                }
                total += elements.bytes.len() as u64;
                if total > limits.buffer_bytes {
                    let (file, pointer) = (document.file().to_owned(), at.pointer);
                    let (what, limit) = ("bytes of decompressed geometry", limits.buffer_bytes);
                    return Err(LoadError::Limit { file, pointer, what, found: total, limit });
                }
                filled.insert(accessor, elements);
            }
        }
    }
    Ok(filled)
}

/// An accessor that a compressed primitive fills.
struct Wanted {
    accessor: usize,
    source: Origin,
}

/// From what of the compressed mesh.
#[derive(Clone, Copy)]
enum Origin {
    Faces,
    /// The attribute with this id.
    Attribute(u32),
}

/// The accessors without buffer views.
fn wanted(document: &Document, primitive: &At<'_>, at: &At<'_>) -> Result<Vec<Wanted>, LoadError> {
    let accessors = document.count("accessors");
    let mut wanted = Vec::new();
    let mut want = |accessor: usize, source| -> Result<(), LoadError> {
        if document.item("accessors", accessor)?.get("bufferView").is_none() {
            wanted.push(Wanted { accessor, source });
        }
        Ok(())
    };
    if !matches!(primitive.whole("mode")?, None | Some(4)) {
        return Err(at.error("only lists of triangles can be decompressed: \"mode\" must be 4"));
    }
    match primitive.index("indices", "accessors", accessors)? {
        Some(indices) => want(indices, Origin::Faces)?,
        None => return Err(primitive.error("\"indices\" is missing, which a Draco mesh needs")),
    }
    let ids = at.object("attributes")?.ok_or_else(|| at.error("\"attributes\" is missing"))?;
    let attributes = primitive.object("attributes")?;
    for name in ids.members().into_iter().flat_map(|members| members.keys()) {
        let id = ids.whole(name)?.and_then(|id| u32::try_from(id).ok());
        let id = id.ok_or_else(|| ids.error(format!("\"{name}\" is no id of a Draco attribute")))?;
        let Some(attributes) = &attributes else { continue };
        if let Some(accessor) = attributes.index(name, "accessors", accessors)? {
            want(accessor, Origin::Attribute(id))?;
        }
    }
    Ok(wanted)
}

fn decode(
    document: &Document,
    buffers: &Buffers<'_>,
    at: &At<'_>,
    limits: &Limits,
) -> Result<Mesh, LoadError> {
    let view = at.need("bufferView")?.as_index("bufferViews", document.count("bufferViews"))?;
    let bytes = buffers.view(document, view)?.bytes;
    let most = limits.unbacked_elements + ELEMENTS_A_BYTE * bytes.len() as u64;
    let most = most.min(limits.triangles);
    let ceilings = DecodeLimits::default()
        .with_max_points(most)
        .with_max_faces(most)
        .with_max_decoded_bytes(most.saturating_mul(64).min(limits.buffer_bytes));
    let mesh = guarded(|| {
        let mut mesh = Mesh::new();
        let mut buffer = DecoderBuffer::new(bytes).with_limits(ceilings);
        MeshDecoder::new().decode(&mut buffer, &mut mesh).map(|()| mesh)
    });
    mesh.map_err(|broken| at.error(format!("its Draco mesh in /bufferViews/{view} is broken: {broken}")))
}

fn elements(item: &At<'_>, at: &At<'_>, mesh: &Mesh, source: Origin) -> Result<Filled, LoadError> {
    let layout = Layout::of(item)?;
    match source {
        Origin::Faces => {
            let points = mesh.num_points() as u32;
            let corners = || mesh.faces().iter().flatten().map(|corner| corner.0);
            if let Some(beyond) = corners().find(|corner| *corner >= points) {
                return Err(at.error(format!("a triangle has vertex {beyond} of only {points}")));
            }
            let greatest = corners().max().unwrap_or(0);
            if layout.components != 1 || !layout.component.holds_index(greatest) {
                return Err(item.error(format!("cannot hold indices of up to {greatest}")));
            }
            let mut bytes = Vec::with_capacity(mesh.num_faces() * 3 * layout.size());
            corners().for_each(|corner| layout.component.write_index(corner, &mut bytes));
            Ok(Filled { bytes, count: mesh.num_faces() as u64 * 3 })
        }
        Origin::Attribute(id) => {
            let Some(attribute) = mesh.attribute_by_unique_id(id) else {
                return Err(at.error(format!("its Draco mesh has no attribute {id}")));
            };
            let count = mesh.num_points();
            Ok(Filled { bytes: values(attribute, count, &layout), count: count as u64 })
        }
    }
}

/// One value a point, as the accessor has them.
fn values(attribute: &PointAttribute, count: usize, layout: &Layout) -> Vec<u8> {
    let size = layout.size();
    let same = attribute.data_type() == data_type(layout.component)
        && usize::from(attribute.num_components()) == layout.components;
    if !same {
        let mut bytes = Vec::with_capacity(count * size);
        for value in attribute.read_f32s(count, layout.components) {
            layout.component.write(value, &mut bytes);
        }
        return bytes;
    }
    let (data, stride) = (attribute.buffer().data(), attribute.byte_stride().max(0) as usize);
    let mut bytes = vec![0; count * size];
    for (point, value) in bytes.chunks_exact_mut(size).enumerate() {
        let index = attribute.mapped_index(PointIndex(point as u32)).0 as usize;
        let start = index.checked_mul(stride);
        let end = start.and_then(|start| start.checked_add(size));
        if let (Some(start), Some(end)) = (start, end)
            && let Some(found) = data.get(start..end)
        {
            value.copy_from_slice(found);
        }
    }
    bytes
}

fn data_type(component: Component) -> DataType {
    match component {
        Component::I8 => DataType::Int8,
        Component::U8 => DataType::Uint8,
        Component::I16 => DataType::Int16,
        Component::U16 => DataType::Uint16,
        Component::U32 => DataType::Uint32,
        Component::F32 => DataType::Float32,
    }
}

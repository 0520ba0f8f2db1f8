//! Typed elements of buffers: strided, normalised, sparse.

use crate::gltf::buffers::Buffers;
use crate::gltf::document::{At, Document};
use crate::gltf::error::LoadError;
use crate::gltf::limits::Limits;

/// What accessors are read from.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) document: &'a Document,
    pub(crate) buffers: &'a Buffers<'a>,
    pub(crate) limits: &'a Limits,
}

/// Typed elements, checked to lie within their buffers.
#[derive(Clone)]
pub(crate) struct Accessor<'a> {
    /// Number of elements.
    pub(crate) count: usize,
    /// Numbers an element.
    pub(crate) components: usize,
    pub(crate) component: Component,
    normalised: bool,
    /// `None`: all zero.
    dense: Option<Strided<'a>>,
    sparse: Option<Sparse<'a>>,
}

#[derive(Clone, Copy)]
struct Strided<'a> {
    bytes: &'a [u8],
    stride: usize,
}

#[derive(Clone)]
struct Sparse<'a> {
    indices: Indices<'a>,
    values: Strided<'a>,
}

/// Which elements a sparse accessor replaces, left where they are: reading them for every primitive that
/// shares an accessor would cost more than the file is long. They should rise strictly; where they do not,
/// some are not found, and the survey says so.
#[derive(Clone)]
struct Indices<'a> {
    component: Component,
    raw: Strided<'a>,
    count: usize,
}

impl Indices<'_> {
    #[inline]
    fn get(&self, i: usize) -> u32 {
        self.component.read_index(&self.raw.bytes[i * self.raw.stride..])
    }

    /// Where `element` is, if it is replaced.
    fn find(&self, element: u32) -> Option<usize> {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low.midpoint(high);
            if self.get(middle) < element { low = middle + 1 } else { high = middle }
        }
        (low < self.count && self.get(low) == element).then_some(low)
    }
}

/// Type of the numbers of an accessor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn from_code(code: u64) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// A number as it stands; integers normalised as glTF 2.0 §3.11 says.
    #[inline]
    fn read(self, bytes: &[u8], normalised: bool) -> f32 {
        let (value, one) = match self {
            Self::I8 => (f32::from(bytes[0] as i8), 127.0),
            Self::U8 => (f32::from(bytes[0]), 255.0),
            Self::I16 => (f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
            Self::U16 => (f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
            Self::U32 => (word(bytes) as f32, 4_294_967_295.0),
            Self::F32 => return f32::from_bits(word(bytes)),
        };
        if normalised { (value / one).max(-1.0) } else { value }
    }

    /// Whether an unsigned integer of this type reaches `index`.
    pub(crate) fn holds_index(self, index: u32) -> bool {
        match self {
            Self::U8 => index <= u32::from(u8::MAX),
            Self::U16 => index <= u32::from(u16::MAX),
            Self::U32 => true,
            Self::I8 | Self::I16 | Self::F32 => false,
        }
    }

    /// Appends the low bits of an index.
    pub(crate) fn write_index(self, index: u32, bytes: &mut Vec<u8>) {
        bytes.extend_from_slice(&index.to_le_bytes()[..self.size()]);
    }

    /// Appends a number, as the nearest that the type has.
    pub(crate) fn write(self, value: f32, bytes: &mut Vec<u8>) {
        match self {
            Self::I8 => bytes.extend((value.round() as i8).to_le_bytes()),
            Self::U8 => bytes.push(value.round() as u8),
            Self::I16 => bytes.extend((value.round() as i16).to_le_bytes()),
            Self::U16 => bytes.extend((value.round() as u16).to_le_bytes()),
            Self::U32 => bytes.extend((value.round() as u32).to_le_bytes()),
            Self::F32 => bytes.extend(value.to_le_bytes()),
        }
    }

    #[inline]
    fn read_index(self, bytes: &[u8]) -> u32 {
        match self {
            Self::I8 | Self::U8 => u32::from(bytes[0]),
            Self::I16 | Self::U16 => u32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            Self::U32 | Self::F32 => word(bytes),
        }
    }
}

#[inline]
fn word(bytes: &[u8]) -> u32 {
    u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
}

/// How many elements an accessor has, and of what.
pub(crate) struct Layout {
    pub(crate) count: u64,
    pub(crate) component: Component,
    /// Numbers an element.
    pub(crate) components: usize,
}

impl Layout {
    /// What an accessor says.
    pub(crate) fn of(item: &At<'_>) -> Result<Self, LoadError> {
        let count = item.whole("count")?.ok_or_else(|| item.error("\"count\" is missing"))?;
        let code = item.whole("componentType")?.ok_or_else(|| item.error("\"componentType\" is missing"))?;
        let component = Component::from_code(code)
            .ok_or_else(|| item.error(format!("the component type {code} does not exist in glTF 2.0")))?;
        let shape = item.text("type")?.ok_or_else(|| item.error("\"type\" is missing"))?;
        let components = match shape {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" | "MAT2" => 4,
            "MAT3" => 9,
            "MAT4" => 16,
            _ => return Err(item.error(format!("the type \"{shape}\" does not exist in glTF 2.0"))),
        };
        if matches!(shape, "MAT2" | "MAT3") && component.size() < 4 {
            return Err(item.error("padded matrices are not supported; use floats"));
        }
        Ok(Self { count, component, components })
    }

    /// Bytes of an element.
    pub(crate) fn size(&self) -> usize {
        self.components * self.component.size()
    }
}

/// Elements without gaps that a compressed primitive has filled an accessor with.
pub(crate) struct Filled {
    pub(crate) bytes: Vec<u8>,
    pub(crate) count: u64,
}

impl<'a> Source<'a> {
    /// Looks at an accessor and checks that it lies within its buffer.
    pub(crate) fn accessor(&self, index: usize) -> Result<Accessor<'a>, LoadError> {
        let item = self.document.item("accessors", index)?;
        let layout = Layout::of(&item)?;
        let Layout { mut count, component, components } = layout;
        let size = layout.size();
        let buffers: &'a Buffers<'a> = self.buffers;
        let dense = match item.index("bufferView", "bufferViews", self.document.count("bufferViews"))? {
            Some(view) => {
                let offset = item.whole("byteOffset")?.unwrap_or(0);
                Some(self.strided(&item.pointer, view, offset, size, count)?)
            }
            None if let Some(filled) = buffers.filled(index) => {
                count = filled.count;
                Some(Strided { bytes: &filled.bytes, stride: size })
            }
            None if count > self.limits.unbacked_elements => {
                return Err(LoadError::Limit {
                    file: self.document.file().to_owned(),
                    pointer: item.pointer,
                    what: "elements without a buffer",
                    found: count,
                    limit: self.limits.unbacked_elements,
                });
            }
            None => None,
        };
        let sparse = self.sparse(&item, size, count)?;
        let normalised = item.flag("normalized")?.unwrap_or(false);
        Ok(Accessor { count: count as usize, components, component, normalised, dense, sparse })
    }

    /// `count` elements of `size` bytes from `offset` on; `pointer` is who wants them.
    fn strided(
        &self,
        pointer: &str,
        view: usize,
        offset: u64,
        size: usize,
        count: u64,
    ) -> Result<Strided<'a>, LoadError> {
        let buffers: &'a Buffers<'a> = self.buffers;
        let view_bytes = buffers.view(self.document, view)?;
        let stride = view_bytes.stride.unwrap_or(size);
        if stride < size {
            return Err(self.document.error(
                pointer,
                format!("its elements of {size} bytes do not fit /bufferViews/{view}'s stride of {stride}"),
            ));
        }
        let needed = match count.checked_sub(1) {
            Some(last) => last.checked_mul(stride as u64).and_then(|n| n.checked_add(size as u64)),
            None => Some(0),
        };
        let end =
            needed.and_then(|n| n.checked_add(offset)).filter(|end| *end <= view_bytes.bytes.len() as u64);
        let Some(end) = end else {
            let have = view_bytes.bytes.len();
            return Err(self.document.error(
                pointer,
                format!(
                    "wants {count} elements of {size} bytes from {offset} on, \
                     but /bufferViews/{view} has only {have} bytes"
                ),
            ));
        };
        Ok(Strided { bytes: &view_bytes.bytes[offset as usize..end as usize], stride })
    }

    fn sparse(
        &self,
        item: &At<'_>,
        size: usize,
        count: u64,
    ) -> Result<Option<Sparse<'a>>, LoadError> {
        let Some(sparse) = item.object("sparse")? else {
            return Ok(None);
        };
        let replaced = sparse.whole("count")?.ok_or_else(|| sparse.error("\"count\" is missing"))?;
        if replaced > count {
            return Err(sparse.error(format!("replaces {replaced} elements of only {count}")));
        }
        let views = self.document.count("bufferViews");
        let at = sparse.object("indices")?.ok_or_else(|| sparse.error("\"indices\" is missing"))?;
        let code = at.whole("componentType")?.unwrap_or(0);
        let component = Component::from_code(code)
            .filter(|c| matches!(c, Component::U8 | Component::U16 | Component::U32))
            .ok_or_else(|| at.error(format!("indices cannot be of the component type {code}")))?;
        let view = at.need("bufferView")?.as_index("bufferViews", views)?;
        let offset = at.whole("byteOffset")?.unwrap_or(0);
        let raw = self.strided(&at.pointer, view, offset, component.size(), replaced)?;
        let indices = Indices { component, raw, count: replaced as usize };
        if indices.count > 0 && u64::from(indices.get(indices.count - 1)) >= count {
            return Err(at.error(format!("its last index is not below the accessor's count of {count}")));
        }
        let at = sparse.object("values")?.ok_or_else(|| sparse.error("\"values\" is missing"))?;
        let view = at.need("bufferView")?.as_index("bufferViews", views)?;
        let offset = at.whole("byteOffset")?.unwrap_or(0);
        let values = self.strided(&at.pointer, view, offset, size, replaced)?;
        Ok(Some(Sparse { indices, values }))
    }
}

impl Accessor<'_> {
    #[inline]
    fn element(&self, index: usize) -> Option<&[u8]> {
        if let Some(sparse) = &self.sparse
            && let Some(at) = sparse.indices.find(index as u32)
        {
            return Some(&sparse.values.bytes[at * sparse.values.stride..]);
        }
        self.dense.map(|dense| &dense.bytes[index * dense.stride..])
    }

    /// Whether integers stand for shares of one.
    pub(crate) fn is_normalised(&self) -> bool {
        self.normalised
    }

    /// How many elements are replaced.
    pub(crate) fn sparse_len(&self) -> usize {
        self.sparse.as_ref().map_or(0, |sparse| sparse.indices.count)
    }

    /// Which element the `i`-th replacement replaces.
    pub(crate) fn sparse_index(&self, i: usize) -> u32 {
        self.sparse.as_ref().map_or(0, |sparse| sparse.indices.get(i))
    }

    /// An element's first `N` numbers; those it does not have are zero.
    #[inline]
    pub(crate) fn get<const N: usize>(&self, index: usize) -> [f32; N] {
        let mut numbers = [0.0; N];
        if let Some(bytes) = self.element(index) {
            let size = self.component.size();
            for (i, number) in numbers.iter_mut().enumerate().take(self.components) {
                *number = self.component.read(&bytes[i * size..], self.normalised);
            }
        }
        numbers
    }

    /// An element as an index.
    #[inline]
    pub(crate) fn get_index(&self, index: usize) -> u32 {
        self.element(index).map_or(0, |bytes| self.component.read_index(bytes))
    }

    /// Four small whole numbers.
    pub(crate) fn get_joints(&self, index: usize) -> [u16; 4] {
        let mut joints = [0; 4];
        if let Some(bytes) = self.element(index) {
            let size = self.component.size();
            for (i, joint) in joints.iter_mut().enumerate().take(self.components) {
                *joint = self.component.read_index(&bytes[i * size..]).min(u32::from(u16::MAX)) as u16;
            }
        }
        joints
    }
}

//! Buffer views that are compressed with meshoptimizer's codecs.

use crate::gltf::document::At;
use crate::gltf::error::LoadError;
use crate::gltf::guard::guarded;
use meshoptimizer_rs::codec::{
    decode_filter_color, decode_filter_exp, decode_filter_oct, decode_filter_quat, decode_index_buffer,
    decode_index_sequence, decode_vertex_buffer, decode_vertex_version,
};
use meshoptimizer_rs::{Error, Workspace};

/// As other vendors write it: the first version of the vertex codec.
const EXT: &str = "EXT_meshopt_compression";
/// As ratified: the second version, and a filter for colours.
const KHR: &str = "KHR_meshopt_compression";

/// What a compressed buffer view says of itself.
pub(crate) struct Compressed<'a> {
    at: At<'a>,
    newer: bool,
    /// Index of the buffer that holds it.
    pub(crate) buffer: usize,
    /// Bytes there.
    pub(crate) range: [u64; 2],
    count: usize,
    stride: usize,
}

/// The compressed form of a buffer view, if it has one. `buffers` is how many there are.
pub(crate) fn compressed<'a>(view: &At<'a>, buffers: usize) -> Result<Option<Compressed<'a>>, LoadError> {
    let (at, newer) = match (view.extension(KHR)?, view.extension(EXT)?) {
        (Some(at), _) => (at, true),
        (None, Some(at)) => (at, false),
        (None, None) => return Ok(None),
    };
    let need = |key: &str| at.whole(key)?.ok_or_else(|| at.error(format!("\"{key}\" is missing")));
    let buffer = at.need("buffer")?.as_index("buffers", buffers)?;
    let (offset, length) = (at.whole("byteOffset")?.unwrap_or(0), need("byteLength")?);
    let (count, stride) = (need("count")?, need("byteStride")?);
    let says = view.whole("byteLength")?;
    if count == 0 || stride == 0 || count.checked_mul(stride) != says {
        let says = says.unwrap_or(0);
        return Err(at.error(format!(
            "holds {count} elements of {stride} bytes, but its buffer view is {says} bytes long"
        )));
    }
    let (count, stride) = (count as usize, stride as usize);
    Ok(Some(Compressed { at, newer, buffer, range: [offset, length], count, stride }))
}

impl Compressed<'_> {
    /// Bytes that come out.
    pub(crate) fn len(&self) -> u64 {
        self.count as u64 * self.stride as u64
    }

    /// JSON pointer.
    pub(crate) fn pointer(&self) -> &str {
        &self.at.pointer
    }

    /// Decodes it from the bytes of its buffer.
    pub(crate) fn decode(&self, buffer: &[u8]) -> Result<Vec<u8>, LoadError> {
        let [offset, length] = self.range;
        let end = offset.checked_add(length).filter(|end| *end <= buffer.len() as u64);
        let Some(end) = end else {
            let have = buffer.len();
            return Err(self
                .at
                .error(format!("wants {length} bytes from {offset} on, but its buffer has only {have}")));
        };
        let source = &buffer[offset as usize..end as usize];
        let mode = self.at.text("mode")?.unwrap_or_default();
        let filter = self.at.text("filter")?.unwrap_or("NONE");
        let codec = self.codec(mode, filter)?;
        guarded(|| codec(self, source)).map_err(|broken| {
            self.at.error(format!("its {mode} with the filter {filter} cannot be decoded: {broken}"))
        })
    }

    fn codec(&self, mode: &str, filter: &str) -> Result<Codec, LoadError> {
        Ok(match (mode, filter) {
            ("TRIANGLES", "NONE") => |c, source| decode_index_buffer(c.count, c.stride, source, &mut c.room()),
            ("INDICES", "NONE") => |c, source| decode_index_sequence(c.count, c.stride, source, &mut c.room()),
            ("ATTRIBUTES", "NONE") => |c, source| c.vertices(source),
            ("ATTRIBUTES", "OCTAHEDRAL") => |c, source| {
                let mut bytes = c.vertices(source)?;
                decode_filter_oct(&mut bytes, c.count, c.stride, &mut c.room()).map(|()| bytes)
            },
            ("ATTRIBUTES", "QUATERNION") => |c, source| {
                let mut bytes = c.vertices(source)?;
                decode_filter_quat(&mut bytes, c.count, c.stride, &mut c.room()).map(|()| bytes)
            },
            ("ATTRIBUTES", "EXPONENTIAL") => |c, source| {
                let mut bytes = c.vertices(source)?;
                decode_filter_exp(&mut bytes, c.count, c.stride, &mut c.room()).map(|()| bytes)
            },
            ("ATTRIBUTES", "COLOR") if self.newer => |c, source| {
                let mut bytes = c.vertices(source)?;
                decode_filter_color(&mut bytes, c.count, c.stride, &mut c.room()).map(|()| bytes)
            },
            _ => {
                let detail = format!("the mode \"{mode}\" with the filter \"{filter}\" does not exist");
                return Err(self.at.error(detail));
            }
        })
    }

    fn vertices(&self, source: &[u8]) -> Result<Vec<u8>, Error> {
        if !self.newer && decode_vertex_version(source)? != 0 {
            return Err(Error::UnsupportedVersion);
        }
        decode_vertex_buffer(self.count, self.stride, source, &mut self.room())
    }

    /// Memory for what comes out, which the caller has allowed.
    fn room(&self) -> Workspace {
        let bytes = (self.len() as usize).saturating_mul(2).saturating_add(1 << 20);
        Workspace::new(meshoptimizer_rs::Limits { max_bytes: bytes, max_work: u64::MAX })
    }
}

type Codec = fn(&Compressed<'_>, &[u8]) -> Result<Vec<u8>, Error>;

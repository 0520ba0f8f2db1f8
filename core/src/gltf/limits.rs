//! How large a scene may be.

/// How large a scene may be. The defaults let real scenes through and keep a hostile one from taking
/// a machine's memory or time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of all buffers together, data URIs decoded and archives unpacked.
    pub buffer_bytes: u64,
    /// Bytes of the JSON document.
    pub document_bytes: u64,
    /// Values in the JSON document: each takes about 100 bytes of memory while it is read.
    pub document_values: u64,
    /// Triangles of all meshes that are used, each mesh counted once.
    pub triangles: u64,
    /// Places at which meshes stand.
    pub instances: u64,
    /// Pixels of all pictures that are used.
    pub picture_pixels: u64,
    /// Pixels along a side of one picture.
    pub picture_side: u32,
    /// Vertices of morph targets with a weight, each target of each mesh counted at each form it takes.
    pub morphed_vertices: u64,
    /// Elements of an accessor that no buffer backs.
    pub unbacked_elements: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            buffer_bytes: 8 << 30,
            document_bytes: 1 << 30,
            document_values: 1 << 23,
            triangles: 50_000_000,
            instances: 10_000_000,
            picture_pixels: 1 << 28,
            picture_side: 16_384,
            morphed_vertices: 1 << 31,
            unbacked_elements: 1 << 22,
        }
    }
}

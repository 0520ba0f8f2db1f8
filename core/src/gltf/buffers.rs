//! The bytes that accessors and pictures look at.

use crate::gltf::accessor::Filled;
use crate::gltf::bundle::Bundle;
use crate::gltf::document::{At, Document};
use crate::gltf::error::LoadError;
use crate::gltf::limits::Limits;
use crate::gltf::meshopt::compressed;
use crate::gltf::uri::{self, Target};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};

/// The buffers of a document, each as long as it says.
pub(crate) struct Buffers<'a> {
    /// `None` for a buffer that an extension would have to fill.
    bytes: Vec<Option<Cow<'a, [u8]>>>,
    /// Buffers that are the file of an earlier one, by index.
    same: Vec<usize>,
    /// What compressed buffer views hold, by index.
    decoded: BTreeMap<usize, Vec<u8>>,
    /// What compressed primitives have filled accessors with, by index.
    filled: BTreeMap<usize, Filled>,
    /// Whether each buffer view was looked at.
    seen: Vec<AtomicBool>,
}

/// A slice of a buffer, and the distance of its elements where the view says one.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) stride: Option<usize>,
}

/// The bytes that the URI of `item` names.
pub(crate) fn read_uri<'a>(
    bundle: &'a Bundle,
    item: &At<'_>,
    text: &str,
) -> Result<Cow<'a, [u8]>, LoadError> {
    let pointer = item.pointer_to("uri");
    let refused = |detail| LoadError::Uri {
        file: bundle.name().to_owned(),
        pointer: pointer.clone(),
        uri: uri::shorten(text),
        detail,
    };
    match uri::resolve(text).map_err(refused)? {
        Target::Data(bytes) => Ok(Cow::Owned(bytes)),
        Target::File(file) => bundle.read(&file, text)?.ok_or_else(|| LoadError::MissingFile {
            file: bundle.name().to_owned(),
            pointer: pointer.clone(),
            uri: uri::shorten(&file),
        }),
    }
}

impl<'a> Buffers<'a> {
    /// Reads all buffers of a document. `binary` is the container's binary chunk.
    pub(crate) fn read(
        bundle: &'a Bundle,
        document: &Document,
        mut binary: Option<Cow<'a, [u8]>>,
        limits: &Limits,
    ) -> Result<Self, LoadError> {
        let seen = (0..document.count("bufferViews")).map(|_| AtomicBool::new(false)).collect();
        let (decoded, filled) = (BTreeMap::new(), BTreeMap::new());
        let mut buffers = Self { bytes: Vec::new(), same: Vec::new(), decoded, filled, seen };
        let items = document.list("buffers")?;
        let mut known: BTreeMap<&str, usize> = BTreeMap::new();
        let mut total = 0_u64;
        for (i, item) in items.iter().enumerate() {
            let length = item.whole("byteLength")?.ok_or_else(|| item.error("\"byteLength\" is missing"))?;
            let mut same = i;
            let bytes = match item.text("uri")? {
                Some(text) => {
                    same = *known.entry(text).or_insert(i);
                    if same == i { Some(read_uri(bundle, item, text)?) } else { None }
                }
                None if i == 0 => binary.take(),
                None => None,
            };
            buffers.bytes.push(bytes);
            buffers.same.push(same);
            let have = buffers.whole(i).map(<[u8]>::len);
            if let Some(have) = have.filter(|have| (*have as u64) < length) {
                return Err(item.error(format!("says {length} bytes, but there are only {have}")));
            }
            total += if same == i { have.unwrap_or(0) as u64 } else { 0 };
            check_total(document, &item.pointer, total, limits)?;
        }
        buffers.decode(document, total, limits)?;
        Ok(buffers)
    }

    /// Decodes all compressed buffer views. `total` bytes are there.
    fn decode(&mut self, document: &Document, mut total: u64, limits: &Limits) -> Result<(), LoadError> {
        for (i, item) in document.list("bufferViews")?.iter().enumerate() {
            let Some(view) = compressed(item, self.bytes.len())? else { continue };
            total = total.saturating_add(view.len());
            check_total(document, view.pointer(), total, limits)?;
            let Some(whole) = self.whole(view.buffer) else {
                let detail = format!("refers to /buffers/{}, which has no data", view.buffer);
                return Err(document.error(view.pointer(), detail));
            };
            self.decoded.insert(i, view.decode(whole)?);
        }
        Ok(())
    }

    /// Notes what compressed primitives have filled accessors with.
    pub(crate) fn fill(&mut self, filled: BTreeMap<usize, Filled>) {
        self.filled = filled;
    }

    /// What a compressed primitive has filled an accessor with.
    pub(crate) fn filled(&self, accessor: usize) -> Option<&Filled> {
        self.filled.get(&accessor)
    }

    /// Whether there are compressed buffer views.
    pub(crate) fn are_compressed(&self) -> bool {
        !self.decoded.is_empty()
    }

    /// Buffer views that were looked at so far.
    pub(crate) fn seen(&self) -> Vec<bool> {
        self.seen.iter().map(|seen| seen.load(Ordering::Relaxed)).collect()
    }

    fn whole(&self, index: usize) -> Option<&[u8]> {
        self.bytes[self.same[index]].as_deref()
    }

    /// The bytes of a buffer view.
    pub(crate) fn view(&self, document: &Document, index: usize) -> Result<View<'_>, LoadError> {
        let item = document.item("bufferViews", index)?;
        self.seen[index].store(true, Ordering::Relaxed);
        let buffer = item.need("buffer")?.as_index("buffers", self.bytes.len())?;
        let offset = item.whole("byteOffset")?.unwrap_or(0);
        let length = item.whole("byteLength")?.ok_or_else(|| item.error("\"byteLength\" is missing"))?;
        let stride = item.whole("byteStride")?;
        if stride.is_some_and(|s| !(4..=252).contains(&s)) {
            return Err(item.error("\"byteStride\" must be 4 to 252"));
        }
        if let Some(bytes) = self.decoded.get(&index) {
            return Ok(View { bytes, stride: stride.map(|s| s as usize) });
        }
        let Some(whole) = self.whole(buffer) else {
            return Err(item
                .error(format!("refers to /buffers/{buffer}, which has no data: no URI, no binary chunk")));
        };
        let end = offset.checked_add(length).filter(|end| *end <= whole.len() as u64);
        let Some(end) = end else {
            let have = whole.len();
            return Err(item.error(format!(
                "wants {length} bytes from {offset} on, but /buffers/{buffer} has only {have}"
            )));
        };
        Ok(View { bytes: &whole[offset as usize..end as usize], stride: stride.map(|s| s as usize) })
    }
}

fn check_total(document: &Document, pointer: &str, found: u64, limits: &Limits) -> Result<(), LoadError> {
    if found <= limits.buffer_bytes {
        return Ok(());
    }
    let (file, pointer) = (document.file().to_owned(), pointer.to_owned());
    Err(LoadError::Limit { file, pointer, what: "bytes of buffers", found, limit: limits.buffer_bytes })
}

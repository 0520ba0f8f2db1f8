//! A scene as one blob: a `.glb`, or a `.zip` of a document with its files.

use crate::gltf::document::Document;
use crate::gltf::error::LoadError;
use crate::gltf::limits::Limits;
use crate::gltf::{glb, uri};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{Cursor, Read, Write};
use std::ops::Range;
use std::sync::Arc;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

/// A scene as one blob.
///
/// Three forms are told apart by their first bytes: a `.glb`; a `.zip` that holds one `.gltf` or `.glb`
/// and the files it refers to; a `.gltf` alone, which may refer to nothing but data URIs.
pub struct Bundle {
    /// Of the document, relative to the bundle's root.
    name: String,
    bytes: Arc<[u8]>,
    form: Form,
}

enum Form {
    Glb(glb::Chunks),
    Document,
    Archive { archive: ZipArchive<Cursor<Arc<[u8]>>>, entries: BTreeMap<String, Entry>, binary: bool },
}

#[derive(Clone, Debug)]
struct Entry {
    index: usize,
    /// Bytes once unpacked, as the directory says.
    size: u64,
    /// Where they lie as they are, if not compressed.
    stored: Option<Range<usize>>,
}

/// Files an archive may hold.
const ENTRIES: usize = 65_536;
/// Bytes that an archive may hold once unpacked.
const UNPACKED: u64 = 16 << 30;
/// How many times larger than packed an archive of more than [`RATIO_FREE`] bytes may be.
const RATIO: u64 = 200;
const RATIO_FREE: u64 = 256 << 20;

/// The JSON document of a bundle and the binary chunk beside it.
pub(crate) struct Parts<'a> {
    pub(crate) json: Cow<'a, [u8]>,
    pub(crate) binary: Option<Cow<'a, [u8]>>,
    /// Bytes of a container that mean nothing.
    pub(crate) ignored: usize,
}

impl Bundle {
    /// Looks at the form of a blob and, for an archive, at its directory.
    pub fn open(bytes: impl Into<Arc<[u8]>>) -> Result<Self, LoadError> {
        let bytes = bytes.into();
        let name = "scene".to_owned();
        let refuse = |detail: String| LoadError::Container { file: name.clone(), detail };
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes).trim_ascii_start();
        if bytes.starts_with(glb::MAGIC) {
            let form = Form::Glb(glb::chunks(&bytes).map_err(refuse)?);
            Ok(Self { name, bytes, form })
        } else if bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"PK\x05\x06") {
            Self::open_archive(bytes)
        } else if text.starts_with(b"{") {
            Ok(Self { name, bytes, form: Form::Document })
        } else {
            Err(refuse(foreign(&bytes)))
        }
    }

    /// Gives the document of a blob that is not an archive the name of the file it comes from, for messages.
    #[must_use]
    pub fn named(mut self, name: &str) -> Self {
        if !matches!(self.form, Form::Archive { .. }) {
            name.clone_into(&mut self.name);
        }
        self
    }

    /// Name of the document, relative to the bundle's root.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// An archive of a scene and the files it refers to: stored, in order of name, without times, so that
    /// the same files give the same bytes. Names are relative to the folder of the document.
    pub fn pack(main: (&str, &[u8]), files: &[(String, Vec<u8>)]) -> Vec<u8> {
        let mut sorted: BTreeMap<&str, &[u8]> =
            files.iter().map(|(n, b)| (n.as_str(), b.as_slice())).collect();
        sorted.insert(main.0, main.1);
        let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, bytes) in sorted {
            let options = SimpleFileOptions::default()
                .compression_method(CompressionMethod::Stored)
                .last_modified_time(DateTime::default())
                .unix_permissions(0o644)
                .large_file(bytes.len() as u64 >= u64::from(u32::MAX));
            writer.start_file(name, options).expect("names are unique, and memory takes what is written");
            writer.write_all(bytes).expect("memory takes what is written");
        }
        writer.finish().expect("memory takes what is written").into_inner()
    }

    fn open_archive(bytes: Arc<[u8]>) -> Result<Self, LoadError> {
        let refuse = |detail: String| LoadError::Container { file: "archive".to_owned(), detail };
        let mut archive = ZipArchive::new(Cursor::new(bytes.clone()))
            .map_err(|e| refuse(format!("the .zip is broken: {e}")))?;
        if archive.len() > ENTRIES {
            let found = archive.len();
            return Err(refuse(format!("the .zip holds {found} files, more than the limit of {ENTRIES}")));
        }
        let entries = read_directory(&mut archive, &bytes).map_err(refuse)?;
        let unpacked: u64 = entries.values().fold(0, |sum: u64, e| sum.saturating_add(e.size));
        let allowed = UNPACKED.min(RATIO_FREE.max(RATIO.saturating_mul(bytes.len() as u64)));
        if unpacked > allowed {
            let packed = bytes.len();
            return Err(refuse(format!(
                "the .zip unpacks from {packed} to {unpacked} bytes, more than the limit of {allowed}"
            )));
        }
        let name = find_main(&entries).map_err(refuse)?;
        let binary = name.to_ascii_lowercase().ends_with(".glb");
        Ok(Self { name, bytes, form: Form::Archive { archive, entries, binary } })
    }

    /// The document and its binary chunk.
    pub(crate) fn parts(&self) -> Result<Parts<'_>, LoadError> {
        match &self.form {
            Form::Glb(chunks) => Ok(Parts {
                json: Cow::Borrowed(&self.bytes[chunks.json.clone()]),
                binary: chunks.binary.clone().map(|range| Cow::Borrowed(&self.bytes[range])),
                ignored: chunks.ignored,
            }),
            Form::Document => Ok(Parts { json: Cow::Borrowed(&self.bytes), binary: None, ignored: 0 }),
            Form::Archive { entries, binary, .. } => {
                let bytes = self.unpack(&self.name, &entries[&self.name])?;
                if !binary {
                    return Ok(Parts { json: bytes, binary: None, ignored: 0 });
                }
                let refuse = |detail: String| LoadError::Container { file: self.name.clone(), detail };
                if !bytes.starts_with(glb::MAGIC) {
                    return Err(refuse(foreign(&bytes)));
                }
                let chunks = glb::chunks(&bytes).map_err(refuse)?;
                let part = |range: Range<usize>| match &bytes {
                    Cow::Borrowed(bytes) => Cow::Borrowed(&bytes[range]),
                    Cow::Owned(bytes) => Cow::Owned(bytes[range].to_vec()),
                };
                let (json, binary) = (part(chunks.json), chunks.binary.map(part));
                Ok(Parts { json, binary, ignored: chunks.ignored })
            }
        }
    }

    /// A file beside the document: `None` where the bundle has none of this name. `file` is what
    /// [`uri::resolve`] gave; `raw` the reference before percent-decoding, tried second.
    pub(crate) fn read(&self, file: &str, raw: &str) -> Result<Option<Cow<'_, [u8]>>, LoadError> {
        let Form::Archive { entries, .. } = &self.form else {
            return Ok(None);
        };
        let folder = self.name.rfind('/').map_or("", |at| &self.name[..=at]);
        let found = [file, raw].into_iter().find_map(|name| {
            let path = format!("{folder}{name}");
            entries.get(&path).map(|entry| (path, entry))
        });
        found.map(|(path, entry)| self.unpack(&path, entry)).transpose()
    }

    fn unpack(&self, name: &str, entry: &Entry) -> Result<Cow<'_, [u8]>, LoadError> {
        if let Some(range) = &entry.stored {
            return Ok(Cow::Borrowed(&self.bytes[range.clone()]));
        }
        let Form::Archive { archive, .. } = &self.form else { unreachable!("only archives have entries") };
        let refuse = |detail: String| LoadError::Container { file: name.to_owned(), detail };
        let mut archive = archive.clone();
        let file = archive.by_index(entry.index).map_err(|e| refuse(format!("cannot be unpacked: {e}")))?;
        let mut bytes = Vec::new();
        file.take(entry.size + 1)
            .read_to_end(&mut bytes)
            .map_err(|e| refuse(format!("cannot be unpacked: {e}")))?;
        if bytes.len() as u64 != entry.size {
            return Err(refuse("unpacks to another size than the .zip says".to_owned()));
        }
        Ok(Cow::Owned(bytes))
    }
}

fn read_directory(
    archive: &mut ZipArchive<Cursor<Arc<[u8]>>>,
    bytes: &[u8],
) -> Result<BTreeMap<String, Entry>, String> {
    let mut entries = BTreeMap::new();
    for index in 0..archive.len() {
        let file = archive.by_index_raw(index).map_err(|e| format!("the .zip is broken: {e}"))?;
        if file.is_dir() {
            continue;
        }
        let raw = file.name().map_err(|e| format!("a name in the .zip is broken: {e}"))?.into_owned();
        let shown = uri::shorten(&raw);
        if file.is_symlink() {
            return Err(format!("\"{shown}\" in the .zip is a link; pack the file itself"));
        }
        if file.encrypted() {
            return Err(format!("\"{shown}\" in the .zip is encrypted; pack it without a password"));
        }
        let name =
            uri::normalise(&raw).map_err(|why| format!("\"{shown}\" in the .zip is refused: {why}"))?;
        let size = file.size();
        let stored = (file.compression() == CompressionMethod::Stored)
            .then(|| {
                let start = usize::try_from(file.data_start()?).ok()?;
                let end = start.checked_add(usize::try_from(size).ok()?)?;
                (end <= bytes.len()).then_some(start..end)
            })
            .flatten();
        if entries.insert(name, Entry { index, size, stored }).is_some() {
            return Err(format!("\"{shown}\" is in the .zip twice"));
        }
    }
    Ok(entries)
}

fn find_main(entries: &BTreeMap<String, Entry>) -> Result<String, String> {
    let is = |name: &str, ending: &str| name.to_ascii_lowercase().ends_with(ending);
    let skip = |name: &str| name.starts_with("__MACOSX/") || name.contains("/._") || name.starts_with("._");
    for ending in [".gltf", ".glb"] {
        let depth = |name: &str| name.matches('/').count();
        let mut found: Vec<&String> = entries.keys().filter(|n| is(n, ending) && !skip(n)).collect();
        let least = found.iter().map(|n| depth(n)).min().unwrap_or(0);
        found.retain(|n| depth(n) == least);
        match found.as_slice() {
            [] => {}
            [one] => return Ok((*one).clone()),
            [one, other, ..] => {
                return Err(format!(
                    "the .zip holds several scenes (\"{one}\", \"{other}\"); pack one alone"
                ));
            }
        }
    }
    Err("the .zip holds neither a .gltf nor a .glb".to_owned())
}

/// What to say of bytes that are no scene.
fn foreign(bytes: &[u8]) -> String {
    if bytes.is_empty() {
        "the file is empty".to_owned()
    } else if bytes.starts_with(b"version https://git-lfs") {
        "the file is a git-LFS pointer, not the scene itself; run git lfs pull".to_owned()
    } else {
        "neither a .glb nor a .gltf nor a .zip of one".to_owned()
    }
}

/// Files that a scene refers to: relative to its folder, percent-decoded, each once, in order of name. Takes
/// the bytes of a `.gltf` or `.glb`. A file that does not exist may be left out of the bundle: reading
/// names it if it is needed. URIs that lead out of the folder are refused.
pub fn references(scene: &[u8]) -> Result<Vec<String>, LoadError> {
    let bundle = Bundle::open(scene)?;
    let parts = bundle.parts()?;
    let document = Document::parse(bundle.name(), &parts.json, &Limits::default())?;
    let mut files = BTreeSet::new();
    for list in ["buffers", "images"] {
        for item in document.list(list)? {
            let Some(text) = item.text("uri")?.filter(|text| !text.starts_with("data:")) else {
                continue;
            };
            let file = uri::resolve_file(text).map_err(|detail| LoadError::Uri {
                file: document.file().to_owned(),
                pointer: item.pointer_to("uri"),
                uri: uri::shorten(text),
                detail,
            })?;
            files.insert(file);
        }
    }
    Ok(files.into_iter().collect())
}

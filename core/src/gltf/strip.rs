//! What of a file a render reads, as a file of its own.

use crate::gltf::buffers::{Buffers, read_uri};
use crate::gltf::bundle::Bundle;
use crate::gltf::document::Document;
use crate::gltf::error::LoadError;
use crate::gltf::limits::Limits;
use crate::gltf::load::{Choice, Used, load_and_note};
use serde::de::IgnoredAny;
use serde_json::{Map, Value, json};
use std::ops::Range;
use std::sync::Arc;

/// A file that saves less than this share is not worth another copy.
const WORTH: usize = 16;

/// A `.glb` that reads as the same scene, to the bit, for this choice: it has the document's own words and numbers, but of
/// buffers and pictures only what reading the scene looks at. `None` where that saves little, and for files with compressed
/// buffer views.
pub fn strip(
    bytes: impl Into<Arc<[u8]>>,
    limits: &Limits,
    choice: &Choice<'_>,
) -> Result<Option<Vec<u8>>, LoadError> {
    let bytes: Arc<[u8]> = bytes.into();
    let whole = bytes.len();
    let bundle = Bundle::open(bytes)?;
    let (_, used) = load_and_note(&bundle, limits, choice)?;
    if used.compressed {
        return Ok(None);
    }
    let parts = bundle.parts()?;
    let document = Document::parse(bundle.name(), &parts.json, limits)?;
    let buffers = Buffers::read(&bundle, &document, parts.binary, limits)?;
    let mut kept = Kept { binary: Vec::new(), views: Vec::new() };
    for index in 0..document.count("bufferViews") {
        let item = document.item("bufferViews", index)?;
        let mut view = item.value.as_object().cloned().unwrap_or_default();
        let (offset, bytes) = if used.views[index] {
            (item.whole("byteOffset")?.unwrap_or(0), buffers.view(&document, index)?.bytes)
        } else {
            (0, &[][..])
        };
        kept.place(&mut view, offset, bytes);
    }
    let images = images(&bundle, &document, &used, &mut kept)?;
    let Kept { binary, views } = kept;
    let mut lists = vec![("buffers", json!([{"byteLength": binary.len()}])), ("bufferViews", json!(views))];
    lists.extend((!images.is_empty()).then(|| ("images", json!(images))));
    let file = spliced(&parts.json, &lists).and_then(|json| glb(json, binary));
    Ok(file.filter(|file| file.len() + whole / WORTH <= whole))
}

/// Buffer views of the new file.
struct Kept {
    binary: Vec<u8>,
    views: Vec<Value>,
}

impl Kept {
    /// Adds a view on these bytes, which lay at `offset`: numbers in them stay aligned.
    fn place(&mut self, view: &mut Map<String, Value>, offset: u64, bytes: &[u8]) {
        while self.binary.len() as u64 % 4 != offset % 4 {
            self.binary.push(0);
        }
        view.insert("buffer".to_owned(), json!(0));
        view.insert("byteOffset".to_owned(), json!(self.binary.len()));
        view.insert("byteLength".to_owned(), json!(bytes.len()));
        self.binary.extend_from_slice(bytes);
        self.views.push(json!(view));
    }
}

/// The pictures: those that are looked at in buffer views, the others nowhere.
fn images(
    bundle: &Bundle,
    document: &Document,
    used: &Used,
    kept: &mut Kept,
) -> Result<Vec<Value>, LoadError> {
    let mut images = Vec::new();
    for (index, item) in document.list("images")?.iter().enumerate() {
        let mut image = item.value.as_object().cloned().unwrap_or_default();
        if let Some(text) = item.text("uri")? {
            image.remove("uri");
            if used.images.contains(&index) {
                let bytes = read_uri(bundle, item, text)?;
                image.insert("bufferView".to_owned(), json!(kept.views.len()));
                kept.place(&mut Map::new(), 0, &bytes);
            }
        }
        images.push(json!(image));
    }
    Ok(images)
}

/// A JSON object with other values of some members, all else left as it is written: numbers that are parsed and written again may
/// differ in their last bit. `None` where a member stands there twice.
fn spliced(text: &[u8], values: &[(&str, Value)]) -> Option<Vec<u8>> {
    let Members { list: members, end } = members(text)?;
    let mut changed = Vec::with_capacity(text.len());
    let mut at = 0;
    for (name, span) in &members {
        if members.iter().filter(|(other, _)| other == name).count() > 1 {
            return None;
        }
        if let Some((_, value)) = values.iter().find(|(changes, _)| changes == name) {
            changed.extend_from_slice(&text[at..span.start]);
            changed.extend(serde_json::to_vec(value).ok()?);
            at = span.end;
        }
    }
    changed.extend_from_slice(&text[at..end]);
    let mut first = members.is_empty();
    for (name, value) in values.iter().filter(|(name, _)| members.iter().all(|(other, _)| other != name)) {
        if !std::mem::take(&mut first) {
            changed.push(b',');
        }
        changed.extend(serde_json::to_vec(name).ok()?);
        changed.push(b':');
        changed.extend(serde_json::to_vec(value).ok()?);
    }
    changed.push(b'}');
    Some(changed)
}

/// Members of a JSON object.
struct Members {
    /// Names, with the places of their values.
    list: Vec<(String, Range<usize>)>,
    /// The place of the closing brace.
    end: usize,
}

fn members(text: &[u8]) -> Option<Members> {
    let blank = |at: usize| at + text[at..].iter().take_while(|byte| byte.is_ascii_whitespace()).count();
    let mut at = text.iter().position(|byte| *byte == b'{')? + 1;
    let mut list = Vec::new();
    loop {
        at = blank(at);
        match text.get(at)? {
            b'}' => return Some(Members { list, end: at }),
            b',' => at = blank(at + 1),
            _ => {}
        }
        let mut names = serde_json::Deserializer::from_slice(&text[at..]).into_iter::<String>();
        let name = names.next()?.ok()?;
        at = blank(at + names.byte_offset());
        if text.get(at) != Some(&b':') {
            return None;
        }
        let start = blank(at + 1);
        let mut values = serde_json::Deserializer::from_slice(&text[start..]).into_iter::<IgnoredAny>();
        values.next()?.ok()?;
        at = start + values.byte_offset();
        list.push((name, start..at));
    }
}

/// The container; `None` where it would be longer than the four gigabytes that it can count.
fn glb(mut json: Vec<u8>, mut binary: Vec<u8>) -> Option<Vec<u8>> {
    json.resize(json.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let word = |length: usize| u32::try_from(length).ok().map(u32::to_le_bytes);
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend(word(12 + 8 + json.len() + 8 + binary.len())?);
    for (kind, bytes) in [(b"JSON", json), (b"BIN\0", binary)] {
        file.extend(word(bytes.len())?);
        file.extend_from_slice(kind);
        file.extend(bytes);
    }
    Some(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_are_changed_and_all_else_stays_as_it_is_written() {
        let text = br#" { "a" : 0.10000000000000000555e0, "bufferViews":[1, {"x":"}"}] ,"c\u0022":[ ]}"#;
        let changed = spliced(text, &[("bufferViews", json!([2])), ("buffers", json!([]))]).unwrap();
        let wanted = br#" { "a" : 0.10000000000000000555e0, "bufferViews":[2] ,"c\u0022":[ ],"buffers":[]}"#;
        assert_eq!(String::from_utf8_lossy(&changed), String::from_utf8_lossy(wanted));
        assert_eq!(spliced(b"{}", &[("a", json!(1))]).unwrap(), br#"{"a":1}"#);
        assert!(spliced(br#"{"a":1,"a":2}"#, &[("a", json!(1))]).is_none());
    }
}

//! A binary glTF 2.0 file in the making.

use glam::{Vec2, Vec3};
use serde_json::{Map, Value, json};

/// `ARRAY_BUFFER` and `ELEMENT_ARRAY_BUFFER`.
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

/// A binary glTF 2.0 file in the making. Methods return the index of what they add.
#[derive(Debug, Default)]
pub struct Writer {
    document: Map<String, Value>,
    binary: Vec<u8>,
}

impl Writer {
    /// Adds to one of the document's lists.
    pub fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.document.entry(list).or_insert_with(|| json!([]));
        let list = list.as_array_mut().expect("what is pushed to is a list");
        list.push(value);
        list.len() - 1
    }

    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let mut view = json!({"buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len()});
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.binary.extend_from_slice(bytes);
        self.push("bufferViews", view)
    }

    /// An accessor of positions, with their bounds as glTF demands.
    pub fn positions(&mut self, points: &[Vec3]) -> usize {
        let bytes: Vec<u8> = points.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes).collect();
        let low = points.iter().fold(Vec3::INFINITY, |low, p| low.min(*p));
        let high = points.iter().fold(Vec3::NEG_INFINITY, |high, p| high.max(*p));
        let view = self.view(&bytes, Some(VERTICES));
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": 5126, "count": points.len(), "type": "VEC3",
                "min": low.to_array(), "max": high.to_array()}),
        )
    }

    /// An accessor of texture coordinates.
    pub fn coordinates(&mut self, points: &[Vec2]) -> usize {
        let bytes: Vec<u8> = points.iter().flat_map(Vec2::to_array).flat_map(f32::to_le_bytes).collect();
        let view = self.view(&bytes, Some(VERTICES));
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": 5126, "count": points.len(), "type": "VEC2"}),
        )
    }

    /// An accessor of colours: shares of 65,535, linear, with alpha.
    pub fn colours(&mut self, colours: &[[u16; 4]]) -> usize {
        let bytes: Vec<u8> = colours.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(VERTICES));
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": 5123, "normalized": true, "count": colours.len(), "type": "VEC4"}),
        )
    }

    /// An accessor of indices.
    pub fn indices(&mut self, indices: &[u32]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(INDICES));
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": 5125, "count": indices.len(), "type": "SCALAR"}),
        )
    }

    /// A texture of a PNG in the file.
    pub fn texture(&mut self, png: &[u8], sampler: Value) -> usize {
        let view = self.view(png, None);
        let source = self.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
        let sampler = self.push("samplers", sampler);
        self.push("textures", json!({"source": source, "sampler": sampler}))
    }

    /// The file: a scene of the node `root`, with what `extras` says beside the generator's name. `None` where it would be longer than
    /// the four gigabytes that a `.glb` can count.
    pub fn finish(mut self, root: usize, extensions: &[&str], extras: &Value) -> Option<Vec<u8>> {
        let asset = json!({"version": "2.0", "generator": "ovtigre", "extras": extras});
        self.document.insert("asset".to_owned(), asset);
        self.document.insert("scenes".to_owned(), json!([{"nodes": [root]}]));
        self.document.insert("scene".to_owned(), json!(0));
        if !extensions.is_empty() {
            self.document.insert("extensionsUsed".to_owned(), json!(extensions));
        }
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        if !self.binary.is_empty() {
            self.document.insert("buffers".to_owned(), json!([{"byteLength": self.binary.len()}]));
        }
        let mut text = serde_json::to_vec(&Value::Object(self.document)).expect("JSON of JSON");
        text.resize(text.len().next_multiple_of(4), b' ');
        let binary = if self.binary.is_empty() { 0 } else { 8 + self.binary.len() };
        let word = |value: usize| u32::try_from(value).ok().map(u32::to_le_bytes);
        let mut file = b"glTF\x02\0\0\0".to_vec();
        file.extend(word(12 + 8 + text.len() + binary)?);
        file.extend(word(text.len())?);
        file.extend_from_slice(b"JSON");
        file.extend(text);
        if !self.binary.is_empty() {
            file.extend(word(self.binary.len())?);
            file.extend_from_slice(b"BIN\0");
            file.extend(self.binary);
        }
        Some(file)
    }
}

//! A document and its binary chunk, put together piece by piece.

use crate::gltf::bundle::Bundle;
use crate::gltf::error::LoadError;
use crate::gltf::limits::Limits;
use crate::gltf::load::{Loaded, load};
use base64::Engine;
use serde_json::{Value, json};

pub(super) struct Builder {
    pub(super) json: Value,
    pub(super) binary: Vec<u8>,
}

pub(super) const I8: u64 = 5120;
pub(super) const U8: u64 = 5121;
pub(super) const I16: u64 = 5122;
pub(super) const U16: u64 = 5123;
pub(super) const U32: u64 = 5125;
pub(super) const F32: u64 = 5126;

/// A right triangle in the xy plane whose front is +z.
pub(super) const TRIANGLE: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

pub(super) fn bytes(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

impl Builder {
    pub(super) fn new() -> Self {
        Self { json: json!({"asset": {"version": "2.0"}}), binary: Vec::new() }
    }

    /// Appends to one of the outermost lists; its index comes back.
    pub(super) fn push(&mut self, list: &str, value: Value) -> usize {
        let root = self.json.as_object_mut().unwrap();
        let list = root.entry(list).or_insert_with(|| json!([])).as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    pub(super) fn view(&mut self, bytes: &[u8], stride: Option<u64>) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let mut view = json!({"buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len()});
        if let Some(stride) = stride {
            view["byteStride"] = json!(stride);
        }
        self.binary.extend_from_slice(bytes);
        self.push("bufferViews", view)
    }

    pub(super) fn accessor(&mut self, bytes: &[u8], component: u64, shape: &str, count: usize) -> usize {
        let view = self.view(bytes, None);
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": component, "type": shape, "count": count}),
        )
    }

    pub(super) fn floats(&mut self, shape: &str, numbers: &[f32]) -> usize {
        let width = match shape {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        self.accessor(&bytes(numbers), F32, shape, numbers.len() / width)
    }

    /// A mesh of one primitive at a node of its own.
    pub(super) fn primitive(&mut self, primitive: &Value) -> usize {
        let mesh = self.push("meshes", json!({"primitives": [primitive]}));
        self.push("nodes", json!({"mesh": mesh}))
    }

    /// A scene of one triangle with further attributes and members of its primitive.
    pub(super) fn triangle(attributes: &[(&str, &str, &[f32])], members: Value) -> Self {
        let mut builder = Self::new();
        let mut primitive = members;
        primitive["attributes"] = json!({"POSITION": builder.floats("VEC3", &TRIANGLE)});
        for (name, shape, numbers) in attributes {
            primitive["attributes"][*name] = json!(builder.floats(shape, numbers));
        }
        builder.primitive(&primitive);
        builder
    }

    pub(super) fn glb(&self) -> Vec<u8> {
        let mut document = self.json.clone();
        if !self.binary.is_empty() && document.get("buffers").is_none() {
            document["buffers"] = json!([{"byteLength": self.binary.len()}]);
        }
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut binary = self.binary.clone();
        binary.resize(binary.len().next_multiple_of(4), 0);
        let mut glb = b"glTF".to_vec();
        glb.extend(2_u32.to_le_bytes());
        glb.extend((28 + text.len() as u32 + binary.len() as u32).to_le_bytes());
        for (kind, chunk) in [(0x4E4F_534A_u32, text), (0x004E_4942, binary)] {
            glb.extend((chunk.len() as u32).to_le_bytes());
            glb.extend(kind.to_le_bytes());
            glb.extend(chunk);
        }
        glb
    }

    /// The same with its buffer as a data URI.
    pub(super) fn embedded(&self) -> Vec<u8> {
        let mut document = self.json.clone();
        let data = base64::engine::general_purpose::STANDARD.encode(&self.binary);
        document["buffers"] = json!([{
            "byteLength": self.binary.len(), "uri": format!("data:application/octet-stream;base64,{data}")
        }]);
        document.to_string().into_bytes()
    }

    pub(super) fn try_load(&self) -> Result<Loaded, LoadError> {
        load(&Bundle::open(self.glb())?, &Limits::default())
    }

    pub(super) fn load(&self) -> Loaded {
        self.try_load().unwrap()
    }

    /// What the reader says when it refuses the scene.
    pub(super) fn refusal(&self) -> String {
        self.try_load().expect_err("the scene should be refused").to_string()
    }
}

/// A PNG of eight-bit RGBA pixels.
pub(super) fn png(width: u32, height: u32, pixels: &[[u8; 4]]) -> Vec<u8> {
    let picture = image::RgbaImage::from_raw(width, height, pixels.concat()).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

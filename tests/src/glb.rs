//! Binary glTF scenes, made by code.

use glam::Vec3;
use serde_json::{Value, json};

/// A glTF document in the making. Methods return the index of what they add.
#[derive(Debug, Default)]
pub struct Glb {
    document: serde_json::Map<String, Value>,
    bin: Vec<u8>,
    nodes: Vec<usize>,
}

impl Glb {
    /// An empty document.
    pub fn new() -> Self {
        Self::default()
    }

    fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.document.entry(list).or_insert_with(|| json!([]));
        let list = list.as_array_mut().expect("top-level properties are lists");
        list.push(value);
        list.len() - 1
    }

    /// Adds bytes as a buffer view.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        while !self.bin.len().is_multiple_of(4) {
            self.bin.push(0);
        }
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()}))
    }

    /// Adds an accessor of floats, `width` a vertex (2, 3 or 4).
    pub fn floats(&mut self, values: &[f32], width: usize) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes);
        let count = values.len() / width;
        let mut accessor =
            json!({"bufferView": view, "componentType": 5126, "count": count, "type": format!("VEC{width}")});
        if width == 3 && values.iter().all(|v| v.is_finite()) {
            let bound = |pick: fn(f32, f32) -> f32, start: f32| {
                (0..3)
                    .map(|c| values.iter().skip(c).step_by(3).fold(start, |a, v| pick(a, *v)))
                    .collect::<Vec<_>>()
            };
            accessor["min"] = json!(bound(f32::min, f32::INFINITY));
            accessor["max"] = json!(bound(f32::max, f32::NEG_INFINITY));
        }
        self.push("accessors", accessor)
    }

    /// Adds an accessor of single floats.
    pub fn scalars(&mut self, values: &[f32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes);
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": 5126, "count": values.len(), "type": "SCALAR"}),
        )
    }

    /// Adds an accessor of 32-bit indices.
    pub fn indices(&mut self, indices: &[u32]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes);
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": 5125, "count": indices.len(), "type": "SCALAR"}),
        )
    }

    /// Adds a material as glTF has it.
    pub fn material(&mut self, material: Value) -> usize {
        self.push("materials", material)
    }

    /// Adds a texture of an embedded PNG.
    pub fn texture(&mut self, png: &[u8], sampler: Value) -> usize {
        let view = self.view(png);
        let image = self.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
        let sampler = self.push("samplers", sampler);
        self.push("textures", json!({"source": image, "sampler": sampler}))
    }

    /// Adds a mesh of triangles.
    pub fn mesh(&mut self, positions: &[Vec3], triangles: &[[u32; 3]], material: usize) -> usize {
        self.mesh_with(positions, triangles, material, &[])
    }

    /// Adds a mesh of triangles with further attributes: name, values, values a vertex.
    pub fn mesh_with(
        &mut self,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        material: usize,
        attributes: &[(&str, &[f32], usize)],
    ) -> usize {
        let flat: Vec<f32> = positions.iter().flat_map(Vec3::to_array).collect();
        let mut named = json!({"POSITION": self.floats(&flat, 3)});
        for (name, values, width) in attributes {
            named[*name] = json!(self.floats(values, *width));
        }
        let indices = self.indices(triangles.as_flattened());
        self.push(
            "meshes",
            json!({"primitives": [{"attributes": named, "indices": indices, "material": material}]}),
        )
    }

    /// Adds a node to the scene.
    pub fn node(&mut self, node: Value) -> usize {
        let index = self.push("nodes", node);
        self.nodes.push(index);
        index
    }

    /// Adds a mesh at the origin.
    pub fn place(&mut self, mesh: usize) -> usize {
        self.node(json!({"mesh": mesh}))
    }

    /// Adds triangles of a material of their own at the origin, and returns their node.
    pub fn body(&mut self, material: Value, (positions, triangles): (Vec<Vec3>, Vec<[u32; 3]>)) -> usize {
        let material = self.material(material);
        let mesh = self.mesh(&positions, &triangles, material);
        self.place(mesh)
    }

    /// Adds a camera that sees `width` × `height` metres in parallel, from `eye` towards `target`.
    pub fn orthographic(&mut self, eye: Vec3, target: Vec3, width: f32, height: f32) {
        let camera = json!({"type": "orthographic", "orthographic":
            {"xmag": width / 2.0, "ymag": height / 2.0, "znear": 0.0, "zfar": 1e9}});
        self.camera(camera, eye, target);
    }

    /// Adds a camera with a vertical angle of view in degrees, from `eye` towards `target`.
    pub fn perspective(&mut self, eye: Vec3, target: Vec3, degrees: f32) {
        let camera =
            json!({"type": "perspective", "perspective": {"yfov": degrees.to_radians(), "znear": 0.01}});
        self.camera(camera, eye, target);
    }

    fn camera(&mut self, camera: Value, eye: Vec3, target: Vec3) {
        let camera = self.push("cameras", camera);
        let back = (eye - target).normalize();
        let right = if back.y.abs() > 0.999 { Vec3::X } else { Vec3::Y.cross(back).normalize() };
        let up = back.cross(right);
        let columns = [right.extend(0.0), up.extend(0.0), back.extend(0.0), eye.extend(1.0)];
        let matrix: Vec<f32> = columns.iter().flat_map(glam::Vec4::to_array).collect();
        self.node(json!({"camera": camera, "matrix": matrix}));
    }

    /// Adds a punctual light; it shines along −z of the node.
    pub fn light(&mut self, light: Value, mut node: Value) -> usize {
        let extensions = self.document.entry("extensions").or_insert_with(|| json!({}));
        let lights = &mut extensions["KHR_lights_punctual"]["lights"];
        if lights.is_null() {
            *lights = json!([]);
        }
        let lights = lights.as_array_mut().expect("a list");
        lights.push(light);
        node["extensions"] = json!({"KHR_lights_punctual": {"light": lights.len() - 1}});
        self.node(node)
    }

    /// Puts nodes under a new one.
    pub fn carry(&mut self, nodes: &[usize]) -> usize {
        self.nodes.retain(|node| !nodes.contains(node));
        self.node(json!({"children": nodes}))
    }

    /// Gives the mesh of a node a morph target that moves its vertices, three numbers each.
    pub fn morph(&mut self, node: usize, moves: &[f32]) {
        let target = self.floats(moves, 3);
        let mesh = self.document["nodes"][node]["mesh"].as_u64().expect("the node has a mesh") as usize;
        self.document["meshes"][mesh]["primitives"][0]["targets"] = json!([{"POSITION": target}]);
    }

    /// Animates a node's `translation`, `rotation`, `scale` or `weights`: key frames' times, and their values.
    pub fn animate(&mut self, node: usize, path: &str, interpolation: &str, times: &[f32], values: &[f32]) {
        let input = self.scalars(times);
        let output = match path {
            "weights" => self.scalars(values),
            "rotation" => self.floats(values, 4),
            _ => self.floats(values, 3),
        };
        self.push(
            "animations",
            json!({"samplers": [{"input": input, "output": output, "interpolation": interpolation}],
                "channels": [{"sampler": 0, "target": {"node": node, "path": path}}]}),
        );
    }

    /// The document so far, to be changed by hand.
    pub fn document(&mut self) -> &mut serde_json::Map<String, Value> {
        &mut self.document
    }

    /// The finished file, all its nodes under one with the given transform.
    pub fn finish_under(mut self, mut parent: Value) -> Vec<u8> {
        parent["children"] = json!(std::mem::take(&mut self.nodes));
        self.node(parent);
        self.finish()
    }

    /// The finished file.
    pub fn finish(mut self) -> Vec<u8> {
        let nodes = std::mem::take(&mut self.nodes);
        self.document.insert("asset".to_owned(), json!({"version": "2.0"}));
        self.document.insert("scenes".to_owned(), json!([{"nodes": nodes}]));
        self.document.insert("scene".to_owned(), json!(0));
        self.document.insert("buffers".to_owned(), json!([{"byteLength": self.bin.len()}]));
        let text = serde_json::to_vec(&Value::Object(self.document)).expect("JSON of JSON");
        glb(&text, &self.bin)
    }
}

/// A binary glTF of a JSON text and a binary chunk.
pub fn glb(json: &[u8], bin: &[u8]) -> Vec<u8> {
    let pad = |length: usize| (4 - length % 4) % 4;
    let mut chunks = Vec::new();
    for (kind, bytes, filler) in [(b"JSON", json, b' '), (b"BIN\0", bin, 0)] {
        chunks.extend_from_slice(&((bytes.len() + pad(bytes.len())) as u32).to_le_bytes());
        chunks.extend_from_slice(kind);
        chunks.extend_from_slice(bytes);
        chunks.extend(std::iter::repeat_n(filler, pad(bytes.len())));
    }
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend_from_slice(&(12 + chunks.len() as u32).to_le_bytes());
    file.extend(chunks);
    file
}

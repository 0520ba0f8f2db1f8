//! Random scenes.

use crate::film::size::Size;
use crate::gltf::bundle::Bundle;
use crate::gltf::limits::Limits;
use crate::gltf::load::load;
use crate::sampler::{Dimension, Sampler, Use};
use crate::scene::Scene;
use crate::scene::environment::Environment;
use crate::scene::view::{LensInScene, Views};
use crate::settings::{CameraChoice, Distribution, FULL, Gloss, Method, Settings, Shadows, Shutter, Weights};
use base64::Engine;
use glam::{Vec2, Vec3};
use serde_json::{Value, json};

pub(super) struct Numbers {
    pub(super) sampler: Sampler,
    pub(super) next: u32,
}

impl Numbers {
    pub(super) fn pair(&mut self) -> Vec2 {
        self.next += 1;
        self.sampler.pair(Dimension::Eye(self.next, Use::Choice))
    }

    pub(super) fn one(&mut self) -> f32 {
        self.pair().x
    }

    pub(super) fn of<T: Clone>(&mut self, all: &[T]) -> T {
        all[(self.one() * all.len() as f32) as usize].clone()
    }
}

/// A document in the making: bodies of loose triangles.
struct Document {
    json: Value,
}

impl Document {
    fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    fn body(&mut self, material: &Value, triangles: &[[Vec3; 3]]) {
        let bytes: Vec<u8> =
            triangles.iter().flatten().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes).collect();
        let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
        let uri = format!("data:application/octet-stream;base64,{data}");
        let buffer = self.push("buffers", json!({"byteLength": bytes.len(), "uri": uri}));
        let view = self.push("bufferViews", json!({"buffer": buffer, "byteLength": bytes.len()}));
        let low = triangles.iter().flatten().copied().reduce(Vec3::min).unwrap().to_array();
        let high = triangles.iter().flatten().copied().reduce(Vec3::max).unwrap().to_array();
        let accessor = self.push(
            "accessors",
            json!({"bufferView": view, "componentType": 5126, "type": "VEC3", "count": 3 * triangles.len(),
                "min": low, "max": high}),
        );
        let material = self.push("materials", material.clone());
        let primitive = json!({"attributes": {"POSITION": accessor}, "material": material});
        let mesh = self.push("meshes", json!({"primitives": [primitive]}));
        self.node(json!({"mesh": mesh}));
    }

    fn node(&mut self, node: Value) {
        let node = self.push("nodes", node);
        self.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(node));
    }

    fn light(&mut self, light: Value, mut node: Value) {
        let lights = self.json["extensions"]["KHR_lights_punctual"]["lights"].as_array_mut().unwrap();
        lights.push(light);
        node["extensions"] = json!({"KHR_lights_punctual": {"light": lights.len() - 1}});
        self.node(node);
    }
}

/// The six sides of a box, their front outside.
fn sides(low: Vec3, high: Vec3) -> [[[Vec3; 3]; 2]; 6] {
    let corner = |i: usize| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
        Vec3::new(pick(0), pick(1), pick(2))
    };
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    faces.map(|face| {
        let [a, b, c, d] = face.map(corner);
        [[a, b, c], [a, c, d]]
    })
}

/// Smooth glass, rough glass, mirrors, metal down to α = 10⁻³, plastic with and without an ideally smooth coat, matt.
fn materials() -> Vec<Value> {
    let of = |metallic: f32, roughness: f32| {
        json!({"pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.7, 0.6, 1.0],
            "metallicFactor": metallic, "roughnessFactor": roughness}})
    };
    let glass = |roughness: f32| {
        let mut glass = of(0.0, roughness);
        glass["extensions"] = json!({"KHR_materials_transmission": {"transmissionFactor": 0.9},
            "KHR_materials_volume": {"thicknessFactor": 1.0}});
        glass
    };
    let mut matt = of(0.0, 1.0);
    matt["extensions"] = json!({"KHR_materials_specular": {"specularFactor": 0.0}});
    vec![of(1.0, 0.0), of(1.0, 0.032), of(1.0, 0.3), of(0.0, 0.0), of(0.0, 0.3), glass(0.0), glass(0.4), matt]
}

/// α = 10⁻³, a little above what is taken for ideal.
const NARROW: usize = 1;
const MATT: usize = 7;

/// What a scene is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// Any materials and lights.
    Any,
    /// A closed room whose floor and ceiling are narrow and matt: long paths.
    Tunnel,
}

pub(super) fn scene(kind: Kind, numbers: &mut Numbers) -> Scene {
    let mut document = Document {
        json: json!({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [],
            "meshes": [], "materials": [], "accessors": [], "bufferViews": [], "buffers": [], "cameras": [],
            "extensionsUsed": ["KHR_lights_punctual"],
            "extensions": {"KHR_lights_punctual": {"lights": []}}}),
    };
    let all = materials();
    let closed = kind == Kind::Tunnel || numbers.one() < 0.5;
    for (i, side) in sides(Vec3::splat(-1.0), Vec3::ONE).into_iter().enumerate() {
        let inward = side.map(|[a, b, c]| [a, c, b]);
        if !closed && i == 5 {
            continue;
        }
        let material = match kind {
            Kind::Any => numbers.of(&all),
            Kind::Tunnel => all[if i % 2 == 0 { NARROW } else { MATT }].clone(),
        };
        document.body(&material, &inward);
    }
    for x in [-0.5, 0.4] {
        let low = Vec3::new(x - 0.2, -0.9 + numbers.one(), -0.3);
        document.body(&numbers.of(&all), sides(low, low + Vec3::new(0.45, 0.5, 0.6)).as_flattened());
    }
    lights(&mut document, numbers);
    let camera = if numbers.one() < 0.7 {
        json!({"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.01}})
    } else {
        json!({"type": "orthographic", "orthographic": {"xmag": 0.8, "ymag": 0.8, "znear": 0.0, "zfar": 9.0}})
    };
    document.push("cameras", camera);
    document.node(json!({"camera": 0, "translation": [0.1, 0.0, 0.85]}));
    let text = serde_json::to_vec(&document.json).unwrap();
    let data = load(&Bundle::open(text).unwrap(), &Limits::default()).unwrap().scene;
    let lens = (numbers.one() < 0.5).then(|| LensInScene {
        radius: data.normalisation.distance(0.05) as f32,
        focus_distance: data.normalisation.distance(1.5) as f32,
    });
    let views = Views::new(&data.cameras[0], SIZE, lens);
    let environment = (numbers.one() < 0.4).then(|| Environment::uniform(Vec3::ONE));
    Scene::new(data, environment, views).unwrap()
}

/// Some lights of every kind.
fn lights(document: &mut Document, numbers: &mut Numbers) {
    let mut lamp = materials()[MATT].clone();
    lamp["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
    lamp["doubleSided"] = json!(numbers.one() < 0.5);
    let [side, ..] = sides(Vec3::new(-0.1, 0.7, -0.3), Vec3::new(0.2, 0.9, 0.1));
    document.body(&lamp, &side);
    let half = core::f64::consts::FRAC_1_SQRT_2;
    let down = json!({"translation": [0.2, 0.6, 0.1], "rotation": [-half, 0.0, 0.0, half]});
    let cone = json!({"innerConeAngle": 0.3, "outerConeAngle": 1.2});
    for light in [
        json!({"type": "point", "intensity": 0.3}),
        json!({"type": "spot", "intensity": 0.5, "spot": cone}),
        json!({"type": "directional", "intensity": 0.5}),
    ] {
        if numbers.one() < 0.6 {
            document.light(light, down.clone());
        }
    }
}

const SIZE: Size = Size { width: 8, height: 8 };

pub(super) fn settings(weights: Weights) -> Settings {
    Settings {
        size: SIZE,
        camera: CameraChoice::Index(0),
        variant: None,
        method: Method::Bidirectional,
        paths: FULL.to_owned(),
        layers: Vec::new(),
        gloss: Gloss::AsItIs,
        strategies: Vec::new(),
        weights,
        bounces: None,
        lens: None,
        shutter: Shutter::default(),
        environment: None,
        shadows: Shadows::On,
        seed: 0,
        replicates: 1,
        sampling: Distribution::Uniform,
    }
}

//! Scenes of every kind that all methods have to agree on.

use crate::{
    glb::Glb,
    picture::{in_environment, settings},
    scenes::{cuboid, glass, lambert, quad, sphere},
    stage::{metal, plastic, room, room_in_parallel, smooth_sphere},
    textures::{UVS, png},
};
use glam::Vec3;
use ovtigre_core::settings::{Lens, Settings, Shutter};
use serde_json::{Value, json};

/// A scene, and how it is looked at.
#[derive(Clone, Debug)]
pub struct Case {
    /// What it is.
    pub what: &'static str,
    /// The file.
    pub glb: Vec<u8>,
    /// 64×64 pixels, 16 replicates.
    pub settings: Settings,
}

fn case(what: &'static str, glb: Vec<u8>) -> Case {
    Case { what, glb, settings: settings(64, 64, 16) }
}

impl Case {
    fn in_environment(mut self, radiance: f32) -> Self {
        self.settings = in_environment(self.settings, radiance);
        self
    }
}

/// A diffuse room.
pub fn diffuse() -> Case {
    let contents = cuboid(Vec3::new(-0.5, -1.0, -0.5), Vec3::new(0.2, 0.1, 0.2));
    case("diffuse", room(10.0, |glb| glb.body(lambert(0.8, 0.0), contents)))
}

/// Smooth normals on plastic, metal and matt spheres.
pub fn smooth_normals() -> Case {
    let glb = room(10.0, |glb| {
        smooth_sphere(glb, plastic(0.3), Vec3::new(-0.4, -0.5, 0.0), 0.45);
        smooth_sphere(glb, metal(0.4), Vec3::new(0.5, -0.4, 0.2), 0.4);
        smooth_sphere(glb, lambert(0.8, 0.0), Vec3::new(0.1, 0.4, -0.3), 0.3);
    });
    case("smooth normals", glb)
}

/// A ball of glass.
pub fn ball_of_glass(roughness: f32) -> Case {
    let mut material = glass(1.5);
    material["pbrMetallicRoughness"]["roughnessFactor"] = json!(roughness);
    let glb = room(10.0, |glb| smooth_sphere(glb, material, Vec3::new(0.0, -0.3, 0.0), 0.6));
    case(if roughness == 0.0 { "smooth glass" } else { "rough glass" }, glb)
}

/// Plastic with an ideally smooth coat, and a mixture of all lobes.
pub fn coated() -> Case {
    let glb = room(10.0, |glb| {
        glb.body(plastic(0.0), cuboid(Vec3::new(-0.8, -1.0, -0.5), Vec3::new(-0.1, 0.0, 0.3)));
        let mut mixed = plastic(0.3);
        mixed["pbrMetallicRoughness"]["metallicFactor"] = json!(0.4);
        mixed["extensions"] = json!({"KHR_materials_transmission": {"transmissionFactor": 0.5}});
        glb.body(mixed, cuboid(Vec3::new(0.2, -1.0, -0.3), Vec3::new(0.7, 0.0, 0.4)));
    });
    case("coated", glb)
}

/// A metal under a coat, cloth, and a leaf that light shines through.
pub fn coats_cloth_and_leaves() -> Case {
    let glb = room(10.0, |glb| {
        let mut coated = metal(0.5);
        coated["extensions"] = json!({"KHR_materials_clearcoat":
            {"clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.3}});
        smooth_sphere(glb, coated, Vec3::new(-0.5, -0.5, 0.2), 0.4);
        let mut cloth = plastic(0.8);
        cloth["extensions"] = json!({"KHR_materials_sheen":
            {"sheenColorFactor": [0.9, 0.6, 0.3], "sheenRoughnessFactor": 0.4}});
        smooth_sphere(glb, cloth, Vec3::new(0.5, -0.5, 0.2), 0.4);
        let mut leaf = plastic(0.5);
        leaf["extensions"] = json!({"KHR_materials_diffuse_transmission":
            {"diffuseTransmissionFactor": 0.7, "diffuseTransmissionColorFactor": [0.4, 0.9, 0.3]}});
        let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
        glb.body(leaf, quad([at(-0.5, 0.2), at(0.5, 0.2), at(0.5, 0.8), at(-0.5, 0.8)]));
    });
    case("layers", glb)
}

const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;

fn downwards() -> Value {
    json!({"translation": [0.2, 0.8, 0.1], "rotation": [-HALF, 0.0, 0.0, HALF]})
}

fn sun(glb: &mut Glb) {
    let along = json!({"rotation": [-0.3, 0.2, 0.0, 0.93]});
    glb.light(json!({"type": "directional", "intensity": 3.0}), along);
}

/// A point light.
pub fn point() -> Case {
    case("point", room(0.0, |glb| glb.light(json!({"type": "point", "intensity": 2.0}), downwards())))
}

/// A spot.
pub fn spot() -> Case {
    let cone =
        json!({"type": "spot", "intensity": 4.0, "spot": {"innerConeAngle": 0.3, "outerConeAngle": 0.8}});
    case("spot", room(0.0, |glb| glb.light(cone, downwards())))
}

/// A sun.
pub fn sunny() -> Case {
    case("sun", room(0.0, sun))
}

/// A sky.
pub fn sky() -> Case {
    case("sky", room(0.0, |_| ())).in_environment(1.0)
}

/// A sky, a lamp and a point at once.
pub fn many_lights() -> Case {
    let glb = room(4.0, |glb| {
        glb.light(json!({"type": "point", "intensity": 1.0}), json!({"translation": [-0.5, 0.0, 0.2]}))
    });
    case("sky, lamp and point", glb).in_environment(1.0)
}

/// A quad whose material has a texture of 4×4 texels in the given place.
fn textured(glb: &mut Glb, mut material: Value, texels: &[[u8; 4]; 16], place: &str, corners: [Vec3; 4]) {
    let texture = glb.texture(&png(4, texels), json!({}));
    material[place] = json!({"index": texture});
    let material = glb.material(material);
    let (positions, triangles) = quad(corners);
    let mesh = glb.mesh_with(&positions, &triangles, material, &[("TEXCOORD_0", &UVS, 2)]);
    glb.place(mesh);
}

/// A normal map on plastic, and a lamp with a texture.
pub fn maps() -> Case {
    let at = Vec3::new;
    let bumps = std::array::from_fn(|i| [96 + 16 * (i as u8 % 5), 88 + 20 * (i as u8 % 4), 215, 255]);
    let glow = std::array::from_fn(|i| [if i % 3 == 0 { 255 } else { 60 }, 40 + 12 * i as u8, 90, 255]);
    let glb = room(2.0, |glb| {
        let raised = [at(-0.9, -0.9, 0.9), at(0.5, -0.9, 0.9), at(0.5, -0.8, -0.6), at(-0.9, -0.8, -0.6)];
        textured(glb, plastic(0.4), &bumps, "normalTexture", raised);
        let lamp = [at(0.6, -0.6, -0.9), at(0.95, -0.6, -0.6), at(0.95, 0.4, -0.6), at(0.6, 0.4, -0.9)];
        textured(glb, lambert(0.2, 6.0), &glow, "emissiveTexture", lamp);
    });
    case("normal maps and textured lamps", glb)
}

/// A ball and a point light that move.
pub fn moving() -> Case {
    let glb = room(10.0, |glb| {
        let ball = glb.body(plastic(0.4), sphere(Vec3::new(0.0, -0.4, 0.1), 0.35, 8));
        glb.animate(ball, "translation", "LINEAR", &[0.0, 1.0], &[-0.4, 0.0, 0.0, 0.4, 0.2, 0.0]);
        let lamp = glb.light(json!({"type": "point", "intensity": 0.5}), json!({}));
        glb.animate(lamp, "translation", "LINEAR", &[0.0, 1.0], &[0.7, 0.3, 0.3, 0.7, -0.5, 0.3]);
    });
    let mut case = case("moving things", glb);
    case.settings.shutter = Shutter { open: 0.0, close: 1.0 };
    case
}

fn block(glb: &mut Glb) -> usize {
    glb.body(plastic(0.4), cuboid(Vec3::new(-0.4, -1.0, -0.4), Vec3::new(0.4, -0.2, 0.4)))
}

/// A room through a lens.
pub fn lens() -> Case {
    let mut case = case("lens", room(10.0, block));
    case.settings.lens = Some(Lens { radius: 0.2, focus_distance: 3.0 });
    case
}

/// A room seen by parallel rays.
pub fn parallel() -> Case {
    case("parallel rays", room_in_parallel(10.0, block))
}

/// A sun and a sky, seen by parallel rays.
pub fn parallel_under_sky() -> Case {
    let glb = room_in_parallel(0.0, |glb| {
        block(glb);
        sun(glb);
    });
    case("parallel rays, sun and sky", glb).in_environment(0.5)
}

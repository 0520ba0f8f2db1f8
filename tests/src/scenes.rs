//! Scenes whose light is known.

use crate::glb::Glb;
use glam::Vec3;
use serde_json::{Value, json};

/// A pure Lambert material that emits.
pub fn lambert(reflectance: f32, emission: f32) -> Value {
    let mut material = json!({
        "pbrMetallicRoughness": {"baseColorFactor": [reflectance, reflectance, reflectance, 1.0], "metallicFactor": 0.0},
        "extensions": {"KHR_materials_specular": {"specularFactor": 0.0}},
    });
    if emission > 0.0 {
        material["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
        material["extensions"]["KHR_materials_emissive_strength"] = json!({"emissiveStrength": emission});
    }
    material
}

/// A mirror that loses nothing.
pub fn mirror() -> Value {
    json!({"pbrMetallicRoughness": {"metallicFactor": 1.0, "roughnessFactor": 0.0}})
}

/// Clear smooth glass, solid.
pub fn glass(ior: f32) -> Value {
    json!({
        "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.0},
        "extensions": {
            "KHR_materials_transmission": {"transmissionFactor": 1.0},
            "KHR_materials_volume": {"thicknessFactor": 1.0},
            "KHR_materials_ior": {"ior": ior},
        },
    })
}

/// A quad from four corners, counter-clockwise seen from its front.
pub fn quad(corners: [Vec3; 4]) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    (corners.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
}

/// A square in the plane y = `height`, its front up (+y), of the given side, centred at (x, z).
pub fn floor(height: f32, side: f32, x: f32, z: f32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let h = side / 2.0;
    let corner = |dx: f32, dz: f32| Vec3::new(x + dx * h, height, z + dz * h);
    quad([corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)])
}

/// The same triangles, their front on the other side.
pub fn flipped((positions, triangles): (Vec<Vec3>, Vec<[u32; 3]>)) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    (positions, triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect())
}

/// An axis-aligned box, its front outside.
pub fn cuboid(low: Vec3, high: Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let positions = (0..8)
        .map(|i| {
            let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
            Vec3::new(pick(0), pick(1), pick(2))
        })
        .collect();
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    (positions, faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
}

/// A sphere of `rings` × 2 `rings` facets, its front outside.
pub fn sphere(centre: Vec3, radius: f32, rings: u32) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let sectors = 2 * rings;
    let point = |ring: u32, sector: u32| {
        let (theta, phi) =
            (f64::from(ring) / f64::from(rings), f64::from(sector % sectors) / f64::from(sectors));
        let (theta, phi) = (theta * std::f64::consts::PI, phi * std::f64::consts::TAU);
        let d = glam::DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
        centre + radius * d.as_vec3()
    };
    let mut positions = vec![centre + Vec3::Y * radius];
    for ring in 1..rings {
        positions.extend((0..sectors).map(|sector| point(ring, sector)));
    }
    positions.push(centre - Vec3::Y * radius);
    let at = |ring: u32, sector: u32| match ring {
        0 => 0,
        r if r == rings => 1 + (rings - 1) * sectors,
        r => 1 + (r - 1) * sectors + sector % sectors,
    };
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for sector in 0..sectors {
            let [a, b] = [at(ring, sector), at(ring, sector + 1)];
            let [c, d] = [at(ring + 1, sector), at(ring + 1, sector + 1)];
            if a != b {
                triangles.push([a, b, d]);
            }
            if c != d {
                triangles.push([a, d, c]);
            }
        }
    }
    (positions, triangles)
}

/// A closed room of side 2 around the origin whose walls reflect `reflectance` and emit `emission` inwards, seen from
/// within: its radiance is emission / (1 − reflectance) everywhere.
pub fn furnace(reflectance: f32, emission: f32) -> Vec<u8> {
    let mut glb = Glb::new();
    let material = glb.material(lambert(reflectance, emission));
    let (positions, triangles) = flipped(cuboid(Vec3::splat(-1.0), Vec3::ONE));
    let mesh = glb.mesh(&positions, &triangles, material);
    glb.place(mesh);
    glb.perspective(Vec3::new(0.3, -0.2, 0.5), Vec3::new(-1.0, 0.4, -0.7), 70.0);
    glb.finish()
}

/// A body alone, filling most of the view, for a uniform environment.
pub fn body_alone(material: Value, (positions, triangles): (Vec<Vec3>, Vec<[u32; 3]>)) -> Vec<u8> {
    let mut glb = Glb::new();
    let material = glb.material(material);
    let mesh = glb.mesh(&positions, &triangles, material);
    glb.place(mesh);
    glb.perspective(Vec3::new(0.5, 1.0, 4.0), Vec3::ZERO, 35.0);
    glb.finish()
}

/// A large grey floor seen straight down at the origin through a peephole, and what `add` puts above it.
pub fn over_floor(reflectance: f32, add: impl FnOnce(&mut Glb)) -> Vec<u8> {
    let mut glb = Glb::new();
    let material = glb.material(lambert(reflectance, 0.0));
    let (positions, triangles) = floor(0.0, 20.0, 0.0, 0.0);
    let mesh = glb.mesh(&positions, &triangles, material);
    glb.place(mesh);
    // Slanted, so that what is right above the origin does not stand in the way.
    glb.orthographic(Vec3::new(0.0, 0.01, 0.02), Vec3::ZERO, 1e-5, 1e-5);
    add(&mut glb);
    glb.finish()
}

/// A pure Lambert material of a colour.
pub fn coloured_lambert(rgb: [f32; 3]) -> Value {
    let mut material = lambert(0.0, 0.0);
    material["pbrMetallicRoughness"]["baseColorFactor"] = json!([rgb[0], rgb[1], rgb[2], 1.0]);
    material
}

/// Adds a body of its own node, mesh and material.
pub fn add(
    glb: &mut Glb,
    name: &str,
    mut material: Value,
    (positions, triangles): (Vec<Vec3>, Vec<[u32; 3]>),
) {
    material["name"] = json!(name);
    let material = glb.material(material);
    let mesh = glb.mesh(&positions, &triangles, material);
    glb.node(json!({"mesh": mesh, "name": name}));
}

/// The six sides of a box as seen from within: left, right, floor, ceiling, back, front.
pub fn walls(low: Vec3, high: Vec3) -> [(Vec<Vec3>, Vec<[u32; 3]>); 6] {
    let (positions, triangles) = flipped(cuboid(low, high));
    std::array::from_fn(|side| {
        let triangles = &triangles[2 * side..2 * side + 2];
        let mut used: Vec<u32> = triangles.as_flattened().to_vec();
        used.sort_unstable();
        used.dedup();
        let number = |v: u32| used.iter().position(|u| *u == v).expect("a vertex in use") as u32;
        let moved = triangles.iter().map(|t| t.map(number)).collect();
        (used.iter().map(|&v| positions[v as usize]).collect(), moved)
    })
}

/// A box of side 2 around the origin, open in front, with a lamp under its ceiling and two blocks, all Lambert.
pub fn cornell() -> Vec<u8> {
    let mut glb = Glb::new();
    let [left, right, ground, ceiling, back, _] = walls(Vec3::splat(-1.0), Vec3::ONE);
    add(&mut glb, "left", coloured_lambert([0.63, 0.065, 0.05]), left);
    add(&mut glb, "right", coloured_lambert([0.14, 0.45, 0.091]), right);
    for (name, side) in [("floor", ground), ("ceiling", ceiling), ("back", back)] {
        add(&mut glb, name, lambert(0.7, 0.0), side);
    }
    add(&mut glb, "lamp", lambert(0.0, 12.0), flipped(floor(0.98, 0.6, 0.0, 0.0)));
    let block = |low: Vec3, high: Vec3, degrees: f32| {
        let (positions, triangles) = cuboid(low, high);
        let centre = (low + high) * 0.5;
        let turn = glam::Quat::from_rotation_y(degrees.to_radians());
        (positions.iter().map(|p| turn * (*p - centre) + centre).collect(), triangles)
    };
    let low = block(Vec3::new(0.05, -1.0, 0.05), Vec3::new(0.65, -0.4, 0.65), 18.0);
    let high = block(Vec3::new(-0.65, -1.0, -0.6), Vec3::new(-0.05, 0.2, 0.0), -20.0);
    add(&mut glb, "low block", lambert(0.7, 0.0), low);
    add(&mut glb, "high block", lambert(0.7, 0.0), high);
    glb.perspective(Vec3::new(0.0, 0.0, 4.2), Vec3::ZERO, 36.0);
    glb.finish()
}

/// Two closed rooms side by side with a doorway between them, lit in the one and seen in the other, all Lambert.
pub fn two_rooms() -> Vec<u8> {
    let mut glb = Glb::new();
    let (low, high) = (Vec3::new(-2.0, 0.0, -1.0), Vec3::new(2.0, 2.0, 1.0));
    let [left, right, ground, ceiling, back, front] = walls(low, high);
    add(&mut glb, "left", lambert(0.7, 0.0), left);
    add(&mut glb, "right", coloured_lambert([0.7, 0.4, 0.3]), right);
    for (name, side) in [("floor", ground), ("ceiling", ceiling), ("back", back), ("front", front)] {
        add(&mut glb, name, lambert(0.6, 0.0), side);
    }
    for (name, from, to) in [
        ("wall behind the door", Vec3::new(-0.05, 0.0, -1.0), Vec3::new(0.05, 2.0, -0.3)),
        ("wall before the door", Vec3::new(-0.05, 0.0, 0.4), Vec3::new(0.05, 2.0, 1.0)),
        ("wall above the door", Vec3::new(-0.05, 1.5, -0.3), Vec3::new(0.05, 2.0, 0.4)),
    ] {
        add(&mut glb, name, lambert(0.6, 0.0), cuboid(from, to));
    }
    add(&mut glb, "lamp", lambert(0.0, 10.0), flipped(floor(1.98, 0.8, -1.0, 0.0)));
    glb.perspective(Vec3::new(0.4, 1.0, 0.9), Vec3::new(1.6, 0.8, -0.8), 75.0);
    glb.finish()
}

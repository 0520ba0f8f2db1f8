//! A scene with its light in it.

use crate::bake::light_map::{self, LightMap};
use crate::bake::materials::UNLIT;
use crate::bake::writer::Writer;
use crate::bake::{cameras, vertex_colours};
use crate::radiosity::solution::Solution;
use crate::scene::data::SceneData;
use serde_json::json;

/// Largest side of a light map in texels.
pub const SIDE_MAX: u32 = 8192;

/// What light is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Colours of vertices; the mesh is cut into the solution's patches.
    VertexColours,
    /// A texture of that many texels a side, a power of two.
    LightMap(u32),
}

/// Why a scene cannot be baked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BakeError {
    /// A `.glb` cannot be that long.
    #[error(
        "the file would be longer than the four gigabytes a .glb can have; ask for fewer patches or a smaller light map"
    )]
    TooLong,
    /// The side of a light map is none.
    #[error("a light map has a power of two of texels a side, from 8 to {SIDE_MAX}, not {0}")]
    Side(u32),
    /// The triangles do not fit.
    #[error(
        "the triangles do not fit into a light map of {0} texels a side; make it larger or write vertex colours"
    )]
    DoesNotFit(u32),
}

/// A scene with its light in it.
#[derive(Clone, Debug)]
pub struct Baked {
    /// A binary glTF 2.0. Its materials are unlit; it has the scene's nodes with triangles by their names, at their places,
    /// and its cameras.
    pub glb: Vec<u8>,
    /// The radiance, W/(sr·m²), that white stands for; also in the file's `asset.extras.ovtigre`.
    pub white: f32,
    /// The texture, where there is one.
    pub light_map: Option<LightMap>,
}

/// Writes a solution into a file. `white` is the radiance that white stands for; by default the one that 99.9 % of all that does
/// not emit stay below.
pub fn bake(
    data: &SceneData,
    solution: &Solution,
    form: Form,
    white: Option<f32>,
) -> Result<Baked, BakeError> {
    let mut writer = Writer::default();
    let (mut nodes, light_map, white) = match form {
        Form::VertexColours => {
            let (nodes, white) = vertex_colours::write(&mut writer, data, solution, white);
            (nodes, None, white)
        }
        Form::LightMap(side) => {
            if !side.is_power_of_two() || !(8..=SIDE_MAX).contains(&side) {
                return Err(BakeError::Side(side));
            }
            let written = light_map::write(&mut writer, data, solution, side, white);
            let (nodes, map, white) = written.ok_or(BakeError::DoesNotFit(side))?;
            (nodes, Some(map), white)
        }
    };
    nodes.extend(cameras::write(&mut writer, data));
    // What is far from the origin stays exact in the vertices.
    let mut root = json!({"name": "baked", "translation": data.normalisation.centre.to_array()});
    if !nodes.is_empty() {
        root["children"] = json!(nodes);
    }
    let root = writer.push("nodes", root);
    let report = solution.report();
    let extras = json!({"ovtigre": {
        "method": report.method, "paths": "LD*E", "white": white, "patches": report.patches,
        "iterations": report.iterations, "residual": report.residuals.last(), "certified": report.certified,
    }});
    let glb = writer.finish(root, &[UNLIT], &extras).ok_or(BakeError::TooLong)?;
    Ok(Baked { glb, white, light_map })
}

//! The cameras of a scene as glTF nodes.

use crate::bake::writer::Writer;
use crate::scene::camera::{Camera, Projection};
use crate::scene::data::SceneData;
use glam::{Vec3, Vec4};
use serde_json::json;

/// Adds them under a node at the scene's centre, and returns their nodes.
pub fn write(writer: &mut Writer, data: &SceneData) -> Vec<usize> {
    data.cameras.iter().map(|camera| write_one(writer, data, camera)).collect()
}

fn write_one(writer: &mut Writer, data: &SceneData, camera: &Camera) -> usize {
    let metres = |distance: f32| data.normalisation.metres(f64::from(distance));
    let far = data.normalisation.metres(data.bounds.radius()).max(f64::MIN_POSITIVE) * 1e3;
    let lens = match camera.projection {
        Projection::Perspective { tan_half_y, aspect } => {
            let angle = 2.0 * libm::atan(f64::from(tan_half_y));
            let mut perspective = json!({"yfov": angle, "znear": far * 1e-6});
            if let Some(aspect) = aspect {
                perspective["aspectRatio"] = json!(aspect);
            }
            json!({"name": camera.name, "type": "perspective", "perspective": perspective})
        }
        Projection::Orthographic { half_width, half_height } => {
            let sizes =
                json!({"xmag": metres(half_width), "ymag": metres(half_height), "znear": 0.0, "zfar": far});
            json!({"name": camera.name, "type": "orthographic", "orthographic": sizes})
        }
    };
    let index = writer.push("cameras", lens);
    // A glTF node's matrix must not shear.
    let back = camera.backward;
    let up = (camera.up - back * back.dot(camera.up)).try_normalize().unwrap_or(Vec3::Y);
    let right = up.cross(back);
    let position = camera.position.as_dvec3() / data.normalisation.scale();
    let columns = [right.extend(0.0), up.extend(0.0), back.extend(0.0), position.as_vec3().extend(1.0)];
    let matrix: Vec<f32> = columns.iter().flat_map(Vec4::to_array).collect();
    writer.push("nodes", json!({"name": camera.name, "camera": index, "matrix": matrix}))
}

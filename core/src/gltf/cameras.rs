//! Cameras of a document.

use crate::gltf::document::{At, Document};
use crate::gltf::error::{LoadError, Problems};
use crate::gltf::nodes::Carries;
use crate::gltf::stage::Stage;
use crate::scene::camera::{Camera, Projection, Stand};
use crate::scene::normalisation::Normalisation;

/// The cameras of the scene's nodes, in the scene's space. The size of an orthographic one is that at the first knot.
pub(crate) fn read(
    document: &Document,
    stage: &Stage<'_>,
    normalisation: &Normalisation,
    problems: &mut Problems,
) -> Result<Vec<Camera>, LoadError> {
    let mut cameras = Vec::new();
    let whole = stage.tree.nodes.iter().enumerate().filter(|(_, node)| node.carries != Carries::Mesh);
    for (place, node) in whole {
        let Some(index) = node.at.index("camera", "cameras", document.count("cameras"))? else {
            continue;
        };
        let item = document.item("cameras", index)?;
        let projection = projection(&item)?;
        let name = if node.name.is_empty() { item.name() } else { node.name.clone() };
        let placed = (stage.worlds(place))
            .map(|world| Camera::placed(name.clone(), &normalisation.apply(&world), projection))
            .collect::<Option<Vec<_>>>();
        let Some(mut placed) = placed else {
            problems.add(&node.at.pointer, "its transform flattens space: the camera is left out");
            continue;
        };
        let stands: Vec<Stand> = placed.iter().map(Camera::stand).collect();
        let mut camera = placed.swap_remove(0);
        if stands.len() > 1 {
            camera.knots = stands;
        }
        cameras.push(camera);
    }
    Ok(cameras)
}

/// Sizes of an orthographic camera are in metres here: placing it applies the scale.
fn projection(item: &At<'_>) -> Result<Projection, LoadError> {
    match item.text("type")? {
        Some("perspective") => {
            let at = item.object("perspective")?.ok_or_else(|| item.error("\"perspective\" is missing"))?;
            let angle = at.number("yfov")?.ok_or_else(|| at.error("\"yfov\" is missing"))?;
            if !(angle > 0.0 && angle < std::f64::consts::PI) {
                return Err(at.error(format!("\"yfov\" is {angle}, but must be between 0 and π")));
            }
            let aspect = at.number("aspectRatio")?;
            if aspect.is_some_and(|a| !(a > 0.0 && (a as f32).is_finite())) {
                return Err(
                    at.error(format!("\"aspectRatio\" is {}, but must be positive", aspect.unwrap_or(0.0)))
                );
            }
            Ok(Projection::Perspective {
                tan_half_y: libm::tan(angle * 0.5) as f32,
                aspect: aspect.map(|a| a as f32),
            })
        }
        Some("orthographic") => {
            let at = item.object("orthographic")?.ok_or_else(|| item.error("\"orthographic\" is missing"))?;
            let half = |key: &str| match at.number(key)? {
                Some(size) if size != 0.0 && (size as f32).is_finite() => Ok(size.abs() as f32),
                Some(size) => Err(at.error(format!("\"{key}\" is {size}, but must not be zero"))),
                None => Err(at.error(format!("\"{key}\" is missing"))),
            };
            Ok(Projection::Orthographic { half_width: half("xmag")?, half_height: half("ymag")? })
        }
        Some(other) => {
            Err(item
                .error(format!("the type \"{}\" is no camera of glTF 2.0", crate::gltf::uri::shorten(other))))
        }
        None => Err(item.error("\"type\" is missing")),
    }
}

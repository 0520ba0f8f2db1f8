//! Lights of `KHR_lights_punctual`.

use crate::gltf::document::{At, Document};
use crate::gltf::error::{LoadError, Problems};
use crate::gltf::nodes::{Carries, Node};
use crate::gltf::stage::Stage;
use crate::math::colour::Rgb;
use crate::scene::normalisation::Normalisation;
use crate::scene::punctual::{Punctual, PunctualKind};
use glam::{DAffine3, DVec3, Vec3};

const NAME: &str = "KHR_lights_punctual";

/// The lights of the scene's nodes, in the scene's space; those that do not shine are left out. "range" is
/// a hint for other kinds of renderer and is not used.
pub(crate) fn read(
    document: &Document,
    stage: &Stage<'_>,
    normalisation: &Normalisation,
    problems: &mut Problems,
) -> Result<Vec<Punctual>, LoadError> {
    let list = match document.root().extension(NAME)? {
        Some(extension) => extension.items("lights")?,
        None => Vec::new(),
    };
    let mut lights = Vec::new();
    let whole = stage.tree.nodes.iter().enumerate().filter(|(_, node)| node.carries != Carries::Mesh);
    for (place, node) in whole {
        let Some(at) = node.at.extension(NAME)? else {
            continue;
        };
        let index = at.need("light")?.as_index("lights", list.len())?;
        let item = &list[index];
        let mut knots = Vec::new();
        for world in stage.worlds(place) {
            knots.push(stand(node, &world, normalisation)?);
        }
        let Some(kind) = kind(item, node, knots[0], normalisation, problems)? else {
            continue;
        };
        if knots.len() == 1 {
            knots.clear();
        }
        let name = if node.name.is_empty() { item.name() } else { node.name.clone() };
        lights.push(Punctual { name, kind, knots });
    }
    Ok(lights)
}

/// Where a light is and which way it shines.
fn stand(
    node: &Node<'_>,
    world: &DAffine3,
    normalisation: &Normalisation,
) -> Result<(Vec3, Vec3), LoadError> {
    let position = normalisation.point(world.translation);
    if !position.is_finite() {
        return Err(node.at.error("the light is too far away for the range of numbers"));
    }
    Ok((position, (world.matrix3 * DVec3::NEG_Z).normalize_or_zero().as_vec3()))
}

fn kind(
    item: &At<'_>,
    node: &Node<'_>,
    (position, direction): (Vec3, Vec3),
    normalisation: &Normalisation,
    problems: &mut Problems,
) -> Result<Option<PunctualKind>, LoadError> {
    let strength = item.number_from("intensity", 0.0)?.unwrap_or(1.0);
    let colour = item.numbers::<3>("color")?.unwrap_or([1.0; 3]);
    if colour.iter().any(|c| *c < 0.0) {
        return Err(item.error("\"color\" holds a negative number"));
    }
    let power = DVec3::from(colour) * strength;
    let scale = normalisation.scale();
    let finite = |value: DVec3| -> Result<Rgb, LoadError> {
        let rounded = value.as_vec3();
        if rounded.is_finite() {
            Ok(rounded)
        } else {
            Err(item.error("\"intensity\" exceeds the range of numbers"))
        }
    };
    let kind = match item.text("type")? {
        Some("point") => PunctualKind::Point { position, intensity: finite(power * scale * scale)? },
        Some("spot") => {
            let intensity = finite(power * scale * scale)?;
            let (inner_cos, outer_cos) = cone(item)?;
            PunctualKind::Spot { position, direction, intensity, inner_cos, outer_cos }
        }
        Some("directional") => PunctualKind::Directional { direction, irradiance: finite(power)? },
        Some(_) => return Err(item.error("\"type\" must be point, spot or directional")),
        None => return Err(item.error("\"type\" is missing")),
    };
    if direction == Vec3::ZERO && !matches!(kind, PunctualKind::Point { .. }) {
        problems.add(&node.at.pointer, "its transform leaves the light no direction: it is left out");
        return Ok(None);
    }
    if power == DVec3::ZERO {
        problems.add(&node.at.pointer, "its light does not shine: it is left out");
        return Ok(None);
    }
    Ok(Some(kind))
}

/// Cosines of a spot's inner and outer angle.
fn cone(item: &At<'_>) -> Result<(f32, f32), LoadError> {
    let spot = item.object("spot")?;
    let angle = |key: &str, default: f64| match &spot {
        Some(spot) => Ok(spot.number(key)?.unwrap_or(default)),
        None => Ok(default),
    };
    let inner = angle("innerConeAngle", 0.0)?;
    let outer = angle("outerConeAngle", std::f64::consts::FRAC_PI_4)?;
    // A hair of rounding beyond a right angle is what exporters write.
    if !(inner >= 0.0 && inner < outer && outer <= std::f64::consts::FRAC_PI_2 + 1e-4) {
        let at = spot.as_ref().unwrap_or(item);
        return Err(at.error(format!("the cone's angles {inner} and {outer} must rise between 0 and π/2")));
    }
    let inner_cos = libm::cos(inner) as f32;
    Ok((inner_cos, (libm::cos(outer).max(0.0) as f32).min(inner_cos.next_down())))
}

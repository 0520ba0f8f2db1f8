//! Which patches are too coarse for the light on them.

use crate::math::colour::{Rgb, luminance};
use crate::radiosity::element::Element;
use crate::radiosity::form_factor::Row;
use crate::radiosity::interpolate::Vertices;
use crate::radiosity::patch::{Patch, Patches};
use glam::DVec3;

/// A patch is fine enough where light varies by less than this share of itself.
const CONTRAST: f32 = 0.03;
/// Where it is darker than this share of the mean, by less than that share of the mean.
const DARK: f32 = 0.2;

/// The patches to cut, so that at most `most` are left: those whose light differs most between middle and corners, by
/// how much and on how large an area.
pub fn choose(
    patches: &Patches,
    rows: &[Row],
    arriving: &[DVec3],
    vertices: &Vertices,
    most: usize,
) -> Vec<bool> {
    let values = vertices.values(patches, arriving);
    let leaving = |e: usize, h: Rgb| luminance(rows[e].reflectance * h);
    let areas: Vec<f64> = patches.all().iter().map(Patch::area).collect();
    let (mut sum, mut whole) = (0.0, 0.0);
    for (e, h) in arriving.iter().enumerate() {
        let light = leaving(e, h.as_vec3());
        if light > 0.0 {
            sum += f64::from(light) * areas[e / 2];
            whole += areas[e / 2];
        }
    }
    let mean = if whole > 0.0 { (sum / whole) as f32 } else { 0.0 };
    let mut worst: Vec<(f64, usize)> = Vec::new();
    for (p, _) in patches.all().iter().enumerate().filter(|(_, patch)| patch.can_be_cut()) {
        let mut score = 0.0_f64;
        for e in [2 * p, 2 * p + 1] {
            let own = leaving(e, arriving[e].as_vec3());
            let corners = vertices.of(Element(e as u32)).map(|v| leaving(e, values[v as usize]));
            let step = corners.iter().fold(0.0_f32, |most, corner| most.max((corner - own).abs()));
            if step > CONTRAST * own.max(DARK * mean) {
                score = score.max(f64::from(step) * areas[p]);
            }
        }
        if score > 0.0 {
            worst.push((score, p));
        }
    }
    worst.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut chosen = vec![false; patches.all().len()];
    for (_, p) in worst.into_iter().take(most.saturating_sub(patches.all().len()) / 3) {
        chosen[p] = true;
    }
    chosen
}

//! How far apart two pictures are.

use super::exr::Layers;
use serde::Serialize;
use std::collections::BTreeMap;

/// Two pictures, layer by layer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// By layer; the picture is named `picture`.
    pub layers: BTreeMap<String, Difference>,
    /// The largest relative error of a layer.
    pub relative_error: f64,
}

/// How far one layer is apart.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// √(mean over pixels and channels of the squared difference).
    pub rms_error: f64,
    /// √(mean over pixels of `[Σ_c d² / 3]` / (Y² + 0.01 Ȳ²)), Y the second picture's 3×3 mean luminance.
    pub relative_error: f64,
    /// Mean of the first over mean of the second, over all channels; 1 where both are black.
    pub mean_ratio: f64,
}

/// Compares the layers that both pictures have, the second being the reference. Error layers are left out.
pub fn compare(a: &Layers, b: &Layers) -> Result<Comparison, String> {
    if (a.width, a.height) != (b.width, b.height) {
        return Err(format!(
            "the pictures have different sizes: {}x{} and {}x{}",
            a.width, a.height, b.width, b.height
        ));
    }
    let mut layers = BTreeMap::new();
    for name in b.channels.keys() {
        let is_error = |prefix: &str| prefix == "error." || prefix.ends_with(".error.");
        let Some(prefix) = name.strip_suffix('R').filter(|p| !is_error(p)) else { continue };
        if let (Some(x), Some(y)) = (triple(a, prefix), triple(b, prefix)) {
            let layer = if prefix.is_empty() { "picture" } else { prefix.trim_end_matches('.') };
            layers.insert(layer.to_owned(), difference(b.width, b.height, x, y));
        }
    }
    if layers.is_empty() {
        return Err("the pictures have no layer with channels R, G and B in common".to_owned());
    }
    let relative_error = layers.values().map(|d: &Difference| d.relative_error).fold(0.0, f64::max);
    Ok(Comparison { layers, relative_error })
}

fn triple<'a>(layers: &'a Layers, prefix: &str) -> Option<[&'a [f32]; 3]> {
    let channel = |c: &str| layers.channels.get(&format!("{prefix}{c}")).map(Vec::as_slice);
    Some([channel("R")?, channel("G")?, channel("B")?])
}

fn difference(width: usize, height: usize, a: [&[f32]; 3], b: [&[f32]; 3]) -> Difference {
    let pixels = width * height;
    let luminance: Vec<f64> = (0..pixels)
        .map(|i| 0.2126 * f64::from(b[0][i]) + 0.7152 * f64::from(b[1][i]) + 0.0722 * f64::from(b[2][i]))
        .collect();
    let mean = luminance.iter().sum::<f64>() / pixels as f64;
    let (mut square, mut relative, mut sum_a, mut sum_b) = (0.0, 0.0, 0.0, 0.0);
    for i in 0..pixels {
        let mut d = 0.0;
        for c in 0..3 {
            let (x, y) = (f64::from(a[c][i]), f64::from(b[c][i]));
            d += (x - y) * (x - y) / 3.0;
            sum_a += x;
            sum_b += y;
        }
        square += d;
        let local = super::error::window_mean(&luminance, width, height, i % width, i / width);
        let reference = local * local + super::error::EPSILON * mean * mean;
        if reference > 0.0 {
            relative += d / reference;
        } else if d > 0.0 {
            relative = f64::INFINITY;
        }
    }
    Difference {
        rms_error: (square / pixels as f64).sqrt(),
        relative_error: (relative / pixels as f64).sqrt(),
        mean_ratio: if sum_a - sum_b == 0.0 { 1.0 } else { sum_a / sum_b },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layers(value: f32) -> Layers {
        let channels = ["R", "G", "B"].map(|c| (c.to_owned(), vec![value; 12]));
        Layers { width: 4, height: 3, channels: channels.into(), ..Layers::default() }
    }

    #[test]
    fn layers_are_compared_one_by_one_and_their_errors_are_not() {
        let with = |value: f32| {
            let mut all = layers(1.0);
            for prefix in ["terror.", "b1.", "error.", "b1.error."] {
                let own = ["R", "G", "B"].map(|c| (format!("{prefix}{c}"), vec![value; 12]));
                all.channels.extend(own);
            }
            all
        };
        let c = compare(&with(3.0), &with(1.0)).unwrap();
        assert_eq!(c.layers.keys().collect::<Vec<_>>(), ["b1", "picture", "terror"]);
        assert_eq!((c.layers["picture"].relative_error, c.layers["b1"].mean_ratio), (0.0, 3.0));
        assert_eq!(c.relative_error, c.layers["terror"].relative_error);
    }

    #[test]
    fn a_constant_difference_is_measured_exactly() {
        let c = compare(&layers(1.1), &layers(1.0)).unwrap();
        let d = c.layers["picture"];
        assert!((d.rms_error - 0.1).abs() < 1e-6 && (d.mean_ratio - 1.1).abs() < 1e-6, "{d:?}");
        assert!((d.relative_error - 0.1 / 1.01_f64.sqrt()).abs() < 1e-6);
        let same = compare(&layers(0.0), &layers(0.0)).unwrap();
        assert_eq!(same.relative_error, 0.0);
    }
}

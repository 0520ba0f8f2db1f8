//! A picture that is much closer to the truth than those that are compared with it.

use super::{
    error::{EPSILON, window_mean},
    estimate::Picture,
    exr::Layers,
    size::Size,
    sum::Plane,
};

/// A reference, with the error that it has itself.
#[derive(Clone, Debug)]
pub struct Reference {
    size: Size,
    means: Plane,
    /// 1 / (Y² + ε Ȳ²) of each pixel; 0 where that is not finite.
    weights: Vec<f64>,
    /// Square of its own relative error.
    own: f64,
}

impl Reference {
    /// Of a plane and its standard errors; `None` in place of these where they are not known.
    pub fn new(size: Size, means: &[[f32; 3]], errors: Option<&[[f32; 3]]>) -> Self {
        let (width, height) = (size.width as usize, size.height as usize);
        assert_eq!(means.len(), width * height, "a picture has its size");
        let luminance: Vec<f64> = means.iter().map(luminance).collect();
        let mean = luminance.iter().sum::<f64>() / luminance.len() as f64;
        let weights: Vec<f64> = (0..means.len())
            .map(|i| {
                let local = window_mean(&luminance, width, height, i % width, i / width);
                Some(1.0 / (local * local + EPSILON * mean * mean)).filter(|w| w.is_finite()).unwrap_or(0.0)
            })
            .collect();
        let own = errors.map_or(0.0, |errors| mean_square(&weights, errors.iter().map(|e| e.map(f64::from))));
        Self { size, means: means.to_vec(), weights, own }
    }

    /// Of a rendered picture of a whole frame.
    pub fn of_picture(picture: &Picture) -> Self {
        Self::new(picture.size, &picture.planes[0], picture.errors.first().map(Vec::as_slice))
    }

    /// Of an EXR's picture. What it says of its own error is used.
    pub fn of_layers(layers: &Layers) -> Result<Self, String> {
        let means = plane(layers, "").ok_or("the reference has no channels R, G and B")?;
        let size = Size { width: layers.width as u32, height: layers.height as u32 };
        Ok(Self::new(size, &means, plane(layers, "error.").as_deref()))
    }

    /// Its size.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Its own relative error; 0 where it is not known.
    pub fn own_error(&self) -> f64 {
        self.own.sqrt()
    }

    /// Relative error of a picture of the same size: √(mean over pixels of `[Σ_c d² / 3]` / (Y² + ε Ȳ²) − own²), d the difference and Y
    /// the reference's 3×3 mean luminance. The difference has the errors of both, which are independent, so that the
    /// reference's is taken off; 0 where that leaves nothing.
    pub fn relative_error(&self, picture: &[[f32; 3]]) -> f64 {
        assert_eq!(picture.len(), self.means.len(), "pictures of one size");
        let differences = picture.iter().zip(&self.means);
        let squares = differences.map(|(a, b)| [0, 1, 2].map(|c| f64::from(a[c]) - f64::from(b[c])));
        (mean_square(&self.weights, squares) - self.own).max(0.0).sqrt()
    }
}

/// The three channels of a layer of an EXR.
pub fn plane(layers: &Layers, prefix: &str) -> Option<Plane> {
    let channel = |c: &str| layers.channels.get(&format!("{prefix}{c}"));
    let (r, g, b) = (channel("R")?, channel("G")?, channel("B")?);
    Some(r.iter().zip(g).zip(b).map(|((r, g), b)| [*r, *g, *b]).collect())
}

pub(super) fn luminance(pixel: &[f32; 3]) -> f64 {
    let [r, g, b] = pixel.map(f64::from);
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

fn mean_square(weights: &[f64], values: impl Iterator<Item = [f64; 3]>) -> f64 {
    let sum: f64 =
        weights.iter().zip(values).map(|(w, d)| w * d.iter().map(|d| d * d).sum::<f64>() / 3.0).sum();
    sum / weights.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reference_s_own_error_is_taken_off() {
        let size = Size { width: 4, height: 4 };
        let reference = Reference::new(size, &[[1.0; 3]; 16], Some(&[[0.03; 3]; 16]));
        assert!((reference.own_error() - 0.03 / 1.01_f64.sqrt()).abs() < 1e-8);
        // A difference of 0.05, of which 0.04 is the picture's.
        let error = reference.relative_error(&[[1.05; 3]; 16]);
        assert!((error - 0.04 / 1.01_f64.sqrt()).abs() < 1e-6, "{error}");
        assert_eq!(reference.relative_error(&[[1.01; 3]; 16]), 0.0);
    }

    #[test]
    fn without_an_error_of_its_own_it_says_what_a_comparison_says() {
        let picture =
            |shift: f32| -> Plane { (0..12).map(|i| [i as f32 + shift, 2.0, 0.5 * shift]).collect() };
        let layers = |plane: &Plane| Layers {
            width: 4,
            height: 3,
            channels: ["R", "G", "B"]
                .into_iter()
                .enumerate()
                .map(|(c, name)| (name.to_owned(), plane.iter().map(|p| p[c]).collect()))
                .collect(),
            ..Layers::default()
        };
        let (a, b) = (picture(0.25), picture(0.0));
        let expected = super::super::compare::compare(&layers(&a), &layers(&b)).unwrap().relative_error;
        let found = Reference::of_layers(&layers(&b)).unwrap().relative_error(&a);
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
    }
}

//! From linear light to a PNG for the screen.

use super::{
    size::{Region, Size},
    sum::Plane,
};
use crate::math::colour::linear_to_srgb;
use image::{ImageEncoder as _, codecs::png};

/// How a picture is developed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Develop {
    /// Stops: the light is multiplied by 2^exposure.
    pub exposure: f32,
    /// Columns of the PNG at most; a smaller picture is not enlarged.
    pub width: Option<u32>,
}

impl Develop {
    /// The size of the PNG of a picture: whole boxes of pixels become one.
    pub fn size(&self, of: Size) -> Size {
        let side = self.box_side(of.width);
        Size { width: of.width.div_ceil(side), height: of.height.div_ceil(side) }
    }

    /// Pixels along a box of those that become one.
    fn box_side(&self, width: u32) -> u32 {
        self.width.map_or(1, |most| width.div_ceil(most.max(1)))
    }
}

/// Develops a plane of `region`: exposure, clip, sRGB, 8 bits a channel. No tone curve: what is
/// above white is white.
pub fn png(region: Region, plane: &Plane, develop: &Develop) -> Vec<u8> {
    assert_eq!(plane.len(), region.pixels(), "a plane of another size than its region");
    let (Size { width, height }, plane) = shrink(region, plane, develop);
    let scale = libm::exp2f(develop.exposure);
    let encode = |v: f32| (linear_to_srgb((v * scale).clamp(0.0, 1.0)) * 255.0).round() as u8;
    let bytes: Vec<u8> = plane.iter().flatten().map(|v| encode(*v)).collect();
    let mut png = Vec::new();
    png::PngEncoder::new_with_quality(&mut png, png::CompressionType::Fast, png::FilterType::Adaptive)
        .write_image(&bytes, width, height, image::ExtendedColorType::Rgb8)
        .expect("writing a PNG to memory cannot fail");
    png
}

/// Averages whole boxes of pixels until the picture is at most as wide as asked for.
fn shrink(region: Region, plane: &Plane, develop: &Develop) -> (Size, Plane) {
    let box_side = develop.box_side(region.width);
    let to = develop.size(Size { width: region.width, height: region.height });
    let (w, h) = (to.width, to.height);
    if box_side == 1 {
        return (to, plane.clone());
    }
    let mean = |x: u32, y: u32| {
        let mut sum = [0.0_f64; 3];
        let mut n = 0.0;
        for v in y * box_side..((y + 1) * box_side).min(region.height) {
            for u in x * box_side..((x + 1) * box_side).min(region.width) {
                let pixel = plane[v as usize * region.width as usize + u as usize];
                (0..3).for_each(|c| sum[c] += f64::from(pixel[c]));
                n += 1.0;
            }
        }
        sum.map(|s| (s / n) as f32)
    };
    (to, (0..h).flat_map(|y| (0..w).map(move |x| (x, y))).map(|(x, y)| mean(x, y)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_is_developed_as_srgb_says() {
        let region = Region { x: 0, y: 0, width: 4, height: 2 };
        let plane = vec![[0.214_041_14, 1e9, 0.0]; 8];
        let bytes = png(region, &plane, &Develop { exposure: 0.0, width: Some(2) });
        let image = image::load_from_memory(&bytes).unwrap().to_rgb8();
        assert_eq!((image.width(), image.height()), (2, 1));
        assert_eq!(image.get_pixel(1, 0).0, [128, 255, 0]);
    }
}

//! Pictures and how they are looked up.

use crate::math::colour::srgb_to_linear;
use glam::{Vec2, Vec4};
use std::sync::{Arc, LazyLock};

/// Index of a texture of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TextureId(pub u32);

impl TextureId {
    /// As an index.
    #[inline]
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// A picture, row by row from the top, red, green, blue, alpha. Several textures may share one.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Pixels a row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// `width · height` pixels.
    pub texels: Texels,
}

/// Pixels as the file has them.
#[derive(Clone, Debug)]
pub enum Texels {
    /// Eight bits a channel.
    Bytes(Vec<[u8; 4]>),
    /// Sixteen bits a channel.
    Words(Vec<[u16; 4]>),
}

/// What the numbers of a picture's colour channels stand for; alpha is always linear.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Encoding {
    /// Themselves.
    Linear,
    /// sRGB (IEC 61966-2-1).
    Srgb,
}

/// What lies beyond a picture's edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Wrap {
    /// The picture again.
    Repeat,
    /// The picture in a mirror.
    Mirror,
    /// The pixels of the edge.
    Clamp,
}

/// How a value between pixels is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Filter {
    /// That of the pixel it falls into.
    Nearest,
    /// Mixed from four.
    Linear,
}

/// A picture and how it is looked up.
#[derive(Clone, Debug)]
pub struct Texture {
    /// The picture.
    pub picture: Arc<Picture>,
    /// What its numbers stand for.
    pub encoding: Encoding,
    /// Beyond its left and right, upper and lower edge.
    pub wrap: [Wrap; 2],
    /// Between its pixels.
    pub filter: Filter,
}

static SRGB_TABLE: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| srgb_to_linear(i as f32 / 255.0)));

impl Picture {
    /// Memory that the pixels take.
    pub fn bytes(&self) -> usize {
        match &self.texels {
            Texels::Bytes(texels) => size_of_val(texels.as_slice()),
            Texels::Words(texels) => size_of_val(texels.as_slice()),
        }
    }

    /// Whether alpha is 1 everywhere.
    pub fn is_opaque(&self) -> bool {
        match &self.texels {
            Texels::Bytes(texels) => texels.iter().all(|texel| texel[3] == u8::MAX),
            Texels::Words(texels) => texels.iter().all(|texel| texel[3] == u16::MAX),
        }
    }

    /// A texel, decoded.
    #[inline]
    pub(crate) fn texel(&self, encoding: Encoding, x: u32, y: u32) -> Vec4 {
        let index = y as usize * self.width as usize + x as usize;
        match (&self.texels, encoding) {
            (Texels::Bytes(texels), Encoding::Srgb) => {
                let [r, g, b, a] = texels[index];
                let table = &*SRGB_TABLE;
                Vec4::new(table[r as usize], table[g as usize], table[b as usize], f32::from(a) / 255.0)
            }
            (Texels::Bytes(texels), Encoding::Linear) => Vec4::from(texels[index].map(f32::from)) / 255.0,
            (Texels::Words(texels), Encoding::Linear) => Vec4::from(texels[index].map(f32::from)) / 65535.0,
            (Texels::Words(texels), Encoding::Srgb) => {
                let v = Vec4::from(texels[index].map(f32::from)) / 65535.0;
                Vec4::new(srgb_to_linear(v.x), srgb_to_linear(v.y), srgb_to_linear(v.z), v.w)
            }
        }
    }
}

impl Wrap {
    /// A coordinate brought near 0..1, so that no integer overflows.
    #[inline]
    fn reduce(self, coordinate: f32) -> f32 {
        match self {
            Self::Repeat => coordinate - coordinate.floor(),
            Self::Mirror => coordinate - 2.0 * (coordinate * 0.5).floor(),
            Self::Clamp => coordinate.clamp(-1.0, 2.0),
        }
    }

    /// The pixel at `index`, which may lie outside 0..size, but by no more than a reduced coordinate and its neighbours do.
    #[inline]
    fn pixel(self, index: i32, size: u32) -> u32 {
        let n = size as i32;
        match self {
            Self::Repeat => once_around(index, n) as u32,
            Self::Mirror => {
                let folded = once_around(index, 2 * n);
                folded.min(2 * n - 1 - folded) as u32
            }
            Self::Clamp => index.clamp(0, n - 1) as u32,
        }
    }
}

/// The remainder of an index in −n..2n by n, without a division.
#[inline]
fn once_around(index: i32, n: i32) -> i32 {
    let index = if index < 0 { index + n } else { index };
    if index < n { index } else { index - n }
}

impl Texture {
    /// The linear value at `uv`: (0, 0) is the upper left corner of the picture, (1, 1) the lower right.
    pub fn sample(&self, uv: Vec2) -> Vec4 {
        let picture = &*self.picture;
        let x = self.wrap[0].reduce(uv.x) * picture.width as f32;
        let y = self.wrap[1].reduce(uv.y) * picture.height as f32;
        match self.filter {
            Filter::Nearest => self.fetch(self.column(x.floor() as i32), self.row(y.floor() as i32)),
            Filter::Linear => {
                let (x, y) = (x - 0.5, y - 0.5);
                let (left, top) = (x.floor(), y.floor());
                let (right_share, low_share) = (x - left, y - top);
                let (left, top) = (left as i32, top as i32);
                let columns = [self.column(left), self.column(left + 1)];
                let rows = [self.row(top), self.row(top + 1)];
                // Written so that equal pixels give their own value, to the bit.
                let mix = |a: Vec4, b: Vec4, share: f32| a + (b - a) * share;
                let across = |y| mix(self.fetch(columns[0], y), self.fetch(columns[1], y), right_share);
                mix(across(rows[0]), across(rows[1]), low_share)
            }
        }
    }

    #[inline]
    fn column(&self, index: i32) -> u32 {
        self.wrap[0].pixel(index, self.picture.width)
    }

    #[inline]
    fn row(&self, index: i32) -> u32 {
        self.wrap[1].pixel(index, self.picture.height)
    }

    #[inline]
    fn fetch(&self, x: u32, y: u32) -> Vec4 {
        self.picture.texel(self.encoding, x, y)
    }

    /// The mean over all pixels: what the texture is worth when only its power counts.
    pub fn average(&self) -> Vec4 {
        let picture = &*self.picture;
        let mut sum = glam::DVec4::ZERO;
        for y in 0..picture.height {
            for x in 0..picture.width {
                sum += picture.texel(self.encoding, x, y).as_dvec4();
            }
        }
        (sum / (f64::from(picture.width) * f64::from(picture.height))).as_vec4()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(wrap: Wrap, filter: Filter, encoding: Encoding) -> Texture {
        let texels = [0, 100, 200, 255].map(|v| [v, v, v, v]).to_vec();
        let picture = Arc::new(Picture { width: 4, height: 1, texels: Texels::Bytes(texels) });
        Texture { picture, encoding, wrap: [wrap; 2], filter }
    }

    fn reds(texture: &Texture, us: &[f32]) -> Vec<i32> {
        us.iter().map(|&u| (texture.sample(Vec2::new(u, 0.5)).x * 255.0).round() as i32).collect()
    }

    #[test]
    fn wrap_modes_continue_beyond_the_edge_as_named() {
        let centres = [-0.625, -0.125, 0.125, 0.375, 0.625, 0.875, 1.125, 1.375, 2.125];
        for filter in [Filter::Nearest, Filter::Linear] {
            let got = |wrap| reds(&row(wrap, filter, Encoding::Linear), &centres);
            assert_eq!(got(Wrap::Repeat), [100, 255, 0, 100, 200, 255, 0, 100, 0], "{filter:?}");
            assert_eq!(got(Wrap::Mirror), [200, 0, 0, 100, 200, 255, 255, 200, 0], "{filter:?}");
            assert_eq!(got(Wrap::Clamp), [0, 0, 0, 100, 200, 255, 255, 255, 255], "{filter:?}");
        }
    }

    #[test]
    fn linear_filter_mixes_neighbours_across_the_seam() {
        let texture = row(Wrap::Repeat, Filter::Linear, Encoding::Linear);
        assert_eq!(reds(&texture, &[0.25, 0.5, 1.0, 0.0]), [50, 150, 128, 128]);
        assert_eq!(reds(&row(Wrap::Clamp, Filter::Linear, Encoding::Linear), &[0.0, 1.0]), [0, 255]);
    }

    #[test]
    fn srgb_is_decoded_before_mixing_and_alpha_never() {
        let value = row(Wrap::Repeat, Filter::Nearest, Encoding::Srgb).sample(Vec2::new(0.375, 0.0));
        assert!((value.x - 0.127_437_68).abs() < 1e-6 && (value.w - 100.0 / 255.0).abs() < 1e-6, "{value}");
        let mixed = row(Wrap::Repeat, Filter::Linear, Encoding::Srgb).sample(Vec2::new(0.25, 0.0)).x;
        assert!((mixed - 0.127_437_68 / 2.0).abs() < 1e-6);
    }

    #[test]
    fn sixteen_bits_are_kept() {
        let texels = Texels::Words(vec![[12345, 0, 65535, 32768]]);
        let picture = Arc::new(Picture { width: 1, height: 1, texels });
        let texture =
            Texture { picture, encoding: Encoding::Linear, wrap: [Wrap::Clamp; 2], filter: Filter::Linear };
        // A 65536th of a step of eight bits would be seen.
        assert!((texture.sample(Vec2::new(0.3, 0.9)).x - 12345.0 / 65535.0).abs() < 1e-7);
    }

    #[test]
    fn no_coordinate_panics() {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for u in [1e30, -1e30, f32::MAX, f32::NAN, f32::INFINITY, -1e-30, 1.0_f32.next_down()] {
                row(wrap, Filter::Linear, Encoding::Linear).sample(Vec2::new(u, -u));
                row(wrap, Filter::Nearest, Encoding::Linear).sample(Vec2::new(u, u));
            }
        }
    }

    #[test]
    fn average_is_the_mean_of_decoded_pixels() {
        let mean = row(Wrap::Clamp, Filter::Linear, Encoding::Linear).average().x;
        assert!((mean - 555.0 / 4.0 / 255.0).abs() < 1e-6);
    }
}

//! Pixels of a frame, and rectangles of them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// Width and height of a frame in pixels; both at least 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub struct Size {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Size {
    /// Longest side that is taken.
    pub const SIDE_MAX: u32 = 32_768;

    /// Number of pixels.
    pub fn pixels(self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// The whole frame.
    pub fn frame(self) -> Region {
        Region { x: 0, y: 0, width: self.width, height: self.height }
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("'{text}' is not a size: write WIDTHxHEIGHT, such as 1280x720");
        let (width, height) = text.split_once(['x', 'X']).ok_or_else(wrong)?;
        let size = Self {
            width: width.trim().parse().map_err(|_| wrong())?,
            height: height.trim().parse().map_err(|_| wrong())?,
        };
        if size.width == 0 || size.height == 0 || size.width.max(size.height) > Self::SIDE_MAX {
            return Err(format!("'{text}': each side is 1 to {} pixels", Self::SIDE_MAX));
        }
        Ok(size)
    }
}

/// A rectangle of pixels of a frame; row 0 is the top.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub struct Region {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Region {
    /// Number of pixels.
    pub fn pixels(self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Whether it is not empty and lies in a frame of `size`.
    pub fn is_in(self, size: Size) -> bool {
        let end = |start: u32, length: u32| start.checked_add(length).filter(|_| length > 0);
        end(self.x, self.width).is_some_and(|e| e <= size.width)
            && end(self.y, self.height).is_some_and(|e| e <= size.height)
    }

    /// Horizontal bands, top to bottom, of at most `pixels` pixels each (at least one row).
    pub fn bands(self, pixels: usize) -> Vec<Self> {
        let rows = (pixels / self.width.max(1) as usize).clamp(1, self.height.max(1) as usize) as u32;
        let count = self.height.div_ceil(rows);
        let rows = self.height.div_ceil(count.max(1)).max(1);
        (0..self.height)
            .step_by(rows as usize)
            .map(|y| Self { y: self.y + y, height: rows.min(self.height - y), ..self })
            .collect()
    }
}

impl fmt::Display for Region {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{},{},{}", self.x, self.y, self.width, self.height)
    }
}

impl FromStr for Region {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Option<Vec<u32>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
        match numbers.as_deref() {
            Some(&[x, y, width, height]) if width > 0 && height > 0 => Ok(Self { x, y, width, height }),
            _ => Err(format!(
                "'{text}' is not a region: write X,Y,WIDTH,HEIGHT in pixels, such as 0,0,640,360"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_cover_a_region_once() {
        let region = Region { x: 3, y: 5, width: 100, height: 37 };
        for pixels in [1, 100, 999, 1000, 3700, 10_000] {
            let bands = region.bands(pixels);
            let mut y = region.y;
            for band in &bands {
                assert_eq!((band.x, band.width, band.y), (region.x, region.width, y));
                assert!(band.pixels() <= pixels.max(100));
                y += band.height;
            }
            assert_eq!(y, region.y + region.height);
        }
    }

    #[test]
    fn text_that_is_no_size_is_refused() {
        for text in ["", "x", "640", "0x10", "-1x5", "1e3x4", "99999999x1", "640x480x3"] {
            assert!(text.parse::<Size>().is_err(), "{text}");
        }
        assert_eq!("640x480".parse(), Ok(Size { width: 640, height: 480 }));
    }
}

//! Light from infinitely far.

use crate::math::colour::{Rgb, luminance};
use crate::scene::distribution::Distribution;
use core::f32::consts::{FRAC_1_PI, PI, TAU};
use glam::{Vec2, Vec3};
use std::io::Cursor;

/// Most pixels of an environment image.
const PIXELS_MAX: u64 = 1 << 27;

/// A latitude-longitude image, or one radiance for all directions.
///
/// The image's middle is straight ahead of a camera that was not turned (−z), its left edge behind; its top is
/// up (+y).
#[derive(Clone, Debug)]
pub struct Environment {
    width: usize,
    height: usize,
    /// Radiance, W/(sr·m²), row by row from the top.
    texels: Vec<[f32; 3]>,
    distribution: Option<Distribution>,
    /// Turn around +y, radians over 2π.
    turn: f32,
    mean_luminance: f64,
}

/// Why bytes are no environment.
#[derive(Debug, thiserror::Error)]
pub enum EnvironmentError {
    /// Neither format could be read.
    #[error("the environment is neither a readable EXR nor a Radiance HDR image: {0}")]
    Unreadable(String),
    /// Too many pixels.
    #[error("the environment has {width}x{height} pixels; at most {PIXELS_MAX} are read")]
    TooLarge {
        /// Columns.
        width: u64,
        /// Rows.
        height: u64,
    },
}

impl Environment {
    /// One radiance for all directions.
    pub fn uniform(radiance: Rgb) -> Self {
        Self::new(1, 1, vec![radiance.to_array()], 0.0)
    }

    /// A plain sky for scenes without light: dark ground, a bright horizon, a blue zenith.
    pub fn default_sky() -> Self {
        let height = 64;
        let row = |y: usize| {
            let elevation = 1.0 - 2.0 * (y as f32 + 0.5) / height as f32;
            let (horizon, zenith, ground) =
                (Vec3::new(1.0, 1.0, 1.0), Vec3::new(0.45, 0.65, 1.0), Vec3::new(0.25, 0.23, 0.2));
            let colour = if elevation > 0.0 { horizon.lerp(zenith, elevation.sqrt()) } else { ground };
            [colour.to_array(); 2]
        };
        Self::new(2, height, (0..height).flat_map(row).collect(), 0.0)
    }

    /// An image of so many columns and rows of what `radiance` tells of unit directions.
    pub fn of(width: usize, height: usize, radiance: impl Fn(Vec3) -> Rgb) -> Self {
        let texel = |i: usize| {
            let (x, y) = (i % width, i / width);
            let (sin_latitude, cos_latitude) = libm::sincosf(PI * (y as f32 + 0.5) / height as f32);
            let (sin, cos) = libm::sincosf(TAU * ((x as f32 + 0.5) / width as f32 - 0.5));
            radiance(Vec3::new(sin_latitude * sin, cos_latitude, -sin_latitude * cos)).to_array()
        };
        Self::new(width, height, (0..width * height).map(texel).collect(), 0.0)
    }

    /// The largest radiance that a channel of it has.
    pub fn brightest(&self) -> f32 {
        self.texels.as_flattened().iter().copied().fold(0.0, f32::max)
    }

    /// From the bytes of an EXR or Radiance HDR image. Values that are not finite or are negative count as zero.
    pub fn decode(bytes: &[u8], turn_degrees: f64) -> Result<Self, EnvironmentError> {
        let unreadable = |e: image::ImageError| EnvironmentError::Unreadable(e.to_string());
        let reader = image::ImageReader::new(Cursor::new(bytes))
            .with_guessed_format()
            .map_err(|e| EnvironmentError::Unreadable(e.to_string()))?;
        let (width, height, texels) = if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
            let layers = crate::film::exr::read_layers(bytes)
                .map_err(|e| EnvironmentError::Unreadable(e.to_string()))?;
            check_size(layers.width as u64, layers.height as u64)?;
            let channel = |name: &str| {
                (layers.channels.get(name))
                    .ok_or_else(|| EnvironmentError::Unreadable(format!("it has no channel {name}")))
            };
            let (r, g, b) = (channel("R")?, channel("G")?, channel("B")?);
            let texels: Vec<[f32; 3]> = (0..r.len()).map(|i| [r[i], g[i], b[i]]).collect();
            (layers.width, layers.height, texels)
        } else {
            let (width, height) = reader.into_dimensions().map_err(unreadable)?;
            check_size(u64::from(width), u64::from(height))?;
            // Two bytes stand for a run of 127 at most.
            if u64::from(width) * u64::from(height) * 4 > 64 * bytes.len() as u64 {
                let reason = format!("{} bytes cannot hold the {width}x{height} pixels", bytes.len());
                return Err(EnvironmentError::Unreadable(reason));
            }
            let image = image::load_from_memory(bytes).map_err(unreadable)?.into_rgb32f();
            (width as usize, height as usize, image.pixels().map(|p| p.0).collect())
        };
        let clean = |v: f32| if v.is_finite() { v.max(0.0) } else { 0.0 };
        let texels: Vec<[f32; 3]> = texels.into_iter().map(|t: [f32; 3]| t.map(clean)).collect();
        Ok(Self::new(width, height, texels, turn_degrees))
    }

    fn new(width: usize, height: usize, texels: Vec<[f32; 3]>, turn_degrees: f64) -> Self {
        // Each texel's luminance times its solid angle, up to a factor.
        let weights: Vec<f64> = texels
            .iter()
            .enumerate()
            .map(|(i, t)| {
                let latitude = core::f64::consts::PI * ((i / width) as f64 + 0.5) / height as f64;
                f64::from(luminance(Vec3::from_array(*t)).max(0.0)) * libm::sin(latitude)
            })
            .collect();
        let solid_angles: f64 = (0..height)
            .map(|y| libm::sin(core::f64::consts::PI * (y as f64 + 0.5) / height as f64) * width as f64)
            .sum();
        let mean_luminance = weights.iter().sum::<f64>() / solid_angles;
        let distribution = if texels.len() > 1 { Distribution::new(width, height, &weights) } else { None };
        let turn = (turn_degrees / 360.0).rem_euclid(1.0) as f32;
        Self { width, height, texels, distribution, turn, mean_luminance }
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Mean luminance over all directions.
    pub fn mean_luminance(&self) -> f64 {
        self.mean_luminance
    }

    /// Radiance that comes from a unit direction, bilinear between texels.
    pub fn radiance(&self, direction: Vec3) -> Rgb {
        if self.texels.len() == 1 {
            return Vec3::from_array(self.texels[0]);
        }
        let p = self.place(direction);
        let (x, y) = (p.x * self.width as f32 - 0.5, p.y * self.height as f32 - 0.5);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let texel = |dx: i64, dy: i64| {
            let column = (x.floor() as i64 + dx).rem_euclid(self.width as i64) as usize;
            let row = (y.floor() as i64 + dy).clamp(0, self.height as i64 - 1) as usize;
            Vec3::from_array(self.texels[row * self.width + column])
        };
        let (top, bottom) = (texel(0, 0).lerp(texel(1, 0), fx), texel(0, 1).lerp(texel(1, 1), fx));
        top.lerp(bottom, fy)
    }

    /// A unit direction and its density over solid angle.
    pub fn sample(&self, u: Vec2) -> (Vec3, f32) {
        let Some(distribution) = &self.distribution else {
            return (crate::math::warp::sphere(u), 0.25 * FRAC_1_PI);
        };
        let (p, density) = distribution.sample(u);
        let (sin_latitude, cos_latitude) = libm::sincosf(PI * p.y);
        let (sin, cos) = libm::sincosf(TAU * (p.x - 0.5 - self.turn));
        let direction = Vec3::new(sin_latitude * sin, cos_latitude, -sin_latitude * cos);
        (direction, over_solid_angle(density, sin_latitude))
    }

    /// Density of [`Environment::sample`] over solid angle.
    pub fn pdf(&self, direction: Vec3) -> f32 {
        match &self.distribution {
            None => 0.25 * FRAC_1_PI,
            Some(distribution) => {
                let sin_latitude = direction.x.hypot(direction.z);
                over_solid_angle(distribution.density(self.place(direction)), sin_latitude)
            }
        }
    }

    /// Where in the unit square a direction lies.
    fn place(&self, d: Vec3) -> Vec2 {
        let longitude = libm::atan2f(d.x, -d.z) / TAU + 0.5 + self.turn;
        let latitude = libm::atan2f((d.x * d.x + d.z * d.z).sqrt(), d.y) * FRAC_1_PI;
        Vec2::new(longitude - longitude.floor(), latitude)
    }
}

fn over_solid_angle(density: f32, sin_latitude: f32) -> f32 {
    if sin_latitude > 0.0 { density / (2.0 * PI * PI * sin_latitude) } else { 0.0 }
}

fn check_size(width: u64, height: u64) -> Result<(), EnvironmentError> {
    if width.saturating_mul(height) > PIXELS_MAX || width == 0 || height == 0 {
        return Err(EnvironmentError::TooLarge { width, height });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::warp;

    fn spotted() -> Environment {
        let texels =
            (0..32 * 16).map(|i| [0.1 + (i * 37 % 101) as f32, 1.0, if i == 100 { 500.0 } else { 0.0 }]);
        Environment::new(32, 16, texels.collect(), 30.0)
    }

    #[test]
    fn sampling_agrees_with_its_density_and_integrates_the_radiance() {
        let environment = spotted();
        let n = 512;
        let grid = |i: u32| Vec2::new(((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32);
        let (mut by_density, mut uniform, mut mass) = (0.0_f64, 0.0_f64, 0.0_f64);
        for i in 0..n * n {
            let (direction, pdf) = environment.sample(grid(i));
            assert!((direction.length() - 1.0).abs() < 1e-5);
            // A direction on the border of two texels may fall to either.
            if (environment.pdf(direction) / pdf - 1.0).abs() < 1e-3 {
                mass += 1.0;
            }
            by_density += f64::from(environment.radiance(direction).x / pdf);
            let d = warp::sphere(grid(i));
            uniform += f64::from(environment.radiance(d).x) * 4.0 * core::f64::consts::PI;
        }
        let count = f64::from(n * n);
        assert!(mass / count > 0.995, "{}", mass / count);
        assert!((by_density / uniform - 1.0).abs() < 3e-3, "{by_density} {uniform}");
    }

    #[test]
    fn a_uniform_environment_is_the_same_everywhere() {
        let environment = Environment::uniform(Vec3::new(1.0, 2.0, 3.0));
        assert_eq!(environment.radiance(Vec3::Y), Vec3::new(1.0, 2.0, 3.0));
        assert!((environment.mean_luminance() - f64::from(luminance(Vec3::new(1.0, 2.0, 3.0)))).abs() < 1e-6);
    }
}

//! A small picture that stands for a larger one until there is one.

use super::{size::Size, sum::Plane};

/// A picture in few pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Sketch {
    size: Size,
    plane: Plane,
}

impl Sketch {
    /// Of a plane of so many pixels: linear radiance, rows from the top.
    pub fn new(size: Size, plane: Plane) -> Self {
        assert_eq!(plane.len(), size.pixels() as usize, "a plane of another size");
        Self { size, plane }
    }

    /// Its size in pixels.
    pub fn size(&self) -> Size {
        self.size
    }

    /// The picture in `to` pixels. Along an axis with more of them: its light at their centres, linear between those of its own
    /// pixels. Along one with fewer: the means over them.
    pub fn resized(&self, to: Size) -> Plane {
        let columns = shares(self.size.width, to.width);
        let rows = shares(self.size.height, to.height);
        let mut plane = Vec::with_capacity(columns.len() * rows.len());
        for row in &rows {
            for column in &columns {
                let mut sum = [0.0; 3];
                for (y, v) in row {
                    for (x, u) in column {
                        let pixel = self.plane[(y * self.size.width + x) as usize];
                        (0..3).for_each(|c| sum[c] += f64::from(pixel[c]) * u * v);
                    }
                }
                plane.push(sum.map(|light| light as f32));
            }
        }
        plane
    }
}

/// Which of `from` pixels each of `to` pixels in a row is made of, with weights whose sum is one.
fn shares(from: u32, to: u32) -> Vec<Vec<(u32, f64)>> {
    let (last, ratio) = (f64::from(from - 1), f64::from(from) / f64::from(to));
    let between = |x: u32| {
        let place = ((f64::from(x) + 0.5) * ratio - 0.5).clamp(0.0, last);
        let (first, part) = (place.floor(), place.fract());
        vec![(first as u32, 1.0 - part), ((first + 1.0).min(last) as u32, part)]
    };
    let over = |x: u32| {
        let (begin, end) = (f64::from(x) * ratio, f64::from(x + 1) * ratio);
        let covered = |i: u32| (f64::from(i + 1).min(end) - f64::from(i).max(begin)).max(0.0) / ratio;
        (begin as u32..(end.ceil() as u32).min(from)).map(|i| (i, covered(i))).collect()
    };
    (0..to).map(|x| if to < from { over(x) } else { between(x) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_stays_a_ramp_and_a_sketch_of_the_same_size_itself() {
        let ramp: Plane = (0..6).map(|i| [(i % 3) as f32, (i / 3) as f32, 1.0]).collect();
        let sketch = Sketch::new(Size { width: 3, height: 2 }, ramp.clone());
        assert_eq!(sketch.resized(Size { width: 3, height: 2 }), ramp);
        let large = sketch.resized(Size { width: 6, height: 4 });
        // Centres of the six columns lie at −¼, ¼, ¾ … of the three; outside of them the border goes on.
        let row: Vec<f32> = large[..6].iter().map(|p| p[0]).collect();
        assert_eq!(row, [0.0, 0.25, 0.75, 1.25, 1.75, 2.0]);
        let column: Vec<f32> = large.iter().step_by(6).map(|p| p[1]).collect();
        assert_eq!(column, [0.0, 0.25, 0.75, 1.0]);
        assert!(large.iter().all(|p| p[2] == 1.0));
    }

    #[test]
    fn one_pixel_fills_a_picture() {
        let sketch = Sketch::new(Size { width: 1, height: 1 }, vec![[2.0, 3.0, 4.0]]);
        assert_eq!(sketch.resized(Size { width: 2, height: 3 }), vec![[2.0, 3.0, 4.0]; 6]);
    }

    #[test]
    fn fewer_pixels_hold_the_means_of_more() {
        let sketch =
            Sketch::new(Size { width: 6, height: 1 }, (0..6).map(|i| [i as f32, 1.0, 0.0]).collect());
        assert_eq!(sketch.resized(Size { width: 2, height: 1 }), [[1.0, 1.0, 0.0], [4.0, 1.0, 0.0]]);
        // Boxes of a pixel and a half: (0 + 1/2)·2/3, (1/2 + 2)·2/3 …
        let four = sketch.resized(Size { width: 4, height: 3 });
        let row: Vec<f32> = four[..4].iter().map(|pixel| 3.0 * pixel[0]).collect();
        for (is, ought) in row.iter().zip([1.0, 5.0, 10.0, 14.0]) {
            assert!((is - ought).abs() < 1e-5, "{row:?}");
        }
        assert!(four.iter().all(|pixel| (pixel[1] - 1.0).abs() < 1e-6 && pixel[2] == 0.0));
    }
}

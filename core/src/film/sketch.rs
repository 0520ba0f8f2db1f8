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

    /// Its light at the centres of the pixels of a larger picture: linear between those of its own pixels.
    pub fn enlarged(&self, to: Size) -> Plane {
        let columns = between(self.size.width, to.width);
        let rows = between(self.size.height, to.height);
        let at = |x: u32, y: u32| self.plane[(y * self.size.width + x) as usize];
        let blend = |a: [f32; 3], b: [f32; 3], t: f32| [0, 1, 2].map(|c| a[c] + t * (b[c] - a[c]));
        let mut plane = Vec::with_capacity(columns.len() * rows.len());
        for ([top, bottom], v) in &rows {
            for ([left, right], u) in &columns {
                let above = blend(at(*left, *top), at(*right, *top), *u);
                plane.push(blend(above, blend(at(*left, *bottom), at(*right, *bottom), *u), *v));
            }
        }
        plane
    }
}

/// For each of `to` pixels in a row: which two of `from` pixels its centre lies between, and how far on the way to the second.
fn between(from: u32, to: u32) -> Vec<([u32; 2], f32)> {
    let last = f64::from(from - 1);
    let place = |x| ((f64::from(x) + 0.5) * f64::from(from) / f64::from(to) - 0.5).clamp(0.0, last);
    let pair = |x| {
        let place: f64 = place(x);
        let first = place.floor();
        ([first as u32, (first + 1.0).min(last) as u32], (place - first) as f32)
    };
    (0..to).map(pair).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_stays_a_ramp_and_a_sketch_of_the_same_size_itself() {
        let ramp: Plane = (0..6).map(|i| [(i % 3) as f32, (i / 3) as f32, 1.0]).collect();
        let sketch = Sketch::new(Size { width: 3, height: 2 }, ramp.clone());
        assert_eq!(sketch.enlarged(Size { width: 3, height: 2 }), ramp);
        let large = sketch.enlarged(Size { width: 6, height: 4 });
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
        assert_eq!(sketch.enlarged(Size { width: 2, height: 3 }), vec![[2.0, 3.0, 4.0]; 6]);
    }
}

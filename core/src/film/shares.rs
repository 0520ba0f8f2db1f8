//! Where in a picture the error is.

use super::{
    error::{EPSILON, window_mean},
    reference::luminance,
    size::Size,
};

/// Cells of the grid along each side.
pub const CELLS: usize = 8;

/// Share of the squared relative error in each cell of an 8×8 grid over the frame, rows from the top, from a plane and its standard
/// errors; `None` where there is no error.
pub fn shares(size: Size, means: &[[f32; 3]], errors: &[[f32; 3]]) -> Option<Vec<Vec<f64>>> {
    let (width, height) = (size.width as usize, size.height as usize);
    let luminance: Vec<f64> = means.iter().map(luminance).collect();
    let mean = luminance.iter().sum::<f64>() / luminance.len() as f64;
    let mut cells = vec![vec![0.0; CELLS]; CELLS];
    for (i, error) in errors.iter().enumerate() {
        let (x, y) = (i % width, i / width);
        let local = window_mean(&luminance, width, height, x, y);
        let floor = local * local + EPSILON * mean * mean;
        let square = error.iter().map(|e| f64::from(*e) * f64::from(*e)).sum::<f64>() / 3.0;
        if floor > 0.0 {
            cells[y * CELLS / height][x * CELLS / width] += square / floor;
        }
    }
    let sum: f64 = cells.iter().flatten().sum();
    cells.iter_mut().flatten().for_each(|cell| *cell /= sum);
    (sum > 0.0 && sum.is_finite()).then_some(cells)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_to_one_and_lie_where_the_error_is() {
        let size = Size { width: 16, height: 24 };
        let mut errors = vec![[0.0; 3]; 16 * 24];
        // Cells are 2×3 pixels: these are in column 7, row 2, and in column 0, row 7.
        errors[8 * 16 + 15] = [0.3; 3];
        errors[21 * 16] = [0.1; 3];
        let cells = shares(size, &[[1.0; 3]; 16 * 24], &errors).unwrap();
        assert!((cells[2][7] - 0.9).abs() < 1e-6 && (cells[7][0] - 0.1).abs() < 1e-6, "{cells:?}");
        assert!((cells.iter().flatten().sum::<f64>() - 1.0).abs() < 1e-12);
        assert_eq!(shares(size, &[[1.0; 3]; 16 * 24], &[[0.0; 3]; 16 * 24]), None);
    }
}

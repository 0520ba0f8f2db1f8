//! Makes the table, and holds it against the integral.

use super::*;
use crate::bsdf::tests::oracle::{alpha_of, passed, visible_mean};
use crate::bsdf::tests::rings::Rings;
use rayon::prelude::*;

/// Stands for a ratio of indices without end.
const GREATEST: f64 = 1e5;
/// Points at which interpolation is held below M, in a cell along planes, rows and columns.
const PARTS: [usize; 3] = [2, 2, 4];
/// By how much interpolation stays below M at least: more than what the integral errs by.
const LEAST: f64 = 2e-5;
/// Between two points it exceeds M by an eighth of the second difference, if that is everywhere the same.
const BETWEEN: f64 = 1.0 / 5.0;

/// E met from the side whose index is 1 of an interface with relative index `eta`, by the midpoint rule.
fn integrate(mu: f64, alpha: f64, eta: f64, n: usize) -> f64 {
    let [even] = visible_mean(mu, alpha, n, |dot, cos| {
        let up = passed(alpha, mu, 2.0 * dot * cos - mu);
        let squared = 1.0 - (1.0 - dot * dot) / (eta * eta);
        if squared <= 0.0 {
            return [up];
        }
        let root = squared.sqrt();
        let parallel = (eta * dot - root) / (eta * dot + root);
        let perpendicular = (dot - eta * root) / (dot + eta * root);
        let reflected = 0.5 * (parallel * parallel + perpendicular * perpendicular);
        let down = passed(alpha, mu, mu / eta - cos * (dot / eta - root));
        [reflected * up + (1.0 - reflected) * down]
    });
    even
}

/// The most that is taken off M for an index of 1.1 or more.
const MOST: f64 = 6e-3;
/// The same for the first two columns, where M is steep: μ < 0.02 α.
const MOST_FIRST: f64 = 0.02;
/// By what share means are above what they are at least.
const MEAN_LEAST: f64 = 2e-5;

/// α, η and the critical cosine at a place in planes and rows.
struct Surface {
    alpha: f64,
    ratio: f64,
    critical: f64,
}

impl Surface {
    fn at(plane: f64, row: f64) -> Self {
        let alpha = alpha_of(row / (ROWS - 1) as f64);
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let y: f64 = 0.5 * (low + high);
            let (gone, left) = (y * (1.0 - y + alpha), (1.0 - y) * (y + alpha));
            let place = 0.5 * (y + gone / (gone + left));
            *(if place * ((PLANES - 1) as f64) < plane { &mut low } else { &mut high }) = y;
        }
        let first = f64::from(FIRST);
        let squared = (first + (1.0 - first) * low).powi(2);
        let ratio = ((1.0 + squared) / (1.0 - squared)).min(GREATEST);
        Self { alpha, ratio, critical: ((ratio - 1.0) * (ratio + 1.0)).sqrt() / ratio }
    }

    /// The cosine at a place in the columns.
    fn cosine(&self, side: Side, column: f64) -> f64 {
        let (m, below) = if side == Side::Rare { (0.0, 0.0) } else { (self.critical, BELOW as f64) };
        let breadth = f64::from(BREADTH) * self.alpha;
        if column < below {
            // (1 − 2 w) a² − (m (1 − 2 w) + k) a + w m k = 0.
            let way = column * column / (below * below);
            let (square, line) = (1.0 - 2.0 * way, m * (1.0 - 2.0 * way) + breadth);
            let product = way * m * breadth;
            2.0 * product / (line + (line * line - 4.0 * square * product).max(0.0).sqrt())
        } else {
            let place = (column - below) / ((COLUMNS[side as usize] - 1) as f64 - below);
            let (way, rest) = (place * place, 1.0 - m);
            m + way * rest * breadth / (rest * (1.0 - way) + breadth)
        }
    }

    fn missing(&self, side: Side, mu: f64, rings: &Rings) -> f64 {
        let eta = if side == Side::Rare { self.ratio } else { 1.0 / self.ratio };
        1.0 - rings.albedo(mu, self.alpha, eta)
    }
}

/// Planes, rows and columns of one side.
fn shape(side: Side) -> [usize; 3] {
    [PLANES, ROWS, COLUMNS[side as usize]]
}

/// All points of one side.
fn grid(side: Side) -> [usize; 3] {
    let nodes = shape(side);
    [0, 1, 2].map(|axis| (nodes[axis] - 1) * PARTS[axis] + 1)
}

/// Index of a node or point of a shape.
fn flat(place: [usize; 3], shape: [usize; 3]) -> usize {
    (place[0] * shape[1] + place[1]) * shape[2] + place[2]
}

fn place(i: usize, shape: [usize; 3]) -> [usize; 3] {
    [i / shape[2] / shape[1], i / shape[2] % shape[1], i % shape[2]]
}

/// M at all points of one side.
fn points(side: Side) -> Vec<f64> {
    let rings = Rings::new(14);
    let [planes, rows, columns] = grid(side);
    let surface = |i: usize| {
        let at = |i: usize, axis: usize| i as f64 / PARTS[axis] as f64;
        let surface = Surface::at(at(i / rows, 0), at(i % rows, 1));
        let point = |column| surface.missing(side, surface.cosine(side, at(column, 2)), &rings);
        (0..columns).map(point).collect::<Vec<f64>>()
    };
    (0..planes * rows).into_par_iter().flat_map_iter(surface).collect()
}

/// What interpolation may reach at all points of one side.
fn bounds(points: &[f64], grid: [usize; 3]) -> Vec<f64> {
    let bound = |i: usize| {
        let here = place(i, grid);
        let bend = |axis: usize| {
            let step = grid[axis + 1..].iter().product::<usize>();
            let middle = here[axis].clamp(1, grid[axis] - 2);
            let i = i + middle * step - here[axis] * step;
            (points[i - step] - 2.0 * points[i] + points[i + step]).max(0.0)
        };
        (points[i] - LEAST - BETWEEN * (0..3).map(bend).sum::<f64>()).max(0.0)
    };
    (0..points.len()).into_par_iter().map(bound).collect()
}

/// The nodes of one side, as they are found.
struct Fit {
    shape: [usize; 3],
    grid: [usize; 3],
    nodes: Vec<f64>,
    /// Of interpolation at the points.
    bounds: Vec<f64>,
}

impl Fit {
    /// Nodes at their own bounds.
    fn new(side: Side) -> Self {
        let (shape, grid) = (shape(side), grid(side));
        let bounds = bounds(&points(side), grid);
        let own = |i: usize| {
            let node = place(i, shape);
            bounds[flat([0, 1, 2].map(|axis| node[axis] * PARTS[axis]), grid)]
        };
        let nodes = (0..shape.iter().product()).map(own).collect();
        Self { shape, grid, nodes, bounds }
    }

    /// Nodes around a point, and their weights.
    fn around(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + use<> {
        let (point, shape) = (place(i, self.grid), self.shape);
        (0..8).filter_map(move |corner: usize| {
            let (mut node, mut weight) = ([0; 3], 1.0);
            for axis in 0..3 {
                let (first, rest) = (point[axis] / PARTS[axis], point[axis] % PARTS[axis]);
                let share = rest as f64 / PARTS[axis] as f64;
                let above = corner >> axis & 1;
                node[axis] = first + above;
                weight *= if above == 1 { share } else { 1.0 - share };
            }
            (weight > 0.0).then(|| (flat(node, shape), weight))
        })
    }

    /// By how much interpolation at a point is above its bound.
    fn excess(&self, i: usize) -> f64 {
        self.around(i).map(|(node, weight)| weight * self.nodes[node]).sum::<f64>() - self.bounds[i]
    }

    /// Projects on what each point allows (Kaczmarz 1937), until all do.
    fn lower(&mut self) {
        for _ in 0..100 {
            let mut done = true;
            for i in 0..self.bounds.len() {
                let excess = self.excess(i);
                if excess > 1e-8 {
                    done = false;
                    let squared: f64 = self.around(i).map(|(_, weight)| weight * weight).sum();
                    for (node, weight) in self.around(i) {
                        self.nodes[node] = (self.nodes[node] - excess * weight / squared).max(0.0);
                    }
                }
            }
            if done {
                break;
            }
        }
    }

    /// Each node alone as far up as the points around it let it.
    fn raise(&mut self) {
        for i in 0..self.nodes.len() {
            self.nodes[i] += self.room(i).max(0.0);
        }
    }

    fn room(&self, i: usize) -> f64 {
        let node = place(i, self.shape);
        let range = |axis: usize| {
            let (middle, reach) = (node[axis] * PARTS[axis], PARTS[axis] - 1);
            middle.saturating_sub(reach)..=(middle + reach).min(self.grid[axis] - 1)
        };
        let mut least = f64::INFINITY;
        for plane in range(0) {
            for row in range(1) {
                for column in range(2) {
                    let point = flat([plane, row, column], self.grid);
                    let own = self.around(point).find(|(node, _)| *node == i);
                    least = own.map_or(least, |(_, weight)| least.min(-self.excess(point) / weight));
                }
            }
        }
        least
    }
}

/// Nodes of one side, as great as they can be.
fn nodes(side: Side) -> Vec<f64> {
    let mut fit = Fit::new(side);
    fit.lower();
    (0..4).for_each(|_| fit.raise());
    fit.nodes
}

/// 2 ∫ M μ dμ of interpolated nodes, over α² ln(1 + 1/α²), at a place in planes and rows.
fn mean(table: &[u16], side: Side, plane: f64, row: f64) -> f64 {
    let surface = Surface::at(plane, row);
    let (first, above) = ((plane as usize).min(PLANES - 2), (row as usize).min(ROWS - 2));
    let (along, across) = (plane - first as f64, row - above as f64);
    let node = |column: usize| {
        let at = |p: usize, r: usize| {
            let i = side as usize * PLANES * ROWS * COLUMNS[0];
            let i = i + flat([first + p, above + r, column], shape(side));
            f64::from(table[i]) * f64::from(UNIT)
        };
        let row = |p: usize| at(p, 0) + (at(p, 1) - at(p, 0)) * across;
        row(0) + (row(1) - row(0)) * along
    };
    let steps = 32;
    let mut sum = 0.0;
    for column in 0..COLUMNS[side as usize] - 1 {
        let (from, to) = (node(column), node(column + 1));
        let mut low = surface.cosine(side, column as f64);
        for step in 0..steps {
            let t = (f64::from(step) + 0.5) / f64::from(steps);
            let high = surface.cosine(side, column as f64 + (f64::from(step) + 1.0) / f64::from(steps));
            sum += (high * high - low * low) * (from + (to - from) * t);
            low = high;
        }
    }
    let squared = surface.alpha * surface.alpha;
    sum / (squared * libm::log(1.0 + 1.0 / squared))
}

/// The means of one side: more than interpolation between them errs by above what they are.
fn means(table: &[u16], side: Side) -> Vec<f32> {
    // Those of the nodes, and of points between them.
    let (planes, rows) = (2 * MEAN_PLANES - 1, 2 * MEAN_ROWS - 1);
    let exact = |i: usize| {
        let at = |place: usize, finer: usize| place as f64 / (2 * finer) as f64;
        mean(table, side, at(i / rows, FINER[0]), at(i % rows, FINER[1]))
    };
    let exact: Vec<f64> = (0..planes * rows).into_par_iter().map(exact).collect();
    let short = |plane: usize, row: usize| {
        let corners = [plane / 2, plane.div_ceil(2)]
            .map(|plane| [row / 2, row.div_ceil(2)].map(|row| exact[2 * plane * rows + 2 * row]));
        exact[plane * rows + row] / (0.25 * corners.as_flattened().iter().sum::<f64>())
    };
    let node = |i: usize| {
        let [plane, row] = [2 * (i / MEAN_ROWS), 2 * (i % MEAN_ROWS)];
        let mut factor: f64 = 1.0;
        for plane in plane.saturating_sub(1)..=(plane + 1).min(planes - 1) {
            for row in row.saturating_sub(1)..=(row + 1).min(rows - 1) {
                factor = factor.max(short(plane, row));
            }
        }
        (exact[plane * rows + row] * (1.0 + 1.2 * (factor - 1.0) + MEAN_LEAST)) as f32
    };
    (0..MEAN_PLANES * MEAN_ROWS).map(node).collect()
}

#[test]
#[ignore = "writes solid_albedo.bin"]
fn write() {
    let table = [Side::Rare, Side::Dense].map(nodes).concat();
    let table: Vec<u16> = table.into_iter().map(|m| (m * 65535.0) as u16).collect();
    let means = [Side::Rare, Side::Dense].map(|side| means(&table, side)).concat();
    let mut bytes: Vec<u8> = table.into_iter().flat_map(u16::to_le_bytes).collect();
    bytes.extend(means.into_iter().flat_map(f32::to_le_bytes));
    assert_eq!(bytes.len(), LENGTH);
    std::fs::write(concat!(env!("CARGO_MANIFEST_DIR"), "/src/bsdf/solid_albedo.bin"), bytes).unwrap();
}

/// Places spread evenly over a table (Roberts's R₃), on alternate sides.
fn places(count: usize) -> impl IndexedParallelIterator<Item = (Side, [f64; 3])> {
    const STEP: [f64; 3] = [0.819_172_513_396_164, 0.671_043_606_703_789, 0.549_700_477_901_947];
    (0..count).into_par_iter().map(|i| {
        let side = if i % 2 == 0 { Side::Rare } else { Side::Dense };
        let at = |axis: usize| (0.5 + i as f64 * STEP[axis]).fract() * (shape(side)[axis] - 1) as f64;
        (side, [0, 1, 2].map(at))
    })
}

/// M of the table.
fn looked_up(surface: &Surface, side: Side, mu: f64) -> f64 {
    f64::from(Cell::of(surface.alpha as f32, surface.ratio as f32).missing(side, mu as f32))
}

/// The most that may be taken off M.
fn most(surface: &Surface, column: f64) -> f64 {
    if surface.ratio < 1.1 {
        1.0
    } else if column < 2.0 {
        MOST_FIRST
    } else {
        MOST
    }
}

/// Whether glass is rough there (see `glass`).
fn is_rough(surface: &Surface) -> bool {
    surface.alpha * (surface.ratio - 1.0) > 1e-5
}

#[test]
fn both_rules_find_the_same_integral() {
    let rings = Rings::new(16);
    places(60).for_each(|(side, [plane, row, column])| {
        let surface = Surface::at(plane, row);
        let mu = surface.cosine(side, column);
        let eta = if side == Side::Rare { surface.ratio } else { 1.0 / surface.ratio };
        let (a, b) = (rings.albedo(mu, surface.alpha, eta), integrate(mu, surface.alpha, eta, 1000));
        assert!((a - b).abs() < 3e-5, "{a} {b}: {side:?} α {} μ {mu} η {eta}", surface.alpha);
    });
}

#[test]
fn the_table_is_the_integral_less_a_margin() {
    let rings = Rings::new(24);
    for side in [Side::Rare, Side::Dense] {
        let (shape, first) = (shape(side), side as usize * PLANES * ROWS * COLUMNS[0]);
        (0..shape.iter().product()).into_par_iter().step_by(23).for_each(|i| {
            let [plane, row, column] = place(i, shape).map(|at| at as f64);
            let surface = Surface::at(plane, row);
            let exact = surface.missing(side, surface.cosine(side, column), &rings);
            let taken = exact - f64::from(u16::from_le_bytes(TABLE[first + i])) / 65535.0;
            let most = most(&surface, column);
            let what = format!("{side:?} α {} η {} column {column}", surface.alpha, surface.ratio);
            assert!((-1e-6..most).contains(&taken), "{taken} taken of {exact}: {what}");
        });
    }
}

#[test]
fn interpolation_never_exceeds_the_integral() {
    let rings = Rings::new(24);
    places(30_000).for_each(|(side, [plane, row, column])| {
        let surface = Surface::at(plane, row);
        if !is_rough(&surface) {
            return;
        }
        let mu = surface.cosine(side, column);
        let excess = looked_up(&surface, side, mu) - surface.missing(side, mu, &rings);
        // From the rare side M begins at nothing and with no slope. No light comes from there: μ < 1.8e-4 α.
        let allowed = if column < 0.2 {
            6e-3
        } else if surface.ratio < 1.0001 {
            4e-4
        } else {
            0.0
        };
        let least = -most(&surface, column);
        let what = format!("{side:?} α {} μ {mu} η {}", surface.alpha, surface.ratio);
        assert!((least..allowed).contains(&excess), "{excess} too much: {what}");
    });
}

#[test]
fn less_than_a_thousandth_of_uniform_light_is_lost() {
    let rings = Rings::new(12);
    let ratios = [1.0001, 1.001, 1.01, 1.03, 1.1, 1.2, 1.33, 1.5, 1.8, 2.4, 3.0, 5.0, 10.0, 100.0, 1e4];
    for alpha in [2e-3, 0.01, 0.04, 0.07, 0.12, 0.25, 0.4, 0.64, 0.85, 1.0] {
        ratios.into_par_iter().filter(|ratio| alpha * (ratio - 1.0) > 1e-5).for_each(|ratio: f64| {
            let critical = ((ratio - 1.0) * (ratio + 1.0)).sqrt() / ratio;
            let surface = Surface { alpha, ratio, critical };
            for side in [Side::Rare, Side::Dense] {
                let lost = (0..120).map(|i| {
                    let root = (f64::from(i) + 0.5) / 120.0;
                    let mu = root * root;
                    let lost = surface.missing(side, mu, &rings) - looked_up(&surface, side, mu);
                    lost * 4.0 * mu * root / 120.0
                });
                let lost: f64 = lost.sum();
                assert!((0.0..1e-3).contains(&lost), "{lost} lost: {side:?} α {alpha} η {ratio}");
            }
        });
    }
}

#[test]
fn means_are_those_of_the_interpolated_table_or_more() {
    let table: Vec<u16> = TABLE.iter().map(|node| u16::from_le_bytes(*node)).collect();
    places(2000).for_each(|(side, [plane, row, _])| {
        let surface = Surface::at(plane, row);
        let alpha = surface.alpha as f32;
        let ell = libm::log1pf(1.0 / (alpha * alpha));
        let got = Cell::of(alpha, surface.ratio as f32).mean(side, ell);
        let scale = f64::from(alpha * alpha * ell);
        let share = f64::from(got) / (scale * mean(&table, side, plane, row));
        // Where little is missing, more is lost of it.
        let most = if alpha < 0.05 { 1.1 } else { 1.006 };
        let what = format!("{side:?} α {alpha} η {}", surface.ratio);
        assert!((1.0 - 1e-5..most).contains(&share), "{share} times the mean: {what}");
    });
}

//! Polynomials fitted to the neighbours of a point by least squares, over windows of several sizes at once: pure
//! mathematics.

use std::collections::HashMap;

use crate::flux::photometric;
use crate::gather::gates::Step;

/// Radius of the widest window, in cells.
pub const WIDEST: f32 = 10.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Degree {
    Linear,
    Quadratic,
}

/// A window over the neighbours of a point.
pub(super) struct Window {
    pub(super) degree: Degree,
    /// The kernel is 1 − sharpness · d².
    pub(super) sharpness: f64,
    /// Columns and rows to each side.
    pub(super) half: [usize; 2],
    /// Offsets within it.
    pub(super) count: usize,
    /// Where nothing is in its way: what each cell counts, row by row, and Σ of their squares.
    pub(super) weights: Vec<f64>,
    pub(super) squares: f64,
}

pub(super) struct Offset {
    pub(super) step: [i32; 2],
    /// In cells.
    pub(super) distance: f32,
    /// The offset one step nearer to the middle, and the step from there.
    pub(super) before: usize,
    pub(super) onward: Step,
    /// 1, x, y, x², xy, y², x³ … y⁴ times 1, d² and d⁴, in widest windows.
    pub(super) monomials: [[f64; MONOMIALS]; 3],
}

impl Offset {
    /// What the value there counts in a window's fit, `row` being that of [`FitSums::row`].
    pub(super) fn weight(&self, window: &Window, row: &[f64; TERMS]) -> f64 {
        let terms = &self.monomials[0][..TERMS];
        let distance_squared = self.monomials[1][0];
        let plane: f64 = terms.iter().zip(row).map(|(term, part)| term * part).sum();
        (1.0 - window.sharpness * distance_squared) * plane
    }
}

/// Monomials of x and y up to the fourth degree.
pub(super) const MONOMIALS: usize = 15;

/// Terms of the polynomials fitted: 1, x, y, x², xy, y². The first monomials are the same.
pub(super) const TERMS: usize = 6;

/// The fit of one window at a point.
#[derive(Clone, Copy)]
pub(super) struct Fit<const C: usize> {
    /// lx.
    pub(super) value: [f32; C],
    /// Variance for noise of variance 1.
    pub(super) squares: f32,
    /// What the point itself counts.
    pub(super) own: f32,
}

impl<const C: usize> Fit<C> {
    pub(super) const NONE: Self = Self { value: [0.0; C], squares: 0.0, own: 0.0 };

    pub(super) fn photometric(&self) -> f64 {
        photometric(self.value.map(f64::from))
    }
}

impl Window {
    pub(super) fn new(degree: Degree, radius: f32, offsets: &[Offset]) -> Self {
        let count = offsets.partition_point(|offset| offset.distance <= radius);
        let offsets = &offsets[..count];
        let sharpness = f64::from((WIDEST + 0.5) / (radius + 0.5)).powi(2);
        let most = |axis: usize| offsets.iter().map(|offset| offset.step[axis].unsigned_abs() as usize).max();
        let half = [0, 1].map(|axis| most(axis).unwrap_or(0));
        let mut window = Self { degree, sharpness, half, count, weights: Vec::new(), squares: 0.0 };
        let mut sums = FitSums::<1>::new();
        offsets.iter().for_each(|offset| sums.add(offset, &[0.0]));
        let row = sums.row(&window);
        let width = 2 * half[0] + 1;
        window.weights = vec![0.0; width * (2 * half[1] + 1)];
        for offset in offsets {
            let [column, line] = [0, 1].map(|axis| (offset.step[axis] + half[axis] as i32) as usize);
            window.weights[line * width + column] = offset.weight(&window, &row);
        }
        window.squares = window.weights.iter().map(|weight| weight * weight).sum();
        window
    }
}

/// Sums over the neighbours seen, from which the fit under every kernel of the kind 1 − s·d² follows.
pub(super) struct FitSums<const C: usize> {
    /// Of the monomials, times 1, d² and d⁴.
    pub(super) moments: [[f64; MONOMIALS]; 3],
    /// Of values times terms, times 1 and d².
    pub(super) values: [[[f64; TERMS]; 2]; C],
}

impl<const C: usize> FitSums<C> {
    pub(super) fn new() -> Self {
        Self { moments: [[0.0; MONOMIALS]; 3], values: [[[0.0; TERMS]; 2]; C] }
    }

    #[inline(always)]
    pub(super) fn add(&mut self, offset: &Offset, value: &[f64; C]) {
        for (sums, monomials) in self.moments.iter_mut().zip(&offset.monomials) {
            sums.iter_mut().zip(monomials).for_each(|(sum, monomial)| *sum += monomial);
        }
        for (sums, value) in self.values.iter_mut().zip(value) {
            for (sums, monomials) in sums.iter_mut().zip(&offset.monomials) {
                sums.iter_mut().zip(monomials).for_each(|(sum, monomial)| *sum += monomial * value);
            }
        }
    }

    /// Coefficients of the value at the middle of the polynomial fitted by least squares; of a lower degree where the
    /// neighbours don't determine the one wanted.
    pub(super) fn row(&self, window: &Window) -> [f64; TERMS] {
        let [plain, square, _] = &self.moments;
        let kernel: [f64; MONOMIALS] = std::array::from_fn(|i| plain[i] - window.sharpness * square[i]);
        let normal = matrix(&kernel);
        let degrees: &[usize] = if window.degree == Degree::Quadratic { &[6, 3, 1] } else { &[3, 1] };
        degrees.iter().find_map(|&size| first_row_of_inverse(&normal, size)).unwrap_or_default()
    }

    pub(super) fn fit(&self, window: &Window) -> Fit<C> {
        let row = self.row(window);
        let sharpness = window.sharpness;
        let [plain, square, fourth] = &self.moments;
        let kernel_squared: [f64; MONOMIALS] =
            std::array::from_fn(|i| plain[i] - 2.0 * sharpness * square[i] + sharpness * sharpness * fourth[i]);
        let spread = matrix(&kernel_squared);
        let squares: f64 = (0..TERMS).map(|i| (0..TERMS).map(|j| row[i] * spread[i][j] * row[j]).sum::<f64>()).sum();
        let value = self
            .values
            .map(|[plain, square]| (0..TERMS).map(|i| row[i] * (plain[i] - sharpness * square[i])).sum::<f64>() as f32);
        Fit { value, squares: squares.max(0.0) as f32, own: row[0] as f32 }
    }
}

/// Σ weight · row over some rows of numbers as long as `sum`.
pub(super) fn add_up(weights: &[(usize, f32)], rows: &[f32], sum: &mut [f32]) {
    let width = sum.len();
    let (wide, rest) = sum.as_chunks_mut::<16>();
    let narrow_from = 16 * wide.len();
    for (chunk, sum) in wide.iter_mut().enumerate() {
        *sum = column_sums(weights, rows, width, 16 * chunk);
    }
    for (chunk, sum) in rest.as_chunks_mut::<4>().0.iter_mut().enumerate() {
        *sum = column_sums(weights, rows, width, narrow_from + 4 * chunk);
    }
}

/// N of these sums, from column `first` on; a few rows at a time, so that rounding does not grow with their number.
pub(super) fn column_sums<const N: usize>(
    weights: &[(usize, f32)],
    rows: &[f32],
    width: usize,
    first: usize,
) -> [f32; N] {
    let mut sum = [0.0; N];
    for few in weights.chunks(16) {
        let mut part = [0.0; N];
        for &(row, weight) in few {
            let from = row * width + first;
            if let Some(numbers) = rows[from..].first_chunk::<N>() {
                (0..N).for_each(|i| part[i] += weight * numbers[i]);
            }
        }
        (0..N).for_each(|i| sum[i] += part[i]);
    }
    sum
}

/// Exponents of x and y in the monomials, by degree.
pub(super) const EXPONENTS: [[usize; 2]; MONOMIALS] = [
    [0, 0],
    [1, 0],
    [0, 1],
    [2, 0],
    [1, 1],
    [0, 2],
    [3, 0],
    [2, 1],
    [1, 2],
    [0, 3],
    [4, 0],
    [3, 1],
    [2, 2],
    [1, 3],
    [0, 4],
];

/// Σ of products of every two terms, out of the sums of monomials.
pub(super) fn matrix(sums: &[f64; MONOMIALS]) -> [[f64; TERMS]; TERMS] {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let [x, y] = [0, 1].map(|axis| EXPONENTS[i][axis] + EXPONENTS[j][axis]);
            let degree = x + y;
            sums[degree * (degree + 1) / 2 + y]
        })
    })
}

/// Offsets within the widest window of a grid whose cells have these sides, in units of the longer; nearest first.
pub(super) fn offsets(cell: [f32; 2]) -> Vec<Offset> {
    let reach = WIDEST;
    let most = cell.map(|side| (reach / side) as i32);
    let mut offsets: Vec<Offset> = (-most[1]..=most[1])
        .flat_map(|row| (-most[0]..=most[0]).map(move |column| [column, row]))
        .map(|step| {
            let [x, y] = [0, 1].map(|axis| f64::from(step[axis]) * f64::from(cell[axis]));
            let scale = 1.0 / f64::from(WIDEST + 0.5);
            let square = (x * x + y * y) * scale * scale;
            let plain = EXPONENTS.map(|[i, j]| (x * scale).powi(i as i32) * (y * scale).powi(j as i32));
            let monomials = [1.0, square, square * square].map(|factor| plain.map(|monomial| monomial * factor));
            Offset { step, distance: x.hypot(y) as f32, before: 0, onward: Step::new(0, 0), monomials }
        })
        .filter(|offset| offset.distance <= reach)
        .collect();
    offsets.sort_by(|a, b| a.distance.total_cmp(&b.distance).then(a.step.cmp(&b.step)));
    let index_of: HashMap<[i32; 2], usize> =
        offsets.iter().enumerate().map(|(index, offset)| (offset.step, index)).collect();
    for offset in &mut offsets[1..] {
        let [column, row] = offset.step;
        let steps = column.abs().max(row.abs());
        let nearer = |part: i32| (f64::from(part) * f64::from(steps - 1) / f64::from(steps)).round() as i32;
        let before = [nearer(column), nearer(row)];
        offset.before = index_of[&before];
        offset.onward = Step::new(column - before[0], row - before[1]);
    }
    offsets
}

/// A pivot below this part of its diagonal element makes a matrix nearly singular: the neighbours do not determine the
/// polynomial.
const SINGULAR: f64 = 1e-4;

/// First row of the inverse of the leading `size` × `size` part of a symmetric positive matrix, by Cholesky's
/// decomposition; `None` where it is nearly singular.
pub(super) fn first_row_of_inverse(matrix: &[[f64; 6]; 6], size: usize) -> Option<[f64; 6]> {
    let mut lower = [[0.0; 6]; 6];
    for row in 0..size {
        for column in 0..=row {
            let sum: f64 = (0..column).map(|k| lower[row][k] * lower[column][k]).sum();
            let rest = matrix[column][row] - sum;
            if row == column {
                if rest <= SINGULAR * matrix[row][row] {
                    return None;
                }
                lower[row][row] = rest.sqrt();
            } else {
                lower[row][column] = rest / lower[column][column];
            }
        }
    }
    let mut found = [0.0; 6];
    for row in 0..size {
        let known: f64 = (0..row).map(|k| lower[row][k] * found[k]).sum();
        found[row] = (f64::from(u8::from(row == 0)) - known) / lower[row][row];
    }
    for row in (0..size).rev() {
        let known: f64 = (row + 1..size).map(|k| lower[k][row] * found[k]).sum();
        found[row] = (found[row] - known) / lower[row][row];
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gather::smooth::WINDOWS;

    /// Weighted sums of values at a window's offsets, as a fit sees them.
    fn fitted(degree: Degree, radius: f32, keep: impl Fn(f64, f64) -> bool, value: impl Fn(f64, f64) -> f64) -> f64 {
        let offsets = offsets([1.0, 1.0]);
        let window = Window::new(degree, radius, &offsets);
        let mut sums = FitSums::<1>::new();
        for offset in &offsets[..window.count] {
            let [x, y] = offset.step.map(f64::from);
            if keep(x, y) {
                sums.add(offset, &[value(x, y)]);
            }
        }
        sums.fit(&window).photometric()
    }

    /// A plane is its own linear fit and a quadric its own quadratic fit, beside a wall and in a corner too.
    #[test]
    fn polynomials_are_reproduced() {
        let quadric = |x: f64, y: f64| 100.0 + 3.0 * x - 2.0 * y + 0.2 * x * x - 0.3 * x * y + 0.1 * y * y;
        let plane = |x: f64, y: f64| 100.0 + 3.0 * x - 2.0 * y;
        let sides: [fn(f64, f64) -> bool; 3] = [|_, _| true, |x, _| x > -2.0, |x, y| x > -1.0 && y < 2.0];
        for keep in sides {
            for radius in [2.5, 4.0, 10.0] {
                let found = fitted(Degree::Linear, radius, keep, plane);
                assert!((found - 100.0).abs() < 1e-4, "linear, {radius}: {found}");
            }
            for radius in [5.0, 7.0, 10.0] {
                let found = fitted(Degree::Quadratic, radius, keep, quadric);
                assert!((found - 100.0).abs() < 1e-4, "quadratic, {radius}: {found}");
            }
        }
    }

    /// Where only a row of neighbours is seen no plane can be fitted, and the mean stands in: finite, and right where
    /// light is even.
    #[test]
    fn a_row_of_neighbours_is_enough() {
        for degree in [Degree::Linear, Degree::Quadratic] {
            let found = fitted(degree, 10.0, |_, y| y == 0.0, |_, _| 42.0);
            assert!((found - 42.0).abs() < 1e-4, "{found}");
            let alone = fitted(degree, 10.0, |x, y| x == 0.0 && y == 0.0, |_, _| 42.0);
            assert!((alone - 42.0).abs() < 1e-4, "{alone}");
        }
    }

    /// Of noise of variance 1 a fit has the variance Σ weight², whether summed by weights or by moments.
    #[test]
    fn both_ways_to_sum_agree() {
        let offsets = offsets([1.0, 0.7]);
        for (degree, radius) in WINDOWS {
            let window = Window::new(degree, radius, &offsets);
            let mut sums = FitSums::<1>::new();
            offsets[..window.count].iter().for_each(|offset| sums.add(offset, &[1.0]));
            let fit = sums.fit(&window);
            assert!((f64::from(fit.squares) / window.squares - 1.0).abs() < 1e-4, "{degree:?}, {radius}");
            assert!((fit.photometric() - 1.0).abs() < 1e-5);
            let own = window.weights[window.weights.len() / 2];
            assert!((f64::from(fit.own) - own).abs() < 1e-6);
        }
    }
}

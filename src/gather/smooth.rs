//! Smoothing of a map of noisy estimates, as far as their noise allows and no farther than the point sees.
//!
//! Every grid point is refitted by a polynomial through its neighbours (local-linear and local-quadratic regression)
//! over windows of several sizes. Which of them is best about a point is decided by the data: Stein's unbiased estimate
//! of the risk (Stein 1981; Li, Wu & Chuang 2012 for rendered images) estimates the squared error, noise and smoothing
//! bias together, of each window without knowing the truth. So smooth light is averaged over a wide window, and a
//! shadow's edge over a narrow one. Neighbours that the point does not see in its plane (the other side of a partition)
//! never count.

pub mod counts;
mod fit;
mod samples;

use rayon::prelude::*;

use self::fit::{Degree, Fit, FitSums, Offset, Window, add_up, offsets};
use super::density::Estimate;
use super::gates::Gates;
use super::receiver::Receiver;
use crate::embree::RayCaster;
use crate::flux::photometric;
pub use fit::WIDEST;
pub use samples::{MAP_BATCHES, POINT_BATCHES, Samples, Together, few, mean_of};

/// Cells to each side over which noise is pooled, and risk.
const POOL: usize = 4;
const RISK_POOL: usize = 10;
const BIAS_POOL: usize = 16;

/// Points with something within this many cells choose their windows among themselves.
const BESIDE: usize = 2;

/// A window's bias is estimated against one whose variance is at least this many times as large.
const YARDSTICK: f32 = 3.0;

/// Sides of the blocks over which all points' common noise is taken, in cells.
const BLOCK: usize = 16;

/// The windows: degree of the polynomial fitted, and radius in cells.
const WINDOWS: [(Degree, f32); 9] = [
    (Degree::Linear, 0.0),
    (Degree::Linear, 1.5),
    (Degree::Linear, 2.5),
    (Degree::Linear, 4.0),
    (Degree::Quadratic, 5.0),
    (Degree::Linear, 6.0),
    (Degree::Quadratic, 7.0),
    (Degree::Linear, 10.0),
    (Degree::Quadratic, 10.0),
];

/// Cells narrower than this part of their length count as if they were so wide: their windows stay as many cells wide.
const NARROWEST: f32 = 0.25;

/// How far, in cells, others influence a cell: the widest window, and the pooling of its bias.
pub const REACH: usize = WIDEST as usize + BIAS_POOL;

/// Squared bias of the window chosen, at least, as a share of its variance. At the radius of least risk it is 1/2 for a
/// plane and 1/4 for a quadric (bias of order h² and h⁴, variance h⁻²); that the risk by which windows are chosen is
/// itself noisy costs some, too. In even light, where there is no bias, claims are √1.5 of the errors.
const BIAS_AT_LEAST_RISK: f64 = 0.5;

/// What smoothing needs of a grid: its windows, and what stands in the way.
pub struct Smoother {
    columns: usize,
    rows: usize,
    gates: Gates,
    windows: Vec<Window>,
    /// Offsets of the widest window, nearest first.
    offsets: Vec<Offset>,
    /// Whether something stands within [`BESIDE`] cells of a point.
    beside: Vec<bool>,
}

impl Smoother {
    /// Prepares a grid; `has_value` marks the points that have one. Cost: two rays a point.
    pub fn new(receiver: &Receiver, [columns, rows]: [usize; 2], has_value: &[bool], caster: &RayCaster) -> Self {
        let gates = Gates::new(receiver, [columns, rows], has_value, caster);
        let cell = cell_size(receiver, [columns, rows]);
        let spacing = cell[0].max(cell[1]);
        let offsets = offsets(cell.map(|side| (side / spacing).max(NARROWEST)));
        let windows = WINDOWS.into_iter().map(|(degree, radius)| Window::new(degree, radius, &offsets)).collect();
        let beside = (0..columns * rows).map(|point| !gates.open(point, [BESIDE; 2])).collect();
        Self { columns, rows, gates, windows, offsets, beside }
    }

    /// The estimate at every grid point, smoothed over its neighbours, and its variance, smoothing bias included.
    ///
    /// The window chosen at each point is in `chosen`. Cost: 2 to 10 µs a point, 100 bytes a point while it lasts.
    pub fn smooth<const C: usize>(
        &self,
        samples: &Samples<C>,
        has_value: &[bool],
        chosen: &mut Vec<usize>,
    ) -> Vec<Estimate<C>> {
        let raw = samples.plain();
        let noise: Vec<f64> = raw.iter().map(|estimate| estimate.variance).collect();
        let noise = pooled(&noise, has_value, [self.columns, self.rows]);
        let fits: Vec<[Fit<C>; WINDOWS.len()]> = (0..raw.len())
            .into_par_iter()
            .with_min_len(64)
            .map_init(Vec::new, |reached, point| {
                if has_value[point] { self.fits(point, &raw, reached) } else { [Fit::NONE; WINDOWS.len()] }
            })
            .collect();
        let risks: Vec<Vec<f64>> = (0..WINDOWS.len())
            .into_par_iter()
            .map(|window| {
                let risk = |point: usize| {
                    let fit = &fits[point][window];
                    let off = fit.photometric() - photometric(raw[point].value);
                    off * off + (2.0 * f64::from(fit.own) - 1.0) * noise[point]
                };
                let risks: Vec<f64> = (0..raw.len()).map(risk).collect();
                self.box_means(&risks, has_value, RISK_POOL)
            })
            .collect();
        let best: Vec<usize> = (0..raw.len())
            .map(|point| {
                let better = |&a: &usize, &b: &usize| risks[a][point].total_cmp(&risks[b][point]);
                // Light is never negative, and the point's own mean, window 0, is not either.
                let possible = |&window: &usize| fits[point][window].value.iter().all(|value| *value >= 0.0);
                (0..WINDOWS.len()).filter(possible).min_by(better).unwrap_or(0)
            })
            .collect();
        let bias = self.squared_bias(&fits, &best, &noise, has_value);
        let common = self.common_noise(samples, &raw, &noise, has_value);
        let smoothed = (0..raw.len())
            .map(|point| {
                if !has_value[point] {
                    return Estimate::DARK;
                }
                let fit = &fits[point][best[point]];
                let own = f64::from(fit.squares) * noise[point];
                let bias = bias[point].max(own * BIAS_AT_LEAST_RISK);
                let variance = own + bias + common * fit.photometric().powi(2);
                Estimate { value: fit.value.map(f64::from), variance }
            })
            .collect();
        *chosen = best;
        smoothed
    }

    /// Rows of numbers about each point put through the windows chosen for it: what [`Self::smooth`] does to a whole,
    /// done to its parts. Rows have `width` numbers, a multiple of four. Cost: about 0.1 ns a number and neighbour in
    /// the window.
    pub fn apply(&self, chosen: &[usize], rows: &[f32], width: usize, has_value: &[bool]) -> Vec<f32> {
        let mut smoothed = vec![0.0; rows.len()];
        let fresh = || (Vec::new(), Vec::new());
        smoothed.par_chunks_mut(width).enumerate().with_min_len(64).for_each_init(
            fresh,
            |(reached, weights), (point, row)| {
                if has_value[point] {
                    self.weights(point, &self.windows[chosen[point]], reached, weights);
                    add_up(weights, rows, row);
                }
            },
        );
        smoothed
    }

    /// What each neighbour counts in the fit of a window about a point. `reached` is memory to reuse.
    fn weights(
        &self,
        point: usize,
        window: &Window,
        reached: &mut Vec<Option<usize>>,
        weights: &mut Vec<(usize, f32)>,
    ) {
        weights.clear();
        if self.gates.open(point, window.half) {
            let [columns, rows] = window.half;
            let first = point - rows * self.columns - columns;
            for (row, line) in window.weights.chunks_exact(2 * columns + 1).enumerate() {
                let from = first + row * self.columns;
                let counts = line.iter().enumerate().filter(|(_, weight)| **weight != 0.0);
                weights.extend(counts.map(|(column, weight)| (from + column, *weight as f32)));
            }
            return;
        }
        reached.clear();
        let mut sums = FitSums::<0>::new();
        self.reach(point, window, reached, |offset, _| sums.add(offset, &[]));
        let row = sums.row(window);
        for (offset, there) in self.offsets.iter().zip(&*reached) {
            if let Some(there) = there {
                weights.push((*there, offset.weight(window, &row) as f32));
            }
        }
    }

    /// Goes on along the offsets of a window from those in `reached`, and shows what it gets to.
    #[inline(always)]
    fn reach(
        &self,
        point: usize,
        window: &Window,
        reached: &mut Vec<Option<usize>>,
        mut arrive: impl FnMut(&Offset, usize),
    ) {
        for index in reached.len()..window.count {
            let offset = &self.offsets[index];
            let there = if index == 0 {
                Some(point)
            } else {
                reached[offset.before].and_then(|from| self.gates.step(from, offset.onward))
            };
            reached.push(there);
            if let Some(there) = there {
                arrive(offset, there);
            }
        }
    }

    /// Squared bias of the windows chosen: their squared difference to narrower ones, less what noise makes of it. The
    /// narrower estimate scatters about the wider one by the difference of their variances, as that of any efficient
    /// estimate does (Hausman 1978).
    fn squared_bias<const C: usize>(
        &self,
        fits: &[[Fit<C>; WINDOWS.len()]],
        best: &[usize],
        noise: &[f64],
        has_value: &[bool],
    ) -> Vec<f64> {
        let excess = |point: usize| {
            let fits = &fits[point];
            let chosen = &fits[best[point]];
            let rougher = |fit: &&Fit<C>| fit.squares >= YARDSTICK * chosen.squares;
            let by_variance = |a: &&Fit<C>, b: &&Fit<C>| a.squares.total_cmp(&b.squares);
            let yardstick = fits.iter().filter(rougher).min_by(by_variance).unwrap_or(&fits[0]);
            let off = chosen.photometric() - yardstick.photometric();
            off * off - f64::from(yardstick.squares - chosen.squares).max(0.0) * noise[point]
        };
        let excess: Vec<f64> = (0..fits.len()).map(excess).collect();
        self.box_means(&excess, has_value, BIAS_POOL).into_iter().map(|square| square.max(0.0)).collect()
    }

    /// Relative variance of what neighbouring points have in common: the photons behind their records. It is what the
    /// batches' means over blocks scatter beyond the points' own noise.
    fn common_noise<const C: usize>(
        &self,
        samples: &Samples<C>,
        raw: &[Estimate<C>],
        noise: &[f64],
        has_value: &[bool],
    ) -> f64 {
        let batches: Vec<usize> = samples.active().collect();
        let columns = self.columns.div_ceil(BLOCK);
        let mut blocks = vec![([0.0_f64; MAP_BATCHES], 0.0_f64, 0.0_f64); columns * self.rows.div_ceil(BLOCK)];
        for point in (0..raw.len()).filter(|&point| has_value[point]) {
            let block = point / self.columns / BLOCK * columns + point % self.columns / BLOCK;
            let (means, own, count) = &mut blocks[block];
            batches.iter().for_each(|&batch| means[batch] += samples.batch_mean(point, batch));
            *own += noise[point];
            *count += 1.0;
        }
        let (mut excess, mut level) = (0.0, 0.0);
        let number = batches.len() as f64;
        for (means, own, count) in blocks.iter().filter(|(_, _, count)| *count > 0.0) {
            let mean = batches.iter().map(|&batch| means[batch]).sum::<f64>() / number;
            let scatter: f64 = batches.iter().map(|&batch| (means[batch] - mean).powi(2)).sum();
            excess += (scatter / (number * (number - 1.0)).max(1.0) - own) / count;
            level += mean * mean / count;
        }
        if level > 0.0 { (excess / level).max(0.0) } else { 0.0 }
    }

    /// Whether a point has a value, and nothing stands between it and its eight neighbours.
    pub fn is_open(&self, point: usize) -> bool {
        self.gates.open(point, [1, 1])
    }

    /// Means over squares of `half` cells to each side, over points of the same kind: those beside something or at the
    /// edge, where light changes within a cell or two, and the others.
    fn box_means(&self, values: &[f64], has_value: &[bool], half: usize) -> Vec<f64> {
        let size = [self.columns, self.rows];
        let among = |beside: bool| {
            let kind: Vec<bool> = has_value.iter().zip(&self.beside).map(|(&has, &at)| has && at == beside).collect();
            box_means(values, &kind, size, half)
        };
        let (open, beside) = (among(false), among(true));
        open.iter().zip(beside).zip(&self.beside).map(|((open, at), beside)| if *beside { at } else { *open }).collect()
    }

    /// The fit of every window at a point. `reached` is memory to reuse.
    fn fits<const C: usize>(
        &self,
        point: usize,
        raw: &[Estimate<C>],
        reached: &mut Vec<Option<usize>>,
    ) -> [Fit<C>; WINDOWS.len()] {
        let mut fits = [Fit::NONE; WINDOWS.len()];
        reached.clear();
        let mut sums = FitSums::new();
        for (fit, window) in fits.iter_mut().zip(&self.windows) {
            if self.gates.open(point, window.half) {
                *fit = self.open_fit(point, window, raw);
                continue;
            }
            self.reach(point, window, reached, |offset, there| sums.add(offset, &raw[there].value));
            *fit = sums.fit(window);
        }
        fits
    }

    /// The fit of a window at a point where nothing is in its way.
    fn open_fit<const C: usize>(&self, point: usize, window: &Window, raw: &[Estimate<C>]) -> Fit<C> {
        let [columns, rows] = window.half;
        let first = point - rows * self.columns - columns;
        let width = 2 * columns + 1;
        let mut value = [0.0; C];
        for (row, weights) in window.weights.chunks_exact(width).enumerate() {
            let from = first + row * self.columns;
            for (weight, raw) in weights.iter().zip(&raw[from..from + width]) {
                (0..C).for_each(|c| value[c] += weight * raw.value[c]);
            }
        }
        let own = window.weights[window.weights.len() / 2];
        Fit { value: value.map(|lux| lux as f32), squares: window.squares as f32, own: own as f32 }
    }
}

/// Variances pooled over [`POOL`]; over wider squares, and in the end over all points, where it is 0 there: cells where
/// no ray has found light have less information. Never below 0, which the differences of large sums would miss by
/// rounding where it is dark.
fn pooled(variances: &[f64], has_value: &[bool], size: [usize; 2]) -> Vec<f64> {
    let mut pooled = box_means(variances, has_value, size, POOL);
    for half in [RISK_POOL, size[0].max(size[1])] {
        if pooled.iter().zip(has_value).all(|(variance, has_value)| *variance > 0.0 || !has_value) {
            break;
        }
        let wider = box_means(variances, has_value, size, half);
        pooled.iter_mut().zip(wider).filter(|(variance, _)| **variance <= 0.0).for_each(|(own, wider)| *own = wider);
    }
    pooled.into_iter().map(|variance| variance.max(0.0)).collect()
}

/// Means over the squares of `half` cells to each side of every point of a grid, of the points that have a value; 0
/// where none has.
pub(super) fn box_means(values: &[f64], has_value: &[bool], [columns, rows]: [usize; 2], half: usize) -> Vec<f64> {
    let width = columns + 1;
    let mut sums = vec![[0.0_f64; 2]; width * (rows + 1)];
    for row in 0..rows {
        let mut along = [0.0; 2];
        for column in 0..columns {
            let point = row * columns + column;
            if has_value[point] {
                along = [along[0] + values[point], along[1] + 1.0];
            }
            let below = sums[row * width + column + 1];
            sums[(row + 1) * width + column + 1] = [below[0] + along[0], below[1] + along[1]];
        }
    }
    (0..values.len())
        .map(|point| {
            let (column, row) = (point % columns, point / columns);
            let (left, right) = (column.saturating_sub(half), (column + half + 1).min(columns));
            let (low, high) = (row.saturating_sub(half), (row + half + 1).min(rows));
            let at = |column: usize, row: usize| sums[row * width + column];
            let [sum, count] = [0, 1]
                .map(|part| at(right, high)[part] + at(left, low)[part] - at(left, high)[part] - at(right, low)[part]);
            if count > 0.5 { sum / count } else { 0.0 }
        })
        .collect()
}

/// Sides of a cell, m; 1 where there is only one.
fn cell_size(receiver: &Receiver, [columns, rows]: [usize; 2]) -> [f32; 2] {
    let side = |to: usize, axis: usize| (receiver.points[to][axis] - receiver.points[0][axis]).abs();
    let x = (columns > 1).then(|| side(1, 0));
    let y = (rows > 1).then(|| side(columns, 1));
    [x.or(y).unwrap_or(1.0), y.or(x).unwrap_or(1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Variances are not negative, nor are their means, where dark cells lie beside bright ones either: their square
    /// root, the standard error, was NaN once. Without the bound rounding breaks this in some cells.
    #[test]
    fn pooled_variances_are_not_negative() {
        let size = [122, 82];
        let variances: Vec<f64> = (0..size[0] * size[1])
            .map(|point| if point % size[0] < 60 { 1e3 * (point as f64 * 0.618_034).fract() } else { 0.0 })
            .collect();
        let has_value = vec![true; variances.len()];
        let bare = box_means(&variances, &has_value, size, POOL);
        assert!(bare.iter().any(|&mean| mean < 0.0), "the case is too easy to show anything");
        assert!(pooled(&variances, &has_value, size).iter().all(|&mean| mean >= 0.0));
    }
}

//! Smoothing of a map of noisy estimates, as far as the data bear it and no farther than the point sees.
//!
//! Every grid point is refitted by a polynomial through its neighbours (local-linear and local-quadratic regression) over
//! windows of several sizes. Which of them is best about a point is asked of the data: Stein's unbiased estimate of the
//! risk (Stein 1981; Li, Wu & Chuang 2012 for rendered images) tells the squared error, noise and smoothing bias
//! together, of each window without knowing the truth. So smooth light is averaged over a wide window, and a shadow's
//! edge over a narrow one. Neighbours that the point does not see in its plane (the other side of a partition) never
//! count.

pub mod counts;

use std::collections::HashMap;
use std::io;

use rayon::prelude::*;

use super::density::Estimate;
use super::gates::{Gates, Step};
use super::receiver::Receiver;
use crate::embree::RayCaster;
use crate::flux::photometric;
use crate::state::Sum;
use crate::state::tape::Tape;

/// Independent parts of the samples of a map, whose scatter is the noise: neighbours' scatter is pooled.
pub const MAP_BATCHES: usize = 8;
/// Those of points without neighbours, each of which has nothing but its own batches to know its noise by: with 16, what
/// is within two standard errors is 93.6 % (Student's t) where a known one has 95.4 %.
pub const POINT_BATCHES: usize = 16;

/// Cells to each side over which noise is pooled, and risk.
const POOL: usize = 4;
const RISK_POOL: usize = 10;
const BIAS_POOL: usize = 16;

/// Points with something within so many cells choose their windows among themselves.
const BESIDE: usize = 2;

/// A window's bias is judged by one whose variance is at least so many times as large.
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

/// Radius of the widest window, in cells.
pub const WIDEST: f32 = 10.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Degree {
    Linear,
    Quadratic,
}

/// Squared bias of the window chosen, at least, as a share of its variance. At the radius of least risk it is 1/2 for a plane and
/// 1/4 for a quadric (bias of order h² and h⁴, variance h⁻²); that the risk by which windows are chosen is itself noisy costs
/// some, too. In even light, where there is no bias, claims are √1.5 of the errors.
const BIAS_AT_LEAST_RISK: f64 = 0.5;

/// Samples at each point of a receiver, in batches.
pub struct Samples<const C: usize> {
    /// Sum of the samples of each point and batch, lx: point by point.
    sums: Vec<[Sum; C]>,
    /// Samples of a point in each batch.
    counts: Vec<u64>,
    /// The same by light group, where asked for.
    groups: Option<GroupSamples>,
}

/// Samples by light group.
struct GroupSamples {
    /// Numbers in a row of all groups.
    width: usize,
    /// Rows of each point: one for each batch, or one for all.
    rows: usize,
    /// Rows of sums, lx, point by point.
    sums: Vec<Sum>,
}

impl<const C: usize> Samples<C> {
    /// None yet, in so many batches. Takes 16 bytes a channel, batch and point.
    pub fn new(points: usize, batches: usize) -> Self {
        Self { sums: vec![[Sum::ZERO; C]; points * batches], counts: vec![0; batches], groups: None }
    }

    /// None yet, light groups apart: `width` numbers each, for each batch too if their variances are wanted.
    /// Takes 16 bytes a number and point more, times `batches` with variances.
    pub fn in_groups(points: usize, batches: usize, width: usize, variances: bool) -> Self {
        let rows = if variances { batches } else { 1 };
        let groups = GroupSamples { width, rows, sums: vec![Sum::ZERO; points * width * rows] };
        Self { groups: Some(groups), ..Self::new(points, batches) }
    }

    fn batches(&self) -> usize {
        self.counts.len()
    }

    /// Adds to each point the sum of `count` samples that `sample` takes there; `round` numbers the rounds.
    pub fn add(&mut self, round: u64, count: u64, sample: impl Fn(usize) -> [f64; C] + Sync) {
        let batch = (round % self.batches() as u64) as usize;
        self.counts[batch] += count;
        self.sums.par_chunks_mut(self.counts.len()).enumerate().with_min_len(32).for_each(|(point, sums)| {
            let found = sample(point);
            (0..C).for_each(|c| sums[batch][c].add(found[c]));
        });
    }

    /// The same with light groups apart: `sample` adds each group's part to a row of sums.
    pub fn add_in_groups(&mut self, round: u64, count: u64, sample: impl Fn(usize, &mut [f64]) -> [f64; C] + Sync) {
        let batches = self.batches();
        let batch = (round % batches as u64) as usize;
        self.counts[batch] += count;
        let Some(GroupSamples { width, rows, sums: groups }) = &mut self.groups else { return };
        let (width, row) = (*width, batch % *rows);
        let points = self.sums.par_chunks_mut(batches).zip(groups.par_chunks_mut(width * *rows));
        let fresh = || vec![0.0; width];
        points.enumerate().with_min_len(32).for_each_init(fresh, |parts, (point, (sums, groups))| {
            parts.fill(0.0);
            let found = sample(point, parts);
            (0..C).for_each(|c| sums[batch][c].add(found[c]));
            let lit = groups[row * width..].iter_mut().zip(&*parts).filter(|(_, part)| **part != 0.0);
            lit.for_each(|(sum, part)| sum.add(*part));
        });
    }

    /// Hands its sums over.
    pub fn exchange(&mut self, tape: &mut Tape<'_>) -> io::Result<()> {
        self.counts.iter_mut().try_for_each(|count| tape.count(count))?;
        tape.sums(self.sums.as_flattened_mut())?;
        self.groups.iter_mut().try_for_each(|groups| tape.sums(&mut groups.sums))
    }

    /// Means of the light groups: a row of all groups for each point. None without groups.
    pub fn group_means(&self) -> Vec<f32> {
        let Some(GroupSamples { width, rows, sums }) = &self.groups else { return Vec::new() };
        let per_sample = 1.0 / self.counts.iter().sum::<u64>().max(1) as f64;
        let mean = |point: &[Sum], i: usize| {
            let sum: f64 = (0..*rows).map(|row| point[row * width + i].value()).sum();
            (sum * per_sample) as f32
        };
        let points = sums.par_chunks(width * rows);
        points.flat_map_iter(|point| (0..*width).map(move |i| mean(point, i))).collect()
    }

    /// Variance of the photometric mean of a light group at a point, from the batches' scatter and their number; 0 where
    /// batches are not kept.
    pub fn group_variance(&self, point: usize, group: usize) -> f64 {
        let Some(GroupSamples { width, rows, sums }) = &self.groups else { return 0.0 };
        if *rows != self.batches() {
            return 0.0;
        }
        let batch = |batch: usize| -> [f64; C] {
            let row = &sums[(point * rows + batch) * width..][..*width];
            std::array::from_fn(|c| row[group * C + c].value())
        };
        let means: Vec<f64> = self.active().map(|b| photometric(batch(b)) / self.counts[b] as f64).collect();
        let whole: f64 = (0..*rows).map(|b| photometric(batch(b))).sum();
        let mean = whole / self.counts.iter().sum::<u64>().max(1) as f64;
        let scatter: f64 = means.iter().map(|found| (found - mean).powi(2)).sum();
        few(means.len() as f64) * scatter / (means.len() as f64 * (means.len() as f64 - 1.0)).max(1.0)
    }

    fn active(&self) -> impl Iterator<Item = usize> {
        (0..self.batches()).filter(|&batch| self.counts[batch] > 0)
    }

    /// Mean of a point.
    fn mean(&self, point: usize) -> [f64; C] {
        let count: u64 = self.counts.iter().sum();
        let sums = &self.sums[point * self.batches()..][..self.batches()];
        std::array::from_fn(|c| sums.iter().map(|sum| sum[c].value()).sum::<f64>() / count.max(1) as f64)
    }

    /// Photometric mean of a batch.
    fn batch_mean(&self, point: usize, batch: usize) -> f64 {
        photometric(self.sums[point * self.batches() + batch].map(Sum::value)) / self.counts[batch] as f64
    }

    /// Variance of the photometric mean, from the batches' scatter.
    fn variance(&self, point: usize) -> f64 {
        let mean = photometric(self.mean(point));
        let (mut scatter, mut batches) = (0.0, 0.0_f64);
        for batch in self.active() {
            scatter += (self.batch_mean(point, batch) - mean).powi(2);
            batches += 1.0;
        }
        scatter / (batches * (batches - 1.0)).max(1.0)
    }

    /// Variance of Σ weight · mean over points (photometric), from the scatter of the batches: so what the points have in
    /// common, the photons behind their records, counts in full. Wider by what a scatter of few batches may miss: the
    /// variance of Student's t.
    pub fn variance_of_sum(&self, weighted: &[(usize, f64)]) -> f64 {
        let batch = |batch: usize| -> f64 {
            weighted.iter().map(|&(point, weight)| weight * self.batch_mean(point, batch)).sum()
        };
        let sums: Vec<f64> = self.active().map(batch).collect();
        let free = sums.len() as f64 - 1.0;
        mean_of(&sums).1 * if free > 2.0 { free / (free - 2.0) } else { 3.0 }
    }

    /// Every point by itself: mean, and variance of the mean.
    pub fn plain(&self) -> Vec<Estimate<C>> {
        let points = 0..self.sums.len() / self.batches();
        points.map(|point| Estimate { value: self.mean(point), variance: self.variance(point) }).collect()
    }

    /// The same with the variance of a point that has nothing but its own batches to know it by; see [`few`].
    pub fn alone(&self) -> Vec<Estimate<C>> {
        let factor = few(self.active().count() as f64);
        let mut estimates = self.plain();
        estimates.iter_mut().for_each(|estimate| estimate.variance *= factor);
        estimates
    }
}

/// What the samples of some points say together.
pub struct Together {
    /// Photometric mean, lx.
    pub mean: f64,
    /// Its variance, lx².
    pub variance: f64,
}

impl<const C: usize> Samples<C> {
    /// The mean of some points.
    pub fn together(&self, points: &[usize]) -> Together {
        let of_batch = |batch: usize| {
            points.iter().map(|&point| self.batch_mean(point, batch)).sum::<f64>() / points.len().max(1) as f64
        };
        let means: Vec<f64> = self.active().map(of_batch).collect();
        let (mean, variance) = mean_of(&means);
        Together { mean, variance: few(means.len() as f64) * variance }
    }
}

/// Mean of independent parts, and its variance from their scatter; 0 and 0 of none.
pub fn mean_of(parts: &[f64]) -> (f64, f64) {
    let count = parts.len().max(1) as f64;
    let mean = parts.iter().sum::<f64>() / count;
    let scatter: f64 = parts.iter().map(|part| (part - mean).powi(2)).sum();
    (mean, scatter / (count * (count - 1.0)).max(1.0))
}

/// What a variance found from the scatter of a few batches is multiplied by, so that 68.27 % of errors are within its square
/// root: the square of Student's t for that share, 1 + 1/(2 ν) + 1/(4 ν²) + 1/(16 ν³), with ν = `batches` − 1 degrees of
/// freedom (Cornish & Fisher 1938; 1 % too low for ν = 1). 1 for fewer than two.
pub fn few(batches: f64) -> f64 {
    if batches < 2.0 {
        return 1.0;
    }
    let per = 1.0 / (batches - 1.0);
    (1.0 + per * (0.5 + per * (0.25 + per * 0.0625))).powi(2)
}

/// What smoothing needs to know of a grid: its windows, and what stands in the way.
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

/// One of [`WINDOWS`].
struct Window {
    degree: Degree,
    /// The kernel is 1 − sharpness · d².
    sharpness: f64,
    /// Columns and rows to each side.
    half: [usize; 2],
    /// Offsets within it.
    count: usize,
    /// Where nothing is in its way: what each cell counts, row by row, and Σ of their squares.
    weights: Vec<f64>,
    squares: f64,
}

struct Offset {
    step: [i32; 2],
    /// In cells.
    distance: f32,
    /// The offset one step nearer to the middle, and the step from there.
    before: usize,
    onward: Step,
    /// 1, x, y, x², xy, y², x³ … y⁴ times 1, d² and d⁴, in widest windows.
    monomials: [[f64; MONOMIALS]; 3],
}

impl Offset {
    /// What the value there counts in a window's fit, `row` being that of [`Sums::row`].
    fn weight(&self, window: &Window, row: &[f64; TERMS]) -> f64 {
        let terms = &self.monomials[0][..TERMS];
        let distance_squared = self.monomials[1][0];
        let plane: f64 = terms.iter().zip(row).map(|(term, part)| term * part).sum();
        (1.0 - window.sharpness * distance_squared) * plane
    }
}

/// Monomials of x and y up to the fourth degree.
const MONOMIALS: usize = 15;

/// Terms of the polynomials fitted: 1, x, y, x², xy, y². The first monomials are the same.
const TERMS: usize = 6;

/// What one window says of a point.
#[derive(Clone, Copy)]
struct Fit<const C: usize> {
    /// lx.
    value: [f32; C],
    /// Variance for noise of variance 1.
    squares: f32,
    /// What the point itself counts.
    own: f32,
}

impl Smoother {
    /// Prepares a grid; `has_value` tells which points do. Cost: two rays a point.
    pub fn new(receiver: &Receiver, [columns, rows]: [usize; 2], has_value: &[bool], caster: &RayCaster) -> Self {
        let gates = Gates::new(receiver, [columns, rows], has_value, caster);
        let cell = cell_size(receiver, [columns, rows]);
        let spacing = cell[0].max(cell[1]);
        let offsets = offsets(cell.map(|side| (side / spacing).max(NARROWEST)));
        let windows = WINDOWS.into_iter().map(|(degree, radius)| Window::new(degree, radius, &offsets)).collect();
        let beside = (0..columns * rows).map(|point| !gates.open(point, [BESIDE; 2])).collect();
        Self { columns, rows, gates, windows, offsets, beside }
    }

    /// The estimate at every grid point with its neighbours' help, and its variance, smoothing bias included.
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

    /// Rows of numbers about each point put through the windows chosen for it: what [`Self::smooth`] does to a whole, done to its
    /// parts. Rows have `width` numbers, a multiple of four. Cost: about 0.1 ns a number and neighbour in the window.
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
        let mut sums = Sums::<0>::new();
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

    /// Means over squares of `half` cells to each side, over points of the same kind: those beside something or at the edge,
    /// where light changes within a cell or two, and the others.
    fn box_means(&self, values: &[f64], has_value: &[bool], half: usize) -> Vec<f64> {
        let size = [self.columns, self.rows];
        let among = |beside: bool| {
            let kind: Vec<bool> = has_value.iter().zip(&self.beside).map(|(&has, &at)| has && at == beside).collect();
            box_means(values, &kind, size, half)
        };
        let (open, beside) = (among(false), among(true));
        open.iter().zip(beside).zip(&self.beside).map(|((open, at), beside)| if *beside { at } else { *open }).collect()
    }

    /// What every window says of a point. `reached` is memory to reuse.
    fn fits<const C: usize>(
        &self,
        point: usize,
        raw: &[Estimate<C>],
        reached: &mut Vec<Option<usize>>,
    ) -> [Fit<C>; WINDOWS.len()] {
        let mut fits = [Fit::NONE; WINDOWS.len()];
        reached.clear();
        let mut sums = Sums::new();
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

    /// What a window says of a point where nothing is in its way.
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

impl<const C: usize> Fit<C> {
    const NONE: Self = Self { value: [0.0; C], squares: 0.0, own: 0.0 };

    fn photometric(&self) -> f64 {
        photometric(self.value.map(f64::from))
    }
}

impl Window {
    fn new(degree: Degree, radius: f32, offsets: &[Offset]) -> Self {
        let count = offsets.partition_point(|offset| offset.distance <= radius);
        let offsets = &offsets[..count];
        let sharpness = f64::from((WIDEST + 0.5) / (radius + 0.5)).powi(2);
        let most = |axis: usize| offsets.iter().map(|offset| offset.step[axis].unsigned_abs() as usize).max();
        let half = [0, 1].map(|axis| most(axis).unwrap_or(0));
        let mut window = Self { degree, sharpness, half, count, weights: Vec::new(), squares: 0.0 };
        let mut sums = Sums::<1>::new();
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
struct Sums<const C: usize> {
    /// Of the monomials, times 1, d² and d⁴.
    moments: [[f64; MONOMIALS]; 3],
    /// Of values times terms, times 1 and d².
    values: [[[f64; TERMS]; 2]; C],
}

impl<const C: usize> Sums<C> {
    fn new() -> Self {
        Self { moments: [[0.0; MONOMIALS]; 3], values: [[[0.0; TERMS]; 2]; C] }
    }

    #[inline(always)]
    fn add(&mut self, offset: &Offset, value: &[f64; C]) {
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
    /// neighbours don't bear the one asked for.
    fn row(&self, window: &Window) -> [f64; TERMS] {
        let [plain, square, _] = &self.moments;
        let kernel: [f64; MONOMIALS] = std::array::from_fn(|i| plain[i] - window.sharpness * square[i]);
        let normal = matrix(&kernel);
        let degrees: &[usize] = if window.degree == Degree::Quadratic { &[6, 3, 1] } else { &[3, 1] };
        degrees.iter().find_map(|&size| first_row_of_inverse(&normal, size)).unwrap_or_default()
    }

    fn fit(&self, window: &Window) -> Fit<C> {
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
fn add_up(weights: &[(usize, f32)], rows: &[f32], sum: &mut [f32]) {
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
fn column_sums<const N: usize>(weights: &[(usize, f32)], rows: &[f32], width: usize, first: usize) -> [f32; N] {
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
const EXPONENTS: [[usize; 2]; MONOMIALS] = [
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
fn matrix(sums: &[f64; MONOMIALS]) -> [[f64; TERMS]; TERMS] {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let [x, y] = [0, 1].map(|axis| EXPONENTS[i][axis] + EXPONENTS[j][axis]);
            let degree = x + y;
            sums[degree * (degree + 1) / 2 + y]
        })
    })
}

/// Variances pooled over [`POOL`]; over wider squares, and in the end over all points, where it is 0 there: cells that no ray
/// has found light in know the less of it. Never below 0, which the differences of large sums would miss by rounding where it
/// is dark.
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

/// Means over the squares of `half` cells to each side of every point of a grid, of the points that have a value; 0 where
/// none has.
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

/// Offsets within the widest window of a grid whose cells have these sides, in units of the longer; nearest first.
fn offsets(cell: [f32; 2]) -> Vec<Offset> {
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

/// First row of the inverse of the leading `size` × `size` part of a symmetric positive matrix, by Cholesky's decomposition; `None` where it is nearly singular.
fn first_row_of_inverse(matrix: &[[f64; 6]; 6], size: usize) -> Option<[f64; 6]> {
    let mut lower = [[0.0; 6]; 6];
    for row in 0..size {
        for column in 0..=row {
            let sum: f64 = (0..column).map(|k| lower[row][k] * lower[column][k]).sum();
            let rest = matrix[column][row] - sum;
            if row == column {
                if rest <= 1e-4 * matrix[row][row] {
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

    /// Weighted sums of values at a window's offsets, as a fit sees them.
    fn fitted(degree: Degree, radius: f32, keep: impl Fn(f64, f64) -> bool, value: impl Fn(f64, f64) -> f64) -> f64 {
        let offsets = offsets([1.0, 1.0]);
        let window = Window::new(degree, radius, &offsets);
        let mut sums = Sums::<1>::new();
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

    /// Variances are not negative, nor are their means, where dark cells lie beside bright ones either: their square root,
    /// the standard error, was NaN once. Without the bound rounding breaks this in some cells.
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

    /// Of noise of variance 1 a fit has the variance Σ weight², whether summed by weights or by moments.
    #[test]
    fn both_ways_to_sum_agree() {
        let offsets = offsets([1.0, 0.7]);
        for (degree, radius) in WINDOWS {
            let window = Window::new(degree, radius, &offsets);
            let mut sums = Sums::<1>::new();
            offsets[..window.count].iter().for_each(|offset| sums.add(offset, &[1.0]));
            let fit = sums.fit(&window);
            assert!((f64::from(fit.squares) / window.squares - 1.0).abs() < 1e-4, "{degree:?}, {radius}");
            assert!((fit.photometric() - 1.0).abs() < 1e-5);
            let own = window.weights[window.weights.len() / 2];
            assert!((f64::from(fit.own) - own).abs() < 1e-6);
        }
    }
}

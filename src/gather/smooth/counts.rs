//! Smoothing of cells in which photons were counted.
//!
//! Counts differ from what rays find in two ways. Their noise is known cell by cell, as the sum of the photons'
//! squares, and differs a thousandfold between a focus and the shadow beside it: so it is never pooled. And their light
//! has edges: a window counts only where it agrees with narrower ones at this very cell, and what blur its
//! neighbourhood shows is claimed there and not spread far.

use rayon::prelude::*;

use super::fit::{Fit, FitSums};
use super::{Smoother, WINDOWS, box_means};
use crate::flux::photometric;
use crate::gather::density::Estimate;

/// Cells to each side over which risk and blur are taken, and how many those are.
const RISK_POOL: usize = 6;
const ABOUT: f64 = ((2 * RISK_POOL + 1) * (2 * RISK_POOL + 1)) as f64;
const BLUR_POOL: usize = 4;

/// How many σ a window's fit may differ from a narrower one's.
const DOUBT: f64 = 3.0;

/// Blur's squared share of the noise where windows are chosen by their risk: twice that of rays, since light that is
/// counted has edges, and the risk is pooled over fewer cells.
const BLUR_AT_LEAST_RISK: f64 = 1.0;

/// Cells to each side over which smoothing keeps the flux, and the most by which it is set right.
const FLUX_POOL: usize = 10;
const MAX_RESTORED: f64 = 1.25;

/// What was done to the counts of a cell: to be done to its parts.
#[derive(Clone, Copy, Debug)]
pub struct Smoothed {
    /// Number of the window.
    pub window: usize,
    /// By what its fit was multiplied.
    pub restored: f32,
}

/// The fit of one window at a cell.
#[derive(Clone, Copy)]
struct CountFit<const C: usize> {
    fit: Fit<C>,
    /// Its variance, from the variance of each cell in it.
    variance: f64,
}

impl Smoother {
    /// The estimate at every cell, smoothed over its neighbours, and its variance, blur included. `raw` is what the
    /// cells counted themselves, with the variance of independent photons; `quantum` is what one photon brings to each,
    /// lx.
    ///
    /// Bright cells are smoothed more than dark ones beside an edge, which would lose flux: it is restored over the
    /// cells about. What was done to each cell is in `chosen`. Cost: 4 to 20 µs a cell.
    pub fn smooth_counts<const C: usize>(
        &self,
        raw: &[Estimate<C>],
        quantum: impl Fn(usize) -> f64 + Sync,
        has_value: &[bool],
        chosen: &mut Vec<Smoothed>,
    ) -> Vec<Estimate<C>> {
        let fits: Vec<[CountFit<C>; WINDOWS.len()]> = (0..raw.len())
            .into_par_iter()
            .with_min_len(64)
            .map_init(Vec::new, |reached, point| {
                if has_value[point] { self.counted_fits(point, raw, reached) } else { [CountFit::NONE; WINDOWS.len()] }
            })
            .collect();
        let risks: Vec<Vec<f64>> = (0..WINDOWS.len())
            .into_par_iter()
            .map(|window| {
                let risk = |point: usize| {
                    let fit = &fits[point][window].fit;
                    let off = fit.photometric() - photometric(raw[point].value);
                    off * off + (2.0 * f64::from(fit.own) - 1.0) * raw[point].variance
                };
                let risks: Vec<f64> = (0..raw.len()).map(risk).collect();
                box_means(&risks, has_value, [self.columns, self.rows], RISK_POOL)
            })
            .collect();
        let best: Vec<usize> = (0..raw.len())
            .into_par_iter()
            .with_min_len(64)
            .map(|point| {
                // Where nothing was met the risk is 0 but for the rounding of large sums.
                let nothing = 1e-6 * quantum(point).powi(2);
                let risk =
                    |window: usize| if risks[window][point].abs() < nothing { 0.0 } else { risks[window][point] };
                let better = |&a: &usize, &b: &usize| risk(a).total_cmp(&risk(b));
                let possible = |&window: &usize| agrees(&fits[point], window, quantum(point));
                // Of windows as good as each other the widest: where nothing was met it bounds the light best.
                (0..WINDOWS.len()).rev().filter(possible).min_by(better).unwrap_or(0)
            })
            .collect();
        let counted: Vec<f64> = raw.iter().map(|estimate| photometric(estimate.value)).collect();
        let level = box_means(&counted, has_value, [self.columns, self.rows], RISK_POOL);
        let blur = self.blur(&fits, &best);
        let restored = self.restored(raw, &fits, &best, has_value);
        let smoothed = (0..raw.len())
            .map(|point| {
                if !has_value[point] {
                    return Estimate::DARK;
                }
                let CountFit { fit, variance } = fits[point][best[point]];
                let blur = if best[point] == 0 { 0.0 } else { blur[point].max(BLUR_AT_LEAST_RISK * variance) };
                // Where no photon was met the noise is that of the light about, or of one photon there that was missed.
                let about = level[point].max(quantum(point) / ABOUT);
                let unseen = if variance > 0.0 { 0.0 } else { f64::from(fit.squares) * quantum(point) * about };
                let times = f64::from(restored[point]);
                let value = fit.value.map(|lux| times * f64::from(lux));
                Estimate { value, variance: times * times * (variance + blur) + unseen }
            })
            .collect();
        *chosen = best.iter().zip(restored).map(|(&window, restored)| Smoothed { window, restored }).collect();
        smoothed
    }

    /// By what smoothed cells are multiplied, so that as much light is about each as was counted there.
    fn restored<const C: usize>(
        &self,
        raw: &[Estimate<C>],
        fits: &[[CountFit<C>; WINDOWS.len()]],
        best: &[usize],
        has_value: &[bool],
    ) -> Vec<f32> {
        let counted: Vec<f64> = raw.iter().map(|estimate| photometric(estimate.value)).collect();
        let fitted: Vec<f64> = (0..raw.len()).map(|point| fits[point][best[point]].fit.photometric()).collect();
        let [counted, fitted] =
            [counted, fitted].map(|values| box_means(&values, has_value, [self.columns, self.rows], FLUX_POOL));
        let ratio = |(counted, fitted): (&f64, &f64)| {
            let ratio = if *fitted > 0.0 { counted / fitted } else { 1.0 };
            ratio.clamp(1.0 / MAX_RESTORED, MAX_RESTORED) as f32
        };
        counted.iter().zip(&fitted).map(ratio).collect()
    }

    /// Squared blur of the windows chosen: their squared difference to rougher ones, less what noise makes of it; over
    /// the cells nearby that are smoothed at all.
    fn blur<const C: usize>(&self, fits: &[[CountFit<C>; WINDOWS.len()]], best: &[usize]) -> Vec<f64> {
        let excess = |point: usize| {
            let fits = &fits[point];
            let chosen = &fits[best[point]];
            let rougher = |counted: &&CountFit<C>| counted.fit.squares >= super::YARDSTICK * chosen.fit.squares;
            let by_squares = |a: &&CountFit<C>, b: &&CountFit<C>| a.fit.squares.total_cmp(&b.fit.squares);
            let yardstick = fits.iter().filter(rougher).min_by(by_squares).unwrap_or(&fits[0]);
            let off = chosen.fit.photometric() - yardstick.fit.photometric();
            off * off - (yardstick.variance - chosen.variance).max(0.0)
        };
        let excess: Vec<f64> = (0..fits.len()).map(excess).collect();
        let smoothed: Vec<bool> = best.iter().map(|&window| window > 0).collect();
        let means = box_means(&excess, &smoothed, [self.columns, self.rows], BLUR_POOL);
        means.into_iter().map(|square| square.max(0.0)).collect()
    }

    /// The fit of every window at a cell. `reached` is memory to reuse.
    fn counted_fits<const C: usize>(
        &self,
        point: usize,
        raw: &[Estimate<C>],
        reached: &mut Vec<Option<usize>>,
    ) -> [CountFit<C>; WINDOWS.len()] {
        let mut fits = [CountFit::NONE; WINDOWS.len()];
        reached.clear();
        let mut sums = FitSums::new();
        for (counted, window) in fits.iter_mut().zip(&self.windows) {
            if self.gates.open(point, window.half) {
                *counted = CountFit {
                    fit: self.open_fit(point, window, raw),
                    variance: self.open_variance(point, window, raw),
                };
                continue;
            }
            self.reach(point, window, reached, |offset, there| sums.add(offset, &raw[there].value));
            let fit = sums.fit(window);
            let row = sums.row(window);
            let in_reach = self.offsets.iter().zip(&*reached).take(window.count);
            let parts = in_reach.filter_map(|(offset, there)| {
                there.map(|there| offset.weight(window, &row).powi(2) * raw[there].variance)
            });
            *counted = CountFit { fit, variance: parts.sum() };
        }
        fits
    }

    /// Variance of a window's fit where nothing is in its way.
    fn open_variance<const C: usize>(&self, point: usize, window: &super::Window, raw: &[Estimate<C>]) -> f64 {
        let [columns, rows] = window.half;
        let first = point - rows * self.columns - columns;
        let width = 2 * columns + 1;
        let lines = window.weights.chunks_exact(width).enumerate();
        let of_line = |(row, weights): (usize, &[f64])| -> f64 {
            let from = first + row * self.columns;
            weights.iter().zip(&raw[from..from + width]).map(|(weight, raw)| weight * weight * raw.variance).sum()
        };
        lines.map(of_line).sum()
    }
}

impl<const C: usize> CountFit<C> {
    const NONE: Self = Self { fit: Fit::NONE, variance: 0.0 };
}

/// Whether a window's fit may stand: light is not negative, and narrower windows agree within the noise that
/// they would have in its light.
fn agrees<const C: usize>(fits: &[CountFit<C>; WINDOWS.len()], window: usize, quantum: f64) -> bool {
    let wide = &fits[window];
    if wide.fit.value.iter().any(|value| *value < 0.0) {
        return false;
    }
    let level = wide.fit.photometric();
    fits[..window].iter().filter(|narrow| narrow.fit.squares > wide.fit.squares).all(|narrow| {
        let own = narrow.variance.max(level * quantum * f64::from(narrow.fit.squares));
        (narrow.fit.photometric() - level).powi(2) <= DOUBT * DOUBT * own
    })
}

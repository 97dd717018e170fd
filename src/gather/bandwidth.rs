//! How many photons an estimate takes, chosen place by place from the photons themselves.
//!
//! Many photons are smooth and blur shadows' edges, few are sharp and noisy. Estimates with several k stand side by
//! side; the one of least risk (variance plus squared bias) about each point is taken. The bias of a wide estimate shows
//! in its difference to the narrowest, less what noise makes of that: the narrow one scatters about the wide one by the
//! difference of their variances, as it would about any efficient estimate (Hausman 1978).

use super::density::Estimate;
use super::smooth::box_means;
use crate::photon::flux::photometric;

/// k of the estimates that stand side by side, as multiples of the k asked for.
pub const SCALES: [f64; 3] = [2.0, 0.7, 0.25];

/// That of points without neighbours, where nothing tells one from another.
const MIDDLE: usize = 1;

/// Cells to each side over which risk is pooled: one point alone knows nothing of its bias.
const POOL: usize = 6;

/// Those where the user says k: the narrow one only tells the bias of the other.
pub const FIXED: [f64; 2] = [1.0, 0.25];

/// Least squared bias of an estimate chosen by its risk, as a share of its variance: where squared bias grows as R⁴ and
/// variance falls as R⁻², their sum is least when one is half of the other.
const BIAS_AT_LEAST_RISK: f64 = 0.5;

/// The best of several estimates at each point, widest first, its bias included in its variance; the first, if `fixed`.
/// `grid` is the points' columns and rows, if they have any. `chosen` hears which was taken at each point.
pub fn choose<const C: usize>(
    mut scales: Vec<Vec<Estimate<C>>>,
    fixed: bool,
    grid: Option<[usize; 2]>,
    has_value: &[bool],
    mut chosen: impl FnMut(usize),
) -> Vec<Estimate<C>> {
    let plain = if fixed { 0 } else { MIDDLE };
    let Some(grid) = grid else {
        let plain = plain.min(scales.len() - 1);
        has_value.iter().for_each(|_| chosen(plain));
        return scales.swap_remove(plain);
    };
    let Some(narrowest) = scales.last() else { return Vec::new() };
    let risks: Vec<[Vec<f64>; 2]> = scales
        .iter()
        .map(|scale| {
            let excess = |(wide, narrow): (&Estimate<C>, &Estimate<C>)| {
                let off = photometric(wide.value) - photometric(narrow.value);
                off * off - (narrow.variance - wide.variance).max(0.0)
            };
            let excess: Vec<f64> = scale.iter().zip(narrowest).map(excess).collect();
            let variance: Vec<f64> = scale.iter().map(|estimate| estimate.variance).collect();
            let mut bias = box_means(&excess, has_value, grid, POOL);
            bias.iter_mut().for_each(|square| *square = square.max(0.0));
            [bias, box_means(&variance, has_value, grid, POOL)]
        })
        .collect();
    (0..has_value.len())
        .map(|point| {
            let risk = |scale: usize| risks[scale][0][point] + risks[scale][1][point];
            if fixed {
                let Estimate { value, variance } = scales[0][point];
                chosen(0);
                return Estimate { value, variance: variance + risks[0][0][point] };
            }
            let best = (0..scales.len()).min_by(|&a, &b| risk(a).total_cmp(&risk(b))).unwrap_or(0);
            let Estimate { value, variance } = scales[best][point];
            chosen(best);
            Estimate { value, variance: variance + risks[best][0][point].max(BIAS_AT_LEAST_RISK * variance) }
        })
        .collect()
}

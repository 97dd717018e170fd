//! How many photons an estimate takes, chosen place by place from the photons themselves.
//!
//! Many photons are smooth and blur shadows' edges, few are sharp and noisy. Estimates with several k stand side by
//! side; the one of least risk (variance plus squared bias) about each point is taken, of those that agree with all
//! narrower ones at the point itself. The bias of an estimate shows in its difference to the next narrower, less what
//! noise makes of that: the narrow one scatters about the wide one by the difference of their variances, as it would
//! about any efficient estimate (Hausman 1978).

use super::density::Estimate;
use super::smooth::box_means;
use crate::flux::photometric;

/// k of the estimates that stand side by side, as multiples of the k of the settings.
pub const SCALES: [f64; 4] = [2.0, 0.7, 0.25, 0.08];

/// That of points without neighbours, where nothing decides between them.
const MIDDLE: usize = 1;

/// Cells to each side over which risk is pooled: one point alone shows nothing of its bias.
const POOL: usize = 4;

/// Those where the user sets k: the narrow one only shows the bias of the other.
pub const FIXED: [f64; 2] = [1.0, 0.25];

/// Least squared bias of an estimate chosen by its risk, as a share of its variance: where squared bias grows as R⁴ and
/// variance falls as R⁻², their sum is least when one is half of the other.
const BIAS_AT_LEAST_RISK: f64 = 0.5;

/// The best of several estimates at each point, widest first, its bias included in its variance; the first, if `fixed`.
/// `factors` are their k, as multiples of one; `grid` is the points' columns and rows, if they have any. `chosen` is
/// called with the one taken at each point.
pub fn choose<const C: usize>(
    mut scales: Vec<Vec<Estimate<C>>>,
    factors: &[f64],
    fixed: bool,
    grid: Option<[usize; 2]>,
    has_value: &[bool],
    mut chosen: impl FnMut(usize),
) -> Vec<Estimate<C>> {
    let plain = if fixed { 0 } else { MIDDLE };
    let Some(grid) = grid.filter(|_| scales.len() > 1) else {
        let plain = plain.min(scales.len() - 1);
        has_value.iter().for_each(|_| chosen(plain));
        return scales.swap_remove(plain);
    };
    let last = scales.len() - 1;
    let off =
        |a: usize, b: usize, point: usize| photometric(scales[a][point].value) - photometric(scales[b][point].value);
    let noise = |wide: usize, narrow: usize, point: usize| {
        (scales[narrow][point].variance - scales[wide][point].variance).max(0.0)
    };
    let risks: Vec<[Vec<f64>; 2]> = (0..=last)
        .map(|scale| {
            // Bias grows as R², as k does: from what one step took away follows what is left, or was before it.
            let (wide, narrow) = if scale < last { (scale, scale + 1) } else { (scale - 1, scale) };
            let share = (factors[scale] / (factors[wide] - factors[narrow])).powi(2);
            let excess = |point: usize| share * (off(wide, narrow, point).powi(2) - noise(wide, narrow, point));
            let excess: Vec<f64> = (0..has_value.len()).map(excess).collect();
            let variance: Vec<f64> = scales[scale].iter().map(|estimate| estimate.variance).collect();
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
            let agrees = |wide: &usize| {
                let mut narrower = *wide + 1..=last;
                narrower.all(|narrow| off(*wide, narrow, point).powi(2) <= DOUBT.powi(2) * noise(*wide, narrow, point))
            };
            let best = (0..=last).filter(agrees).min_by(|&a, &b| risk(a).total_cmp(&risk(b))).unwrap_or(last);
            let Estimate { value, variance } = scales[best][point];
            chosen(best);
            Estimate { value, variance: variance + risks[best][0][point].max(BIAS_AT_LEAST_RISK * variance) }
        })
        .collect()
}

/// How many σ an estimate may differ from a narrower one before it counts as blurred.
const DOUBT: f64 = 2.5;

/// Which of several discs about a point to take, each of half the radius of the one before, and its estimate with the
/// blur that may be left in the variance. `quantum` is what one photon brings at the widest disc's middle, lx.
///
/// Lepski's rule: the widest disc that agrees with all narrower ones within their noise; then two narrower, whose blur
/// is a sixteenth as large where E is curved, and whose noise covers what an edge nearby, hidden by noise, may take
/// away. Noise of a narrow disc is at least what the wider one's light would have there: a disc that met nothing is no
/// proof of darkness.
pub fn of_ladder<const C: usize>(discs: &[Estimate<C>], quantum: f64) -> (usize, Estimate<C>) {
    let least = |disc: usize| quantum * 4.0_f64.powi(disc as i32);
    let variance = |disc: usize| if discs[disc].variance > 0.0 { discs[disc].variance } else { least(disc).powi(2) };
    let off = |a: usize, b: usize| photometric(discs[a].value) - photometric(discs[b].value);
    let apart = |wide: usize, narrow: usize| {
        let spread = variance(narrow).max(variance(wide) * 4.0_f64.powi((narrow - wide) as i32)) - variance(wide);
        off(wide, narrow).powi(2) > DOUBT.powi(2) * spread.max(0.0)
    };
    if discs[0].variance == 0.0 {
        return (0, Estimate { variance: quantum.powi(2), ..discs[0] });
    }
    let last = discs.len() - 1;
    let widest = (0..last).find(|&wide| !(wide + 1..=last).any(|narrow| apart(wide, narrow))).unwrap_or(last);
    let taken = (widest + 2).min(last);
    let blur = if taken == widest {
        // Nothing narrower shows how much is left: as much as the last halving took away.
        off(last.saturating_sub(1), last).powi(2)
    } else {
        // Blur grows as R²: a third of what one halving took away is left, and less of what two did.
        let noise = (variance(taken) - variance(widest)).max(0.0);
        (off(widest, taken).powi(2) - noise).max(0.0) / 9.0
    };
    (taken, Estimate { value: discs[taken].value, variance: variance(taken) + blur })
}

//! Figures of a map that lighting standards ask for.

use crate::report::IlluminanceMap;
use crate::units::Lux;

/// Figures of one illuminance map, over the cells that have a value; all zero where none has.
///
/// Cells count alike, as all have the same area. Extremes are those of the estimate, noise included: E_min reads low and
/// E_max high, by a few of the cells' standard errors where the light is even.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Cells that have a value.
    pub cells: usize,
    /// Cells that have none.
    pub cells_without_value: usize,
    /// Ē, arithmetic mean.
    pub mean: Lux,
    /// E_min, darkest cell.
    pub min: Lux,
    /// E_max, brightest cell.
    pub max: Lux,
    /// Half of the cells are darker, half brighter; the mean of the middle two for an even number.
    pub median: Lux,
    /// Standard deviation of E over the cells: light and shade of the room and noise together.
    pub deviation: Lux,
    /// Mean of the cells' standard errors (1 σ, statistical part): the noise of a typical cell, not the error of Ē.
    pub mean_standard_error: Lux,
    /// Largest of the cells' standard errors.
    pub largest_standard_error: Lux,
    /// U₀ = E_min / Ē; 0 in the dark.
    pub uniformity: f64,
    /// U_d = E_min / E_max; 0 in the dark.
    pub diversity: f64,
}

impl Statistics {
    /// Mean standard error as a part of Ē; 0 in the dark.
    pub fn relative_error(&self) -> f64 {
        ratio(self.mean_standard_error, self.mean)
    }
}

/// Figures of `map`; cells without a value, and any that isn't a finite number, don't count.
///
/// Cost: O(n), with one copy of the values for the median.
pub fn statistics(map: &IlluminanceMap) -> Statistics {
    of_cells(map, |_| true)
}

/// The same of the cells that `belongs` picks.
pub(crate) fn of_cells(map: &IlluminanceMap, belongs: impl Fn(usize) -> bool) -> Statistics {
    let mut cells = 0;
    let (mut values, errors): (Vec<f64>, Vec<f64>) = map
        .values()
        .zip(&map.standard_error)
        .enumerate()
        .filter(|(cell, _)| belongs(*cell))
        .filter_map(|(_, (value, &error))| {
            cells += 1;
            Some((value.filter(|e| e.is_finite())?, if error.is_finite() { error } else { 0.0 }))
        })
        .unzip();
    let cells_without_value = cells - values.len();
    if values.is_empty() {
        return Statistics { cells_without_value, ..Statistics::default() };
    }
    let mean = average(&values);
    let min = Lux(values.iter().copied().fold(f64::INFINITY, f64::min));
    let max = Lux(values.iter().copied().fold(f64::NEG_INFINITY, f64::max));
    let squares: Vec<_> = values.iter().map(|e| (e - mean).powi(2)).collect();
    Statistics {
        cells: values.len(),
        cells_without_value,
        mean: Lux(mean),
        min,
        max,
        median: Lux(median(&mut values)),
        deviation: Lux(average(&squares).sqrt()),
        mean_standard_error: Lux(average(&errors)),
        largest_standard_error: Lux(errors.iter().copied().fold(0.0, f64::max)),
        uniformity: ratio(min, Lux(mean)),
        diversity: ratio(min, max),
    }
}

/// Arithmetic mean of at least one number.
fn average(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Median of at least one number; changes their order.
fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    let even = values.len().is_multiple_of(2);
    let (below, &mut upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    if even { (below.iter().copied().fold(f64::NEG_INFINITY, f64::max) + upper) / 2.0 } else { upper }
}

/// part / whole, 0 where whole is.
fn ratio(part: Lux, whole: Lux) -> f64 {
    if whole.0 == 0.0 { 0.0 } else { part / whole }
}

//! Figures of a map that lighting standards ask for.

use crate::results::IlluminanceMap;
use crate::units::Lux;

/// An illuminance and its standard error (1 σ), lx.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// E, lx.
    pub lux: f64,
    /// Standard error, lx.
    pub error: f64,
}

/// What is known of the mean and the extremes of a map, or of a part of it, beyond the cells themselves: extremes that
/// were read once more, by rays that had no part in choosing the cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extremes {
    /// Standard error of Ē, lx.
    pub mean_error: f64,
    /// E_min.
    pub min: Reading,
    /// E_max.
    pub max: Reading,
}

/// Figures of one illuminance map, over the cells that have a value; all zero where none has.
///
/// Cells count alike, as all have the same area. E_min and E_max are what [`Extremes`] say; where there are none, those
/// of the cells, noise included: E_min then reads low and E_max high, by a few of the cells' standard errors where the
/// light is even.
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
    /// Standard errors (1 σ) of Ē, E_min, E_max, U₀ and U_d.
    pub errors: Errors,
    /// The cells' standard error, root mean square, as a part of Ē: what `--error` bounds.
    pub claim: f64,
}

/// Standard errors (1 σ) of the figures that standards ask for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Of Ē.
    pub mean: Lux,
    /// Of E_min.
    pub min: Lux,
    /// Of E_max.
    pub max: Lux,
    /// Of U₀.
    pub uniformity: f64,
    /// Of U_d.
    pub diversity: f64,
}

impl Errors {
    /// Those of a mean and two extremes. Ratios: relative errors add in squares, as extremes are read by rays of their
    /// own.
    pub(crate) fn of(mean: f64, Extremes { mean_error, min, max }: &Extremes) -> Self {
        let of_ratio = |to: f64, error: f64| {
            if to > 0.0 { (min.error / to).hypot(min.lux / to * (error / to)) } else { 0.0 }
        };
        Self {
            mean: Lux(*mean_error),
            min: Lux(min.error),
            max: Lux(max.error),
            uniformity: of_ratio(mean, *mean_error),
            diversity: of_ratio(max.lux, max.error),
        }
    }
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
    of_cells(map, 0..map.illuminance.len(), map.extremes.as_ref())
}

/// The same of some cells, with what is known of their extremes.
pub(crate) fn of_cells(
    map: &IlluminanceMap,
    cells: impl ExactSizeIterator<Item = usize>,
    known: Option<&Extremes>,
) -> Statistics {
    let count = cells.len();
    let (mut values, errors): (Vec<f64>, Vec<f64>) = cells
        .filter_map(|cell| {
            let error = map.standard_error[cell];
            Some((map.value(cell).filter(|e| e.is_finite())?, if error.is_finite() { error } else { 0.0 }))
        })
        .unzip();
    let cells_without_value = count - values.len();
    if values.is_empty() {
        return Statistics { cells_without_value, ..Statistics::default() };
    }
    let mean = average(&values);
    let known = known.copied().unwrap_or_else(|| as_read(&values, &errors));
    let (min, max) = (Lux(known.min.lux), Lux(known.max.lux));
    let squares_of_errors = errors.iter().map(|error| error * error).sum::<f64>();
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
        errors: Errors::of(mean, &known),
        claim: if mean > 0.0 { (squares_of_errors / errors.len() as f64).sqrt() / mean } else { 0.0 },
    }
}

/// What some values themselves say: the extreme ones with their own errors, and a mean whose error is taken as if all
/// erred together.
pub(crate) fn as_read(values: &[f64], errors: &[f64]) -> Extremes {
    let readings = || values.iter().zip(errors).map(|(&lux, &error)| Reading { lux, error });
    let by_value = |a: &Reading, b: &Reading| a.lux.total_cmp(&b.lux);
    Extremes {
        mean_error: average(errors),
        min: readings().min_by(by_value).unwrap_or_default(),
        max: readings().max_by(by_value).unwrap_or_default(),
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

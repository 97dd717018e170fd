//! Round values along a range, and the colour of each value.

use super::canvas::Ink;

/// A range of values, with ticks at round ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    /// Lowest value.
    pub(super) low: f64,
    /// Highest value, greater than `low`.
    pub(super) high: f64,
    /// Distance of the ticks: 1, 2 or 5 times a power of ten.
    pub(super) step: f64,
}

impl Scale {
    /// A scale from `low` to `high` with about `intervals` steps. Where both are equal (to a millionth) it begins at 0,
    /// where both are 0 it ends at 1.
    pub(super) fn new(low: f64, high: f64, intervals: f64) -> Self {
        let wide_enough = high - low > 1e-6 * low.abs().max(high.abs());
        let (low, high) = match (wide_enough, high) {
            (true, _) => (low, high),
            (false, 0.0) => (0.0, 1.0),
            (false, _) => (high.min(0.0), high.max(0.0)),
        };
        Self { low, high, step: round_step((high - low) / intervals.max(1.0)) }
    }

    /// Round values from `low` to `high`, both included where they are round.
    pub(super) fn ticks(&self) -> Vec<f64> {
        let first = (self.low / self.step - 1e-6).ceil();
        let last = (self.high / self.step + 1e-6).floor();
        (0..=(last - first) as usize).map(|i| (first + i as f64) * self.step + 0.0).collect()
    }

    /// A tick as text, with as many digits as tell it from its neighbours.
    pub(super) fn label(&self, tick: f64) -> String {
        let order = self.step.log10().floor();
        let largest = self.low.abs().max(self.high.abs());
        if largest >= 1e7 || self.step < 1e-4 {
            let own = if tick == 0.0 { order } else { tick.abs().log10().floor() };
            return format!("{:.*e}", (own - order).clamp(0.0, 6.0) as usize, tick);
        }
        format!("{:.*}", (-order).max(0.0) as usize, tick)
    }

    /// Where a value stands between `low` (0) and `high` (1); clamped.
    pub(super) fn share(&self, value: f64) -> f64 {
        ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0)
    }

    /// Colour of a value: viridis, as bright as the value is high, also in grey and to the colour-blind.
    pub(super) fn colour(&self, value: f64) -> Ink {
        colorous::VIRIDIS.eval_continuous(self.share(value)).as_array()
    }

    /// Black or white, whichever is read more easily on the colour of a value.
    pub(super) fn ink(&self, value: f64) -> Ink {
        let [r, g, b] = self.colour(value).map(f64::from);
        if 0.2126 * r + 0.7152 * g + 0.0722 * b > 125.0 { [10, 10, 10] } else { [255, 255, 255] }
    }
}

/// 1, 2 or 5 times a power of ten: the nearest at or above `step`.
fn round_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * power >= step * (1.0 - 1e-9));
    factor.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64) -> Vec<String> {
        let scale = Scale::new(low, high, 7.0);
        scale.ticks().into_iter().map(|tick| scale.label(tick)).collect()
    }

    #[test]
    fn ticks_are_round_and_told_apart() {
        assert_eq!(labels(98.0, 612.0), ["100", "200", "300", "400", "500", "600"]);
        assert_eq!(labels(0.0, 0.7), ["0.0", "0.1", "0.2", "0.3", "0.4", "0.5", "0.6", "0.7"]);
        assert_eq!(labels(0.0, 1e9), ["0e0", "2e8", "4e8", "6e8", "8e8", "1.0e9"]);
        assert_eq!(labels(0.0, 1e-6), ["0e0", "2e-7", "4e-7", "6e-7", "8e-7", "1.0e-6"]);
        assert_eq!(labels(1000.1, 1000.3), ["1000.10", "1000.15", "1000.20", "1000.25", "1000.30"]);
    }

    #[test]
    fn a_constant_has_a_scale_from_nothing() {
        assert_eq!(labels(0.0, 0.0).last().map(String::as_str), Some("1.0"));
        assert_eq!(labels(500.0, 500.0), ["0", "100", "200", "300", "400", "500"]);
    }
}

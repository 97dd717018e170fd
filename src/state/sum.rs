//! Sums whose bits do not depend on the order in which their parts come.
//!
//! What several processes find is added up in another order than one process would. A plain `f64` sum then differs in
//! its last bits; of a sum in two `f64`, the second holding what the first had to round away, only the last bits of the
//! second do, some 2⁻¹⁰⁶ of the sum, and the first is the exact sum rounded once.

/// A sum that rounds only when it is read.
///
/// Its value is the same whatever the order of its parts, but where the exact sum lies within about 2⁻⁵⁰ of a rounding
/// step from the middle between two `f64`: a chance of 10⁻¹⁵. Parts are finite and below 2¹⁰⁰⁰.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sum {
    /// The sum, rounded.
    high: f64,
    /// What rounding took away.
    low: f64,
}

impl Sum {
    /// No part yet.
    pub const ZERO: Self = Self { high: 0.0, low: 0.0 };

    /// Adds a part. Cost: ten operations.
    #[inline]
    pub fn add(&mut self, part: f64) {
        // Knuth's two-sum: the rounding error of a sum of two numbers is a number itself.
        let sum = self.high + part;
        let of_part = sum - self.high;
        let lost = (self.high - (sum - of_part)) + (part - of_part);
        let low = self.low + lost;
        self.high = sum + low;
        self.low = low - (self.high - sum);
    }

    /// Adds all parts of another sum.
    #[inline]
    pub fn merge(&mut self, other: Self) {
        self.add(other.high);
        self.add(other.low);
    }

    /// The sum.
    #[inline]
    pub fn value(self) -> f64 {
        self.high
    }

    /// Its two numbers, as they are kept in files.
    pub(crate) fn parts(self) -> [f64; 2] {
        [self.high, self.low]
    }

    /// The sum that was kept as two numbers.
    pub(crate) fn from_parts([high, low]: [f64; 2]) -> Self {
        Self { high, low }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(parts: impl IntoIterator<Item = f64>) -> Sum {
        let mut sum = Sum::ZERO;
        parts.into_iter().for_each(|part| sum.add(part));
        sum
    }

    /// Parts of very different size, as the light that rays find: forwards, backwards and in shares, the bits are the
    /// same, where a plain sum's are not.
    #[test]
    fn order_and_grouping_do_not_change_the_bits() {
        let part = |i: u32| {
            let mixed = f64::from(i.wrapping_mul(2_654_435_761) % 1_000_003) / 1_000_003.0;
            mixed * 10.0_f64.powi((i % 13) as i32 - 6)
        };
        let parts: Vec<f64> = (0..10_000).map(part).collect();
        let forwards = sum(parts.iter().copied());
        assert_eq!(forwards.value().to_bits(), sum(parts.iter().rev().copied()).value().to_bits());
        for shares in [2, 3, 7] {
            let share = |first| sum(parts.iter().skip(first).step_by(shares).copied());
            let mut merged = Sum::ZERO;
            (0..shares).rev().for_each(|first| merged.merge(share(first)));
            assert_eq!(forwards.value().to_bits(), merged.value().to_bits(), "{shares} shares");
        }
        let plain: f64 = parts.iter().sum();
        let backwards: f64 = parts.iter().rev().sum();
        assert_ne!(plain.to_bits(), backwards.to_bits(), "the parts are no challenge");
    }

    #[test]
    fn what_a_plain_sum_loses_is_kept() {
        assert_eq!(sum([1.0, 1e-20, -1.0]).value(), 1e-20);
        assert_eq!(sum((0..1_000_000).map(|_| 0.1)).value(), 100_000.0);
    }
}

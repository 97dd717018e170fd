//! Which passes a state holds.

use serde::{Deserialize, Serialize};

/// Passes that follow each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PassRange {
    /// Seed of their random streams.
    pub seed: u64,
    /// The first.
    pub first: u32,
    /// How many.
    pub count: u32,
}

impl PassRange {
    fn end(&self) -> u64 {
        u64::from(self.first) + u64::from(self.count)
    }
}

/// A set of passes: ranges in order, none touching the next.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Passes(Vec<PassRange>);

impl Passes {
    /// Those of one range.
    pub fn of(range: PassRange) -> Self {
        Self(if range.count > 0 { vec![range] } else { Vec::new() })
    }

    /// Adds passes; the first that was there already is the error.
    pub fn add(&mut self, other: &Self) -> Result<(), (u64, u32)> {
        let mut all = [self.0.as_slice(), other.0.as_slice()].concat();
        all.sort();
        let mut ranges: Vec<PassRange> = Vec::with_capacity(all.len());
        for range in all {
            match ranges.last_mut().filter(|last| last.seed == range.seed) {
                Some(last) if last.end() > u64::from(range.first) => return Err((range.seed, range.first)),
                Some(last) if last.end() == u64::from(range.first) => last.count += range.count,
                _ => ranges.push(range),
            }
        }
        self.0 = ranges;
        Ok(())
    }

    /// Whether it has all passes from `first` to before `end`, of a seed.
    pub fn has_all(&self, seed: u64, first: u64, end: u64) -> bool {
        self.0.iter().any(|range| range.seed == seed && u64::from(range.first) <= first && end <= range.end())
    }

    /// Number of passes.
    pub fn len(&self) -> u32 {
        self.0.iter().map(|range| range.count).sum()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The ranges, in order.
    pub fn ranges(&self) -> &[PassRange] {
        &self.0
    }

    /// Whether this is what a file may say: ranges in order, none empty, none past the last number, none meeting the
    /// next.
    pub fn is_valid(&self) -> bool {
        let whole = |range: &PassRange| range.count > 0 && range.end() <= u64::from(u32::MAX);
        let apart = |pair: &[PassRange]| pair[0].seed < pair[1].seed || pair[0].end() < u64::from(pair[1].first);
        let counts: u64 = self.0.iter().map(|range| u64::from(range.count)).sum();
        self.0.iter().all(whole) && self.0.is_sorted() && self.0.windows(2).all(apart) && counts <= u64::from(u32::MAX)
    }
}

impl std::fmt::Display for Passes {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (index, PassRange { seed, first, count }) in self.0.iter().enumerate() {
            let comma = if index > 0 { ", " } else { "" };
            // An empty range is told, too: a file that was tampered with may hold one.
            let last = (u64::from(*first) + u64::from(*count)).saturating_sub(1);
            write!(f, "{comma}{first} … {last} of seed {seed}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(seed: u64, first: u32, count: u32) -> Passes {
        Passes::of(PassRange { seed, first, count })
    }

    #[test]
    fn ranges_join_in_any_order_and_never_twice() {
        let mut passes = range(0, 4, 4);
        passes.add(&range(1, 0, 2)).expect("another seed");
        passes.add(&range(0, 8, 1)).expect("the next");
        passes.add(&range(0, 0, 4)).expect("those before");
        assert_eq!(
            passes.ranges(),
            [PassRange { seed: 0, first: 0, count: 9 }, PassRange { seed: 1, first: 0, count: 2 }]
        );
        assert!(passes.is_valid());
        assert!(passes.has_all(0, 2, 9) && !passes.has_all(0, 2, 10) && !passes.has_all(1, 1, 3));
        assert_eq!(passes.add(&range(0, 8, 3)), Err((0, 8)));
        assert_eq!(passes.len(), 11);
        let empty = Passes(vec![PassRange { seed: 7, first: 0, count: 0 }]);
        assert_eq!((empty.to_string().as_str(), empty.is_valid()), ("0 … 0 of seed 7", false));
        assert_eq!(passes.to_string(), "0 … 8 of seed 0, 0 … 1 of seed 1");
    }
}

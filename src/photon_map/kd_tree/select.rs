//! The k-th smallest of many numbers, by counting instead of sorting.

use super::simd::{LANES, LaneRows, Lanes};

/// Where the k-th smallest number lies: `below` of the numbers are ≤ `low`, `upto` are ≤ `high`, `below` < k ≤ `upto`.
#[derive(Clone, Copy)]
pub(super) struct Bracket {
    pub(super) low: f32,
    pub(super) below: usize,
    pub(super) high: f32,
    pub(super) upto: usize,
}

/// The k-th smallest of some numbers, and how many of them are not greater: more than k where some are equal to it.
#[derive(Clone, Copy)]
pub(super) struct Kth {
    pub(super) value: f32,
    pub(super) upto: usize,
}

/// The k-th smallest of `blocks` (k from 1), which lies in `bracket`. Numbers above the bracket may be anything but
/// NaN.
///
/// Two thresholds are interpolated between the bracket's ends, one on either side of where the k-th lies if the numbers
/// are spread evenly (squared distances on a surface are), and the numbers up to each are counted, 16 at a time. Every
/// fourth round halves the numbers that `f32` has between the ends instead, which ends the search after 128 rounds at
/// the latest; two are usual. Of the last 16 candidates the ranks are counted.
#[inline(always)]
pub(super) fn kth_smallest<L: Lanes>(lanes: L, blocks: &[[f32; LANES]], k: usize, mut bracket: Bracket) -> Kth {
    let mut round = 0;
    while bracket.upto - bracket.below > LANES {
        let Bracket { low, below, high, upto } = bracket;
        let (from, to) = (ordered(low), ordered(high));
        if to - from <= 1 {
            return Kth { value: high, upto };
        }
        let (before, all) = ((k - below) as f32, (upto - below) as f32);
        let off = (1.5 * (before * (all - before) / all).sqrt()).clamp(4.0, 7.0);
        let place = |rank: f32| low + (high - low) * (rank / all);
        let mut thresholds = [place(before - off), place(before + off)];
        if round % 4 == 3 {
            thresholds = [unordered(from + (to - from) / 2); 2];
        }
        let counts = count_at_most(lanes, blocks, thresholds);
        for (threshold, count) in thresholds.into_iter().zip(counts) {
            bracket.narrow(k, threshold, count);
        }
        round += 1;
    }
    let mut candidates = LaneRows([[f32::INFINITY; LANES]; 2]);
    let mut count = 0;
    let (above, limit) = (lanes.splat(bracket.low), lanes.splat(bracket.high));
    for block in blocks {
        let block = lanes.load(block);
        let mask = lanes.less(above, block) & lanes.at_most(block, limit);
        let free = candidates.0.as_flattened_mut().get_mut(count..);
        if let Some(free) = free.and_then(<[f32]>::first_chunk_mut) {
            lanes.store(lanes.compress(mask, block), free);
        }
        count += mask.count_ones() as usize;
    }
    let candidates = &mut candidates.0[0];
    // What follows the candidates is of no meaning.
    candidates[count.min(LANES)..].fill(f32::INFINITY);
    let vector = lanes.load(candidates);
    let mut kth = Kth { value: bracket.high, upto: bracket.upto };
    for &candidate in &candidates[..count.min(LANES)] {
        let upto = bracket.below + lanes.at_most(vector, lanes.splat(candidate)).count_ones() as usize;
        if k <= upto && upto <= kth.upto {
            kth = Kth { value: candidate, upto };
        }
    }
    kth
}

impl Bracket {
    /// Draws one end to a threshold up to which there are `count` numbers.
    #[inline(always)]
    fn narrow(&mut self, k: usize, threshold: f32, count: usize) {
        if count >= k {
            if threshold < self.high {
                (self.high, self.upto) = (threshold, count);
            }
        } else if threshold > self.low {
            (self.low, self.below) = (threshold, count);
        }
    }
}

/// How many numbers are ≤ each of two thresholds.
#[inline(always)]
pub(super) fn count_at_most<L: Lanes>(lanes: L, blocks: &[[f32; LANES]], thresholds: [f32; 2]) -> [usize; 2] {
    let (first, second) = (lanes.splat(thresholds[0]), lanes.splat(thresholds[1]));
    let mut counts = [0; 2];
    for block in blocks {
        let block = lanes.load(block);
        counts[0] += lanes.at_most(block, first).count_ones() as usize;
        counts[1] += lanes.at_most(block, second).count_ones() as usize;
    }
    counts
}

/// Numbers the finite `f32` in their order.
#[inline(always)]
fn ordered(value: f32) -> i64 {
    let bits = i64::from(value.to_bits());
    if bits < 0x8000_0000 { bits } else { 0x8000_0000 - bits }
}

/// The number of an [`ordered`] place.
#[inline(always)]
fn unordered(place: i64) -> f32 {
    f32::from_bits(if place >= 0 { place as u32 } else { (0x8000_0000 - place) as u32 })
}

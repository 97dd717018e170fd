//! Whether what is asked for is reached, as far as the errors let it be said.

use std::fmt;

use super::met::{is_within, reaches};
use crate::text::number::round_down_to;

/// One-sided quantile of the normal distribution: what is said is wrong in no more than 5 % of all cases on the limit.
const CONFIDENCE: f64 = 1.645;

/// A finer run than this many times is not proposed: the figure lies on its limit.
const MOST_FINER: f64 = 30.0;

/// Whether a figure reaches its limit, with 95 % confidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// It does.
    Met,
    /// It does not.
    Missed,
    /// Its error is too large to say.
    Undecided {
        /// The `--error` (%) with which it would, were the figure what it reads now; `None` where the limit is too
        /// near.
        needs: Option<f64>,
    },
}

impl Verdict {
    /// Of a figure with a standard error, found by a run of this claim (a part, as `--error` bounds it).
    pub(crate) fn of(found: f64, error: f64, least: f64, claim: f64) -> Self {
        let (distance, doubt) = ((found - least).abs(), CONFIDENCE * error);
        if distance >= doubt {
            return if found >= least { Self::Met } else { Self::Missed };
        }
        let share = distance / doubt;
        let needs = (share * MOST_FINER > 1.0 && claim > 0.0).then(|| round_down_to(100.0 * claim * share, 2));
        Self::Undecided { needs }
    }

    /// Of E that is known within ± `error` (lx), for the least and the most that is welcome. Met is a target only where
    /// E is above it by `spare`, which is more than the error if renders that check it are to find the same.
    pub fn within(lux: f64, spare: f64, error: f64, band: [f64; 2]) -> Self {
        let [least, most] = band;
        if is_within(lux - spare, [least, f64::INFINITY]) && is_within(lux + error, [0.0, most]) {
            Self::Met
        } else if !reaches(lux + error, least) || !is_within(lux - error, [f64::NEG_INFINITY, most]) {
            Self::Missed
        } else {
            Self::Undecided { needs: None }
        }
    }

    /// In one word or two.
    pub fn word(self) -> &'static str {
        match self {
            Self::Met => "met",
            Self::Missed => "missed",
            Self::Undecided { .. } => "not decided",
        }
    }

    /// Of two criteria together: missed if either is, met if both are.
    pub(crate) fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Missed, _) | (_, Self::Missed) => Self::Missed,
            (Self::Met, other) => other,
            (one, Self::Met) => one,
            (Self::Undecided { needs: one }, Self::Undecided { needs: other }) => {
                Self::Undecided { needs: one.zip(other).map(|(one, other)| one.min(other)) }
            }
        }
    }

    /// Whether it is met; `None` where that isn't decided.
    pub fn met(self) -> Option<bool> {
        match self {
            Self::Met => Some(true),
            Self::Missed => Some(false),
            Self::Undecided { .. } => None,
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Met | Self::Missed => out.write_str(self.word()),
            Self::Undecided { needs: Some(error) } => write!(out, "not decided: needs --error {error}"),
            Self::Undecided { needs: None } => out.write_str("not decided: on the limit"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1.645 σ either side of 500 lx is not decided. At 505 ± 5, half of it would do to be 1.645 · 2 σ off: claims
    /// scale with it.
    #[test]
    fn what_an_error_leaves_open_is_not_decided() {
        let judged = |found, error| Verdict::of(found, error, 500.0, 0.01);
        assert_eq!((judged(500.0, 0.0), judged(499.9, 0.0)), (Verdict::Met, Verdict::Missed));
        assert_eq!((judged(508.3, 5.0), judged(491.7, 5.0)), (Verdict::Met, Verdict::Missed));
        assert_eq!(judged(505.0, 5.0), Verdict::Undecided { needs: Some(0.6) });
        assert_eq!(judged(505.0, 5.0).to_string(), "not decided: needs --error 0.6");
        assert_eq!(judged(500.1, 5.0), Verdict::Undecided { needs: None });
        // With the error proposed, which scales with the claim, the same figure is decided.
        assert_eq!(Verdict::of(505.0, 5.0 * 0.6, 500.0, 0.006), Verdict::Met);
    }

    #[test]
    fn one_criterion_missed_is_enough() {
        let (open, finer) = (Verdict::Undecided { needs: Some(0.5) }, Verdict::Undecided { needs: Some(0.2) });
        assert_eq!(Verdict::Met.and(open), open);
        assert_eq!(open.and(finer), finer);
        assert_eq!(open.and(Verdict::Missed), Verdict::Missed);
        assert_eq!(Verdict::Met.and(Verdict::Met), Verdict::Met);
    }

    #[test]
    fn on_the_target_and_on_its_tolerance_is_met() {
        for lux in [500.0, 550.0, 500.0 * (1.0 - 1e-9), 550.0 * (1.0 + 1e-9), 0.1 + 549.9] {
            assert_eq!(Verdict::within(lux, 0.0, 0.0, [500.0, 550.0]), Verdict::Met, "{lux}");
        }
        for (lux, verdict) in [
            (499.9, Verdict::Missed),
            (550.1, Verdict::Missed),
            (510.0, Verdict::Met),
            (501.0, Verdict::Undecided { needs: None }),
        ] {
            let doubt = if lux == 501.0 { 2.0 } else { 0.0 };
            assert_eq!(Verdict::within(lux, doubt, doubt, [500.0, 550.0]), verdict, "{lux}");
        }
        assert_eq!(Verdict::within(549.0, 2.0, 2.0, [500.0, 550.0]), Verdict::Undecided { needs: None });
        assert_eq!(Verdict::within(502.0, 3.0, 1.0, [500.0, 550.0]), Verdict::Undecided { needs: None });
        assert_eq!(Verdict::within(0.0, 0.0, 0.0, [0.0, f64::INFINITY]), Verdict::Met);
    }
}

//! Whether a target is met: one answer for terminal, JSON, pages and exit codes.

/// Shares of a target that don't matter, whatever rounding left them: none of the digits printed shows them.
pub const ROUNDING: f64 = 1e-6;

/// How sure it must be that all targets are met, where nobody says.
pub const CONFIDENCE: f64 = 0.95;

/// Whether E (lx) reaches a target.
pub fn reaches(lux: f64, target: f64) -> bool {
    lux >= target * (1.0 - ROUNDING)
}

/// Whether E (lx) is neither below the least nor above the most that is welcome.
pub fn is_within(lux: f64, [least, most]: [f64; 2]) -> bool {
    reaches(lux, least) && lux <= most * (1.0 + ROUNDING) + ROUNDING
}

/// What can be said of a target where E is known within an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// E is where it should be, with the confidence asked for.
    Met,
    /// It isn't, with the same confidence.
    Missed,
    /// The error is too large to say.
    Undecided,
}

impl Verdict {
    /// Of E that is known within ± `error` (lx), for the least and the most that is welcome. Met is a target only where E is
    /// above it by `spare`, which is more than the error if renders that check it are to find the same.
    pub fn of(lux: f64, spare: f64, error: f64, band: [f64; 2]) -> Self {
        let [least, most] = band;
        if is_within(lux - spare, [least, f64::INFINITY]) && is_within(lux + error, [0.0, most]) {
            Self::Met
        } else if !reaches(lux + error, least) || !is_within(lux - error, [f64::NEG_INFINITY, most]) {
            Self::Missed
        } else {
            Self::Undecided
        }
    }

    /// In words.
    pub fn word(self) -> &'static str {
        match self {
            Self::Met => "met",
            Self::Missed => "missed",
            Self::Undecided => "not decided",
        }
    }
}

/// How many σ a normal deviate stays within on one side so that all of `count` do with this confidence (0 … 1), by Bonferroni's
/// inequality; Hastings' approximation of the quantile, within 5·10⁻⁴ (Abramowitz and Stegun 26.2.23).
pub fn sigmas(confidence: f64, count: usize) -> f64 {
    let tail = ((1.0 - confidence) / count.max(1) as f64).clamp(1e-15, 0.5);
    let t = (-2.0 * tail.ln()).sqrt();
    let above = 2.515_517 + t * (0.802_853 + t * 0.010_328);
    let below = 1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308));
    (t - above / below).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sigmas_are_quantiles_of_the_normal_distribution() {
        for (confidence, count, expected) in
            [(0.95, 1, 1.644_85), (0.95, 2, 1.959_96), (0.99, 10, 3.090_23), (0.5, 1, 0.0), (0.999_999, 1, 4.753_42)]
        {
            let found = sigmas(confidence, count);
            assert!((found - expected).abs() < 5e-4, "{confidence}, {count}: {found}, expected {expected}");
        }
    }

    #[test]
    fn on_the_target_and_on_its_tolerance_is_met() {
        for lux in [500.0, 550.0, 500.0 * (1.0 - 1e-9), 550.0 * (1.0 + 1e-9), 0.1 + 549.9] {
            assert_eq!(Verdict::of(lux, 0.0, 0.0, [500.0, 550.0]), Verdict::Met, "{lux}");
        }
        for (lux, verdict) in
            [(499.9, Verdict::Missed), (550.1, Verdict::Missed), (510.0, Verdict::Met), (501.0, Verdict::Undecided)]
        {
            let doubt = if lux == 501.0 { 2.0 } else { 0.0 };
            assert_eq!(Verdict::of(lux, doubt, doubt, [500.0, 550.0]), verdict, "{lux}");
        }
        assert_eq!(Verdict::of(549.0, 2.0, 2.0, [500.0, 550.0]), Verdict::Undecided);
        assert_eq!(Verdict::of(502.0, 3.0, 1.0, [500.0, 550.0]), Verdict::Undecided);
        assert_eq!(Verdict::of(0.0, 0.0, 0.0, [0.0, f64::INFINITY]), Verdict::Met);
    }
}

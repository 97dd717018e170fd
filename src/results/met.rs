//! Whether a target is met: one answer for terminal, JSON, pages and exit codes.

/// Shares of a target that don't matter, whatever rounding left them: none of the digits printed shows them.
pub const ROUNDING: f64 = 1e-6;

/// Confidence with which all targets must be met, where none is given.
pub const CONFIDENCE: f64 = 0.95;

/// Whether E (lx) reaches a target.
pub fn reaches(lux: f64, target: f64) -> bool {
    lux >= target * (1.0 - ROUNDING)
}

/// Whether E (lx) is neither below the least nor above the most that is welcome.
pub fn is_within(lux: f64, [least, most]: [f64; 2]) -> bool {
    reaches(lux, least) && lux <= most * (1.0 + ROUNDING) + ROUNDING
}

/// How many σ a normal deviate stays within on one side so that all of `count` do with this confidence (0 … 1), by
/// Bonferroni's inequality; Hastings' approximation of the quantile, within 5·10⁻⁴ (Abramowitz and Stegun 26.2.23).
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
}

//! Angles by + − × ÷ alone, which every machine rounds alike: the system's sine may differ in its last bit.

use std::f64::consts::FRAC_PI_2;

/// (cos, sin) of so many full turns, exact at quarters, elsewhere to 10⁻¹⁵: Taylor series within an eighth of a turn of
/// the nearest quarter.
pub fn circle(turns: f64) -> [f64; 2] {
    let quarter = (4.0 * turns + 0.5).floor();
    let angle = (4.0 * turns - quarter) * FRAC_PI_2;
    let square = angle * angle;
    // 1 − x²/(k (k + 1)) (1 − x²/((k + 2)(k + 3)) (…)), from the inside out.
    let series = |first: u32| {
        (0..9).rev().fold(1.0, |sum, term| {
            let k = f64::from(first + 2 * term);
            1.0 - square / (k * (k + 1.0)) * sum
        })
    };
    let (cos, sin) = (series(1), angle * series(2));
    match quarter.rem_euclid(4.0) as u32 {
        0 => [cos, sin],
        1 => [-sin, cos],
        2 => [-cos, -sin],
        _ => [sin, -cos],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn the_circle_is_the_systems_to_rounding_and_exact_at_quarters() {
        for step in -2000..2000 {
            let turns = f64::from(step) / 777.0;
            let (sin, cos) = (turns * TAU).sin_cos();
            let [x, y] = circle(turns);
            // The system's argument is rounded too: 2.6 turns · 2π · 2⁻⁵³ ≈ 2·10⁻¹⁵.
            assert!((x - cos).abs() < 4e-15 && (y - sin).abs() < 4e-15, "{turns}: ({x}, {y}), expected ({cos}, {sin})");
        }
        for (turns, exact) in [(0.0, [1.0, 0.0]), (0.25, [0.0, 1.0]), (-0.5, [-1.0, 0.0]), (1.75, [0.0, -1.0])] {
            assert_eq!(circle(turns), exact);
        }
    }
}

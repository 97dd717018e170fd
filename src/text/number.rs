//! Numbers as text, for people and for programs.

/// A number for a person: four significant digits, as `352.6`, `0.01234`, `1.2e9`.
pub(crate) fn short(value: f64) -> String {
    plain_or_scientific(round_to(value, 4), 4)
}

/// A number with its standard error, to two digits of that: `43.70 ± 0.62`; by itself where the error is nothing beside
/// it.
pub(crate) fn with_error(value: f64, error: f64) -> String {
    if error <= 1e-5 * value.abs() || !error.is_finite() {
        return short(value);
    }
    digits_of_error(value, error)
}

/// A ratio from 0 to 1 with its standard error; to a hundredth where there is none.
pub(crate) fn ratio_with_error(value: f64, error: f64) -> String {
    if error <= 1e-5 || !error.is_finite() { format!("{value:.2}") } else { digits_of_error(value, error) }
}

fn digits_of_error(value: f64, error: f64) -> String {
    let decimals = (1 - error.log10().floor() as i32).clamp(0, 9) as usize;
    format!("{value:.decimals$} ± {error:.decimals$}")
}

/// A number of a balance, where small losses must show: seven significant digits.
pub(crate) fn long(value: f64) -> String {
    plain_or_scientific(round_to(value, 7), 7)
}

/// A part of a whole in per cent, to a hundredth: `0.35`, `99.98`, `100`.
pub(crate) fn percent(part: f64) -> String {
    format!("{}", (part * 1e4).round() / 1e2)
}

/// A part of a whole in per cent, to a ten-thousandth, where small losses must show.
pub(crate) fn fine_percent(part: f64) -> String {
    format!("{}", (part * 1e6).round() / 1e4)
}

/// Bytes, as MB or GB.
pub(crate) fn bytes(bytes: u64) -> String {
    if bytes >= 1_000_000_000 {
        format!("{:.2} GB", bytes as f64 / 1e9)
    } else {
        format!("{} MB", short(bytes as f64 / 1e6))
    }
}

/// Seconds as `0.85 ms`, `3.42 s`, `2 min 05 s`, `1 h 02 min`.
pub(crate) fn duration(seconds: f64) -> String {
    let whole = seconds.max(0.0).round();
    let (hours, minutes) = ((whole / 3600.0).floor(), (whole / 60.0).floor() % 60.0);
    match whole {
        s if s >= 3600.0 => format!("{hours} h {minutes:02} min"),
        s if s >= 120.0 => format!("{minutes} min {:02} s", s % 60.0),
        _ if seconds < 0.9995 => format!("{} ms", plain_or_scientific(round_to(1e3 * seconds, 3), 3)),
        _ => format!("{} s", plain_or_scientific(round_to(seconds, 3), 3)),
    }
}

/// A count with its digits in threes: `1 200 000` (no-break spaces).
pub(crate) fn count(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push('\u{a0}');
        }
        text.push(digit);
    }
    text
}

/// Rounded to so many significant digits.
pub(crate) fn round_to(value: f64, digits: i32) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let shift = digits - 1 - value.abs().log10().floor() as i32;
    match shift {
        0..=22 => (value * 10f64.powi(shift)).round() / 10f64.powi(shift),
        -22..0 => (value / 10f64.powi(-shift)).round() * 10f64.powi(-shift),
        _ => value, // powers of ten beyond 10²² aren't exact
    }
}

/// Rounded to so many significant digits, towards 0.
pub(crate) fn round_down_to(value: f64, digits: i32) -> f64 {
    let rounded = round_to(value, digits);
    if rounded.abs() <= value.abs() {
        return rounded;
    }
    // Half a unit of the last digit less rounds to the digit below.
    let unit = 10f64.powi(value.abs().log10().floor() as i32 + 1 - digits);
    round_to(value - value.signum() * 0.5 * unit, digits)
}

/// Shortest digits that read back as `value`; `1.2e9` beyond the range a person reads easily.
pub(crate) fn plain_or_scientific(value: f64, digits: i32) -> String {
    let size = value.abs();
    if size != 0.0 && (size < 1e-3 || size >= 10f64.powi(digits.max(7))) {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_for_people_have_four_digits() {
        for (value, text) in [
            (352.5704, "352.6"),
            (0.0, "0"),
            (1_234_567.0, "1235000"),
            (1.23456e9, "1.235e9"),
            (1.23456e-6, "1.235e-6"),
            (-0.012_344, "-0.01234"),
            (500.0, "500"),
            (99_995.1, "100000"),
        ] {
            assert_eq!(short(value), text);
        }
    }

    #[test]
    fn durations_and_counts_read_easily() {
        assert_eq!(duration(3.4211), "3.42 s");
        assert_eq!(duration(0.00085), "0.85 ms");
        assert_eq!(duration(125.2), "2 min 05 s");
        assert_eq!(duration(3725.0), "1 h 02 min");
        assert_eq!(count(1_200_000), "1\u{a0}200\u{a0}000");
        assert_eq!(count(42), "42");
        assert_eq!(percent(0.999_98), "100");
        assert_eq!(percent(0.003_51), "0.35");
    }
}

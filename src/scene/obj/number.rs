//! Decimal numbers, read as `str::parse::<f64>` reads them, to the bit, but faster where that is simple.

/// Powers of ten that `f64` holds exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// The number that a word is; `None` for anything that is no number, infinite ones among it.
///
/// A whole number up to 2⁵³ over a power of ten up to 10²² are both exact, so that their quotient is rounded once, as
/// it should be (Clinger 1990). The standard library does the rest.
#[inline]
pub(super) fn parse(word: &[u8]) -> Option<f64> {
    let (negative, digits) = match word {
        [b'-', digits @ ..] => (true, digits),
        [b'+', digits @ ..] => (false, digits),
        digits => (false, digits),
    };
    let (mut whole, mut point) = (0_u64, None);
    for (place, &byte) in digits.iter().enumerate() {
        match byte {
            b'0'..=b'9' => whole = whole.wrapping_mul(10).wrapping_add(u64::from(byte - b'0')),
            b'.' if point.is_none() => point = Some(place),
            _ => return standard(word),
        }
    }
    let count = digits.len() - usize::from(point.is_some());
    if !(1..=19).contains(&count) || whole > 1 << 53 {
        return standard(word);
    }
    let decimals = point.map_or(0, |place| digits.len() - 1 - place);
    let number = whole as f64 / POWERS[decimals];
    Some(if negative { -number } else { number })
}

fn standard(word: &[u8]) -> Option<f64> {
    str::from_utf8(word).ok()?.parse().ok().filter(|number: &f64| number.is_finite())
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn same(word: &str) {
        assert_eq!(parse(word.as_bytes()).map(f64::to_bits), standard(word.as_bytes()).map(f64::to_bits), "{word}");
    }

    #[test]
    fn odd_numbers_are_read_as_the_standard_library_does() {
        let odd = "0 -0 +0 . - + -. 1. .5 -.5 +.5 1..2 1.2.3 --1 +-1 1e5 1E-5 1e 1e400 inf nan -infinity 0x1 1_0 ١ \
                   9007199254740992 9007199254740993 9999999999999999999 99999999999999999999 0.00000000000000000001 \
                   0.0000000000000000001 18446744073709551616 1.7976931348623159e308 4.9e-324 123456.789012345678";
        odd.split(' ').chain([""]).for_each(same);
    }

    proptest! {
        #[test]
        fn numbers_are_read_to_the_bit(word in "[+-]?[0-9]{0,12}(\\.[0-9]{0,12})?([eE][+-]?[0-9]{1,3})?") {
            same(&word);
        }

        #[test]
        fn what_programs_write_is_read_to_the_bit(number in -1e9..1e9_f64, decimals in 0_usize..18) {
            same(&format!("{number:.decimals$}"));
            same(&number.to_string());
        }
    }
}

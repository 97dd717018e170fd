//! Colours of light, as linear Rec. 709 triples of luminance 1.

use crate::units;

/// The colour of `rgb`, scaled to luminance 1 so that the flux in lumens stays what it is. At least one channel of
/// `rgb` is above 0, none below.
pub(crate) fn normalised(rgb: [f64; 3]) -> [f64; 3] {
    if rgb[0] == rgb[1] && rgb[1] == rgb[2] {
        return [1.0; 3]; // exactly: a colourless scene needs one channel only
    }
    let largest = rgb.iter().fold(0.0, |largest: f64, &channel| largest.max(channel));
    let rgb = rgb.map(|channel| channel / largest);
    let luminance = units::luminance(rgb);
    rgb.map(|channel| channel / luminance)
}

/// The colour of a black body of `kelvin`, 1000 … 25000 K.
///
/// CIE 1960 (u, v) by the rational approximation of M. Krystek, "An algorithm to calculate correlated colour
/// temperature", Color Research & Application 10 (1985), as reprinted in Wikipedia, "Planckian locus", § Approximation.
/// It was made for 1000 … 15000 K; above, y reads up to 0.0016 too low at 25000 K (against Kim et al.'s cubic there),
/// which no eye sees. Colours outside of Rec. 709 (below about 1900 K) lose their negative channel before the luminance
/// is set to 1.
pub(crate) fn black_body(kelvin: f64) -> [f64; 3] {
    let t = kelvin;
    let u = (0.860_117_757 + 1.541_182_54e-4 * t + 1.286_412_12e-7 * t * t)
        / (1.0 + 8.424_202_35e-4 * t + 7.081_451_63e-7 * t * t);
    let v = (0.317_398_726 + 4.228_062_45e-5 * t + 4.204_816_91e-8 * t * t)
        / (1.0 - 2.897_418_16e-5 * t + 1.614_560_53e-7 * t * t);
    let (x, y) = (3.0 * u / (2.0 * u - 8.0 * v + 4.0), 2.0 * v / (2.0 * u - 8.0 * v + 4.0));
    let xyz = [x / y, 1.0, (1.0 - x - y) / y];
    // XYZ → linear Rec. 709, white D65 (the matrix of IEC 61966-2-1).
    let rgb = [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
        .map(|row: [f64; 3]| row.iter().zip(xyz).map(|(weight, value)| weight * value).sum::<f64>().max(0.0));
    normalised(rgb)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_temperature_has_luminance_1_and_no_negative_channel() {
        for kelvin in (1000..=25000).step_by(250) {
            let rgb = black_body(f64::from(kelvin));
            assert!((units::luminance(rgb) - 1.0).abs() < 1e-12, "{kelvin} K: {rgb:?}");
            assert!(rgb.iter().all(|&channel| channel >= 0.0), "{kelvin} K: {rgb:?}");
        }
    }

    #[test]
    fn hotter_is_bluer_and_6500_k_is_nearly_white() {
        let blue_of = |kelvin: f64| black_body(kelvin)[2] / black_body(kelvin)[0];
        assert!(blue_of(2700.0) < blue_of(4000.0) && blue_of(4000.0) < blue_of(10_000.0));
        assert!(black_body(6500.0).iter().all(|channel| (channel - 1.0).abs() < 0.05), "{:?}", black_body(6500.0));
    }

    #[test]
    fn grey_is_exactly_one() {
        assert_eq!(normalised([0.3; 3]), [1.0; 3]);
    }

    #[test]
    fn green_alone_carries_its_flux_in_one_channel() {
        assert!((normalised([0.0, 1e-300, 0.0])[1] * 0.7152 - 1.0).abs() < 1e-12);
    }
}

//! Photometric quantities as types, so that a lumen can't be taken for a lux.

use std::fmt;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Mul, Sub};

macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident, $unit:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
        pub struct $name(pub f64);

        impl Add for $name {
            type Output = Self;
            fn add(self, other: Self) -> Self {
                Self(self.0 + other.0)
            }
        }
        impl AddAssign for $name {
            fn add_assign(&mut self, other: Self) {
                self.0 += other.0;
            }
        }
        impl Sub for $name {
            type Output = Self;
            fn sub(self, other: Self) -> Self {
                Self(self.0 - other.0)
            }
        }
        impl Mul<f64> for $name {
            type Output = Self;
            fn mul(self, factor: f64) -> Self {
                Self(self.0 * factor)
            }
        }
        impl Div for $name {
            type Output = f64;
            fn div(self, other: Self) -> f64 {
                self.0 / other.0
            }
        }
        impl Sum for $name {
            fn sum<I: Iterator<Item = Self>>(quantities: I) -> Self {
                quantities.fold(Self(0.0), Add::add)
            }
        }
        impl fmt::Display for $name {
            /// Writes the number, at the precision asked for, and its unit.
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Display::fmt(&self.0, f)?;
                f.write_str(concat!(" ", $unit))
            }
        }
    };
}

quantity!(
    /// Luminous flux Φ, lm.
    Lumens,
    "lm"
);
quantity!(
    /// Illuminance E = dΦ/dA, lx: light arriving at a surface.
    Lux,
    "lx"
);
quantity!(
    /// Area A, m².
    SquareMetres,
    "m²"
);

impl Div<SquareMetres> for Lumens {
    type Output = Lux;
    fn div(self, area: SquareMetres) -> Lux {
        Lux(self.0 / area.0)
    }
}

impl Mul<SquareMetres> for Lux {
    type Output = Lumens;
    fn mul(self, area: SquareMetres) -> Lumens {
        Lumens(self.0 * area.0)
    }
}

/// Relative luminance of linear Rec. 709 (R, G, B): the part of each channel in a photometric total.
pub const REC709_LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

/// Photometric value of a linear Rec. 709 triple: 0.2126 R + 0.7152 G + 0.0722 B.
pub fn luminance(rgb: [f64; 3]) -> f64 {
    rgb.iter().zip(REC709_LUMINANCE).map(|(channel, weight)| channel * weight).sum()
}

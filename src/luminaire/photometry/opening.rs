//! Luminous openings, as either format tells them.
//!
//! LM-63 gives width, length and height; their signs tell the shape, and what signs mean changed with the editions.
//! In all of them *length* lies along the 0° plane ("parallel to the length of the luminaire", LM-63-1991;
//! "photometric horizontal" in LM-63-2002) and *width* across it. The tables here are those that Radiance's `ies2rad`
//! lists for 1986/1991, 1995 and 2002/2019. A code that its own edition lacks but another one has is common (discs of
//! 1995 under a header of 2002), and taken with a note.
//!
//! EULUMDAT doesn't say which way its *length* lies. C0 is taken for the plane *across* the lamp, the European custom
//! for linear luminaires, so length lies along C90.

use super::Format;
use crate::text::number::short;

/// Where light leaves: a body around the photometric centre. Sizes are whole lengths (diameters, not radii), m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LuminousOpening {
    /// Its form.
    pub shape: Shape,
    /// Size in the direction of C0–C180.
    pub c0: f64,
    /// Size in the direction of C90–C270.
    pub c90: f64,
    /// Size in the direction of the nadir; 0 for flat openings that face it.
    pub height: f64,
    /// Heights of the luminous sides that C0, C90, C180 and C270 look at. EULUMDAT can tell four, in other files all
    /// are `height`.
    pub sides: [f64; 4],
}

/// Form of a luminous opening. Some sizes of a rectangle or box may be 0 (a line), never all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// No extent, all sizes are 0.
    Point,
    /// Flat, faces the nadir.
    Rectangle,
    /// Flat, faces the nadir; a disc where both sizes are equal.
    Ellipse,
    /// A rectangle with luminous sides.
    Box,
    /// An ellipse with a luminous side; a cylinder where both sizes are equal.
    VerticalCylinder,
    /// A cylinder that lies along C0–C180; its section is an ellipse of `c90` and `height`.
    CylinderAlongC0,
    /// A cylinder that lies along C90–C270; its section is an ellipse of `c0` and `height`.
    CylinderAlongC90,
    /// A sphere where all sizes are equal.
    Ellipsoid,
    /// Flat and upright, faces C0; an ellipse of `c90` and `height`.
    UprightEllipse,
}

/// Unit of length that a file declares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LengthUnit {
    Foot,
    Metre,
    Millimetre,
}

impl LengthUnit {
    /// Its name, and its length in metres.
    pub(super) fn told(self) -> (&'static str, f64) {
        match self {
            Self::Foot => ("feet", 0.3048),
            Self::Metre => ("metres", 1.0),
            Self::Millimetre => ("mm", 1e-3),
        }
    }

    /// Units that numbers may be in instead, likely ones first.
    fn mistaken(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Foot => &[("inches", 0.0254), ("mm", 1e-3), ("cm", 1e-2)],
            Self::Metre => &[("mm", 1e-3), ("cm", 1e-2), ("inches", 0.0254)],
            Self::Millimetre => &[("tenths of a mm", 1e-4)],
        }
    }
}

/// Largest opening that is taken without a word, m.
const LARGEST_USUAL: f64 = 3.0;
/// Size of a usual one, m.
const USUAL: f64 = 0.6;

impl LuminousOpening {
    /// No extent.
    pub const POINT: Self = Self { shape: Shape::Point, c0: 0.0, c90: 0.0, height: 0.0, sides: [0.0; 4] };

    fn new(shape: Shape, c0: f64, c90: f64, height: f64) -> Self {
        Self { shape, c0, c90, height, sides: [height; 4] }
    }

    /// The opening that an LM-63 file means by width, length and height (any unit, kept), and the edition whose code
    /// it is where that isn't the file's own. `None` where no edition has such a code.
    pub(super) fn from_lm63(format: Format, [width, length, height]: [f64; 3]) -> Option<(Self, Option<Format>)> {
        use Format::{Lm63_1986, Lm63_1991, Lm63_1995, Lm63_2002};
        let own = match format {
            Lm63_1991 => Lm63_1986,
            Format::Lm63_2019 => Lm63_2002,
            other => other,
        };
        let others = [Lm63_1995, Lm63_2002, Lm63_1986].into_iter().filter(|edition| *edition != own);
        let mut candidates = std::iter::once(own).chain(others);
        candidates.find_map(|edition| {
            let (shape, [c0, c90, height]) = Self::code(edition, [width, length, height])?;
            Some((Self::new(shape, c0, c90, height), (edition != own).then_some(edition)))
        })
    }

    /// Shape and sizes (along C0, along C90, height) of a code in an edition: 1986, 1995 or 2002.
    fn code(edition: Format, [width, length, height]: [f64; 3]) -> Option<(Shape, [f64; 3])> {
        use std::cmp::Ordering::{Equal, Greater, Less};
        let [w, l, h] = [width, length, height].map(f64::abs);
        let signs = [width, length, height].map(|size| {
            if size < 0.0 {
                Less
            } else if size > 0.0 {
                Greater
            } else {
                Equal
            }
        });
        let of_all_editions = match signs {
            [Equal, Equal, Equal] => Some((Shape::Point, [0.0; 3])),
            [Equal | Greater, Equal | Greater, Equal] => Some((Shape::Rectangle, [l, w, 0.0])),
            [Equal | Greater, Equal | Greater, Greater] => Some((Shape::Box, [l, w, h])),
            _ => None,
        };
        of_all_editions.or(match (edition, signs) {
            (Format::Lm63_1986 | Format::Lm63_1995, [Less, Equal, Equal]) => Some((Shape::Ellipse, [w, w, 0.0])),
            (Format::Lm63_1986 | Format::Lm63_1995, [Less, Equal, Greater]) => {
                Some((Shape::VerticalCylinder, [w, w, h]))
            }
            (Format::Lm63_1986, [Less, Greater, Equal]) => Some((Shape::Ellipse, [l, w, 0.0])),
            (Format::Lm63_1986, [Less, Greater, Greater]) => Some((Shape::Ellipsoid, [l, w, h])),
            (Format::Lm63_1995, [Less, Equal, Less]) => Some((Shape::Ellipsoid, [w, w, h])),
            (Format::Lm63_1995, [Equal, Greater, Less]) => Some((Shape::CylinderAlongC0, [l, h, h])),
            (Format::Lm63_1995, [Greater, Equal, Less]) => Some((Shape::CylinderAlongC90, [h, w, h])),
            (Format::Lm63_1995, [Less, Greater, Equal] | [Greater, Less, Equal]) => Some((Shape::Ellipse, [l, w, 0.0])),
            (Format::Lm63_1995, [Less, Greater, Greater] | [Greater, Less, Greater]) => {
                Some((Shape::VerticalCylinder, [l, w, h]))
            }
            (Format::Lm63_1995, [Less, Greater, Less] | [Greater, Less, Less]) => Some((Shape::Ellipsoid, [l, w, h])),
            (Format::Lm63_2002, [Less, Less, Equal]) => Some((Shape::Ellipse, [l, w, 0.0])),
            (Format::Lm63_2002, [Less, Less, Greater]) => Some((Shape::VerticalCylinder, [l, w, h])),
            (Format::Lm63_2002, [Less, Less, Less]) => Some((Shape::Ellipsoid, [l, w, h])),
            (Format::Lm63_2002, [Less, Greater, Less]) => Some((Shape::CylinderAlongC0, [l, w, h])),
            (Format::Lm63_2002, [Greater, Less, Less]) => Some((Shape::CylinderAlongC90, [l, w, h])),
            (Format::Lm63_2002, [Less, Equal, Less]) => Some((Shape::UprightEllipse, [0.0, w, h])),
            _ => None,
        })
    }

    /// The opening of an EULUMDAT file, from sizes in m that are not negative; a width of 0 makes it round.
    pub(super) fn from_eulumdat(length: f64, width: f64, sides: [f64; 4]) -> Self {
        let height = sides.into_iter().fold(0.0, f64::max);
        let flat = height == 0.0;
        let (shape, c0, c90) = match (length > 0.0, width > 0.0) {
            (false, false) if flat => (Shape::Point, 0.0, 0.0),
            (true, false) => (if flat { Shape::Ellipse } else { Shape::VerticalCylinder }, length, length),
            _ => (if flat { Shape::Rectangle } else { Shape::Box }, width, length),
        };
        Self { shape, c0, c90, height, sides }
    }

    /// What is doubtful about the sizes, and what may have been meant; nothing below 3 m.
    pub(super) fn doubt(&self, given: LengthUnit) -> Option<String> {
        let largest = self.largest();
        if largest <= LARGEST_USUAL {
            return None;
        }
        let metres = |size: f64| format!("{} m", short(size));
        let sizes = |factor: f64| {
            let sizes = [self.c0, self.c90, self.height].into_iter().filter(|size| *size > 0.0);
            sizes.map(|size| metres(size * factor)).collect::<Vec<_>>().join(" × ")
        };
        let (name, length) = given.told();
        let sound = |(_, other): &(&str, f64)| (0.05..=LARGEST_USUAL).contains(&(largest / length * other));
        // Of what is likely, that which makes it about as large as luminaires are; inches before all where feet are told.
        let off = |(_, other): &(&str, f64)| (largest / length * other / USUAL).ln().abs();
        let others = given.mistaken().iter().copied().filter(sound);
        let likely = match given {
            LengthUnit::Foot => others.clone().next(),
            _ => others.min_by(|a, b| off(a).total_cmp(&off(b))),
        };
        let meant = likely.map_or_else(String::new, |(other, metres_of_it)| {
            format!("; in {other} it would be {}", sizes(metres_of_it / length))
        });
        Some(format!("a luminous opening of {}, as the file counts in {name}{meant}", sizes(1.0)))
    }

    /// The largest of its sizes, m.
    fn largest(&self) -> f64 {
        self.sides.into_iter().chain([self.c0, self.c90, self.height]).fold(0.0, f64::max)
    }

    /// The same with every size multiplied.
    pub(super) fn scaled(self, factor: f64) -> Self {
        let Self { shape, c0, c90, height, sides } = self;
        let [c0, c90, height] = [c0, c90, height].map(|size| size * factor);
        Self { shape, c0, c90, height, sides: sides.map(|side| side * factor) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each code of the editions' tables, along C0, along C90, height.
    #[test]
    fn signs_tell_the_shape_as_each_edition_says() {
        use Format::{Lm63_1986, Lm63_1991, Lm63_1995, Lm63_2002, Lm63_2019};
        for (format, code, shape, sizes) in [
            (Lm63_1986, [0.0, 0.0, 0.0], Shape::Point, [0.0, 0.0, 0.0]),
            (Lm63_1986, [1.0, 2.0, 0.0], Shape::Rectangle, [2.0, 1.0, 0.0]),
            (Lm63_1991, [1.0, 2.0, 3.0], Shape::Box, [2.0, 1.0, 3.0]),
            (Lm63_1991, [-1.0, 0.0, 0.0], Shape::Ellipse, [1.0, 1.0, 0.0]),
            (Lm63_1991, [-1.0, 0.0, 2.0], Shape::VerticalCylinder, [1.0, 1.0, 2.0]),
            (Lm63_1986, [-1.0, 2.0, 0.0], Shape::Ellipse, [2.0, 1.0, 0.0]),
            (Lm63_1995, [-1.0, 0.0, -1.0], Shape::Ellipsoid, [1.0, 1.0, 1.0]),
            (Lm63_1995, [0.0, 2.0, -1.0], Shape::CylinderAlongC0, [2.0, 1.0, 1.0]),
            (Lm63_1995, [2.0, 0.0, -1.0], Shape::CylinderAlongC90, [1.0, 2.0, 1.0]),
            (Lm63_1995, [-1.0, 2.0, 0.0], Shape::Ellipse, [2.0, 1.0, 0.0]),
            (Lm63_1995, [1.0, -2.0, 3.0], Shape::VerticalCylinder, [2.0, 1.0, 3.0]),
            (Lm63_1995, [-1.0, 2.0, -3.0], Shape::Ellipsoid, [2.0, 1.0, 3.0]),
            (Lm63_2002, [-1.0, -1.0, 0.0], Shape::Ellipse, [1.0, 1.0, 0.0]),
            (Lm63_2002, [-1.0, -2.0, 3.0], Shape::VerticalCylinder, [2.0, 1.0, 3.0]),
            (Lm63_2019, [-1.0, -2.0, -3.0], Shape::Ellipsoid, [2.0, 1.0, 3.0]),
            (Lm63_2019, [-1.0, 2.0, -3.0], Shape::CylinderAlongC0, [2.0, 1.0, 3.0]),
            (Lm63_2002, [1.0, -2.0, -3.0], Shape::CylinderAlongC90, [2.0, 1.0, 3.0]),
            (Lm63_2002, [-1.0, 0.0, -3.0], Shape::UprightEllipse, [0.0, 1.0, 3.0]),
        ] {
            let (opening, other) = LuminousOpening::from_lm63(format, code).expect("a code of this edition");
            assert_eq!(
                (opening.shape, [opening.c0, opening.c90, opening.height]),
                (shape, sizes),
                "{format:?} {code:?}"
            );
            assert_eq!((other, opening.sides), (None, [sizes[2]; 4]), "{format:?} {code:?}");
        }
    }

    #[test]
    fn a_code_of_another_edition_is_told() {
        let found = LuminousOpening::from_lm63(Format::Lm63_2002, [-1.0, 0.0, 0.0]).expect("a disc of 1995");
        assert_eq!((found.0.shape, found.1), (Shape::Ellipse, Some(Format::Lm63_1995)));
        assert!(LuminousOpening::from_lm63(Format::Lm63_2002, [0.0, 0.0, -1.0]).is_none());
        assert!(LuminousOpening::from_lm63(Format::Lm63_1995, [1.0, 1.0, -1.0]).is_none());
    }

    #[test]
    fn what_is_too_large_was_meant_in_another_unit() {
        let of = |c0: f64, c90: f64, given: LengthUnit| {
            LuminousOpening::new(Shape::Rectangle, c0, c90, 0.0).scaled(given.told().1).doubt(given)
        };
        for (sizes, unit, says) in [
            (
                [24.0, 24.0],
                LengthUnit::Foot,
                Some("7.315 m × 7.315 m, as the file counts in feet; in inches it would be 0.6096 m × 0.6096 m"),
            ),
            ([600.0, 600.0], LengthUnit::Foot, Some("in mm it would be 0.6 m × 0.6 m")),
            ([600.0, 1200.0], LengthUnit::Metre, Some("in mm it would be 0.6 m × 1.2 m")),
            ([60.0, 60.0], LengthUnit::Metre, Some("in cm it would be 0.6 m × 0.6 m")),
            ([6000.0, 500.0], LengthUnit::Millimetre, Some("in tenths of a mm it would be 0.6 m × 0.05 m")),
            ([1.2, 3.0], LengthUnit::Metre, None),
            ([9.8, 2.0], LengthUnit::Foot, None),
        ] {
            let found = of(sizes[0], sizes[1], unit);
            assert_eq!(found.is_some(), says.is_some(), "{sizes:?} {unit:?}: {found:?}");
            assert!(found.as_deref().unwrap_or_default().ends_with(says.unwrap_or_default()), "{found:?}");
        }
    }

    #[test]
    fn length_of_eulumdat_lies_along_c90() {
        let long = LuminousOpening::from_eulumdat(1.2, 0.2, [0.0; 4]);
        assert_eq!((long.shape, long.c0, long.c90), (Shape::Rectangle, 0.2, 1.2));
        let round = LuminousOpening::from_eulumdat(0.3, 0.0, [0.01, 0.02, 0.03, 0.04]);
        assert_eq!((round.shape, round.c0, round.c90, round.height), (Shape::VerticalCylinder, 0.3, 0.3, 0.04));
        assert_eq!(LuminousOpening::from_eulumdat(0.0, 0.0, [0.0; 4]), LuminousOpening::POINT);
    }
}

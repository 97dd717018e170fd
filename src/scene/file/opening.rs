//! `opening` of a luminaire: the form that light leaves from.

use super::keys::{Key, Section, Table};
use super::kinds::{Number, Numbers, Range, Several};
use crate::error::InputError;
use crate::geometry::body::Solid;

/// Form of a luminous opening, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum OpeningShape {
    Point,
    Rectangle([f64; 2]),
    Disc {
        diameter: f64,
    },
    Ellipse([f64; 2]),
    /// An ellipse that faces C0: sizes along C90 and the aim.
    Upright([f64; 2]),
    /// A body: sizes along C0, C90 and the aim, and the number of the axis along which a cylinder lies.
    Solid(Solid, [f64; 3], usize),
}

pub(super) static OPENING: Key<Several<OpeningShape>> = Key::optional(
    "opening",
    Several { unit: "m", forms: FORM, tables: &[&FORMS], read },
    "that of the photometric file, else a point",
    "Form and size of what the light leaves from; the first size lies along C0, the second along C90, heights along \
         `aim`.",
);

const FORM: &str = "\"point\", { rectangle = [a, b] }, { disc = diameter }, { ellipse = [a, b] }, \
                    { box = [a, b, height] }, { cylinder = [diameter, height] }, { tube = [length, diameter] }, \
                    { sphere = diameter } or { ellipsoid = [a, b, height] } (m)";

const SIZES: Range = Range::above_to(0.0, 1e6);
const ONE: Number = Number::of(SIZES, "m").said("a diameter above 0, up to 1e6 m");
const TWO: Numbers<2> = Numbers::of(SIZES, "m").said("two sizes, each above 0, up to 1e6 m");
const THREE: Numbers<3> = Numbers::of(SIZES, "m").said("three sizes, each above 0, up to 1e6 m");

static RECTANGLE: Key<Numbers<2>> =
    Key::optional("rectangle", TWO, "", "A flat rectangle: sizes along C0 and C90; light leaves towards `aim`.");
static DISC: Key<Number> = Key::optional("disc", ONE, "", "A flat disc: its diameter.");
static ELLIPSE: Key<Numbers<2>> = Key::optional("ellipse", TWO, "", "A flat ellipse: sizes along C0 and C90.");
static BOX: Key<Numbers<3>> = Key::optional(
    "box",
    THREE.shown("[a, b, height]"),
    "",
    "A box that shines on all sides: sizes along C0 and C90, and height.",
);
static CYLINDER: Key<Numbers<2>> = Key::optional(
    "cylinder",
    TWO.shown("[diameter, height]"),
    "",
    "A cylinder with its axis along `aim`: diameter and height.",
);
static TUBE: Key<Numbers<2>> = Key::optional(
    "tube",
    TWO.shown("[length, diameter]"),
    "",
    "A cylinder with its axis along C0: length and diameter.",
);
static SPHERE: Key<Number> = Key::optional("sphere", ONE, "", "A ball: its diameter.");
static ELLIPSOID: Key<Numbers<3>> =
    Key::optional("ellipsoid", THREE.shown("[a, b, height]"), "", "An ellipsoid: sizes along C0 and C90, and height.");

static FORMS: Table = Table {
    head: "opening",
    about: "The word \"point\", or a table with one of these keys.",
    keys: &[&RECTANGLE, &DISC, &ELLIPSE, &BOX, &CYLINDER, &TUBE, &SPHERE, &ELLIPSOID],
    rules: &["Exactly one of them."],
    example: "",
};

fn read(section: &Section<'_>, key: &str) -> Result<Option<OpeningShape>, InputError> {
    if section.fields.is_text(key) {
        return match section.fields.text(key)? {
            Some(word) if word.value == "point" => Ok(Some(OpeningShape::Point)),
            _ => Err(section.fields.refusal(key, FORM)),
        };
    }
    let Some(opening) = section.inner(key, FORM, &FORMS)? else { return Ok(None) };
    let round = |[diameter, height]: [f64; 2]| OpeningShape::Solid(Solid::Cylinder, [diameter, diameter, height], 2);
    let along = |[length, diameter]: [f64; 2]| OpeningShape::Solid(Solid::Cylinder, [length, diameter, diameter], 0);
    let said = [
        opening.get(&RECTANGLE)?.map(OpeningShape::Rectangle),
        opening.get(&DISC)?.map(|diameter| OpeningShape::Disc { diameter }),
        opening.get(&ELLIPSE)?.map(OpeningShape::Ellipse),
        opening.get(&BOX)?.map(|sizes| OpeningShape::Solid(Solid::Box, sizes, 2)),
        opening.get(&CYLINDER)?.map(round),
        opening.get(&TUBE)?.map(along),
        opening.get(&SPHERE)?.map(|diameter| OpeningShape::Solid(Solid::Ellipsoid, [diameter; 3], 2)),
        opening.get(&ELLIPSOID)?.map(|sizes| OpeningShape::Solid(Solid::Ellipsoid, sizes, 2)),
    ];
    let mut said = said.into_iter().flatten();
    match (said.next(), said.next()) {
        (Some(shape), None) => Ok(Some(shape)),
        _ => Err(section.fields.refusal(key, FORM)),
    }
}

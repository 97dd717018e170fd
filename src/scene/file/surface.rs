//! `[[surface]]`: faces of the mesh that are measured.

use super::super::measured::SurfaceSection;
use super::TakenNames;
use super::keys::{Key, Section, Table};
use super::kinds::{Number, OneOf, Range, Text};
use crate::error::InputError;

static NAME: Key<Text> = Key::needed("name", Text::FILE_NAME, "\"surface 1\"", "Its name, and that of its files.");
static MATERIAL: Key<Text> = Key::needed_unless(
    "material",
    Text::NAME,
    "faces of any material; required without group",
    "",
    "Faces of this material.",
);
static GROUP: Key<Text> = Key::needed_unless(
    "group",
    Text::NAME,
    "faces of any group; required without material",
    "",
    "Faces of this group or object (lines `g` and `o`) of the OBJ files.",
);
static SIDE: Key<OneOf<bool>> = Key::optional(
    "side",
    OneOf(&[("front", false), ("back", true)]),
    "\"front\"",
    "Measured side; at the front vertices run counter-clockwise.",
);
static SPACING: Key<Number> = Key::optional(
    "spacing",
    Number::of(Range::above(0.0), "m"),
    "a hundredth of the surface's largest extent",
    "Side of the largest square that one sample stands for.",
);

pub(super) static SURFACE: Table = Table {
    head: "[[surface]]",
    about: "Faces of the mesh that are measured themselves, whatever their form: walls, ceilings, desk tops. Results \
            are written as `NAME.csv` and `NAME.ply`.",
    keys: &[&NAME, &MATERIAL, &GROUP, &SIDE, &SPACING],
    rules: &[
        "Give `material`, `group` or both: with both, faces of that material in that group.",
        "No two surfaces have the same name.",
        "A surface has at most 1,000,000 samples; each triangle is one sample at least.",
    ],
    example: "\
[[surface]]
name = \"walls\"
material = \"wall\"
spacing = 0.25

[[surface]]
name = \"partition\"
group = \"partition0\"
side = \"back\"
",
};

pub(super) fn read(section: &Section<'_>, names: &mut TakenNames) -> Result<SurfaceSection, InputError> {
    let name = names.take_file(section, &NAME, "ply")?;
    let (material, group) = (section.placed(&MATERIAL)?, section.placed(&GROUP)?);
    if material.is_none() && group.is_none() {
        let error = section.fields.missing("material or group", "\"desk\"");
        return Err(error.hint("the faces of a material, of a group or object (g or o) of the OBJ file, or of both"));
    }
    Ok(SurfaceSection {
        name,
        at: section.at().clone(),
        material,
        group,
        back: section.get(&SIDE)?.unwrap_or(false),
        spacing: section.placed(&SPACING)?,
    })
}

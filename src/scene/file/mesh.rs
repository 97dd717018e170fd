//! `[[mesh]]`: a mesh file, and where it stands.

use glam::DVec3;

use super::super::fields::Placed;
use super::keys::{Key, Section, Table};
use super::kinds::{Metres, Number, OneOf, Range, Text};
use crate::error::InputError;
use crate::geometry::mesh::Placement;

/// A `[[mesh]]`.
pub(crate) struct MeshSection {
    pub(crate) file: Placed<String>,
    pub(crate) placement: Placement,
}

static FILE: Key<Text> = Key::needed(
    "file",
    Text("path of an OBJ file"),
    "\"room.obj\"",
    "The mesh, looked up from the folder of the scene file.",
);
static UNIT: Key<OneOf<f64>> = Key::optional(
    "unit",
    OneOf(&[("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("ft", 0.3048), ("in", 0.0254)]),
    "\"m\"",
    "Unit of the coordinates in the OBJ file.",
);
static UP: Key<OneOf<bool>> =
    Key::optional("up", OneOf(&[("z", false), ("y", true)]), "\"z\"", "Axis of the OBJ file that points up.");
static TRANSLATE: Key<Metres> =
    Key::optional("translate", Metres, "[0, 0, 0]", "Shift of the mesh, after it is scaled and turned.");
static ROTATE_Z: Key<Number> = Key::optional(
    "rotate_z",
    Number::of(Range::between(-36_000.0, 36_000.0), "°"),
    "0",
    "Turn about the z axis, counter-clockwise seen from above.",
);

pub(super) static MESH: Table = Table {
    head: "[[mesh]]",
    about: "A mesh in an OBJ file, in world coordinates after `up`, `unit`, `rotate_z` and `translate`, applied in \
            this order. A scene may have several, or none: then nothing reflects or blocks light.",
    keys: &[&FILE, &UNIT, &UP, &TRANSLATE, &ROTATE_Z],
    rules: &["The file lies in the folder of the scene file or below it, or in a folder given with `--include`."],
    example: "\
[[mesh]]
file = \"office.obj\"
unit = \"mm\"
up = \"y\"
rotate_z = 90
translate = [0, 0, 3.2]
",
};

pub(super) fn read(section: &Section<'_>) -> Result<MeshSection, InputError> {
    Ok(MeshSection {
        file: section.need_placed(&FILE)?,
        placement: Placement {
            metres_per_unit: section.get(&UNIT)?.unwrap_or(1.0),
            y_up: section.get(&UP)?.unwrap_or(false),
            rotate_z: section.get(&ROTATE_Z)?.unwrap_or(0.0),
            translate: section.get(&TRANSLATE)?.unwrap_or(DVec3::ZERO),
        },
    })
}

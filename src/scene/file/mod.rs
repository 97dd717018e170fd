//! The scene file: TOML in, checked sections out, every mistake named with its line.
//!
//! Each section has a file with a table of its keys and a parser that reads by it; `reference` prints the tables.

mod array;
mod camera;
mod keys;
mod kinds;
mod luminaire;
mod material;
mod mesh;
mod opening;
mod plane;
pub(crate) mod reference;
mod render;
mod sensor;
mod supply;
mod surface;
#[cfg(test)]
mod tests;

use std::collections::HashMap;
use std::path::Path;

use super::fields::{Placed, Source};
use super::measured::SurfaceSection;
use super::{Camera, MeasuringPlane, Sensor};
use crate::error::{InputError, Location};
use crate::files::limits::{MOST_CELLS, MOST_PIXELS};
use crate::options::Options;
use crate::text::quoted;
#[cfg(test)]
pub(crate) use array::Array;
use keys::{Key, NamedSections, Section, Sections, Table};
use kinds::{Inner, Number, Range, Text, WholePair};
pub(crate) use luminaire::{LuminaireSection, SpreadKey};
pub(crate) use material::MaterialSection;
pub(crate) use mesh::MeshSection;
pub(crate) use opening::OpeningShape;

/// A scene file, read and checked by itself: what depends on the meshes is still open. World coordinates.
pub(crate) struct SceneFile {
    pub(crate) name: Option<String>,
    pub(crate) meshes: Vec<MeshSection>,
    pub(crate) materials: Vec<MaterialSection>,
    pub(crate) luminaires: Vec<LuminaireSection>,
    pub(crate) planes: Vec<MeasuringPlane>,
    pub(crate) sensors: Vec<Sensor>,
    pub(crate) cameras: Vec<Camera>,
    pub(crate) surfaces: Vec<SurfaceSection>,
    /// Of luminaires that give none of their own, if the file gives one.
    pub(crate) maintenance: Option<f64>,
    pub(crate) render: Options,
}

static NAME: Key<Text> = Key::optional("name", Text::NAME, "the file's name", "Name of the scene, in results.");
static MESHES: Key<Sections> = Key::optional("mesh", Sections(&mesh::MESH), "none", "What stands in the room.");
static MATERIALS: Key<NamedSections> =
    Key::optional("material", NamedSections(&material::MATERIAL), "MTL files", "What surfaces do with light.");
static LUMINAIRES: Key<Sections> = Key::optional("luminaire", Sections(&luminaire::LUMINAIRE), "none", "What shines.");
static PLANES: Key<Sections> =
    Key::optional("plane", Sections(&plane::PLANE), "none", "Rectangles where illuminance is computed.");
static SENSORS: Key<Sections> =
    Key::optional("sensor", Sections(&sensor::SENSOR), "none", "Points where illuminance is computed.");
static SURFACES: Key<Sections> =
    Key::optional("surface", Sections(&surface::SURFACE), "none", "Faces of the mesh where illuminance is computed.");
static CAMERAS: Key<Sections> = Key::optional("camera", Sections(&camera::CAMERA), "none", "Images of what is seen.");
static RENDER: Key<Inner<Options>> = Key::optional(
    "render",
    Inner { form: "a section that begins with [render]", table: &render::RENDER, read: render::read },
    "none",
    "Options of `luxmap render`.",
);
/// Of the scene and of a luminaire.
static MAINTENANCE_FACTOR: Key<Number> = Key::optional(
    "maintenance_factor",
    Number::of(Range::above_to(0.0, 1.0), "").said("a number above 0, at most 1 (a clean office: about 0.8)"),
    "the scene's, else 1",
    "Share of the initial light that is left before the next maintenance; a luminaire's wins over the scene's.",
);

/// The scene file as a whole.
static SCENE: Table = Table {
    head: "the scene file",
    about: "Keys outside of any section stand at the top of the file. What stands in the room, what shines and where \
            illuminance is wanted are sections.",
    keys: &[
        &NAME,
        &MESHES,
        &MATERIALS,
        &LUMINAIRES,
        &PLANES,
        &SENSORS,
        &SURFACES,
        &CAMERAS,
        &RENDER,
        &MAINTENANCE_FACTOR,
    ],
    rules: &[
        "At least one `[[plane]]`, `[[sensor]]`, `[[surface]]` or `[[camera]]`.",
        "At least one thing that shines: a `[[luminaire]]`, or a material with Ke in an MTL file.",
    ],
    example: "\
name = \"Office\"
maintenance_factor = 0.8

[[mesh]]
file = \"office.obj\"

[material.floor]
reflectance = 0.2

[[luminaire]]
name = \"L\"
position = [1.0, 0.72, 2.69]
opening = { rectangle = [0.6, 0.6] }
flux = 3000

[[plane]]
name = \"workplane\"
corner = [0, 0, 0.75]
along = [6.0, 0, 0]
across = [0, 7.2, 0]
cells = [60, 72]
on = \"air\"
",
};

impl SceneFile {
    /// Reads the text of the file at `path`. No other file is looked at.
    pub(crate) fn parse(path: &Path, text: &str) -> Result<Self, InputError> {
        let source = Source::new(path, text);
        let toml = source.table(text)?;
        let top = Section::new(&source, SCENE.head, Location::file(path), toml.get_ref(), &SCENE)?;

        let planes = planes(&top)?;
        let scene = Self {
            name: top.get(&NAME)?,
            meshes: top.sections(&MESHES)?.map(|section| mesh::read(&section?)).collect::<Result<_, _>>()?,
            materials: materials(&top)?,
            luminaires: top
                .sections(&LUMINAIRES)?
                .map(|section| luminaire::read(&section?))
                .collect::<Result<_, _>>()?,
            sensors: sensors(&top)?,
            cameras: cameras(&top, &planes)?,
            planes,
            surfaces: surfaces(&top)?,
            maintenance: top.get(&MAINTENANCE_FACTOR)?,
            render: top.get(&RENDER)?.unwrap_or_default(),
        };
        let nothing = scene.planes.is_empty() && scene.sensors.is_empty() && scene.surfaces.is_empty();
        if nothing && scene.cameras.is_empty() {
            let found = "neither a [[plane]] nor a [[sensor]], [[surface]] or [[camera]]";
            let error = InputError::new(Location::file(path), found, "at least one of them");
            return Err(error.hint("they say where illuminance is wanted"));
        }
        Ok(scene)
    }
}

fn materials(top: &Section<'_>) -> Result<Vec<MaterialSection>, InputError> {
    let sections = top.named_sections(&MATERIALS, material::head)?;
    sections.map(|named| named.and_then(|(name, section)| material::read(name, &section))).collect()
}

fn planes(top: &Section<'_>) -> Result<Vec<MeasuringPlane>, InputError> {
    let (mut names, mut left) = (TakenNames::new("plane"), MOST_CELLS);
    top.sections(&PLANES)?.map(|section| plane::read(&section?, &mut names, &mut left)).collect()
}

fn sensors(top: &Section<'_>) -> Result<Vec<Sensor>, InputError> {
    let (mut names, mut sensors) = (TakenNames::new("sensor"), Vec::new());
    for section in top.sections(&SENSORS)? {
        sensor::read(&section?, &mut names, &mut sensors)?;
    }
    Ok(sensors)
}

fn cameras(top: &Section<'_>, planes: &[MeasuringPlane]) -> Result<Vec<Camera>, InputError> {
    let (mut names, mut left) = (TakenNames::new("camera"), MOST_PIXELS);
    top.sections(&CAMERAS)?.map(|section| camera::read(&section?, &mut names, planes, &mut left)).collect()
}

fn surfaces(top: &Section<'_>) -> Result<Vec<SurfaceSection>, InputError> {
    let mut names = TakenNames::new("surface");
    top.sections(&SURFACES)?.map(|section| surface::read(&section?, &mut names)).collect()
}

/// Columns and rows of an image, of `most` points of which earlier ones have left some.
fn whole_image(
    section: &Section<'_>,
    key: &Key<WholePair>,
    most: u64,
    left: &mut u64,
) -> Result<[usize; 2], InputError> {
    use keys::AnyKey as _;
    let sides = section.need(key)?;
    let (all, name) = (sides[0] * sides[1], key.name());
    if all > most {
        return Err(section.refusal(key, format!("two whole numbers from 1 up, at most {most} {name} in all")));
    }
    if all > *left {
        let error = section.refusal(key, format!("at most {left} {name}"));
        return Err(error.hint(format!("all sections of its kind together have at most {most}")));
    }
    *left -= all;
    Ok(sides.map(|side| side as usize))
}

/// The names given so far to things of one kind, each with its place.
struct TakenNames {
    kind: &'static str,
    taken: HashMap<String, Location>,
}

impl TakenNames {
    fn new(kind: &'static str) -> Self {
        Self { kind, taken: HashMap::new() }
    }

    /// The name of a section, which no other may have.
    fn take(&mut self, section: &Section<'_>, key: &Key<Text>) -> Result<String, InputError> {
        self.add(section.need_placed(key)?)
    }

    fn add(&mut self, name: Placed<String>) -> Result<String, InputError> {
        match self.taken.insert(name.value.clone(), name.at.clone()) {
            Some(first) => Err(duplicate(self.kind, &name, &first)),
            None => Ok(name.value),
        }
    }

    /// The name of a section whose results are written as NAME.`ending`.
    fn take_file(&mut self, section: &Section<'_>, key: &Key<Text>, ending: &str) -> Result<String, InputError> {
        let name = self.take(section, key)?;
        if name.contains(['/', '\\', ':']) || name.starts_with('.') || name.len() > 200 {
            let error = section.refusal(key, "a name that can be a file's");
            return Err(error.hint(format!("no / \\ : in it, no dot in front; results are written as NAME.{ending}")));
        }
        Ok(name)
    }
}

/// Two things of one kind bear the same name.
pub(crate) fn duplicate(kind: &str, name: &Placed<String>, first: &Location) -> InputError {
    let found = format!("a second {kind} named {}", quoted(&name.value));
    InputError::new(name.at.clone(), found, "a name of its own for each").hint(format!("the first is at {first}"))
}

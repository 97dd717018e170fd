//! The scene file: TOML in, checked sections out, every mistake named with its line.

use std::path::Path;

use glam::DVec3;
use toml::de::DeTable;

use super::areas::areas;
use super::fields::{FARTHEST, Fields, Placed, Source, plain};
use super::glazing::{Curve, Glazing};
use super::material::{Dielectric, Sides};
use super::measure::{Measure, measure};
use super::measured::{self, SurfaceSection};
use super::{Camera, MeasuringPlane, PlaneKind, Sensor};
use crate::error::{InputError, Location};
use crate::files::limits::{MOST_CELLS, MOST_LUMINAIRES, MOST_PIXELS, MOST_SENSORS};
use crate::geometry::body::Solid;
use crate::geometry::mesh::Placement;
use crate::luminaire::photometry::{Choice, Chosen};
use crate::luminaire::{Supply, colour};
use crate::text::quoted;

/// Options of `luxmap render` that a scene file may set in `[render]`; the command line wins over them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderDefaults {
    /// `split`, `photons` or `seed`.
    pub method: Option<String>,
    /// Photons a pass.
    pub photons: Option<u64>,
    /// k, nearest photons of an estimate.
    pub nearest: Option<usize>,
    /// Largest search radius, m.
    pub radius: Option<f64>,
    /// Independent photon maps.
    pub passes: Option<u32>,
    /// `kd`, `kiddo`, `paper` or `brute`.
    pub tree: Option<String>,
    /// Seed of the random streams.
    pub seed: Option<u64>,
    /// Whether light groups are told apart.
    pub groups: Option<bool>,
}

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
    pub(crate) render: RenderDefaults,
}

/// A `[[mesh]]`.
pub(crate) struct MeshSection {
    pub(crate) file: Placed<String>,
    pub(crate) placement: Placement,
}

/// A `[material.NAME]`; [`material`](super::material) tells what its keys mean.
#[derive(Clone)]
pub(crate) struct MaterialSection {
    pub(crate) name: String,
    pub(crate) at: Location,
    pub(crate) reflectance: Option<Placed<[f64; 3]>>,
    pub(crate) specular: Option<Placed<[f64; 3]>>,
    pub(crate) roughness: Option<Placed<f64>>,
    pub(crate) transmittance: Option<Placed<[f64; 3]>>,
    pub(crate) sides: Sides,
    pub(crate) dielectric: Option<Dielectric>,
    pub(crate) glazing: Option<Glazing>,
}

impl MaterialSection {
    /// A section that says nothing but what is reflected by Lambert's law.
    pub(crate) fn reflecting(name: &str, at: Location, reflectance: [f64; 3]) -> Self {
        Self {
            name: name.to_owned(),
            reflectance: Some(Placed { value: reflectance, at: at.clone() }),
            at,
            specular: None,
            roughness: None,
            transmittance: None,
            sides: Sides::Two,
            dielectric: None,
            glazing: None,
        }
    }
}

/// A `[[luminaire]]`.
pub(crate) struct LuminaireSection {
    pub(crate) name: Placed<String>,
    pub(crate) position: DVec3,
    /// Where γ = 0 looks; straight down where the section says nothing.
    pub(crate) aim: DVec3,
    /// `rotation`, degrees. At 0, looking down, C0 (the first size of an opening) lies towards +x and C90 towards +y. Positive
    /// turns from C0 towards C90: counter-clockwise seen from above where the luminaire looks down, counter-clockwise seen
    /// from behind it whatever it looks at.
    pub(crate) rotation: f64,
    /// Where the section says it.
    pub(crate) shape: Option<Shape>,
    pub(crate) spread: Spread,
    /// Undimmed and new, lm, where the section says it.
    pub(crate) flux: Option<f64>,
    /// Level as the file has it, 0 where it is switched off; and what it draws.
    pub(crate) supply: Supply,
    /// Maintenance factor; the scene's where the section gives none.
    pub(crate) maintenance: Option<f64>,
    pub(crate) colour: [f64; 3],
    pub(crate) group: Option<String>,
    pub(crate) array: Option<Array>,
}

/// How light spreads.
pub(crate) enum Spread {
    Isotropic,
    Lambertian,
    /// As this photometric file has it, and what is chosen of it.
    File(Placed<String>, Choice),
}

/// Form of a luminous opening, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shape {
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

/// Rows of equal luminaires, along world x and y.
pub(crate) struct Array {
    pub(crate) count: [u64; 2],
    pub(crate) pitch: [f64; 2],
    pub(crate) at: Location,
}

impl SceneFile {
    /// Reads the text of the file at `path`.
    pub(crate) fn parse(path: &Path, text: &str) -> Result<Self, InputError> {
        let source = Source::new(path, text);
        let table = source.table(text)?;
        const KNOWN: [&str; 10] = [
            "name",
            "mesh",
            "material",
            "luminaire",
            "plane",
            "sensor",
            "surface",
            "camera",
            "render",
            "maintenance_factor",
        ];
        let top = Fields::new(&source, "the scene file", Location::file(path), table.get_ref(), &KNOWN)?;

        let each = |key: &str| top.sections(key);
        let planes = planes(&source, each("plane")?)?;
        let scene = Self {
            name: top.name("name")?.map(|name| name.value),
            meshes: each("mesh")?.into_iter().map(|(at, t)| mesh(&source, at, t)).collect::<Result<_, _>>()?,
            materials: materials(&source, &top)?,
            luminaires: each("luminaire")?
                .into_iter()
                .map(|(at, t)| luminaire(&source, at, t))
                .collect::<Result<_, _>>()?,
            sensors: sensors(&source, each("sensor")?)?,
            cameras: cameras(&source, each("camera")?, &planes)?,
            planes,
            surfaces: surfaces(&source, each("surface")?)?,
            maintenance: maintenance_factor(&top)?,
            render: render(&top)?,
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

fn mesh(source: &Source, at: Location, table: &DeTable) -> Result<MeshSection, InputError> {
    let fields = Fields::new(source, "[[mesh]]", at, table, &["file", "unit", "up", "translate", "rotate_z"])?;
    let file = fields.name("file")?.ok_or_else(|| fields.missing("file", "\"room.obj\""))?;
    let metres_per_unit =
        match fields.word("unit", &["m", "cm", "mm", "ft", "in"])?.as_ref().map(|unit| unit.value.as_str()) {
            Some("cm") => 0.01,
            Some("mm") => 0.001,
            Some("ft") => 0.3048,
            Some("in") => 0.0254,
            _ => 1.0,
        };
    Ok(MeshSection {
        file,
        placement: Placement {
            metres_per_unit,
            y_up: fields.word("up", &["z", "y"])?.is_some_and(|up| up.value == "y"),
            rotate_z: fields
                .number("rotate_z", "degrees, within ±36000", |n| n.abs() <= 36_000.0)?
                .map_or(0.0, |n| n.value),
            translate: fields.metres("translate")?.map_or(DVec3::ZERO, |vector| vector.value),
        },
    })
}

fn materials(source: &Source, top: &Fields) -> Result<Vec<MaterialSection>, InputError> {
    top.named_sections("material")?.into_iter().map(|(name, at, table)| material(source, name, at, table)).collect()
}

fn material(source: &Source, name: &str, at: Location, table: &DeTable) -> Result<MaterialSection, InputError> {
    const KNOWN: [&str; 7] =
        ["reflectance", "specular", "roughness", "transmittance", "sides", "dielectric", "glazing"];
    const SHARE: &str = "a number from 0 to 1, or three as [r, g, b]";
    let section = format!("[material.{}]", plain(name));
    let fields = Fields::new(source, section, at.clone(), table, &KNOWN)?;
    let share = |key: &str, hint: &str| fields.channels(key, SHARE).map_err(|error| error.hint(hint));
    let reflectance = share("reflectance", "white paint: about 0.85")?;
    let specular = share("specular", "a good mirror: about 0.9")?;
    let transmittance = share("transmittance", "opal glass: about 0.5")?;
    let roughness = fields
        .number("roughness", "a number from 0 (a perfect mirror) to 1", |n| (0.0..=1.0).contains(&n))
        .map_err(|error| error.hint("brushed metal: about 0.3"))?;
    let sides = match fields.word("sides", &["one", "two"])? {
        Some(word) if word.value == "one" => Sides::One,
        _ => Sides::Two,
    };
    if sides == Sides::One && transmittance.as_ref().is_some_and(|part| part.value != [0.0; 3]) {
        let error = fields.refusal("sides", "\"two\" where there is a transmittance");
        return Err(error.hint("a sheet that light passes has two sides"));
    }
    let (dielectric, glazing) = (dielectric(&fields)?, glazing(&fields)?);
    for (key, hint) in [("dielectric", "what glass reflects follows from its ior"), ("glazing", OWN_REFLECTANCE)] {
        if fields.has(key) && table.len() > 1 {
            return Err(fields.refusal(key, "no other key beside it").hint(hint));
        }
    }
    let name = name.to_owned();
    Ok(MaterialSection { name, at, reflectance, specular, roughness, transmittance, sides, dielectric, glazing })
}

const OWN_REFLECTANCE: &str = "a pane has its own: glazing = { transmittance = 0.7, reflectance = 0.2 }";

fn glazing(fields: &Fields) -> Result<Option<Glazing>, InputError> {
    const FORM: &str =
        "a number from 0 to 1, three as [r, g, b], or { transmittance = 0.88 } with reflectance and curve";
    const SHARE: &str = "a number from 0 to 1, or three as [r, g, b]";
    if !fields.has("glazing") {
        return Ok(None);
    }
    if !fields.is_table("glazing") {
        let share = fields.channels("glazing", FORM).map_err(|error| error.hint("a clear pane: about 0.88"))?;
        return Ok(share.map(|share| Glazing::clear(share.value)));
    }
    let Some(pane) = fields.table("glazing", FORM, &["transmittance", "reflectance", "curve"])? else {
        return Ok(None);
    };
    let curve = curve(&pane)?;
    let transmittance = pane.channels("transmittance", SHARE)?.map(|share| share.value);
    let Some(transmittance) = transmittance.or_else(|| Some([curve.at_normal()?; 3])) else {
        return Err(pane.missing("transmittance", "0.88, that at normal incidence"));
    };
    let reflectance = pane.channels("reflectance", SHARE)?;
    let glazing = Glazing::new(transmittance, reflectance.as_ref().map(|share| share.value), curve);
    let sums = [0, 1, 2].map(|channel| glazing.transmittance[channel] + glazing.reflectance[channel]);
    match (sums.iter().find(|&&sum| sum > 1.0 + 1e-9), reflectance) {
        (Some(sum), Some(Placed { at, .. })) => {
            let found = format!("transmittance + reflectance = {sum} in {}", fields.section());
            Err(InputError::new(at, found, "at most 1 in each channel"))
        }
        _ => Ok(Some(glazing)),
    }
}

/// How a pane's transmittance falls with the angle of incidence.
fn curve(pane: &Fields) -> Result<Curve, InputError> {
    const FORM: &str = "\"clear\", \"cie171\", or [angle, transmittance] pairs with angles from 0 up to 90, as in \
                        [[0, 0.8], [60, 0.65], [90, 0]]";
    if pane.is_text("curve") {
        return match pane.text("curve")?.as_ref().map(|word| word.value.as_str()) {
            Some("clear") => Ok(Curve::Clear),
            Some("cie171") => Ok(Curve::Cie171),
            _ => Err(pane.refusal("curve", FORM)),
        };
    }
    if !pane.has("curve") {
        return Ok(Curve::Clear);
    }
    let Some(Placed { value: points, .. }) = pane.pairs("curve", FORM, |n| (0.0..=90.0).contains(&n))? else {
        return Err(pane.refusal("curve", FORM));
    };
    let ascending = points.windows(2).all(|pair| pair[0][0] < pair[1][0]);
    let from_normal = points.first().is_some_and(|first| first[0] == 0.0 && first[1] > 0.0);
    if !ascending || !from_normal || points.iter().any(|point| point[1] > 1.0) {
        return Err(pane.refusal("curve", FORM));
    }
    Ok(Curve::Table(points))
}

fn dielectric(fields: &Fields) -> Result<Option<Dielectric>, InputError> {
    let form = "{ ior = 1.5, absorption = 0.0 }";
    let Some(glass) = fields.table("dielectric", form, &["ior", "absorption"])? else { return Ok(None) };
    let ior = glass.number("ior", "a number from 1 to 10 (window glass: 1.5)", |n| (1.0..=10.0).contains(&n))?;
    let per_metre = "a number from 0 up, 1/m, or three as [r, g, b]";
    let absorption = glass.channels_within("absorption", per_metre, |n| n >= 0.0)?;
    Ok(Some(Dielectric {
        ior: ior.ok_or_else(|| glass.missing("ior", "1.5"))?.value,
        absorption: absorption.map_or([0.0; 3], |rgb| rgb.value),
    }))
}

fn luminaire(source: &Source, at: Location, table: &DeTable) -> Result<LuminaireSection, InputError> {
    const KNOWN: [&str; 18] = [
        "name",
        "position",
        "aim",
        "rotation",
        "opening",
        "photometry",
        "lamp_set",
        "variant",
        "flux",
        "dimming",
        "color",
        "cct",
        "group",
        "array",
        "maintenance_factor",
        "dimming_min",
        "power",
        "standby",
    ];
    let fields = Fields::new(source, "[[luminaire]]", at, table, &KNOWN)?;
    let shape = shape(&fields)?;
    let spread = spread(&fields, shape)?;
    let flux = fields
        .number("flux", "a number above 0, lm", |n| n > 0.0 && n <= 1e15)
        .map_err(|error| error.hint("dimming = 0 switches a luminaire off"))?;
    if flux.is_none() && !matches!(spread, Spread::File(..)) {
        return Err(fields.missing("flux", "3000 (lm)"));
    }
    Ok(LuminaireSection {
        name: fields.name("name")?.ok_or_else(|| fields.missing("name", "\"L\""))?,
        position: fields.metres("position")?.ok_or_else(|| fields.missing("position", "[x, y, z] (m)"))?.value,
        aim: fields.direction("aim")?.map_or(DVec3::NEG_Z, |aim| aim.value),
        rotation: fields
            .number("rotation", "degrees, within ±36000", |n| n.abs() <= 36_000.0)?
            .map_or(0.0, |n| n.value),
        shape,
        spread,
        flux: flux.map(|n| n.value),
        supply: supply(&fields)?,
        maintenance: maintenance_factor(&fields)?,
        colour: light_colour(&fields)?,
        group: fields.name("group")?.map(|group| group.value),
        array: array(&fields, MOST_LUMINAIRES, "luminaires")?,
    })
}

/// How far a luminaire dims, and what it draws.
fn supply(fields: &Fields) -> Result<Supply, InputError> {
    let level = fields.number("dimming", "a number from 0 (off) to 1", |n| (0.0..=1.0).contains(&n))?;
    let least =
        fields.number("dimming_min", "the lowest level above off, from 0 to below 1", |n| (0.0..1.0).contains(&n))?;
    let off = fields.number("standby", "a number from 0 up, W when off", |n| (0.0..=1e9).contains(&n))?;
    let watts = "the power at full output, W, or [level, W] pairs with levels ascending to 1, as [[0.1, 5], [1, 30]]";
    let power = match fields.pairs("power", watts, |n| (0.0..=1e9).contains(&n))? {
        Some(points) => {
            let levels = || points.value.iter().map(|[level, _]| *level);
            let ascending = levels().zip(levels().skip(1)).all(|(lower, upper)| lower < upper);
            if points.value.len() < 2 || !ascending || levels().next_back() != Some(1.0) {
                return Err(fields.refusal("power", watts));
            }
            Some(points.value)
        }
        None => {
            fields.number("power", watts, |n| (0.0..=1e9).contains(&n))?.map(|full| vec![[0.0, 0.0], [1.0, full.value]])
        }
    };
    let first = power.as_ref().map_or(0.0, |points| points[0][0]);
    let least = match least {
        Some(least) if least.value < first => {
            let error =
                fields.refusal("dimming_min", format!("at least {first}, the first level that power is given for"));
            return Err(error);
        }
        Some(least) => least.value,
        None => first,
    };
    if let (Some(off), None) = (&off, &power) {
        return Err(InputError::new(
            off.at.clone(),
            "standby without power",
            "power too: what it draws at full output, W",
        ));
    }
    let whole = Supply { level: 1.0, least, off: off.map_or(0.0, |n| n.value), power };
    // What is drawn below the lowest level is never drawn.
    let power = whole.power.as_ref().map(|points| {
        let start = whole.power_at(least).filter(|_| least > 0.0).unwrap_or(points[0][1]);
        let above = points.iter().filter(|[level, _]| *level > least);
        std::iter::once([least, start]).chain(above.copied()).collect()
    });
    Ok(Supply { level: level.map_or(1.0, |n| n.value), power, ..whole })
}

/// The form of the luminous opening.
fn shape(fields: &Fields) -> Result<Option<Shape>, InputError> {
    const FORM: &str = "\"point\", { rectangle = [a, b] }, { disc = diameter }, { ellipse = [a, b] }, \
                        { box = [a, b, height] }, { cylinder = [diameter, height] }, { tube = [length, diameter] }, \
                        { sphere = diameter } or { ellipsoid = [a, b, height] } (m)";
    const KNOWN: [&str; 8] = ["rectangle", "disc", "ellipse", "box", "cylinder", "tube", "sphere", "ellipsoid"];
    if fields.is_text("opening") {
        return match fields.text("opening")? {
            Some(word) if word.value == "point" => Ok(Some(Shape::Point)),
            _ => Err(fields.refusal("opening", FORM)),
        };
    }
    let Some(opening) = fields.table("opening", FORM, &KNOWN)? else { return Ok(None) };
    const SIZES: &str = "above 0, up to 1e6 m";
    let is_size = |n: f64| n > 0.0 && n <= 1e6;
    let one = |key: &str| {
        let size = opening.number(key, &format!("a diameter {SIZES}"), is_size)?;
        Ok::<_, InputError>(size.map(|size| size.value))
    };
    let two = |key: &str| {
        let sizes = opening.numbers::<2>(key, &format!("two sizes, each {SIZES}"), is_size)?;
        Ok::<_, InputError>(sizes.map(|sizes| sizes.value))
    };
    let three = |key: &str| {
        let sizes = opening.numbers::<3>(key, &format!("three sizes, each {SIZES}"), is_size)?;
        Ok::<_, InputError>(sizes.map(|sizes| sizes.value))
    };
    let said = [
        two("rectangle")?.map(Shape::Rectangle),
        one("disc")?.map(|diameter| Shape::Disc { diameter }),
        two("ellipse")?.map(Shape::Ellipse),
        three("box")?.map(|sizes| Shape::Solid(Solid::Box, sizes, 2)),
        two("cylinder")?.map(|[diameter, height]| Shape::Solid(Solid::Cylinder, [diameter, diameter, height], 2)),
        two("tube")?.map(|[length, diameter]| Shape::Solid(Solid::Cylinder, [length, diameter, diameter], 0)),
        one("sphere")?.map(|diameter| Shape::Solid(Solid::Ellipsoid, [diameter; 3], 2)),
        three("ellipsoid")?.map(|sizes| Shape::Solid(Solid::Ellipsoid, sizes, 2)),
    ];
    let mut said = said.into_iter().flatten();
    match (said.next(), said.next()) {
        (Some(shape), None) => Ok(Some(shape)),
        _ => Err(fields.refusal("opening", FORM)),
    }
}

/// How light spreads: a photometric file, or one of the built-in kinds.
fn spread(fields: &Fields, shape: Option<Shape>) -> Result<Spread, InputError> {
    let photometry = fields.name("photometry")?;
    let is_point = matches!(shape, None | Some(Shape::Point));
    let lamp_set = fields.whole("lamp_set", 1, 1000)?;
    let variant = fields.name("variant")?;
    let built_in = photometry.as_ref().is_none_or(|word| ["lambertian", "isotropic"].contains(&word.value.as_str()));
    for key in [lamp_set.as_ref().map(|_| "lamp_set"), variant.as_ref().map(|_| "variant")].into_iter().flatten() {
        if built_in {
            return Err(fields.refusal(key, format!("a photometric file that {key} chooses from")));
        }
    }
    match photometry {
        None if is_point => Ok(Spread::Isotropic),
        None => Ok(Spread::Lambertian),
        Some(word) if word.value == "lambertian" => Ok(Spread::Lambertian),
        Some(word) if word.value == "isotropic" && is_point => Ok(Spread::Isotropic),
        Some(word) if word.value == "isotropic" => Err(fields
            .refusal("photometry", "\"lambertian\" for an opening with an area")
            .hint("only points shine alike in all directions")),
        Some(file) => {
            let choice = Choice {
                lamp_set: lamp_set.map(|set| Chosen { value: set.value as usize, at: set.at }),
                variant: variant.map(|name| Chosen { value: name.value, at: name.at }),
                flux_is_told: false,
            };
            Ok(Spread::File(file, choice))
        }
    }
}

fn light_colour(fields: &Fields) -> Result<[f64; 3], InputError> {
    const COLOR: &str = "[r, g, b], none below 0 and not all of them 0";
    let color = fields.numbers::<3>("color", COLOR, |n| (0.0..=1e15).contains(&n))?;
    let cct = fields.number("cct", "a number from 1000 to 25000, K", |n| (1000.0..=25_000.0).contains(&n))?;
    match (color, cct) {
        (Some(_), Some(_)) => Err(fields.refusal("cct", "either color or cct")),
        (Some(color), None) if color.value == [0.0; 3] => Err(fields.refusal("color", COLOR)),
        (Some(color), None) => Ok(colour::normalised(color.value)),
        (None, Some(cct)) => Ok(colour::black_body(cct.value)),
        (None, None) => Ok([1.0; 3]),
    }
}

fn array(fields: &Fields, most: u64, what: &str) -> Result<Option<Array>, InputError> {
    let Some(array) = fields.table("array", "{ count = [3, 5], pitch = [2.0, 1.44] }", &["count", "pitch"])? else {
        return Ok(None);
    };
    let count = array.whole_pair("count", 1, most)?.ok_or_else(|| array.missing("count", "[3, 5]"))?;
    let pitch = array.numbers("pitch", "two distances in metres, within ±1e9", |n| n.abs() <= FARTHEST)?;
    let pitch = pitch.ok_or_else(|| array.missing("pitch", "[2.0, 1.44] (m)"))?;
    if count.value[0] * count.value[1] > most {
        return Err(array.refusal("count", format!("at most {most} {what}")));
    }
    Ok(Some(Array { count: count.value, pitch: pitch.value, at: array.at }))
}

/// Share of the initial light that is left before the next maintenance.
fn maintenance_factor(fields: &Fields) -> Result<Option<f64>, InputError> {
    let expected = "a number above 0, at most 1 (a clean office: about 0.8)";
    Ok(fields.number("maintenance_factor", expected, |n| n > 0.0 && n <= 1.0)?.map(|n| n.value))
}

fn surfaces(source: &Source, sections: Vec<(Location, &DeTable)>) -> Result<Vec<SurfaceSection>, InputError> {
    let mut names = Names::new("surface");
    let surface = |(at, table)| {
        let fields = Fields::new(source, "[[surface]]", at, table, &measured::KNOWN)?;
        let name = names.take_file(&fields, "ply")?;
        measured::section(&fields, name)
    };
    sections.into_iter().map(surface).collect()
}

fn planes(source: &Source, sections: Vec<(Location, &DeTable)>) -> Result<Vec<MeasuringPlane>, InputError> {
    let mut planes: Vec<MeasuringPlane> = Vec::with_capacity(sections.len());
    let mut names = Names::new("plane");
    let mut left = MOST_CELLS;
    for (at, table) in sections {
        const KNOWN: [&str; 9] = ["name", "corner", "along", "across", "cells", "on", "margin", "required", "task"];
        let fields = Fields::new(source, "[[plane]]", at, table, &KNOWN)?;
        let name = names.take_file(&fields, "exr")?;
        let [along, across] = sides(&fields)?;
        let cells = whole_image(&fields, "cells", "[120, 144]", MOST_CELLS, &mut left)?;
        planes.push(MeasuringPlane {
            name,
            corner: fields.metres("corner")?.ok_or_else(|| fields.missing("corner", "[x, y, z] (m)"))?.value,
            areas: areas(&fields, [along.length(), across.length()], cells)?,
            along,
            across,
            cells,
            kind: match fields.word("on", &["surface", "air"])? {
                Some(word) if word.value == "air" => PlaneKind::Air,
                _ => PlaneKind::Surface,
            },
        });
    }
    Ok(planes)
}

fn cameras(
    source: &Source,
    sections: Vec<(Location, &DeTable)>,
    planes: &[MeasuringPlane],
) -> Result<Vec<Camera>, InputError> {
    let mut cameras = Vec::with_capacity(sections.len());
    let mut names = Names::new("camera");
    let mut left = MOST_PIXELS;
    for (at, table) in sections {
        const KNOWN: [&str; 6] = ["name", "eye", "look_at", "up", "fov", "pixels"];
        let fields = Fields::new(source, "[[camera]]", at, table, &KNOWN)?;
        let name = names.take_file(&fields, "exr")?;
        if planes.iter().any(|plane| plane.name.to_lowercase() == name.to_lowercase()) {
            let error = fields.refusal("name", "a name that no [[plane]] has");
            return Err(error.hint("both are written as NAME.exr"));
        }
        let eye = fields.metres("eye")?.ok_or_else(|| fields.missing("eye", "[x, y, z] (m)"))?.value;
        let [forward, right, up] = view_axes(&fields, eye)?;
        let fov =
            fields.number("fov", "degrees from bottom to top, from 0.01 to 170", |n| (0.01..=170.0).contains(&n))?;
        let fov = fov.ok_or_else(|| fields.missing("fov", "60 (degrees from bottom to top)"))?.value;
        let pixels = whole_image(&fields, "pixels", "[960, 540]", MOST_PIXELS, &mut left)?;
        cameras.push(Camera { name, eye, forward, right, up, fov, pixels });
    }
    Ok(cameras)
}

/// Unit vectors forward, to the right and to the top of a camera's image. Without `up`, the world's z points to the top;
/// seen straight from above or below y does, as in a plan.
fn view_axes(fields: &Fields, eye: DVec3) -> Result<[DVec3; 3], InputError> {
    let look_at = fields.metres("look_at")?.ok_or_else(|| fields.missing("look_at", "[x, y, z] (m)"))?.value;
    let Some(forward) = (look_at - eye).try_normalize().filter(|_| look_at.distance(eye) >= 1e-9) else {
        return Err(fields.refusal("look_at", "a point other than eye"));
    };
    let sides = match fields.direction("up")? {
        Some(up) => Camera::sides(forward, up.value)
            .ok_or_else(|| fields.refusal("up", "a direction other than that from eye to look_at, or its opposite"))?,
        None => Camera::sides(forward, DVec3::Z)
            .or_else(|| Camera::sides(forward, DVec3::Y))
            .expect("no direction is parallel to both z and y"),
    };
    Ok([forward, sides[0], sides[1]])
}

/// The two sides of a measuring plane.
fn sides(fields: &Fields) -> Result<[DVec3; 2], InputError> {
    let side = |key: &str| {
        let side = fields.metres(key)?.ok_or_else(|| fields.missing(key, "[x, y, z] (m)"))?.value;
        if side.length() < 1e-9 {
            return Err(fields.refusal(key, "a side longer than 0"));
        }
        Ok(side)
    };
    let (along, across) = (side("along")?, side("across")?);
    if along.normalize().dot(across.normalize()).abs() > 1e-6 {
        let error = fields.refusal("across", "a vector at a right angle to along");
        return Err(error.hint(format!("the angle is {:.4}°", along.angle_between(across).to_degrees())));
    }
    Ok([along, across])
}

/// Columns and rows of an image, of `most` points of which earlier ones have left some.
fn whole_image(fields: &Fields, key: &str, example: &str, most: u64, left: &mut u64) -> Result<[usize; 2], InputError> {
    let sides = fields.whole_pair(key, 1, most)?.ok_or_else(|| fields.missing(key, example))?.value;
    let all = sides[0] * sides[1];
    if all > most {
        return Err(fields.refusal(key, format!("two whole numbers from 1 up, at most {most} {key} in all")));
    }
    if all > *left {
        let error = fields.refusal(key, format!("at most {left} {key}"));
        return Err(error.hint(format!("all sections of its kind together have at most {most}")));
    }
    *left -= all;
    Ok(sides.map(|side| side as usize))
}

fn sensors(source: &Source, sections: Vec<(Location, &DeTable)>) -> Result<Vec<Sensor>, InputError> {
    let mut sensors = Vec::with_capacity(sections.len());
    let mut names = Names::new("sensor");
    for (at, table) in sections {
        const KNOWN: [&str; 10] =
            ["name", "position", "normal", "measure", "facing", "target", "tolerance", "daylight", "disc", "array"];
        let fields = Fields::new(source, "[[sensor]]", at, table, &KNOWN)?;
        let name = names.take(&fields)?;
        let position = fields.metres("position")?.ok_or_else(|| fields.missing("position", "[x, y, z] (m)"))?.value;
        let (measure, normal) = measure(&fields)?;
        let lux = |key: &str, what: &str| {
            let lux = fields.number(key, &format!("{what}, lx"), |n| (0.0..=1e12).contains(&n))?;
            Ok::<_, InputError>(lux.map(|lux| lux.value))
        };
        let disc = fields.number("disc", "a diameter above 0, up to 1e6 m", |n| n > 0.0 && n <= 1e6)?;
        if disc.is_some() && measure != Measure::Plane {
            return Err(fields.refusal("disc", "disc beside measure = \"plane\" only"));
        }
        let sensor = Sensor {
            name,
            position,
            normal,
            measure,
            disc: disc.map(|disc| disc.value),
            target: lux("target", "a number from 0 up")?,
            tolerance: lux("tolerance", "a number from 0 up, above the target")?,
            daylight: lux("daylight", "a number from 0 up, beside the luminaires' light")?.unwrap_or(0.0),
        };
        if sensor.tolerance.is_some() && sensor.target.is_none() {
            return Err(fields.refusal("tolerance", "tolerance beside target only"));
        }
        spread_out(sensor, &fields, &mut names, &mut sensors)?;
    }
    Ok(sensors)
}

/// A sensor, or all of its array: rows along world x and y.
fn spread_out(sensor: Sensor, fields: &Fields, names: &mut Names, sensors: &mut Vec<Sensor>) -> Result<(), InputError> {
    let Some(Array { count, pitch, .. }) = array(fields, MOST_SENSORS, "sensors")? else {
        sensors.push(sensor);
        return Ok(());
    };
    if sensors.len() as u64 + count[0] * count[1] > MOST_SENSORS {
        return Err(fields.refusal("array", format!("at most {MOST_SENSORS} sensors in all")));
    }
    for (row, column) in (0..count[1]).flat_map(|row| (0..count[0]).map(move |column| (row, column))) {
        let name = format!("{}[{},{}]", sensor.name, column + 1, row + 1);
        let position = sensor.position + DVec3::new(column as f64 * pitch[0], row as f64 * pitch[1], 0.0);
        if position.abs().max_element() > FARTHEST {
            return Err(fields.refusal("array", "an array within 1e9 m of the origin"));
        }
        let at = fields.name("name")?.map_or_else(|| Location::file(Path::new("")), |name| name.at);
        let name = names.add(Placed { value: name, at })?;
        sensors.push(Sensor { name, position, ..sensor.clone() });
    }
    Ok(())
}

/// The names given so far to things of one kind, each with its place.
struct Names {
    kind: &'static str,
    taken: std::collections::HashMap<String, Location>,
}

impl Names {
    fn new(kind: &'static str) -> Self {
        Self { kind, taken: Default::default() }
    }

    /// The name of a section, which no other may have.
    fn take(&mut self, fields: &Fields) -> Result<String, InputError> {
        let name = fields.name("name")?.ok_or_else(|| fields.missing("name", &format!("\"{} 1\"", self.kind)))?;
        self.add(name)
    }

    fn add(&mut self, name: Placed<String>) -> Result<String, InputError> {
        match self.taken.insert(name.value.clone(), name.at.clone()) {
            Some(first) => Err(duplicate(self.kind, &name, &first)),
            None => Ok(name.value),
        }
    }

    /// The name of a section whose results are written as NAME.`ending`.
    fn take_file(&mut self, fields: &Fields, ending: &str) -> Result<String, InputError> {
        let name = self.take(fields)?;
        if name.contains(['/', '\\', ':']) || name.starts_with('.') || name.len() > 200 {
            let error = fields.refusal("name", "a name that can be a file's");
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

fn render(top: &Fields) -> Result<RenderDefaults, InputError> {
    const KNOWN: [&str; 8] = ["method", "photons", "nearest", "radius", "passes", "tree", "seed", "groups"];
    let Some(fields) = top.table("render", "a section that begins with [render]", &KNOWN)? else {
        return Ok(RenderDefaults::default());
    };
    Ok(RenderDefaults {
        method: fields.word("method", &["split", "photons", "seed"])?.map(|word| word.value),
        photons: fields.whole("photons", 1, 1 << 40)?.map(|n| n.value),
        nearest: fields.whole("nearest", 2, 1_000_000_000)?.and_then(|n| usize::try_from(n.value).ok()),
        radius: fields.number("radius", "a number above 0, m", |n| n > 0.0)?.map(|n| n.value),
        passes: fields.whole("passes", 1, u64::from(u32::MAX))?.and_then(|n| u32::try_from(n.value).ok()),
        tree: fields.word("tree", &["kd", "kiddo", "paper", "brute"])?.map(|word| word.value),
        seed: fields.whole("seed", 0, u64::MAX)?.map(|n| n.value),
        groups: fields.switch("groups")?.map(|on| on.value),
    })
}

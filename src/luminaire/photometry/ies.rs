//! LM-63 ("IES files"), editions 1986 to 2019.
//!
//! A first line tells the edition (none: 1986), labels follow up to `TILT=`, then numbers in a fixed order, parted by
//! white space or commas and broken over lines anywhere: lamps, lumens a lamp (−1: absolute photometry), multiplier,
//! number of vertical and of horizontal angles, type (1 C, 2 B, 3 A), units (1 feet, 2 metres), width, length and
//! height of the opening; ballast factor, a number whose meaning changed, power; the angles; the intensities.
//!
//! - Intensities are multiplied by the multiplier and the ballast factor, in 1986 and 1991 also by the number after
//!   it (the ballast-lamp photometric factor). That was "for future use" from 1995 and tells how the file was made
//!   from 2019, so there it isn't a factor. Radiance's `ies2rad` does the same.
//! - **C90**: horizontal angles of type C count counterclockwise (LM-63-2002, chapter 3), seen from above as
//!   `ies2rad` has it since 1993 (until then it mirrored): C0 towards +x, C90 towards +y.
//! - **Tilt**: some lamps give less light when they are tilted (`tilt.rs`). Where the luminaire hangs as it was
//!   measured the tilt is 0°, and that factor is what intensities are multiplied by; [`Tilt`] keeps all, and a scene
//!   takes the one of the luminaire's actual tilt.
//! - Type A and B become type C (`table.rs` tells how). One plane of them is taken as the same all around the axis,
//!   with a note: nothing else is known of the other directions.
//! - **Commas** part numbers, or are decimal signs (`text.rs`): whichever fits the counts of angles. Numbers left over
//!   after the last intensity are refused; text there is passed over.
//! - Angles may descend, and planes may run past 360° (`angles.rs`).
//!
//! Sources: definitions of ANSI/IESNA LM-63-02; the notes on all editions in Radiance's `ies2rad.c` 2.35; Autodesk's
//! summary of LM-63-1991; Lighting Analysts' knowledge base on complete ranges of angles.

use std::path::Path;

use super::labels::{self, Labels, edition, edition_of, names_tm33};
use super::opening::{LengthUnit, LuminousOpening};
use super::table::IntensityTable;
use super::text::{self, Commas, WordReader, quoted};
use super::{Format, Notes, Photometry, PlaneSystem, Symmetry, Tilt, Values, angles, tilt};
use crate::error::{InputError, Location};
use crate::luminaire::intensity::Intensity;

/// Largest size of an opening, m.
const LARGEST: f64 = 10_000.0;

/// Reads an LM-63 file.
pub(super) fn parse(path: &Path, text: &str) -> Result<Photometry, InputError> {
    let lines = text::lines(text);
    let mut notes = Notes::default();
    let (format, first) = edition(&lines, &mut notes);
    let Some(tilt_line) = (first..lines.len()).find(|&line| tilt::of_line(lines[line]).is_some()) else {
        if first > 0 && names_tm33(lines[first - 1]) {
            let found = format!("{}, and neither XML nor a line TILT=", quoted(lines[first - 1].trim()));
            let error = InputError::new(Location::line(path, first), found, "a TM-33 file, which is XML");
            return Err(error.hint("an LM-63 or EULUMDAT file of the luminaire is read, too"));
        }
        let at = Location::line(path, lines.len().max(1));
        let expected = "a line TILT=NONE, TILT=INCLUDE or TILT=<file> before the numbers of an LM-63 file";
        return Err(InputError::new(at, "the end of the file", expected));
    };
    let mut labels = Labels::read(&lines[first..tilt_line], format);
    let all = WordReader::new(path, &lines, tilt_line + 1, Commas::Decimal);
    let (numbers, note) = text::settle(path, all, |commas| IesData::read(path, format, &lines, tilt_line, commas))?;
    if let Some((line, sentence)) = note {
        notes.at(line, sentence);
    }
    let IesData { tilt, head, body, notes: others } = numbers;
    notes.0.extend(others.0);
    let opening_note = notes.opening(head.opening_line, head.opening.doubt(head.unit));
    labels.remarks.extend(head.generation.map(|text| ("file generation".to_owned(), text)));
    let lamps = labels.lamps(head.lamps, head.lamp_flux, head.power);
    Ok(Photometry {
        format,
        power: lamps.power,
        lamps: vec![lamps],
        lamp_set: 0,
        kind: head.kind,
        symmetry: body.symmetry,
        tabulated: [head.planes, head.angles],
        intensity: into_intensity(body.table, head.kind, body.symmetry, path, body.line)?,
        flux: None,
        downward: None,
        opening: head.opening,
        opening_note,
        tilt,
        name: labels.name,
        catalogue: labels.catalogue,
        manufacturer: labels.manufacturer,
        remarks: labels.remarks,
        notes: notes.0,
    })
}

/// What stands below `TILT=`.
#[derive(PartialEq)]
struct IesData {
    tilt: Option<Tilt>,
    head: Head,
    body: IesBody,
    notes: Notes,
}

impl IesData {
    /// Reads them where commas mean that; they end with the file, or with text.
    fn read(path: &Path, format: Format, lines: &[&str], tilt_line: usize, commas: Commas) -> Result<Self, InputError> {
        let mut notes = Notes::default();
        let mut words = WordReader::new(path, lines, tilt_line + 1, commas);
        let what = tilt::of_line(lines[tilt_line]).unwrap_or_default();
        let tilt = tilt::read(path, tilt_line + 1, what, &mut words, &mut notes)?;
        let head = Head::read(path, format, &mut words, &mut notes)?;
        let hanging = tilt.as_ref().map_or(1.0, |tilt| tilt.factor(0.0));
        if let Some(tilt) = &tilt {
            tilt.note(tilt_line + 1, hanging, &mut notes);
        }
        if hanging <= 0.0 {
            let found = format!("tilt factor {hanging} at 0°");
            return Err(InputError::new(Location::line(path, tilt_line + 1), found, "more than 0"));
        }
        let body = IesBody::read(path, &head, head.factor * hanging, &mut words, &mut notes)?;
        Ok(Self { tilt, head, body, notes })
    }
}

/// Whether a text is an LM-63 file: its first line says so, or one begins with `TILT=`.
pub(super) fn is_ies(text: &str) -> bool {
    let lines = text::lines(text);
    let first = lines.iter().find(|line| !line.trim().is_empty());
    first.is_some_and(|line| edition_of(line).is_some()) || lines.iter().any(|line| tilt::of_line(line).is_some())
}

/// The thirteen numbers before the angles.
#[derive(PartialEq)]
struct Head {
    lamps: u32,
    /// Of all lamps, lm; `None` in absolute photometry.
    lamp_flux: Option<f64>,
    /// What intensities are multiplied by.
    factor: f64,
    angles: usize,
    planes: usize,
    kind: PlaneSystem,
    unit: LengthUnit,
    opening: LuminousOpening,
    opening_line: usize,
    /// How the file came about, where it says so (2019).
    generation: Option<String>,
    power: Option<f64>,
}

impl Head {
    fn read(path: &Path, format: Format, words: &mut WordReader, notes: &mut Notes) -> Result<Self, InputError> {
        let start = words.at();
        let (lamp_line, lamps) = words.number("the number of lamps, the first of ten numbers after TILT")?;
        if lamps.fract() != 0.0 || !(0.0..=1e6).contains(&lamps) {
            let found = format!("{lamps} lamps");
            return Err(InputError::new(Location::line(path, lamp_line), found, "a whole number from 0 to 1000000"));
        }
        let (lumen_line, lumens) = words.number("lumens a lamp")?;
        if lumens <= 0.0 && lumens != -1.0 {
            notes.at(lumen_line, format!("{lumens} lm a lamp, taken for absolute photometry (-1)"));
        }
        let lamp_flux = (lumens > 0.0).then(|| lamps.max(1.0) * lumens);
        let multiplier = factor(path, words, "multiplier")?;
        let (_, angles) = words.whole("number of vertical angles", 2, angles::MOST)?;
        let (_, planes) = words.whole("number of horizontal angles", 1, angles::MOST)?;
        let (kind_line, kind) = words.whole("photometric type", 1, 3)?;
        let kind = [PlaneSystem::C, PlaneSystem::B, PlaneSystem::A][kind as usize - 1];
        let (_, unit) = words.whole("unit of length (1 feet, 2 metres)", 1, 2)?;
        let unit = if unit == 1 { LengthUnit::Foot } else { LengthUnit::Metre };
        let opening_line = words.at();
        let opening = read_opening(path, format, unit.told().1, words, notes)?;
        let ballast = factor(path, words, "ballast factor")?;
        let (other_line, other) = words.number("the number after the ballast factor")?;
        let generation = (format == Format::Lm63_2019).then(|| labels::generation(other)).flatten();
        let other = match format {
            Format::Lm63_1986 | Format::Lm63_1991 if other > 0.0 => other,
            Format::Lm63_1986 | Format::Lm63_1991 => {
                let found = format!("ballast-lamp photometric factor {other}");
                return Err(InputError::new(Location::line(path, other_line), found, "more than 0"));
            }
            Format::Lm63_1995 | Format::Lm63_2002 if other != 1.0 => {
                notes.at(other_line, format!("{other} stands where {} wants 1; it is no factor", format.name()));
                1.0
            }
            _ => 1.0,
        };
        let (power_line, power) = words.number("input power, W")?;
        if power < 0.0 {
            notes.at(power_line, format!("{power} W, taken for unknown"));
        }
        if kind == PlaneSystem::A {
            notes.at(kind_line, "type A: the luminaire looks along C0, to the horizon (γ = 90°)".to_owned());
        }
        let (angles, planes) = (angles as usize, planes as usize);
        let (needed, left) = (planes + angles + planes * angles, words.left());
        if left < needed {
            let found = format!("{planes} × {angles} angles, but {left} numbers after them");
            let expected = format!("{needed} numbers (angles, then intensities)");
            return Err(InputError::new(Location::line(path, start), found, expected).hint("is the file cut off?"));
        }
        Ok(Self {
            lamps: lamps as u32,
            lamp_flux,
            factor: multiplier * ballast * other,
            angles,
            planes,
            kind,
            unit,
            opening,
            opening_line,
            generation,
            power: (power > 0.0).then_some(power),
        })
    }
}

/// A factor that must be more than 0.
fn factor(path: &Path, words: &mut WordReader, what: &str) -> Result<f64, InputError> {
    let (line, value) = words.number(what)?;
    if value > 0.0 && value <= 1e9 {
        return Ok(value);
    }
    Err(InputError::new(Location::line(path, line), format!("{what} {value}"), "more than 0, 1e9 at most"))
}

fn read_opening(
    path: &Path,
    format: Format,
    metres: f64,
    words: &mut WordReader,
    notes: &mut Notes,
) -> Result<LuminousOpening, InputError> {
    let (line, width) = words.number("width of the luminous opening")?;
    let (_, length) = words.number("length of the luminous opening")?;
    let (_, height) = words.number("height of the luminous opening")?;
    let code = [width, length, height];
    let told = format!("luminous opening {width} {length} {height}");
    if let Some(size) = code.iter().map(|size| size.abs() * metres).find(|size| *size > LARGEST) {
        let found = format!("{told} (a size of {size} m)");
        return Err(InputError::new(Location::line(path, line), found, format!("{LARGEST} m at most")));
    }
    match LuminousOpening::from_lm63(format, code) {
        Some((opening, other)) => {
            if let Some(edition) = other {
                notes.at(line, format!("{told} is a code of {}, not of {}", edition.name(), format.name()));
            }
            Ok(opening.scaled(metres))
        }
        None => {
            let expected = "width, length and height with signs that mean a shape in LM-63";
            Err(InputError::new(Location::line(path, line), told, expected).hint("0 0 0 is a point"))
        }
    }
}

/// Angles and intensities.
#[derive(PartialEq)]
struct IesBody {
    table: IntensityTable,
    symmetry: Symmetry,
    /// Line of the planes.
    line: usize,
}

impl IesBody {
    fn read(
        path: &Path,
        head: &Head,
        factor: f64,
        words: &mut WordReader,
        notes: &mut Notes,
    ) -> Result<Self, InputError> {
        let [vertical, horizontal] = match head.kind {
            PlaneSystem::C => [[0.0, 180.0], angles::TURNS],
            PlaneSystem::B => [[-180.0, 180.0], [-90.0, 90.0]],
            PlaneSystem::A => [[-90.0, 90.0], [-180.0, 180.0]],
        };
        let angles = angles::read(path, words, head.angles, "vertical angle", vertical, notes)?;
        let planes = angles::read(path, words, head.planes, "horizontal angle", horizontal, notes)?;
        let (first, last) = (angles.list[0], angles.list[angles.list.len() - 1]);
        let complete = match head.kind {
            PlaneSystem::C => [0.0, 90.0].contains(&first) && [90.0, 180.0].contains(&last),
            PlaneSystem::A | PlaneSystem::B => [-90.0, 0.0, -180.0].contains(&first) && [90.0, 180.0].contains(&last),
        };
        if !complete {
            notes.at(angles.line, format!("vertical angles from {first}° to {last}°; beyond them there is no light"));
        }
        let symmetry = match head.kind {
            PlaneSystem::C => angles::symmetry(path, planes.line, &planes.list, notes)?,
            PlaneSystem::A | PlaneSystem::B => symmetry_of_a_or_b(planes.line, &planes.list, &angles.list, notes),
        };
        let values = Values::read(path, words, head.planes * head.angles, factor, notes)?;
        let counted =
            format!("{} × {} angles have {} intensities", head.planes, head.angles, head.planes * head.angles);
        text::check_end(path, words, &counted, notes)?;
        let mut table = IntensityTable { planes: planes.list, angles: angles.list, candela: values.candela };
        table.turn(planes.fall, angles.fall);
        if table.close() {
            notes.at(values.line, "planes 0° and 360° differ; 0° is taken".to_owned());
        }
        if head.kind == PlaneSystem::C {
            super::check_nadir(&table, values.line, notes);
        }
        Ok(Self { table, symmetry, line: planes.line })
    }
}

/// A table of any type as C-planes all around; `line` is that of its planes.
pub(super) fn into_intensity(
    table: IntensityTable,
    kind: PlaneSystem,
    symmetry: Symmetry,
    path: &Path,
    line: usize,
) -> Result<Intensity, InputError> {
    match kind {
        PlaneSystem::C => Ok(table.unfold(symmetry)),
        PlaneSystem::A | PlaneSystem::B if symmetry == Symmetry::Rotational => {
            table.about_axis(kind == PlaneSystem::A).ok_or_else(|| {
                let found = "one horizontal angle of type A or B, with intensities that differ up and down";
                InputError::new(Location::line(path, line), found, "two or more")
            })
        }
        PlaneSystem::B => Ok(table.type_b_to_c()),
        PlaneSystem::A => Ok(table.type_a_to_c()),
    }
}

/// Symmetry of a table of type A or B, which is about a plane where its angles begin at 0°.
pub(super) fn symmetry_of_a_or_b(line: usize, planes: &[f64], angles: &[f64], notes: &mut Notes) -> Symmetry {
    let (first, last) = (planes[0], planes[planes.len() - 1]);
    if planes.len() == 1 {
        notes.at(line, "one horizontal angle of type A or B, taken as the same all around the axis".to_owned());
        return Symmetry::Rotational;
    }
    if ![-90.0, 0.0, -180.0].contains(&first) || ![90.0, 180.0].contains(&last) {
        notes.at(line, format!("horizontal angles from {first}° to {last}°; beyond them there is no light"));
    }
    match (first == 0.0, angles[0] == 0.0) {
        (true, true) => Symmetry::Quadrant,
        (true, false) => Symmetry::AboutC0,
        (false, true) => Symmetry::AboutC90,
        (false, false) => Symmetry::None,
    }
}

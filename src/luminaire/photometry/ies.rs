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
//! - **Tilt**: some lamps give less light when they are tilted. The factors say how much by the luminaire's tilt;
//!   where it hangs as it was measured the tilt is 0°, and that factor is what intensities are multiplied by.
//!   [`Tilt`] keeps all.
//! - Type A and B become type C (`table.rs` tells how).
//!
//! Sources: definitions of ANSI/IESNA LM-63-02; the notes on all editions in Radiance's `ies2rad.c` 2.35; Autodesk's
//! summary of LM-63-1991; Lighting Analysts' knowledge base on complete ranges of angles.

use std::path::{Component, Path};

use super::opening::LuminousOpening;
use super::table::Table;
use super::text::{self, Words, quoted};
use super::{Format, Kind, Lamps, Notes, Photometry, Symmetry, Tilt, Values};
use crate::error::{InputError, Location};

/// Metres of a foot.
const FOOT: f64 = 0.3048;
/// Largest size of an opening, m.
const LARGEST: f64 = 1000.0;
/// Most angles of a table in one direction: twentieths of a degree around a circle.
const MOST_ANGLES: i64 = 7201;

/// Reads an LM-63 file.
pub(super) fn parse(path: &Path, text: &str) -> Result<Photometry, InputError> {
    let lines = text::lines(text);
    let mut notes = Notes::default();
    let (format, first) = edition(&lines, &mut notes);
    let Some(tilt_line) = (first..lines.len()).find(|&line| tilt_of(lines[line]).is_some()) else {
        let at = Location::line(path, lines.len().max(1));
        let expected = "a line TILT=NONE, TILT=INCLUDE or TILT=<file> before the numbers of an LM-63 file";
        return Err(InputError::new(at, "the end of the file", expected));
    };
    let labels = Labels::read(&lines[first..tilt_line], format);
    let mut words = Words::new(path, &lines, tilt_line + 1, true);
    let tilt = read_tilt(path, tilt_line + 1, tilt_of(lines[tilt_line]).unwrap_or_default(), &mut words)?;
    let head = Head::read(path, format, &mut words, &mut notes)?;
    let hanging = tilt.as_ref().map_or(1.0, |tilt| tilt.factor(0.0));
    if let Some(tilt) = &tilt {
        notes.at(tilt_line + 1, format!("{}; intensities are for 0°, factor {hanging}", tilt.describe()));
    }
    if hanging <= 0.0 {
        let found = format!("tilt factor {hanging} at 0°");
        return Err(InputError::new(Location::line(path, tilt_line + 1), found, "more than 0"));
    }
    let body = Body::read(path, &head, head.factor * hanging, &mut words, &mut notes)?;
    let lamps = labels.lamps(&head);
    Ok(Photometry {
        format,
        power: lamps.power,
        lamps: vec![lamps],
        kind: head.kind,
        symmetry: body.symmetry,
        tabulated: [head.planes, head.angles],
        intensity: body.into_intensity(head.kind),
        flux: None,
        downward: None,
        opening: head.opening,
        tilt,
        name: labels.name,
        catalogue: labels.catalogue,
        manufacturer: labels.manufacturer,
        remarks: labels.remarks,
        notes: notes.0,
    })
}

/// Whether a text is an LM-63 file: its first line says so, or one begins with `TILT=`.
pub(super) fn is_ies(text: &str) -> bool {
    let lines = text::lines(text);
    let first = lines.iter().find(|line| !line.trim().is_empty());
    first.is_some_and(|line| edition_of(line).is_some()) || lines.iter().any(|line| tilt_of(line).is_some())
}

/// What stands after `TILT=` in a line that begins so, in any case and with blanks anywhere.
fn tilt_of(line: &str) -> Option<&str> {
    let line = line.trim();
    let word = line.get(..4).filter(|word| word.eq_ignore_ascii_case("TILT"))?;
    line[word.len()..].trim_start().strip_prefix('=').map(str::trim)
}

/// The edition, and the index of the line after the one that tells it.
fn edition(lines: &[&str], notes: &mut Notes) -> (Format, usize) {
    let Some(line) = lines.iter().position(|line| !line.trim().is_empty()) else { return (Format::Lm63_1986, 0) };
    match edition_of(lines[line]) {
        Some(Some(format)) => (format, line + 1),
        Some(None) => {
            notes
                .at(line + 1, format!("{} is an edition unknown here, read as LM-63-2019", quoted(lines[line].trim())));
            (Format::Lm63_2019, line + 1)
        }
        None => (Format::Lm63_1986, line),
    }
}

/// Edition that a first line tells, `Some(None)` where it is unknown: `IESNA91`, `IESNA:LM-63-1995`,
/// `IES:LM-63-2019`, in any case and with blanks anywhere.
fn edition_of(line: &str) -> Option<Option<Format>> {
    let line: String = line.chars().filter(|c| !c.is_whitespace()).take(40).collect::<String>().to_ascii_uppercase();
    let rest = line.strip_prefix("IESNA").or_else(|| line.strip_prefix("IES"))?;
    let rest = rest.trim_start_matches([':', '-']);
    let year = match rest.strip_prefix("LM").map(|rest| rest.trim_start_matches('-')) {
        Some(rest) => rest.strip_prefix("63")?.trim_start_matches(['-', ':']),
        None if rest.starts_with(|c: char| c.is_ascii_digit()) => rest,
        None => return None,
    };
    let two_digits = year.strip_prefix("19").filter(|year| year.len() > 1).or_else(|| year.strip_prefix("20"));
    Some(match two_digits.unwrap_or(year).get(..2) {
        Some("86") => Some(Format::Lm63_1986),
        Some("91") => Some(Format::Lm63_1991),
        Some("95") => Some(Format::Lm63_1995),
        Some("02") => Some(Format::Lm63_2002),
        Some("19") => Some(Format::Lm63_2019),
        _ => None,
    })
}

/// What the lines between the edition and `TILT=` say.
#[derive(Default)]
struct Labels {
    name: String,
    catalogue: String,
    manufacturer: String,
    lamp: String,
    colour: String,
    rendering: String,
    remarks: Vec<(String, String)>,
}

impl Labels {
    fn read(lines: &[&str], format: Format) -> Self {
        let mut pairs: Vec<(String, String)> = Vec::new();
        for line in lines.iter().map(|line| line.trim()).filter(|line| !line.is_empty()) {
            let keyed = line.strip_prefix('[').and_then(|line| line.split_once(']'));
            let (key, value) = keyed.map_or(("", line), |(key, value)| (key.trim(), value.trim()));
            let key = key.to_ascii_uppercase();
            match pairs.last_mut() {
                Some((_, before)) if key == "MORE" => {
                    before.push(' ');
                    before.push_str(&text::label(value));
                }
                _ => pairs.push((text::label(&key), text::label(value))),
            }
        }
        let mut labels = Self::default();
        for (key, text) in pairs.into_iter().filter(|(_, text)| !text.is_empty()) {
            let known = match key.as_str() {
                "LUMINAIRE" => &mut labels.name,
                "LUMCAT" => &mut labels.catalogue,
                "MANUFAC" => &mut labels.manufacturer,
                "LAMP" => &mut labels.lamp,
                "COLORTEMP" => &mut labels.colour,
                "CRI" => &mut labels.rendering,
                // Without keywords the first line is what the file is about.
                "" if format == Format::Lm63_1986 => &mut labels.name,
                _ => {
                    labels.remarks.push((key.to_ascii_lowercase(), text));
                    continue;
                }
            };
            if known.is_empty() {
                *known = text;
            } else {
                labels.remarks.push((key.to_ascii_lowercase(), text));
            }
        }
        labels
    }

    fn lamps(&self, head: &Head) -> Lamps {
        Lamps {
            count: head.lamps,
            name: self.lamp.clone(),
            flux: head.lamp_flux,
            power: head.power,
            colour: self.colour.clone(),
            rendering: self.rendering.clone(),
            absolute: head.lamp_flux.is_none(),
        }
    }
}

/// The tilt factors of `TILT=` and the numbers after it, or those of the file it names.
fn read_tilt(path: &Path, line: usize, what: &str, words: &mut Words) -> Result<Option<Tilt>, InputError> {
    if what.eq_ignore_ascii_case("NONE") {
        return Ok(None);
    }
    if what.eq_ignore_ascii_case("INCLUDE") {
        return tilt_factors(path, words).map(Some);
    }
    let at = || Location::line(path, line);
    let name = Path::new(what);
    let stays = name.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    if what.is_empty() || !stays || what.contains(['\\', ':']) || what.contains(char::is_control) {
        let expected = "NONE, INCLUDE or the name of a file in the same folder";
        return Err(InputError::new(at(), format!("TILT={}", quoted(what)), expected));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let file = folder.join(name);
    // A link may lead elsewhere.
    if let (Ok(real), Ok(folder)) = (file.canonicalize(), Path::new(".").join(folder).canonicalize())
        && !real.starts_with(folder)
    {
        let found = format!("TILT={}, which lies in another folder", quoted(what));
        return Err(InputError::new(at(), found, "the name of a file in the same folder"));
    }
    let content = super::content(&file).map_err(|error| InputError {
        at: at(),
        found: format!("TILT={}, {} there", quoted(what), error.found),
        ..error
    })?;
    let text = text::decode(&file, &content)?;
    let lines = text::lines(&text);
    tilt_factors(&file, &mut Words::new(&file, &lines, 0, true)).map(Some)
}

/// Lamp-to-luminaire geometry, number of pairs, angles, factors.
fn tilt_factors(path: &Path, words: &mut Words) -> Result<Tilt, InputError> {
    let (_, geometry) = words.whole("lamp-to-luminaire geometry", 1, 3)?;
    let (_, count) = words.whole("number of tilt angles", 1, 721)?;
    let (_, angles) = words.angles(count as usize, "tilt angle", [-180.0, 180.0])?;
    let mut factors = Vec::new();
    for _ in 0..count {
        let (line, factor) = words.number("a tilt factor")?;
        if !(0.0..=100.0).contains(&factor) {
            return Err(InputError::new(Location::line(path, line), format!("tilt factor {factor}"), "0 to 100"));
        }
        factors.push(factor);
    }
    Ok(Tilt { geometry: geometry as u8, angles, factors })
}

/// The thirteen numbers before the angles.
struct Head {
    lamps: u32,
    /// Of all lamps, lm; `None` in absolute photometry.
    lamp_flux: Option<f64>,
    /// What intensities are multiplied by.
    factor: f64,
    angles: usize,
    planes: usize,
    kind: Kind,
    opening: LuminousOpening,
    power: Option<f64>,
}

impl Head {
    fn read(path: &Path, format: Format, words: &mut Words, notes: &mut Notes) -> Result<Self, InputError> {
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
        let (_, angles) = words.whole("number of vertical angles", 2, MOST_ANGLES)?;
        let (plane_line, planes) = words.whole("number of horizontal angles", 1, MOST_ANGLES)?;
        let (kind_line, kind) = words.whole("photometric type", 1, 3)?;
        let kind = [Kind::C, Kind::B, Kind::A][kind as usize - 1];
        if kind != Kind::C && planes < 2 {
            let found = "1 horizontal angle of type A or B";
            return Err(InputError::new(Location::line(path, plane_line), found, "two or more"));
        }
        let (_, unit) = words.whole("unit of length (1 feet, 2 metres)", 1, 2)?;
        let opening = read_opening(path, format, if unit == 1 { FOOT } else { 1.0 }, words, notes)?;
        let ballast = factor(path, words, "ballast factor")?;
        let (other_line, other) = words.number("the number after the ballast factor")?;
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
        if kind == Kind::A {
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
            opening,
            power: (power > 0.0).then_some(power),
        })
    }
}

/// A factor that must be more than 0.
fn factor(path: &Path, words: &mut Words, what: &str) -> Result<f64, InputError> {
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
    words: &mut Words,
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
struct Body {
    table: Table,
    symmetry: Symmetry,
}

impl Body {
    fn read(path: &Path, head: &Head, factor: f64, words: &mut Words, notes: &mut Notes) -> Result<Self, InputError> {
        let [vertical, horizontal] = match head.kind {
            Kind::C => [[0.0, 180.0], [-180.0, 360.0]],
            Kind::B => [[-180.0, 180.0], [-90.0, 90.0]],
            Kind::A => [[-90.0, 90.0], [-180.0, 180.0]],
        };
        let (angle_line, angles) = words.angles(head.angles, "vertical angle", vertical)?;
        let (plane_line, planes) = words.angles(head.planes, "horizontal angle", horizontal)?;
        let (first, last) = (angles[0], angles[angles.len() - 1]);
        let complete = match head.kind {
            Kind::C => [0.0, 90.0].contains(&first) && [90.0, 180.0].contains(&last),
            Kind::A | Kind::B => [-90.0, 0.0, -180.0].contains(&first) && [90.0, 180.0].contains(&last),
        };
        if !complete {
            notes.at(angle_line, format!("vertical angles from {first}° to {last}°; beyond them there is no light"));
        }
        let symmetry = match head.kind {
            Kind::C => symmetry_of(path, plane_line, &planes, notes)?,
            Kind::A | Kind::B => symmetry_of_a_or_b(plane_line, &planes, &angles, notes),
        };
        let values = Values::read(path, words, head.planes * head.angles, factor, notes)?;
        if let Some((line, word)) = words.next() {
            notes.at(line, format!("{} and what follows isn't read: all intensities are there", quoted(word)));
        }
        let mut table = Table { planes, angles, candela: values.candela };
        let count = table.planes.len();
        if count > 1 && table.planes[count - 1] - table.planes[0] == 360.0 {
            // The plane at 360° is the one at 0° again.
            let [from, to] = [0, count - 1].map(|plane| &table.candela[plane * head.angles..][..head.angles]);
            let largest = table.candela.iter().fold(0.0, |a: f64, b| a.max(*b));
            if from.iter().zip(to).any(|(a, b)| (a - b).abs() > 0.01 * largest) {
                notes.at(values.line, "planes 0° and 360° differ; 0° is taken".to_owned());
            }
            table.planes.pop();
            table.candela.truncate((count - 1) * head.angles);
        }
        if head.kind == Kind::C {
            super::check_nadir(&table, values.line, notes);
        }
        Ok(Self { table, symmetry })
    }

    fn into_intensity(self, kind: Kind) -> crate::luminaire::intensity::Intensity {
        match kind {
            Kind::C => self.table.unfold(self.symmetry),
            Kind::B => self.table.type_b_to_c(),
            Kind::A => self.table.type_a_to_c(),
        }
    }
}

/// Symmetry that horizontal angles of type C tell by where they begin and end.
fn symmetry_of(path: &Path, line: usize, planes: &[f64], notes: &mut Notes) -> Result<Symmetry, InputError> {
    let (first, last) = (planes[0], planes[planes.len() - 1]);
    if planes.len() == 1 {
        return Ok(Symmetry::Rotational);
    }
    let gap = first + 360.0 - last;
    match (first, last) {
        (0.0, 90.0) => Ok(Symmetry::Quadrant),
        (0.0, 180.0) => Ok(Symmetry::AboutC0),
        (90.0, 270.0) | (-90.0, 90.0) => Ok(Symmetry::AboutC90),
        _ if gap == 0.0 => Ok(Symmetry::None),
        (0.0, last) if last > 180.0 => {
            let widest = planes.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
            if gap > 1.5 * widest {
                let sentence =
                    format!("no plane between {last}° and 360°; intensities run straight from one to the other");
                notes.at(line, sentence);
            }
            Ok(Symmetry::None)
        }
        _ => {
            let found = format!("horizontal angles from {first}° to {last}°");
            let expected = "0° alone, 0° to 90°, 0° to 180°, 90° to 270° or 0° to 360°";
            Err(InputError::new(Location::line(path, line), found, expected))
        }
    }
}

/// Symmetry of a table of type A or B, which is about a plane where its angles begin at 0°.
fn symmetry_of_a_or_b(line: usize, planes: &[f64], angles: &[f64], notes: &mut Notes) -> Symmetry {
    let (first, last) = (planes[0], planes[planes.len() - 1]);
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

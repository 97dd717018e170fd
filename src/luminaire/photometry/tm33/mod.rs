//! TM-33 (ANSI/IES TM-33-18 and -23, ATLA S001, UNI 11733): a luminaire and its emitters in XML, or the same as JSON.
//!
//! - **Dialects.** `IESTM33-22` (2023) writes `LuminousData/LuminousIntensity/IntData` with attributes h and v, its
//!   examples `LuminousData/IntensityData` with horz and vert; `LuminaireOpticalData` (2018)
//!   `IntensityDistribution/IntensityData`. Names count without regard to case, blanks and underscores (`CIE _ C`).
//!   JSON has the names in camelCase, and lists of angles with the intensities plane after plane.
//! - **Intensities** are cd of the luminaire, times `Multiplier`, and times `BallastFactor` as in LM-63. They are taken
//!   as those of all `Quantity` emitters of one kind together, with a note where there are several. Emitters of several
//!   kinds shine together: their tables are added where they have the same angles, or one of them is chosen by name.
//! - **Directions** are those of LM-63: type C, A or B of the IES, planes at attribute h, angles in them at v. CIE's own
//!   types A and B number planes in another way, and are refused.
//! - **Symmetry** is told by `SymmType` and by where the planes begin and end; the two have to agree.
//! - **Opening**: `EmissionAreas`' area in the bottom face, or `LuminousOpening`, else the luminaire's dimensions, with a
//!   note. Lengths are mm, *length* lies along C0 as in LM-63.
//! - Spectra and colours over angles are passed over, with a note. Radiant and photon intensities are no light.

mod json;
mod xml;

use std::path::Path;

pub(super) use json::parse as parse_json;
pub(super) use xml::{parse as parse_xml, tree};

use super::opening::{LengthUnit, LuminousOpening};
use super::table::IntensityTable;
use super::text::{label, quoted};
use super::{Choice, Format, Kind, Lamps, Notes, Photometry, Shape, Symmetry, Values, angles};
use crate::error::{InputError, Location};
use crate::text::listed;

/// A document, in terms of both XML and JSON.
#[derive(Default)]
struct Document {
    /// Line where it begins.
    line: usize,
    name: String,
    catalogue: String,
    manufacturer: String,
    remarks: Vec<(String, String)>,
    /// Length, width and height of the luminaire, mm.
    dimensions: Option<[f64; 3]>,
    /// Length and width of the luminous area, mm, and whether it is round.
    area: Option<([f64; 2], bool)>,
    /// More luminous areas than that, or on other faces.
    more_areas: bool,
    /// Type of the goniometer.
    goniometer: Option<String>,
    emitters: Vec<Tm33Emitter>,
}

/// Emitters of one kind.
#[derive(Default)]
struct Tm33Emitter {
    line: usize,
    names: Vec<String>,
    quantity: Option<f64>,
    rated: Option<f64>,
    power: Option<f64>,
    ballast: Option<f64>,
    colour: String,
    rendering: String,
    has_tilt: bool,
    has_spectrum: bool,
    table: Option<Raw>,
}

/// Intensities as they are listed.
#[derive(Default)]
struct Raw {
    line: usize,
    kind: Option<String>,
    metric: Option<String>,
    units: Option<String>,
    symmetry: Option<String>,
    absolute: Option<bool>,
    multiplier: Option<f64>,
    flux: Option<f64>,
    /// h, v, intensity.
    points: Vec<[f64; 3]>,
}

/// A word without regard to case, blanks and signs.
fn plain(word: &str) -> String {
    word.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// A number as the file has it; `what` names it in a refusal.
fn number(path: &Path, line: usize, text: &str, what: &str) -> Result<f64, InputError> {
    text.trim()
        .parse()
        .ok()
        .filter(|number: &f64| number.is_finite())
        .ok_or_else(|| InputError::new(Location::line(path, line), quoted(text.trim()), format!("{what}, a number")))
}

impl Document {
    /// The luminaire that the document describes.
    fn photometry(self, path: &Path, choice: &Choice) -> Result<Photometry, InputError> {
        let mut notes = Notes::default();
        let chosen = self.chosen(path, choice, &mut notes)?;
        let mut lamps = Vec::new();
        let mut sum: Option<(IntensityGrid, Option<f64>)> = None;
        for emitter in chosen {
            let Some(raw) = &emitter.table else { continue };
            let grid = emitter.grid(path, raw, self.goniometer.as_deref(), &mut notes)?;
            lamps.push(emitter.lamps(raw));
            sum = Some(match sum {
                None => (grid, raw.flux),
                Some((whole, flux)) => (whole.plus(path, emitter.line, grid)?, flux.zip(raw.flux).map(|(a, b)| a + b)),
            });
        }
        let Some((grid, flux)) = sum else { return Err(self.dark(path)) };
        if lamps.len() > 1 {
            notes.0.push(format!("{} kinds of emitters, added: all of them shine", lamps.len()));
            let total = |of: fn(&Lamps) -> Option<f64>| lamps.iter().map(of).sum::<Option<f64>>();
            let (flux, power) = (total(|lamps| lamps.flux), total(|lamps| lamps.power));
            let name = lamps.iter().map(|lamps| lamps.name.clone()).collect::<Vec<_>>().join(" + ");
            let first = lamps.swap_remove(0);
            lamps = vec![Lamps { name, flux, power, ..first }];
        }
        let (opening, opening_note) = self.opening(path, &mut notes)?;
        let tabulated = [grid.table.planes.len(), grid.table.angles.len()];
        let (kind, symmetry) = (grid.kind, grid.symmetry);
        Ok(Photometry {
            format: Format::Tm33,
            intensity: grid.into_intensity(path)?,
            name: self.name,
            catalogue: self.catalogue,
            manufacturer: self.manufacturer,
            remarks: self.remarks,
            power: lamps[0].power,
            lamps,
            lamp_set: 0,
            kind,
            symmetry,
            tabulated,
            flux,
            downward: None,
            opening,
            opening_note,
            tilt: None,
            notes: notes.0,
        })
    }

    /// Emitters with intensities that count.
    fn chosen(&self, path: &Path, choice: &Choice, notes: &mut Notes) -> Result<Vec<&Tm33Emitter>, InputError> {
        let lit: Vec<&Tm33Emitter> = self.emitters.iter().filter(|emitter| emitter.table.is_some()).collect();
        choice.lamp_set.as_ref().map_or(Ok(0), |set| set.within(1, path))?;
        let Some(variant) = &choice.variant else {
            if lit.len() < self.emitters.len() && !lit.is_empty() {
                let without = self.emitters.len() - lit.len();
                notes.0.push(format!("{without} of {} emitters have no luminous intensities", self.emitters.len()));
            }
            return Ok(lit);
        };
        let wanted = variant.value.trim();
        let named: Vec<&Tm33Emitter> =
            lit.iter().copied().filter(|emitter| emitter.names.iter().any(|name| name == wanted)).collect();
        if !named.is_empty() {
            return Ok(named);
        }
        let names = listed(lit.iter().filter_map(|emitter| emitter.names.first()).map(String::as_str));
        let found = format!("variant = {}", quoted(wanted));
        Err(InputError::new(variant.at.clone(), found, format!("an emitter with luminous intensities: {names}")))
    }

    /// Why there are no intensities.
    fn dark(&self, path: &Path) -> InputError {
        let at = Location::line(path, self.line.max(1));
        let found = match self.emitters.iter().any(|emitter| emitter.has_spectrum) {
            true => "a TM-33 file with spectra, but without luminous intensities",
            false => "a TM-33 file without luminous intensities",
        };
        InputError::new(at, found, "an Emitter with LuminousData and IntensityData")
    }

    /// Where light leaves.
    fn opening(&self, path: &Path, notes: &mut Notes) -> Result<(LuminousOpening, Option<String>), InputError> {
        let sound = |size: &f64| (0.0..=1e6).contains(size);
        let sizes = self.area.iter().flat_map(|(sizes, _)| sizes).chain(self.dimensions.iter().flatten());
        if let Some(size) = sizes.copied().find(|size| !sound(size)) {
            let at = Location::line(path, self.line.max(1));
            return Err(InputError::new(at, format!("a size of {size} mm"), "0 to 1000000 mm"));
        }
        let flat = |shape: Shape, [length, width]: [f64; 2]| {
            LuminousOpening { shape, c0: length, c90: width, height: 0.0, sides: [0.0; 4] }.scaled(1e-3)
        };
        let opening = match (self.area, self.dimensions) {
            (Some((sizes, round)), _) if sizes.iter().any(|size| *size > 0.0) => {
                if self.more_areas {
                    notes.0.push("only one luminous area, that in the bottom face, is taken".to_owned());
                }
                flat(if round { Shape::Ellipse } else { Shape::Rectangle }, sizes)
            }
            (_, Some([length, width, _])) if length > 0.0 && width > 0.0 => {
                let sentence = "no luminous area is told, taken as large as the luminaire, its length along C0";
                notes.0.push(sentence.to_owned());
                flat(Shape::Rectangle, [length, width])
            }
            _ => {
                let sentence = "no luminous area is told, taken for a point; opening = … in [[luminaire]] sets one";
                notes.0.push(sentence.to_owned());
                LuminousOpening::POINT
            }
        };
        let doubt = notes.opening(self.line.max(1), opening.doubt(LengthUnit::Millimetre));
        Ok((opening, doubt))
    }
}

impl Tm33Emitter {
    fn lamps(&self, raw: &Raw) -> Lamps {
        Lamps {
            count: self.quantity.map_or(1, |quantity| quantity.clamp(0.0, 1e9) as u32),
            name: label(self.names.first().map_or("", String::as_str)),
            flux: self.rated.filter(|flux| (0.0..=1e12).contains(flux)),
            power: self.power.filter(|power| *power > 0.0),
            colour: self.colour.clone(),
            rendering: self.rendering.clone(),
            absolute: raw.absolute != Some(false),
        }
    }

    /// The intensities as a table, every factor in them.
    fn grid(
        &self,
        path: &Path,
        raw: &Raw,
        goniometer: Option<&str>,
        notes: &mut Notes,
    ) -> Result<IntensityGrid, InputError> {
        let refuse = |found: String, expected: &str| {
            Err(InputError::new(Location::line(path, raw.line), found, expected.to_owned()))
        };
        if let Some(metric) = raw.metric.as_deref().filter(|metric| !plain(metric).contains("lumin")) {
            return refuse(format!("intensities of metric {}", quoted(metric)), "Luminous");
        }
        let kind = match raw.kind.as_deref().or(goniometer).map(|kind| (plain(kind), kind)) {
            None => {
                notes.0.push("no type of photometry is told, taken for type C".to_owned());
                Kind::C
            }
            Some((kind, told)) => match kind.strip_prefix("ies").unwrap_or(&kind).trim_start_matches("type") {
                "c" | "ciec" | "ciecgamma" => Kind::C,
                "b" => Kind::B,
                "a" => Kind::A,
                _ => return refuse(format!("photometry of type {}", quoted(told)), "CIE_C, IES_C, IES_B or IES_A"),
            },
        };
        let mut factor = raw.multiplier.unwrap_or(1.0) * self.ballast.unwrap_or(1.0);
        match raw.units.as_deref().map(plain).as_deref() {
            None | Some("" | "cd" | "candela" | "candelas") => {}
            Some("cdklm" | "cdper1000lm") => match self.rated {
                Some(flux) if flux > 0.0 => factor *= flux / 1000.0,
                _ => return refuse("intensities in cd/klm without RatedLumens".to_owned(), "RatedLumens, or cd"),
            },
            Some(_) => {
                let units = raw.units.as_deref().unwrap_or_default();
                return refuse(format!("intensities in {}", quoted(units)), "cd or cd/klm");
            }
        }
        if !(factor > 0.0 && factor <= 1e9) {
            return refuse(format!("intensities times {factor}"), "a factor above 0, 1e9 at most");
        }
        if let Some(ballast) = self.ballast.filter(|ballast| *ballast != 1.0) {
            notes.0.push(format!("intensities are multiplied by the ballast factor {ballast}, as in LM-63"));
        }
        if let Some(quantity) = self.quantity.filter(|quantity| *quantity != 1.0) {
            notes.0.push(format!("{quantity} emitters of one kind; the intensities are taken as those of all of them"));
        }
        if self.has_tilt {
            notes.0.push("factors of the lamp's tilt are passed over: how the lamp lies isn't told".to_owned());
        }
        if self.has_spectrum {
            notes.0.push("spectra and colours are passed over; color or cct in [[luminaire]] sets a colour".to_owned());
        }
        let table = raw.table(path, kind, factor, notes)?;
        let symmetry = raw.symmetry(path, kind, &table, notes)?;
        let mut grid = IntensityGrid { kind, symmetry, table, line: raw.line };
        if grid.table.close() {
            notes.at(raw.line, "planes 0° and 360° differ; 0° is taken".to_owned());
        }
        if kind == Kind::C {
            super::check_nadir(&grid.table, raw.line, notes);
        }
        Ok(grid)
    }
}

impl Raw {
    /// The intensities in the order of their angles; those at the poles may stand in one plane only.
    fn table(&self, path: &Path, kind: Kind, factor: f64, notes: &mut Notes) -> Result<IntensityTable, InputError> {
        let refused =
            |found: String, expected: String| InputError::new(Location::line(path, self.line), found, expected);
        let refuse = |found: String, expected: String| Err(refused(found, expected));
        let (planes, angles) = match kind {
            Kind::C => (angles::TURNS, [0.0, 180.0]),
            Kind::B => ([-90.0, 90.0], [-180.0, 180.0]),
            Kind::A => ([-180.0, 180.0], [-90.0, 90.0]),
        };
        let sorted = |axis: usize, [low, high]: [f64; 2], name: &str| {
            let mut list: Vec<f64> = self.points.iter().map(|point| point[axis] + 0.0).collect();
            list.sort_by(f64::total_cmp);
            list.dedup();
            match list.iter().find(|angle| !(low..=high).contains(*angle)) {
                Some(angle) => Err(refused(format!("{name} angle {angle}"), format!("{low}° to {high}°"))),
                None => Ok(list),
            }
        };
        let (planes, angles) = (sorted(0, planes, "horizontal")?, sorted(1, angles, "vertical")?);
        let count = planes.len() * angles.len();
        let counts = format!("{} planes × {} angles", planes.len(), angles.len());
        if angles.len() < 2 || planes.len().max(angles.len()) as i64 > angles::MOST {
            return refuse(counts, format!("2 to {} angles, and no more planes than that", angles::MOST));
        }
        if planes[planes.len() - 1] - planes[0] > 360.0 {
            return refuse(format!("planes from {}° to {}°", planes[0], planes[planes.len() - 1]), "a turn".into());
        }
        if self.points.len() + 2 * planes.len() < count {
            let expected = format!("{count}: one for each pair of angles");
            return refuse(format!("{counts}, but {} intensities", self.points.len()), expected);
        }
        let place = |list: &[f64], angle: f64| list.partition_point(|other| *other < angle + 0.0);
        let mut values = vec![f64::NAN; count];
        for &[h, v, value] in &self.points {
            let entry = &mut values[place(&planes, h) * angles.len() + place(&angles, v)];
            if !entry.is_nan() && *entry != value {
                return refuse(format!("two intensities at h {h}°, v {v}°: {entry} and {value}"), "one".into());
            }
            *entry = value;
        }
        for (a, v) in angles.iter().enumerate().filter(|(_, v)| kind == Kind::C && [0.0, 180.0].contains(*v)) {
            let row = || (0..planes.len()).map(|plane| plane * angles.len() + a);
            let known: Vec<f64> = row().map(|i| values[i]).filter(|value| !value.is_nan()).collect();
            if known.len() == 1 && planes.len() > 1 {
                row().for_each(|i| values[i] = known[0]);
                notes.at(self.line, format!("the intensity at v {v}° stands in one plane, and holds for all"));
            }
        }
        if let Some(i) = values.iter().position(|value| value.is_nan()) {
            let (h, v) = (planes[i / angles.len()], angles[i % angles.len()]);
            return refuse(format!("no intensity at h {h}°, v {v}°"), format!("one for each of {counts}"));
        }
        let numbers = values.into_iter().map(|value| Ok((self.line, value)));
        let candela = Values::of(path, self.line, numbers, factor, notes)?.candela;
        Ok(IntensityTable { planes, angles, candela })
    }

    /// Symmetry of the table, as it says and as its planes tell.
    fn symmetry(
        &self,
        path: &Path,
        kind: Kind,
        table: &IntensityTable,
        notes: &mut Notes,
    ) -> Result<Symmetry, InputError> {
        let told = match self.symmetry.as_deref().map(|told| (plain(told), told)) {
            None => None,
            Some((word, told)) => Some(match word.strip_prefix("symm").unwrap_or(&word) {
                "none" | "arbitrary" => Symmetry::None,
                "full" => Symmetry::Rotational,
                "bi0" => Symmetry::AboutC0,
                "bi90" => Symmetry::AboutC90,
                "quad" => Symmetry::Quadrant,
                _ => {
                    let expected = "Symm_None, Symm_Bi_0, Symm_Bi_90, Symm_Quad or Symm_Full";
                    let found = format!("symmetry {}", quoted(told));
                    return Err(InputError::new(Location::line(path, self.line), found, expected));
                }
            }),
        };
        if kind != Kind::C {
            return Ok(super::ies::symmetry_of_a_or_b(self.line, &table.planes, &table.angles, notes));
        }
        let seen = angles::symmetry(path, self.line, &table.planes, notes)?;
        let agree = match told {
            None => true,
            Some(Symmetry::None) if seen == Symmetry::Rotational => {
                notes.at(self.line, "no symmetry, but one plane: taken as the same all around".to_owned());
                true
            }
            Some(Symmetry::None) => seen == Symmetry::None,
            // A table of all planes says the same as the part that its symmetry asks for.
            Some(told) => seen == told || seen == Symmetry::None || seen == Symmetry::Rotational,
        };
        if agree {
            return Ok(seen);
        }
        let (first, last) = (table.planes[0], table.planes[table.planes.len() - 1]);
        let found = format!(
            "symmetry {}, but {} planes from {first}° to {last}°",
            quoted(self.symmetry.as_deref().unwrap_or_default()),
            table.planes.len()
        );
        Err(InputError::new(Location::line(path, self.line), found, "planes that the symmetry asks for"))
    }
}

/// Intensities as a table.
struct IntensityGrid {
    kind: Kind,
    symmetry: Symmetry,
    table: IntensityTable,
    line: usize,
}

impl IntensityGrid {
    /// Both together, which have the same angles.
    fn plus(mut self, path: &Path, line: usize, other: Self) -> Result<Self, InputError> {
        let alike = self.kind == other.kind
            && self.symmetry == other.symmetry
            && self.table.planes == other.table.planes
            && self.table.angles == other.table.angles;
        if !alike {
            let found = "emitters whose intensities stand at other angles";
            let error = InputError::new(Location::line(path, line), found, "the same angles, or one emitter");
            return Err(error.hint("variant = … in [[luminaire]] chooses an emitter by its description"));
        }
        self.table.candela.iter_mut().zip(other.table.candela).for_each(|(sum, more)| *sum += more);
        Ok(self)
    }

    fn into_intensity(self, path: &Path) -> Result<crate::luminaire::intensity::Intensity, InputError> {
        super::ies::into_intensity(self.table, self.kind, self.symmetry, path, self.line)
    }
}

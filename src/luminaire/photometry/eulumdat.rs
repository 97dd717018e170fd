//! EULUMDAT (`.ldt`; A. W. Stockmar, "EULUMDAT – ein Leuchtendatenformat für den europäischen Beleuchtungsplaner",
//! Licht '90).
//!
//! One item a line: 26 lines about the luminaire, six for each set of lamps, ten direct ratios, the C-planes, the γ
//! angles, and intensities in cd per 1000 lm of the lamps.
//!
//! - Sets of lamps are alternatives; the first counts, or the one that is chosen ([`Choice`]). A negative number of
//!   lamps means absolute photometry (Lighting Analysts and DIAL, 2009): the flux is that of the luminaire. Intensities
//!   are cd/klm in both cases, so I = value × conversion factor × flux / 1000.
//! - With symmetry (Isym) only part of the planes have intensities: 1 one plane, 2 C0 … C180, 4 C0 … C90, 3 C270 over
//!   C0 to C90 (from plane 3 Mc/4 + 1 on, Mc/2 + 1 of them); all Mc planes are listed nonetheless.
//! - C0 is taken to lie across the lamp, C90 along it (`opening.rs`). Planes are taken to count counterclockwise seen
//!   from above, C0 towards +x and C90 towards +y, the same as in LM-63.
//! - Without a set of lamps, or with lamps of 0 lm, it isn't known how much light there is: refused, unless the user
//!   says what the luminaire gives.
//! - C-planes and γ angles in descending order, and planes past 360°, are taken with a note (`angles.rs`).
//! - Decimal commas are taken with a note, unless each could part thousands as well (`text.rs`). Numbers left over
//!   after the last intensity are refused; text there is passed over.
//! - The flux declared for the luminaire is that of the lamps × LORL.

use std::path::Path;

use super::opening::{LengthUnit, LuminousOpening};
use super::table::{IntensityTable, within_turn};
use super::text::{self, Commas, WordReader, quoted};
use super::{Choice, Format, Lamps, Notes, Photometry, PlaneSystem, Symmetry, Values, angles};
use crate::error::{InputError, Location};

/// Lines of the head, which begin the file.
const HEAD: usize = 26;

/// Reads a EULUMDAT file.
pub(super) fn parse(path: &Path, text: &str, choice: &Choice) -> Result<Photometry, InputError> {
    let lines = text::lines(text);
    let mut notes = Notes::default();
    let head = NumberedLines { path, lines: &lines };
    let (kind, planes, angles) = (head.whole(3, "symmetry (Isym)", 0, 4)?, head.planes()?, head.angles()?);
    let sets = head.whole(26, "number of sets of lamps", 0, 1000)? as usize;
    let lamps = (0..sets).map(|set| head.lamps(HEAD + 6 * set, &mut notes)).collect::<Result<Vec<_>, _>>()?;
    if let Some((line, sentence)) = text::decimals(path, head.numbers(sets))? {
        notes.at(line, sentence);
    }
    let set = head.chosen(sets, choice, &mut notes)?;
    let factor = head.factor(lamps.get(set), HEAD + 6 * set + 3, choice, &mut notes)?;
    let opening = head.opening(&mut notes)?;
    let tilt = head.number(25, "tilt during measurement", &mut notes)?;
    if tilt != 0.0 {
        notes.at(25, format!("measured tilted by {tilt}°; directions are taken as they stand"));
    }
    let first = HEAD + 6 * sets + 10;
    let stored = Stored::new(kind, planes);
    let read = |commas| {
        let mut notes = Notes::default();
        let body = stored.read(path, angles, factor, &mut WordReader::new(path, &lines, first, commas), &mut notes)?;
        Ok((body, notes))
    };
    let ((body, others), note) = text::settle(path, WordReader::new(path, &lines, first, Commas::Decimal), read)?;
    if let Some((line, sentence)) = note {
        notes.at(line, sentence);
    }
    notes.0.extend(others.0);
    let opening_note = notes.opening(16, opening.doubt(LengthUnit::Millimetre));
    let share = |line: usize, what: &str, notes: &mut Notes| -> Result<Option<f64>, InputError> {
        let percent = head.number(line, what, notes)?;
        Ok((percent > 0.0 && percent <= 1000.0).then_some(percent / 100.0))
    };
    let downward = share(22, "downward flux fraction", &mut notes)?.map(|share| share.min(1.0));
    let output = share(23, "light output ratio (LORL)", &mut notes)?;
    if output.is_none() {
        notes.at(23, "no light output ratio: the file declares no flux of the luminaire".to_owned());
    }
    let text = |line: usize| text::label(head.text(line));
    let remarks = [(8, "report"), (11, "file"), (12, "date")];
    Ok(Photometry {
        format: Format::Eulumdat,
        name: text(9),
        catalogue: text(10),
        manufacturer: text(1),
        remarks: remarks
            .map(|(line, what)| (what.to_owned(), text(line)))
            .into_iter()
            .filter(|r| !r.1.is_empty())
            .collect(),
        kind: PlaneSystem::C,
        symmetry: stored.symmetry,
        tabulated: [stored.planes, angles],
        intensity: body.unfold(stored.symmetry),
        flux: output.zip(lamps.get(set).and_then(|lamps| lamps.flux)).map(|(output, flux)| output * flux),
        downward,
        opening,
        opening_note,
        tilt: None,
        power: lamps.get(set).and_then(|lamps| lamps.power),
        lamps,
        lamp_set: set,
        notes: notes.0,
    })
}

/// Whether a text looks like EULUMDAT: type and symmetry in lines 2 and 3, numbers in 4 to 7.
pub(super) fn is_eulumdat(text: &str) -> bool {
    let lines = text::lines(text);
    let number = |line: usize| lines.get(line - 1).and_then(|line| text::parse(line.trim()));
    number(3).is_some_and(|symmetry| [0.0, 1.0, 2.0, 3.0, 4.0].contains(&symmetry))
        && [2, 4, 5, 6, 7].into_iter().all(|line| number(line).is_some())
}

/// The lines of a file by their number, from 1.
struct NumberedLines<'a> {
    path: &'a Path,
    lines: &'a [&'a str],
}

impl NumberedLines<'_> {
    fn text(&self, line: usize) -> &str {
        self.lines.get(line - 1).map_or("", |line| line.trim())
    }

    fn refuse<T>(&self, line: usize, found: String, expected: &str) -> Result<T, InputError> {
        let at = Location::line(self.path, line.min(self.lines.len().max(1)));
        let found = if line > self.lines.len() { "the end of the file".to_owned() } else { found };
        Err(InputError::new(at, found, expected))
    }

    /// The number of a line; an empty one is 0.
    fn number(&self, line: usize, what: &str, notes: &mut Notes) -> Result<f64, InputError> {
        let text = self.text(line);
        if text.is_empty() && line <= self.lines.len() {
            notes.at(line, format!("nothing where {what} should stand, taken for 0"));
            return Ok(0.0);
        }
        match text::parse(text) {
            Some(number) => Ok(number),
            None => self.refuse(line, quoted(text), what),
        }
    }

    fn whole(&self, line: usize, what: &str, low: i64, high: i64) -> Result<i64, InputError> {
        let number = text::parse(self.text(line)).filter(|number| number.fract() == 0.0);
        match number.filter(|number| (low as f64..=high as f64).contains(number)) {
            Some(number) => Ok(number as i64),
            None => self.refuse(line, quoted(self.text(line)), &format!("{what}, {low} to {high}")),
        }
    }

    fn planes(&self) -> Result<usize, InputError> {
        Ok(self.whole(4, "number of C-planes (Mc)", 1, angles::MOST)? as usize)
    }

    fn angles(&self) -> Result<usize, InputError> {
        Ok(self.whole(6, "number of γ angles (Ng)", 2, angles::MOST)? as usize)
    }

    /// The set of lamps whose first line follows `before`.
    fn lamps(&self, before: usize, notes: &mut Notes) -> Result<Lamps, InputError> {
        let count = self.whole(before + 1, "number of lamps", -1_000_000, 1_000_000)?;
        let flux = self.number(before + 3, "luminous flux of the lamps, lm", notes)?;
        if !(0.0..=1e12).contains(&flux) {
            return self.refuse(before + 3, format!("{flux} lm"), "a luminous flux from 0 to 1e12 lm");
        }
        let power = self.number(before + 6, "power of the lamps, W", notes)?;
        Ok(Lamps {
            count: count.unsigned_abs() as u32,
            name: text::label(self.text(before + 2)),
            flux: Some(flux),
            power: (power > 0.0).then_some(power),
            colour: text::label(self.text(before + 4)),
            rendering: text::label(self.text(before + 5)),
            absolute: count < 0,
        })
    }

    /// Every line of the head that is a number, and the set of lamps' and ratios', with its text.
    fn numbers(&self, sets: usize) -> impl Iterator<Item = (usize, &str)> {
        let lamps = (0..sets).flat_map(|set| [1, 3, 6].map(|line| HEAD + 6 * set + line));
        let ratios = (1..=10).map(move |line| HEAD + 6 * sets + line);
        let all = (4..=7).chain(13..=HEAD).chain(lamps).chain(ratios);
        all.map(|line| (line, self.text(line))).filter(|(_, text)| text::parse(text).is_some())
    }

    /// Index of the set of lamps that counts.
    fn chosen(&self, sets: usize, choice: &Choice, notes: &mut Notes) -> Result<usize, InputError> {
        match &choice.lamp_set {
            Some(set) => set.within(sets, self.path),
            None if sets > 1 => {
                notes.at(26, format!("{sets} sets of lamps, alternatives; the first is taken"));
                Ok(0)
            }
            None => Ok(0),
        }
    }

    /// What values are multiplied by to be cd; `line` is that of the lamps' flux.
    fn factor(
        &self,
        lamps: Option<&Lamps>,
        line: usize,
        choice: &Choice,
        notes: &mut Notes,
    ) -> Result<f64, InputError> {
        let conversion = self.number(24, "conversion factor of the intensities", notes)?;
        let conversion = if conversion == 0.0 {
            notes.at(24, "conversion factor 0, taken for 1".to_owned());
            1.0
        } else {
            conversion
        };
        if !(0.0..=1e9).contains(&conversion) {
            return self.refuse(24, format!("conversion factor {conversion}"), "more than 0, 1e9 at most");
        }
        let (line, found) = match lamps {
            Some(Lamps { flux: Some(flux), .. }) if *flux > 0.0 => return Ok(conversion * flux / 1000.0),
            Some(_) => (line, "lamps without a luminous flux"),
            None => (26, "no set of lamps"),
        };
        if choice.flux_is_told {
            return Ok(conversion);
        }
        let expected = "more than 0 lm: intensities are cd per 1000 lm of the lamps";
        let error = self.refuse(line, found.to_owned(), expected);
        error.map_err(|error| error.hint("flux = … in [[luminaire]] says what the luminaire gives, lm"))
    }

    /// Lengths are mm.
    fn opening(&self, notes: &mut Notes) -> Result<LuminousOpening, InputError> {
        let mut size = |line: usize, what: &str| -> Result<f64, InputError> {
            let size = self.number(line, what, notes)?;
            if (0.0..=1e6).contains(&size) {
                return Ok(size);
            }
            self.refuse(line, format!("{what} {size} mm"), "0 to 1000000 mm")
        };
        let length = size(16, "length of the luminous area")?;
        let width = size(17, "width of the luminous area")?;
        let mut sides = [0.0; 4];
        for (line, side) in (18..).zip(&mut sides) {
            *side = size(line, "height of the luminous area")?;
        }
        Ok(LuminousOpening::from_eulumdat(length, width, sides).scaled(1e-3))
    }
}

/// Which of the planes have intensities.
struct Stored {
    symmetry: Symmetry,
    /// Planes listed.
    planes: usize,
    /// Index of the first with intensities, and how many follow each other from it, around the circle.
    first: usize,
    count: usize,
}

impl Stored {
    fn new(kind: i64, planes: usize) -> Self {
        let (symmetry, first, count) = match kind {
            1 => (Symmetry::Rotational, 0, 1),
            2 => (Symmetry::AboutC0, 0, planes / 2 + 1),
            3 => (Symmetry::AboutC90, 3 * planes / 4, planes / 2 + 1),
            4 => (Symmetry::Quadrant, 0, planes / 4 + 1),
            _ if planes == 1 => (Symmetry::Rotational, 0, 1),
            _ => (Symmetry::None, 0, planes),
        };
        Self { symmetry, planes, first, count: count.min(planes) }
    }

    fn read(
        &self,
        path: &Path,
        angles: usize,
        factor: f64,
        words: &mut WordReader,
        notes: &mut Notes,
    ) -> Result<IntensityTable, InputError> {
        let (start, left) = (words.at(), words.left());
        let needed = self.planes + angles + self.count * angles;
        if left < needed {
            let found =
                format!("{} planes × {angles} angles (lines 3, 4 and 6), but {left} numbers for them", self.planes);
            let expected = format!("{needed} numbers (planes, angles, then {} planes of intensities)", self.count);
            let error = InputError::new(Location::line(path, start), found, expected);
            return Err(error.hint("is the file cut off?"));
        }
        let planes = angles::read(path, words, self.planes, "C-plane", angles::TURNS, notes)?;
        let gamma = angles::read(path, words, angles, "γ angle", [0.0, 180.0], notes)?;
        // Some programs store every plane whatever the symmetry.
        let all = self.count == self.planes || words.left() == self.planes * angles;
        let (first, count) = if all { (0, self.planes) } else { (self.begin(&planes.list), self.count) };
        if all && self.count < self.planes {
            let line = words.at();
            notes.at(
                line,
                format!("intensities of all {} planes, though symmetry asks for {}", self.planes, self.count),
            );
        }
        if planes.fall && !all && self.symmetry != Symmetry::Rotational {
            let found = "C-planes in descending order";
            let expected = "ascending ones where symmetry (line 3) says which have intensities";
            return Err(InputError::new(Location::line(path, planes.line), found, expected));
        }
        self.check_ends(path, planes.line, &planes.list, first, count)?;
        let values = Values::read(path, words, count * angles, factor, notes)?;
        let counted = format!("{count} × {angles} angles have {} intensities", count * angles);
        text::check_end(path, words, &counted, notes)?;
        let mut stored: Vec<f64> = (first..first + count).map(|plane| planes.list[plane % self.planes]).collect();
        if self.symmetry == Symmetry::AboutC90 && !all {
            // From C270 over C0 to C90: as −90 … 90.
            stored.iter_mut().filter(|c| **c > 180.0).for_each(|c| *c -= 360.0);
        }
        let mut table = IntensityTable { planes: stored, angles: gamma.list, candela: values.candela };
        table.turn(planes.fall && all, gamma.fall);
        table.close();
        super::check_nadir(&table, values.line, notes);
        Ok(table)
    }

    /// Index of the first plane with intensities: the one where the symmetry begins, else the one at its place in a
    /// list that begins at C0.
    fn begin(&self, planes: &[f64]) -> usize {
        let start = self.ends().map(|[start, _]| start);
        planes.iter().position(|plane| Some(within_turn(*plane)) == start).unwrap_or(self.first)
    }

    /// Where the symmetry begins and ends.
    fn ends(&self) -> Option<[f64; 2]> {
        match self.symmetry {
            Symmetry::AboutC0 => Some([0.0, 180.0]),
            Symmetry::AboutC90 => Some([270.0, 90.0]),
            Symmetry::Quadrant => Some([0.0, 90.0]),
            Symmetry::None | Symmetry::Rotational => None,
        }
    }

    /// Whether the planes with intensities begin and end where the symmetry wants them, or go all around.
    fn check_ends(
        &self,
        path: &Path,
        line: usize,
        planes: &[f64],
        first: usize,
        count: usize,
    ) -> Result<(), InputError> {
        let Some(ends) = self.ends() else { return Ok(()) };
        let found = [first, first + count - 1].map(|plane| within_turn(planes[plane % self.planes]));
        let widest = planes.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        let around = count == self.planes && 360.0 - (planes[self.planes - 1] - planes[0]) <= 1.5 * widest;
        if found == ends || around {
            return Ok(());
        }
        let found = format!("planes C{} to C{} with intensities", found[0], found[1]);
        let expected = format!("C{} to C{}, as the symmetry (line 3) asks", ends[0], ends[1]);
        Err(InputError::new(Location::line(path, line), found, expected))
    }
}

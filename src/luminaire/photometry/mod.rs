//! Photometric files: luminous intensity as laboratories publish it.
//!
//! [`Photometry::read`] takes all of them to the same terms: candelas of the luminaire on C-planes all around, sizes in
//! metres. Content decides what a file is (`formats.rs`):
//!
//! | Format | Ending | Read in |
//! |---|---|---|
//! | LM-63, editions 1986 to 2019 | `.ies` | `ies.rs`, `labels.rs`, `tilt.rs` |
//! | EULUMDAT | `.ldt` | `eulumdat.rs` |
//! | TM-33, ATLA S001, UNI 11733 | `.xml`, `.iesxml`, `.json` | `tm33/` |
//! | GLDF, which holds files of the others | `.gldf` | `gldf.rs` |
//!
//! Others (ULD of DIALux, ROLF of Relux, CIBSE TM14 …) are refused by name. What each format says about directions and
//! sizes, and where that is written, stands in these files and in `angles.rs`, `opening.rs` and `table.rs`. What a file
//! leaves open is decided where only one meaning fits (`text.rs`: commas; `angles.rs`: where planes begin), and told in
//! [`Photometry::notes`]; else the file is refused.

mod angles;
mod eulumdat;
mod formats;
mod gldf;
mod ies;
mod labels;
mod opening;
mod table;
mod text;
mod tilt;
mod tm33;

use std::path::Path;

pub use opening::{LuminousOpening, Shape};
pub use tilt::Tilt;

use self::table::IntensityTable;
use self::text::{WordReader, quoted};
use super::intensity::Intensity;
use crate::error::{InputError, Location};
use crate::files;
use crate::files::limits::LARGEST_GLDF;

/// Largest intensity that is believed, cd: a hundred million times a searchlight's would be a mistake.
const BRIGHTEST: f64 = 1e15;

/// Share of the largest intensity up to which a negative one is taken for noise of the measurement.
const NOISE: f64 = 0.01;

/// What a photometric file says about a luminaire.
#[derive(Clone, Debug)]
pub struct Photometry {
    /// Format and edition found.
    pub format: Format,
    /// Name of the luminaire; empty where the file has none.
    pub name: String,
    /// Its number in the maker's catalogue; empty where the file has none.
    pub catalogue: String,
    /// Who makes it; empty where the file has none.
    pub manufacturer: String,
    /// What else the file tells (test report, laboratory, date …): what it calls it, and the text.
    pub remarks: Vec<(String, String)>,
    /// The lamps; in EULUMDAT files with several sets each is an alternative.
    pub lamps: Vec<Lamps>,
    /// Index of the set of lamps that counts.
    pub lamp_set: usize,
    /// How directions were tabulated, before they became C-planes and γ.
    pub kind: PlaneSystem,
    /// Symmetry of the table, before it was unfolded.
    pub symmetry: Symmetry,
    /// C-planes (or horizontal angles) and γ (or vertical angles) in the file.
    pub tabulated: [usize; 2],
    /// Luminous intensity of the luminaire, cd: every factor of the file is in it, symmetries are unfolded.
    pub intensity: Intensity,
    /// Luminous flux that the file declares for the luminaire, lm. EULUMDAT: flux of the lamps × LORL. LM-63 declares
    /// none (its relative files give the lamps' flux, see [`Lamps::flux`]).
    pub flux: Option<f64>,
    /// Share of the flux that goes down, 0 … 1, where the file declares it (EULUMDAT: DFF).
    pub downward: Option<f64>,
    /// Where light leaves.
    pub opening: LuminousOpening,
    /// What is doubtful about the opening's sizes; it is among the notes, too.
    pub opening_note: Option<String>,
    /// What tilting the luminaire does to its light (LM-63); `intensity` is for 0°.
    pub tilt: Option<Tilt>,
    /// Electrical power, ballast included, W; `None` where the file says 0.
    pub power: Option<f64>,
    /// What is odd but accepted, each with its line: `line 14: …`.
    pub notes: Vec<String>,
}

impl Photometry {
    /// Reads a file; content decides what it is, the ending only where content can't.
    ///
    /// # Errors
    /// Where the file can't be read or isn't understood, with its line.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        Self::parse(path, &content(path)?)
    }

    /// The same from the content of a file; `path` names it in errors and tells where a tilt file is.
    ///
    /// # Errors
    /// See [`read`](Self::read).
    pub fn parse(path: &Path, content: &[u8]) -> Result<Self, InputError> {
        Self::parse_chosen(path, content, &Choice::default())
    }

    /// The same where the file holds several sets of lamps or variants and one of them is chosen.
    ///
    /// # Errors
    /// See [`read`](Self::read); and where what is chosen isn't there.
    pub fn parse_chosen(path: &Path, content: &[u8], choice: &Choice) -> Result<Self, InputError> {
        if content.starts_with(b"PK\x03\x04") || content.starts_with(b"PK\x05\x06") {
            return gldf::parse(path, content, choice);
        }
        formats::parse_plain(path, content, choice)
    }
}

/// What the user says about a file that leaves something open.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    /// Which set of lamps counts, from 1.
    pub lamp_set: Option<Chosen<usize>>,
    /// Which variant (GLDF) or emitter (TM-33), by its name.
    pub variant: Option<Chosen<String>>,
    /// Whether the luminaire's flux is known from elsewhere, so that the file has to give its distribution only.
    pub flux_is_told: bool,
}

/// Something chosen, and where that is said.
#[derive(Clone, Debug, PartialEq)]
pub struct Chosen<T> {
    /// What.
    pub value: T,
    /// Where.
    pub at: Location,
}

impl Chosen<usize> {
    /// As an index of `count` sets of lamps of a file.
    fn within(&self, count: usize, path: &Path) -> Result<usize, InputError> {
        if (1..=count).contains(&self.value) {
            return Ok(self.value - 1);
        }
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        let expected = match count {
            0 => format!("no lamp_set: {} has no set of lamps", quoted(&file)),
            1 => format!("1: {} has one set of lamps", quoted(&file)),
            more => format!("1 to {more}: {} has {more} sets of lamps", quoted(&file)),
        };
        Err(InputError::new(self.at.clone(), format!("lamp_set = {}", self.value), expected))
    }
}

/// Format of a photometric file, with its edition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// LM-63-1986: no line tells the edition.
    Lm63_1986,
    /// LM-63-1991: `IESNA91`.
    Lm63_1991,
    /// `IESNA:LM-63-1995`.
    Lm63_1995,
    /// `IESNA:LM-63-2002`.
    Lm63_2002,
    /// `IES:LM-63-2019`.
    Lm63_2019,
    /// EULUMDAT (1990).
    Eulumdat,
    /// ANSI/IES TM-33, also ATLA S001 and UNI 11733: XML, or the same as JSON.
    Tm33,
}

impl Format {
    /// As people write it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lm63_1986 => "LM-63-1986",
            Self::Lm63_1991 => "LM-63-1991",
            Self::Lm63_1995 => "LM-63-1995",
            Self::Lm63_2002 => "LM-63-2002",
            Self::Lm63_2019 => "LM-63-2019",
            Self::Eulumdat => "EULUMDAT",
            Self::Tm33 => "TM-33",
        }
    }
}

/// A set of lamps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lamps {
    /// How many.
    pub count: u32,
    /// Their type, empty where the file doesn't say.
    pub name: String,
    /// Luminous flux of all of them, lm; `None` in absolute photometry of LM-63. In absolute photometry of EULUMDAT
    /// that of the luminaire.
    pub flux: Option<f64>,
    /// Power, ballast included, W; `None` where the file doesn't say.
    pub power: Option<f64>,
    /// Colour temperature or appearance, empty where the file doesn't say.
    pub colour: String,
    /// Colour rendering, empty where the file doesn't say.
    pub rendering: String,
    /// Whether intensities hold for the luminaire as it is, whatever lamps it has.
    pub absolute: bool,
}

/// How a goniometer tabulates directions (CIE 121, IES LM-75).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaneSystem {
    /// Half-planes about the vertical axis, γ from the nadir.
    C,
    /// Planes about a horizontal axis along C90, floodlights.
    B,
    /// Planes about a vertical axis of a luminaire that looks along the horizon, headlights.
    A,
}

/// Symmetry of the table in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symmetry {
    /// None.
    None,
    /// One plane stands for all.
    Rotational,
    /// About the plane C0–C180.
    AboutC0,
    /// About the plane C90–C270.
    AboutC90,
    /// About both.
    Quadrant,
}

/// What is odd but accepted.
#[derive(Default, PartialEq)]
struct Notes(Vec<String>);

impl Notes {
    /// A note about a line.
    fn at(&mut self, line: usize, sentence: String) {
        self.0.push(format!("line {line}: {sentence}"));
    }

    /// A doubt about the opening; the whole note comes back.
    fn opening(&mut self, line: usize, doubt: Option<String>) -> Option<String> {
        let doubt = doubt?;
        self.at(line, format!("{doubt}; opening = … in [[luminaire]] sets another"));
        self.0.last().cloned()
    }
}

/// Content of a regular file that isn't too long.
fn content(path: &Path) -> Result<Vec<u8>, InputError> {
    files::read(path, LARGEST_GLDF).map_err(|error| {
        let expected = "a photometric file: LM-63 (.ies), EULUMDAT (.ldt), TM-33 (.xml) or GLDF (.gldf)";
        let found = format!("no file that can be read ({})", files::why(&error));
        InputError::new(Location::file(path), found, expected)
    })
}

/// Intensities of a table, cd.
struct Values {
    /// Line of the first.
    line: usize,
    candela: Vec<f64>,
}

impl Values {
    /// Reads `count` numbers and multiplies them.
    fn read(
        path: &Path,
        words: &mut WordReader,
        count: usize,
        factor: f64,
        notes: &mut Notes,
    ) -> Result<Self, InputError> {
        let first = words.at();
        let number = |number| words.number(&format!("intensity {number} of {count}"));
        Self::of(path, first, (1..=count).map(number), factor, notes)
    }

    /// Multiplies numbers, each with its line. Small negative ones, noise of a measurement, become 0.
    fn of(
        path: &Path,
        first: usize,
        values: impl Iterator<Item = Result<(usize, f64), InputError>>,
        factor: f64,
        notes: &mut Notes,
    ) -> Result<Self, InputError> {
        let mut candela = Vec::with_capacity(values.size_hint().0);
        let (mut lowest, mut largest) = ((first, 0.0_f64), 0.0_f64);
        for item in values {
            let (line, value) = item?;
            let value = value * factor;
            if !(-BRIGHTEST..=BRIGHTEST).contains(&value) {
                let found = format!("an intensity of {value} cd");
                return Err(InputError::new(Location::line(path, line), found, format!("{BRIGHTEST} cd at most")));
            }
            if value < lowest.1 {
                lowest = (line, value);
            }
            largest = largest.max(value);
            candela.push(value.max(0.0));
        }
        let (line, low) = lowest;
        if low < -NOISE * largest {
            let found = format!("an intensity of {low} cd");
            return Err(InputError::new(Location::line(path, line), found, "0 or more"));
        }
        if low < 0.0 {
            notes.at(line, format!("negative intensities, down to {low} cd, taken for 0"));
        }
        if largest == 0.0 {
            return Err(InputError::new(Location::line(path, first), "intensities that are all 0", "some light"));
        }
        Ok(Self { line: first, candela })
    }
}

/// Tells where planes of type C disagree about the one direction they share.
fn check_nadir(table: &IntensityTable, line: usize, notes: &mut Notes) {
    let largest = table.candela.iter().fold(0.0_f64, |a, b| a.max(*b));
    if table.angles[0] == 0.0 {
        let values = table.candela.chunks(table.angles.len()).map(|plane| plane[0]);
        let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
        if high - low > 0.02 * largest {
            notes.at(line, format!("planes disagree about γ = 0°, which they share: {low} cd to {high} cd"));
        }
    }
}

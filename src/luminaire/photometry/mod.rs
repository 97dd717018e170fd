//! Photometric files: luminous intensity as laboratories publish it.
//!
//! [`Photometry::read`] takes LM-63 (`.ies`, editions 1986 to 2019) and EULUMDAT (`.ldt`) to the same terms: candelas
//! of the luminaire on C-planes all around, sizes in metres. What each format says about directions and sizes, and
//! where that is written, stands in `ies.rs`, `eulumdat.rs`, `opening.rs` and `table.rs`.

mod eulumdat;
mod ies;
mod opening;
mod table;
mod text;

use std::path::Path;

pub use opening::{LuminousOpening, Shape};

use self::table::Table;
use self::text::Words;
use super::intensity::Intensity;
use crate::error::{InputError, Location};
use crate::input;
use crate::scene::limits::LARGEST_PHOTOMETRY;

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
    /// The lamps; in EULUMDAT files with several sets each is an alternative, and the first is the one that counts.
    pub lamps: Vec<Lamps>,
    /// How directions were tabulated, before they became C-planes and γ.
    pub kind: Kind,
    /// Symmetry of the table, before it was unfolded.
    pub symmetry: Symmetry,
    /// C-planes (or horizontal angles) and γ (or vertical angles) in the file.
    pub tabulated: [usize; 2],
    /// Luminous intensity of the luminaire, cd: every factor of the file is in it, symmetries are unfolded.
    pub intensity: Intensity,
    /// Luminous flux that the file declares for the luminaire, lm. EULUMDAT: flux of the lamps × LORL. LM-63 declares
    /// none (its relative files tell the lamps' flux, see [`Lamps::flux`]).
    pub flux: Option<f64>,
    /// Share of the flux that goes down, 0 … 1, where the file declares it (EULUMDAT: DFF).
    pub downward: Option<f64>,
    /// Where light leaves.
    pub opening: LuminousOpening,
    /// What tilting the luminaire does to its light (LM-63); `intensity` is for 0°.
    pub tilt: Option<Tilt>,
    /// Electrical power, ballast included, W; `None` where the file says 0.
    pub power: Option<f64>,
    /// What is odd but accepted, each with its line: `line 14: …`.
    pub notes: Vec<String>,
}

impl Photometry {
    /// Reads a file, `.ies` (LM-63) or `.ldt` (EULUMDAT); content decides, the ending only where it can't.
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
        let text = text::decode(path, content)?;
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
        let ending = ending.as_deref();
        match (ies::is_ies(&text), eulumdat::is_eulumdat(&text)) {
            (true, _) => ies::parse(path, &text),
            (false, true) => eulumdat::parse(path, &text),
            (false, false) if ending == Some("ies") => ies::parse(path, &text),
            (false, false) if ending == Some("ldt") => eulumdat::parse(path, &text),
            (false, false) => {
                let found = "neither a line TILT= nor the numbers that begin a EULUMDAT file";
                Err(InputError::new(Location::file(path), found, "a photometric file, LM-63 (.ies) or EULUMDAT (.ldt)"))
            }
        }
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
pub enum Kind {
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

/// What tilting a luminaire does to the light of its lamps (LM-63, `TILT=`).
#[derive(Clone, Debug, PartialEq)]
pub struct Tilt {
    /// 1: lamps stand upright while the luminaire hangs as measured; 2: they lie, and stay level when it is tilted;
    /// 3: they lie, and are tilted with it.
    pub geometry: u8,
    /// Degrees, ascending.
    pub angles: Vec<f64>,
    /// What intensities are multiplied by at each angle.
    pub factors: Vec<f64>,
}

impl Tilt {
    /// Factor at a tilt in degrees, linear between the angles; the first or last one beyond.
    pub fn factor(&self, angle: f64) -> f64 {
        let after = self.angles.partition_point(|&other| other <= angle);
        if after == 0 || after == self.angles.len() {
            return self.factors[after.min(self.angles.len() - 1)];
        }
        let share = (angle - self.angles[after - 1]) / (self.angles[after] - self.angles[after - 1]);
        self.factors[after - 1] + (self.factors[after] - self.factors[after - 1]) * share
    }

    /// In words, as `lamps that lie and tilt with the luminaire, tilt factors 0.9 to 1`.
    fn describe(&self) -> String {
        let low = self.factors.iter().fold(f64::INFINITY, |low, factor| low.min(*factor));
        let high = self.factors.iter().fold(0.0_f64, |high, factor| high.max(*factor));
        let lamps = match self.geometry {
            1 => "lamps that stand upright",
            2 => "lamps that lie and stay level",
            _ => "lamps that lie and tilt with the luminaire",
        };
        format!("{lamps}, tilt factors {low} to {high}")
    }
}

/// What is odd but accepted.
#[derive(Default)]
struct Notes(Vec<String>);

impl Notes {
    /// A note about a line.
    fn at(&mut self, line: usize, sentence: String) {
        self.0.push(format!("line {line}: {sentence}"));
    }
}

/// Content of a regular file that isn't too long.
fn content(path: &Path) -> Result<Vec<u8>, InputError> {
    input::read(path, LARGEST_PHOTOMETRY).map_err(|error| {
        let expected = "a photometric file, LM-63 (.ies) or EULUMDAT (.ldt)";
        let found = format!("no file that can be read ({})", input::why(&error));
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
    /// Reads `count` numbers and multiplies them. Small negative ones, noise of a measurement, become 0.
    fn read(path: &Path, words: &mut Words, count: usize, factor: f64, notes: &mut Notes) -> Result<Self, InputError> {
        let first = words.at();
        let mut candela = Vec::with_capacity(count);
        let (mut lowest, mut largest) = ((first, 0.0_f64), 0.0_f64);
        for number in 1..=count {
            let (line, value) = words.number(&format!("intensity {number} of {count}"))?;
            let value = value * factor;
            if !(-BRIGHTEST..=BRIGHTEST).contains(&value) {
                let at = Location::line(path, line);
                return Err(InputError::new(
                    at,
                    format!("an intensity of {value} cd"),
                    format!("{BRIGHTEST} cd at most"),
                ));
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
fn check_nadir(table: &Table, line: usize, notes: &mut Notes) {
    let largest = table.candela.iter().fold(0.0_f64, |a, b| a.max(*b));
    if table.angles[0] == 0.0 {
        let values = table.candela.chunks(table.angles.len()).map(|plane| plane[0]);
        let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
        if high - low > 0.02 * largest {
            notes.at(line, format!("planes disagree about γ = 0°, which they share: {low} cd to {high} cd"));
        }
    }
}

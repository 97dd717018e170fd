//! Photometric files: luminous intensity as laboratories publish it.

use std::path::Path;

use super::intensity::Intensity;
use crate::error::InputError;

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
    /// Test report, laboratory, date, as far as the file tells: what it calls each, and the text.
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
    /// Luminous flux that the file declares for the luminaire, lm. EULUMDAT: flux of the lamps × LORL. LM-63 declares none
    /// (its relative files tell the lamps' flux, see [`Lamps::flux`]).
    pub flux: Option<f64>,
    /// Share of the flux that goes down, 0 … 1, where the file declares it (EULUMDAT: DFF).
    pub downward: Option<f64>,
    /// Where light leaves.
    pub opening: LuminousOpening,
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
        todo!("{path:?}")
    }

    /// The same from the content of a file; `path` names it in errors and tells where a tilt file is.
    ///
    /// # Errors
    /// See [`read`](Self::read).
    pub fn parse(path: &Path, content: &[u8]) -> Result<Self, InputError> {
        todo!("{path:?} {content:?}")
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
    /// Luminous flux of all of them, lm; `None` in absolute photometry of LM-63. In absolute photometry of EULUMDAT that of
    /// the luminaire.
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

/// Where light leaves: a body around the photometric centre. Sizes are whole lengths (diameters, not radii), m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LuminousOpening {
    /// Its form.
    pub shape: Shape,
    /// Size in the direction of C0–C180.
    pub c0: f64,
    /// Size in the direction of C90–C270.
    pub c90: f64,
    /// Size in the direction of the nadir; 0 for flat openings.
    pub height: f64,
    /// Heights of the luminous sides that C0, C90, C180 and C270 look at. EULUMDAT can tell four, in other files all are
    /// `height`.
    pub sides: [f64; 4],
}

/// Form of a luminous opening. One of the sizes of a rectangle or box may be 0 (a line), never all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// No extent, all sizes are 0.
    Point,
    /// Flat, faces the nadir.
    Rectangle,
    /// Flat, faces the nadir; a disc where both sizes are equal.
    Ellipse,
    /// A rectangle with luminous sides.
    Box,
    /// An ellipse with a luminous side; a cylinder where both sizes are equal.
    VerticalCylinder,
    /// A cylinder that lies along C0–C180; its section is an ellipse of `c90` and `height`.
    CylinderAlongC0,
    /// A cylinder that lies along C90–C270; its section is an ellipse of `c0` and `height`.
    CylinderAlongC90,
    /// A sphere where all sizes are equal.
    Ellipsoid,
    /// Flat and upright, faces C0; an ellipse of `c90` and `height`.
    UprightEllipse,
}

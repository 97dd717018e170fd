//! What a photometric file says, for a program.
//!
//! `luminaire.json` is one object, keys in a fixed order, each with its unit in its name: `luxmap`, `file`, `format`,
//! `name`, `catalogue`, `manufacturer`, `remarks`, `lamps` (`count`, `name`, `flux_lm`, `power_w`, `colour`,
//! `rendering`, `absolute`), `type`, `symmetry`, `planes`, `angles`, `opening` (`shape`, `c0_m`, `c90_m`, `height_m`,
//! `sides_m`), `flux_lm` (computed), `declared_flux_lm`, `declared_share_down`, `share_down`, `power_w`,
//! `efficacy_lm_per_w`, `max_cd`, `max_c_deg`, `max_gamma_deg`, `beam_deg` and `field_deg` (in C0/C180 and C90/C270:
//! from, to and the angle between), `notes`. What a file doesn't tell is null or empty.
//!
//! Of several files there is an array, in their order; one that can't be read is `{"file", "error"}` there.

use std::path::Path;

use serde::Serialize;

use super::figures::{Figures, Spread};
use super::text::{kind, shape, symmetry};
use crate::luminaire::photometry::{Lamps, LuminousOpening, Photometry};

#[derive(Serialize)]
struct LuminaireJson<'a> {
    luxmap: &'static str,
    file: String,
    format: &'static str,
    name: &'a str,
    catalogue: &'a str,
    manufacturer: &'a str,
    remarks: &'a [(String, String)],
    lamps: Vec<LampsOut<'a>>,
    r#type: &'static str,
    symmetry: &'static str,
    planes: usize,
    angles: usize,
    opening: OpeningOut,
    flux_lm: f64,
    declared_flux_lm: Option<f64>,
    declared_share_down: Option<f64>,
    share_down: f64,
    power_w: Option<f64>,
    efficacy_lm_per_w: Option<f64>,
    max_cd: f64,
    max_c_deg: f64,
    max_gamma_deg: f64,
    beam_deg: [[f64; 3]; 2],
    field_deg: [[f64; 3]; 2],
    notes: &'a [String],
}

#[derive(Serialize)]
struct LampsOut<'a> {
    count: u32,
    name: &'a str,
    flux_lm: Option<f64>,
    power_w: Option<f64>,
    colour: &'a str,
    rendering: &'a str,
    absolute: bool,
}

impl<'a> LampsOut<'a> {
    fn new(set: &'a Lamps) -> Self {
        let Lamps { count, name, flux, power, colour, rendering, absolute } = set;
        Self { count: *count, name, flux_lm: *flux, power_w: *power, colour, rendering, absolute: *absolute }
    }
}

#[derive(Serialize)]
struct OpeningOut {
    shape: &'static str,
    c0_m: f64,
    c90_m: f64,
    height_m: f64,
    sides_m: [f64; 4],
}

/// The same as JSON, indented, with a line end: what `luminaire.json` holds and `--json` prints.
pub fn json(path: &Path, photometry: &Photometry, figures: &Figures) -> String {
    let LuminousOpening { shape: form, c0, c90, height, sides } = photometry.opening;
    let spread = |spread: Spread| [spread.from, spread.to, spread.angle()];
    let [max_cd, max_c_deg, max_gamma_deg] = figures.largest;
    let summary = LuminaireJson {
        luxmap: env!("CARGO_PKG_VERSION"),
        file: path.display().to_string(),
        format: photometry.format.name(),
        name: &photometry.name,
        catalogue: &photometry.catalogue,
        manufacturer: &photometry.manufacturer,
        remarks: &photometry.remarks,
        lamps: photometry.lamps.iter().map(LampsOut::new).collect(),
        r#type: kind(photometry.kind),
        symmetry: symmetry(photometry.symmetry),
        planes: photometry.tabulated[0],
        angles: photometry.tabulated[1],
        opening: OpeningOut { shape: shape(form), c0_m: c0, c90_m: c90, height_m: height, sides_m: sides },
        flux_lm: figures.flux,
        declared_flux_lm: photometry.flux,
        declared_share_down: photometry.downward,
        share_down: figures.down,
        power_w: photometry.power,
        efficacy_lm_per_w: photometry.power.map(|power| figures.flux / power),
        max_cd,
        max_c_deg,
        max_gamma_deg,
        beam_deg: figures.beam.map(spread),
        field_deg: figures.field.map(spread),
        notes: &photometry.notes,
    };
    let mut text = serde_json::to_string_pretty(&summary).expect("numbers, texts and lists make JSON");
    text.push('\n');
    text
}

/// What is printed of a file that can't be read.
pub(super) fn error(path: &Path, error: &str) -> String {
    #[derive(Serialize)]
    struct Unread<'a> {
        file: String,
        error: &'a str,
    }
    let unread = Unread { file: path.display().to_string(), error };
    serde_json::to_string_pretty(&unread).expect("texts make JSON")
}

/// An array of such objects.
pub(super) fn array<'a>(objects: impl Iterator<Item = &'a str>) -> String {
    let indented = |object: &str| object.lines().map(|line| format!("  {line}")).collect::<Vec<_>>().join("\n");
    format!("[\n{}\n]\n", objects.map(indented).collect::<Vec<_>>().join(",\n"))
}

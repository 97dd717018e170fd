//! Many photometric files: a list as CSV, a contact sheet as a page that needs nothing else, a table for a terminal,
//! JSON.
//!
//! `luminaires.csv` is UTF-8 with a byte order mark, which spreadsheets want; a text that one would take for a formula
//! (it begins with `=`, `+`, `-`, `@`, a tab or a line break) has an apostrophe in front. A file that can't be read has
//! its name and `error` only.

use std::collections::HashSet;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use ::csv::WriterBuilder;
use maud::{Markup, html};

use super::figures::{Figures, Spread};
use super::page::title;
use super::text::{kind, opening, shape, symmetry, warnings};
use super::{json, write};
use crate::error::Error;
use crate::files;
use crate::files::write::{first_free, safe};
use crate::luminaire::photometry::Photometry;
use crate::report::html::{document, list, own};
use crate::report::png::{drawing, polar};
use crate::report::table::columns;
use crate::text::number::{round_to, short};

/// Columns of `luminaires.csv`. `flux_ratio` is computed over declared; `flux_lamps_lm` what bare lamps give, where a
/// file tells only that; beam (half of the largest intensity) and field (a tenth) are angles in C0/C180 and C90/C270;
/// `warnings` are separated by ` | `.
pub const COLUMNS: [&str; 28] = [
    "file",
    "folder",
    "format",
    "maker",
    "name",
    "catalogue",
    "flux_declared_lm",
    "flux_computed_lm",
    "flux_ratio",
    "flux_lamps_lm",
    "share_down",
    "max_cd",
    "max_c_deg",
    "max_gamma_deg",
    "beam_c0_deg",
    "beam_c90_deg",
    "field_c0_deg",
    "field_c90_deg",
    "opening",
    "opening_c0_m",
    "opening_c90_m",
    "opening_height_m",
    "type",
    "symmetry",
    "power_w",
    "efficacy_lm_per_w",
    "warnings",
    "error",
];

const CSV: &str = "luminaires.csv";
const PAGE: &str = "luminaires.html";

/// Looks and behaviour of the page.
const STYLE: &str = include_str!("sheet.css");
const SCRIPT: &str = include_str!("sheet.js");

/// Longest name of a file's folder, characters.
const LONGEST: usize = 120;

/// Names of folders for files, which are named by where they lie, with `/` between: `a/b.ies` gets `a_b.ies`. Outer
/// folders are left out where a name would be too long; where two would be the same in any case of letters, the second
/// gets `-2`.
pub fn folders(names: &[String]) -> Vec<String> {
    let mut taken: HashSet<String> = [CSV, PAGE].map(String::from).into();
    let folder = |name: &String| {
        let mut name = name.as_str();
        while let Some((_, inner)) = name.split_once('/').filter(|_| name.chars().count() > LONGEST) {
            name = inner;
        }
        first_free(&safe(name, LONGEST), &[""], &mut taken)
    };
    names.iter().map(folder).collect()
}

/// What became of one of many files, ready for every output.
pub struct Entry {
    file: String,
    folder: String,
    json: String,
    found: Result<ReadFile, String>,
}

/// What a file that could be read says. Its table of intensities is gone: thousands of files fit in memory.
struct ReadFile {
    /// Those of [`COLUMNS`] from the third to the last but one.
    cells: Vec<String>,
    card: Markup,
    flux: String,
    ratio: String,
    beam: String,
    warnings: usize,
}

impl Entry {
    /// What `read` brought of `file`; what there is to say of it goes into `folder`, a folder in `home`.
    ///
    /// # Errors
    /// [`Error::Write`] where the folder can't be written.
    pub fn new(file: &Path, read: Result<Photometry, String>, folder: String, home: &Path) -> Result<Self, Error> {
        let name = file.display().to_string();
        Ok(match read {
            Ok(photometry) => {
                let figures = Figures::new(&photometry.intensity);
                write(file, &photometry, &figures, &home.join(&folder))?;
                let found = ReadFile::new(file, &folder, &photometry, &figures);
                Self { file: name, json: json::json(file, &photometry, &figures), folder, found: Ok(found) }
            }
            Err(error) => {
                Self { file: name, json: json::error(file, &error), folder: String::new(), found: Err(error) }
            }
        })
    }

    /// Why it can't be read.
    pub fn error(&self) -> Option<&str> {
        self.found.as_ref().err().map(String::as_str)
    }

    /// Its line of the list.
    fn record(&self) -> Vec<String> {
        let mut record = vec![harmless(&self.file), harmless(&self.folder)];
        match &self.found {
            Ok(found) => record.extend(found.cells.iter().cloned().chain([String::new()])),
            Err(error) => {
                record.resize(COLUMNS.len() - 1, String::new());
                record.push(harmless(error));
            }
        }
        record
    }

    /// Its line on a terminal.
    fn line(&self) -> [String; 5] {
        let [flux, ratio, beam, warnings] = match &self.found {
            Ok(ReadFile { flux, ratio, beam, warnings, .. }) => {
                let warnings = if *warnings == 0 { String::new() } else { warnings.to_string() };
                [flux.clone(), ratio.clone(), beam.clone(), warnings]
            }
            Err(_) => ["", "", "", "not read"].map(String::from),
        };
        [self.file.clone(), flux, ratio, beam, warnings]
    }

    /// Its card of the contact sheet.
    fn card(&self) -> Markup {
        match &self.found {
            Ok(found) => found.card.clone(),
            Err(error) => html! {
                article class="card odd" { h2 { (self.file) } p class="error" { "Not read: " (error) } } "\n"
            },
        }
    }
}

impl ReadFile {
    fn new(file: &Path, folder: &str, photometry: &Photometry, figures: &Figures) -> Self {
        let warnings = warnings(photometry, figures);
        let ratio = photometry.flux.filter(|flux| *flux > 0.0).map(|flux| figures.flux / flux);
        Self {
            cells: cells(photometry, figures, ratio, &warnings),
            card: card(file, folder, photometry, figures, &warnings),
            flux: short(figures.flux),
            ratio: ratio.map_or_else(String::new, |ratio| short(round_to(ratio, 4))),
            beam: angles(photometry, &figures.beam),
            warnings: warnings.len(),
        }
    }
}

/// The cells of the list that a file fills.
fn cells(photometry: &Photometry, figures: &Figures, ratio: Option<f64>, warnings: &[String]) -> Vec<String> {
    let known = |value: Option<f64>| value.map_or_else(String::new, |value| round_to(value, 6).to_string());
    let number = |value: f64| known(Some(value));
    let opening = photometry.opening;
    let lamps = photometry.lamps.first().filter(|lamps| !lamps.absolute).and_then(|lamps| lamps.flux);
    let [cd, c, gamma] = figures.largest;
    let angles = |spreads: &[Spread; 2]| spreads.map(|spread| round_to(spread.angle(), 4).to_string());
    let [beam_c0, beam_c90] = angles(&figures.beam);
    let [field_c0, field_c90] = angles(&figures.field);
    vec![
        photometry.format.name().to_owned(),
        harmless(&photometry.manufacturer),
        harmless(&photometry.name),
        harmless(&photometry.catalogue),
        known(photometry.flux),
        number(figures.flux),
        known(ratio),
        known(lamps),
        number(figures.down),
        number(cd),
        number(c),
        number(gamma),
        beam_c0,
        beam_c90,
        field_c0,
        field_c90,
        shape(opening.shape).to_owned(),
        number(opening.c0),
        number(opening.c90),
        number(opening.height),
        kind(photometry.kind).to_owned(),
        symmetry(photometry.symmetry).to_owned(),
        known(photometry.power),
        known(photometry.power.map(|power| figures.flux / power)),
        harmless(&warnings.join(" | ")),
    ]
}

/// A text that no spreadsheet takes for a formula.
fn harmless(text: &str) -> String {
    if text.starts_with(['=', '+', '-', '@', '\t', '\r', '\n']) { format!("'{text}") } else { text.to_owned() }
}

/// `62°`, or `62° × 100°` in C0/C180 and C90/C270 where these differ.
fn angles(photometry: &Photometry, spreads: &[Spread; 2]) -> String {
    let [a, b] = spreads.map(|spread| short(spread.angle().round()));
    if photometry.tabulated[0] == 1 || a == b { format!("{a}°") } else { format!("{a}° × {b}°") }
}

fn card(file: &Path, folder: &str, photometry: &Photometry, figures: &Figures, warnings: &[String]) -> Markup {
    let name = title(file, photometry);
    let diagram = polar::small(photometry, figures, &format!("Polar diagram of {name}"));
    let flux = match photometry.flux.filter(|flux| *flux > 0.0) {
        Some(declared) => format!("{} lm, {} declared", short(figures.flux), short(declared)),
        None => format!("{} lm", short(figures.flux)),
    };
    let mut facts = vec![
        ("Flux", flux),
        ("Beam", angles(photometry, &figures.beam)),
        ("Largest", format!("{} cd", short(figures.largest[0]))),
        ("Opening", opening(&photometry.opening)),
    ];
    facts.extend(
        photometry.power.map(|power| ("Power", format!("{} W, {} lm/W", short(power), short(figures.flux / power)))),
    );
    let class = if warnings.is_empty() { "card" } else { "card odd" };
    let maker = [photometry.manufacturer.as_str(), photometry.format.name()];
    let maker = maker.into_iter().filter(|text| !text.is_empty()).collect::<Vec<_>>().join(" · ");
    html! {
        article class=(class) {
            h2 { a href={ (address(folder)) "/luminaire.html" } { (name) } }
            p { (maker) br; (file.display().to_string()) } "\n"
            (diagram)
            dl { @for (name, text) in &facts { dt { (name) } dd { (text) } } } "\n"
            @if !warnings.is_empty() {
                details {
                    summary { (warnings.len()) @if warnings.len() == 1 { " warning" } @else { " warnings" } }
                    (list(warnings))
                }
            }
        }
        "\n"
    }
}

/// A name as part of an address.
fn address(name: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.~".contains(&byte);
    name.bytes().map(|byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") }).collect()
}

/// All files of a list.
pub struct Sheet(pub Vec<Entry>);

impl Sheet {
    /// Writes `luminaires.csv` and `luminaires.html`; returns their paths.
    ///
    /// # Errors
    /// [`Error::Write`] where one can't be written.
    pub fn write(&self, folder: &Path) -> Result<Vec<PathBuf>, Error> {
        files::write_together(folder, &mut |folder| {
            let [csv, page] = [CSV, PAGE].map(|name| folder.join(name));
            files::write_whole(&csv, &mut |out| self.csv(out))?;
            files::write_whole(&page, &mut |out| out.write_all(self.page().as_bytes()))?;
            Ok(vec![csv, page])
        })
    }

    /// The list as CSV.
    ///
    /// # Errors
    /// Where `out` fails.
    pub fn csv(&self, out: &mut impl Write) -> io::Result<()> {
        out.write_all("\u{feff}".as_bytes())?;
        let mut table = WriterBuilder::new().from_writer(out);
        table.write_record(COLUMNS)?;
        for entry in &self.0 {
            table.write_record(entry.record())?;
        }
        table.flush()
    }

    /// An array of each file's object.
    pub fn json(&self) -> String {
        json::array(self.0.iter().map(|entry| entry.json.as_str()))
    }

    /// A table, and how many there are.
    pub fn text(&self) -> String {
        let head = ["file", "lm", "of declared", "beam", "warnings"];
        let mut lines = columns(head, self.0.iter().map(Entry::line));
        lines.extend([String::new(), self.in_short(), String::new()]);
        lines.join("\n")
    }

    /// `143 files, 12 with warnings, 2 not read`
    fn in_short(&self) -> String {
        let files = self.0.len();
        let warned = self.0.iter().filter(|entry| entry.found.as_ref().is_ok_and(|found| found.warnings > 0)).count();
        let unread = self.0.iter().filter(|entry| entry.found.is_err()).count();
        let part = |count: usize, what: &str| if count > 0 { format!(", {count} {what}") } else { String::new() };
        let noun = if files == 1 { "file" } else { "files" };
        format!("{files} {noun}{}{}", part(warned, "with warnings"), part(unread, "not read"))
    }

    /// The contact sheet.
    pub fn page(&self) -> String {
        let main = html! {
            header {
                h1 { "Luminaires" }
                p {
                    (self.in_short()) ". Diagrams: " span class="key first" { "C0/C180" } ", "
                    span class="key second" { "C90/C270" } ", each to its own largest intensity; the outer circle is \
                    that, the inner one half of it. C0 and C90 are to the right, the nadir is below. "
                    a href=(CSV) { (CSV) } " has all figures."
                }
            }
            div class="tools" hidden {
                label { "Filter " input type="search" id="filter"; } "\n"
                label { input type="checkbox" id="odd"; " only with warnings or not read" } "\n"
                output aria-live="polite" {}
            }
            "\n"
            div class="cards" { "\n" @for entry in &self.0 { (entry.card()) } }
            script { "\n" (own(SCRIPT)) }
        };
        document("Luminaires", &[drawing::STYLE, STYLE], &main)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_gets_a_folder_of_its_own() {
        let names = ["a.ies", "a.ldt", "A.IES", "x/a.ies", "x_a.ies", "luminaires.csv", "../b.ies"].map(String::from);
        let expected = ["a.ies", "a.ldt", "A.IES-2", "x_a.ies", "x_a.ies-2", "luminaires.csv-2", "_b.ies"];
        assert_eq!(folders(&names), expected);
        let long = [format!("{}/{}/b.ies", "x".repeat(80), "y".repeat(80))];
        assert_eq!(folders(&long), [format!("{}_b.ies", "y".repeat(80))]);
    }

    #[test]
    fn no_text_is_a_formula() {
        for text in ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1"] {
            assert_eq!(harmless(text), format!("'{text}"));
        }
        assert_eq!(harmless("Büro, 1-flammig"), "Büro, 1-flammig");
    }

    #[test]
    fn addresses_lead_to_the_folder_that_is_named() {
        assert_eq!(address("a b#1?100%ü.ies"), "a%20b%231%3F100%25%C3%BC.ies");
    }
}

//! What photometric files say: one for a person and for a program with its polar diagram, many as a list and a contact
//! sheet.
//!
//! [`write()`] makes a file's folder: `luminaire.html`, `polar.svg`, `polar.png` and `luminaire.json` (keys:
//! `json.rs`). [`Entry`] makes that for each of many files, and beside these folders `luminaires.csv` (columns:
//! [`COLUMNS`]) and `luminaires.html`.

mod figures;
mod json;
mod page;
mod sheet;
mod text;

use std::io::Write as _;
use std::path::{Path, PathBuf};

pub use figures::{Figures, Spread};
pub use json::json;
pub use sheet::{COLUMNS, Entry, Sheet, folders};
pub use text::text;

use super::{make_folder, png};
use crate::error::Error;
use crate::files;
use crate::luminaire::photometry::Photometry;

/// Writes `luminaire.html`, `polar.svg`, `polar.png` and `luminaire.json` into a folder, making it where it's missing;
/// returns their paths. Each is whole or not there, and on an error those of an earlier run stay.
///
/// # Errors
/// [`Error::Write`] where the folder or a file can't be written.
pub fn write(path: &Path, photometry: &Photometry, figures: &Figures, folder: &Path) -> Result<Vec<PathBuf>, Error> {
    make_folder(folder)?;
    let polar = png::polar::diagram(photometry, figures, true).above(png::orientation::drawing(photometry));
    let picture = polar.png().map_err(|source| Error::Write { path: folder.join("polar.png"), source })?;
    let (page, svg, json) = (page::page(path, photometry, figures), polar.svg(), json(path, photometry, figures));
    let files: [(&str, &[u8]); 4] = [
        ("luminaire.html", page.as_bytes()),
        ("polar.svg", svg.as_bytes()),
        ("polar.png", &picture),
        ("luminaire.json", json.as_bytes()),
    ];
    files::write_together(folder, &mut |folder| {
        let save = |(name, content): &(&str, &[u8])| {
            let path = folder.join(name);
            files::write_whole(&path, &mut |out| out.write_all(content))?;
            Ok(path)
        };
        files.iter().map(save).collect()
    })
}

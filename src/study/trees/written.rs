//! The files that `luxmap trees` leaves behind.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use super::Comparison;
use super::page::page;
use super::report::{write_csv, write_figures};
use crate::error::Error;
use crate::files;
use crate::report::make_folder;

/// Writes `trees.csv`, `trees.html` and, where the paper's figures were repeated, `paper.csv` into `folder`, making it
/// where it's missing; each under a temporary name, then renamed. Returns their paths.
///
/// # Errors
/// [`Error::Write`] where the folder or a file can't be written.
pub fn write(comparison: &Comparison, folder: &Path) -> Result<Vec<PathBuf>, Error> {
    make_folder(folder)?;
    let mut written = vec![folder.join("trees.csv"), folder.join("trees.html")];
    files::write_whole(&written[0], &mut |out| write_csv(&comparison.cases, out))?;
    files::write_whole(&written[1], &mut |out| out.write_all(page(comparison).as_bytes()))?;
    if !comparison.figures.is_empty() {
        let path = folder.join("paper.csv");
        files::write_whole(&path, &mut |out| write_figures(&comparison.figures, out))?;
        written.push(path);
    }
    Ok(written)
}

//! The files that `luxmap converge` leaves behind.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use super::Study;
use super::page::page;
use super::report::write_csv;
use crate::error::Error;
use crate::files;
use crate::report::make_folder;

/// Writes `convergence.csv` and `report.html` into `folder`, making it where it's missing; each under a temporary name,
/// then renamed. Returns their paths.
///
/// # Errors
/// [`Error::Write`] where the folder or a file can't be written, and where a figure isn't finite.
pub fn write(study: &Study, folder: &Path) -> Result<Vec<PathBuf>, Error> {
    make_folder(folder)?;
    let paths = ["convergence.csv", "report.html"].map(|name| folder.join(name));
    files::write_whole(&paths[0], &mut |out| write_csv(study, out))?;
    files::write_whole(&paths[1], &mut |out| out.write_all(page(study).as_bytes()))?;
    Ok(paths.into())
}

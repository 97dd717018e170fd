//! `luxmap luminaire`: what a photometric file says.

use std::path::{Path, PathBuf};

use super::render::stem;
use super::{Outcome, print};
use crate::error::Error;
use crate::luminaire::photometry::Photometry;
use crate::report::luminaire::{self, Figures};

/// Read a photometric file (.ies, .ldt): flux, intensities, opening; writes polar.svg, polar.png and luminaire.json.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Photometric file: LM-63 (.ies, editions 1986 to 2019) or EULUMDAT (.ldt).
    file: PathBuf,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR", help = "Folder for the results [default: out/<file>]")]
    output: Option<PathBuf>,
    /// Print JSON instead of text.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let file = &arguments.file;
    let photometry = Photometry::read(file)?;
    let figures = Figures::new(&photometry.intensity);
    let folder = arguments.output.clone().unwrap_or_else(|| Path::new("out").join(stem(file)));
    let written = luminaire::write(file, &photometry, &figures, &folder)?;
    if arguments.json {
        print(&luminaire::json(file, &photometry, &figures))?;
    } else {
        print(&luminaire::text(file, &photometry, &figures))?;
        print(&format!("wrote {} files to {}\n", written.len(), folder.display()))?;
    }
    Ok(Outcome::Done)
}

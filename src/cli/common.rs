//! What commands that run a scene have in common.

use std::path::{Path, PathBuf};

use super::options::{RunOptions, Taker, flagged};
use super::progress::TerminalBar;
use super::{Include, Outcome, complain, print, results_folder};
use crate::error::Error;
use crate::job::Job;
use crate::report::{self, ExtraLayers};
use crate::results::Results;
use crate::scene::Dimming;

/// A scene, how it is computed, and how results are printed.
#[derive(clap::Args)]
#[group(skip)]
pub(super) struct Common<T: Taker> {
    /// Scene file (TOML); meshes are looked up beside it.
    pub(super) scene: PathBuf,
    #[command(flatten)]
    pub(super) include: Include,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR", help = "Folder for the results [default: out/<scene>]")]
    output: Option<PathBuf>,
    #[command(flatten)]
    options: RunOptions<T>,
    /// Only this measuring plane or surface, and no camera but those of --camera; repeatable.
    #[arg(long = "plane", value_name = "NAME")]
    planes: Vec<String>,
    /// Only this camera, and no measuring plane but those of --plane; repeatable.
    #[arg(long = "camera", value_name = "NAME")]
    cameras: Vec<String>,
    /// Further EXR layers.
    #[arg(long, value_name = "LAYER", value_delimiter = ',', value_parser = ["direct", "indirect", "stderr"])]
    layers: Vec<String>,
    /// Print the summary as JSON instead of the table.
    #[arg(long)]
    pub(super) json: bool,
    /// No progress on stderr.
    #[arg(long, short)]
    pub(super) quiet: bool,
}

impl<T: Taker> Common<T> {
    /// The job, of a scene whose luminaires are at these levels.
    pub(super) fn job<'a>(&self, dimming: Dimming, bar: &'a TerminalBar) -> Result<Job<'a>, Error> {
        let job = self.include.job(&self.scene, dimming)?.only(&self.planes, &self.cameras)?;
        Ok(job.options(self.options.given().clone()).progress(bar))
    }

    /// Where results go: as asked, else `out/<scene>` with an `ending`.
    pub(super) fn folder(&self, ending: &str) -> PathBuf {
        results_folder(self.output.as_ref(), &self.scene, ending)
    }

    /// Layers that were asked for.
    pub(super) fn layers(&self) -> ExtraLayers {
        layers(&self.layers)
    }
}

/// Layers by name.
pub(super) fn layers(names: &[String]) -> ExtraLayers {
    let asked = |name: &str| names.iter().any(|layer| layer == name);
    ExtraLayers { direct: asked("direct"), indirect: asked("indirect"), standard_error: asked("stderr") }
}

/// Names options in a run's warnings as they stand on the command line.
pub(super) fn flag(results: &mut Results) {
    results.run.warnings.iter_mut().for_each(|warning| *warning = flagged(warning));
}

/// Writes what was found and says so; `check` makes a missed target count.
pub(super) fn write(
    mut results: Results,
    folder: &Path,
    layers: &ExtraLayers,
    json: bool,
    check: bool,
) -> Result<Outcome, Error> {
    flag(&mut results);
    let written = report::write(&results, folder, layers)?;
    if json {
        print(&report::json::summary(&results))?;
    } else {
        print(&report::table::table(&results))?;
        print(&format!("wrote {} files to {}\n", written.len(), folder.display()))?;
    }
    results.run.warnings.iter().for_each(|warning| complain(&format!("warning: {warning}")));
    Ok(match Outcome::of_interruption() {
        Outcome::Done if check && results.misses_target() => Outcome::Missed,
        outcome => outcome,
    })
}

//! `luxmap merge`: what several runs found, put together.

use std::path::PathBuf;

use super::common::{layers, write};
use super::options::{RunOptions, Taker};
use super::progress::TerminalBar;
use super::{Include, Outcome, results_folder};
use crate::error::{Error, InputError, Location};
use crate::files::Claim;
use crate::job::Job;
use crate::options::Command;
use crate::scene::Dimming;
use crate::state::file::Kept;

/// Put together what runs of one scene with other passes or seeds have found, as if one run had done all passes.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// States that `render --checkpoint` has kept, of the same scene and settings.
    #[arg(required = true, value_name = "STATE")]
    states: Vec<PathBuf>,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR", help = "Folder for the results [default: out/<scene>-merged]")]
    output: Option<PathBuf>,
    /// Scene file [default: where it was when the first state was kept].
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    include: Include,
    /// Keep the sum of the states in this file, to be merged further.
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
    #[command(flatten)]
    options: RunOptions<MergeTaker>,
    /// Further EXR layers.
    #[arg(long, value_name = "LAYER", value_delimiter = ',', value_parser = ["direct", "indirect", "stderr"])]
    layers: Vec<String>,
    /// Exit with code 1 unless every sensor meets its target, and every area what is required of it, with 95 %
    /// confidence.
    #[arg(long)]
    check: bool,
    /// Print the summary as JSON instead of the table.
    #[arg(long)]
    json: bool,
    /// No progress on stderr.
    #[arg(long, short)]
    quiet: bool,
}

/// Takes the options of `luxmap merge`.
struct MergeTaker;

impl Taker for MergeTaker {
    const COMMAND: Command = Command::Merge;
}

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let first = &arguments.states[0];
    let words = Kept::open(first)?.words;
    let scene = arguments.scene.as_ref().unwrap_or(&words.scene);
    if !scene.is_file() {
        let error =
            InputError::new(Location::file(first), format!("a state of {}", scene.display()), "that scene file");
        return Err(error.hint("--scene says where it is now").into());
    }
    let seed = words.passes.ranges().first().map_or(0, |range| range.seed);
    let bar = TerminalBar::new(arguments.quiet);
    let options = arguments.include.options(Dimming::AsWritten)?;
    let planned = Job::of_recipe(scene, options, &words.recipe, seed, &bar)?;
    let planned = planned.with_threads(arguments.options.given().threads);
    let folder = results_folder(arguments.output.as_ref(), scene, "-merged");
    let _claim = Claim::of(&folder)?;
    let results = planned.merged(&arguments.states, arguments.state.as_deref())?;
    bar.clear();
    let Some(results) = results else { return Ok(Outcome::Done) };
    write(results, &folder, &layers(&arguments.layers), arguments.json, arguments.check)
}

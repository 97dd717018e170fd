//! `luxmap merge`: what several runs found, put together.

use std::path::PathBuf;

use super::render::{Job, layers, write};
use super::{Include, Outcome, results_folder};
use crate::error::{Error, InputError, Location};
use crate::files::Claim;
use crate::render::Keeping;
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
    /// Threads [default: all].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Further EXR layers.
    #[arg(long, value_name = "LAYER", value_delimiter = ',', value_parser = ["direct", "indirect", "stderr"])]
    layers: Vec<String>,
    /// Exit with code 1 unless every sensor meets its target, and every area what is required of it, with 95 % confidence.
    #[arg(long)]
    check: bool,
    /// Print the summary as JSON instead of the table.
    #[arg(long)]
    json: bool,
    /// No progress on stderr.
    #[arg(long, short)]
    quiet: bool,
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
    let job = Job::of_recipe(scene, &arguments.include, &words.recipe, seed)?;
    let folder = results_folder(arguments.output.as_ref(), scene, "-merged");
    let _claim = Claim::of(&folder)?;
    let keeping = Keeping { checkpoint: arguments.state.as_deref(), states: &arguments.states, ..Default::default() };
    let Some(results) = job.run(arguments.threads, arguments.quiet, &keeping)? else { return Ok(Outcome::Done) };
    write(&results, &folder, &layers(&arguments.layers), arguments.json, arguments.check)
}

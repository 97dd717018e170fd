//! `luxmap render`: the main job.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::{Args as _, FromArgMatches as _};

use super::Outcome;
use super::common::{Common, flag, write};
#[cfg(feature = "mpi")]
use super::complain;
use super::options::Taker;
#[cfg(feature = "mpi")]
use super::options::said;
use super::progress::TerminalBar;
use super::signals::end_after_pass;
use crate::dimming::sure::Known;
use crate::dimming::{Influence, page};
use crate::error::Error;
use crate::files::Claim;
use crate::job::{Job, Planned};
use crate::options::Command;
#[cfg(not(feature = "mpi"))]
use crate::render::launched;
#[cfg(feature = "mpi")]
use crate::render::mpi::World;
use crate::render::{Alone, Team};
use crate::results::met::{CONFIDENCE, sigmas};
use crate::scene::{Dimming, Levels};

/// Compute the illuminance of every measuring plane, sensor and camera image, and write it as EXR, PNG, CSV, JSON and
/// HTML.
#[derive(clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    pub(super) common: Common<RenderTaker>,
    /// Keep the state after each pass in this file, and go on from it if it is there.
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// Dim luminaires as this file says, which luxmap dim and the live page write: {"dimming": {"L[1,1]": 0.42}}.
    #[arg(long, value_name = "FILE", help = "Dim luminaires as this file of luxmap dim or the live page says")]
    dimming: Option<PathBuf>,
    /// Write live.html too: a page in which each luminaire is dimmed and the maps follow.
    #[arg(long)]
    live: bool,
    /// Exit with code 1 unless every sensor meets its target, and every area what is required of it, with 95 %
    /// confidence.
    #[arg(long)]
    pub(super) check: bool,
}

/// Takes the options of `luxmap render`.
pub(super) struct RenderTaker;

impl Taker for RenderTaker {
    const COMMAND: Command = Command::Render;
}

impl Arguments {
    /// What is asked for.
    pub(super) fn job<'a>(&self, bar: &'a TerminalBar) -> Result<Job<'a>, Error> {
        let dimming = match &self.dimming {
            Some(path) => Dimming::Levels(Levels::read(path)?),
            None => Dimming::AsWritten,
        };
        let job = self.common.job(dimming, bar)?;
        Ok(match &self.checkpoint {
            Some(path) => job.checkpoint(path),
            None => job,
        })
    }
}

/// The parser of these arguments, by itself.
pub(super) fn command() -> clap::Command {
    Arguments::augment_args(clap::Command::new("render")).args_override_self(true)
}

/// Arguments made of options and a scene; where an option is given twice, the last wins.
pub(super) fn parse(options: &[String], scene: &Path) -> Result<Arguments, clap::Error> {
    let words = std::iter::once("render".into()).chain(options.iter().map(OsString::from));
    let words = words.chain(["--".into(), scene.into()]);
    Arguments::from_arg_matches(&command().try_get_matches_from(words)?)
}

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    #[cfg(feature = "mpi")]
    if let Some(world) = World::join()? {
        return run_in(world, arguments);
    }
    #[cfg(not(feature = "mpi"))]
    if launched() > 1 {
        let found = launched();
        return Err(Error::Usage(format!("found {found} MPI processes, expected a luxmap built with --features mpi")));
    }
    end_after_pass();
    let bar = TerminalBar::new(arguments.common.quiet);
    if arguments.live {
        return live(arguments, &bar);
    }
    finish(arguments, &prepare(arguments, &bar, true)?, &bar, &Alone)
}

/// The same, as one of several processes. An error that all have is printed once.
#[cfg(feature = "mpi")]
fn run_in(world: World, arguments: &Arguments) -> Result<Outcome, Error> {
    let bar = TerminalBar::new(arguments.common.quiet || world.rank() > 0);
    let prepared = prepare(arguments, &bar, world.rank() == 0);
    // A launcher ends all processes as soon as one has failed: what there is to say comes before any leaves.
    match (world.first_failure(prepared.is_err()), prepared) {
        (None, Ok(prepared)) => {
            let outcome = finish(arguments, &prepared, &bar, &world);
            match &outcome {
                Ok(_) => world.leave(),
                Err(error) => complain(&format!("luxmap: process {}: {}", world.rank(), said(error))),
            }
            outcome
        }
        (first, prepared) => {
            if let (true, Err(error)) = (first == Some(world.rank()), prepared) {
                complain(&format!("luxmap: {}", said(&error)));
            }
            world.leave();
            Ok(Outcome::Failed)
        }
    }
}

/// What to do, and the folder for what is found.
struct Prepared<'a> {
    planned: Planned<'a>,
    folder: PathBuf,
    _claim: Option<Claim>,
}

/// Reads the scene and makes the folder, so that what is wrong comes first. The leader of several processes has the
/// folder.
fn prepare<'a>(arguments: &Arguments, bar: &'a TerminalBar, leads: bool) -> Result<Prepared<'a>, Error> {
    let planned = arguments.job(bar)?.planned()?;
    let folder = arguments.common.folder("");
    let claim = leads.then(|| Claim::of(&folder)).transpose()?;
    Ok(Prepared { planned, folder, _claim: claim })
}

/// Computes, writes and tells.
fn finish(
    arguments: &Arguments,
    prepared: &Prepared<'_>,
    bar: &TerminalBar,
    team: &dyn Team,
) -> Result<Outcome, Error> {
    let results = prepared.planned.shared(team)?;
    bar.clear();
    let Some(results) = results else { return Ok(Outcome::Done) };
    let common = &arguments.common;
    write(results, &prepared.folder, &common.layers(), common.json, arguments.check)
}

/// Renders with every luminaire as a light group of its own, and writes the page beside what is asked for.
fn live(arguments: &Arguments, bar: &TerminalBar) -> Result<Outcome, Error> {
    let common = &arguments.common;
    let job = arguments.job(bar)?;
    let groups_asked = job.asks_for_groups();
    let (job, groups) = job.in_groups_of_one();
    let planned = job.planned()?;
    let folder = common.folder("");
    let _claim = Claim::of(&folder)?;
    let mut results = planned.alone()?;
    bar.clear();
    flag(&mut results);
    let matrix = Influence::of(&planned.scene, groups, &results);
    let sigmas = sigmas(CONFIDENCE, matrix.sensors.len());
    page::write(&planned.scene, &Known::new(&matrix), sigmas, &results, None, &folder.join("live.html"))?;
    if !groups_asked {
        results.run.groups.clear();
        results.maps.iter_mut().for_each(|map| map.groups.clear());
        results.sensors.iter_mut().for_each(|sensor| sensor.groups.clear());
    }
    write(results, &folder, &common.layers(), common.json, arguments.check)
}

pub(super) fn stem(scene: &Path) -> PathBuf {
    scene.file_stem().map_or_else(|| PathBuf::from("scene"), PathBuf::from)
}

//! `luxmap render`: the main job.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::builder::PossibleValuesParser;
use clap::{Args as _, FromArgMatches as _};

use super::progress::Bar;
use super::signals::{end_after_pass, interrupted};
use super::{Include, Outcome, complain, pool, print, results_folder};
use crate::dimming::met::{CONFIDENCE, sigmas};
use crate::dimming::sure::Known;
use crate::dimming::{Influence, Levels, influence, page};
use crate::error::Error;
#[cfg(not(feature = "mpi"))]
use crate::render::launched;
#[cfg(feature = "mpi")]
use crate::render::mpi::World;
use crate::render::{Alone, IMAGE_ERROR, Keeping, MOST_CELLS, Settings, Team, Tree, memory, recipe, render_in_bands};
use crate::report::{self, Claim, ExtraLayers, Results};
use crate::scene::plan::{Method, Plan};
use crate::scene::{Dimming, Scene};
use crate::state::file::Recipe;

/// Passes that a matrix of influence takes at least, where no number is given: its standard errors decide on levels.
const LEAST_PASSES: u32 = 4;

/// Compute the illuminance of every measuring plane, sensor and camera image, and write it as EXR, PNG, CSV, JSON and HTML.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Scene file (TOML); meshes are looked up beside it.
    pub(super) scene: PathBuf,
    #[command(flatten)]
    include: Include,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR", help = "Folder for the results [default: out/<scene>]")]
    pub(super) output: Option<PathBuf>,
    /// gather: direct light by shadow rays, what has bounced by rays to surfaces whose light the photons know; split: the
    /// same, what has bounced by the photons' density; path: no photons, paths from the points; photons: all by photons;
    /// seed: the paper's estimator, biases and all [default: gather].
    #[arg(long, value_name = "METHOD", value_parser = method_parser(), hide_possible_values = true)]
    method: Option<String>,
    /// Photons a pass [default: gather 200000, with mirrors or glass 1000000; split and photons 1000000; seed 30000].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1 << 40))]
    photons: Option<u64>,
    /// k, nearest photons of an estimate; more is smoother and less sharp [default: grows with the photons; seed: 100].
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(2..))]
    nearest: Option<u32>,
    /// Largest search radius, m [default: a tenth of the scene's diagonal].
    #[arg(long, value_name = "M", value_parser = positive, allow_negative_numbers = true)]
    radius: Option<f64>,
    /// Rays from each grid point a pass; methods gather and path; a camera's pixel sends four times as many [default: 8].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    rays: Option<u32>,
    /// Whether neighbouring grid points help each other to what rays found, on or off; off, path has no bias at all
    /// [default: on for gather, off for path].
    #[arg(long, value_name = "ON", value_parser = ["on", "off"], hide_possible_values = true)]
    smooth: Option<String>,
    /// Stop when the standard error of every map is at most this, % of its mean, or that of every image where there are
    /// only cameras [default: 1, images 5, unless --passes or --time is given; seed: one pass].
    #[arg(long, value_name = "PCT", value_parser = percent, allow_negative_numbers = true)]
    error: Option<f64>,
    /// Stop before this time is over, s (the first pass is always done).
    #[arg(long, value_name = "SECONDS", value_parser = seconds, allow_negative_numbers = true)]
    time: Option<f64>,
    /// Stop after so many passes: independent photons and rays.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    passes: Option<u32>,
    /// Number of the first pass: runs of other passes of the same seed, or of other seeds, can be merged.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 0,
        hide_default_value = true,
        help = "Number of the first pass, so that runs \
          of different passes can be merged [default: 0]"
    )]
    first_pass: u32,
    /// Keep the state after each pass in this file, and go on from it if it is there.
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// Tree of the photon map: kd (luxmap's own), kiddo, paper (the paper's own) or brute (none) [default: kd].
    #[arg(long, value_name = "TREE", value_parser = PossibleValuesParser::new(Tree::ALL.map(|(name, _)| name)),
          hide_possible_values = true)]
    tree: Option<String>,
    /// Same seed, same bits, whatever the number of threads [default: 0].
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Threads [default: all].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,
    /// Take no more memory than this: large planes are computed in bands, and with methods that store photons a pass has
    /// fewer [default: planes of more than 4 million cells in bands].
    #[arg(long, value_name = "GB", value_parser = gigabytes, allow_negative_numbers = true)]
    memory: Option<f64>,
    /// Only this measuring plane or surface, and no camera but those of --camera; repeatable.
    #[arg(long = "plane", value_name = "NAME")]
    planes: Vec<String>,
    /// Only this camera, and no measuring plane but those of --plane; repeatable.
    #[arg(long = "camera", value_name = "NAME")]
    cameras: Vec<String>,
    /// Further EXR layers.
    #[arg(long, value_name = "LAYER", value_delimiter = ',', value_parser = ["direct", "indirect", "stderr"])]
    pub(super) layers: Vec<String>,
    /// Dim luminaires as this file says, which luxmap dim and the live page write: {"dimming": {"L[1,1]": 0.42}}.
    #[arg(long, value_name = "FILE", help = "Dim luminaires as this file of luxmap dim or the live page says")]
    pub(super) dimming: Option<PathBuf>,
    /// Write live.html too: a page in which each luminaire is dimmed and the maps follow.
    #[arg(long)]
    live: bool,
    /// Tell light groups apart: a layer group.NAME in the EXR files for each, groups.csv for sensors.
    #[arg(long)]
    groups: bool,
    /// Exit with code 1 unless every sensor meets its target, and every area what is required of it, with 95 % confidence.
    #[arg(long)]
    pub(super) check: bool,
    /// Print the summary as JSON instead of the table.
    #[arg(long)]
    pub(super) json: bool,
    /// No progress on stderr.
    #[arg(long, short)]
    pub(super) quiet: bool,
}

impl Arguments {
    /// The levels asked for.
    fn dimming(&self) -> Result<Dimming, Error> {
        Ok(match &self.dimming {
            Some(path) => Dimming::Levels(Levels::read(path)?),
            None => Dimming::AsWritten,
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

pub(super) fn method_parser() -> PossibleValuesParser {
    PossibleValuesParser::new(Method::ALL.map(|(name, _)| name))
}

pub(super) fn positive(text: &str) -> Result<f64, String> {
    more_than_nothing(text, "metres", "m")
}

pub(super) fn gigabytes(text: &str) -> Result<f64, String> {
    more_than_nothing(text, "gigabytes", "GB")
}

fn percent(text: &str) -> Result<f64, String> {
    more_than_nothing(text, "percent", "%")
}

fn seconds(text: &str) -> Result<f64, String> {
    more_than_nothing(text, "seconds", "s")
}

fn more_than_nothing(text: &str, units: &str, unit: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| format!("expected a number of {units}"))?;
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(format!("expected more than 0 {unit}")) }
}

/// The value named, of a list whose names clap or the scene reader has checked.
pub(super) fn named<T: Copy, const N: usize>(name: &str, all: [(&'static str, T); N]) -> Option<T> {
    all.into_iter().find(|(known, _)| *known == name).map(|(_, value)| value)
}

/// The method asked for on the command line, else by the scene file, else `gather`.
pub(super) fn parse_method(given: Option<&String>, scene: &Scene) -> Method {
    given.or(scene.render.method.as_ref()).and_then(|name| named(name, Method::ALL)).unwrap_or(Method::Gather)
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
    if arguments.live {
        return live(arguments);
    }
    finish(arguments, prepare(arguments, true)?, &Alone)
}

/// The same, as one of several processes. What ails all is said once.
#[cfg(feature = "mpi")]
fn run_in(world: World, arguments: &Arguments) -> Result<Outcome, Error> {
    let prepared = prepare(arguments, world.rank() == 0);
    // A launcher ends all processes as soon as one has failed: what there is to say comes before any leaves.
    match (world.first_failure(prepared.is_err()), prepared) {
        (None, Ok(job)) => {
            let outcome = finish(arguments, job, &world);
            match &outcome {
                Ok(_) => world.leave(),
                Err(error) => complain(&format!("luxmap: process {}: {error}", world.rank())),
            }
            outcome
        }
        (first, prepared) => {
            if let (true, Err(error)) = (first == Some(world.rank()), prepared) {
                complain(&format!("luxmap: {error}"));
            }
            world.leave();
            Ok(Outcome::Failed)
        }
    }
}

/// Reads the scene and makes the folder, so that what is wrong comes first. The leader of several processes has the folder.
fn prepare(arguments: &Arguments, leads: bool) -> Result<Prepared, Error> {
    let job = Job::of(arguments)?;
    let folder = results_folder(arguments.output.as_ref(), &arguments.scene, "");
    let claim = leads.then(|| Claim::of(&folder)).transpose()?;
    Ok(Prepared { job, folder, _claim: claim })
}

/// Renders with every luminaire told apart, and writes the page beside what is asked for.
fn live(arguments: &Arguments) -> Result<Outcome, Error> {
    let (mut scene, load_seconds) = load(&arguments.scene, &arguments.include, &arguments.dimming()?)?;
    let groups_asked = arguments.groups || scene.render.groups == Some(true);
    let groups = influence::tell_apart(&mut scene);
    scene.render.groups = Some(true);
    let job = Job::of_scene(arguments, scene, load_seconds)?;
    let folder = results_folder(arguments.output.as_ref(), &arguments.scene, "");
    let _claim = Claim::of(&folder)?;
    let keeping = Keeping { checkpoint: arguments.checkpoint.as_deref(), ..Default::default() };
    let mut results = job.run(arguments.threads, arguments.quiet, &keeping)?.expect("who is alone leads");
    let matrix = Influence::of(&job.scene, groups, &results);
    let sigmas = sigmas(CONFIDENCE, matrix.sensors.len());
    page::write(&job.scene, &Known::new(&matrix), sigmas, &results, None, &folder.join("live.html"))?;
    if !groups_asked {
        results.run.groups.clear();
        results.maps.iter_mut().for_each(|map| map.groups.clear());
        results.sensors.iter_mut().for_each(|sensor| sensor.groups.clear());
    }
    write(&results, &folder, &layers(&arguments.layers), arguments.json, arguments.check)
}

/// What to do, and the folder for what is found.
struct Prepared {
    job: Job,
    folder: PathBuf,
    _claim: Option<Claim>,
}

/// Computes, writes and tells.
fn finish(arguments: &Arguments, prepared: Prepared, team: &dyn Team) -> Result<Outcome, Error> {
    let Prepared { job, folder, .. } = &prepared;
    let keeping = Keeping { checkpoint: arguments.checkpoint.as_deref(), team, ..Default::default() };
    let quiet = arguments.quiet || team.rank() > 0;
    let Some(results) = job.run(arguments.threads, quiet, &keeping)? else { return Ok(Outcome::Done) };
    write(&results, folder, &layers(&arguments.layers), arguments.json, arguments.check)
}

/// Writes what was found and says so; `check` makes a missed target count.
pub(super) fn write(
    results: &Results,
    folder: &Path,
    layers: &ExtraLayers,
    json: bool,
    check: bool,
) -> Result<Outcome, Error> {
    let written = report::write(results, folder, layers)?;
    if json {
        print(&report::json::summary(results))?;
    } else {
        print(&report::table::table(results))?;
        print(&format!("wrote {} files to {}\n", written.len(), folder.display()))?;
    }
    results.run.warnings.iter().for_each(|warning| complain(&format!("warning: {warning}")));
    Ok(match Outcome::of_interruption() {
        Outcome::Done if check && results.misses_target() => Outcome::Missed,
        outcome => outcome,
    })
}

/// A scene that is read, and how it is to be computed.
pub(super) struct Job {
    scene: Scene,
    plan: Plan,
    settings: Settings,
    load_seconds: f64,
    /// Cells of a plane that are worked on at once.
    most_cells: usize,
}

impl Job {
    /// What the arguments ask for.
    pub(super) fn of(arguments: &Arguments) -> Result<Self, Error> {
        Self::dimmed(arguments, &arguments.dimming()?)
    }

    /// The same with luminaires at other levels.
    pub(super) fn dimmed(arguments: &Arguments, dimming: &Dimming) -> Result<Self, Error> {
        let (scene, load_seconds) = load(&arguments.scene, &arguments.include, dimming)?;
        Self::of_scene(arguments, scene, load_seconds)
    }

    /// The same with every luminaire at full output and a light group of its own; and the groups they were in.
    pub(super) fn told_apart(arguments: &Arguments) -> Result<(Self, Vec<String>), Error> {
        let (mut scene, load_seconds) = load(&arguments.scene, &arguments.include, &Dimming::Full)?;
        let groups = influence::tell_apart(&mut scene);
        scene.render.groups = Some(true);
        let mut job = Self::of_scene(arguments, scene, load_seconds)?;
        job.settings.least_passes = LEAST_PASSES;
        Ok((job, groups))
    }

    /// The same with a later seed: by so many.
    pub(super) fn seeded_later(mut self, by: u64) -> Self {
        self.settings.seed = self.settings.seed.wrapping_add(by);
        self
    }

    fn of_scene(arguments: &Arguments, mut scene: Scene, load_seconds: f64) -> Result<Self, Error> {
        choose(&mut scene, &arguments.planes, &arguments.cameras)?;
        if arguments.groups {
            scene.render.groups = Some(true);
        }
        let plan = Plan::new(&scene, parse_method(arguments.method.as_ref(), &scene));
        let mut settings = settings(arguments, &scene, &plan);
        let asked = settings.photons;
        let most_cells = memory::fit(&scene, &plan, &mut settings, arguments.memory.or(scene.render.memory))?;
        if settings.photons < asked {
            scene.warnings.push(format!("--memory: {} photons a pass instead of {asked}", settings.photons));
        }
        Ok(Self { scene, plan, settings, load_seconds, most_cells })
    }

    /// What made a state of the scene.
    pub(super) fn of_recipe(path: &Path, include: &Include, recipe: &Recipe, seed: u64) -> Result<Self, Error> {
        let (mut scene, load_seconds) = load(path, include, &Dimming::AsWritten)?;
        keep_only(&mut scene, &recipe.planes, &recipe.cameras);
        scene.render.groups = Some(recipe.groups);
        let plan = Plan::new(&scene, parse_method(Some(&recipe.method), &scene));
        let tree = named(&recipe.tree, Tree::ALL).unwrap_or(Tree::Kd);
        let Recipe { photons, rays, smooth, nearest, radius, groups, .. } = *recipe;
        let defaults = Settings::of(plan.method);
        let settings =
            Settings { photons, rays, smooth, nearest, radius, groups, tree, seed, passes: None, ..defaults };
        Ok(Self { scene, plan, settings, load_seconds, most_cells: MOST_CELLS })
    }

    /// What makes its state.
    pub(super) fn recipe(&self) -> Recipe {
        recipe(&self.scene, &self.plan, &self.settings)
    }

    /// What is to be computed.
    pub(super) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// How it is to be computed.
    pub(super) fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Cells of a plane that are worked on at once.
    pub(super) fn most_cells(&self) -> usize {
        self.most_cells
    }

    /// Computes it; `None` where another process has the results.
    pub(super) fn run(
        &self,
        threads: Option<u16>,
        quiet: bool,
        keeping: &Keeping<'_>,
    ) -> Result<Option<Results>, Error> {
        let pool = pool(threads)?;
        let bar = Bar::new(quiet);
        let Self { scene, plan, settings, most_cells, .. } = self;
        let results = pool.install(|| render_in_bands(scene, plan, settings, &bar, keeping, *most_cells))?;
        Ok(results.map(|mut results| {
            if interrupted() {
                let passes = results.run.passes;
                results
                    .run
                    .warnings
                    .push(format!("interrupted after pass {passes}: the errors stated are those reached"));
            }
            results.run.seconds.insert(0, ("load scene", self.load_seconds));
            results.run.total_seconds += self.load_seconds;
            results
        }))
    }
}

/// Keeps the planes and cameras asked for; all where none is named.
fn choose(scene: &mut Scene, planes: &[String], cameras: &[String]) -> Result<(), Error> {
    choose_planes(scene, planes)?;
    let known: Vec<&str> = scene.cameras.iter().map(|camera| camera.name.as_str()).collect();
    if let Some(unknown) = cameras.iter().find(|name| !known.contains(&name.as_str())) {
        let known =
            if known.is_empty() { "a scene with a [[camera]]" } else { &format!("one of {}", known.join(", ")) };
        return Err(Error::Usage(format!("--camera: found \"{unknown}\", expected {known}")));
    }
    if !planes.is_empty() || !cameras.is_empty() {
        keep_only(scene, planes, cameras);
    }
    Ok(())
}

/// Leaves out planes, surfaces and cameras of other names.
fn keep_only(scene: &mut Scene, planes: &[String], cameras: &[String]) {
    scene.planes.retain(|plane| planes.contains(&plane.name));
    scene.surfaces.retain(|surface| planes.contains(&surface.name));
    scene.cameras.retain(|camera| cameras.contains(&camera.name));
}

/// A scene, and how long it took to read it, s.
fn load(path: &Path, include: &Include, dimming: &Dimming) -> Result<(Scene, f64), Error> {
    let started = Instant::now();
    let scene = include.load_dimmed(path, dimming)?;
    Ok((scene, started.elapsed().as_secs_f64()))
}

/// Keeps the planes and surfaces asked for; all where none is named.
pub(super) fn choose_planes(scene: &mut Scene, names: &[String]) -> Result<(), Error> {
    if names.is_empty() {
        return Ok(());
    }
    let planes = scene.planes.iter().map(|plane| plane.name.as_str());
    let known: Vec<&str> = planes.chain(scene.surfaces.iter().map(|surface| surface.name.as_str())).collect();
    if let Some(unknown) = names.iter().find(|name| !known.contains(&name.as_str())) {
        return Err(Error::Usage(format!("--plane: found \"{unknown}\", expected one of {}", known.join(", "))));
    }
    scene.planes.retain(|plane| names.contains(&plane.name));
    scene.surfaces.retain(|surface| names.contains(&surface.name));
    Ok(())
}

/// Command line over scene file over defaults.
fn settings(arguments: &Arguments, scene: &Scene, plan: &Plan) -> Settings {
    let file = &scene.render;
    let defaults = Settings::for_plan(plan);
    let passes = arguments.passes.or(file.passes).or((plan.method == Method::Seed).then_some(1));
    let time = arguments.time.or(file.time);
    let unlimited = passes.is_none() && time.is_none();
    let only_images = scene.planes.is_empty() && scene.sensors.is_empty();
    let tree = arguments.tree.as_ref().or(file.tree.as_ref()).and_then(|name| named(name, Tree::ALL));
    Settings {
        photons: arguments.photons.or(file.photons).unwrap_or(defaults.photons),
        nearest: arguments.nearest.map(|k| k as usize).or(file.nearest),
        radius: arguments.radius.or(file.radius),
        rays: arguments.rays.or(file.rays).unwrap_or(defaults.rays),
        smooth: arguments.smooth.as_ref().map(|switch| switch == "on").or(file.smooth).unwrap_or(defaults.smooth),
        passes,
        least_passes: 1,
        first_pass: arguments.first_pass,
        error: arguments.error.or(file.error).or(unlimited.then_some(if only_images { IMAGE_ERROR } else { 1.0 })),
        time,
        tree: tree.unwrap_or(defaults.tree),
        seed: arguments.seed.or(file.seed).unwrap_or(defaults.seed),
        groups: file.groups.unwrap_or(false),
    }
}

pub(super) fn layers(names: &[String]) -> ExtraLayers {
    let asked = |name: &str| names.iter().any(|layer| layer == name);
    ExtraLayers { direct: asked("direct"), indirect: asked("indirect"), standard_error: asked("stderr") }
}

pub(super) fn stem(scene: &Path) -> PathBuf {
    scene.file_stem().map_or_else(|| PathBuf::from("scene"), PathBuf::from)
}

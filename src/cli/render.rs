//! `luxmap render`: the main job.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::builder::PossibleValuesParser;

use super::progress::Bar;
use super::{Outcome, complain, print};
use crate::error::Error;
use crate::render::{Settings, Tree, render};
use crate::report::{self, ExtraLayers, Results};
use crate::scene::Scene;
use crate::scene::plan::{Method, Plan};

/// Compute the illuminance of every measuring plane and sensor, and write it as EXR, PNG, CSV, JSON and HTML.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Scene file (TOML); meshes are looked up beside it.
    scene: PathBuf,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR", help = "Folder for the results [default: out/<scene>]")]
    output: Option<PathBuf>,
    /// split: direct light by shadow rays, photons for what has bounced; photons: all by photons; seed: the paper's
    /// estimator, biases and all [default: split].
    #[arg(long, value_name = "METHOD", value_parser = method_parser(), hide_possible_values = true)]
    method: Option<String>,
    /// Photons a pass; more is less noisy and slower [default: 1000000; seed: 30000].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1 << 40))]
    photons: Option<u64>,
    /// k, nearest photons of an estimate; more is smoother and less sharp [default: grows with the photons; seed: 100].
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(2..))]
    nearest: Option<u32>,
    /// Largest search radius, m [default: a tenth of the scene's diagonal].
    #[arg(long, value_name = "M", value_parser = positive, allow_negative_numbers = true)]
    radius: Option<f64>,
    /// Independent photon maps, averaged [default: 1].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    passes: Option<u32>,
    /// Tree of the photon map: kiddo, paper (the paper's own) or brute (none) [default: kiddo].
    #[arg(long, value_name = "TREE", value_parser = PossibleValuesParser::new(Tree::ALL.map(|(name, _)| name)),
          hide_possible_values = true)]
    tree: Option<String>,
    /// Same seed, same bits, whatever the number of threads [default: 0].
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Threads [default: all].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Only this measuring plane; repeatable.
    #[arg(long = "plane", value_name = "NAME")]
    planes: Vec<String>,
    /// Further EXR layers.
    #[arg(long, value_name = "LAYER", value_delimiter = ',', value_parser = ["direct", "indirect", "stderr"])]
    layers: Vec<String>,
    /// Exit with code 1 if a sensor misses its target.
    #[arg(long)]
    check: bool,
    /// Print the summary as JSON instead of the table.
    #[arg(long)]
    json: bool,
    /// No progress on stderr.
    #[arg(long, short)]
    quiet: bool,
}

pub(super) fn method_parser() -> PossibleValuesParser {
    PossibleValuesParser::new(Method::ALL.map(|(name, _)| name))
}

fn positive(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "expected a number of metres".to_owned())?;
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err("expected more than 0 m".to_owned()) }
}

/// The value named, of a list whose names clap or the scene reader has checked.
fn named<T: Copy, const N: usize>(name: &str, all: [(&'static str, T); N]) -> Option<T> {
    all.into_iter().find(|(known, _)| *known == name).map(|(_, value)| value)
}

/// The method asked for on the command line, else by the scene file, else `split`.
pub(super) fn parse_method(given: Option<&String>, scene: &Scene) -> Method {
    given.or(scene.render.method.as_ref()).and_then(|name| named(name, Method::ALL)).unwrap_or(Method::Split)
}

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let started = Instant::now();
    let mut scene = Scene::load(&arguments.scene)?;
    let load_seconds = started.elapsed().as_secs_f64();
    choose_planes(&mut scene, &arguments.planes)?;
    let plan = Plan::new(&scene, parse_method(arguments.method.as_ref(), &scene));
    let settings = settings(arguments, &scene, plan.method);
    let folder = arguments.output.clone().unwrap_or_else(|| Path::new("out").join(stem(&arguments.scene)));
    report::prepare(&folder)?;

    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(usize::from(arguments.threads.unwrap_or(0)))
        .build()
        .map_err(|error| Error::Usage(format!("--threads: {error}")))?;
    let bar = Bar::new(arguments.quiet);
    let mut results = pool.install(|| render(&scene, &plan, &settings, &bar))?;
    drop(bar);

    results.run.seconds.insert(0, ("load scene", load_seconds));
    results.run.total_seconds += load_seconds;
    let written = report::write(&results, &folder, &layers(&arguments.layers))?;
    if arguments.json {
        print(&report::json::summary(&results))?;
    } else {
        print(&report::table::table(&results))?;
        print(&format!("wrote {} files to {}\n", written.len(), folder.display()))?;
    }
    results.run.warnings.iter().for_each(|warning| complain(&format!("warning: {warning}")));
    Ok(if arguments.check && misses_target(&results) { Outcome::Missed } else { Outcome::Done })
}

/// Keeps the planes asked for; all where none is named.
fn choose_planes(scene: &mut Scene, names: &[String]) -> Result<(), Error> {
    if names.is_empty() {
        return Ok(());
    }
    let known: Vec<&str> = scene.planes.iter().map(|plane| plane.name.as_str()).collect();
    if let Some(unknown) = names.iter().find(|name| !known.contains(&name.as_str())) {
        return Err(Error::Usage(format!("--plane: found \"{unknown}\", expected one of {}", known.join(", "))));
    }
    scene.planes.retain(|plane| names.contains(&plane.name));
    Ok(())
}

/// Command line over scene file over defaults.
fn settings(arguments: &Arguments, scene: &Scene, method: Method) -> Settings {
    let file = &scene.render;
    let defaults = Settings::of(method);
    let tree = arguments.tree.as_ref().or(file.tree.as_ref()).and_then(|name| named(name, Tree::ALL));
    Settings {
        photons: arguments.photons.or(file.photons).unwrap_or(defaults.photons),
        nearest: arguments.nearest.map(|k| k as usize).or(file.nearest),
        radius: arguments.radius.or(file.radius),
        passes: arguments.passes.or(file.passes).unwrap_or(defaults.passes),
        tree: tree.unwrap_or(defaults.tree),
        seed: arguments.seed.or(file.seed).unwrap_or(defaults.seed),
    }
}

fn layers(names: &[String]) -> ExtraLayers {
    let asked = |name: &str| names.iter().any(|layer| layer == name);
    ExtraLayers { direct: asked("direct"), indirect: asked("indirect"), standard_error: asked("stderr") }
}

fn stem(scene: &Path) -> PathBuf {
    scene.file_stem().map_or_else(|| PathBuf::from("scene"), PathBuf::from)
}

fn misses_target(results: &Results) -> bool {
    results.sensors.iter().any(|sensor| sensor.meets_target() == Some(false))
}

//! `luxmap converge`: error against run time.

use std::path::PathBuf;

use super::options::values_of;
use super::progress::TerminalBar;
use super::{Include, Outcome, complain, print, results_folder};
use crate::error::Error;
use crate::files::Claim;
use crate::job::{choose_planes, pool};
use crate::options::{Method, Options};
use crate::photon_map::Tree;
use crate::scene::Scene;
use crate::study::convergence::report;
use crate::study::convergence::{CommonSettings, Study, ladder, reference};

/// Photons a pass, where the user names none: the seed office takes about a minute with three methods and three seeds.
const PHOTONS: [u64; 5] = [30_000, 100_000, 300_000, 1_000_000, 3_000_000];

/// Measure error against run time: every method, number of photons and k with several seeds, compared with a reference;
/// writes convergence.csv and report.html.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Scene file (TOML); meshes are looked up beside it.
    scene: PathBuf,
    #[command(flatten)]
    include: Include,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR", help = "Folder for the results [default: out/<scene>]")]
    output: Option<PathBuf>,
    /// Methods to compare [default: all].
    #[arg(long, value_name = "METHOD,…", value_delimiter = ',', value_parser = values_of("method"),
          hide_possible_values = true)]
    methods: Vec<String>,
    /// Photons a pass of each run [default: 30000 to 3000000 in five steps].
    #[arg(long, value_name = "N,…", value_delimiter = ',', value_parser = values_of("photons"))]
    photons: Vec<u64>,
    /// k, nearest photons of an estimate [default: what the method chooses].
    #[arg(long, value_name = "K,…", value_delimiter = ',', value_parser = values_of("nearest"))]
    nearest: Vec<u32>,
    /// Independent photon maps, averaged [default: 1].
    #[arg(long, value_name = "N,…", value_delimiter = ',', value_parser = values_of("passes"))]
    passes: Vec<u32>,
    /// What is taken for the truth: PLANE=FILE (.exr, or .csv with columns E_lx and standard_error_lx), a file named
    /// after a plane, or a folder of such files; repeatable [default: the closed form where one holds, else a long
    /// run].
    #[arg(long, value_name = "[PLANE=]FILE")]
    reference: Vec<String>,
    /// Only this measuring plane; repeatable.
    #[arg(long = "plane", value_name = "NAME")]
    planes: Vec<String>,
    /// Runs of each setting, each with a seed of its own.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    repeats: u32,
    /// Seed of the first repeat; each further one takes the next [default: 0].
    #[arg(long, value_name = "S", value_parser = values_of("seed"))]
    seed: Option<u64>,
    /// Threads [default: all].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print a summary as JSON instead of the table.
    #[arg(long)]
    json: bool,
    /// No progress on stderr.
    #[arg(long, short)]
    quiet: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let mut scene = arguments.include.load(&arguments.scene)?;
    choose_planes(&mut scene, &arguments.planes)?;
    if scene.planes.is_empty() {
        let found = format!("{}: found no measuring plane, expected a [[plane]]", arguments.scene.display());
        return Err(Error::Usage(format!("{found}; errors are measured on planes")));
    }
    // Nothing is compared there, so no time is spent on them.
    scene.surfaces.clear();
    scene.sensors.clear();
    scene.cameras.clear();
    let given = reference::given(&arguments.reference, &scene)?;
    let folder = results_folder(arguments.output.as_ref(), &arguments.scene, "");
    let _claim = Claim::of(&folder)?;

    let common = common(arguments, &scene);
    let ladder = ladder(
        &scene,
        &methods(arguments),
        or(&arguments.photons, &PHOTONS),
        &nearest(arguments, &scene),
        or(&arguments.passes, &[1]),
    );
    let pool = pool(arguments.threads)?;
    let bar = TerminalBar::new(arguments.quiet);
    let study = pool.install(|| {
        let unused = common.seed.wrapping_sub(1);
        let references = reference::complete(given, &scene, unused, &bar)?;
        Study::measure(&scene, &references, &ladder, &common, &bar)
    })?;
    drop(bar);

    let written = crate::study::convergence::write(&study, &folder)?;
    if arguments.json {
        print(&report::json(&study))?;
    } else {
        print(&report::table(&study))?;
        let names: Vec<String> = written.iter().map(|path| path.display().to_string()).collect();
        print(&format!("wrote {}\n", names.join(" and ")))?;
    }
    study.warnings.iter().for_each(|warning| complain(&format!("warning: {warning}")));
    Ok(Outcome::Done)
}

/// What the scene file sets holds for every run.
fn common(arguments: &Arguments, scene: &Scene) -> CommonSettings {
    let Options { radius, tree, seed, .. } =
        Options { seed: arguments.seed, ..Options::default() }.over(scene.render.clone());
    CommonSettings { radius, tree: tree.unwrap_or(Tree::Kd), seed: seed.unwrap_or(0), repeats: arguments.repeats }
}

/// The methods asked for; all where none is named.
fn methods(arguments: &Arguments) -> Vec<Method> {
    if arguments.methods.is_empty() {
        return Method::ALL.map(|(_, method)| method).to_vec();
    }
    arguments.methods.iter().filter_map(|name| Method::named(name)).collect()
}

/// k as asked for, else the scene file's; nothing where each method is to choose.
fn nearest(arguments: &Arguments, scene: &Scene) -> Vec<usize> {
    if arguments.nearest.is_empty() {
        return scene.render.nearest.into_iter().collect();
    }
    arguments.nearest.iter().map(|&k| k as usize).collect()
}

fn or<'a, T>(given: &'a [T], default: &'a [T]) -> &'a [T] {
    if given.is_empty() { default } else { given }
}

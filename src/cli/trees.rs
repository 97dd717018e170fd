//! `luxmap trees`: kd-trees against each other.

use std::path::{Path, PathBuf};

use clap::builder::PossibleValuesParser;

use super::options::positive;
use super::progress::TerminalBar;
use super::render::stem;
use super::{Include, Outcome, complain, named, print};
use crate::error::Error;
use crate::files::Claim;
use crate::photon_map::Tree;
use crate::study::trees::report as results;
use crate::study::trees::{Comparison, ComparisonSettings, Landings, Pools, Set, Start, TREES, built_in_scene};

/// Compare kd-trees on a scene's photons and on hard cases; writes trees.csv and trees.html.
///
/// Every tree first has to give brute force's answers (exit code 1 if one doesn't); then they take turns.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Scene file (TOML) whose photons are taken [default: the seed office, which is built in].
    scene: Option<PathBuf>,
    #[command(flatten)]
    include: Include,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR", help = "Folder for the results [default: out/<scene>, or out/trees]")]
    output: Option<PathBuf>,
    /// Photons stored.
    #[arg(long, value_name = "N,…", value_delimiter = ',', default_value = "30000,300000",
          value_parser = clap::value_parser!(u32).range(1..=1 << 27))]
    photons: Vec<u32>,
    /// k of the sums over the nearest photons; the middle one is also visited.
    #[arg(long, value_name = "K,…", value_delimiter = ',', default_value = "10,100,500",
          value_parser = clap::value_parser!(u32).range(1..))]
    nearest: Vec<u32>,
    /// Radii of the sums within one, m.
    #[arg(long, value_name = "M,…", value_delimiter = ',', default_value = "0.05,0.2", value_parser = radius,
          allow_negative_numbers = true)]
    radius: Vec<f32>,
    /// Trees: kd (luxmap's own), kiddo, paper (the paper's own).
    #[arg(long, value_name = "TREE,…", value_delimiter = ',', default_value = "kd,kiddo,paper",
          value_parser = PossibleValuesParser::new(TREES.map(Tree::name)), hide_possible_values = true)]
    trees: Vec<String>,
    /// Where photons lie: scene, uniform, plane, clustered, coincident, half-coincident, collinear, offset [default:
    /// all].
    #[arg(long, value_name = "SET,…", value_delimiter = ',',
          value_parser = PossibleValuesParser::new(Set::ALL.map(|(name, _)| name)), hide_possible_values = true)]
    sets: Vec<String>,
    /// Threads to compare with one [default: all].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Seed of photons and of the points asked at.
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// Also write photons and points of the first set, with the most photons, as NumPy files: positions to FILE.npy,
    /// flux to FILE.flux.npy, points to FILE.floor.npy and FILE.random.npy.
    #[arg(long, value_name = "FILE.npy")]
    dump_photons: Option<PathBuf>,
    /// Also repeat the paper's Figures 5 to 7: time against pixels, photons and k, doubled from 17280, 30000 and 100;
    /// writes paper.csv. Takes minutes.
    #[arg(long)]
    paper: bool,
    /// No progress on stderr.
    #[arg(long, short)]
    quiet: bool,
}

fn radius(text: &str) -> Result<f32, String> {
    let radius = positive(text)? as f32;
    if (1e-6..=1e6).contains(&radius) { Ok(radius) } else { Err("expected 1e-6 to 1e6 m".to_owned()) }
}

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let settings = settings(arguments);
    let real = settings.sets.contains(&Set::Scene) || arguments.paper;
    check(arguments, real)?;
    let scene = match &arguments.scene {
        Some(file) => Some(arguments.include.load(file)?),
        None if real => Some(built_in_scene()?),
        None => None,
    };
    let folder = arguments.output.clone().unwrap_or_else(|| {
        Path::new("out").join(arguments.scene.as_ref().map_or_else(|| PathBuf::from("trees"), |scene| stem(scene)))
    });
    let _claim = Claim::of(&folder)?;
    let pools = Pools::new(usize::from(arguments.threads.unwrap_or(0)))?;
    let bar = TerminalBar::new(arguments.quiet);

    let stored = settings.photons.iter().copied().max().unwrap_or(0);
    let of_figures = if arguments.paper { Start::PAPER.most_photons() } else { 0 };
    let of_sets = if settings.sets.contains(&Set::Scene) { stored } else { 0 };
    let landings = match &scene {
        Some(scene) if real => {
            pools.all().install(|| Landings::trace(scene, of_sets.max(of_figures), settings.seed, &bar))?
        }
        _ => Landings::default(),
    };
    let dumped = match &arguments.dump_photons {
        Some(path) => results::dump(&settings.sample(settings.sets[0], stored, &landings), path)?,
        None => Vec::new(),
    };
    let measured = compare(&settings, arguments.paper, &landings, &pools, &bar);
    drop(bar);
    let (cases, figures) = match measured {
        Ok(measured) => measured,
        Err(disagreement) => {
            complain(&format!("luxmap: trees disagree: {disagreement}; nothing was timed after that"));
            return Ok(Outcome::Missed);
        }
    };
    let scene = scene.filter(|_| real).map(|scene| scene.name);
    let comparison = Comparison { scene, machine: processor(), cases, figures };
    let written = crate::study::trees::write(&comparison, &folder)?;
    print(&results::table(&comparison))?;
    let names: Vec<String> = dumped.iter().chain(&written).map(|path| path.display().to_string()).collect();
    print(&format!("wrote {}\n", names.join(", ")))?;
    Ok(Outcome::Done)
}

fn check(arguments: &Arguments, real: bool) -> Result<(), Error> {
    if arguments.scene.is_some() && !real {
        let found = arguments.sets.join(",");
        return Err(Error::Usage(format!(
            "--sets: found {found}, expected scene among them where a scene file is given"
        )));
    }
    match &arguments.dump_photons {
        Some(path) if path.extension().is_none_or(|ending| ending != "npy") => {
            Err(Error::Usage(format!("--dump-photons: found {}, expected a name that ends in .npy", path.display())))
        }
        _ => Ok(()),
    }
}

type Measured = (Vec<crate::study::trees::TreeCase>, Vec<crate::study::trees::Doubling>);

fn compare(
    settings: &ComparisonSettings,
    paper: bool,
    landings: &Landings,
    pools: &Pools,
    bar: &TerminalBar,
) -> Result<Measured, crate::study::trees::Disagreement> {
    let mut cases = Vec::new();
    for &set in &settings.sets {
        for &photons in &settings.photons {
            let sample = settings.sample(set, photons, landings);
            cases.extend(settings.compare(set, &sample, pools, bar)?);
        }
    }
    let figures = if paper { settings.repeat_figures(&Start::PAPER, landings, pools, bar)? } else { Vec::new() };
    Ok((cases, figures))
}

fn settings(arguments: &Arguments) -> ComparisonSettings {
    let sets: Vec<Set> = match arguments.sets.as_slice() {
        [] => Set::ALL.map(|(_, set)| set).to_vec(),
        names => names.iter().filter_map(|name| named(name, Set::ALL)).collect(),
    };
    let trees = arguments.trees.iter().filter_map(|name| named(name, Tree::ALL)).collect();
    ComparisonSettings {
        sets: once_each(sets),
        photons: once_each(arguments.photons.iter().map(|&count| count as usize).collect()),
        nearest: once_each(arguments.nearest.iter().map(|&k| k as usize).collect()),
        radii: once_each(arguments.radius.clone()),
        trees: once_each(trees),
        seed: arguments.seed,
    }
}

/// The values in their order, without repetitions.
fn once_each<T: PartialEq>(values: Vec<T>) -> Vec<T> {
    values.into_iter().fold(Vec::new(), |mut kept, value| {
        if !kept.contains(&value) {
            kept.push(value);
        }
        kept
    })
}

/// The processor's name, where the system tells.
fn processor() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("model name"))?;
    line.split_once(':').map(|(_, name)| name.trim().to_owned())
}

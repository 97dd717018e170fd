//! `luxmap control`: a control loop in a room, step by step.

use std::path::{Path, PathBuf};

use super::progress::TerminalBar;
use super::{Include, Outcome, complain, influence, print, results_folder};
use crate::control::report::{Simulation, json, table, write};
use crate::control::{Script, simulate};
use crate::dimming::Influence;
use crate::error::{Error, InputError, Location};
use crate::files;
use crate::files::Claim;
use crate::scene::{Dimming, Scene};

/// Largest script read, bytes.
const LARGEST: u64 = 16 << 20;

/// Simulate a control loop: sensors read, a controller dims, workers come and go, sensors and luminaires fail, as a script says;
/// beside it the levels of least power. Writes control.csv and control.html.
///
/// SCRIPT (TOML):
///
///   controller = "ana-rc"      # the lab's hill climbing; "uniform": one level for all; "optimum"
///   duration = 1800            # s
///   step = 1.0                 # s between measurements; a search operation of ana-rc takes two
///   seed = 0
///   [[event]]
///   at = 600                   # s
///   sensor = "desk 1"
///   target = 700               # or leaves, comes, fails = true; reads, noise, daylight = lx
///   [[event]]
///   at = 900
///   luminaire = "L[2,3]"
///   fails = true               # or stuck = 0.4; fails = false: works again
///   [[event]]
///   at = 1200
///   daylight = 100             # of all sensors, lx
///
/// Parameters, each with its default; coefficients are those of the regression of a sensor's illuminance on luminaires' levels:
///
///   [uniform]
///   gain = 0.2                 # share of what lacks that a step makes up for
///   [ana-rc]
///   weight = 0.33              # a miss of 10 lx costs so many times the power of a mean luminaire at full output
///   power = "own"              # a luminaire weighs its own power; "meter": that of all
///   counts = 0.2               # a sensor counts for luminaires from this share of its largest coefficient on; from less where
///                              # those together could not reach its target
///   strong = 0.5               # such luminaires are strong for it: others are dimmed while the strong suffice; where counts
///                              # was lowered, all that count are strong
///   total = 0.6                # also strong: from this share of the largest sum of coefficients over needy sensors on
///   margin = 10                # lx: so far above its target a sensor has enough, so far below the weak help
///   down = [-0.06, 0.02]       # from … to, shares of full output: random steps of a luminaire that nobody needs,
///   both = [-0.03, 0.03]       # of one whose sensors have what they ask for,
///   up = [-0.02, 0.06]         # of one with a sensor that lacks light
///   prior = 200                # lx at full output: how large coefficients may be before anything is measured
///   noise = 3                  # lx: noise of a difference of readings (1 σ)
///   drift = 0.7                # lx at full output: how far a coefficient may wander in one search operation (1 σ)
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(super) struct Arguments {
    /// Scene file (TOML) with sensors that have targets.
    scene: PathBuf,
    #[command(flatten)]
    include: Include,
    /// What is to happen (TOML).
    script: PathBuf,
    /// The matrix that luxmap influence has written for this scene, instead of computing it.
    #[arg(long, value_name = "FILE")]
    influence: Option<PathBuf>,
    /// Folder for the results.
    #[arg(long, short, value_name = "DIR", help = "Folder for the results [default: out/<scene>-control]")]
    output: Option<PathBuf>,
    /// Seed of the controller and of noise [default: the script's, else 0].
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Print the summary as JSON instead of the table.
    #[arg(long)]
    json: bool,
    /// No progress on stderr.
    #[arg(long, short)]
    quiet: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let text = read(&arguments.script)?;
    let mut warnings = Vec::new();
    let folder = results_folder(arguments.output.as_ref(), &arguments.scene, "-control");
    let (influence, claim) = match &arguments.influence {
        Some(path) => {
            let influence = Influence::read(path)?;
            let options = arguments.include.options(Dimming::Full)?;
            if Scene::load_as(&arguments.scene, &options)?.hash != influence.scene_sha256 {
                let (path, scene) = (path.display(), arguments.scene.display());
                warnings.push(format!(
                    "{path} is of another scene than {scene} as it is now; targets and light are of the former"
                ));
            }
            (influence, None)
        }
        None => {
            let bar = TerminalBar::new(arguments.quiet);
            let job = arguments.include.job(&arguments.scene, Dimming::Full)?.progress(&bar);
            let found = influence::found(job, &bar, &folder)?;
            (found.influence, Some(found.claim))
        }
    };
    let script = Script::parse(&arguments.script, &text, &influence)?;
    let _claim = claim.map_or_else(|| Claim::of(&folder), Ok)?;
    let seed = arguments.seed.unwrap_or(script.seed);
    let series = simulate(&influence, &script, seed)?;
    let simulation = Simulation { influence: &influence, script: &script, seed, series: &series };
    let written = write(&simulation, &folder)?;
    if arguments.json {
        print(&json(&simulation))?;
    } else {
        print(&table(&simulation))?;
        let names: Vec<String> = written.iter().map(|path| path.display().to_string()).collect();
        print(&format!("wrote {}\n", names.join(" and ")))?;
    }
    warnings.iter().for_each(|warning| complain(&format!("warning: {warning}")));
    Ok(Outcome::Done)
}

/// The text of the script.
fn read(path: &Path) -> Result<String, InputError> {
    let refuse = |found: String| InputError::new(Location::file(path), found, "a script of luxmap control, in TOML");
    let found = |error| if path.exists() { files::why(&error) } else { "no such file".into() };
    let bytes = files::read(path, LARGEST).map_err(|error| refuse(found(error)))?;
    String::from_utf8(bytes).map_err(|_| refuse("bytes that are no UTF-8".into()))
}

//! `luxmap dim`: levels that reach every target at least power.

use std::path::PathBuf;

use serde_json::json;

use super::influence::Found;
use super::render::{self, Job, layers};
use super::signals::end_after_pass;
use super::{Outcome, complain, influence, print, results_folder};
use crate::dimming::{Answer, Goal, Influence, Levels, page, solve};
use crate::error::Error;
use crate::render::Keeping;
use crate::report::{self, Claim, Results, dimming};
use crate::scene::Dimming;

/// Find dimming levels that reach every sensor's target at least power, and verify them by a render.
#[derive(clap::Args)]
#[group(skip)]
pub(super) struct Arguments {
    #[command(flatten)]
    run: render::Arguments,
    /// The matrix that luxmap influence has written for this scene, instead of computing it.
    #[arg(long, value_name = "FILE")]
    influence: Option<PathBuf>,
    /// Come as close to the targets as can be, above as below, instead of reaching them at least power.
    #[arg(long)]
    closest: bool,
    /// Don't verify the levels by a render.
    #[arg(long)]
    no_verify: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    end_after_pass();
    let options = &arguments.run;
    let folder = results_folder(options.output.as_ref(), &options.scene, "-dim");
    let (matrix, found) = match &arguments.influence {
        Some(path) => (Influence::read(path)?, None),
        None => {
            let found = influence::found(options, &folder)?;
            (found.influence.clone(), Some(found))
        }
    };
    let goal = if arguments.closest { Goal::Closest } else { Goal::LeastPower };
    let answer = solve(&matrix, goal)?;
    let _claim = if found.is_none() { Some(Claim::of(&folder)?) } else { None };
    let names = matrix.luminaires.iter().map(|luminaire| luminaire.name.clone());
    let levels = Levels::new(names.zip(answer.levels.iter().copied()));

    let mut written = matrix.write(&folder)?;
    let dark = answer.levels.iter().all(|level| *level <= 0.0);
    let verified = match arguments.no_verify || dark {
        true => None,
        false => {
            let job = Job::dimmed(options, &Dimming::Levels(levels.clone()))?;
            job.run(options.threads, options.quiet, &Keeping::default())?
        }
    };
    if let Some(results) = &verified {
        written.extend(report::write(results, &folder, &layers(&options.layers))?);
    }
    let full = matrix.full_power();
    let about = [
        ("scene", json!(matrix.scene)),
        ("power", json!(answer.power)),
        ("power_full", json!(full)),
        ("power_unit", json!(matrix.power_unit())),
        ("power_bound", json!(answer.bound)),
        ("sensors", sensors(&matrix, &answer, verified.as_ref())),
    ];
    // Layers of the maps are known where the matrix was computed here.
    if let Some(Found { scene, results, .. }) = &found {
        let path = folder.join("live.html");
        page::write(scene, &matrix, results, Some(&answer), &path)?;
        written.push(path);
    }
    let path = folder.join("dimming.json");
    levels.write(&path, &about)?;
    written.push(path);

    if options.json {
        let mut object = serde_json::Map::from_iter(about.map(|(name, value)| (name.to_owned(), value)));
        object.insert("dimming".into(), json!(levels.of));
        print(&format!("{}\n", serde_json::to_string_pretty(&object).expect("levels are numbers")))?;
    } else {
        print(&dimming::dimming(&matrix, &answer, verified.as_ref()))?;
        print(&format!("wrote {} files to {}\n", written.len(), folder.display()))?;
    }
    for missed in &answer.missed {
        let place = &matrix.sensors[missed.sensor];
        complain(&format!(
            "luxmap: sensor \"{}\": target {} lx is not met; {:.1} lx with these levels, {:.1} lx with all luminaires at full \
             output",
            place.name,
            place.target.unwrap_or(0.0),
            missed.reached,
            missed.most,
        ));
    }
    if dark {
        complain(
            "warning: every luminaire is off: the daylight alone reaches the targets, and there is nothing to verify",
        );
    }
    let mut short = false;
    for (place, reading, off) in verified.iter().flat_map(|results| misses(&matrix, &answer, results)) {
        short = true;
        complain(&format!(
            "luxmap: sensor \"{}\": the render with these levels reads {:.1} ± {:.1} lx, {off:.1} lx from what the target allows",
            matrix.sensors[place].name, reading.0, reading.1,
        ));
    }
    Ok(match Outcome::of_interruption() {
        Outcome::Done if short || !answer.missed.is_empty() => Outcome::Missed,
        outcome => outcome,
    })
}

/// What the sensors read by the matrix, and in the render that verifies it.
fn sensors(matrix: &Influence, answer: &Answer, verified: Option<&Results>) -> serde_json::Value {
    let sensor = |number: usize| {
        let place = &matrix.sensors[number];
        let reading = verified.and_then(|results| results.sensor(&place.name));
        json!({
            "name": place.name,
            "target": place.target,
            "tolerance": place.tolerance,
            "daylight": place.daylight,
            "lux": matrix.illuminance(number, &answer.levels),
            "verified": reading.map(|reading| reading.illuminance + place.daylight),
            "verified_stderr": reading.map(|reading| reading.standard_error),
            "most": matrix.most(number),
        })
    };
    (0..matrix.sensors.len()).map(sensor).collect()
}

/// Sensors whose target the render contradicts by more than three standard errors of it and of the matrix: number, reading and
/// its error, and by how much. Targets that no levels meet are told elsewhere.
fn misses(matrix: &Influence, answer: &Answer, results: &Results) -> Vec<(usize, (f64, f64), f64)> {
    let reading = |number: &usize| {
        let place = &matrix.sensors[*number];
        let ([target, most], reading) = (place.band()?, results.sensor(&place.name)?);
        if answer.missed.iter().any(|missed| missed.sensor == *number) {
            return None;
        }
        // Errors of a row's entries may all point the same way.
        let rows = matrix.standard_error[*number].iter().zip(&answer.levels).map(|(error, level)| error * level);
        let error = reading.standard_error.hypot(rows.sum());
        let found = reading.illuminance + place.daylight;
        let off = (target - found).max(found - most);
        (off > 3.0 * error + 1e-6 * target).then_some((*number, (found, reading.standard_error), off))
    };
    (0..matrix.sensors.len()).collect::<Vec<_>>().iter().filter_map(reading).collect()
}

//! `luxmap dim`: levels that reach every target at least power, surely.

use std::path::{Path, PathBuf};

use serde_json::json;

use super::common::{Common, flag};
use super::influence::MatrixRun;
use super::options::Taker;
use super::progress::TerminalBar;
use super::signals::{end_after_pass, interrupted};
use super::{Outcome, complain, influence, print};
use crate::dimming::report::{DimmingResult, dimming};
use crate::dimming::sure::{Known, solve_surely};
use crate::dimming::verify::{Verified, named, verify};
use crate::dimming::{Goal, Influence, page};
use crate::error::Error;
use crate::files::Claim;
use crate::options::Command;
use crate::report::{self};
use crate::results::Verdict;
use crate::results::met::{CONFIDENCE, sigmas};
use crate::scene::Dimming;

/// Find dimming levels that reach every sensor's target at least power, and verify them by renders.
///
/// Each target is reached by a margin that covers the errors of matrix and render, so that a later render finds them
/// all reached; what the margin costs is told.
#[derive(clap::Args)]
#[group(skip)]
pub(super) struct Arguments {
    #[command(flatten)]
    common: Common<DimTaker>,
    /// The matrix that luxmap influence has written for this scene, instead of computing it.
    #[arg(long, value_name = "FILE")]
    influence: Option<PathBuf>,
    /// Come as close to the targets as can be, above as below, instead of reaching them at least power; without a
    /// margin.
    #[arg(long)]
    closest: bool,
    /// How sure it must be that all targets are reached, %, from 50 to 99.9999 [default: 95].
    #[arg(long, value_name = "PCT", value_parser = confidence, allow_negative_numbers = true)]
    confidence: Option<f64>,
    /// Don't verify the levels by renders.
    #[arg(long)]
    no_verify: bool,
}

/// Takes the options of `luxmap dim`.
struct DimTaker;

impl Taker for DimTaker {
    const COMMAND: Command = Command::Dim;
}

fn confidence(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "expected a number of percent".to_owned())?;
    if (50.0..=99.9999).contains(&value) { Ok(value) } else { Err("expected 50 % to 99.9999 %".into()) }
}

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    end_after_pass();
    let common = &arguments.common;
    let folder = common.folder("-dim");
    let bar = TerminalBar::new(common.quiet);
    let (matrix, found) = match &arguments.influence {
        Some(path) => (Influence::read(path)?, None),
        None => {
            let found = influence::found(common.job(Dimming::Full, &bar)?, &bar, &folder)?;
            (found.influence.clone(), Some(found))
        }
    };
    let confidence = arguments.confidence.unwrap_or(100.0 * CONFIDENCE);
    let asked = matrix.sensors.iter().filter(|sensor| sensor.target.is_some()).count();
    let goal = if arguments.closest { Goal::Closest } else { Goal::LeastPower };
    let sigmas = sigmas(confidence / 100.0, asked);
    let mut known = Known::new(&matrix);
    let sure = solve_surely(&known, goal, sigmas)?;
    let _claim = if found.is_none() { Some(Claim::of(&folder)?) } else { None };
    let dark = sure.is_dark();
    let Verified { sure, renders, results: verified } = if arguments.no_verify {
        Verified { sure, renders: 0, results: None }
    } else {
        verify(&mut known, goal, sigmas, sure, &mut |levels, number| {
            let planned = common.job(Dimming::Levels(levels), &bar)?.planned()?.seeded_later(number);
            let mut results = planned.alone()?;
            bar.clear();
            flag(&mut results);
            Ok((results, !interrupted()))
        })?
    };
    let reported = DimmingResult {
        known: &known,
        sure: &sure,
        verdicts: known.verdicts(&sure.answer.levels, sigmas),
        verified: verified.as_ref(),
        renders,
        confidence,
    };

    let mut written = matrix.write(&folder)?;
    if let Some(results) = &verified {
        written.extend(report::write(results, &folder, &common.layers())?);
    }
    // Layers of the maps are known where the matrix was computed here.
    if let Some(MatrixRun { scene, results, .. }) = &found {
        let path = folder.join("live.html");
        page::write(scene, &known, sigmas, results, Some(&sure.answer), &path)?;
        written.push(path);
    }
    written.push(write_levels(&reported, &folder)?);
    if common.json {
        let about = about(&reported).map(|(name, value)| (name.to_owned(), value));
        let mut object = serde_json::Map::from_iter(about);
        object.insert("dimming".into(), json!(named(&known.mean, &sure.answer.levels).of));
        print(&format!("{}\n", serde_json::to_string_pretty(&object).expect("levels are numbers")))?;
    } else {
        print(&dimming(&reported))?;
        print(&format!("wrote {} files to {}\n", written.len(), folder.display()))?;
    }
    if dark {
        complain(
            "warning: every luminaire is off: the daylight alone reaches the targets, and there is nothing to verify",
        );
    }
    let short = print_missed(&reported, goal);
    Ok(match Outcome::of_interruption() {
        Outcome::Done if short => Outcome::Missed,
        outcome => outcome,
    })
}

/// Writes `dimming.json`; returns its path.
fn write_levels(reported: &DimmingResult<'_>, folder: &Path) -> Result<PathBuf, Error> {
    let path = folder.join("dimming.json");
    named(&reported.known.mean, &reported.sure.answer.levels).write(&path, &about(reported))?;
    Ok(path)
}

/// What there is to say beside the levels.
fn about(reported: &DimmingResult<'_>) -> [(&'static str, serde_json::Value); 9] {
    let DimmingResult { known, sure, confidence, renders, .. } = reported;
    let matrix = &known.mean;
    [
        ("scene", json!(matrix.scene)),
        ("power", json!(sure.answer.power)),
        ("power_full", json!(matrix.full_power())),
        ("power_unit", json!(matrix.power_unit())),
        ("power_bound", json!(sure.answer.bound)),
        ("power_without_margin", json!(sure.bare)),
        ("confidence_percent", json!(confidence)),
        ("renders", json!(renders)),
        ("sensors", (0..matrix.sensors.len()).map(|number| sensor(reported, number)).collect()),
    ]
}

/// What a sensor has by all that is known, and in the render that verifies it.
fn sensor(reported: &DimmingResult<'_>, number: usize) -> serde_json::Value {
    let DimmingResult { known, sure, verdicts, verified, .. } = reported;
    let (place, levels) = (&known.mean.sensors[number], &sure.answer.levels);
    let reading = verified.and_then(|results| results.sensor(&place.name));
    json!({
        "name": place.name,
        "target": place.target,
        "tolerance": place.tolerance,
        "daylight": place.daylight,
        "lux": known.mean.illuminance(number, levels),
        "stderr": known.error(number, levels),
        "verdict": verdicts[number].map(Verdict::word),
        "verified": reading.map(|reading| reading.illuminance + place.daylight),
        "verified_stderr": reading.map(|reading| reading.standard_error),
        "most": known.mean.most(number),
    })
}

/// Prints the sensors whose targets are not met with confidence; whether there are some.
fn print_missed(reported: &DimmingResult<'_>, goal: Goal) -> bool {
    let DimmingResult { known, sure, verdicts, .. } = reported;
    let mut short = false;
    for (number, verdict) in verdicts.iter().enumerate() {
        let place = &known.mean.sensors[number];
        let (lux, error) =
            (known.mean.illuminance(number, &sure.answer.levels), known.error(number, &sure.answer.levels));
        let asked = match (place.target, place.tolerance) {
            (Some(target), Some(tolerance)) => format!("{target} … {} lx", target + tolerance),
            (target, _) => format!("{} lx", target.unwrap_or(0.0)),
        };
        let hopeless = sure.answer.missed.iter().any(|missed| missed.sensor == number);
        let why = match verdict {
            Some(Verdict::Missed) if hopeless => format!(
                "target {asked} is not met: {lux:.1} ± {error:.1} lx with these levels, {:.1} lx with all luminaires at full \
                 output",
                known.mean.most(number)
            ),
            Some(Verdict::Missed) => format!("target {asked} is not met: {lux:.1} ± {error:.1} lx with these levels"),
            Some(Verdict::Undecided { .. }) if goal == Goal::LeastPower => format!(
                "target {asked} is not surely met: {lux:.1} ± {error:.1} lx with these levels; a smaller --error decides"
            ),
            _ => continue,
        };
        short = true;
        complain(&format!("luxmap: sensor \"{}\": {why}", place.name));
    }
    short
}

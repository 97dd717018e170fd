//! `luxmap influence`: which luminaire brings how much to which sensor.

use std::path::Path;

use super::common::{Common, flag};
use super::options::Taker;
use super::progress::TerminalBar;
use super::signals::end_after_pass;
use super::{Outcome, complain, print};
use crate::dimming::sure::Known;
use crate::dimming::{Influence, page};
use crate::error::Error;
use crate::files::Claim;
use crate::job::{Job, no_sensor};
use crate::options::Command;
use crate::report;
use crate::results::Results;
use crate::results::met::{CONFIDENCE, sigmas};
use crate::scene::{Dimming, Scene};

/// Compute the influence matrix of a scene: what each luminaire at full output brings to each sensor, in lx and in
/// lx/cd, with standard errors, from one run; and one layer a luminaire in the image of each measuring plane.
#[derive(clap::Args)]
#[group(skip)]
pub(super) struct Arguments {
    #[command(flatten)]
    common: Common<InfluenceTaker>,
}

/// Takes the options of `luxmap influence`.
struct InfluenceTaker;

impl Taker for InfluenceTaker {
    const COMMAND: Command = Command::Influence;
}

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let common = &arguments.common;
    end_after_pass();
    let folder = common.folder("-influence");
    let bar = TerminalBar::new(common.quiet);
    let job = common.job(Dimming::Full, &bar)?;
    let MatrixRun { claim: _claim, scene, influence, results } = found(job, &bar, &folder)?;
    let mut written = report::write(&results, &folder, &common.layers())?;
    written.extend(influence.write(&folder)?);
    written.push(folder.join("live.html"));
    let sigmas = sigmas(CONFIDENCE, influence.sensors.len());
    page::write(&scene, &Known::new(&influence), sigmas, &results, None, &folder.join("live.html"))?;
    if common.json {
        print(&format!("{}\n", influence.json()))?;
    } else {
        print(&crate::dimming::report::influence(&influence))?;
        print(&format!("wrote {} files to {}\n", written.len(), folder.display()))?;
    }
    results.run.warnings.iter().for_each(|warning| complain(&format!("warning: {warning}")));
    Ok(Outcome::of_interruption())
}

/// The matrix, and the run that found it: maps of all luminaires at full output, each a light group.
pub(super) struct MatrixRun {
    pub(super) claim: Claim,
    pub(super) scene: Scene,
    pub(super) influence: Influence,
    pub(super) results: Results,
}

/// Computes the matrix. The folder for results is claimed once it is clear that there will be some.
pub(super) fn found(job: Job<'_>, bar: &TerminalBar, folder: &Path) -> Result<MatrixRun, Error> {
    let (planned, groups) = job.for_influence()?;
    if planned.scene.sensors.is_empty() {
        return Err(no_sensor(&planned.scene));
    }
    let claim = Claim::of(folder)?;
    let mut results = planned.alone()?;
    bar.clear();
    flag(&mut results);
    let influence = Influence::of(&planned.scene, groups, &results);
    Ok(MatrixRun { claim, scene: planned.scene, influence, results })
}

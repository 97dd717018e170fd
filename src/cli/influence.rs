//! `luxmap influence`: which luminaire brings how much to which sensor.

use std::path::Path;

use super::render::{self, Job, layers};
use super::signals::end_after_pass;
use super::{Outcome, complain, print, results_folder};
use crate::dimming::sure::Known;
use crate::dimming::{Influence, page};
use crate::error::Error;
use crate::files::Claim;
use crate::render::Keeping;
use crate::report;
use crate::results::Results;
use crate::results::met::{CONFIDENCE, sigmas};
use crate::scene::Scene;

/// Compute the influence matrix of a scene: what each luminaire at full output brings to each sensor, in lx and in lx/cd, with
/// standard errors, from one run; and one layer a luminaire in the image of each measuring plane.
#[derive(clap::Args)]
#[group(skip)]
pub(super) struct Arguments {
    #[command(flatten)]
    run: render::Arguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let arguments = &arguments.run;
    end_after_pass();
    let folder = results_folder(arguments.output.as_ref(), &arguments.scene, "-influence");
    let Found { claim: _claim, scene, influence, results } = found(arguments, &folder)?;
    let mut written = report::write(&results, &folder, &layers(&arguments.layers))?;
    written.extend(influence.write(&folder)?);
    written.push(folder.join("live.html"));
    let sigmas = sigmas(CONFIDENCE, influence.sensors.len());
    page::write(&scene, &Known::new(&influence), sigmas, &results, None, &folder.join("live.html"))?;
    if arguments.json {
        print(&format!("{}\n", influence.json()))?;
    } else {
        print(&crate::dimming::report::influence(&influence))?;
        print(&format!("wrote {} files to {}\n", written.len(), folder.display()))?;
    }
    results.run.warnings.iter().for_each(|warning| complain(&format!("warning: {warning}")));
    Ok(Outcome::of_interruption())
}

/// The matrix, and the run that found it: maps of all luminaires at full output, each a light group.
pub(super) struct Found {
    pub(super) claim: Claim,
    pub(super) scene: Scene,
    pub(super) influence: Influence,
    pub(super) results: Results,
}

/// Computes the matrix. The folder for results is claimed once it is clear that there will be some.
pub(super) fn found(arguments: &render::Arguments, folder: &Path) -> Result<Found, Error> {
    if let Some(path) = &arguments.dimming {
        let found = format!("--dimming {}", path.display());
        return Err(Error::Usage(format!("found {found}, expected none: every luminaire is taken at full output")));
    }
    let (job, groups) = Job::told_apart(arguments)?;
    if job.scene().sensors.is_empty() {
        let scene = arguments.scene.display();
        return Err(Error::Usage(format!("{scene}: found no sensor, expected a [[sensor]] that luminaires influence")));
    }
    let claim = Claim::of(folder)?;
    let results = job.run(arguments.threads, arguments.quiet, &Keeping::default())?.expect("who is alone leads");
    let influence = Influence::of(job.scene(), groups, &results);
    Ok(Found { claim, scene: job.scene().clone(), influence, results })
}

//! `luxmap plan`: what a scene needs, what is left out, and why.

use std::path::PathBuf;

use super::render::{method_parser, parse_method};
use super::{Outcome, complain, print};
use crate::error::Error;
use crate::scene::Scene;
use crate::scene::plan::Plan;

/// List what a scene needs and what is left out, with the reason.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Scene file (TOML); meshes are looked up beside it.
    scene: PathBuf,
    /// How illuminance is to be computed.
    #[arg(long, value_name = "METHOD", value_parser = method_parser())]
    method: Option<String>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let scene = Scene::load(&arguments.scene)?;
    let method = parse_method(arguments.method.as_ref(), &scene);
    let points: usize = scene.planes.iter().map(|plane| plane.len()).sum();
    print(&format!(
        "{}: {} triangles, {} luminaires, {} planes with {points} points, {} sensors, {} cameras; method {}\n{}",
        scene.name,
        scene.mesh.triangles.len(),
        scene.luminaires.len(),
        scene.planes.len(),
        scene.sensors.len(),
        scene.cameras.len(),
        method.name(),
        Plan::new(&scene, method),
    ))?;
    for warning in &scene.warnings {
        complain(&format!("warning: {warning}"));
    }
    Ok(Outcome::Done)
}

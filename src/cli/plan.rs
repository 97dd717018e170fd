//! `luxmap plan`: what a scene needs, what is left out, and why; what it is made of, and what looks wrong about it.

use std::path::PathBuf;

use super::options::{RunOptions, Taker, flagged};
use super::{Include, Outcome, complain, print};
use crate::error::Error;
use crate::job::choose_planes;
use crate::options::{Command, Method};
use crate::render::Settings;
use crate::render::memory::{Memory, fit};
use crate::render::plan::Plan;
use crate::report::inventory;
use crate::scene::inventory::Inventory;
use crate::text::number;

/// Materials that are listed where not all of them are asked for.
const MOST_MATERIALS: usize = 40;

/// List what a scene needs and what is left out, with the reason.
#[derive(clap::Args)]
pub(super) struct Arguments {
    /// Scene file (TOML); meshes are looked up beside it.
    scene: PathBuf,
    #[command(flatten)]
    include: Include,
    #[command(flatten)]
    options: RunOptions<PlanTaker>,
    /// Only this measuring plane or surface; repeatable.
    #[arg(long = "plane", value_name = "NAME")]
    planes: Vec<String>,
    /// List all materials, and not only the largest 40.
    #[arg(long)]
    materials: bool,
}

/// Takes the options of `luxmap plan`.
struct PlanTaker;

impl Taker for PlanTaker {
    const COMMAND: Command = Command::Plan;
}

pub(super) fn run(arguments: &Arguments) -> Result<Outcome, Error> {
    let mut scene = arguments.include.load(&arguments.scene)?;
    choose_planes(&mut scene, &arguments.planes)?;
    let options = arguments.options.given().clone().over(scene.render.clone());
    let method = options.method.unwrap_or(Method::Gather);
    let plan = Plan::new(&scene, method);
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
        flagged(&plan.to_string()),
    ))?;
    let mut settings = Settings { groups: plan.groups, ..Settings::for_plan(&plan) };
    settings.photons = options.photons.unwrap_or(settings.photons);
    let most_cells = fit(&scene, &plan, &mut settings, options.memory)?;
    let memory = Memory::of(&scene, &plan, &settings, most_cells);
    let Memory { program, triangles, photons, cells, results, pixels } = memory;
    let parts = [program, triangles, photons, cells, results, pixels].map(number::bytes);
    let [program, triangles, photons, cells, results, pixels] = parts;
    print(&format!(
        "peak memory about {}: program {program}, triangles {triangles}, {} photons a pass {photons}, cells {cells}, \
         results {results}, pixels {pixels}\n",
        number::bytes(memory.peak()),
        number::count(settings.photons),
    ))?;
    let most = if arguments.materials { usize::MAX } else { MOST_MATERIALS };
    print(&inventory::inventory(&Inventory::of(&scene), most))?;
    for warning in &scene.warnings {
        complain(&format!("warning: {warning}"));
    }
    Ok(Outcome::Done)
}

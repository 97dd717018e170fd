//! The main job: a scene in, illuminance of every measuring plane and sensor out, and the image of every camera.

mod bands;
mod composition;
mod engine;
mod extremes;
mod groups;
mod keeping;
pub mod memory;
mod method;
#[cfg(feature = "mpi")]
pub mod mpi;
mod place;
pub mod plan;
mod record;
mod repeat;
mod results;
mod round;
pub(crate) mod settings;
mod sites;
mod stop;
mod team;
mod views;
mod warn;
mod warning;

use std::time::Instant;

use self::composition::Composition;
use self::method::Searches;
use self::plan::Plan;
use self::record::Record;
use crate::embree::RayCaster;
use crate::error::{Error, InputError, Location};
use crate::luminaire::LightGroups;
use crate::photon::trace::BOUNCE_CAP;
use crate::photon::trial::PhotonTrial;
use crate::progress::Progress;
use crate::random::Seed;
use crate::results::Results;
use crate::scene::Scene;
use crate::state::Passes;
pub use bands::{MOST_CELLS, checkpoint_files, render_in_bands};
pub use keeping::{Keeping, recipe};
pub use settings::{IMAGE_ERROR, PIXEL_RAYS, SENSOR_RAYS, Settings};
pub use stop::Stop;
pub use team::{Alone, Team, launched};

/// Computes the illuminance of every measuring plane and sensor of a scene, on rayon's current thread pool. The same
/// settings give the same bits for any number of threads.
pub fn render(scene: &Scene, plan: &Plan, settings: &Settings, progress: &dyn Progress) -> Result<Results, Error> {
    let results = render_and_keep(scene, plan, settings, progress, &Keeping::default())?;
    Ok(results.expect("a run that is alone has results"))
}

/// The same with a state that is kept: in a checkpoint from which the run goes on, merged from those of other runs, or
/// shared among processes, of which only the leader gets results.
pub fn render_and_keep(
    scene: &Scene,
    plan: &Plan,
    settings: &Settings,
    progress: &dyn Progress,
    keeping: &Keeping<'_>,
) -> Result<Option<Results>, Error> {
    settings.stop.check()?;
    let (caster, seconds) = start(scene, progress)?;
    render_part(scene, plan, settings, progress, keeping, &caster, seconds)
}

/// Wall time of each stage, s, in the order they ran.
type Stages = Vec<(&'static str, f64)>;

/// Makes the mesh ready for rays, and says how long that took.
fn start(scene: &Scene, progress: &dyn Progress) -> Result<(RayCaster, Stages), Error> {
    let (name, started) = ("build BVH", Instant::now());
    progress.stage(name, 1);
    let caster = RayCaster::build_near(&scene.mesh, &scene.near, rayon::current_num_threads())?;
    let caster = caster.with_panes(&scene.materials);
    Ok((caster, vec![(name, started.elapsed().as_secs_f64())]))
}

/// Renders a scene whose mesh is ready for rays; `seconds` were spent on that.
fn render_part(
    scene: &Scene,
    plan: &Plan,
    settings: &Settings,
    progress: &dyn Progress,
    keeping: &Keeping<'_>,
    caster: &RayCaster,
    seconds: Stages,
) -> Result<Option<Results>, Error> {
    let run = if plan.coloured { Rendering::<3>::run } else { Rendering::<1>::run };
    let mut results = run(scene, plan, settings, progress, keeping, caster)?;
    if let Some(Results { run, .. }) = &mut results {
        run.total_seconds += seconds.iter().map(|(_, seconds)| seconds).sum::<f64>();
        run.seconds.splice(0..0, seconds);
    }
    Ok(results)
}

/// A run while it is computed.
struct Rendering<'a, const C: usize> {
    scene: &'a Scene,
    plan: &'a Plan,
    composition: Composition,
    settings: &'a Settings,
    progress: &'a dyn Progress,
    /// That of what is near in the scene, m: walked once, since it takes all vertices.
    diagonal: f64,
    searches: Searches,
    done: Passes,
    record: Record<C>,
    /// The light groups to be told apart.
    groups: Option<LightGroups>,
    /// What became of photons sent ahead, where some surface absorbs next to nothing.
    trial: PhotonTrial,
}

impl<'a, const C: usize> Rendering<'a, C> {
    fn run(
        scene: &'a Scene,
        plan: &'a Plan,
        settings: &'a Settings,
        progress: &'a dyn Progress,
        keeping: &Keeping<'_>,
        caster: &RayCaster,
    ) -> Result<Option<Results>, Error> {
        let (diagonal, composition) = (scene.diagonal(), plan.composition(scene));
        let mut rendering = Self {
            scene,
            plan,
            composition,
            settings,
            progress,
            diagonal,
            searches: Searches::new(composition.density, settings, diagonal, settings.photons as f64),
            done: Passes::default(),
            record: Record::new(&scene.warnings),
            groups: None,
            trial: PhotonTrial::default(),
        };
        rendering.choose_groups()?;
        rendering.send_ahead(caster)?;
        let (mut places, sensors) = rendering.places(caster);
        if plan.shadow_rays {
            rendering.direct(&mut places, caster);
        }
        rendering.look_around(&mut places, caster);
        let mut images = Vec::new();
        if plan.bounces || !scene.cameras.is_empty() {
            images = rendering.passes(&mut places, caster, keeping)?;
        }
        if keeping.team.rank() > 0 {
            return Ok(None);
        }
        if plan.bounces {
            rendering.conclude_groups(&mut places);
        }
        rendering.warn(&places);
        Ok(Some(rendering.results(&places, &sensors, images, caster.peak_memory())))
    }

    /// Traces some photons to see whether all light is absorbed in the end, where that isn't certain.
    fn send_ahead(&mut self, caster: &RayCaster) -> Result<(), Error> {
        if !self.plan.bounces || !PhotonTrial::is_called_for(self.scene, self.diagonal) {
            return Ok(());
        }
        let seed = Seed(self.settings.seed).branch(PURPOSE_TRIAL);
        self.trial = self.timed("send photons ahead", 1, |this| PhotonTrial::of::<C>(this.scene, caster, seed));
        let PhotonTrial { photons, endless, .. } = self.trial;
        if endless <= MOST_ENDLESS {
            return Ok(());
        }
        let found = format!(
            "surfaces that absorb next to nothing: {:.1} % of the light of {photons} photons was still under way after \
             {BOUNCE_CAP} bounces",
            100.0 * endless
        );
        let expected = "some that absorb it, or an opening: illuminance has nothing to settle at";
        let error = InputError::new(Location::file(&self.scene.file), found, expected);
        Err(error.hint("white paint reflects 0.85, a good mirror 0.95").into())
    }

    /// Runs a stage and books its wall time.
    fn timed<R>(&mut self, name: &'static str, steps: u64, stage: impl FnOnce(&mut Self) -> R) -> R {
        self.progress.stage(name, steps);
        let started = Instant::now();
        let result = stage(self);
        self.record.book(name, started.elapsed().as_secs_f64());
        result
    }
}

/// Purposes of random streams, so that none draws another's numbers.
const PURPOSE_PHOTONS: u64 = 1;
const PURPOSE_SHADOWS: u64 = 2;
const PURPOSE_REACH: u64 = 3;
const PURPOSE_SIGHT: u64 = 4;
const PURPOSE_VIEWS: u64 = 5;
const PURPOSE_FAINT: u64 = 6;
const PURPOSE_TRIAL: u64 = 7;
const PURPOSE_BRIGHT: u64 = 8;
const PURPOSE_EXTREMES: u64 = 9;

/// The part of the light that may be left after the most bounces: more would take hours, and be wrong by more.
const MOST_ENDLESS: f64 = 0.02;

/// How far a surface may lie from where a measuring plane is said to be, m, in a scene of this diagonal (m): thicker
/// than what CAD programs round, thinner than what people build.
fn surface_tolerance(diagonal: f64) -> f64 {
    (2e-4 * diagonal).min(2e-3)
}

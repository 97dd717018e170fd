//! What a user may choose for a run.

use std::num::NonZeroU32;

use super::Stop;
use super::plan::{Method, Plan};
use crate::options::Options;
use crate::photon_map::Tree;
use crate::scene::Scene;

/// What a user may choose.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Photons a pass.
    pub photons: u64,
    /// Rays from each grid point a pass (`gather` and `path`); a sensor, which has no neighbours to help it, sends
    /// [`SENSOR_RAYS`] times as many, a sample of a surface as many as a sensor, a pixel of a camera [`PIXEL_RAYS`]
    /// times.
    pub rays: u32,
    /// Whether neighbouring grid points help each other to what rays found; if not, `path` has no bias at all.
    pub smooth: bool,
    /// k; by method and number of photons where not given.
    pub nearest: Option<usize>,
    /// Largest search radius, m; a tenth of the scene's diagonal where not given (see
    /// [`Scene::diagonal`](crate::scene::Scene::diagonal)).
    pub radius: Option<f64>,
    /// The error is not asked for before so many passes are done: from few, standard errors of single points are
    /// uncertain themselves. Where single points decide when to stop, it may be asked for earlier, but is not believed
    /// before the fourth.
    pub least_passes: u32,
    /// The first of them: runs of different passes, or seeds, add up to one.
    pub first_pass: u32,
    /// When the run ends.
    pub stop: Stop,
    /// Which tree.
    pub tree: Tree,
    /// Seed of all random streams.
    pub seed: u64,
    /// Whether light groups are told apart, where there are several.
    pub groups: bool,
}

impl Settings {
    /// The settings for a plan where the user chooses nothing: one pass.
    pub fn for_plan(plan: &Plan) -> Self {
        let defaults = Self::of(plan.method);
        // Caustics are few of all photons, and theirs alone.
        let few = plan.method == Method::Gather && plan.caustics;
        let photons = if few { 5 * defaults.photons } else { defaults.photons };
        Self { photons, groups: plan.groups, ..defaults }
    }

    /// The settings of a run: what was chosen, over the defaults of the plan. Where nobody says when it ends, it ends
    /// at a standard error of 1 %, or of [`IMAGE_ERROR`] where there are only cameras; `seed` after one pass.
    pub fn chosen(options: &Options, scene: &Scene, plan: &Plan) -> Self {
        let defaults = Self::for_plan(plan);
        let one = if plan.method == Method::Seed { NonZeroU32::new(1) } else { None };
        let only_images = scene.planes.is_empty() && scene.sensors.is_empty();
        let stop = Stop::by(options.passes.or(one), options.error, options.time);
        Self {
            photons: options.photons.unwrap_or(defaults.photons),
            nearest: options.nearest,
            radius: options.radius,
            rays: options.rays.unwrap_or(defaults.rays),
            smooth: options.smooth.unwrap_or(defaults.smooth),
            least_passes: 1,
            first_pass: options.first_pass.unwrap_or(0),
            stop: stop.unwrap_or(Stop::at_error(if only_images { IMAGE_ERROR } else { 1.0 })),
            tree: options.tree.unwrap_or(defaults.tree),
            seed: options.seed.unwrap_or(defaults.seed),
            groups: options.groups.unwrap_or(false),
        }
    }

    /// The settings of a method where nothing is known of the scene: one pass.
    pub fn of(method: Method) -> Self {
        let photons = match method {
            Method::Seed => 30_000,
            Method::Gather | Method::Path => 200_000,
            Method::Split | Method::Photons => 1_000_000,
        };
        Self {
            photons,
            rays: 8,
            smooth: method == Method::Gather,
            nearest: None,
            radius: None,
            least_passes: 1,
            first_pass: 0,
            stop: Stop::after(1),
            tree: Tree::Kd,
            seed: 0,
            groups: false,
        }
    }
}

/// Passes from which the standard error of a single point, by the scatter of its own batches alone, is believed: four
/// passes of four rounds make 16.
pub(crate) const LEAST_PASSES: u32 = 4;

/// Rays of a sensor, and of a sample of a surface, for each ray of a grid point.
pub const SENSOR_RAYS: u32 = 32;

/// Rays of a camera's pixel for each ray of a grid point: neighbours don't help each other in an image.
pub const PIXEL_RAYS: u32 = 4;

/// Standard error of an image's pixels, % of its mean, that suits the eye: the default of `error` where a scene has
/// cameras only; where maps or sensors end the run, an image that has it takes no more rays.
pub const IMAGE_ERROR: f64 = 5.0;

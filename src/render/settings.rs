//! What a user may choose for a run.

use super::plan::{Method, Plan};
use crate::photon_map::Tree;

/// What a user may choose.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Photons a pass.
    pub photons: u64,
    /// Rays from each grid point a pass (`gather` and `path`); a sensor, which has no neighbours to help it, sends
    /// [`SENSOR_RAYS`] times as many, a sample of a surface [`SAMPLE_RAYS`] times, a pixel of a camera [`PIXEL_RAYS`] times.
    pub rays: u32,
    /// Whether neighbouring grid points help each other to what rays found; if not, `path` has no bias at all.
    pub smooth: bool,
    /// k; by method and number of photons where not given.
    pub nearest: Option<usize>,
    /// Largest search radius, m; a tenth of the scene's diagonal where not given (see [`Scene::diagonal`](crate::scene::Scene::diagonal)).
    pub radius: Option<f64>,
    /// Passes at most; as many as `error` and `time` ask for where not given.
    pub passes: Option<u32>,
    /// The error is not asked for before so many passes are done: from few, standard errors of single points are uncertain
    /// themselves.
    pub least_passes: u32,
    /// The first of them: runs of different passes, or seeds, add up to one.
    pub first_pass: u32,
    /// The run ends when the claimed standard error of every map, or of every sensor where there is no map, is at most
    /// this, % of its mean; where there are only cameras, that of every image.
    pub error: Option<f64>,
    /// The run ends before this wall time is over, s, but for its first pass.
    pub time: Option<f64>,
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
            passes: Some(1),
            least_passes: 1,
            first_pass: 0,
            error: None,
            time: None,
            tree: Tree::Kd,
            seed: 0,
            groups: false,
        }
    }
}

/// Rays of a sensor, and of a sample of a surface, for each ray of a grid point.
pub const SENSOR_RAYS: u32 = 32;

/// Rays of a camera's pixel for each ray of a grid point: neighbours don't help each other in an image.
pub const PIXEL_RAYS: u32 = 4;

/// Standard error of an image's pixels, % of its mean, that suits the eye: the default of `error` where a scene has cameras
/// only; where maps or sensors end the run, an image that has it takes no more rays.
pub const IMAGE_ERROR: f64 = 5.0;

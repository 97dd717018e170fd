//! The main job: a scene in, illuminance of every measuring plane and sensor out, and the image of every camera.

mod bands;
mod densities;
mod extremes;
mod groups;
mod keeping;
pub mod memory;
#[cfg(feature = "mpi")]
pub mod mpi;
mod passes;
mod results;
mod team;
mod views;

use std::time::Instant;

use rayon::prelude::*;

use crate::embree::RayCaster;
use crate::error::{Error, InputError, Location};
use crate::gather::bodies::direct_on_bodies;
use crate::gather::counts::Counts;
use crate::gather::density::{Estimate, Search};
use crate::gather::direct::blockers::Blockers;
use crate::gather::direct::faint::Faint;
use crate::gather::direct::{Asked, DirectLight, direct_light_for};
use crate::gather::reach::{Points, Reach, Standing};
use crate::gather::receiver::Receiver;
use crate::gather::smooth::{MAP_BATCHES, POINT_BATCHES, Samples, Smoother, WIDEST};
use crate::gather::surroundings::{FAN, Surroundings};
use crate::gather::witness::{Contradiction, Witness};
use crate::luminaire::LightGroups;
use crate::photon::flux::photometric;
use crate::photon::random::Seed;
use crate::photon::trace::{BOUNCE_CAP, TallySum};
use crate::photon::trial::Trial;
use crate::photon_map::{BruteForce, KdTree, Kiddo, NearestPhotons, Paper};
use crate::report::{Extremes, Results};
use crate::scene::measured::Sample;
use crate::scene::plan::{Method, Plan};
use crate::scene::{Material, PlaneKind, Scene};
use crate::state::Passes;
pub use bands::{MOST_CELLS, checkpoint_files, render_in_bands};
pub use keeping::{Keeping, recipe};
pub(crate) use results::corners;
pub use team::{Alone, Team, launched};

/// Which tree holds the photons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tree {
    /// luxmap's own kd-tree.
    Kd,
    /// kiddo's immutable kd-tree.
    Kiddo,
    /// The paper's tree.
    Paper,
    /// No tree: every photon is looked at.
    Brute,
}

impl Tree {
    /// Every tree, by name.
    pub const ALL: [(&'static str, Self); 4] =
        [("kd", Self::Kd), ("kiddo", Self::Kiddo), ("paper", Self::Paper), ("brute", Self::Brute)];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Kd => "kd",
            Self::Kiddo => "kiddo",
            Self::Paper => "paper",
            Self::Brute => "brute",
        }
    }
}

/// What a user may choose.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Photons a pass.
    pub photons: u64,
    /// Rays from each grid point a pass (`gather` and `path`); a sensor, which has no neighbours to help it, sends
    /// [`SENSOR_RAYS`] times as many, a sample of a surface `SAMPLE_RAYS` times, a pixel of a camera [`PIXEL_RAYS`] times.
    pub rays: u32,
    /// Whether neighbouring grid points help each other to what rays found; if not, `path` has no bias at all.
    pub smooth: bool,
    /// k; by method and number of photons where not given.
    pub nearest: Option<usize>,
    /// Largest search radius, m; a tenth of the scene's diagonal where not given (see [`Scene::diagonal`]).
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

/// Hears how far a run has come.
pub trait Progress: Sync {
    /// A stage of `steps` steps begins.
    fn stage(&self, name: &'static str, steps: u64);
    /// `steps` more are done.
    fn advance(&self, steps: u64);
    /// A pass is over; the worst map's claimed standard error is now `percent` of its mean.
    fn pass(&self, _passes: u32, _percent: f64) {}
    /// Whether the run shall end after the pass in hand.
    fn interrupted(&self) -> bool {
        false
    }
}

/// Hears nothing.
impl Progress for () {
    fn stage(&self, _: &'static str, _: u64) {}
    fn advance(&self, _: u64) {}
}

/// Computes the illuminance of every measuring plane and sensor of a scene, on rayon's current thread pool. The same
/// settings give the same bits for any number of threads.
pub fn render(scene: &Scene, plan: &Plan, settings: &Settings, progress: &dyn Progress) -> Result<Results, Error> {
    let results = render_and_keep(scene, plan, settings, progress, &Keeping::default())?;
    Ok(results.expect("who is alone leads"))
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
    let run = match (plan.coloured, settings.tree) {
        (false, Tree::Kd) => Rendering::<1>::run::<KdTree>,
        (false, Tree::Kiddo) => Rendering::<1>::run::<Kiddo>,
        (false, Tree::Paper) => Rendering::<1>::run::<Paper>,
        (false, Tree::Brute) => Rendering::<1>::run::<BruteForce>,
        (true, Tree::Kd) => Rendering::<3>::run::<KdTree>,
        (true, Tree::Kiddo) => Rendering::<3>::run::<Kiddo>,
        (true, Tree::Paper) => Rendering::<3>::run::<Paper>,
        (true, Tree::Brute) => Rendering::<3>::run::<BruteForce>,
    };
    let mut results = run(scene, plan, settings, progress, keeping, caster)?;
    if let Some(Results { run, .. }) = &mut results {
        run.total_seconds += seconds.iter().map(|(_, seconds)| seconds).sum::<f64>();
        run.seconds.splice(0..0, seconds);
    }
    Ok(results)
}

/// Search limits of the two kinds of light; see [`Crossings`].
#[derive(Clone, Copy)]
struct Searches {
    sharp: Search,
    smooth: Search,
}

impl Searches {
    /// Those of one map of `photons` photons.
    fn new(method: Method, settings: &Settings, diagonal: f64, photons: f64) -> Self {
        let radius = settings.radius.unwrap_or(0.1 * diagonal) as f32;
        let floor = (1e-4 * diagonal) as f32;
        // Variance falls as 1/k, squared bias grows as (k/N)²: the best k grows as N^(2/3).
        let growing = |at_a_million: f64| {
            let k = at_a_million * (photons / 1e6).powf(2.0 / 3.0);
            settings.nearest.unwrap_or((k as usize).clamp(30, 5000))
        };
        let (sharp, smooth) = match method {
            Method::Seed => {
                let paper = settings.nearest.unwrap_or(100);
                (paper, paper)
            }
            _ => (growing(200.0), growing(1000.0)),
        };
        let search = |nearest| Search { nearest, radius, floor };
        Self { sharp: search(sharp), smooth: search(smooth) }
    }

    /// Those of pass `pass` (from 0 on): discs shrink from pass to pass, so that their bias vanishes with their noise.
    /// R²ₙ₊₁ = R²ₙ (n + α)/(n + 1) with α = 2/3, the rate at which both vanish together (Knaus & Zwicker 2011).
    fn of_pass(self, pass: u32) -> Self {
        let shrunk: f64 = (1..=pass).map(|n| (f64::from(n) + 2.0 / 3.0) / (f64::from(n) + 1.0)).product();
        let shrink = |search: Search| Search {
            nearest: ((search.nearest as f64 * shrunk) as usize).max(search.nearest.min(20)),
            radius: search.radius * shrunk.sqrt() as f32,
            ..search
        };
        Self { sharp: shrink(self.sharp), smooth: shrink(self.smooth) }
    }
}

/// One receiver with all that is known of it.
struct Place<const C: usize> {
    receiver: Receiver,
    /// Whether it is a measuring plane on a surface.
    on_surface: bool,
    has_value: Vec<bool>,
    /// Why, or why not.
    standing: Vec<Standing>,
    surroundings: Vec<Surroundings>,
    smoother: Option<Smoother>,
    direct: Option<DirectLight<C>>,
    /// The part of the direct light that is left to rays.
    faint: Option<FaintLight<C>>,
    /// Sums over the passes of what photon densities say at each point; empty where nothing asks them.
    density: densities::Densities<C>,
    /// What rays found at each point.
    samples: Option<Samples<C>>,
    /// What some photons say of the same, where rays rely on photons' records.
    witness: Option<Witness>,
    /// Photons counted in cells, on samples and about bodies.
    counts: Option<Counts<C>>,
    /// Areas of the points, m²: of a measured surface only.
    areas: Vec<f64>,
    /// What that adds to the variance of each point, lx²; empty without such photons.
    doubt: Vec<f64>,
    /// Where rays and photons contradict each other most, if they do.
    contradiction: Option<Contradiction>,
    /// Light that has bounced, as far as the passes know.
    bounced: Vec<Estimate<C>>,
    /// The part of it that rays from the points could not find: caustics. Empty where there are none.
    rest: Vec<Estimate<C>>,
    /// The same by light group.
    groups: Option<groups::PlaceGroups>,
    /// What is known of extremes and mean: of the whole, then of each area.
    extremes: Vec<Extremes>,
    /// By what the light that has bounced was multiplied where an extreme was read again: its groups are, too.
    scaled: Vec<(usize, [f64; C])>,
}

/// Direct light of luminaires that are faint at a point.
struct FaintLight<const C: usize> {
    luminaires: Faint<C>,
    /// What rays to them found at each point.
    samples: Samples<C>,
    /// What that comes to, as far as the passes know; nothing yet before the first is over.
    light: Vec<Estimate<C>>,
}

/// A run under way.
struct Rendering<'a, const C: usize> {
    scene: &'a Scene,
    plan: &'a Plan,
    settings: &'a Settings,
    progress: &'a dyn Progress,
    started: Instant,
    /// That of what is near in the scene, m: walked once, since it takes all vertices.
    diagonal: f64,
    searches: Searches,
    done: Passes,
    seconds: Stages,
    /// Rays before the first pass, and in passes.
    prepared_rays: u64,
    gather_rays: u64,
    photons_emitted: u64,
    photons_stored: u64,
    flux: TallySum<C>,
    /// The light groups to be told apart.
    groups: Option<LightGroups>,
    warnings: Vec<String>,
    /// What became of photons sent ahead, where some surface absorbs next to nothing.
    trial: Trial,
}

impl<'a, const C: usize> Rendering<'a, C> {
    fn run<T: NearestPhotons>(
        scene: &'a Scene,
        plan: &'a Plan,
        settings: &'a Settings,
        progress: &'a dyn Progress,
        keeping: &Keeping<'_>,
        caster: &RayCaster,
    ) -> Result<Option<Results>, Error> {
        let diagonal = scene.diagonal();
        let mut rendering = Self {
            scene,
            plan,
            settings,
            progress,
            started: Instant::now(),
            diagonal,
            searches: Searches::new(plan.method, settings, diagonal, settings.photons as f64),
            done: Passes::default(),
            seconds: Vec::new(),
            prepared_rays: 0,
            gather_rays: 0,
            photons_emitted: 0,
            photons_stored: 0,
            flux: TallySum::default(),
            groups: None,
            warnings: scene.warnings.clone(),
            trial: Trial::default(),
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
            images = rendering.passes::<T>(&mut places, caster, keeping)?;
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

    /// Asks some photons whether the light comes to an end, where that isn't plain.
    fn send_ahead(&mut self, caster: &RayCaster) -> Result<(), Error> {
        if !self.plan.bounces || !Trial::is_called_for(self.scene, self.diagonal) {
            return Ok(());
        }
        let seed = Seed(self.settings.seed).branch(PURPOSE_TRIAL);
        self.trial = self.timed("send photons ahead", 1, |this| Trial::of::<C>(this.scene, caster, seed));
        let Trial { photons, endless, .. } = self.trial;
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
        let seconds = started.elapsed().as_secs_f64();
        match self.seconds.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += seconds,
            None => self.seconds.push((name, seconds)),
        }
        result
    }

    /// Every receiver: the planes in the scene's order, the sensors' with the sensors each serves, then the surfaces.
    fn places(&mut self, caster: &RayCaster) -> (Vec<Place<C>>, Vec<Vec<usize>>) {
        let scene = self.scene;
        let tolerance = (2e-4 * self.diagonal).min(2e-3) as f32;
        let radius = self.searches.smooth.radius;
        let mut sensors = Vec::new();
        let planes = scene
            .planes
            .iter()
            .map(|plane| (Receiver::of_plane(plane, caster, tolerance, radius), plane.kind == PlaneKind::Surface));
        let mut receivers: Vec<(Receiver, bool)> = planes.collect();
        for (receiver, served) in Receiver::of_sensors(scene, caster, tolerance, radius) {
            receivers.push((receiver, false));
            sensors.push(served);
        }
        if let Some((receiver, served)) = Receiver::of_bodies(scene, caster, tolerance) {
            receivers.push((receiver, false));
            sensors.push(served);
        }
        receivers.extend(scene.surfaces.iter().map(|surface| (Receiver::of_surface(surface, caster), false)));
        let counts_sharp = self.counts_sharp();
        let place = |(mut receiver, on_surface): (Receiver, bool)| {
            // Cells so small that even the widest window over them holds few photons are asked by discs, as single points are.
            let [width, height] = receiver.cell;
            receiver.cells_count =
                counts_sharp && receiver.grid.is_some() && (2.0 * WIDEST + 1.0) * width.min(height) >= radius;
            let dark = vec![Estimate::DARK; receiver.len()];
            let sampled = self.plan.bounces && self.plan.method.sends_rays();
            let told_apart = receiver.is_plane() || !receiver.bodies().is_empty();
            Place {
                on_surface,
                has_value: vec![true; receiver.len()],
                standing: vec![Standing::Place; receiver.len()],
                surroundings: Vec::new(),
                smoother: None,
                direct: None,
                faint: None,
                samples: sampled.then(|| match &self.groups {
                    Some(groups) if told_apart => {
                        let (width, variances) = (groups.width::<C>(), receiver.grid.is_none());
                        Samples::in_groups(receiver.len(), batches(&receiver), width, variances)
                    }
                    _ => Samples::new(receiver.len(), batches(&receiver)),
                }),
                groups: if told_apart { self.place_groups(&receiver) } else { None },
                witness: None,
                doubt: Vec::new(),
                contradiction: None,
                counts: None,
                areas: Vec::new(),
                density: self.empty_densities(&receiver),
                bounced: dark,
                rest: Vec::new(),
                extremes: Vec::new(),
                scaled: Vec::new(),
                receiver,
            }
        };
        let mut places: Vec<Place<C>> = receivers.into_iter().map(place).collect();
        let first = places.len() - scene.surfaces.len();
        for (place, surface) in places[first..].iter_mut().zip(&scene.surfaces) {
            place.areas = surface.samples.iter().map(Sample::area).collect();
        }
        (places, sensors)
    }

    /// Sums for the photon densities that are asked for at a receiver.
    fn empty_densities(&self, receiver: &Receiver) -> densities::Densities<C> {
        let points = if receiver.is_plane() { receiver.len() } else { 0 };
        densities::Densities::new(points * self.discs(receiver.cells_count), points * self.smooth_scales())
    }

    fn direct(&mut self, places: &mut [Place<C>], caster: &RayCaster) {
        let steps = (places.len() * self.scene.luminaires.len()) as u64;
        self.timed("direct light", steps, |this| {
            let blockers = Blockers::new(&this.scene.mesh, caster);
            for (index, place) in places.iter_mut().enumerate() {
                let seed = Seed(this.settings.seed).branch(PURPOSE_SHADOWS).branch(index as u64);
                let advance = |steps| this.progress.advance(steps);
                let (luminaires, receiver) = (&this.scene.luminaires, &place.receiver);
                let groups = place.groups.as_ref().and(this.groups.as_ref());
                // Where rays come anyway, and neighbours help each other, faint luminaires are left to them.
                let faint =
                    this.settings.smooth && receiver.grid.is_some() && place.samples.is_some() && groups.is_none();
                let light = match receiver.bodies() {
                    [] => {
                        let asked = Asked { groups, faint };
                        let (light, faint) = direct_light_for(luminaires, receiver, &blockers, seed, advance, asked);
                        place.faint = (!faint.is_empty()).then(|| FaintLight {
                            samples: Samples::new(receiver.len(), MAP_BATCHES),
                            luminaires: faint,
                            light: Vec::new(),
                        });
                        light
                    }
                    bodies => direct_on_bodies(luminaires, receiver, bodies, &blockers, seed, advance, groups),
                };
                this.prepared_rays += light.rays;
                place.direct = Some(light);
            }
        });
    }

    /// Finds which points are places at all. That is a fact of the scene: all seeds agree on it, so that their results can be
    /// merged.
    fn find_standings(&self, places: &mut [Place<C>], caster: &RayCaster) {
        let points = places.iter().map(|place| Points { receiver: &place.receiver, areas: &place.areas });
        let points: Vec<Points<'_>> = points.collect();
        // Cutting leaves slivers of what is hidden: light that is real comes by some other way, too.
        let of_place = |place: &Place<C>| {
            let values = place.direct.iter().flat_map(|light| &light.value);
            values.fold(0.0, |most: f64, value| most.max(photometric(*value)))
        };
        let sliver = 1e-5 * places.iter().map(of_place).fold(0.0, f64::max);
        let is_lit = |place: usize, point: usize| {
            places[place].direct.as_ref().is_some_and(|light| photometric(light.value[point]) > sliver)
        };
        let mut reach = Reach::new(self.scene, caster, Seed(0).branch(PURPOSE_REACH));
        let found = reach.standings(&points, is_lit);
        for (place, standing) in places.iter_mut().zip(found) {
            place.has_value = standing.iter().map(|standing| standing.is_place()).collect();
            place.standing = standing;
        }
    }

    /// Finds which points are places at all, and what is in their neighbours' way.
    fn look_around(&mut self, places: &mut [Place<C>], caster: &RayCaster) {
        let radius = self.searches.smooth.radius;
        let densities = self.plan.method != Method::Seed && self.has_smooth_densities();
        let counts_sharp = self.counts_sharp();
        self.timed("look around", places.len() as u64, |this| {
            this.find_standings(places, caster);
            for place in places {
                let Place { receiver, has_value, surroundings, smoother, samples, witness, .. } = place;
                let points = (0..receiver.len()).into_par_iter();
                let has_discs = counts_sharp && !receiver.cells_count;
                if receiver.is_plane() && (densities || has_discs) {
                    *surroundings = points.map(|point| Surroundings::look(receiver, point, caster, radius)).collect();
                    this.prepared_rays += (FAN * surroundings.len()) as u64;
                }
                let helped = if samples.is_some() { this.settings.smooth } else { counts_sharp };
                if let (Some(grid), true) = (receiver.grid, helped) {
                    *smoother = Some(Smoother::new(receiver, grid, has_value, caster));
                    this.prepared_rays += 2 * receiver.len() as u64;
                }
                let relies = this.plan.method == Method::Gather && this.plan.photons && samples.is_some();
                if relies && receiver.is_plane() && this.scene.materials.iter().any(Material::is_diffuse) {
                    *witness = match (receiver.grid, &*smoother) {
                        (Some(grid), Some(smoother)) => Some(Witness::of_grid(grid, receiver, smoother, caster)),
                        (None, _) => Some(Witness::of_points(receiver, 0.5 * radius, caster)),
                        _ => None,
                    };
                }
                this.progress.advance(1);
            }
        });
    }
}

/// Batches of the samples of a receiver's points.
fn batches(receiver: &Receiver) -> usize {
    if receiver.grid.is_some() { MAP_BATCHES } else { POINT_BATCHES }
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

/// The part of the light that may be still under way after the most bounces: more would take hours, and be wrong by more.
const MOST_ENDLESS: f64 = 0.02;

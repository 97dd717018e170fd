//! A job: a scene, what was chosen for its run, and where to keep its state. The front door of the library.

use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::dimming::sure::{Known, solve_surely};
use crate::dimming::verify::{Verified, named, verify};
use crate::dimming::{Goal, Influence, influence};
use crate::error::{Error, OptionError};
use crate::options::{Method, Options};
use crate::photon_map::Tree;
use crate::progress::Progress;
use crate::render::plan::Plan;
use crate::render::settings::LEAST_PASSES;
use crate::render::{Keeping, MOST_CELLS, Settings, Stop, Team, memory, recipe, render_in_bands};
use crate::results::met::sigmas;
use crate::results::{Results, Verdict};
use crate::scene::{Dimming, Levels, LoadOptions, Scene};
use crate::state::file::Recipe;

/// A scene to be computed, and how.
///
/// ```no_run
/// luxmap::Job::load("office.toml")?.error(0.5).run()?.write("out")?;
/// # Ok::<(), luxmap::Error>(())
/// ```
///
/// What is set here wins over `[render]` of the scene file, which wins over the defaults. The same scene and settings
/// give the same bits for the same seed, for any number of threads, unless a time limit ends the run.
#[derive(Clone)]
#[must_use = "a job does nothing until it is run"]
pub struct Job<'a> {
    /// Where the scene was read from; `None` for one made in memory.
    file: Option<(PathBuf, LoadOptions)>,
    scene: Scene,
    load_seconds: f64,
    options: Options,
    /// Whether the options hold no limit on purpose.
    endless: bool,
    least_passes: u32,
    planes: Vec<String>,
    cameras: Vec<String>,
    checkpoint: Option<PathBuf>,
    progress: &'a dyn Progress,
}

/// Levels that serve the targets of a scene's sensors.
#[derive(Clone, Debug)]
pub struct Dimmed {
    /// The levels, by luminaire.
    pub levels: Levels,
    /// What they draw, in [`Influence::power_unit`].
    pub power: f64,
    /// Sensors whose targets are not met with confidence.
    pub missed: Vec<String>,
    /// How many renders verified the levels; none where all luminaires are off.
    pub renders: u64,
    /// What the last of them found.
    pub results: Option<Results>,
    /// The matrix that the levels rest on.
    pub influence: Influence,
}

/// How a job is computed: what is left to do is to run it.
pub(crate) struct Planned<'a> {
    pub(crate) scene: Scene,
    pub(crate) plan: Plan,
    pub(crate) settings: Settings,
    /// Cells of a plane that are worked on at once.
    pub(crate) most_cells: usize,
    load_seconds: f64,
    threads: Option<u16>,
    checkpoint: Option<PathBuf>,
    progress: &'a dyn Progress,
}

impl<'a> Job<'a> {
    /// A job for the scene of a file; mistakes of the scene are found here.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::load_as(path.as_ref(), LoadOptions::default())
    }

    /// The same, with what may be said of a scene beside its file.
    ///
    /// # Errors
    /// As [`Scene::load_as`].
    pub fn load_as(path: &Path, options: LoadOptions) -> Result<Self, Error> {
        let started = Instant::now();
        let scene = Scene::load_as(path, &options)?;
        let load_seconds = started.elapsed().as_secs_f64();
        Ok(Self { file: Some((path.to_owned(), options)), load_seconds, ..Self::new(scene) })
    }

    /// A job for a scene made in memory, or read before.
    pub fn new(scene: Scene) -> Self {
        Self {
            file: None,
            scene,
            load_seconds: 0.0,
            options: Options::default(),
            endless: false,
            least_passes: 1,
            planes: Vec::new(),
            cameras: Vec::new(),
            checkpoint: None,
            progress: &(),
        }
    }

    /// How illuminance is computed.
    pub fn method(mut self, method: Method) -> Self {
        self.options.method = Some(method);
        self
    }

    /// Photons a pass.
    pub fn photons(mut self, photons: u64) -> Self {
        self.options.photons = Some(photons);
        self
    }

    /// Rays from each grid point a pass.
    pub fn rays(mut self, rays: u32) -> Self {
        self.options.rays = Some(rays);
        self
    }

    /// Stop at this standard error, % of the mean; as [`Stop::at_error`].
    pub fn error(mut self, percent: f64) -> Self {
        self.options.error = Some(percent);
        self
    }

    /// Stop after so many passes; at least one is run.
    pub fn passes(mut self, passes: u32) -> Self {
        self.options.passes = Some(NonZeroU32::new(passes).unwrap_or(NonZeroU32::MIN));
        self
    }

    /// Stop before this wall time is over, but for the first pass.
    pub fn time(mut self, time: Duration) -> Self {
        self.options.time = Some(time);
        self
    }

    /// When to stop, in place of what was said of error, passes and time before; also in place of the scene file's
    /// passes.
    pub fn stop(mut self, stop: Stop) -> Self {
        self.options.passes = stop.passes().and_then(NonZeroU32::new);
        self.options.error = stop.error();
        self.options.time = stop.time();
        self.endless = stop == Stop::when_interrupted();
        self
    }

    /// Seed of all random streams.
    pub fn seed(mut self, seed: u64) -> Self {
        self.options.seed = Some(seed);
        self
    }

    /// Which tree holds the photons.
    pub fn tree(mut self, tree: Tree) -> Self {
        self.options.tree = Some(tree);
        self
    }

    /// Whether light groups are told apart.
    pub fn groups(mut self, separate: bool) -> Self {
        self.options.groups = Some(separate);
        self
    }

    /// Threads; without a number, rayon's current pool is used.
    pub fn threads(mut self, threads: u16) -> Self {
        self.options.threads = Some(threads);
        self
    }

    /// Memory that may be taken, GB (10⁹ bytes).
    pub fn memory(mut self, gigabytes: f64) -> Self {
        self.options.memory = Some(gigabytes);
        self
    }

    /// All options at once: they win over what was set before.
    pub fn options(mut self, options: Options) -> Self {
        self.options = options.over(self.options);
        self
    }

    /// Keep the state after each pass in this file, and go on from it if it is there.
    pub fn checkpoint(mut self, path: impl Into<PathBuf>) -> Self {
        self.checkpoint = Some(path.into());
        self
    }

    /// Gets reports of how far the run has come, and may end it after the current pass.
    pub fn progress(mut self, progress: &'a dyn Progress) -> Self {
        self.progress = progress;
        self
    }

    /// Measure only these planes and surfaces, and see only by these cameras; all where both lists are empty.
    ///
    /// # Errors
    /// Where the scene has no such plane, surface or camera.
    pub fn only<S: AsRef<str>>(mut self, planes: &[S], cameras: &[S]) -> Result<Self, Error> {
        let owned = |names: &[S]| -> Vec<String> { names.iter().map(|name| name.as_ref().to_owned()).collect() };
        (self.planes, self.cameras) = (owned(planes), owned(cameras));
        choose(&mut self.scene, &self.planes, &self.cameras)?;
        Ok(self)
    }

    /// Luminaires at other levels than the scene has them. A scene file is read again; of a scene made in memory,
    /// luminaires that are off stay off.
    ///
    /// # Errors
    /// As [`Scene::load_as`]; where a level is given to a luminaire that the scene doesn't have.
    pub fn dimming(mut self, dimming: Dimming) -> Result<Self, Error> {
        match self.file.take() {
            None => self.scene = self.scene.dimmed(&dimming)?,
            Some((path, options)) if options.dimming == dimming => self.file = Some((path, options)),
            Some((path, options)) => {
                let mut read = Self::load_as(&path, LoadOptions { dimming, ..options })?;
                choose(&mut read.scene, &self.planes, &self.cameras)?;
                (self.file, self.scene, self.load_seconds) = (read.file, read.scene, read.load_seconds);
            }
        }
        Ok(self)
    }

    /// The scene, with what is left of it where not all is measured.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// What a run would do and leave out, and why.
    pub fn plan(&self) -> Plan {
        self.plan_for(&self.chosen())
    }

    /// Computes illuminance.
    ///
    /// # Errors
    /// Where an option makes no sense here, Embree can't be used, or a checkpoint is of another run.
    pub fn run(self) -> Result<Results, Error> {
        self.planned()?.alone()
    }

    /// Computes what each luminaire at full output brings to each sensor; and the results of the run that found it.
    ///
    /// # Errors
    /// As [`Job::run`]; also where the scene has no sensor.
    pub fn influence(self) -> Result<(Influence, Results), Error> {
        let (planned, groups) = self.for_influence()?;
        if planned.scene.sensors.is_empty() {
            return Err(no_sensor(&planned.scene));
        }
        let results = planned.alone()?;
        Ok((Influence::of(&planned.scene, groups, &results), results))
    }

    /// Finds levels that serve every sensor's target with so much confidence, %, from 50 to 99.9999; and verifies them
    /// by renders, six at most, each with a seed of its own.
    ///
    /// # Errors
    /// As [`Job::influence`]; also where no sensor has a target.
    pub fn dim(self, goal: Goal, confidence: f64) -> Result<Dimmed, Error> {
        if !(50.0..=99.9999).contains(&confidence) {
            let (found, expected) = (confidence.to_string(), "50 % to 99.9999 %".into());
            return Err(OptionError::Value { option: "confidence", found, expected }.into());
        }
        let (influence, _) = self.clone().influence()?;
        let asked = influence.sensors.iter().filter(|sensor| sensor.target.is_some()).count();
        let sigmas = sigmas(confidence / 100.0, asked);
        let mut known = Known::new(&influence);
        let first = solve_surely(&known, goal, sigmas)?;
        let progress = self.progress;
        let Verified { sure, renders, results } = verify(&mut known, goal, sigmas, first, &mut |levels, number| {
            let planned = self.clone().dimming(Dimming::Levels(levels))?.planned()?.seeded_later(number);
            Ok((planned.alone()?, !progress.interrupted()))
        })?;
        let verdicts = known.verdicts(&sure.answer.levels, sigmas);
        let missed = verdicts.iter().zip(&influence.sensors).filter(|(verdict, _)| match verdict {
            Some(Verdict::Missed) => true,
            Some(Verdict::Undecided { .. }) => goal == Goal::LeastPower,
            _ => false,
        });
        let missed = missed.map(|(_, sensor)| sensor.name.clone()).collect();
        let levels = named(&influence, &sure.answer.levels);
        Ok(Dimmed { levels, power: sure.answer.power, missed, renders, results, influence })
    }

    /// The options of all layers.
    fn chosen(&self) -> Options {
        let mut file = self.scene.render.clone();
        if self.endless {
            (file.passes, file.error, file.time) = (None, None, None);
        }
        self.options.clone().over(file)
    }

    fn plan_for(&self, options: &Options) -> Plan {
        let method = options.method.unwrap_or(Method::Gather);
        Plan::with_groups(&self.scene, method, options.groups.unwrap_or(false))
    }

    /// Settles how it is computed.
    ///
    /// # Errors
    /// Where an option makes no sense here, or there is too little memory.
    pub(crate) fn planned(self) -> Result<Planned<'a>, Error> {
        let options = self.chosen();
        options.check()?;
        let plan = self.plan_for(&options);
        let mut scene = self.scene;
        let mut settings = Settings { least_passes: self.least_passes, ..Settings::chosen(&options, &scene, &plan) };
        if self.endless {
            settings.stop = Stop::when_interrupted();
        }
        let asked = settings.photons;
        let most_cells = memory::fit(&scene, &plan, &mut settings, options.memory)?;
        if settings.photons < asked {
            scene.warnings.push(format!("`memory`: {} photons a pass instead of {asked}", settings.photons));
        }
        Ok(Planned {
            scene,
            plan,
            settings,
            most_cells,
            load_seconds: self.load_seconds,
            threads: options.threads,
            checkpoint: self.checkpoint,
            progress: self.progress,
        })
    }

    /// The same with every luminaire a light group of its own; and the groups they were in.
    pub(crate) fn in_groups_of_one(mut self) -> (Self, Vec<String>) {
        let groups = influence::tell_apart(&mut self.scene);
        (self.groups(true), groups)
    }

    /// The same with every luminaire at full output, too, for a matrix of influence.
    pub(crate) fn for_influence(mut self) -> Result<(Planned<'a>, Vec<String>), Error> {
        self = self.dimming(Dimming::Full)?;
        self.least_passes = LEAST_PASSES; // standard errors of sensors decide on levels
        let (job, groups) = self.in_groups_of_one();
        Ok((job.planned()?, groups))
    }

    /// Whether light groups are asked for, here or by the scene file.
    pub(crate) fn asks_for_groups(&self) -> bool {
        self.chosen().groups == Some(true)
    }

    /// What made a state of the scene in a file, to be run no further.
    pub(crate) fn of_recipe(
        path: &Path,
        options: LoadOptions,
        recipe: &Recipe,
        seed: u64,
        progress: &'a dyn Progress,
    ) -> Result<Planned<'a>, Error> {
        let job = Self::load_as(path, options)?;
        let mut scene = job.scene;
        keep_only(&mut scene, &recipe.planes, &recipe.cameras);
        let made = Options { seed: Some(seed), ..Options::of_recipe(recipe) };
        let plan = Plan::with_groups(&scene, made.method.unwrap_or(Method::Gather), recipe.groups);
        let settings = Settings { stop: Stop::when_interrupted(), ..Settings::chosen(&made, &scene, &plan) };
        Ok(Planned {
            scene,
            plan,
            settings,
            most_cells: MOST_CELLS,
            load_seconds: job.load_seconds,
            threads: None,
            checkpoint: None,
            progress,
        })
    }
}

impl<'a> Planned<'a> {
    /// The same with a later seed: by so many.
    pub(crate) fn seeded_later(mut self, by: u64) -> Self {
        self.settings.seed = self.settings.seed.wrapping_add(by);
        self
    }

    /// The same with so many threads.
    pub(crate) fn with_threads(self, threads: Option<u16>) -> Self {
        Self { threads, ..self }
    }

    /// What makes its state.
    pub(crate) fn recipe(&self) -> Recipe {
        recipe(&self.scene, &self.plan, &self.settings)
    }

    /// Computes it in this process.
    pub(crate) fn alone(&self) -> Result<Results, Error> {
        let results = self.run(&Keeping { checkpoint: self.checkpoint.as_deref(), ..Default::default() })?;
        Ok(results.expect("a run that is alone has results"))
    }

    /// Computes it with a team; `None` where another process has the results.
    pub(crate) fn shared(&self, team: &dyn Team) -> Result<Option<Results>, Error> {
        self.run(&Keeping { checkpoint: self.checkpoint.as_deref(), team, ..Default::default() })
    }

    /// Adds up states of other runs and keeps their sum, where a checkpoint is given.
    pub(crate) fn merged(&self, states: &[PathBuf], sum: Option<&Path>) -> Result<Option<Results>, Error> {
        self.run(&Keeping { checkpoint: sum, states, ..Default::default() })
    }

    fn run(&self, keeping: &Keeping<'_>) -> Result<Option<Results>, Error> {
        let Self { scene, plan, settings, most_cells, progress, .. } = self;
        let run = || render_in_bands(scene, plan, settings, *progress, keeping, *most_cells);
        let results = match self.threads {
            Some(threads) => pool(Some(threads))?.install(run),
            None => run(),
        }?;
        Ok(results.map(|mut results| {
            if self.progress.interrupted() {
                let passes = results.run.passes;
                results
                    .run
                    .warnings
                    .push(format!("interrupted after pass {passes}: the errors stated are those reached"));
            }
            results.run.seconds.insert(0, ("load scene", self.load_seconds));
            results.run.total_seconds += self.load_seconds;
            results
        }))
    }
}

/// So many threads; all where none is named.
pub(crate) fn pool(threads: Option<u16>) -> Result<rayon::ThreadPool, OptionError> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(usize::from(threads.unwrap_or(0)))
        .build()
        .map_err(|error| OptionError::Threads { why: error.to_string() })
}

/// A scene without the sensors that a matrix of influence is about.
pub(crate) fn no_sensor(scene: &Scene) -> Error {
    let file = scene.file.display();
    Error::Usage(format!("{file}: found no sensor, expected a [[sensor]] that luminaires influence"))
}

/// Keeps the planes and cameras asked for; all where none is named.
fn choose(scene: &mut Scene, planes: &[String], cameras: &[String]) -> Result<(), OptionError> {
    choose_planes(scene, planes)?;
    let known = || scene.cameras.iter().map(|camera| &camera.name);
    if let Some(found) = cameras.iter().find(|name| !known().any(|known| known == *name)) {
        return Err(OptionError::Camera { found: found.clone(), known: known().cloned().collect() });
    }
    if !planes.is_empty() || !cameras.is_empty() {
        keep_only(scene, planes, cameras);
    }
    Ok(())
}

/// Keeps the planes and surfaces asked for; all where none is named.
pub(crate) fn choose_planes(scene: &mut Scene, names: &[String]) -> Result<(), OptionError> {
    if names.is_empty() {
        return Ok(());
    }
    let planes = scene.planes.iter().map(|plane| &plane.name);
    let known: Vec<&String> = planes.chain(scene.surfaces.iter().map(|surface| &surface.name)).collect();
    if let Some(found) = names.iter().find(|name| !known.contains(name)) {
        return Err(OptionError::Plane { found: found.clone(), known: known.into_iter().cloned().collect() });
    }
    scene.planes.retain(|plane| names.contains(&plane.name));
    scene.surfaces.retain(|surface| names.contains(&surface.name));
    Ok(())
}

/// Leaves out planes, surfaces and cameras of other names.
fn keep_only(scene: &mut Scene, planes: &[String], cameras: &[String]) {
    scene.planes.retain(|plane| planes.contains(&plane.name));
    scene.surfaces.retain(|surface| planes.contains(&surface.name));
    scene.cameras.retain(|camera| cameras.contains(&camera.name));
}

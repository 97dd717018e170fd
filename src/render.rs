//! The main job: a scene in, illuminance of every measuring plane and sensor out.

use std::time::Instant;

use glam::DVec3;
use rayon::prelude::*;

use crate::embree::{RELATIVE_OFFSET, RayCaster};
use crate::error::Error;
use crate::gather::density::{Estimate, Search, local_linear, paper};
use crate::gather::direct::{DirectLight, direct_light};
use crate::gather::reach::Reach;
use crate::gather::receiver::{CrossingRecorder, Crossings, LandingRecorder, Photons, Receiver};
use crate::gather::surroundings::{FAN, Surroundings};
use crate::luminaire::Opening;
use crate::photon::flux::photometric;
use crate::photon::random::Seed;
use crate::photon::trace::{Tally, Tracer};
use crate::photon_map::{BruteForce, Kiddo, NearestPhotons, Paper, PhotonMap};
use crate::report::{FluxBalance, IlluminanceMap, Results, Run, SensorReading};
use crate::scene::plan::{Method, Plan};
use crate::scene::{MeasuringPlane, PlaneKind, Scene};
use crate::units::Lumens;

/// Which tree holds the photons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tree {
    /// kiddo's immutable kd-tree.
    Kiddo,
    /// The paper's tree.
    Paper,
    /// No tree: every photon is looked at.
    Brute,
}

impl Tree {
    /// Every tree, by name.
    pub const ALL: [(&'static str, Self); 3] = [("kiddo", Self::Kiddo), ("paper", Self::Paper), ("brute", Self::Brute)];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
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
    /// k; by method and number of photons where not given.
    pub nearest: Option<usize>,
    /// Largest search radius, m; a tenth of the scene's diagonal where not given.
    pub radius: Option<f64>,
    /// Independent photon maps, averaged.
    pub passes: u32,
    /// Which tree.
    pub tree: Tree,
    /// Seed of all random streams.
    pub seed: u64,
}

impl Settings {
    /// The settings of a method where the user chooses nothing.
    pub fn of(method: Method) -> Self {
        let photons = if method == Method::Seed { 30_000 } else { 1_000_000 };
        Self { photons, nearest: None, radius: None, passes: 1, tree: Tree::Kiddo, seed: 0 }
    }
}

/// Hears how far a run has come.
pub trait Progress: Sync {
    /// A stage of `steps` steps begins.
    fn stage(&self, name: &'static str, steps: u64);
    /// `steps` more are done.
    fn advance(&self, steps: u64);
}

/// Hears nothing.
impl Progress for () {
    fn stage(&self, _: &'static str, _: u64) {}
    fn advance(&self, _: u64) {}
}

/// Computes the illuminance of every measuring plane and sensor of a scene, on rayon's current thread pool. The same
/// settings give the same bits for any number of threads.
pub fn render(scene: &Scene, plan: &Plan, settings: &Settings, progress: &dyn Progress) -> Result<Results, Error> {
    match (plan.coloured, settings.tree) {
        (false, Tree::Kiddo) => Rendering::<1>::run::<Kiddo>(scene, plan, settings, progress),
        (false, Tree::Paper) => Rendering::<1>::run::<Paper>(scene, plan, settings, progress),
        (false, Tree::Brute) => Rendering::<1>::run::<BruteForce>(scene, plan, settings, progress),
        (true, Tree::Kiddo) => Rendering::<3>::run::<Kiddo>(scene, plan, settings, progress),
        (true, Tree::Paper) => Rendering::<3>::run::<Paper>(scene, plan, settings, progress),
        (true, Tree::Brute) => Rendering::<3>::run::<BruteForce>(scene, plan, settings, progress),
    }
}

/// Search limits of the two kinds of light; see [`Crossings`].
#[derive(Clone, Copy)]
struct Searches {
    sharp: Search,
    smooth: Search,
}

impl Searches {
    fn new(method: Method, settings: &Settings, diagonal: f64) -> Self {
        let radius = settings.radius.unwrap_or(0.1 * diagonal) as f32;
        let floor = (1e-4 * diagonal) as f32;
        // Variance falls as 1/k, squared bias grows as (k/N)²: the best k grows as N^(2/3).
        let growing = |at_a_million: f64| {
            let k = at_a_million * (settings.photons as f64 / 1e6).powf(2.0 / 3.0);
            settings.nearest.unwrap_or((k as usize).clamp(30, 5000))
        };
        let (sharp, smooth) = match method {
            Method::Seed => {
                let paper = settings.nearest.unwrap_or(100);
                (paper, paper)
            }
            Method::Split | Method::Photons => (growing(200.0), growing(1000.0)),
        };
        let search = |nearest| Search { nearest, radius, floor };
        Self { sharp: search(sharp), smooth: search(smooth) }
    }
}

/// One receiver with all that is known of it.
struct Place<const C: usize> {
    receiver: Receiver,
    /// Whether it is a measuring plane on a surface.
    on_surface: bool,
    has_value: Vec<bool>,
    surroundings: Vec<Surroundings>,
    direct: Option<DirectLight<C>>,
    /// Sum over the passes at each point, then their mean.
    photons: Vec<Estimate<C>>,
}

/// A run under way.
struct Rendering<'a, const C: usize> {
    scene: &'a Scene,
    plan: &'a Plan,
    settings: &'a Settings,
    progress: &'a dyn Progress,
    /// The scene's, m: walked once, since it takes all vertices.
    diagonal: f64,
    searches: Searches,
    seconds: Vec<(&'static str, f64)>,
    gather_rays: u64,
    photons_stored: u64,
    warnings: Vec<String>,
}

impl<'a, const C: usize> Rendering<'a, C> {
    fn run<T: NearestPhotons>(
        scene: &'a Scene,
        plan: &'a Plan,
        settings: &'a Settings,
        progress: &'a dyn Progress,
    ) -> Result<Results, Error> {
        let started = Instant::now();
        let diagonal = scene.diagonal();
        let mut rendering = Self {
            scene,
            plan,
            settings,
            progress,
            diagonal,
            searches: Searches::new(plan.method, settings, diagonal),
            seconds: Vec::new(),
            gather_rays: 0,
            photons_stored: 0,
            warnings: scene.warnings.clone(),
        };
        let caster =
            rendering.timed("build BVH", 1, |_| RayCaster::build(&scene.mesh, rayon::current_num_threads()))?;
        let (mut places, sensors) = rendering.places(&caster);
        if plan.shadow_rays {
            rendering.direct(&mut places, &caster);
        }
        let flux = if plan.photons { rendering.passes::<T>(&mut places, &caster) } else { Tally::default() };
        rendering.warn(&places, &flux);
        Ok(rendering.results(&places, &sensors, &flux, caster.peak_memory(), started))
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

    /// Every receiver: the planes in the scene's order, then the sensors' with the sensors each serves.
    fn places(&mut self, caster: &RayCaster) -> (Vec<Place<C>>, Vec<Vec<usize>>) {
        let scene = self.scene;
        let tolerance = (2e-4 * self.diagonal).min(2e-3) as f32;
        let radius = self.searches.smooth.radius;
        let steps = (scene.planes.len() + 1) as u64;
        self.timed("look around", steps, |this| {
            let reach = Reach::new(scene, caster, Seed(this.settings.seed).branch(PURPOSE_REACH));
            let mut sensors = Vec::new();
            let mut receivers: Vec<(Receiver, bool)> = scene
                .planes
                .iter()
                .map(|plane| (Receiver::of_plane(plane, caster, tolerance, radius), plane.kind == PlaneKind::Surface))
                .collect();
            for (receiver, served) in Receiver::of_sensors(scene, caster, tolerance, radius) {
                receivers.push((receiver, false));
                sensors.push(served);
            }
            let corrected = this.plan.photons && this.plan.method != Method::Seed;
            let places = receivers
                .into_iter()
                .map(|(receiver, on_surface)| {
                    let points = 0..receiver.len();
                    let look = |point| Surroundings::look(&receiver, point, caster, radius);
                    let surroundings =
                        if corrected { points.clone().into_par_iter().map(look).collect() } else { Vec::new() };
                    let has_value =
                        points.into_par_iter().map(|point| reach.light_can_arrive(&receiver, point)).collect();
                    this.gather_rays += (FAN * surroundings.len()) as u64;
                    this.progress.advance(1);
                    let photons = vec![Estimate::DARK; receiver.len()];
                    Place { receiver, on_surface, has_value, surroundings, direct: None, photons }
                })
                .collect();
            (places, sensors)
        })
    }

    fn direct(&mut self, places: &mut [Place<C>], caster: &RayCaster) {
        let steps = (places.len() * self.scene.luminaires.len()) as u64;
        self.timed("direct light", steps, |this| {
            for (index, place) in places.iter_mut().enumerate() {
                let seed = Seed(this.settings.seed).branch(PURPOSE_SHADOWS).branch(index as u64);
                let advance = |steps| this.progress.advance(steps);
                let light = direct_light(&this.scene.luminaires, &place.receiver, caster, seed, advance);
                this.gather_rays += light.rays;
                place.direct = Some(light);
            }
        });
    }

    /// Traces, builds and gathers each pass; returns the mean flux balance of a pass.
    fn passes<T: NearestPhotons>(&mut self, places: &mut [Place<C>], caster: &RayCaster) -> Tally<C> {
        let tracer = Tracer::new(self.scene, caster, self.settings.photons);
        let mut flux = Tally::default();
        for pass in 0..u64::from(self.settings.passes) {
            let (crossings, landings, tally) =
                self.timed("trace photons", self.settings.photons, |this| this.trace(&tracer, places, pass));
            flux.add(&tally);
            let stored = |photons: &Photons<C>| photons.positions.len() as u64;
            self.photons_stored +=
                stored(&landings) + crossings.iter().map(|c| stored(&c.sharp) + stored(&c.smooth)).sum::<u64>();
            let maps: Vec<[PhotonMap<T, C>; 2]> = self.timed("build trees", 1, |this| this.maps(crossings));
            let surfaces: PhotonMap<T, C> =
                self.timed("build trees", 1, |_| PhotonMap::build(landings.positions, landings.flux));
            let points = places.iter().map(|place| place.receiver.len() as u64).sum();
            self.timed("gather", points, |this| {
                for (place, maps) in places.iter_mut().zip(&maps) {
                    this.gather(place, maps, &surfaces);
                }
            });
        }
        let passes = f64::from(self.settings.passes);
        for place in places {
            for estimate in &mut place.photons {
                estimate.value = estimate.value.map(|value| value / passes);
                estimate.variance /= passes * passes;
            }
        }
        for part in [&mut flux.emitted, &mut flux.absorbed, &mut flux.escaped, &mut flux.cut_off] {
            *part = part.map(|channel| channel / passes);
        }
        flux
    }

    /// One pass of photons: what crossed each receiver and, for `seed`, what landed on surfaces.
    fn trace(
        &self,
        tracer: &Tracer<'_, C>,
        places: &[Place<C>],
        pass: u64,
    ) -> (Vec<Crossings<C>>, Photons<C>, Tally<C>) {
        let receivers: Vec<&Receiver> = places.iter().map(|place| &place.receiver).collect();
        let seed = Seed(self.settings.seed).branch(PURPOSE_PHOTONS);
        let advance = |photons| self.progress.advance(photons);
        if self.plan.method == Method::Seed {
            let record = || (CrossingRecorder::new(&receivers, true), LandingRecorder::new());
            let (records, tally) = tracer.trace(seed, pass, record, advance);
            let (crossings, landings) = records.into_iter().unzip();
            (CrossingRecorder::merge(crossings), LandingRecorder::merge(landings), tally)
        } else {
            let with_direct = self.plan.method == Method::Photons;
            let (records, tally) = tracer.trace(seed, pass, || CrossingRecorder::new(&receivers, with_direct), advance);
            (CrossingRecorder::merge(records), Photons::default(), tally)
        }
    }

    /// The photon maps of each receiver: sharp and smooth light apart; all in the first for `seed`, which knows no such
    /// difference.
    fn maps<T: NearestPhotons>(&self, crossings: Vec<Crossings<C>>) -> Vec<[PhotonMap<T, C>; 2]> {
        crossings
            .into_par_iter()
            .map(|Crossings { mut sharp, mut smooth }| {
                if self.plan.method == Method::Seed {
                    sharp.append(&mut smooth);
                }
                [PhotonMap::build(sharp.positions, sharp.flux), PhotonMap::build(smooth.positions, smooth.flux)]
            })
            .collect()
    }

    /// Adds one pass's estimate at every point of a receiver.
    fn gather<T: NearestPhotons>(
        &self,
        place: &mut Place<C>,
        [sharp, smooth]: &[PhotonMap<T, C>; 2],
        surfaces: &PhotonMap<T, C>,
    ) {
        let Place { receiver, on_surface, has_value, surroundings, photons, .. } = place;
        let Searches { sharp: near, smooth: wide } = self.searches;
        let fresh = || ((sharp.scratch(), Vec::new()), (smooth.scratch(), Vec::new()), surfaces.scratch());
        photons.par_iter_mut().enumerate().with_min_len(64).for_each_init(fresh, |scratch, (point, sum)| {
            if !has_value[point] {
                return;
            }
            let [u, v] = receiver.points[point];
            let mut add = |estimate: Estimate<C>| {
                for (sum, value) in sum.value.iter_mut().zip(estimate.value) {
                    *sum += value;
                }
                sum.variance += estimate.variance;
            };
            if self.plan.method != Method::Seed {
                add(local_linear(sharp, [u, v], near, &surroundings[point], &mut scratch.0));
                add(local_linear(smooth, [u, v], wide, &surroundings[point], &mut scratch.1));
            } else if *on_surface {
                add(paper(surfaces, receiver.position(point).to_array(), wide, &mut scratch.2));
            } else {
                add(paper(sharp, [u, v, 0.0], wide, &mut scratch.0.0));
            }
        });
        self.progress.advance(receiver.len() as u64);
    }

    /// Says what a user ought to know about this run.
    fn warn(&mut self, places: &[Place<C>], flux: &Tally<C>) {
        for (plane, place) in self.scene.planes.iter().zip(places) {
            let missed = |point: &usize| place.has_value[*point] && !place.receiver.is_on_surface(*point);
            let missed = (0..plane.len()).filter(missed).count();
            if plane.kind == PlaneKind::Surface && missed > 0 {
                self.warnings.push(format!(
                    "plane \"{}\": {missed} of {} points have no surface within {:.1} mm; expected on = \"air\" there",
                    plane.name,
                    plane.len(),
                    1e3 * place.receiver.tolerance,
                ));
            }
            if place.has_value.iter().all(|has_value| !has_value) {
                self.warnings.push(format!(
                    "plane \"{}\": no light can arrive at any point; along × across points to the measured side, and some \
                     luminaire has to shine into the same space",
                    plane.name
                ));
            }
            let unmet = |point: &usize| place.has_value[*point] && place.photons[*point] == Estimate::DARK;
            let unmet = (0..plane.len()).filter(unmet).count();
            if self.plan.photons && unmet > 0 {
                self.warnings.push(format!(
                    "plane \"{}\": {unmet} of {} points have no photon within {} m: that part of their light reads 0 ± 0; \
                     expected more photons or a larger radius",
                    plane.name,
                    plane.len(),
                    self.searches.smooth.radius,
                ));
            }
        }
        let (reach, detail) = (self.scene.half_extent(), self.scene.smallest_detail());
        let step = f64::from(RELATIVE_OFFSET) * reach;
        if step > 0.1 * detail {
            self.warnings.push(format!(
                "the scene reaches {reach:.3e} m from its middle, so rays start {step:.1e} m off surfaces; expected less than a \
                 tenth of the smallest opening or cell, {detail:.1e} m: is something far away, or a unit wrong?"
            ));
        }
        let cut_off = photometric(flux.cut_off) / photometric(flux.emitted).max(f64::MIN_POSITIVE);
        if cut_off > 0.0 {
            self.warnings.push(format!(
                "{:.3} % of the flux was still under way after {} bounces and was cut off: illuminance is too low",
                100.0 * cut_off,
                crate::photon::trace::BOUNCE_CAP,
            ));
        }
    }

    fn results(
        self,
        places: &[Place<C>],
        sensors: &[Vec<usize>],
        flux: &Tally<C>,
        bvh_memory: u64,
        started: Instant,
    ) -> Results {
        let scene = self.scene;
        let maps = scene.planes.iter().zip(places).map(|(plane, place)| self.map(plane, place)).collect();
        let mut readings: Vec<(usize, SensorReading)> = places[scene.planes.len()..]
            .iter()
            .zip(sensors)
            .flat_map(|(place, served)| served.iter().enumerate().map(move |(point, &sensor)| (sensor, place, point)))
            .map(|(sensor, place, point)| (sensor, self.reading(sensor, place, point)))
            .collect();
        readings.sort_by_key(|(sensor, _)| *sensor);
        let lumens = |channels| Lumens(photometric(channels));
        let run = Run {
            scene: scene.name.clone(),
            scene_hash: scene.hash.clone(),
            method: self.plan.method.name().into(),
            tree: self.settings.tree.name().into(),
            photons_emitted: if self.plan.photons {
                self.settings.photons * u64::from(self.settings.passes)
            } else {
                0
            },
            photons_stored: self.photons_stored,
            passes: self.settings.passes,
            nearest: self.searches.smooth.nearest,
            radius: f64::from(self.searches.smooth.radius),
            seed: self.settings.seed,
            threads: rayon::current_num_threads(),
            seconds: self.seconds.clone(),
            total_seconds: started.elapsed().as_secs_f64(),
            photon_rays: flux.rays,
            gather_rays: self.gather_rays,
            flux: FluxBalance {
                emitted: lumens(flux.emitted),
                absorbed: lumens(flux.absorbed),
                escaped: lumens(flux.escaped),
                cut_off: lumens(flux.cut_off),
            },
            peak_memory: peak_memory(),
            bvh_memory,
            triangles: scene.mesh.triangles.len(),
            luminaires: scene.luminaires.len(),
            warnings: self.warnings.clone(),
        };
        Results { run, maps, sensors: readings.into_iter().map(|(_, reading)| reading).collect() }
    }

    fn map(&self, plane: &MeasuringPlane, place: &Place<C>) -> IlluminanceMap {
        let cells: Vec<Cell<C>> = (0..plane.len()).map(|point| Cell::of(place, point)).collect();
        let origin = plane.corner + self.scene.centre;
        IlluminanceMap {
            name: plane.name.clone(),
            corner: origin,
            along: plane.along,
            across: plane.across,
            cells: plane.cells,
            illuminance: cells.iter().map(|cell| photometric(cell.value)).collect(),
            rgb: self.plan.coloured.then(|| cells.iter().map(|cell| cell.rgb()).collect()),
            direct: place.direct.is_some().then(|| cells.iter().map(|cell| photometric(cell.direct)).collect()),
            standard_error: cells.iter().map(|cell| cell.variance.sqrt()).collect(),
            has_value: place.has_value.clone(),
            outlines: outlines(self.scene, plane),
        }
    }

    fn reading(&self, sensor: usize, place: &Place<C>, point: usize) -> SensorReading {
        let cell = Cell::of(place, point);
        let sensor = &self.scene.sensors[sensor];
        SensorReading {
            name: sensor.name.clone(),
            position: sensor.position + self.scene.centre,
            normal: sensor.normal,
            illuminance: photometric(cell.value),
            rgb: self.plan.coloured.then(|| cell.rgb()),
            standard_error: cell.variance.sqrt(),
            target: sensor.target,
            has_value: place.has_value[point],
        }
    }
}

/// Purposes of random streams, so that none draws another's numbers.
const PURPOSE_PHOTONS: u64 = 1;
const PURPOSE_SHADOWS: u64 = 2;
const PURPOSE_REACH: u64 = 3;

/// Direct and photons' light of one point together.
struct Cell<const C: usize> {
    value: [f64; C],
    direct: [f64; C],
    variance: f64,
}

impl<const C: usize> Cell<C> {
    fn of(place: &Place<C>, point: usize) -> Self {
        if !place.has_value[point] {
            return Self { value: [0.0; C], direct: [0.0; C], variance: 0.0 };
        }
        let photons = place.photons[point];
        let (direct, spread) =
            place.direct.as_ref().map_or(([0.0; C], 0.0), |light| (light.value[point], light.variance[point]));
        let value = std::array::from_fn(|c| photons.value[c] + direct[c]);
        Self { value, direct, variance: photons.variance + spread }
    }

    fn rgb(&self) -> [f64; 3] {
        std::array::from_fn(|c| self.value[if C == 1 { 0 } else { c }])
    }
}

/// Outlines of the flat openings, in metres along and across the plane.
fn outlines(scene: &Scene, plane: &MeasuringPlane) -> Vec<Vec<[f64; 2]>> {
    let (along, across) = (plane.along.normalize(), plane.across.normalize());
    let flat = |corners: &[DVec3]| -> Vec<[f64; 2]> {
        corners
            .iter()
            .map(|&corner| [(corner - plane.corner).dot(along), (corner - plane.corner).dot(across)])
            .collect()
    };
    scene
        .luminaires
        .iter()
        .flat_map(|luminaire| match &luminaire.opening {
            Opening::Point { .. } => Vec::new(),
            Opening::Rectangle { centre, half_width: w, half_depth: d } => {
                vec![flat(&[*centre - *w - *d, *centre + *w - *d, *centre + *w + *d, *centre - *w + *d])]
            }
            Opening::Disc { centre, aim, radius } => {
                let (x, y) = aim.any_orthonormal_pair();
                let rim = |step: usize| {
                    let angle = std::f64::consts::TAU * step as f64 / 48.0;
                    *centre + (x * angle.cos() + y * angle.sin()) * *radius
                };
                vec![flat(&(0..48).map(rim).collect::<Vec<_>>())]
            }
            Opening::Triangles(triangles) => triangles.iter().map(|corners| flat(corners)).collect(),
        })
        .collect()
}

/// Peak memory of this process, bytes; 0 where the system doesn't say.
fn peak_memory() -> u64 {
    let kilobytes = |status: String| {
        let line = status.lines().find(|line| line.starts_with("VmHWM:"))?.to_owned();
        line.split_whitespace().nth(1)?.parse::<u64>().ok()
    };
    std::fs::read_to_string("/proc/self/status").ok().and_then(kilobytes).map_or(0, |kb| kb * 1024)
}

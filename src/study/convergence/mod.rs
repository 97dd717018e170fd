//! Error against run time: how far runs are from the truth, what they claim to be, and what they cost.
//!
//! A *ladder* of settings is rendered with several seeds, each run from scratch; [`Deviation`] compares a map with the
//! [`Reference`] of its plane. One run on one plane is a [`PlaneRun`], a setting's trials together are a [`Point`], and
//! points that differ in effort only make a [`EffortCurve`]. All errors are in % of the reference's mean.

mod page;
pub mod reference;
pub mod report;
pub mod verdict;
mod written;

use crate::error::Error;
use crate::photon_map::Tree;
use crate::progress::Progress;
use crate::render::plan::{Method, Plan};
use crate::render::{Settings, Stop, render};
use crate::results::{IlluminanceMap, Run};
use crate::scene::Scene;
pub use reference::Reference;
pub use written::write;

/// Written references have six significant digits: each value may be off by this part of itself.
const ROUNDING: f64 = 5e-6;

/// What a run is asked for: a rung of the ladder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rung {
    /// How illuminance is computed.
    pub method: Method,
    /// Photons a pass.
    pub photons: u64,
    /// k; the method's own choice where none is given.
    pub nearest: Option<usize>,
    /// Independent passes.
    pub passes: u32,
}

impl Rung {
    /// The settings this rung stands for.
    fn settings(&self, common: &CommonSettings, seed: u64) -> Settings {
        Settings {
            photons: self.photons,
            nearest: self.nearest,
            stop: Stop::after(self.passes),
            radius: common.radius,
            tree: common.tree,
            seed,
            ..Settings::of(self.method)
        }
    }
}

/// What all runs of a study share.
#[derive(Clone, Copy, Debug)]
pub struct CommonSettings {
    /// Largest search radius, m; a tenth of the scene's diagonal where not given.
    pub radius: Option<f64>,
    /// Which tree.
    pub tree: Tree,
    /// Seed of the first repeat; each further one takes the next.
    pub seed: u64,
    /// Runs of each rung.
    pub repeats: u32,
}

/// Passes by which methods that send rays climb, where the user names none.
const PASSES: [u32; 5] = [1, 2, 4, 8, 16];

/// Every combination of the lists, in the order of methods, k, passes, photons, efforts ascending; methods that send
/// rays climb by passes alone. Where nothing bounces in this scene, one rung of a method stands for all.
pub fn ladder(scene: &Scene, methods: &[Method], photons: &[u64], nearest: &[usize], passes: &[u32]) -> Vec<Rung> {
    let nearest: Vec<Option<usize>> =
        if nearest.is_empty() { vec![None] } else { ascending(nearest).into_iter().map(Some).collect() };
    let (photons, passes) = (ascending(photons), ascending(passes));
    let mut rungs: Vec<Rung> = Vec::new();
    for (index, &method) in methods.iter().enumerate() {
        if methods[..index].contains(&method) {
            continue;
        }
        let before = rungs.len();
        let plan = Plan::new(scene, method);
        if method.sends_rays() {
            // These climb by passes; how many photons one takes matters little.
            let photons = Settings::for_plan(&plan).photons;
            let passes = if passes[..] == [1] { PASSES.to_vec() } else { passes.clone() };
            rungs.extend(passes.into_iter().map(|passes| Rung { method, photons, nearest: None, passes }));
        } else {
            for &nearest in &nearest {
                for &passes in &passes {
                    rungs.extend(photons.iter().map(|&photons| Rung { method, photons, nearest, passes }));
                }
            }
        }
        if !plan.bounces {
            rungs.truncate(before + 1);
        }
    }
    rungs
}

/// Sorted, each once.
fn ascending<T: Copy + Ord>(values: &[T]) -> Vec<T> {
    let mut values = values.to_vec();
    values.sort_unstable();
    values.dedup();
    values
}

/// Wall time of one run by stage, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seconds {
    /// Photons through the scene.
    pub trace: f64,
    /// Trees of the photon maps.
    pub build: f64,
    /// Direct light by shadow rays.
    pub direct: f64,
    /// Illuminance from photons, or along rays from the points.
    pub gather: f64,
    /// Which points are places, and what surrounds them.
    pub look_around: f64,
    /// Embree's BVH and everything else.
    pub other: f64,
}

impl Seconds {
    /// Stages by name, in the order of [`Seconds::parts`].
    pub const NAMES: [&'static str; 6] = ["trace", "build", "direct", "gather", "look around", "other"];

    /// The times a run booked; stages without a name here, and time that no stage booked, are `other`.
    pub fn of(run: &Run) -> Self {
        let mut sum = Self::default();
        for &(name, seconds) in &run.seconds {
            match name {
                "trace photons" => sum.trace += seconds,
                "build trees" => sum.build += seconds,
                "direct light" => sum.direct += seconds,
                "gather" | "gather rays" => sum.gather += seconds,
                "look around" => sum.look_around += seconds,
                _ => {}
            }
        }
        sum.other = (run.total_seconds - sum.total()).max(0.0);
        sum
    }

    /// Each stage, as named by [`Seconds::NAMES`].
    pub fn parts(&self) -> [f64; 6] {
        [self.trace, self.build, self.direct, self.gather, self.look_around, self.other]
    }

    /// The whole run.
    pub fn total(&self) -> f64 {
        self.parts().iter().sum()
    }
}

/// How far a map is from a reference, over the cells that have a value in both. All but the counts are in %, errors of
/// the reference's mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Cells compared.
    pub cells: usize,
    /// Cells that have a value in one of the two only.
    pub unmatched: usize,
    /// Root of the mean square difference, the reference's own noise included.
    pub difference: f64,
    /// The reference's standard error, in quadratic mean.
    pub reference: f64,
    /// Mean difference.
    pub bias: f64,
    /// Largest difference, the reference's noise included.
    pub worst: f64,
    /// What the run claims: its σ in quadratic mean, in % of its own mean.
    pub claimed: f64,
    /// Cells whose difference is within σ, run's and reference's in quadrature; 68.3 % for honest normal errors.
    pub within_1_sigma: f64,
    /// The same for 2 σ; 95.4 %.
    pub within_2_sigma: f64,
}

impl Deviation {
    /// Compares cell by cell; `None` where no cell has a value in both, or the reference is dark. Cost: O(cells).
    ///
    /// # Panics
    /// Where the two differ in their number of cells.
    pub fn between(map: &IlluminanceMap, reference: &Reference) -> Option<Self> {
        assert_eq!(map.illuminance.len(), reference.illuminance.len(), "a map and a reference of different sizes");
        let mut unmatched = 0;
        let mut cells = Vec::new();
        for cell in 0..map.illuminance.len() {
            if map.has_value[cell] && reference.has_value[cell] {
                cells.push(cell);
            } else if map.has_value[cell] || reference.has_value[cell] {
                unmatched += 1;
            }
        }
        let mean = |of: &dyn Fn(usize) -> f64| cells.iter().map(|&cell| of(cell)).sum::<f64>() / cells.len() as f64;
        let truth = mean(&|cell| reference.illuminance[cell]);
        if cells.is_empty() || truth <= 0.0 {
            return None;
        }
        let found = mean(&|cell| map.illuminance[cell]);
        let off = |cell: usize| map.illuminance[cell] - reference.illuminance[cell];
        let within = |sigmas: f64| {
            100.0
                * mean(&|cell| {
                    let sigma = map.standard_error[cell].hypot(reference.standard_error[cell]);
                    let bound = sigmas * sigma + ROUNDING * reference.illuminance[cell].abs();
                    f64::from(u8::from(off(cell).abs() <= bound))
                })
        };
        let sigma = mean(&|cell| map.standard_error[cell].powi(2)).sqrt();
        Some(Self {
            cells: cells.len(),
            unmatched,
            difference: 100.0 * mean(&|cell| off(cell).powi(2)).sqrt() / truth,
            reference: 100.0 * mean(&|cell| reference.standard_error[cell].powi(2)).sqrt() / truth,
            bias: 100.0 * mean(&off) / truth,
            worst: 100.0 * cells.iter().map(|&cell| off(cell).abs()).fold(0.0, f64::max) / truth,
            claimed: if found > 0.0 { 100.0 * sigma / found } else { 0.0 },
            within_1_sigma: within(1.0),
            within_2_sigma: within(2.0),
        })
    }

    /// Root mean square error: the difference without the reference's noise, which is independent of the run's and so
    /// is subtracted in quadrature; 0 where the noise explains it all.
    pub fn rmse(&self) -> f64 {
        without(self.difference, self.reference)
    }
}

/// √(whole² − part²), 0 where part is larger.
fn without(whole: f64, part: f64) -> f64 {
    (whole.powi(2) - part.powi(2)).max(0.0).sqrt()
}

/// One run on one plane.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaneRun {
    /// Which plane, as counted in [`Study::planes`].
    pub plane: usize,
    /// What was asked for.
    pub rung: Rung,
    /// k as used.
    pub nearest: usize,
    /// Seed of this run.
    pub seed: u64,
    /// Wall time of the run, all planes together.
    pub seconds: Seconds,
    /// How wrong it is.
    pub errors: Deviation,
}

/// A rung on a plane, its trials together.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Which plane, as counted in [`Study::planes`].
    pub plane: usize,
    /// What was asked for.
    pub rung: Rung,
    /// k as used.
    pub nearest: usize,
    /// Times of the trial whose total is the (lower) median.
    pub seconds: Seconds,
    /// RMSE over all trials, %, the reference's noise subtracted in quadrature.
    pub rmse: f64,
    /// Mean bias, %.
    pub bias: f64,
    /// Standard error of that mean, from the scatter of the trials; none for a single trial.
    pub bias_error: Option<f64>,
    /// Worst cell of all trials, %.
    pub worst: f64,
    /// Claimed error, quadratic mean of the trials, %.
    pub claimed: f64,
    /// Cells within 1 σ, mean of the trials, %.
    pub within_1_sigma: f64,
    /// Cells within 2 σ, mean of the trials, %.
    pub within_2_sigma: f64,
    /// The reference's own standard error, %.
    pub reference: f64,
}

impl Point {
    /// `trials` of one rung on one plane, at least one.
    fn of(trials: &[&PlaneRun]) -> Self {
        let (first, count) = (trials[0], trials.len() as f64);
        let mean = |of: &dyn Fn(&Deviation) -> f64| trials.iter().map(|trial| of(&trial.errors)).sum::<f64>() / count;
        let quadratic = |of: &dyn Fn(&Deviation) -> f64| mean(&|errors| of(errors).powi(2)).sqrt();
        let bias = mean(&|errors| errors.bias);
        let scatter = trials.iter().map(|trial| (trial.errors.bias - bias).powi(2)).sum::<f64>();
        let reference = quadratic(&|errors| errors.reference);
        let mut times: Vec<Seconds> = trials.iter().map(|trial| trial.seconds).collect();
        times.sort_by(|a, b| a.total().total_cmp(&b.total()));
        Self {
            plane: first.plane,
            rung: first.rung,
            nearest: first.nearest,
            seconds: times[(times.len() - 1) / 2],
            rmse: without(quadratic(&|errors| errors.difference), reference),
            bias,
            bias_error: (trials.len() > 1).then(|| (scatter / (count - 1.0) / count).sqrt()),
            worst: trials.iter().map(|trial| trial.errors.worst).fold(0.0, f64::max),
            claimed: quadratic(&|errors| errors.claimed),
            within_1_sigma: mean(&|errors| errors.within_1_sigma),
            within_2_sigma: mean(&|errors| errors.within_2_sigma),
            reference,
        }
    }

    /// Whether the reference is good enough to tell this error: at least half the reference's own.
    pub fn is_resolved(&self) -> bool {
        self.rmse > 0.0 && self.rmse >= 0.5 * self.reference
    }

    /// True error over claimed error: 1 for an honest claim, more where it promises too much; `None` where there is no
    /// claim or the reference can't tell.
    pub fn true_over_claimed(&self) -> Option<f64> {
        (self.claimed > 0.0 && self.is_resolved()).then(|| self.rmse / self.claimed)
    }
}

/// Points of one method on one plane that differ in effort only, cheapest first.
#[derive(Clone, Debug)]
pub struct EffortCurve<'a> {
    /// Their method.
    pub method: Method,
    /// The method, and what tells this curve from others of it.
    pub label: String,
    /// At least one.
    pub points: Vec<&'a Point>,
}

/// What varies along the curves of a method.
#[derive(Clone, Copy, PartialEq)]
enum Effort {
    Photons,
    Passes,
    Nearest,
}

impl Effort {
    /// Photons if they vary, else passes, else k.
    fn of(points: &[&Point]) -> Self {
        let first = points[0].rung;
        match points {
            _ if points.iter().any(|point| point.rung.photons != first.photons) => Self::Photons,
            _ if points.iter().any(|point| point.rung.passes != first.passes) => Self::Passes,
            _ => Self::Nearest,
        }
    }
}

/// The curves of one plane, methods in the order of their first point.
pub fn curves(points: &[Point], plane: usize) -> Vec<EffortCurve<'_>> {
    let mut methods: Vec<Method> = Vec::new();
    for point in points.iter().filter(|point| point.plane == plane) {
        if !methods.contains(&point.rung.method) {
            methods.push(point.rung.method);
        }
    }
    methods.into_iter().flat_map(|method| curves_of(points, plane, method)).collect()
}

fn curves_of(points: &[Point], plane: usize, method: Method) -> Vec<EffortCurve<'_>> {
    let points: Vec<&Point> =
        points.iter().filter(|point| point.plane == plane && point.rung.method == method).collect();
    let effort = Effort::of(&points);
    let key = |rung: Rung| match effort {
        Effort::Photons => (rung.nearest, rung.passes),
        Effort::Passes => (rung.nearest, 0),
        Effort::Nearest => (None, 0),
    };
    let mut curves: Vec<EffortCurve<'_>> = Vec::new();
    for &point in &points {
        match curves.iter_mut().find(|curve| key(curve.points[0].rung) == key(point.rung)) {
            Some(curve) => curve.points.push(point),
            None => curves.push(EffortCurve { method, label: String::new(), points: vec![point] }),
        }
    }
    let differ = |of: &dyn Fn(Rung) -> u64| curves.iter().any(|c| of(c.points[0].rung) != of(points[0].rung));
    let by_nearest = differ(&|rung| rung.nearest.unwrap_or(0) as u64);
    let by_passes = differ(&|rung| u64::from(rung.passes));
    for curve in &mut curves {
        let rung = curve.points[0].rung;
        curve.label = method.name().to_owned();
        if let Some(nearest) = rung.nearest.filter(|_| by_nearest) {
            curve.label += &format!(", k {nearest}");
        }
        if by_passes {
            curve.label += &format!(", {} ×", rung.passes);
        }
    }
    curves
}

/// A measuring plane of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct StudiedPlane {
    /// Its name.
    pub name: String,
    /// Columns and rows.
    pub cells: [usize; 2],
    /// Whence its reference.
    pub reference: String,
}

/// Everything that was measured.
#[derive(Clone, Debug)]
pub struct Study {
    /// Name of the scene.
    pub scene: String,
    /// SHA-256 of the scene and its files.
    pub scene_hash: String,
    /// Threads used.
    pub threads: usize,
    /// Runs of each rung.
    pub repeats: u32,
    /// Planes, in the scene's order.
    pub planes: Vec<StudiedPlane>,
    /// One for each run and plane, in the order they ran.
    pub trials: Vec<PlaneRun>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

impl Study {
    /// Renders every rung of `ladder` with every seed, on rayon's current thread pool, and compares each plane with its
    /// reference (one for each plane, in order). All rungs take turns with one seed before the next seed begins, so
    /// that a slow spell of the machine hits all of them; a first run is not counted. `progress` gets one step a run.
    ///
    /// # Errors
    /// What [`render()`] says; [`Error::Usage`] where a plane and its reference have no lit cell in common.
    pub fn measure(
        scene: &Scene,
        references: &[Reference],
        ladder: &[Rung],
        common: &CommonSettings,
        progress: &dyn Progress,
    ) -> Result<Self, Error> {
        progress.stage("runs", ladder.len() as u64 * u64::from(common.repeats));
        let run =
            |rung: &Rung, seed: u64| render(scene, &Plan::new(scene, rung.method), &rung.settings(common, seed), &());
        if let Some(first) = ladder.first() {
            run(first, common.seed)?; // memory and threads are new to the process
        }
        let mut trials: Vec<PlaneRun> = Vec::new();
        for repeat in 0..common.repeats {
            let seed = common.seed.wrapping_add(u64::from(repeat));
            for rung in ladder {
                let results = run(rung, seed)?;
                for (plane, (map, reference)) in results.maps.iter().zip(references).enumerate() {
                    let errors = Deviation::between(map, reference).ok_or_else(|| nothing_in_common(map, reference))?;
                    let (nearest, seconds) = (results.run.nearest, Seconds::of(&results.run));
                    trials.push(PlaneRun { plane, rung: *rung, nearest, seed, seconds, errors });
                }
                progress.advance(1);
            }
        }
        let planes = scene.planes.iter().zip(references).map(|(plane, reference)| StudiedPlane {
            name: plane.name.clone(),
            cells: plane.cells,
            reference: reference.source.clone(),
        });
        let mut study = Self {
            scene: scene.name.clone(),
            scene_hash: scene.hash.clone(),
            threads: rayon::current_num_threads(),
            repeats: common.repeats,
            planes: planes.collect(),
            trials,
            warnings: scene.warnings.clone(),
        };
        study.warn();
        Ok(study)
    }

    fn warn(&mut self) {
        for (index, plane) in self.planes.iter().enumerate() {
            let unmatched =
                self.trials.iter().filter(|trial| trial.plane == index).map(|trial| trial.errors.unmatched).max();
            if let Some(cells @ 1..) = unmatched {
                self.warnings.push(format!(
                    "plane \"{}\": {cells} of {} cells have a value in the run or in the reference only, and don't count",
                    plane.name,
                    plane.cells[0] * plane.cells[1],
                ));
            }
        }
    }

    /// Each rung on each plane, planes first.
    pub fn points(&self) -> Vec<Point> {
        let mut groups: Vec<Vec<&PlaneRun>> = Vec::new();
        for trial in &self.trials {
            match groups.iter_mut().find(|group| (group[0].plane, group[0].rung) == (trial.plane, trial.rung)) {
                Some(group) => group.push(trial),
                None => groups.push(vec![trial]),
            }
        }
        let mut points: Vec<Point> = groups.iter().map(|group| Point::of(group)).collect();
        points.sort_by_key(|point| point.plane); // stable: rungs keep their order
        points
    }
}

fn nothing_in_common(map: &IlluminanceMap, reference: &Reference) -> Error {
    Error::Usage(format!(
        "plane \"{}\": found no lit cell that both the run and the reference ({}) have a value at, expected some",
        map.name, reference.source
    ))
}

#[cfg(test)]
mod tests;

//! Stiff and extreme cases: each with its exact answer, and whether what luxmap finds is right, and as sure as it says.
//!
//! A [`Case`] is a scene as text, read as any scene is, and what is expected of it: values in closed form ([`forms`]),
//! the same as of another scene, a refusal, or a warning. [`Case::run`] makes a [`CaseResult`] of it, with a verdict.
//!
//! A row is inside its bound where
//! - every value and every claimed error is a finite number,
//! - what was found is within 4 σ of what is exact, σ being what the run itself claims (more where the worst of many
//!   cells is looked at: √(16 + 2 ln n) of n, which as rarely fails), or within the rounding that the case allows,
//! - the claim is of use: σ is no more than the case's bound on it,
//! - the books on flux close: |emitted − absorbed − escaped − cut off| ≤ 10⁻⁶ of what was emitted,
//! - closed rooms lose no more light than 5·10⁻⁸ a ray (and the noise of counting that);
//!
//! or where the run is refused, or warns, in words and with a number, as the case expects.

mod cases;
pub mod document;
pub mod forms;
pub mod scenes;

use std::path::Path;
use std::time::Instant;

use crate::error::Error;
use crate::render::plan::{Method, Plan};
use crate::render::{MOST_CELLS, Settings, Stop, render_in_bands};
use crate::results::{IlluminanceMap, Results};
pub use cases::cases;
pub use scenes::SceneText;

/// Standard errors that a found value may lie off.
const SIGMAS: f64 = 4.0;
/// Part of the emitted flux that the books may miss.
const BALANCE: f64 = 1e-6;
/// Light that a ray may lose through what is closed: measured 5·10⁻⁸ at corners and edges.
const LEAK: f64 = 5e-8;

/// One thing to be tried.
#[derive(Clone)]
pub struct Case {
    /// What it belongs to.
    pub group: &'static str,
    /// Its name, which no other case of its group has.
    pub name: String,
    /// What makes it hard.
    pub why: &'static str,
    /// Whether it takes a moment only.
    pub quick: bool,
    job: CaseRun,
}

#[derive(Clone)]
enum CaseRun {
    Run(Box<Setup>),
    /// Whatever else; it gets a folder of its own.
    Own(fn(&Path) -> Result<CaseResult, Error>),
}

/// A scene, how it is computed and what is expected.
#[derive(Clone)]
struct Setup {
    scene: SceneText,
    method: Method,
    photons: Option<u64>,
    rays: Option<u32>,
    nearest: Option<usize>,
    expected: Vec<Expected>,
    /// Another scene and what its values are to be multiplied by: what is exact is what is found there.
    twin: Option<(SceneText, f64)>,
    /// Largest σ that is of use, as part of what is exact.
    useful: f64,
    /// Most that found may be off, as part of what is exact, whatever is claimed.
    within: f64,
    /// Whether no light can get out.
    closed: bool,
    refusal: Option<&'static str>,
    warning: Option<&'static str>,
    /// What may be said instead of being right.
    excuse: Option<&'static str>,
}

/// A reading, and what it should be.
#[derive(Clone)]
struct Expected {
    reading: Measurand,
    /// `None`: no value at all.
    exact: Option<f64>,
    /// Relative where `exact` is above 0, else in the reading's unit.
    tolerance: f64,
}

/// What is read off a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measurand {
    /// Mean of a plane, lx.
    Mean(&'static str),
    /// Mean of one channel of a plane, lx.
    Channel(&'static str, usize),
    /// The cell of a plane that is the farthest off, in its own σ, lx.
    Worst(&'static str),
    /// A sensor, lx.
    Sensor(&'static str),
    /// Area mean of all planes, lx.
    AllPlanes,
    /// Σ E A of a plane, lm.
    Flux(&'static str),
    /// Cells of a plane with a value, as a part of all.
    Valued(&'static str),
    /// Flux cut off, as a part of what was emitted.
    CutOff,
    /// Flux that escaped, as a part of what was emitted.
    Escaped,
}

/// What came of a case.
#[derive(Clone, Debug)]
pub struct CaseResult {
    /// The case's group.
    pub group: &'static str,
    /// The case's name.
    pub name: String,
    /// What makes it hard.
    pub why: &'static str,
    /// How it was computed.
    pub method: String,
    /// The reading that is the farthest off its bound.
    pub reading: String,
    /// What is exact, in the reading's unit; `None` where nothing should have a value.
    pub exact: Option<f64>,
    /// What was found.
    pub found: Option<f64>,
    /// Standard error as claimed.
    pub claimed: Option<f64>,
    /// How far off it may be.
    pub allowed: Option<f64>,
    /// What the books on flux miss, as a part of what was emitted; `None` without photons.
    pub balance: Option<f64>,
    /// Photons that got out, as a part of all.
    pub escapes: Option<f64>,
    /// Flux cut off at the cap on bounces, as a part of what was emitted.
    pub cut_off: Option<f64>,
    /// Wall time, s.
    pub seconds: f64,
    /// What the run said.
    pub warnings: Vec<String>,
    /// What to make of it.
    pub verdict: CaseVerdict,
}

/// What to make of a row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CaseVerdict {
    /// Right, and as sure as it says.
    Inside,
    /// The run said in words, with a number, why it can't be trusted; this is what it said.
    Warned(String),
    /// The run was refused; this is what was said.
    Refused(String),
    /// Wrong, or surer than it should be; this is why.
    Outside(String),
}

impl CaseVerdict {
    /// Its word.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Inside => "inside",
            Self::Warned(_) => "warned",
            Self::Refused(_) => "refused",
            Self::Outside(_) => "OUTSIDE",
        }
    }

    /// Why, where there is something to say.
    pub fn reason(&self) -> &str {
        match self {
            Self::Inside => "",
            Self::Warned(why) | Self::Refused(why) | Self::Outside(why) => why,
        }
    }

    /// Whether something is wrong.
    pub fn is_outside(&self) -> bool {
        matches!(self, Self::Outside(_))
    }
}

impl CaseResult {
    /// |found − exact|, in the reading's unit.
    pub fn off(&self) -> Option<f64> {
        Some((self.found? - self.exact?).abs())
    }

    /// The same in claimed standard errors; `None` where none is claimed.
    pub fn ratio(&self) -> Option<f64> {
        let claimed = self.claimed.filter(|sigma| *sigma > 0.0)?;
        Some(self.off()? / claimed)
    }

    fn blank(case: &Case) -> Self {
        Self {
            group: case.group,
            name: case.name.clone(),
            why: case.why,
            method: String::new(),
            reading: String::new(),
            exact: None,
            found: None,
            claimed: None,
            allowed: None,
            balance: None,
            escapes: None,
            cut_off: None,
            seconds: 0.0,
            warnings: Vec::new(),
            verdict: CaseVerdict::Inside,
        }
    }
}

impl Case {
    /// A case with nothing expected yet: method `gather` and its defaults.
    fn new(group: &'static str, name: impl Into<String>, why: &'static str, scene: SceneText) -> Self {
        let trial = Setup {
            scene,
            method: Method::Gather,
            photons: None,
            rays: None,
            nearest: None,
            expected: Vec::new(),
            twin: None,
            useful: 0.05,
            within: f64::INFINITY,
            closed: false,
            refusal: None,
            warning: None,
            excuse: None,
        };
        Self { group, name: name.into(), why, quick: false, job: CaseRun::Run(Box::new(trial)) }
    }

    /// A case that is no run of a scene.
    fn own(group: &'static str, name: &str, why: &'static str, job: fn(&Path) -> Result<CaseResult, Error>) -> Self {
        Self { group, name: name.into(), why, quick: false, job: CaseRun::Own(job) }
    }

    fn with(mut self, change: impl FnOnce(&mut Setup)) -> Self {
        if let CaseRun::Run(trial) = &mut self.job {
            change(trial);
        }
        self
    }

    fn method(self, method: Method) -> Self {
        self.with(|trial| trial.method = method)
    }

    fn photons(self, photons: u64) -> Self {
        self.with(|trial| trial.photons = Some(photons))
    }

    fn rays(self, rays: u32) -> Self {
        self.with(|trial| trial.rays = Some(rays))
    }

    fn nearest(self, nearest: usize) -> Self {
        self.with(|trial| trial.nearest = Some(nearest))
    }

    /// Expects `reading` to be `exact`, up to the claimed error or a relative `tolerance`, whichever is more.
    fn expects(self, reading: Measurand, exact: f64, tolerance: f64) -> Self {
        self.with(|trial| trial.expected.push(Expected { reading, exact: Some(exact), tolerance }))
    }

    /// Expects no value, as no light can arrive.
    fn expects_none(self, reading: Measurand) -> Self {
        self.with(|trial| trial.expected.push(Expected { reading, exact: None, tolerance: 0.0 }))
    }

    /// Expects what is found in another scene, times a factor.
    fn expects_as(self, reading: Measurand, scene: SceneText, factor: f64, tolerance: f64) -> Self {
        let case = self.expects(reading, 0.0, tolerance);
        case.with(|trial| trial.twin = Some((scene, factor)))
    }

    /// Largest claimed σ that is of use, as a part of what is exact.
    fn useful(self, part: f64) -> Self {
        self.with(|trial| trial.useful = part)
    }

    /// The most that found may be off, as a part of what is exact, whatever is claimed: cells claim more than their
    /// mean is off.
    fn within(self, part: f64) -> Self {
        self.with(|trial| trial.within = part)
    }

    fn closed(self) -> Self {
        self.with(|trial| trial.closed = true)
    }

    /// Expects to be refused in these words.
    fn refused(self, words: &'static str) -> Self {
        self.with(|trial| trial.refusal = Some(words))
    }

    /// Expects a warning with these words and a number, whatever is found.
    fn warned(self, words: &'static str) -> Self {
        self.with(|trial| trial.warning = Some(words))
    }

    /// Where it is not right, a warning with these words and a number says so.
    fn excused(self, words: &'static str) -> Self {
        self.with(|trial| trial.excuse = Some(words))
    }

    fn quick(mut self) -> Self {
        self.quick = true;
        self
    }

    /// Group and name.
    pub fn title(&self) -> String {
        format!("{}: {}", self.group, self.name)
    }

    /// Runs it on rayon's current thread pool, with files in `folder`.
    pub fn run(&self, folder: &Path) -> CaseResult {
        let started = Instant::now();
        let blank = CaseResult::blank(self);
        let found = match &self.job {
            CaseRun::Run(trial) => trial.run(folder, blank.clone()),
            CaseRun::Own(job) => {
                job(folder).map(|row| CaseResult { group: self.group, name: self.name.clone(), why: self.why, ..row })
            }
        };
        let mut row =
            found.unwrap_or_else(|error| CaseResult { verdict: CaseVerdict::Outside(error.to_string()), ..blank });
        row.seconds = started.elapsed().as_secs_f64();
        row
    }
}

impl Setup {
    fn run(&self, folder: &Path, mut row: CaseResult) -> Result<CaseResult, Error> {
        row.method = self.method.name().into();
        let results = match (self.results(&self.scene, folder), self.refusal) {
            (Err(error), Some(words)) if error.to_string().contains(words) => {
                // Where the scene was written is no part of what was said.
                let sentence = error.to_string().replace(&format!("{}/", folder.display()), "");
                row.verdict = CaseVerdict::Refused(sentence);
                return Ok(row);
            }
            (Err(error), _) => return Err(error),
            (Ok(_), Some(words)) => {
                row.verdict = CaseVerdict::Outside(format!("expected to be refused: \"{words}\""));
                return Ok(row);
            }
            (Ok(results), None) => results,
        };
        let twin = match &self.twin {
            Some((scene, factor)) => Some((self.results(scene, folder)?, *factor)),
            None => None,
        };
        let run = &results.run;
        row.warnings.clone_from(&run.warnings);
        row.method = match (run.photons_emitted, run.passes) {
            (0, _) => self.method.name().into(),
            (photons, 1) => format!("{}, {photons} photons", self.method.name()),
            (photons, passes) => format!("{}, {photons} photons in {passes} passes", self.method.name()),
        };
        let mut faults = self.books(&results, &mut row);
        faults.extend(not_finite(&results));
        self.compare(&results, twin.as_ref(), &mut row, &mut faults);
        let said = |words: &str| {
            let holds = |warning: &&String| warning.contains(words) && warning.contains(|c: char| c.is_ascii_digit());
            run.warnings.iter().find(holds).cloned()
        };
        row.verdict = match (self.warning, self.excuse) {
            (Some(words), _) => match (said(words), faults.is_empty()) {
                (Some(warning), true) => CaseVerdict::Warned(warning),
                (None, _) => CaseVerdict::Outside(format!("expected a warning: \"{words}\"; {}", faults.join("; "))),
                (_, false) => CaseVerdict::Outside(faults.join("; ")),
            },
            (None, _) if faults.is_empty() => CaseVerdict::Inside,
            (None, Some(words)) => match said(words) {
                Some(warning) => CaseVerdict::Warned(warning),
                None => CaseVerdict::Outside(faults.join("; ")),
            },
            (None, None) => CaseVerdict::Outside(faults.join("; ")),
        };
        Ok(row)
    }

    fn results(&self, scene: &SceneText, folder: &Path) -> Result<Results, Error> {
        let scene = scene.load(folder)?;
        let plan = Plan::new(&scene, self.method);
        let defaults = Settings::for_plan(&plan);
        let settings = Settings {
            photons: self.photons.unwrap_or(defaults.photons),
            rays: self.rays.unwrap_or(defaults.rays),
            nearest: self.nearest,
            stop: Stop::after(1),
            seed: 1,
            ..defaults
        };
        let results = render_in_bands(&scene, &plan, &settings, &(), &Default::default(), MOST_CELLS)?;
        Ok(results.expect("a run that is alone has results"))
    }

    /// Where the flux went; says what is wrong with that.
    fn books(&self, results: &Results, row: &mut CaseResult) -> Vec<String> {
        let (run, flux) = (&results.run, &results.run.flux);
        let mut faults = Vec::new();
        if run.photons_emitted == 0 {
            return faults;
        }
        let emitted = flux.emitted.0;
        let missed = (emitted - flux.absorbed.0 - flux.escaped.0 - flux.cut_off.0).abs() / emitted;
        let escapes = flux.escaped.0 / emitted;
        (row.balance, row.escapes, row.cut_off) = (Some(missed), Some(escapes), Some(flux.cut_off.0 / emitted));
        if missed.is_nan() || missed > BALANCE {
            faults.push(format!("flux balance misses {missed:.1e} of the emitted flux"));
        }
        let may = LEAK * run.photon_rays as f64;
        let count = escapes * run.photons_emitted as f64;
        if self.closed && count > may + SIGMAS * may.sqrt() + 1.0 {
            faults.push(format!("{count:.1} photons escaped a closed room in {} rays", run.photon_rays));
        }
        faults
    }

    /// How far off a value may be.
    fn allowed(&self, found: &ReadValue, doubt: f64, margin: f64, exact: f64) -> f64 {
        let sigmas = (SIGMAS * SIGMAS + 2.0 * (found.of as f64).ln()).sqrt();
        (sigmas * found.sigma.hypot(doubt)).min(self.within * exact.abs()).max(margin)
    }

    /// Compares every reading with what it should be; the row shows that which is the worst.
    fn compare(
        &self,
        results: &Results,
        twin: Option<&(Results, f64)>,
        row: &mut CaseResult,
        faults: &mut Vec<String>,
    ) {
        let mut worst = f64::NEG_INFINITY;
        for expected in &self.expected {
            let reference = twin.and_then(|(twin, factor)| {
                let read = read(twin, expected.reading, None, 0.0)?;
                Some((read.found * factor, read.sigma * factor))
            });
            let (exact, doubt) = match reference {
                Some((found, sigma)) => (Some(found), sigma),
                None => (expected.exact, 0.0),
            };
            let margin = expected.tolerance * exact.map_or(1.0, |exact| if exact != 0.0 { exact.abs() } else { 1.0 });
            let name = expected.reading.in_words();
            let found = read(results, expected.reading, exact, margin);
            let (badness, fault) = match (&exact, &found) {
                (None, None) => (0.0, None),
                (None, Some(found)) => (f64::MAX, Some(format!("{name}: found {}, expected no value", found.found))),
                (Some(exact), None) => (f64::MAX, Some(format!("{name}: found no value, expected {exact}"))),
                (Some(exact), Some(found)) => {
                    let sigma = found.sigma.hypot(doubt);
                    let allowed = self.allowed(found, doubt, margin, *exact);
                    let off = (found.found - exact).abs();
                    let fault = if off.is_nan() || off > allowed {
                        Some(format!("{name}: off by {off:.3e}, allowed {allowed:.3e}"))
                    } else if sigma > (self.useful * exact.abs()).max(margin) {
                        Some(format!("{name}: σ = {sigma:.3e} is too large to be of use"))
                    } else {
                        None
                    };
                    (if off == 0.0 { 0.0 } else { off / allowed }, fault)
                }
            };
            faults.extend(fault);
            if badness > worst {
                worst = badness;
                row.reading = name;
                row.exact = exact;
                row.found = found.as_ref().map(|found| found.found);
                row.claimed = found.as_ref().map(|found| found.sigma.hypot(doubt));
                row.allowed = found.as_ref().zip(exact).map(|(found, exact)| self.allowed(found, doubt, margin, exact));
            }
        }
    }
}

impl Measurand {
    fn in_words(self) -> String {
        match self {
            Self::Mean(plane) => format!("mean of {plane}, lx"),
            Self::Channel(plane, channel) => format!("{} of {plane}, lx", ["red", "green", "blue"][channel]),
            Self::Worst(plane) => format!("worst cell of {plane}, lx"),
            Self::Sensor(name) => format!("{name}, lx"),
            Self::AllPlanes => "mean of all faces, lx".into(),
            Self::Flux(plane) => format!("flux on {plane}, lm"),
            Self::Valued(plane) => format!("share of {plane} with a value"),
            Self::CutOff => "share cut off".into(),
            Self::Escaped => "share escaped".into(),
        }
    }
}

/// A value read off a run.
struct ReadValue {
    found: f64,
    sigma: f64,
    /// The worst of how many.
    of: usize,
}

/// A reading; `None` where nothing has a value. The worst cell is that which is the farthest off `exact`, in what its σ
/// and the `margin` allow.
fn read(results: &Results, reading: Measurand, exact: Option<f64>, margin: f64) -> Option<ReadValue> {
    let map = |name: &str| results.maps.iter().find(|map| map.name == name);
    let one = |found: f64, sigma: f64| ReadValue { found, sigma, of: 1 };
    match reading {
        Measurand::Mean(name) => mean(map(name)?).map(|(found, sigma)| one(found, sigma)),
        Measurand::Channel(name, channel) => {
            let map = map(name)?;
            let (whole, sigma) = mean(map)?;
            let rgb =
                map.rgb.as_ref()?.iter().zip(&map.has_value).filter(|(_, has)| **has).map(|(rgb, _)| rgb[channel]);
            let found = rgb.sum::<f64>() / map.has_value.iter().filter(|has| **has).count() as f64;
            // A claim is one of the photometric value; each channel is taken to be as sure.
            Some(one(found, if whole > 0.0 { sigma / whole * found } else { 0.0 }))
        }
        Measurand::Worst(name) => {
            let (map, exact) = (map(name)?, exact.unwrap_or(0.0));
            let of = map.has_value.iter().filter(|has| **has).count();
            let badness = |&cell: &usize| {
                let off = (map.illuminance[cell] - exact).abs();
                if off > 0.0 { off / map.standard_error[cell].max(margin) } else { 0.0 }
            };
            let cells = (0..map.illuminance.len()).filter(|&cell| map.has_value[cell]);
            let cell = cells.max_by(|a, b| badness(a).total_cmp(&badness(b)))?;
            Some(ReadValue { found: map.illuminance[cell], sigma: map.standard_error[cell], of })
        }
        Measurand::Sensor(name) => {
            let sensor = results.sensors.iter().find(|sensor| sensor.name == name)?;
            sensor.has_value.then(|| one(sensor.illuminance, sensor.standard_error))
        }
        Measurand::AllPlanes => {
            let (mut sum, mut sigmas, mut whole) = (0.0, 0.0, 0.0);
            for map in &results.maps {
                let ((found, sigma), area) = (mean(map)?, map.along.cross(map.across).length());
                sum += found * area;
                sigmas += sigma * area;
                whole += area;
            }
            Some(one(sum / whole, sigmas / whole))
        }
        Measurand::Flux(name) => {
            let map = map(name)?;
            let ((found, sigma), area) = (mean(map)?, map.along.cross(map.across).length());
            Some(one(found * area, sigma * area))
        }
        Measurand::Valued(name) => {
            let has = &map(name)?.has_value;
            Some(one(has.iter().filter(|has| **has).count() as f64 / has.len() as f64, 0.0))
        }
        Measurand::CutOff => Some(one(results.run.flux.cut_off / results.run.flux.emitted, 0.0)),
        Measurand::Escaped => Some(one(results.run.flux.escaped / results.run.flux.emitted, 0.0)),
    }
}

/// Mean of a map and its standard error, were all cells wrong together: cells share photons.
fn mean(map: &IlluminanceMap) -> Option<(f64, f64)> {
    let cells = || (0..map.illuminance.len()).filter(|&cell| map.has_value[cell]);
    let count = cells().count();
    let over = |values: &[f64]| cells().map(|cell| values[cell]).sum::<f64>() / count as f64;
    (count > 0).then(|| (over(&map.illuminance), over(&map.standard_error)))
}

/// Says which value is not a finite number, or below 0.
fn not_finite(results: &Results) -> Option<String> {
    let fine = |(value, sigma): (&f64, &f64)| value.is_finite() && *value >= 0.0 && sigma.is_finite() && *sigma >= 0.0;
    let of_map = |map: &IlluminanceMap| {
        let bad = map.illuminance.iter().zip(&map.standard_error).position(|cell| !fine(cell))?;
        Some(format!("cell {bad} of {}: {} ± {} lx", map.name, map.illuminance[bad], map.standard_error[bad]))
    };
    let bad = results.sensors.iter().find(|sensor| !fine((&sensor.illuminance, &sensor.standard_error)));
    let of_sensor = bad.map(|sensor| format!("{}: {} ± {} lx", sensor.name, sensor.illuminance, sensor.standard_error));
    results.maps.iter().find_map(of_map).or(of_sensor)
}

//! ANA/RC, the Adaptive Neighbourhood Algorithm using Regression Coefficients of the intelligent lighting system (Miki
//! laboratory, Doshisha University): a stochastic hill climbing in which each luminaire changes at random, looks what
//! became of power and of the sensors it has influence on, and takes back what did no good.
//!
//! The ten steps are those of SciTePress 2015, paper 51914: initial intensity; sensors send illuminance and target, the
//! meter sends power; objective of the current intensity; neighbourhood by influence and illuminance; random next
//! intensity in it; sensors and meter again; objective of the next; regression; accept if better, else return. One such
//! search operation takes two of our steps, 2 s by default as there.
//!
//! The objective is as the laboratory's papers are commonly cited; the page with its formula was not readable for us:
//! f = P + w Σ g_j over the sensors j whose regression coefficient is large enough, g_j = 0 where the target is met,
//! else the squared difference in lx². Ours are: every number below (they are parameters of the script); thresholds
//! relative to the largest coefficient of a sensor, and lowered where the luminaires above them together could not give
//! it what it asks for; what lies above target + tolerance counts like what lacks, where the scene gives a tolerance,
//! and a luminaire whose sensors have more too much than they lack, weighed by coefficients, goes down; that P of a
//! luminaire's decision is what it draws itself (`power = "meter"`: the whole, as in the source), since the random
//! changes of all others are noise in the whole; regression on all luminaires at once by recursive least squares with a
//! random walk of the coefficients, since in a regression on one alone the others are noise too; and that a sensor
//! which falls silent is taken to read what the regression predicts.

use super::{Controller, Installation, Make, Observation};
use crate::error::InputError;
use crate::random::Stream;
use crate::scene::fields::Fields;

/// Keys of `[ana-rc]`.
pub(super) const KEYS: [&str; 12] =
    ["weight", "power", "counts", "strong", "total", "margin", "down", "both", "up", "prior", "noise", "drift"];

/// What can be set.
#[derive(Clone, Debug, PartialEq)]
pub struct AnaRcParameters {
    /// What a miss of 10 lx costs: so many times the power of a mean luminaire at full output.
    pub weight: f64,
    /// Whether a luminaire weighs the power of all, as the meter has it, instead of its own.
    pub meter: bool,
    /// A sensor counts in a luminaire's objective from this share of the sensor's largest regression coefficient on;
    /// from less where those luminaires together would not reach the target.
    pub counts: f64,
    /// A luminaire is strong for a sensor from this share on: others are dimmed as long as the strong suffice.
    pub strong: f64,
    /// It is also strong from this share of the largest sum of coefficients over all sensors that need light.
    pub total: f64,
    /// A sensor this far above its target, lx, has enough; this far below, the weak are to help.
    pub margin: f64,
    /// Neighbourhood of a luminaire that no sensor needs: from … to, shares of full output.
    pub down: [f64; 2],
    /// Of one whose sensors have what they ask for.
    pub both: [f64; 2],
    /// Of one with a sensor that lacks light.
    pub up: [f64; 2],
    /// How large coefficients may be, lx at full output: what the regression starts from.
    pub prior: f64,
    /// Noise of a difference of readings, lx (1 σ).
    pub noise: f64,
    /// How far a coefficient may wander in one search operation, lx at full output (1 σ).
    pub drift: f64,
}

impl Default for AnaRcParameters {
    fn default() -> Self {
        Self {
            weight: 0.33,
            meter: false,
            counts: 0.2,
            strong: 0.5,
            total: 0.6,
            margin: 10.0,
            down: [-0.06, 0.02],
            both: [-0.03, 0.03],
            up: [-0.02, 0.06],
            prior: 200.0,
            noise: 3.0,
            drift: 0.7,
        }
    }
}

/// Reads `[ana-rc]`.
pub(super) fn read(fields: Option<&Fields<'_>>) -> Result<Make, InputError> {
    let mut parameters = AnaRcParameters::default();
    if let Some(fields) = fields {
        let number = |key: &str, value: &mut f64, expected: &str, accept: fn(f64) -> bool| {
            if let Some(found) = fields.number(key, expected, accept)? {
                *value = found.value;
            }
            Ok::<(), InputError>(())
        };
        let (share, lux) = ("a share from 0 to 1", "a number above 0, lx");
        let is_share = |n| (0.0..=1.0).contains(&n);
        let positive = |n| n > 0.0 && n <= 1e6;
        number("weight", &mut parameters.weight, "a number above 0", positive)?;
        number("counts", &mut parameters.counts, share, is_share)?;
        number("strong", &mut parameters.strong, share, is_share)?;
        number("total", &mut parameters.total, share, is_share)?;
        number("margin", &mut parameters.margin, "a number from 0 up, lx", |n| (0.0..=1e6).contains(&n))?;
        number("prior", &mut parameters.prior, lux, positive)?;
        number("noise", &mut parameters.noise, lux, positive)?;
        number("drift", &mut parameters.drift, "a number from 0 up, lx", |n| (0.0..=1e6).contains(&n))?;
        if let Some(power) = fields.word("power", &["own", "meter"])? {
            parameters.meter = power.value == "meter";
        }
        let ranges = [("down", &mut parameters.down), ("both", &mut parameters.both), ("up", &mut parameters.up)];
        for (key, range) in ranges {
            let expected = "[from, to] with −1 ≤ from < to ≤ 1, shares of full output";
            let Some(found) = fields.numbers::<2>(key, expected, |n| (-1.0..=1.0).contains(&n))? else { continue };
            if found.value[0] >= found.value[1] {
                return Err(fields.refusal(key, expected));
            }
            *range = found.value;
        }
    }
    Ok(Box::new(move |installation: &Installation<'_>| Box::new(AnaRc::new(installation, parameters.clone()))))
}

/// The algorithm: all luminaires, each of which decides for itself.
pub struct AnaRc {
    parameters: AnaRcParameters,
    /// What a lux² of a miss costs, in the unit of power.
    weight: f64,
    regression: Regression,
    /// The last reading of each sensor, and the levels at the time.
    last: Vec<Option<(f64, Vec<f64>)>>,
    /// What was measured at the current levels, while the next are being tried.
    before: Option<LevelReadings>,
}

/// What is known at some levels.
struct LevelReadings {
    levels: Vec<f64>,
    /// Of each sensor: nothing where none has ever come.
    lux: Vec<Option<f64>>,
    /// Whether it comes from the sensor itself.
    fresh: Vec<bool>,
    power: f64,
    draws: Vec<f64>,
}

impl AnaRc {
    /// Knows nothing of the room yet.
    pub fn new(installation: &Installation<'_>, parameters: AnaRcParameters) -> Self {
        let count = installation.luminaires().len();
        let full = (0..count).map(|luminaire| installation.power_of(luminaire, 1.0)).sum::<f64>() / count as f64;
        let AnaRcParameters { weight, prior, noise, drift, .. } = parameters;
        let sensors = installation.sensors().len();
        Self {
            weight: weight * full / 100.0,
            regression: Regression::new(count, sensors, prior, noise, drift),
            last: vec![None; sensors],
            before: None,
            parameters,
        }
    }

    /// Regression coefficients: lx at full output of each luminaire, a row for each sensor.
    pub fn coefficients(&self) -> &[Vec<f64>] {
        &self.regression.coefficients
    }

    fn measure(&mut self, seen: &Observation<'_>) -> LevelReadings {
        let mut lux = Vec::with_capacity(seen.sensors.len());
        for (sensor, last) in seen.sensors.iter().zip(&mut self.last) {
            if let Some(reading) = sensor.reading {
                *last = Some((reading, seen.levels.to_vec()));
            }
            let row = &self.regression.coefficients[lux.len()];
            lux.push(last.as_ref().map(|(reading, then)| {
                let change = row.iter().zip(seen.levels.iter().zip(then));
                reading + change.map(|(coefficient, (now, then))| coefficient * (now - then)).sum::<f64>()
            }));
        }
        let fresh = seen.sensors.iter().map(|sensor| sensor.reading.is_some()).collect();
        LevelReadings { levels: seen.levels.to_vec(), lux, fresh, power: seen.power, draws: seen.draws.to_vec() }
    }

    /// For each luminaire the sensors that ask for something and have it among their [`Self::neighbours`].
    fn influenced(&self, seen: &Observation<'_>, now: &LevelReadings, share: f64) -> Vec<Vec<usize>> {
        let mut of = vec![Vec::new(); seen.levels.len()];
        for sensor in 0..self.regression.coefficients.len() {
            if let Some(target) = seen.sensors[sensor].target {
                for luminaire in self.neighbours(sensor, target, now, share) {
                    of[luminaire].push(sensor);
                }
            }
        }
        of
    }

    /// A sensor's luminaires: those with at least a share of its largest coefficient. Where all that count, at full
    /// output and without the others, would not reach the target, it takes as many more, by their coefficients, as are
    /// needed, and all of them are strong. All where nothing is known yet.
    fn neighbours(&self, sensor: usize, target: f64, now: &LevelReadings, share: f64) -> Vec<usize> {
        let row = &self.regression.coefficients[sensor];
        let mut order: Vec<usize> = (0..row.len()).collect();
        order.sort_by(|&a, &b| row[b].total_cmp(&row[a]).then(a.cmp(&b)));
        let largest = row[order[0]];
        let Some(lux) = now.lux[sensor].filter(|_| largest > 0.0) else { return order };
        // What it reads with all that have a part in it off; then one after the other goes to full output.
        let part = |luminaire: usize| row[luminaire].max(0.0);
        let mut reached = lux - order.iter().map(|&luminaire| part(luminaire) * now.levels[luminaire]).sum::<f64>();
        let wanted = target + self.parameters.margin;
        let own = |luminaire: usize, share: f64| row[luminaire] >= share * largest;
        let is_needed = |&luminaire: &usize| {
            let needed = reached < wanted && row[luminaire] > 0.0;
            reached += part(luminaire);
            needed || own(luminaire, self.parameters.counts)
        };
        let needed: Vec<usize> = order.iter().copied().filter(is_needed).collect();
        match needed.iter().all(|&luminaire| own(luminaire, self.parameters.counts)) {
            true => order.into_iter().filter(|&luminaire| own(luminaire, share)).collect(),
            false => needed,
        }
    }

    /// Random next levels, each in the neighbourhood that its influence and the sensors' state call for.
    fn next(&self, seen: &Observation<'_>, now: &LevelReadings, stream: &mut Stream) -> Vec<f64> {
        let AnaRcParameters { margin, .. } = self.parameters;
        let counts = self.influenced(seen, now, self.parameters.counts);
        let strong = self.influenced(seen, now, self.parameters.strong);
        // What lacks, lx.
        let lack = |sensor: usize| Some(seen.sensors[sensor].target? - now.lux[sensor]?);
        let needy: Vec<usize> = (0..now.lux.len()).filter(|&s| lack(s).is_some_and(|lack| lack >= -margin)).collect();
        let help = |luminaire: usize| -> f64 {
            needy.iter().map(|&sensor| self.regression.coefficients[sensor][luminaire].max(0.0)).sum()
        };
        let help: Vec<f64> = (0..now.levels.len()).map(help).collect();
        let most = help.iter().fold(0.0_f64, |most, help| most.max(*help));
        let level = |luminaire: usize| {
            let versatile = most > 0.0 && help[luminaire] >= self.parameters.total * most;
            let own = if versatile { &counts[luminaire] } else { &strong[luminaire] };
            let lacks = |sensors: &[usize], least: f64| {
                sensors.iter().any(|&sensor| lack(sensor).is_some_and(|lack| lack > least))
            };
            // Which way all its sensors together pull: what they lack, and what they have beyond their tolerance.
            let pull = |&sensor: &usize| {
                let beyond = seen.sensors[sensor].tolerance.unwrap_or(f64::INFINITY);
                let lack = lack(sensor).unwrap_or(0.0);
                self.regression.coefficients[sensor][luminaire].max(0.0) * (lack.max(0.0) - (-lack - beyond).max(0.0))
            };
            let [from, to] = if counts[luminaire].iter().map(pull).sum::<f64>() < 0.0 {
                self.parameters.down
            } else if lacks(own, 0.0) || lacks(&counts[luminaire], margin) {
                self.parameters.up
            } else if lacks(own, -margin) {
                self.parameters.both
            } else {
                self.parameters.down
            };
            (now.levels[luminaire] + from + (to - from) * f64::from(stream.uniform())).clamp(0.0, 1.0)
        };
        (0..now.levels.len()).map(level).collect()
    }

    /// Levels of those that made things better, and of the others as they were.
    fn decide(&self, seen: &Observation<'_>, before: &LevelReadings, after: &LevelReadings) -> Vec<f64> {
        let penalty = |sensor: usize, lux: f64| {
            let target = seen.sensors[sensor].target.unwrap_or(0.0);
            let most = seen.sensors[sensor].tolerance.map_or(f64::INFINITY, |tolerance| target + tolerance);
            (target - lux).max(lux - most).max(0.0).powi(2)
        };
        let change = |sensor: usize| match (before.lux[sensor], after.lux[sensor]) {
            (Some(before), Some(after)) => penalty(sensor, after) - penalty(sensor, before),
            _ => 0.0,
        };
        let changes: Vec<f64> = (0..before.lux.len()).map(change).collect();
        let counts = self.influenced(seen, before, self.parameters.counts);
        let decide = |luminaire: usize| {
            let [old, new] = [before, after].map(|measured| measured.levels[luminaire]);
            let power = match self.parameters.meter {
                true => after.power - before.power,
                false => after.draws[luminaire] - before.draws[luminaire],
            };
            let misses: f64 = counts[luminaire].iter().map(|&sensor| changes[sensor]).sum();
            if power + self.weight * misses < 0.0 { new } else { old }
        };
        (0..before.levels.len()).map(decide).collect()
    }
}

impl Controller for AnaRc {
    fn step(&mut self, seen: &Observation<'_>, stream: &mut Stream) -> Vec<f64> {
        let now = self.measure(seen);
        let Some(before) = self.before.take() else {
            let next = self.next(seen, &now, stream);
            self.before = Some(now);
            return next;
        };
        let change: Vec<f64> = now.levels.iter().zip(&before.levels).map(|(now, before)| now - before).collect();
        let of_sensor = |sensor: usize| match (before.lux[sensor], now.lux[sensor]) {
            (Some(old), Some(new)) if before.fresh[sensor] && now.fresh[sensor] => Some(new - old),
            _ => None,
        };
        let changes: Vec<Option<f64>> = (0..now.lux.len()).map(of_sensor).collect();
        let levels = self.decide(seen, &before, &now);
        self.regression.learn(&change, &changes);
        levels
    }
}

/// ΔE of each sensor as a sum over ΔI of all luminaires, by recursive least squares (a Kalman filter whose coefficients
/// wander at random). Cost of a step: O(luminaires × (luminaires + sensors)).
struct Regression {
    coefficients: Vec<Vec<f64>>,
    /// Covariance of the coefficients, the same for all sensors, row by row.
    covariance: Vec<f64>,
    prior: f64,
    noise: f64,
    drift: f64,
}

/// Surprises beyond so many σ are cut: daylight may have changed between two measurements.
const SURPRISE: f64 = 3.0;

impl Regression {
    fn new(luminaires: usize, sensors: usize, prior: f64, noise: f64, drift: f64) -> Self {
        let mut covariance = vec![0.0; luminaires * luminaires];
        covariance.iter_mut().step_by(luminaires + 1).for_each(|variance| *variance = prior * prior);
        let coefficients = vec![vec![0.0; luminaires]; sensors];
        Self { coefficients, covariance, prior: prior * prior, noise: noise * noise, drift: drift * drift }
    }

    fn learn(&mut self, change: &[f64], changes: &[Option<f64>]) {
        let count = change.len();
        if change.iter().all(|change| *change == 0.0) {
            return;
        }
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let carried: Vec<f64> = self.covariance.chunks(count).map(|row| dot(row, change)).collect();
        let variance = self.noise + dot(&carried, change);
        for (row, seen) in self.coefficients.iter_mut().zip(changes) {
            let Some(seen) = seen else { continue };
            let most = SURPRISE * variance.sqrt();
            let surprise = (seen - dot(row, change)).clamp(-most, most) / variance;
            row.iter_mut().zip(&carried).for_each(|(coefficient, carried)| *coefficient += surprise * carried);
        }
        for (row, own) in self.covariance.chunks_mut(count).zip(&carried) {
            row.iter_mut().zip(&carried).for_each(|(entry, other)| *entry -= own * other / variance);
        }
        for variance in self.covariance.iter_mut().step_by(count + 1) {
            *variance = (*variance + self.drift).min(self.prior);
        }
    }
}

//! Levels that reach the targets in spite of what isn't known.
//!
//! A row of R is known within its standard errors, independent from luminaire to luminaire. A render with levels d
//! reads R d within an error of its own: one more equation for each row, by which it is corrected (Kalman's update).
//! Levels are looked for that reach every target with a margin: z σ for what isn't known of R d, and as much for the
//! noise of a render that checks it. The margin depends on the levels, so it is found in rounds.

use super::Influence;
use super::solve::{Answer, Goal, Missed, solve};
use crate::error::Error;
use crate::results::Verdict;
use crate::results::met::{self, is_within};

/// Rounds of solving in which margins settle.
const ROUNDS: usize = 8;
/// Renders that verify levels, each after the levels were corrected by the one before.
const MOST_RENDERS: u64 = 6;
/// Levels that differ by less are the same.
const SAME: f64 = 1e-5;
/// Margins that differ by less than this share are settled.
const SETTLED: f64 = 1e-3;
/// Shares of a tolerance that margins may take from both ends: where errors are larger than it, the middle is aimed at.
const OF_TOLERANCE: f64 = 0.9;

/// What is known of the light at the sensors: the matrix, and what renders said of it.
#[derive(Clone, Debug)]
pub struct Known {
    /// What is most likely: the matrix, corrected; its standard errors are those before.
    pub mean: Influence,
    /// Of each sensor, for each render: what it took from the covariance of the row, as the vector u of Σ − u uᵀ.
    pub told: Vec<Vec<Vec<f64>>>,
    /// Squared standard errors of each sensor in the renders, lx², and how many there were.
    squares: Vec<(f64, u32)>,
    /// Standard error (1 σ) of each sensor in a render, lx, where there were some.
    noise: Vec<Option<f64>>,
}

impl Known {
    /// The matrix alone.
    pub fn new(matrix: &Influence) -> Self {
        let sensors = matrix.sensors.len();
        Self {
            mean: matrix.clone(),
            told: vec![Vec::new(); sensors],
            squares: vec![(0.0, 0); sensors],
            noise: vec![None; sensors],
        }
    }

    /// Standard error (1 σ) of E at a sensor, lx. Cost: O(luminaires × renders).
    pub fn error(&self, sensor: usize, levels: &[f64]) -> f64 {
        let squares = |row: &[f64]| row.iter().zip(levels).map(|(error, level)| (error * level).powi(2)).sum::<f64>();
        let dot = |row: &[f64]| row.iter().zip(levels).map(|(part, level)| part * level).sum::<f64>();
        let taken: f64 = self.told[sensor].iter().map(|part| dot(part).powi(2)).sum();
        (squares(&self.mean.standard_error[sensor]) - taken).max(0.0).sqrt()
    }

    /// Standard error (1 σ) of a sensor in a render with these levels, lx: as in those there were, else as in the run
    /// that found the matrix.
    fn noise(&self, sensor: usize, levels: &[f64]) -> f64 {
        self.noise[sensor].unwrap_or_else(|| self.error(sensor, levels))
    }

    /// Standard error (1 σ) of a sensor in the renders, lx; nothing where there were none.
    pub fn noise_of_renders(&self, sensor: usize) -> Option<f64> {
        self.noise[sensor]
    }

    /// Takes in what a render with these levels reads without daylight: E and standard error of each sensor, lx, where
    /// it has a value. Where readings contradict the matrix by more than both claim, its errors are taken for so much
    /// larger.
    pub fn learn(&mut self, levels: &[f64], readings: &[Option<(f64, f64)>]) {
        self.note_noise(levels, readings);
        let square = |(sensor, reading): (usize, &Option<(f64, f64)>)| {
            let (lux, noise) = ((*reading)?.0, self.noise(sensor, levels));
            let off = lux + self.mean.sensors[sensor].daylight - self.mean.illuminance(sensor, levels);
            let variance = self.error(sensor, levels).powi(2) + noise * noise;
            (variance > 0.0).then(|| off * off / variance)
        };
        let squares: Vec<f64> = readings.iter().enumerate().filter_map(square).collect();
        let excess = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt().max(1.0);
        for (sensor, reading) in readings.iter().enumerate() {
            self.mean.standard_error[sensor].iter_mut().for_each(|error| *error *= excess);
            self.told[sensor].iter_mut().flatten().for_each(|part| *part *= excess);
            if let Some((lux, _)) = *reading {
                self.correct(sensor, levels, lux);
            }
        }
    }

    /// Standard errors of single renders are uncertain themselves: a sensor's own count as much as, for one render
    /// more, what all sensors have as a share of their light.
    fn note_noise(&mut self, levels: &[f64], readings: &[Option<(f64, f64)>]) {
        for ((squares, count), reading) in self.squares.iter_mut().zip(readings) {
            if let Some((_, noise)) = reading {
                *squares += noise * noise;
                *count += 1;
            }
        }
        let light = |sensor: usize| {
            let place = &self.mean.sensors[sensor];
            (self.mean.illuminance(sensor, levels) - place.daylight).max(0.0)
        };
        let own = |sensor: usize| Some(self.squares[sensor]).filter(|(_, count)| *count > 0);
        let share = |sensor: usize| {
            let ((squares, count), light) = (own(sensor)?, light(sensor));
            (light > 0.0).then(|| squares / f64::from(count) / (light * light))
        };
        let shares: Vec<f64> = (0..self.squares.len()).filter_map(share).collect();
        let pooled = shares.iter().sum::<f64>() / shares.len().max(1) as f64;
        let noise = |sensor: usize| {
            let ((squares, count), light) = (own(sensor)?, light(sensor));
            Some(((squares + pooled * light * light) / f64::from(count + 1)).sqrt())
        };
        self.noise = (0..self.squares.len()).map(noise).collect();
    }

    fn correct(&mut self, sensor: usize, levels: &[f64], lux: f64) {
        let noise = self.noise(sensor, levels);
        let variance = self.error(sensor, levels).powi(2) + noise * noise;
        if variance <= 0.0 {
            return;
        }
        // Σ d
        let mut gain: Vec<f64> =
            self.mean.standard_error[sensor].iter().zip(levels).map(|(error, level)| error * error * level).collect();
        for part in &self.told[sensor] {
            let share: f64 = part.iter().zip(levels).map(|(part, level)| part * level).sum();
            gain.iter_mut().zip(part).for_each(|(gain, part)| *gain -= part * share);
        }
        let surprise = lux + self.mean.sensors[sensor].daylight - self.mean.illuminance(sensor, levels);
        let row = &mut self.mean.lux[sensor];
        row.iter_mut().zip(&gain).for_each(|(lux, gain)| *lux += gain * surprise / variance);
        self.told[sensor].push(gain.iter().map(|gain| gain / variance.sqrt()).collect());
    }

    /// What is to be added to the target of each sensor, and kept from target + tolerance, at `z` σ, lx.
    fn margins(&self, levels: &[f64], z: f64) -> Vec<[f64; 2]> {
        let margin = |sensor: usize| {
            let error = z * self.error(sensor, levels);
            let [low, high] = [error + z * self.noise(sensor, levels), error];
            let room = self.mean.sensors[sensor].tolerance.map_or(f64::INFINITY, |tolerance| OF_TOLERANCE * tolerance);
            let share = if low + high > room { room / (low + high) } else { 1.0 };
            [low * share, high * share]
        };
        (0..self.mean.sensors.len()).map(margin).collect()
    }

    /// The same room with targets moved by margins.
    fn asking(&self, margins: &[[f64; 2]]) -> Influence {
        let mut asking = self.mean.clone();
        for (place, [low, high]) in asking.sensors.iter_mut().zip(margins) {
            place.target = place.target.map(|target| target + low);
            place.tolerance = place.tolerance.map(|tolerance| (tolerance - low - high).max(0.0));
        }
        asking
    }

    /// What can be said of each sensor's target, at `z` σ; nothing where there is none. Met is one that a further
    /// render finds reached, by what isn't known and by its own noise together.
    pub fn verdicts(&self, levels: &[f64], z: f64) -> Vec<Option<Verdict>> {
        let verdict = |sensor: usize| {
            let (lux, error) = (self.mean.illuminance(sensor, levels), self.error(sensor, levels));
            let spare = error.hypot(self.noise(sensor, levels));
            Some(Verdict::within(lux, z * spare, z * error, self.mean.sensors[sensor].band()?))
        };
        (0..self.mean.sensors.len()).map(verdict).collect()
    }

    /// Whether every target is met, but for those that are out of reach.
    fn holds(&self, levels: &[f64], z: f64) -> bool {
        self.verdicts(levels, z).iter().enumerate().all(|(sensor, verdict)| {
            match (verdict, self.mean.sensors[sensor].band()) {
                (Some(Verdict::Missed | Verdict::Undecided { .. }), Some([target, _])) => {
                    !met::reaches(self.mean.most(sensor) + z * self.error(sensor, levels), target)
                }
                _ => true,
            }
        })
    }
}

/// Levels, and what being sure of them costs.
#[derive(Clone, Debug)]
pub struct Sure {
    /// The levels. Missed are sensors whose targets no levels reach, by what is most likely.
    pub answer: Answer,
    /// What levels without any margin would draw, in [`Influence::power_unit`].
    pub bare: f64,
}

impl Sure {
    /// Whether every luminaire is off.
    pub fn is_dark(&self) -> bool {
        self.answer.levels.iter().all(|level| *level <= 0.0)
    }
}

/// Finds levels that reach every target with a margin of `z` σ; [`Goal::Closest`] has none.
///
/// Cost: some five times that of [`solve`].
///
/// # Errors
/// As [`solve`].
pub fn solve_surely(known: &Known, goal: Goal, z: f64) -> Result<Sure, Error> {
    let bare = solve(&known.mean, goal)?;
    let mut answer = bare.clone();
    if goal == Goal::LeastPower {
        let mut margins = vec![[0.0; 2]; known.mean.sensors.len()];
        for round in 0..ROUNDS {
            let needed = known.margins(&answer.levels, z);
            let pairs = || needed.iter().flatten().zip(margins.iter().flatten());
            if pairs().all(|(needed, margin)| *needed <= margin * (1.0 + SETTLED)) {
                break;
            }
            // Where levels jump to and fro, the larger margin is kept.
            let larger = |(needed, margin): (&[f64; 2], &[f64; 2])| [0, 1].map(|end| needed[end].max(margin[end]));
            margins = if round < ROUNDS / 2 { needed } else { needed.iter().zip(&margins).map(larger).collect() };
            answer = solve(&known.asking(&margins), goal)?;
        }
    }
    let missed = |sensor: usize| {
        let (reached, band) = (known.mean.illuminance(sensor, &answer.levels), known.mean.sensors[sensor].band()?);
        (!is_within(reached, band)).then(|| Missed { sensor, reached, most: known.mean.most(sensor) })
    };
    if goal == Goal::LeastPower {
        answer.missed = (0..known.mean.sensors.len()).filter_map(missed).collect();
    }
    Ok(Sure { answer, bare: bare.power })
}

/// What a render reads: E and standard error of each sensor, lx, without daylight, where it has a value.
pub struct Readings {
    /// In the order of the matrix.
    pub of: Vec<Option<(f64, f64)>>,
    /// Whether another render is allowed.
    pub go_on: bool,
}

/// Renders the scene at some levels, with random numbers that belong to the number given.
pub type Render<'a> = &'a mut dyn FnMut(&[f64], u64) -> Result<Readings, Error>;

/// Renders with the levels and corrects them until what is known says that a further render finds every target reached,
/// or nothing changes any more. `render` gets levels and the number of the render, from 1 on; each is to have random
/// numbers of its own, since levels may not follow the noise of one. Returns the levels that were rendered last, and
/// how many renders there were.
///
/// # Errors
/// As [`solve`] and `render`.
pub fn verify(known: &mut Known, goal: Goal, z: f64, mut sure: Sure, render: Render<'_>) -> Result<(Sure, u64), Error> {
    let mut number = 0;
    loop {
        number += 1;
        let readings = render(&sure.answer.levels, number)?;
        known.learn(&sure.answer.levels, &readings.of);
        let next = solve_surely(known, goal, z)?;
        let enough = goal == Goal::Closest || known.holds(&sure.answer.levels, z);
        let same = next.answer.levels.iter().zip(&sure.answer.levels).all(|(next, now)| (next - now).abs() < SAME);
        if enough || same || !readings.go_on || number == MOST_RENDERS {
            // The levels stay what was verified; their margin is what they draw beyond the least by what is known now.
            sure.answer.bound = sure.answer.bound.filter(|_| same);
            sure.answer.missed = next.answer.missed;
            sure.bare = next.bare;
            return Ok((sure, number));
        }
        sure = next;
    }
}

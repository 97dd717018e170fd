//! Levels that reach every target: at least power, or as exactly as can be.
//!
//! Each luminaire is off or between its lowest level and full output, and its power runs in straight pieces over its
//! level. So the problem is a linear program (quadratic where targets are to be met exactly) but for the gap between
//! off and the lowest level, and for curves that bend the wrong way. Both are relaxed to the lower convex hull of the
//! curve, solved by Clarabel's interior points, and what the relaxation got wrong is split: off or on, below or above a
//! corner of the curve.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus};

use super::Influence;
use crate::error::Error;
use crate::luminaire::along;
use crate::results::met::is_within;

/// What to look for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Goal {
    /// Every target reached, none exceeded by more than its tolerance, least power.
    LeastPower,
    /// Least sum of squared distances from the targets; of such, least power.
    Closest,
}

/// Levels, and how good they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// One for each luminaire, 0 … 1.
    pub levels: Vec<f64>,
    /// What they draw, in [`Influence::power_unit`].
    pub power: f64,
    /// No levels that reach the same draw less than this; `power` itself but where the search was cut short, and
    /// nothing where exactness comes before power.
    pub bound: Option<f64>,
    /// Sensors whose target no levels reach, or not together with the others.
    pub missed: Vec<Missed>,
}

/// A target that is not met.
#[derive(Clone, Debug, PartialEq)]
pub struct Missed {
    /// Number of the sensor.
    pub sensor: usize,
    /// E with the levels found, lx.
    pub reached: f64,
    /// E with every luminaire at full output, lx.
    pub most: f64,
}

/// Work that a search may take: relaxations × luminaires × sensors. Some seconds.
const MOST_WORK: usize = 20_000_000;
/// Shares of full output that don't matter.
const TINY: f64 = 1e-7;

/// Finds levels.
///
/// # Errors
/// Where no sensor has a target, or one has a target that no luminaire has any part in.
pub fn solve(influence: &Influence, goal: Goal) -> Result<Answer, Error> {
    let asked: Vec<usize> =
        (0..influence.sensors.len()).filter(|&sensor| influence.sensors[sensor].target.is_some()).collect();
    if asked.is_empty() {
        return Err(Error::Usage("found no target, expected a [[sensor]] with target = 500 (lx)".into()));
    }
    let dark = |&&sensor: &&usize| {
        let place = &influence.sensors[sensor];
        place.target > Some(place.daylight) && influence.lux[sensor].iter().all(|lux| *lux <= 0.0)
    };
    if let Some(&sensor) = asked.iter().find(dark) {
        let place = &influence.sensors[sensor];
        return Err(Error::Usage(format!(
            "sensor \"{}\": found target = {} where no luminaire's light arrives, expected a place that one reaches; is it \
             inside something, or its normal the wrong way?",
            place.name,
            place.target.unwrap_or(0.0),
        )));
    }
    let mut search = LevelSearch::new(influence, &asked, goal);
    if search.run() {
        return Ok(search.answer());
    }
    // Not all can be had: as little as possible is missing.
    search = LevelSearch { elastic: true, ..LevelSearch::new(influence, &asked, goal) };
    search.run();
    let mut answer = search.answer();
    let missed = |&sensor: &usize| {
        let place = &influence.sensors[sensor];
        let (reached, band) = (influence.illuminance(sensor, &answer.levels), place.band()?);
        (!is_within(reached, band)).then(|| Missed { sensor, reached, most: influence.most(sensor) })
    };
    answer.missed = asked.iter().filter_map(missed).collect();
    answer.bound = None;
    Ok(answer)
}

/// What a luminaire may do in a part of the search.
#[derive(Clone, Debug)]
enum LevelRange {
    /// Off, or anything from its lowest level on.
    Free,
    /// Off.
    Off,
    /// Between two levels, not off.
    Between(f64, f64),
}

/// A part of all levels there are.
#[derive(Clone)]
struct Branch {
    ranges: Vec<LevelRange>,
    /// No levels in it cost less.
    bound: f64,
}

struct LevelSearch<'a> {
    influence: &'a Influence,
    asked: &'a [usize],
    goal: Goal,
    /// Whether targets may be missed, at a price above any power.
    elastic: bool,
    /// Power over level of each luminaire; and when off.
    curves: Vec<Vec<[f64; 2]>>,
    off: Vec<f64>,
    /// Cost of 1 in the unit of power.
    weight: f64,
    best: Option<(f64, Vec<f64>)>,
    /// Least bound of parts that were not looked into.
    left: f64,
}

impl<'a> LevelSearch<'a> {
    fn new(influence: &'a Influence, asked: &'a [usize], goal: Goal) -> Self {
        let count = influence.luminaires.len();
        let curves: Vec<Vec<[f64; 2]>> = (0..count).map(|lamp| influence.curve(lamp)).collect();
        let off: Vec<f64> = (0..count).map(|lamp| influence.power_of(lamp, 0.0)).collect();
        let full: f64 = curves.iter().map(|curve| curve[curve.len() - 1][1]).sum();
        let squares: f64 = asked.iter().filter_map(|&sensor| influence.sensors[sensor].target).map(|t| t * t).sum();
        // Power breaks ties only: at most 1e-4 of the squared targets.
        let weight = match goal {
            Goal::LeastPower => 1.0 / full.max(f64::MIN_POSITIVE),
            Goal::Closest => 1e-4 * squares.max(1.0) / full.max(f64::MIN_POSITIVE),
        };
        Self { influence, asked, goal, elastic: false, curves, off, weight, best: None, left: f64::INFINITY }
    }

    /// Looks through all parts, the most promising child first; whether there are levels at all.
    fn run(&mut self) -> bool {
        let count = self.influence.luminaires.len();
        let most = (MOST_WORK / (count * self.asked.len())).clamp(30, 20_000);
        let mut parts = vec![Branch { ranges: vec![LevelRange::Free; count], bound: f64::NEG_INFINITY }];
        for _ in 0..most {
            let Some(part) = parts.pop() else { return self.best.is_some() };
            if self.is_beaten(part.bound) {
                continue;
            }
            let Some((bound, levels)) = self.relaxed(&part.ranges) else { continue };
            if self.is_beaten(bound) {
                continue;
            }
            self.try_rounded(&levels);
            let wrong = (0..count).map(|lamp| self.understated(lamp, &part.ranges[lamp], levels[lamp])).enumerate();
            let worst = wrong.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, cost)| *cost > TINY * self.scale());
            match worst {
                None => self.offer(levels),
                Some((lamp, _)) => {
                    let children = self.split(lamp, &part.ranges[lamp], levels[lamp]);
                    for range in children.into_iter().rev() {
                        let mut ranges = part.ranges.clone();
                        ranges[lamp] = range;
                        parts.push(Branch { ranges, bound });
                    }
                }
            }
        }
        self.left = parts.iter().map(|part| part.bound).fold(f64::INFINITY, f64::min);
        self.best.is_some()
    }

    /// Cost of all luminaires at full output.
    fn scale(&self) -> f64 {
        self.weight * self.curves.iter().map(|curve| curve[curve.len() - 1][1]).sum::<f64>()
    }

    fn is_beaten(&self, bound: f64) -> bool {
        self.best.as_ref().is_some_and(|(cost, _)| bound >= cost - 1e-6 * self.scale())
    }

    /// How much more a level costs in truth than in the relaxation.
    fn understated(&self, lamp: usize, range: &LevelRange, level: f64) -> f64 {
        let least = self.curves[lamp][0][0];
        let hull = self.hull(lamp, range);
        let relaxed = along(&hull, level);
        match range {
            LevelRange::Off => 0.0,
            LevelRange::Free if level <= TINY => 0.0,
            // Between off and the lowest level there is nothing.
            LevelRange::Free if level < least - TINY => {
                self.weight * (along(&self.curves[lamp], least) - relaxed).abs() + 1e-3
            }
            _ => self.weight * (along(&self.curves[lamp], level) - relaxed).max(0.0),
        }
    }

    fn split(&self, lamp: usize, range: &LevelRange, level: f64) -> Vec<LevelRange> {
        let curve = &self.curves[lamp];
        let (least, most) = (curve[0][0], 1.0);
        match range {
            LevelRange::Free if level < least / 2.0 => vec![LevelRange::Off, LevelRange::Between(least, most)],
            LevelRange::Free => vec![LevelRange::Between(least, most), LevelRange::Off],
            LevelRange::Between(low, high) => {
                let inner = curve.iter().map(|[at, _]| *at).filter(|at| *at > low + TINY && *at < high - TINY);
                match inner.min_by(|a, b| (a - level).abs().total_cmp(&(b - level).abs())) {
                    Some(at) if level < at => vec![LevelRange::Between(*low, at), LevelRange::Between(at, *high)],
                    Some(at) => vec![LevelRange::Between(at, *high), LevelRange::Between(*low, at)],
                    None => Vec::new(),
                }
            }
            LevelRange::Off => Vec::new(),
        }
    }

    /// Lower convex hull of what a luminaire may draw in a range.
    fn hull(&self, lamp: usize, range: &LevelRange) -> Vec<[f64; 2]> {
        let curve = &self.curves[lamp];
        let points: Vec<[f64; 2]> = match range {
            LevelRange::Off => return vec![[0.0, self.off[lamp]]],
            LevelRange::Free => std::iter::once([0.0, self.off[lamp]]).chain(curve.iter().copied()).collect(),
            LevelRange::Between(low, high) => {
                let inner = curve.iter().copied().filter(|[at, _]| *at > low + TINY && *at < high - TINY);
                let [start, end] = [*low, *high].map(|at| [at, along(curve, at)]);
                std::iter::once(start).chain(inner).chain([end]).collect()
            }
        };
        let mut hull: Vec<[f64; 2]> = Vec::new();
        for point in points {
            if let Some(last) = hull.last_mut().filter(|last| point[0] <= last[0]) {
                last[1] = last[1].min(point[1]);
                continue;
            }
            while let [.., a, b] = hull[..] {
                if (b[1] - a[1]) * (point[0] - a[0]) < (point[1] - a[1]) * (b[0] - a[0]) {
                    break;
                }
                hull.pop();
            }
            hull.push(point);
        }
        hull
    }

    /// Least cost in a part where power follows the hulls, and the levels that have it; nothing where targets can't be
    /// met.
    fn relaxed(&self, ranges: &[LevelRange]) -> Option<(f64, Vec<f64>)> {
        let count = ranges.len();
        let hulls: Vec<Vec<[f64; 2]>> = ranges.iter().enumerate().map(|(lamp, range)| self.hull(lamp, range)).collect();
        let mut program = Program::new(count);
        for (lamp, hull) in hulls.iter().enumerate() {
            let (low, high) = (hull[0][0], hull[hull.len() - 1][0]);
            program.at_most(&[(lamp, 1.0)], high);
            program.at_most(&[(lamp, -1.0)], -low);
            match hull.as_slice() {
                [only] => program.constant += self.weight * only[1],
                [a, b] => {
                    let slope = (b[1] - a[1]) / (b[0] - a[0]);
                    program.cost[lamp] += self.weight * slope;
                    program.constant += self.weight * (a[1] - slope * a[0]);
                }
                corners => {
                    // Cost lies above every piece.
                    let cost = program.variable(1.0);
                    for pair in corners.windows(2) {
                        let ([x, y], [x2, y2]) = (pair[0], pair[1]);
                        let slope = self.weight * (y2 - y) / (x2 - x);
                        program.at_most(&[(lamp, slope), (cost, -1.0)], slope * x - self.weight * y);
                    }
                }
            }
        }
        let reach = self.reach();
        for &sensor in self.asked {
            let (row, place) = (&self.influence.lux[sensor], &self.influence.sensors[sensor]);
            let target = place.target.unwrap_or(0.0) - place.daylight;
            match self.goal {
                Goal::Closest => program.squares(row, target),
                Goal::LeastPower => {
                    let entries = |sign: f64| row.iter().enumerate().map(move |(lamp, lux)| (lamp, sign * lux / reach));
                    let mut low: Vec<(usize, f64)> = entries(-1.0).collect();
                    let mut high: Vec<(usize, f64)> = entries(1.0).collect();
                    if self.elastic {
                        // A lux missing costs more than all power there is can bring.
                        let missing = program.slack(1e3);
                        low.push((missing, -1.0));
                        let surplus = program.slack(1e3);
                        high.push((surplus, -1.0));
                    }
                    program.at_most(&low, -target / reach);
                    if let Some(tolerance) = place.tolerance {
                        program.at_most(&high, (target + tolerance) / reach);
                    }
                }
            }
        }
        let (cost, mut values) = program.solve()?;
        values.truncate(count);
        for (level, hull) in values.iter_mut().zip(&hulls) {
            let (low, high) = (hull[0][0], hull[hull.len() - 1][0]);
            *level = level.clamp(low, high);
            for end in [low, high] {
                if (*level - end).abs() < TINY {
                    *level = end;
                }
            }
        }
        Some((cost, values))
    }

    /// Levels of a relaxation, made possible: what lies below the lowest level is raised to it, or else switched off.
    fn try_rounded(&mut self, levels: &[f64]) {
        let raised = |share: f64| -> Vec<f64> {
            let round = |(level, curve): (&f64, &Vec<[f64; 2]>)| match curve[0][0] {
                _ if *level <= TINY => 0.0,
                least if *level >= least => *level,
                least if *level > share * least => least,
                _ => 0.0,
            };
            levels.iter().zip(&self.curves).map(round).collect()
        };
        [0.0, 0.5].map(raised).into_iter().for_each(|levels| self.offer(levels));
    }

    /// Takes levels over if they are allowed and the best so far.
    fn offer(&mut self, mut levels: Vec<f64>) {
        if !self.elastic && self.goal == Goal::LeastPower && !self.mend(&mut levels) {
            return;
        }
        let cost = self.cost(&levels);
        if self.best.as_ref().is_none_or(|(best, _)| cost < *best) {
            self.best = Some((cost, levels));
        }
    }

    /// Makes up for what rounding left below a target, by the luminaire that does most there. Whether all is met then.
    fn mend(&self, levels: &mut [f64]) -> bool {
        for &sensor in self.asked {
            let place = &self.influence.sensors[sensor];
            let target = place.target.unwrap_or(0.0);
            let lacking = target - self.influence.illuminance(sensor, levels);
            if lacking > 1e-5 * target.max(1.0) {
                return false;
            }
            if lacking > 0.0 {
                let row = &self.influence.lux[sensor];
                let room = (0..row.len()).filter(|&lamp| levels[lamp] > TINY && levels[lamp] < 1.0);
                let Some(lamp) = room.max_by(|&a, &b| row[a].total_cmp(&row[b])) else { continue };
                if row[lamp] > 0.0 {
                    levels[lamp] = (levels[lamp] + lacking * (1.0 + 1e-9) / row[lamp]).min(1.0);
                }
            }
        }
        self.asked.iter().all(|&sensor| {
            let place = &self.influence.sensors[sensor];
            let found = self.influence.illuminance(sensor, levels);
            is_within(found, place.band().unwrap_or([0.0, f64::INFINITY]))
        })
    }

    /// What levels cost in truth.
    fn cost(&self, levels: &[f64]) -> f64 {
        let power = self.weight * self.influence.power(levels);
        let apart = |&sensor: &usize| {
            let place = &self.influence.sensors[sensor];
            let found = self.influence.illuminance(sensor, levels);
            let [target, most] = place.band().unwrap_or([0.0, f64::INFINITY]);
            match self.goal {
                Goal::Closest => (found - target).powi(2),
                Goal::LeastPower if self.elastic => {
                    1e3 * ((target - found).max(0.0) + (found - most).max(0.0)) / self.reach()
                }
                Goal::LeastPower => 0.0,
            }
        };
        power + self.asked.iter().map(apart).sum::<f64>()
    }

    /// Most lux that all luminaires bring to a sensor.
    fn reach(&self) -> f64 {
        let of = |&sensor: &usize| self.influence.lux[sensor].iter().map(|lux| lux.abs()).sum::<f64>();
        self.asked.iter().map(of).fold(1.0, f64::max)
    }

    fn answer(self) -> Answer {
        let (_, levels) = self.best.unwrap_or_else(|| (0.0, vec![1.0; self.influence.luminaires.len()]));
        let power = self.influence.power(&levels);
        let bound = (self.goal == Goal::LeastPower).then(|| power.min(self.left / self.weight));
        Answer { levels, power, bound, missed: Vec::new() }
    }
}

/// min ½ xᵀ P x + cost x + constant, rows x ≤ limits.
struct Program {
    cost: Vec<f64>,
    constant: f64,
    /// Of the first variables, dense; empty where nothing is squared.
    quadratic: Vec<f64>,
    levels: usize,
    /// Column, row, number.
    entries: Vec<(usize, usize, f64)>,
    limits: Vec<f64>,
}

impl Program {
    fn new(levels: usize) -> Self {
        Self {
            cost: vec![0.0; levels],
            constant: 0.0,
            quadratic: Vec::new(),
            levels,
            entries: Vec::new(),
            limits: Vec::new(),
        }
    }

    /// A further variable of any sign.
    fn variable(&mut self, cost: f64) -> usize {
        self.cost.push(cost);
        self.cost.len() - 1
    }

    /// A further variable that is not negative.
    fn slack(&mut self, cost: f64) -> usize {
        let slack = self.variable(cost);
        self.at_most(&[(slack, -1.0)], 0.0);
        slack
    }

    fn at_most(&mut self, row: &[(usize, f64)], limit: f64) {
        let number = self.limits.len();
        self.entries
            .extend(row.iter().filter(|(_, entry)| *entry != 0.0).map(|&(column, entry)| (column, number, entry)));
        self.limits.push(limit);
    }

    /// Adds (row · levels − target)² to the cost.
    fn squares(&mut self, row: &[f64], target: f64) {
        let count = self.levels;
        self.quadratic.resize(count * count, 0.0);
        for (i, a) in row.iter().enumerate() {
            self.cost[i] -= 2.0 * target * a;
            for (j, b) in row.iter().enumerate().take(i + 1) {
                self.quadratic[i * count + j] += 2.0 * a * b;
            }
        }
        self.constant += target * target;
    }

    /// Least cost and the variables that have it; nothing where the limits contradict each other.
    fn solve(mut self) -> Option<(f64, Vec<f64>)> {
        let (rows, columns) = (self.limits.len(), self.cost.len());
        self.entries.sort_by_key(|&(column, row, _)| (column, row));
        let compressed = |entries: &[(usize, usize, f64)], rows: usize| {
            let mut starts = vec![0; columns + 1];
            entries.iter().for_each(|&(column, _, _)| starts[column + 1] += 1);
            (0..columns).for_each(|column| starts[column + 1] += starts[column]);
            let places = entries.iter().map(|&(_, row, _)| row).collect();
            CscMatrix::new(rows, columns, starts, places, entries.iter().map(|&(_, _, entry)| entry).collect())
        };
        let constraints = compressed(&self.entries, rows);
        let count = self.levels;
        // The upper triangle, column by column, on a scale near 1.
        let largest = self.quadratic.iter().fold(0.0_f64, |most, entry| most.max(entry.abs()));
        let unit =
            if largest > 0.0 { largest } else { self.cost.iter().fold(0.0_f64, |most, cost| most.max(cost.abs())) };
        let unit = if unit > 0.0 { unit } else { 1.0 };
        let squared: Vec<(usize, usize, f64)> = (0..if largest > 0.0 { count } else { 0 })
            .flat_map(|column| (0..=column).map(move |row| (column, row)))
            .map(|(column, row)| (column, row, self.quadratic[column * count + row] / unit))
            .collect();
        let quadratic = compressed(&squared, columns);
        let cost: Vec<f64> = self.cost.iter().map(|cost| cost / unit).collect();
        let settings = DefaultSettings { verbose: false, max_iter: 200, ..DefaultSettings::default() };
        let mut solver =
            DefaultSolver::new(&quadratic, &cost, &constraints, &self.limits, &[NonnegativeConeT(rows)], settings)
                .ok()?;
        solver.solve();
        let solved = matches!(solver.solution.status, SolverStatus::Solved | SolverStatus::AlmostSolved);
        let values = std::mem::take(&mut solver.solution.x);
        let finite = values.iter().all(|value| value.is_finite());
        (solved && finite).then_some((solver.solution.obj_val * unit + self.constant, values))
    }
}

//! The results of a simulation, phase by phase.

use super::{Script, Series, TimeStep};
use crate::results::met::is_within;

/// Targets count as met from when on they are met for so long, s: a luminaire's try may miss one for a moment.
pub const HOLD: f64 = 20.0;

/// From one turn to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct Phase {
    /// Its first second.
    pub from: f64,
    /// Its last.
    pub to: f64,
    /// What it began with, in words.
    pub what: Vec<String>,
    /// Time until all targets were met within the band and stayed so for [`HOLD`], s; nothing where they never were.
    pub settled: Option<f64>,
    /// Mean power over the last third, in the unit of the power meter.
    pub power: f64,
    /// That of the optimum.
    pub optimum: f64,
    /// Most that a sensor lacked of its target in the last third, lx.
    pub below: f64,
    /// Most that a sensor had above its target in the last third, lx, of those with a tolerance.
    pub above: f64,
    /// Worst sensor by its mean over the last third: how far that is below the target, or above target + tolerance, lx.
    pub mean_miss: f64,
    /// Whether targets are met at the end: they were within the band for [`HOLD`], and their means are over the last
    /// third.
    pub met: bool,
    /// Sensors whose targets can't be met.
    pub out_of_reach: Vec<usize>,
}

impl Phase {
    /// Power above the optimum's, as a share of it; nothing where the optimum draws nothing. Where targets are missed
    /// it says nothing: see `met`.
    pub fn excess(&self) -> Option<f64> {
        (self.optimum > 0.0).then(|| self.power / self.optimum - 1.0)
    }
}

/// The phases of a series.
pub fn phases(series: &Series, script: &Script) -> Vec<Phase> {
    let ends = series.turns.iter().skip(1).map(|turn| turn.row).chain([series.rows.len()]);
    let phase = |(turn, end): (&super::Turn, usize)| {
        let rows = &series.rows[turn.row..end];
        let tail = &rows[rows.len() - rows.len().div_ceil(3)..];
        let mean = |value: &dyn Fn(&TimeStep) -> f64| tail.iter().map(value).sum::<f64>() / tail.len() as f64;
        let most = |value: &dyn Fn(&TimeStep) -> f64| tail.iter().map(value).fold(0.0, f64::max);
        let mean_miss = |sensor: usize| {
            let seen = &rows[0].seen[sensor];
            let Some(target) = seen.target else { return 0.0 };
            let lux = mean(&|row| row.lux[sensor]);
            let above = seen.tolerance.map_or(0.0, |tolerance| lux - target - tolerance);
            (target - lux).max(above).max(0.0)
        };
        let settled = settled(rows, script);
        let mean_miss = (0..rows[0].lux.len()).map(mean_miss).fold(0.0, f64::max);
        Phase {
            from: turn.time,
            to: rows[rows.len() - 1].time,
            what: turn.what.clone(),
            settled,
            power: mean(&|row| row.power),
            optimum: mean(&|row| row.optimum),
            below: most(&|row| worst(row, |lux, target, _| target - lux)),
            above: most(&|row| worst(row, |lux, target, tolerance| tolerance.map_or(0.0, |_| lux - target))),
            mean_miss,
            met: settled.is_some() && is_within(mean_miss, [0.0, script.band]),
            out_of_reach: turn.out_of_reach.clone(),
        }
    };
    series.turns.iter().zip(ends).map(phase).collect()
}

/// The largest miss of all sensors with a target; at least 0.
fn worst(row: &TimeStep, miss: impl Fn(f64, f64, Option<f64>) -> f64) -> f64 {
    let asked = row.lux.iter().zip(&row.seen);
    asked.filter_map(|(lux, seen)| Some(miss(*lux, seen.target?, seen.tolerance))).fold(0.0, f64::max)
}

/// Whether all targets are met: within the band below, and above within it or the tolerance, where there is one.
fn met(row: &TimeStep, band: f64) -> bool {
    row.lux.iter().zip(&row.seen).all(|(lux, seen)| {
        let Some(target) = seen.target else { return true };
        let most = seen.tolerance.map_or(f64::INFINITY, |tolerance| target + tolerance.max(band));
        is_within(*lux, [target - band, most])
    })
}

/// Time from the first row until targets are met for a while.
fn settled(rows: &[TimeStep], script: &Script) -> Option<f64> {
    let mut since: Option<f64> = None;
    for row in rows {
        if !met(row, script.band) {
            since = None;
            continue;
        }
        let from = *since.get_or_insert(row.time);
        if row.time - from >= HOLD {
            return Some(from - rows[0].time);
        }
    }
    None
}

//! E_min and E_max: the cells that decide them are read once more, by rays that had no part in choosing them.
//!
//! The least of many cells that each err a little reads low, and so does U₀ with it. So, when the passes are over, the
//! darkest cells of every plane, area and surface send further rays: many cells few rays, few cells many. They go on as
//! paths, as method `path` has them: no bias, whatever the photons say, and their scatter is all of their error. The
//! last rays come in two halves, of which each reads the cell that the other one chose: what a reading errs has nothing
//! to do with why the cell was taken, and its scatter is its standard error. The same for the brightest.
//!
//! Where paths hardly find the light (by mirrors, opal covers, small openings) they would read low and not know it. So
//! they are tried first on cells all over the place: if what they find there scatters much, or contradicts the map, the
//! extremes are the map's own, with the standard errors of their cells.

use std::collections::{BTreeMap, HashMap};
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::composition::Density;
use super::engine::Engine;
use super::place::{Cell, Place, worst_of};
use super::{PURPOSE_EXTREMES, Rendering};
use crate::flux::photometric;
use crate::gather::density::Estimate;
use crate::gather::parts::rays::FromPoint;
use crate::gather::sight::Sight;
use crate::gather::smooth::mean_of;
use crate::random::Seed;
use crate::results::{Extremes, Reading, areas};

/// The level of asking at which rays are tried.
const TRIAL: u64 = 3;

/// Independent parts of these rays; even ones make one half, odd ones the other.
const ROUNDS: usize = 8;

/// Cells looked at together, and how often more are looked at while some that were not read lower.
const POOL: usize = 16;
const POOLS: usize = 4;

/// Cells that stay for the second look, and for the last.
const SECOND: usize = 6;
const LAST: usize = 2;

/// Rays of a round and cell in the first look; at most in the second; at most in the last.
const FIRST_RAYS: u64 = 16;
const SECOND_RAYS: u64 = 128;
const LAST_RAYS: u64 = 1024;

/// Standard error that a reading is to have, as a part of it: the map's own claim, within these bounds.
const AIM: [f64; 2] = [0.002, 0.02];

/// Cells all over a place, and rays of each, by which it is tried whether these rays know its light at all; the most
/// that their mean may scatter, and differ from the map's beside that, as parts of it.
const TRIED: usize = 32;
const TRIED_RAYS: u64 = 64;
const MOST_SCATTER: f64 = 0.05;
const MOST_OFF: f64 = 0.02;

/// Cells that read beyond an extreme are set to it where that changes the mean by less than this part of its standard
/// error: where light is even, half of all cells do.
const UNNOTICED: f64 = 0.2;

/// What further rays found at one point, means of each round.
#[derive(Clone)]
struct RoundMeans<const C: usize> {
    /// Light that has bounced, but for [`Place::rest`].
    bounced: [[f64; C]; ROUNDS],
    /// That of faint luminaires.
    faint: [[f64; C]; ROUNDS],
}

impl<const C: usize> RoundMeans<C> {
    /// Photometric mean of the rounds from `first` on, every `step`.
    fn mean(&self, first: usize, step: usize) -> f64 {
        let rounds = (first..ROUNDS).step_by(step);
        let count = rounds.len() as f64;
        rounds.map(|round| self.of_round(round)).sum::<f64>() / count
    }

    fn of_round(&self, round: usize) -> f64 {
        photometric(self.bounced[round]) + photometric(self.faint[round])
    }

    /// Variance of the mean, from the rounds' scatter.
    fn variance(&self) -> f64 {
        let rounds: [f64; ROUNDS] = std::array::from_fn(|round| self.of_round(round));
        mean_of(&rounds).1
    }
}

/// What is known of a cell while others are still in the race: E, as it is, and its variance.
#[derive(Clone, Copy)]
struct Belief {
    point: usize,
    lux: f64,
    variance: f64,
}

impl Belief {
    /// With an independent reading.
    fn with(self, lux: f64, variance: f64) -> Self {
        let whole = self.variance + variance;
        let share = if whole > 0.0 { self.variance / whole } else { 0.0 };
        Self { lux: self.lux + share * (lux - self.lux), variance: share * variance, ..self }
    }
}

/// Which end of a map.
#[derive(Clone, Copy, PartialEq)]
enum End {
    Darkest,
    Brightest,
}

impl End {
    /// A number that is the smaller the more extreme.
    fn rank(self, lux: f64) -> f64 {
        if self == Self::Darkest { lux } else { -lux }
    }

    fn sort(self, beliefs: &mut [Belief]) {
        beliefs.sort_by(|a, b| self.rank(a.lux).total_cmp(&self.rank(b.lux)).then(a.point.cmp(&b.point)));
    }
}

/// Rays of a point, in the order of asking: level, point and rays of a round.
type Asked = (u64, usize, u64);

/// Sends further rays from the points of one place.
struct FurtherRays<'a, const C: usize> {
    sight: &'a Sight<'a, C>,
    place: &'a Place<C>,
    seed: Seed,
    /// What a reading's standard error is to be, as a part of it.
    aim: f64,
    cast: AtomicU64,
}

/// The result of a race for one end of some cells.
struct RaceResult<const C: usize> {
    reading: Reading,
    /// Points read last, what they read, and its variance as a part of the square of what they read.
    last: Vec<(usize, RoundMeans<C>)>,
    relative_variance: f64,
}

impl<const C: usize> Rendering<'_, C> {
    /// Reads the cells that decide E_min and E_max of every plane, area and surface once more.
    pub(super) fn read_extremes(&mut self, engine: &Engine<'_, C>, places: &mut [Place<C>]) {
        if self.composition.density == Some(Density::Paper) {
            return; // the paper's estimator, biases and all
        }
        let first_surface = places.len() - self.scene.surfaces.len();
        let rays_find_all = self.composition.rays.is_some();
        let asked = |index: usize| index < self.scene.planes.len() || index >= first_surface && rays_find_all;
        let asked: Vec<usize> = (0..places.len()).filter(|&index| asked(index)).collect();
        if asked.is_empty() {
            return;
        }
        self.timed("extremes", asked.len() as u64, |this| {
            let own = engine.sight.is_none().then(|| Sight::new(this.scene, engine.caster, false));
            let Some(sight) = engine.sight.as_ref().or(own.as_ref()) else { return };
            for index in asked {
                let parts = this.parts(index, &places[index]);
                let seed = Seed(this.settings.seed).branch(PURPOSE_EXTREMES).branch(index as u64);
                let aim = worst_of(&places[index..=index], Cell::of).clamp(AIM[0], AIM[1]);
                let place = &places[index];
                let reader = FurtherRays { sight, place, seed, aim, cast: AtomicU64::new(0) };
                let (ends, again) = if parts.first().is_some_and(|all| reader.knows(all)) {
                    reader.parts(&parts)
                } else {
                    (parts.iter().map(|part| reader.of_map(part)).collect(), Again::new())
                };
                this.record.prepared_rays += reader.cast.into_inner();
                let again = if this.settings.smooth { again } else { Again::new() };
                places[index].take_over(&parts, ends, again, this.settings.smooth);
                this.progress.advance(1);
            }
        });
    }

    /// Points of a place that have a value: all of them, then those of each area.
    fn parts(&self, index: usize, place: &Place<C>) -> Vec<Vec<usize>> {
        let mut parts = vec![(0..place.len()).collect()];
        if let Some(plane) = self.scene.planes.get(index) {
            let sides = [plane.along.length(), plane.across.length()];
            parts
                .extend(areas::parts(&plane.areas, &plane.name, sides, plane.cells).into_iter().map(|part| part.cells));
        }
        parts.iter_mut().for_each(|points: &mut Vec<usize>| points.retain(|&point| place.site.has_value[point]));
        parts
    }
}

/// What a point is read to be: light that has bounced, but for the rest, and of faint luminaires.
type Again<const C: usize> = BTreeMap<usize, [Estimate<C>; 2]>;

impl<const C: usize> FurtherRays<'_, C> {
    /// Both ends of every part, and the points that were read for them.
    fn parts(&self, parts: &[Vec<usize>]) -> (Vec<[Reading; 2]>, Again<C>) {
        let (mut known, mut again) = (HashMap::new(), Again::new());
        let mut read = |points: &[usize], end| {
            let Some(outcome) = self.race(points, end, &mut known) else { return Reading::default() };
            let relative = outcome.relative_variance;
            for (point, found) in outcome.last {
                let mean = |rounds: &[[f64; C]; ROUNDS]| -> [f64; C] {
                    std::array::from_fn(|c| rounds.iter().map(|light| light[c]).sum::<f64>() / ROUNDS as f64)
                };
                let estimate = |rounds| {
                    let value = mean(rounds);
                    Estimate { value, variance: relative * photometric(value).powi(2) }
                };
                let estimates = [estimate(&found.bounced), estimate(&found.faint)];
                let variance = |estimates: &[Estimate<C>; 2]| estimates[0].variance + estimates[1].variance;
                if again.get(&point).is_none_or(|known| variance(known) > variance(&estimates)) {
                    again.insert(point, estimates);
                }
            }
            outcome.reading
        };
        let both = |points: &Vec<usize>| [End::Darkest, End::Brightest].map(|end| read(points, end));
        (parts.iter().map(both).collect(), again)
    }

    /// Whether these rays find all over a place what the map says of it, with little scatter.
    fn knows(&self, points: &[usize]) -> bool {
        let count = TRIED.min(points.len());
        let tried = (0..count).into_par_iter().map(|index| {
            let point = points[(2 * index + 1) * points.len() / (2 * count)];
            let found = self.from(point, TRIAL, 0, TRIED_RAYS);
            let lux = photometric(Cell::of(self.place, point).value);
            [self.fixed(point).0 + photometric(found[0]) + photometric(found[1]) - lux, lux]
        });
        let tried: Vec<[f64; 2]> = tried.collect();
        let number = count as f64;
        let [off, lux] = [0, 1].map(|part| tried.iter().map(|pair| pair[part]).sum::<f64>() / number);
        let scatter: f64 = tried.iter().map(|pair| (pair[0] - off).powi(2)).sum();
        let error = (scatter / (number * (number - 1.0)).max(1.0)).sqrt();
        error <= MOST_SCATTER * lux && off.abs() <= 3.0 * error + MOST_OFF * lux
    }

    /// What the map says of both ends of some points.
    fn of_map(&self, points: &[usize]) -> [Reading; 2] {
        [End::Darkest, End::Brightest].map(|end| {
            let mut beliefs: Vec<Belief> = points.iter().map(|&point| self.belief(point)).collect();
            end.sort(&mut beliefs);
            beliefs
                .first()
                .map_or_else(Reading::default, |first| Reading { lux: first.lux, error: first.variance.sqrt() })
        })
    }

    fn belief(&self, point: usize) -> Belief {
        let cell = Cell::of(self.place, point);
        Belief { point, lux: photometric(cell.value), variance: cell.variance }
    }

    /// The extreme one of some points; `None` where there is no point.
    fn race(&self, points: &[usize], end: End, known: &mut HashMap<Asked, RoundMeans<C>>) -> Option<RaceResult<C>> {
        let mut waiting: Vec<Belief> = points.iter().map(|&point| self.belief(point)).collect();
        end.sort(&mut waiting);
        let darkest = *waiting.first()?;
        let mut racing: Vec<Belief> = Vec::new();
        let mut rays = FIRST_RAYS;
        let mut relative_variance = 0.0_f64;
        for pool in waiting.chunks_mut(POOL).take(POOLS) {
            let best = racing.iter().map(|belief| end.rank(belief.lux)).fold(f64::INFINITY, f64::min);
            if end.rank(pool[0].lux) >= best {
                break;
            }
            let (_, variance) = self.look(pool, 0, rays, known);
            relative_variance = relative_variance.max(variance);
            racing.extend_from_slice(pool);
        }
        let (mut last, mut dropped) = (Vec::new(), Vec::new());
        for (level, stay, least, most) in [(1, SECOND, FIRST_RAYS, SECOND_RAYS), (2, LAST, FIRST_RAYS, LAST_RAYS)] {
            end.sort(&mut racing);
            dropped.extend(racing.drain(stay.min(racing.len())..));
            rays = self.rays_needed(&racing, rays as f64 * relative_variance).clamp(least, most);
            let before = racing.clone();
            let found;
            (found, relative_variance) = self.look(&mut racing, level, rays, known);
            last = before.into_iter().zip(found).collect();
        }
        let reading = if relative_variance > 0.0 {
            self.crossed(&last, relative_variance, &dropped, end)
        } else {
            Reading { lux: darkest.lux, error: darkest.variance.sqrt() } // no ray has told anything
        };
        let last = last.into_iter().map(|(belief, found)| (belief.point, found)).collect();
        Some(RaceResult { reading, last, relative_variance })
    }

    /// What each half of the last rays says of the cell that the other half chose.
    fn crossed(
        &self,
        last: &[(Belief, RoundMeans<C>)],
        relative_variance: f64,
        dropped: &[Belief],
        end: End,
    ) -> Reading {
        let lux = |index: usize, first: usize, step: usize| {
            let (belief, found) = &last[index];
            self.fixed(belief.point).0 + found.mean(first, step)
        };
        let variance = |index: usize| relative_variance * last[index].1.mean(0, 1).powi(2);
        let extreme = |rank: &dyn Fn(usize) -> f64| {
            (0..last.len()).min_by(|&a, &b| rank(a).total_cmp(&rank(b))).unwrap_or_default()
        };
        let chosen_by = |half: usize| {
            extreme(&|index| end.rank(last[index].0.with(lux(index, half, 2), 2.0 * variance(index)).lux))
        };
        let [a, b] = [chosen_by(0), chosen_by(1)];
        let read = (lux(a, 1, 2) + lux(b, 0, 2)) / 2.0;
        // What the choice may miss: the extreme of all readings errs to the other side.
        let most = extreme(&|index| end.rank(lux(index, 0, 1)));
        let choice = read - lux(most, 0, 1);
        let fixed = self.fixed(last[a].0.point).1.max(self.fixed(last[b].0.point).1);
        // A cell that was dropped may be the extreme one after all.
        let beyond = |cell: &Belief| square_above(end.rank(read) - end.rank(cell.lux), cell.variance.sqrt());
        let missed = dropped.iter().map(beyond).fold(0.0, f64::max);
        let fresh = (variance(a) + variance(b)) / 2.0 + fixed + choice * choice + missed;
        // Where neighbours know the cell better than its rays do, as in light that few paths find, they count, too.
        let [one, other] = [a, b].map(|index| last[index].0);
        let before = Belief { lux: (one.lux + other.lux) / 2.0, variance: one.variance.max(other.variance), ..one };
        let found = if before.variance < fresh {
            before.with(read, fresh)
        } else {
            Belief { lux: read, variance: fresh, ..one }
        };
        Reading { lux: found.lux, error: found.variance.sqrt() }
    }

    /// The part of a point's light that these rays do not read, lx, and its variance; that holds what photons
    /// contradict rays by.
    fn fixed(&self, point: usize) -> (f64, f64) {
        let rest = self.place.rest.get(point).copied().unwrap_or(Estimate::DARK);
        let (mut lux, mut variance) = (photometric(rest.value), rest.variance);
        for part in self.place.straight().filter(|part| !part.can_sample_again()) {
            let light = part.straight(point);
            lux += photometric(light.value);
            variance += light.variance;
        }
        (lux, variance + self.place.doubt(point))
    }

    /// Rays of a round for the error aimed at, where one ray a round leaves this relative variance.
    fn rays_needed(&self, racing: &[Belief], relative_variance: f64) -> u64 {
        let share = |belief: &Belief| {
            if belief.lux > 0.0 { (1.0 - self.fixed(belief.point).0 / belief.lux).clamp(0.0, 1.0) } else { 1.0 }
        };
        let share = racing.iter().map(share).fold(0.0, f64::max);
        // Powers of two: areas that share cells then ask for the same.
        ((relative_variance * (share / self.aim).powi(2)) as u64).max(1).next_power_of_two()
    }

    /// Sends so many rays a round from each point, and learns from them; returns what they found, and its variance as a
    /// part of its square, pooled.
    fn look(
        &self,
        racing: &mut [Belief],
        level: u64,
        rays: u64,
        known: &mut HashMap<Asked, RoundMeans<C>>,
    ) -> (Vec<RoundMeans<C>>, f64) {
        let fresh: Vec<usize> = racing
            .iter()
            .map(|belief| belief.point)
            .filter(|&point| !known.contains_key(&(level, point, rays)))
            .collect();
        let rounds = (0..fresh.len() * ROUNDS).into_par_iter();
        let rounds: Vec<[[f64; C]; 2]> =
            rounds.map(|index| self.from(fresh[index / ROUNDS], level, index % ROUNDS, rays)).collect();
        let found = rounds.as_chunks::<ROUNDS>().0.iter().map(|rounds| RoundMeans {
            bounced: rounds.map(|[bounced, _]| bounced),
            faint: rounds.map(|[_, faint]| faint),
        });
        let found: Vec<RoundMeans<C>> = found.collect();
        known.extend(fresh.into_iter().map(|point| (level, point, rays)).zip(found));
        let found: Vec<RoundMeans<C>> =
            racing.iter().map(|belief| known[&(level, belief.point, rays)].clone()).collect();
        let squares: f64 = found.iter().map(|found| found.mean(0, 1).powi(2)).sum();
        let scatter: f64 = found.iter().map(RoundMeans::variance).sum();
        let relative = if squares > 0.0 { scatter / squares } else { 0.0 };
        if relative > 0.0 {
            for (belief, found) in racing.iter_mut().zip(&found) {
                let light = found.mean(0, 1);
                let (fixed, variance) = self.fixed(belief.point);
                *belief = belief.with(fixed + light, relative * light.powi(2) + variance);
            }
        }
        (found, relative)
    }

    /// One round's rays of a point: means of what has bounced, and of faint luminaires.
    fn from(&self, point: usize, level: u64, round: usize, count: u64) -> [[f64; C]; 2] {
        let seed = self.seed.branch(level).branch(round as u64);
        let from = FromPoint { sight: self.sight, records: None, receiver: &self.place.site.receiver, seed, count };
        let (bounced, paths) = from.find(point, &mut ());
        let (faint, cast) = self.place.sample_straight_again(point, count, self.sight.caster(), seed);
        self.cast.fetch_add(paths + cast, Ordering::Relaxed);
        [bounced, faint].map(|sum| sum.map(|lux| lux / count as f64))
    }
}

/// Mean of max(0, x)² where x is normal with this mean and standard deviation.
fn square_above(mean: f64, deviation: f64) -> f64 {
    if deviation <= 0.0 {
        return mean.max(0.0).powi(2);
    }
    let z = mean / deviation;
    let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
    // Share below z, within 10⁻⁵ (Abramowitz and Stegun 26.2.16).
    let t = 1.0 / (1.0 + 0.332_67 * z.abs());
    let beyond = density * t * (0.436_183_6 + t * (-0.120_167_6 + t * 0.937_298));
    let share = if z > 0.0 { 1.0 - beyond } else { beyond };
    ((mean * mean + deviation * deviation) * share + mean * deviation * density).max(0.0)
}

impl<const C: usize> Place<C> {
    /// Makes what was read again part of the map; a map that is not `smooth` keeps what each of its cells found.
    fn take_over(&mut self, parts: &[Vec<usize>], ends: Vec<[Reading; 2]>, again: Again<C>, smooth: bool) {
        for (point, [light, faint]) in again {
            self.replace(point, light, faint);
        }
        self.extremes.clear();
        for (points, [mut min, mut max]) in parts.iter().zip(ends) {
            if points.is_empty() {
                self.extremes.push(Extremes::default());
                continue;
            }
            let (mean, mean_error) = self.mean(points);
            // No cell is the darkest that is brighter than the mean.
            min.lux = min.lux.min(mean);
            max.lux = max.lux.max(mean);
            self.extremes.push(Extremes { mean_error, min, max });
            if smooth && self.site.smoother.is_some() {
                self.bound(points, [min.lux, max.lux], UNNOTICED * mean_error);
            }
        }
    }

    /// Puts another estimate in the place of what rays found, if it is the better one.
    fn replace(&mut self, point: usize, light: Estimate<C>, faint: Estimate<C>) {
        let rest = self.rest.get(point).copied().unwrap_or(Estimate::DARK);
        let now = self.bounced[point];
        let faint_now: f64 = {
            let sampled = self.straight().filter(|part| part.can_sample_again());
            sampled.map(|part| part.straight(point).variance).sum()
        };
        let grouped = self.groups.is_some();
        let doubt = self.doubt(point);
        let worse = light.variance + faint.variance >= now.variance - rest.variance - doubt + faint_now;
        if worse || (grouped && now.value.iter().any(|lux| *lux <= 0.0)) {
            return;
        }
        let mut whole = rest;
        whole.add(&light);
        whole.variance += doubt;
        if grouped {
            self.scaled.push((point, std::array::from_fn(|c| whole.value[c] / now.value[c])));
        }
        self.bounced[point] = whole;
        self.parts.iter_mut().for_each(|part| part.replace_straight(point, faint));
    }

    /// Keeps smoothed cells within the extremes, where that does not move the mean by more than `most` (lx): smoothing
    /// may not undershoot what the darkest cell was read to be.
    fn bound(&mut self, points: &[usize], [low, high]: [f64; 2], most: f64) {
        let lux: Vec<f64> = points.iter().map(|&point| photometric(Cell::of(self, point).value)).collect();
        let raised = lux.iter().map(|lux| (low - lux).max(0.0)).sum::<f64>();
        let lowered = lux.iter().map(|lux| (lux - high).max(0.0)).sum::<f64>();
        if raised.max(lowered) > most * points.len() as f64 {
            return;
        }
        for (&point, lux) in points.iter().zip(lux) {
            let (bounced, wanted) = (photometric(self.bounced[point].value), lux.clamp(low, high.max(low)));
            let factor = (bounced + wanted - lux) / bounced;
            if wanted != lux && factor.is_finite() && factor > 0.0 {
                self.bounced[point].value.iter_mut().for_each(|channel| *channel *= factor);
                if self.groups.is_some() {
                    self.scaled.push((point, [factor; C]));
                }
            }
        }
    }
}

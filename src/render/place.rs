//! A receiver while its light is computed: its points, the parts of their light, and what those add up to so far.

use std::io;

use crate::embree::RayCaster;
use crate::flux::photometric;
use crate::gather::density::Estimate;
use crate::gather::parts::{GroupRows, LightOrigin, LightPart, PhotonTotal, Site};
use crate::random::Seed;
use crate::results::{Extremes, GroupReading};
use crate::state::tape::Tape;

/// One receiver with all that is known of its light.
pub(super) struct Place<const C: usize> {
    pub(super) site: Site,
    /// The parts of its light; their order never matters but for rounding.
    pub(super) parts: Vec<Box<dyn LightPart<C>>>,
    /// Light that passes find, all parts together, as far as it is known.
    pub(super) bounced: Vec<Estimate<C>>,
    /// What of it only photons find; empty where there is none.
    pub(super) rest: Vec<Estimate<C>>,
    /// The same by light group, where they are told apart; no light before the passes are over.
    pub(super) groups: Option<GroupRows>,
    /// What is known of extremes and mean: of the whole, then of each area.
    pub(super) extremes: Vec<Extremes>,
    /// By what the light that has bounced was multiplied where an extreme was read again: its groups are, too.
    pub(super) scaled: Vec<(usize, [f64; C])>,
}

impl<const C: usize> Place<C> {
    /// Number of its points.
    pub(super) fn len(&self) -> usize {
        self.site.receiver.len()
    }

    /// The parts that are straight from luminaires.
    pub(super) fn straight(&self) -> impl DoubleEndedIterator<Item = &dyn LightPart<C>> {
        self.parts.iter().map(|part| &**part).filter(|part| part.source() == LightOrigin::Luminaires)
    }

    /// Works out what all passes so far say.
    pub(super) fn conclude(&mut self, known: PhotonTotal) {
        let mut bounced = vec![Estimate::DARK; self.len()];
        let mut rest = vec![Estimate::DARK; self.len()];
        for part in &mut self.parts {
            let found = part.conclude(known, &self.site);
            bounced.iter_mut().zip(&found).for_each(|(sum, found)| sum.add(found));
            if part.source() == LightOrigin::PhotonsOnly {
                rest.iter_mut().zip(&found).for_each(|(sum, found)| sum.add(found));
            }
        }
        for part in &self.parts {
            bounced.iter_mut().zip(part.doubt()).for_each(|(sum, doubt)| sum.variance += doubt);
        }
        // Sums over the passes may be below 0, light is not.
        bounced.iter_mut().for_each(|sum| sum.value.iter_mut().for_each(|value| *value = value.max(0.0)));
        (self.bounced, self.rest) = (bounced, rest);
    }

    /// The same by light group, by the choices made for the whole.
    pub(super) fn conclude_groups(&mut self, known: PhotonTotal) {
        let Some(GroupRows { width, variances, .. }) = self.groups else { return };
        let mut rows = GroupRows::dark(self.len(), width, variances);
        self.parts.iter().for_each(|part| part.add_groups(known, &self.site, &mut rows));
        // Groups still add up where the whole was read again.
        for &(point, factors) in &self.scaled {
            let row = &mut rows.light[point * width..][..width];
            for (lux, factor) in row.iter_mut().zip(factors.iter().cycle()) {
                *lux = (f64::from(*lux) * factor) as f32;
            }
        }
        self.groups = Some(rows);
    }

    /// Moves the sums of all parts to or from a checkpoint, another run's state or another process.
    pub(super) fn exchange(&mut self, tape: &mut Tape<'_>) -> io::Result<()> {
        tape.same(self.len(), "points")?;
        self.parts.iter_mut().try_for_each(|part| part.exchange(tape))
    }

    /// Variance that parts of the light have at a point since others contradict them, lx².
    pub(super) fn doubt(&self, point: usize) -> f64 {
        self.parts.iter().filter_map(|part| part.doubt().get(point)).sum()
    }

    /// The sum of `count` samples of direct light that rays can find anew at a point, and the rays they took.
    pub(super) fn sample_straight_again(
        &self,
        point: usize,
        count: u64,
        caster: &RayCaster,
        seed: Seed,
    ) -> ([f64; C], u64) {
        let mut sum = ([0.0; C], 0);
        for part in self.straight().filter(|part| part.can_sample_again()) {
            let (found, cast) = part.sample_again(point, count, &self.site, caster, seed);
            (0..C).for_each(|c| sum.0[c] += found[c]);
            sum.1 += cast;
        }
        sum
    }

    /// Mean of some points, each by its area, and its standard error, lx.
    pub(super) fn mean(&self, points: &[usize]) -> (f64, f64) {
        let weight = |point: usize| self.site.areas.get(point).copied().unwrap_or(1.0);
        let whole: f64 = points.iter().map(|&point| weight(point)).sum();
        let weighted: Vec<(usize, f64)> = points.iter().map(|&point| (point, weight(point) / whole)).collect();
        let mean = weighted.iter().map(|&(point, weight)| weight * photometric(Cell::of(self, point).value)).sum();
        // Densities of neighbours share photons: taken as if all erred together.
        let together = |estimates: &[Estimate<C>]| {
            let error = |&(point, weight): &(usize, f64)| {
                weight * estimates.get(point).map_or(0.0, |estimate| estimate.variance.max(0.0).sqrt())
            };
            weighted.iter().map(error).sum::<f64>().powi(2)
        };
        let bounced = self.parts.iter().filter(|part| part.source() != LightOrigin::Luminaires);
        let by_parts: Vec<f64> = bounced.filter_map(|part| part.variance_of_sum(&weighted)).collect();
        let mut variance = if by_parts.is_empty() {
            together(&self.bounced)
        } else {
            by_parts.iter().sum::<f64>() + together(&self.rest)
        };
        variance += self.straight().rev().filter_map(|part| part.variance_of_sum(&weighted)).sum::<f64>();
        (mean, variance.sqrt())
    }

    /// E of a light group at a point in each channel, lx; 0 where the point has no value.
    pub(super) fn group_value(&self, point: usize, group: usize) -> [f64; C] {
        let Some(groups) = self.groups.as_ref().filter(|_| self.site.has_value[point]) else { return [0.0; C] };
        let at = |rows: &[f32], c| rows.get(point * groups.width + group * C + c).map_or(0.0, |lux| f64::from(*lux));
        let direct = self.straight().find_map(|part| part.straight_groups());
        std::array::from_fn(|c| at(&groups.light, c) + direct.map_or(0.0, |direct| at(&direct.value, c)))
    }

    /// What a light group brings to a sensor.
    pub(super) fn group_reading(&self, point: usize, group: usize) -> GroupReading {
        let Some(groups) = self.groups.as_ref().filter(|_| self.site.has_value[point]) else {
            return GroupReading { illuminance: 0.0, standard_error: 0.0 };
        };
        let index = point * groups.variances + group;
        let direct = self.straight().find_map(|part| part.straight_groups());
        let spread = direct.and_then(|direct| direct.variance.get(index)).map_or(0.0, |variance| f64::from(*variance));
        let variance = groups.variance.get(index).copied().unwrap_or(0.0) + spread;
        GroupReading {
            illuminance: photometric(self.group_value(point, group)),
            standard_error: variance.max(0.0).sqrt(),
        }
    }
}

/// Direct light and what has bounced, of one point together.
pub(super) struct Cell<const C: usize> {
    pub(super) value: [f64; C],
    pub(super) direct: [f64; C],
    pub(super) variance: f64,
}

impl<const C: usize> Cell<C> {
    pub(super) fn of(place: &Place<C>, point: usize) -> Self {
        if !place.site.has_value[point] {
            return Self { value: [0.0; C], direct: [0.0; C], variance: 0.0 };
        }
        let bounced = place.bounced[point];
        let (mut direct, mut variance) = ([0.0; C], bounced.variance);
        for light in place.straight().map(|part| part.straight(point)) {
            (0..C).for_each(|c| direct[c] += light.value[c]);
            variance += light.variance;
        }
        Self { value: std::array::from_fn(|c| bounced.value[c] + direct[c]), direct, variance }
    }

    /// The same with only the error that passes don't reduce.
    pub(super) fn of_direct(place: &Place<C>, point: usize) -> Self {
        let fixed = place.straight().filter(|part| !part.can_sample_again());
        Self { variance: fixed.map(|part| part.straight(point).variance).sum(), ..Self::of(place, point) }
    }

    pub(super) fn rgb(&self) -> [f64; 3] {
        std::array::from_fn(|c| self.value[if C == 1 { 0 } else { c }])
    }
}

/// Claimed standard error of the worst map, plane or surface, relative to its mean; of the worst sensor where there is
/// no map.
pub(super) fn worst_of<const C: usize>(places: &[Place<C>], cell: fn(&Place<C>, usize) -> Cell<C>) -> f64 {
    let of_points = |place: &Place<C>, points: &mut dyn Iterator<Item = usize>| {
        let (mut sum, mut variance, mut whole) = (0.0, 0.0, 0.0_f64);
        for point in points.filter(|&point| place.site.has_value[point]) {
            let (cell, weight) = (cell(place, point), place.site.areas.get(point).copied().unwrap_or(1.0));
            sum += weight * photometric(cell.value);
            variance += weight * cell.variance;
            whole += weight;
        }
        if sum > 0.0 { (variance * whole).sqrt() / sum } else { 0.0 }
    };
    let is_map = |place: &&Place<C>| place.site.receiver.grid.is_some() || !place.site.areas.is_empty();
    if places.iter().any(|place| is_map(&place)) {
        let maps = places.iter().filter(is_map);
        return maps.map(|place| of_points(place, &mut (0..place.len()))).fold(0.0, f64::max);
    }
    let sensors = places.iter().flat_map(|place| (0..place.len()).map(move |point| (place, point)));
    sensors.map(|(place, point)| of_points(place, &mut std::iter::once(point))).fold(0.0, f64::max)
}

/// Mean and largest share of a point's light that weak luminaires may have brought: of the worst receiver.
pub(super) fn left_out<const C: usize>(places: &[Place<C>]) -> [f64; 2] {
    let shares = places.iter().flat_map(|place| &place.parts).filter_map(|part| part.left_out_share());
    shares.fold([0.0; 2], |[mean, most], share| [mean.max(share[0]), most.max(share[1])])
}

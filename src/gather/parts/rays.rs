//! Light that has bounced, found by rays from the points: final gather where they end on surfaces whose light photons
//! know, paths where they go on. Neighbours on a grid are smoothed together; where rays rely on photons, other photons
//! check them.

use std::io;
use std::sync::atomic::{AtomicU64, Ordering};

use super::{GroupRows, LightOrigin, LightPart, PhotonRound, PhotonTotal, RayRound, Site};
use crate::gather::density::Estimate;
use crate::gather::receiver::Receiver;
use crate::gather::sight::{Origins, Records, Sight, ToGroups};
use crate::gather::smooth::{MAP_BATCHES, POINT_BATCHES, Samples};
use crate::gather::witness::{Contradiction, Witness};
use crate::luminaire::LightGroups;
use crate::random::{Seed, low_discrepancy};
use crate::state::tape::Tape;

/// Bytes that a point takes, by channels.
pub fn bytes_per_point(channels: u64) -> u64 {
    128 * channels + 5
}

/// What rays from the points of a receiver found.
pub struct RayLight<const C: usize> {
    samples: Samples<C>,
    /// Random numbers of this receiver's rays.
    seed: Seed,
    /// Rays of a point for each that a point of a grid sends.
    times: u64,
    /// Whether neighbours are smoothed together.
    smooth: bool,
    /// The same light by some photons, to check it.
    witness: Option<Witness>,
    /// What that adds to the variance of each point, lx²; empty without such photons.
    doubt: Vec<f64>,
    contradiction: Option<Contradiction>,
    /// Whether light groups are kept apart, and the windows chosen at each point, which their light is put through.
    in_groups: bool,
    windows: Vec<usize>,
}

impl<const C: usize> RayLight<C> {
    /// None yet from the points of a receiver. `seed` is the receiver's own, `times` the rays of its points for each
    /// that a point of a grid sends; `groups` are those to be kept apart here.
    pub fn new(
        receiver: &Receiver,
        seed: Seed,
        times: u64,
        smooth: bool,
        witness: Option<Witness>,
        groups: Option<&LightGroups>,
    ) -> Self {
        let (points, alone) = (receiver.len(), receiver.grid.is_none());
        let batches = if alone { POINT_BATCHES } else { MAP_BATCHES };
        let samples = match groups {
            Some(groups) => Samples::in_groups(points, batches, groups.width::<C>(), alone),
            None => Samples::new(points, batches),
        };
        let (doubt, windows) = (Vec::new(), Vec::new());
        let in_groups = groups.is_some();
        Self { samples, seed, times, smooth, witness, doubt, contradiction: None, in_groups, windows }
    }
}

/// Rays from one point.
pub struct FromPoint<'a, const C: usize> {
    /// Finds the light that comes along a ray.
    pub sight: &'a Sight<'a, C>,
    /// Where rays may end; without, they go on as paths.
    pub records: Option<Records<'a, C>>,
    /// The receiver.
    pub receiver: &'a Receiver,
    /// Random numbers: a stream for each point.
    pub seed: Seed,
    /// Number of rays.
    pub count: u64,
}

impl<const C: usize> FromPoint<'_, C> {
    /// The sum of what they find, lx, and the rays cast, those onward from where they end included; `origins` receives
    /// where the light comes from.
    pub fn find(&self, point: usize, origins: &mut impl Origins<C>) -> ([f64; C], u64) {
        let (mut sum, mut cast) = ([0.0; C], 0);
        let start = self.receiver.start(point);
        let mut stream = self.seed.stream(point as u64);
        let shift = stream.uniform_pair();
        for ray in 0..self.count {
            let direction = self.receiver.direction(point, low_discrepancy(ray, shift));
            let found = self.sight.incoming_from(start, direction, self.records, &mut stream, &mut cast, origins);
            (0..C).for_each(|c| sum[c] += found[c]);
        }
        (sum, cast)
    }
}

impl<const C: usize> LightPart<C> for RayLight<C> {
    fn source(&self) -> LightOrigin {
        LightOrigin::Surfaces
    }

    fn add_photons(&mut self, round: &PhotonRound<'_, C>, site: &Site) {
        if let (Some(witness), Some(crossings)) = (&mut self.witness, &round.arrived.witnessed) {
            witness.add(&site.receiver, [&crossings.smooth, &crossings.sharp]);
        }
    }

    fn add_rays(&mut self, round: &RayRound<'_, C>, site: &Site) -> u64 {
        let RayRound { number, sight, records, patches, .. } = *round;
        let (seed, count) = (self.seed.branch(number), round.rays * self.times);
        let from = FromPoint { sight, records, receiver: &site.receiver, seed, count };
        let rays = AtomicU64::new(0);
        let find = |point: usize, found: ([f64; C], u64)| {
            debug_assert!(site.has_value[point], "points without a value send no rays");
            rays.fetch_add(found.1, Ordering::Relaxed);
            found.0
        };
        match round.groups.filter(|_| self.in_groups) {
            Some(groups) => self.samples.add_in_groups(number, count, |point, row| match site.has_value[point] {
                true => find(point, from.find(point, &mut ToGroups { groups, patches, row })),
                false => [0.0; C],
            }),
            None => self.samples.add(number, count, |point| match site.has_value[point] {
                true => find(point, from.find(point, &mut ())),
                false => [0.0; C],
            }),
        }
        rays.into_inner()
    }

    fn conclude(&mut self, known: PhotonTotal, site: &Site) -> Vec<Estimate<C>> {
        let mut windows = Vec::new();
        let found = match &site.smoother {
            Some(smoother) if self.smooth => smoother.smooth(&self.samples, &site.has_value, &mut windows),
            _ => self.samples.alone(),
        };
        if let Some(witness) = &self.witness {
            (self.doubt, self.contradiction) = witness.doubt(&self.samples, known.photon);
        }
        self.windows = if self.in_groups { windows } else { Vec::new() };
        found
    }

    fn add_groups(&self, _: PhotonTotal, site: &Site, rows: &mut GroupRows) {
        let means = self.samples.group_means();
        let found = match &site.smoother {
            Some(smoother) if !self.windows.is_empty() => {
                smoother.apply(&self.windows, &means, rows.width, &site.has_value)
            }
            _ => means,
        };
        rows.light.iter_mut().zip(found).for_each(|(sum, lux)| *sum += lux);
        let variances = rows.variances;
        for (index, variance) in rows.variance.iter_mut().enumerate() {
            *variance += self.samples.group_variance(index / variances, index % variances);
        }
    }

    fn exchange(&mut self, tape: &mut Tape<'_>) -> io::Result<()> {
        self.samples.exchange(tape)?;
        self.witness.iter_mut().try_for_each(|witness| witness.exchange(tape))
    }

    fn variance_of_sum(&self, weighted: &[(usize, f64)]) -> Option<f64> {
        Some(self.samples.variance_of_sum(weighted))
    }

    fn doubt(&self) -> &[f64] {
        &self.doubt
    }

    fn contradiction(&self) -> Option<Contradiction> {
        self.contradiction
    }
}

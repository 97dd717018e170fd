//! Light that photons are counted for: caustics in the cells of planes, and all light that photons bring to samples of
//! surfaces and about bodies. Sums with fixed weights, so no photon is kept; neighbouring cells are smoothed together.

use std::io;

use super::{GroupRows, LightOrigin, LightPart, PhotonRound, PhotonTotal, Site};
use crate::gather::counts::Counts;
use crate::gather::density::Estimate;
use crate::gather::smooth::counts::Smoothed;
use crate::state::tape::Tape;

/// Bytes that a point takes, by channels.
pub fn bytes_per_point(channels: u64) -> u64 {
    16 * (channels + 1) + 14
}

/// Photons counted at each point, and how they were smoothed.
pub struct CountedLight<const C: usize> {
    counts: Counts<C>,
    /// What was done to the cells when they were smoothed, which is done to their light groups, too.
    smoothed: Vec<Smoothed>,
}

impl<const C: usize> CountedLight<C> {
    /// Of points that stand for these areas (m²), with rows of `width` numbers for light groups, 0 where there are
    /// none.
    pub fn new(areas: Vec<f64>, width: usize) -> Self {
        Self { counts: Counts::new(areas, width), smoothed: Vec::new() }
    }
}

impl<const C: usize> LightPart<C> for CountedLight<C> {
    fn source(&self) -> LightOrigin {
        LightOrigin::PhotonsOnly
    }

    fn add_photons(&mut self, round: &PhotonRound<'_, C>, _: &Site) {
        round.arrived.met.iter().for_each(|met| self.counts.add(met, round.groups));
    }

    fn conclude(&mut self, known: PhotonTotal, site: &Site) -> Vec<Estimate<C>> {
        let points = 0..site.receiver.len();
        let raw: Vec<Estimate<C>> = points.map(|point| self.counts.estimate(point, known.sets)).collect();
        let Some(smoother) = &site.smoother else { return raw };
        let photon = known.photon / known.sets;
        let quantum = |point: usize| photon / self.counts.area(point).max(f64::MIN_POSITIVE);
        let mut smoothed = Vec::new();
        let found = smoother.smooth_counts(&raw, quantum, &site.has_value, &mut smoothed);
        self.smoothed = smoothed;
        found
    }

    fn add_groups(&self, known: PhotonTotal, site: &Site, rows: &mut GroupRows) {
        let means = self.counts.group_means(known.sets);
        let found = match &site.smoother {
            Some(smoother) if !means.is_empty() => {
                let windows: Vec<usize> = self.smoothed.iter().map(|cell| cell.window).collect();
                let mut fits = smoother.apply(&windows, &means, rows.width, &site.has_value);
                let cells = fits.chunks_mut(rows.width).zip(&self.smoothed);
                cells.for_each(|(row, cell)| row.iter_mut().for_each(|lux| *lux *= cell.restored));
                fits
            }
            _ => means,
        };
        rows.light.iter_mut().zip(found).for_each(|(sum, lux)| *sum += lux);
    }

    fn exchange(&mut self, tape: &mut Tape<'_>) -> io::Result<()> {
        self.counts.exchange(tape)
    }
}

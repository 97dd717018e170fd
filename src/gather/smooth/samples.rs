//! Samples at points in independent batches, whose scatter gives their noise.

use std::io;

use rayon::prelude::*;

use crate::flux::photometric;
use crate::gather::density::Estimate;
use crate::state::Sum;
use crate::state::tape::Tape;

/// Independent parts of the samples of a map, whose scatter is the noise: neighbours' scatter is pooled.
pub const MAP_BATCHES: usize = 8;
/// Those of points without neighbours, whose noise is estimated from their own batches alone: with 16,
/// what is within two standard errors is 93.6 % (Student's t) where a known one has 95.4 %.
pub const POINT_BATCHES: usize = 16;

/// Samples at each point of a receiver, in batches.
pub struct Samples<const C: usize> {
    /// Sum of the samples of each point and batch, lx: point by point.
    sums: Vec<[Sum; C]>,
    /// Samples of a point in each batch.
    counts: Vec<u64>,
    /// The same by light group, where wanted.
    groups: Option<GroupSamples>,
}

/// Samples by light group.
struct GroupSamples {
    /// Numbers in a row of all groups.
    width: usize,
    /// Rows of each point: one for each batch, or one for all.
    rows: usize,
    /// Rows of sums, lx, point by point.
    sums: Vec<Sum>,
}

impl<const C: usize> Samples<C> {
    /// None yet, in `batches` batches. Takes 16 bytes a channel, batch and point.
    pub fn new(points: usize, batches: usize) -> Self {
        Self { sums: vec![[Sum::ZERO; C]; points * batches], counts: vec![0; batches], groups: None }
    }

    /// None yet, light groups apart: `width` numbers each, for each batch too if their variances are wanted.
    /// Takes 16 bytes a number and point more, times `batches` with variances.
    pub fn in_groups(points: usize, batches: usize, width: usize, variances: bool) -> Self {
        let rows = if variances { batches } else { 1 };
        let groups = GroupSamples { width, rows, sums: vec![Sum::ZERO; points * width * rows] };
        Self { groups: Some(groups), ..Self::new(points, batches) }
    }

    fn batches(&self) -> usize {
        self.counts.len()
    }

    /// Adds to each point the sum of `count` samples that `sample` takes there; `round` numbers the rounds.
    pub fn add(&mut self, round: u64, count: u64, sample: impl Fn(usize) -> [f64; C] + Sync) {
        let batch = (round % self.batches() as u64) as usize;
        self.counts[batch] += count;
        self.sums.par_chunks_mut(self.counts.len()).enumerate().with_min_len(32).for_each(|(point, sums)| {
            let found = sample(point);
            (0..C).for_each(|c| sums[batch][c].add(found[c]));
        });
    }

    /// The same with light groups apart: `sample` adds each group's part to a row of sums.
    pub fn add_in_groups(&mut self, round: u64, count: u64, sample: impl Fn(usize, &mut [f64]) -> [f64; C] + Sync) {
        let batches = self.batches();
        let batch = (round % batches as u64) as usize;
        self.counts[batch] += count;
        let Some(GroupSamples { width, rows, sums: groups }) = &mut self.groups else { return };
        let (width, row) = (*width, batch % *rows);
        let points = self.sums.par_chunks_mut(batches).zip(groups.par_chunks_mut(width * *rows));
        let fresh = || vec![0.0; width];
        points.enumerate().with_min_len(32).for_each_init(fresh, |parts, (point, (sums, groups))| {
            parts.fill(0.0);
            let found = sample(point, parts);
            (0..C).for_each(|c| sums[batch][c].add(found[c]));
            let lit = groups[row * width..].iter_mut().zip(&*parts).filter(|(_, part)| **part != 0.0);
            lit.for_each(|(sum, part)| sum.add(*part));
        });
    }

    /// Writes its sums to `tape`, or reads them from it.
    pub fn exchange(&mut self, tape: &mut Tape<'_>) -> io::Result<()> {
        self.counts.iter_mut().try_for_each(|count| tape.count(count))?;
        tape.sums(self.sums.as_flattened_mut())?;
        self.groups.iter_mut().try_for_each(|groups| tape.sums(&mut groups.sums))
    }

    /// Means of the light groups: a row of all groups for each point. None without groups.
    pub fn group_means(&self) -> Vec<f32> {
        let Some(GroupSamples { width, rows, sums }) = &self.groups else { return Vec::new() };
        let per_sample = 1.0 / self.counts.iter().sum::<u64>().max(1) as f64;
        let mean = |point: &[Sum], i: usize| {
            let sum: f64 = (0..*rows).map(|row| point[row * width + i].value()).sum();
            (sum * per_sample) as f32
        };
        let points = sums.par_chunks(width * rows);
        points.flat_map_iter(|point| (0..*width).map(move |i| mean(point, i))).collect()
    }

    /// Variance of the photometric mean of a light group at a point, from the batches' scatter and their number; 0
    /// where batches are not kept.
    pub fn group_variance(&self, point: usize, group: usize) -> f64 {
        let Some(GroupSamples { width, rows, sums }) = &self.groups else { return 0.0 };
        if *rows != self.batches() {
            return 0.0;
        }
        let batch = |batch: usize| -> [f64; C] {
            let row = &sums[(point * rows + batch) * width..][..*width];
            std::array::from_fn(|c| row[group * C + c].value())
        };
        let means: Vec<f64> = self.active().map(|b| photometric(batch(b)) / self.counts[b] as f64).collect();
        let whole: f64 = (0..*rows).map(|b| photometric(batch(b))).sum();
        let mean = whole / self.counts.iter().sum::<u64>().max(1) as f64;
        let scatter: f64 = means.iter().map(|found| (found - mean).powi(2)).sum();
        few(means.len() as f64) * scatter / (means.len() as f64 * (means.len() as f64 - 1.0)).max(1.0)
    }

    pub(super) fn active(&self) -> impl Iterator<Item = usize> {
        (0..self.batches()).filter(|&batch| self.counts[batch] > 0)
    }

    /// Mean of a point.
    fn mean(&self, point: usize) -> [f64; C] {
        let count: u64 = self.counts.iter().sum();
        let sums = &self.sums[point * self.batches()..][..self.batches()];
        std::array::from_fn(|c| sums.iter().map(|sum| sum[c].value()).sum::<f64>() / count.max(1) as f64)
    }

    /// Photometric mean of a batch.
    pub(super) fn batch_mean(&self, point: usize, batch: usize) -> f64 {
        photometric(self.sums[point * self.batches() + batch].map(Sum::value)) / self.counts[batch] as f64
    }

    /// Variance of the photometric mean, from the batches' scatter.
    fn variance(&self, point: usize) -> f64 {
        let mean = photometric(self.mean(point));
        let (mut scatter, mut batches) = (0.0, 0.0_f64);
        for batch in self.active() {
            scatter += (self.batch_mean(point, batch) - mean).powi(2);
            batches += 1.0;
        }
        scatter / (batches * (batches - 1.0)).max(1.0)
    }

    /// Variance of Σ weight · mean over points (photometric), from the scatter of the batches: so what the points have
    /// in common, the photons behind their records, counts in full. Wider by what a scatter of few batches may miss:
    /// the variance of Student's t.
    pub fn variance_of_sum(&self, weighted: &[(usize, f64)]) -> f64 {
        let batch = |batch: usize| -> f64 {
            weighted.iter().map(|&(point, weight)| weight * self.batch_mean(point, batch)).sum()
        };
        let sums: Vec<f64> = self.active().map(batch).collect();
        let free = sums.len() as f64 - 1.0;
        mean_of(&sums).1 * if free > 2.0 { free / (free - 2.0) } else { 3.0 }
    }

    /// Every point by itself: mean, and variance of the mean.
    pub fn plain(&self) -> Vec<Estimate<C>> {
        let points = 0..self.sums.len() / self.batches();
        points.map(|point| Estimate { value: self.mean(point), variance: self.variance(point) }).collect()
    }

    /// The same with the variance of points that have no neighbours, from their own batches alone; see [`few`].
    pub fn alone(&self) -> Vec<Estimate<C>> {
        let factor = few(self.active().count() as f64);
        let mut estimates = self.plain();
        estimates.iter_mut().for_each(|estimate| estimate.variance *= factor);
        estimates
    }
}

/// The samples of some points together.
pub struct Together {
    /// Photometric mean, lx.
    pub mean: f64,
    /// Its variance, lx².
    pub variance: f64,
}

impl<const C: usize> Samples<C> {
    /// The mean of some points.
    pub fn together(&self, points: &[usize]) -> Together {
        let of_batch = |batch: usize| {
            points.iter().map(|&point| self.batch_mean(point, batch)).sum::<f64>() / points.len().max(1) as f64
        };
        let means: Vec<f64> = self.active().map(of_batch).collect();
        let (mean, variance) = mean_of(&means);
        Together { mean, variance: few(means.len() as f64) * variance }
    }
}

/// Mean of independent parts, and its variance from their scatter; 0 and 0 of none.
pub fn mean_of(parts: &[f64]) -> (f64, f64) {
    let count = parts.len().max(1) as f64;
    let mean = parts.iter().sum::<f64>() / count;
    let scatter: f64 = parts.iter().map(|part| (part - mean).powi(2)).sum();
    (mean, scatter / (count * (count - 1.0)).max(1.0))
}

/// What a variance found from the scatter of a few batches is multiplied by, so that 68.27 % of errors are within its
/// square root: the square of Student's t for that share, 1 + 1/(2 ν) + 1/(4 ν²) + 1/(16 ν³), with ν = `batches` − 1
/// degrees of freedom (Cornish & Fisher 1938; 1 % too low for ν = 1). 1 for fewer than two.
pub fn few(batches: f64) -> f64 {
    if batches < 2.0 {
        return 1.0;
    }
    let per = 1.0 / (batches - 1.0);
    (1.0 + per * (0.5 + per * (0.25 + per * 0.0625))).powi(2)
}

//! Light by the density of photons that cross a plane: smooth light by the k nearest, with several k side by side;
//! light with edges over discs of a ladder of radii about single points; all of it at once by the paper's estimator.

use std::f64::consts::{FRAC_PI_2, PI};
use std::io;

use rayon::prelude::*;

use super::{GroupRows, LightOrigin, LightPart, PhotonRound, PhotonTotal, Site};
use crate::gather::bandwidth::{FIXED, SCALES, choose, of_ladder};
use crate::gather::density::{
    Estimate, EstimateSum, GroupSums, LADDER, SearchLimits, local_linear_in_groups, local_linear_within, paper,
};
use crate::luminaire::LightGroups;
use crate::photon_map::with_tree;
use crate::state::Sum;
use crate::state::tape::Tape;

/// Bytes that a point takes, by channels: sums of each k, what it concludes, and the point's surroundings.
pub fn bytes_per_point(channels: u64, is_paper: bool) -> u64 {
    let (scales, visible) = if is_paper { (1, 0) } else { (SCALES.len() as u64, 264) };
    scales * 16 * (channels + 1) + 8 * channels + 8 + visible
}

/// Sums over the sets of photons of several estimates at each point, side by side, and which of them was chosen.
struct DensitySums<const C: usize> {
    /// Estimates of a point.
    of_point: usize,
    /// Point by point.
    whole: Vec<EstimateSum<C>>,
    /// The same by light group.
    groups: Option<GroupedSums>,
    /// Number of the estimate chosen at each point.
    chosen: Vec<u8>,
}

/// Sums of each light group: E of each, then variances, as the sums of the whole lie.
struct GroupedSums {
    /// Numbers of E, and of E and variances.
    width: usize,
    stride: usize,
    rows: Vec<Sum>,
}

impl<const C: usize> DensitySums<C> {
    fn new(points: usize, of_point: usize, groups: Option<(&LightGroups, usize)>) -> Self {
        let groups = groups.map(|(groups, variances)| {
            let width = groups.width::<C>();
            let stride = width + variances;
            GroupedSums { width, stride, rows: vec![Sum::ZERO; points * of_point * stride] }
        });
        Self { of_point, whole: vec![EstimateSum::NONE; points * of_point], groups, chosen: Vec::new() }
    }

    /// Adds an estimate to each sum of each point, and the groups' parts to theirs.
    fn add<S>(
        &mut self,
        scratch: impl Fn() -> S + Sync + Send,
        estimate: impl Fn(usize, usize, &mut S, Option<GroupSums<'_>>) -> Estimate<C> + Sync + Send,
    ) {
        let points = self.whole.par_chunks_mut(self.of_point);
        let Some(GroupedSums { width, stride, rows }) = &mut self.groups else {
            points.enumerate().with_min_len(8).for_each_init(scratch, |scratch, (point, sums)| {
                (0..).zip(sums).for_each(|(index, sum)| sum.add(&estimate(point, index, scratch, None)));
            });
            return;
        };
        let (width, stride) = (*width, *stride);
        let fresh = || (scratch(), vec![0.0; stride]);
        let points = points.zip(rows.par_chunks_mut(self.of_point * stride)).enumerate().with_min_len(8);
        points.for_each_init(fresh, |(scratch, row), (point, (sums, rows))| {
            for (index, (sum, of_groups)) in sums.iter_mut().zip(rows.chunks_mut(stride)).enumerate() {
                row.fill(0.0);
                let (lux, variance) = row.split_at_mut(width);
                sum.add(&estimate(point, index, scratch, Some(GroupSums { lux, variance })));
                of_groups.iter_mut().zip(&*row).for_each(|(sum, part)| sum.add(*part));
            }
        });
    }

    fn exchange(&mut self, tape: &mut Tape<'_>) -> io::Result<()> {
        self.whole.iter_mut().try_for_each(|sum| sum.exchange(tape))?;
        self.groups.iter_mut().try_for_each(|groups| tape.sums(&mut groups.rows))
    }

    /// Adds the groups' sums of the estimates that were chosen; `sets` sets of photons are in them.
    fn add_groups(&self, sets: f64, rows: &mut GroupRows) {
        let Some(GroupedSums { width, stride, rows: sums }) = self.groups.as_ref().filter(|_| !self.chosen.is_empty())
        else {
            return;
        };
        let chosen = |point: usize| {
            let first = (point * self.of_point + usize::from(self.chosen[point])) * stride;
            sums[first..][..*stride].split_at(*width)
        };
        rows.light.par_chunks_mut(*width).enumerate().with_min_len(64).for_each(|(point, row)| {
            let sums = row.iter_mut().zip(chosen(point).0);
            sums.for_each(|(lux, sum)| *lux = (f64::from(*lux) + sum.value() / sets) as f32);
        });
        let variances = rows.variances;
        for (index, variance) in rows.variance.iter_mut().enumerate() {
            let (point, group) = (index / variances, index % variances);
            *variance += chosen(point).1[group].value() / (sets * sets);
        }
    }
}

/// Light that met a diffuse surface, as the density of the k nearest photons.
pub struct SmoothDensity<const C: usize> {
    sums: DensitySums<C>,
    /// Multiples of k that stand side by side.
    scales: &'static [f64],
    /// Whether the user has set k.
    fixed: bool,
}

impl<const C: usize> SmoothDensity<C> {
    /// None yet at `points` points; `groups` with the number of those whose variance is kept.
    pub fn new(points: usize, fixed: bool, groups: Option<(&LightGroups, usize)>) -> Self {
        let scales = Self::scales(fixed);
        Self { sums: DensitySums::new(points, scales.len(), groups), scales, fixed }
    }

    /// Multiples of k that stand side by side.
    pub fn scales(fixed: bool) -> &'static [f64] {
        if fixed { &FIXED } else { &SCALES }
    }
}

impl<const C: usize> LightPart<C> for SmoothDensity<C> {
    fn source(&self) -> LightOrigin {
        LightOrigin::Surfaces
    }

    fn add_photons(&mut self, round: &PhotonRound<'_, C>, site: &Site) {
        let chosen = &round.arrived.maps[1];
        if chosen.is_empty() {
            return;
        }
        let (scales, search) = (self.scales, round.search);
        with_tree!(chosen, |map| self.sums.add(
            || map.scratch(),
            |point, scale, scratch, groups| {
                if !site.has_value[point] {
                    return Estimate::DARK;
                }
                let nearest = ((search.nearest as f64 * scales[scale]) as usize).max(2);
                let (at, around) = (site.receiver.points[point], &site.visible[point]);
                local_linear_in_groups(map, at, SearchLimits { nearest, ..search }, around, scratch, groups)
            },
        ));
    }

    fn conclude(&mut self, known: PhotonTotal, site: &Site) -> Vec<Estimate<C>> {
        let scales = self.scales.len();
        let of = |scale: usize| self.sums.whole.chunks(scales).map(|sums| sums[scale].mean(known.sets)).collect();
        let mut chosen = Vec::new();
        let all = (0..scales).map(of).collect();
        let found = choose(all, self.scales, self.fixed, site.receiver.grid, &site.has_value, |scale| {
            chosen.push(scale as u8);
        });
        self.sums.chosen = chosen;
        found
    }

    fn add_groups(&self, known: PhotonTotal, _: &Site, rows: &mut GroupRows) {
        self.sums.add_groups(known.sets, rows);
    }

    fn exchange(&mut self, tape: &mut Tape<'_>) -> io::Result<()> {
        self.sums.exchange(tape)
    }
}

/// Share of a disc that a point sees, at least: a plane may meet its room in no more than a point.
const SMALLEST_SHARE: f64 = 1e-6;

/// Light with edges at single points, over discs each of half the radius of the one before.
pub struct Discs<const C: usize> {
    sums: DensitySums<C>,
    /// Radius of the widest disc, and the least of any, m.
    widest: f32,
    floor: f32,
}

impl<const C: usize> Discs<C> {
    /// None yet at `points` points; `groups` with the number of those whose variance is kept.
    pub fn new(points: usize, widest: f32, floor: f32, groups: Option<(&LightGroups, usize)>) -> Self {
        Self { sums: DensitySums::new(points, LADDER, groups), widest, floor }
    }
}

impl<const C: usize> LightPart<C> for Discs<C> {
    fn source(&self) -> LightOrigin {
        LightOrigin::PhotonsOnly
    }

    fn add_photons(&mut self, round: &PhotonRound<'_, C>, site: &Site) {
        let chosen = &round.arrived.maps[0];
        if chosen.is_empty() {
            return;
        }
        let (widest, floor) = (self.widest, self.floor);
        with_tree!(chosen, |map| self.sums.add(
            || map.scratch(),
            |point, disc, scratch, groups| {
                if !site.has_value[point] {
                    return Estimate::DARK;
                }
                let radius = (widest * 0.5_f32.powi(disc as i32)).max(floor);
                let (at, around) = (site.receiver.points[point], &site.visible[point]);
                local_linear_within(map, at, radius, around, scratch, groups)
            },
        ));
    }

    fn conclude(&mut self, known: PhotonTotal, site: &Site) -> Vec<Estimate<C>> {
        let widest = f64::from(self.widest);
        // The kernel's peak over its mean is 2.
        let quantum = 2.0 * known.photon / known.sets / (PI * widest * widest);
        let mut chosen = Vec::new();
        let found = self.sums.whole.chunks(LADDER).zip(&site.visible).map(|(sums, around)| {
            let discs: Vec<Estimate<C>> = sums.iter().map(|sum| sum.mean(known.sets)).collect();
            // Where walls leave little of the disc, one photon would bring more.
            let open = around.view(self.widest).moments().one / FRAC_PI_2;
            let (disc, found) = of_ladder(&discs, quantum / open.max(SMALLEST_SHARE));
            chosen.push(disc as u8);
            found
        });
        let found = found.collect();
        self.sums.chosen = chosen;
        found
    }

    fn add_groups(&self, known: PhotonTotal, _: &Site, rows: &mut GroupRows) {
        self.sums.add_groups(known.sets, rows);
    }

    fn exchange(&mut self, tape: &mut Tape<'_>) -> io::Result<()> {
        self.sums.exchange(tape)
    }
}

/// All light by the paper's estimator as printed, biases and all.
pub struct PaperDensity<const C: usize>(Vec<EstimateSum<C>>);

impl<const C: usize> PaperDensity<C> {
    /// None yet at `points` points.
    pub fn new(points: usize) -> Self {
        Self(vec![EstimateSum::NONE; points])
    }
}

impl<const C: usize> LightPart<C> for PaperDensity<C> {
    fn source(&self) -> LightOrigin {
        LightOrigin::Surfaces
    }

    fn add_photons(&mut self, round: &PhotonRound<'_, C>, site: &Site) {
        let Site { receiver, on_surface, has_value, .. } = site;
        let chosen = if *on_surface { round.landed } else { &round.arrived.maps[0] };
        let points = self.0.par_iter_mut().enumerate().with_min_len(64);
        with_tree!(chosen, |map| {
            points.filter(|(point, _)| has_value[*point]).for_each_init(
                || map.scratch(),
                |scratch, (point, sum)| {
                    let [u, v] = receiver.points[point];
                    let at = if *on_surface { receiver.position(point).to_array() } else { [u, v, 0.0] };
                    sum.add(&paper(map, at, round.search, scratch));
                },
            );
        });
    }

    fn conclude(&mut self, known: PhotonTotal, _: &Site) -> Vec<Estimate<C>> {
        self.0.iter().map(|sum| sum.mean(known.sets)).collect()
    }

    fn exchange(&mut self, tape: &mut Tape<'_>) -> io::Result<()> {
        self.0.iter_mut().try_for_each(|sum| sum.exchange(tape))
    }
}

//! Light groups: which of the luminaires brings what, told by the photons and rays of the whole.
//!
//! Every estimate here is a sum, with weights, over photons and rays that each know their luminaire. So a group's light is
//! the same sum over its own part, with the weights chosen for the whole (windows of the smoothing, k of the densities): a
//! run traces nothing more for its groups, and they add up to the whole. A group's part may read a little below 0 where the
//! whole does not, since weights of polynomial fits may.

use rayon::prelude::*;

use super::{Place, Rendering};
use crate::error::OptionError;
use crate::flux::photometric;
use crate::gather::density::{GroupSums, LADDER};
use crate::gather::receiver::Receiver;
use crate::gather::smooth::POINT_BATCHES;
use crate::gather::smooth::counts::Smoothed;
use crate::luminaire::LightGroups;
use crate::render::plan::Method;
use crate::results::{GroupMap, GroupReading};
use crate::scene::Measure;
use crate::state::Sum;

/// Most memory that light groups may take, bytes.
const MOST_MEMORY: f64 = 4e9;

/// Light by group at the points of a receiver. Rows are laid out as [`LightGroups`] says.
pub(super) struct PlaceGroups {
    /// Numbers in a row.
    width: usize,
    /// Groups whose variance is kept: all of sensors, none of maps.
    variances: usize,
    /// Sharp light over discs, and smooth light by several k: rows of [`DensityRows`] as the sums of the whole lie.
    pub(super) sharp: Vec<Sum>,
    pub(super) smooth: Vec<Sum>,
    pub(super) layout: DensityRows,
    /// Which disc, and which k, was chosen at each point.
    pub(super) sharp_scales: Vec<u8>,
    pub(super) smooth_scales: Vec<u8>,
    /// Which window of the smoothing was: of what rays found, and of photons in cells.
    pub(super) windows: Vec<usize>,
    pub(super) counted_windows: Vec<Smoothed>,
    /// Light that has bounced: a row for each point.
    bounced: Vec<f32>,
    /// Variance of the photometric value of that, lx²: for each point, of each group.
    variance: Vec<f64>,
}

/// A row of sums of a density: E of each group, then variances.
#[derive(Clone, Copy)]
pub(super) struct DensityRows {
    /// Numbers of E.
    width: usize,
    /// Numbers of E and of variances.
    pub(super) stride: usize,
}

impl DensityRows {
    /// A row of sums set to nothing.
    pub(super) fn sums<'a>(&self, row: &'a mut [f64]) -> GroupSums<'a> {
        row.fill(0.0);
        let (lux, variance) = row.split_at_mut(self.width);
        GroupSums { lux, variance }
    }
}

impl<const C: usize> Rendering<'_, C> {
    /// The groups to be told apart, if asked for and if there are several.
    ///
    /// # Errors
    /// Where the method knows of none, or they would take too much memory.
    pub(super) fn choose_groups(&mut self) -> Result<(), OptionError> {
        let groups = LightGroups::of(&self.scene.luminaires);
        if !self.settings.groups || groups.len() < 2 {
            return Ok(());
        }
        if self.plan.method == Method::Seed {
            return Err(OptionError::GroupsOfSeed);
        }
        let scene = self.scene;
        let body = scene.sensors.iter().find(|sensor| sensor.measure != Measure::Plane);
        if let (true, Some(sensor)) = (self.plan.counts_photons(), body) {
            let (sensor, measure) = (sensor.name.clone(), sensor.measure.name());
            return Err(OptionError::GroupsOnBody { sensor, measure });
        }
        let of_points = |points: usize, variances: usize| {
            let grid = variances == 0;
            let estimates = self.discs(grid) + self.smooth_scales() + usize::from(grid && self.counts_sharp());
            let densities = estimates * (groups.width::<C>() + variances);
            let rows = if variances > 0 { POINT_BATCHES } else { 1 };
            // Direct light, samples, their means, what smoothing makes of them, the map itself; densities.
            let row = groups.width::<C>() * (4 + 16 * rows + 4 + 4 + 4) + 8 * variances + 16 * densities;
            points as f64 * row as f64
        };
        let cells: usize = scene.planes.iter().map(|plane| plane.len()).sum();
        let bytes = of_points(cells, 0) + of_points(scene.sensors.len(), groups.len());
        if bytes > MOST_MEMORY {
            let points = cells + scene.sensors.len();
            return Err(OptionError::GroupsTooLarge { groups: groups.len(), points, bytes, most: MOST_MEMORY });
        }
        self.groups = Some(groups);
        Ok(())
    }

    /// Estimates over discs at a point.
    pub(super) fn discs(&self, in_cells: bool) -> usize {
        if self.counts_sharp() && !in_cells { LADDER } else { 0 }
    }

    /// Estimates of smooth light at a point.
    pub(super) fn smooth_scales(&self) -> usize {
        if self.has_smooth_densities() { self.scales().len() } else { 0 }
    }

    /// Empty sums for a receiver.
    pub(super) fn place_groups(&self, receiver: &Receiver) -> Option<PlaceGroups> {
        let groups = self.groups.as_ref()?;
        let (width, points) = (groups.width::<C>(), receiver.len());
        let variances = if receiver.grid.is_some() { 0 } else { groups.len() };
        let layout = DensityRows { width, stride: width + variances };
        let rows = |estimates: usize| {
            vec![Sum::ZERO; if receiver.is_plane() { points * estimates * layout.stride } else { 0 }]
        };
        Some(PlaceGroups {
            width,
            variances,
            sharp: rows(self.discs(receiver.cells_count)),
            smooth: rows(self.smooth_scales()),
            layout,
            sharp_scales: Vec::new(),
            smooth_scales: Vec::new(),
            windows: Vec::new(),
            counted_windows: Vec::new(),
            bounced: Vec::new(),
            variance: Vec::new(),
        })
    }

    /// Their names; none where groups are not told apart.
    pub(super) fn group_names(&self) -> &[String] {
        self.groups.as_ref().map_or(&[], |groups| groups.names())
    }

    /// The part of a light group in a map.
    pub(super) fn group_map(&self, place: &Place<C>, group: usize) -> GroupMap {
        let values: Vec<[f64; C]> = (0..place.receiver.len()).map(|point| place.group_value(point, group)).collect();
        let rgb = |value: &[f64; C]| std::array::from_fn(|c| value[if C == 1 { 0 } else { c }] as f32);
        GroupMap {
            illuminance: values.iter().map(|value| photometric(*value) as f32).collect(),
            rgb: self.plan.coloured.then(|| values.iter().map(rgb).collect()),
        }
    }

    /// What all passes say of each group's light that has bounced, by the choices made for the whole.
    pub(super) fn conclude_groups(&mut self, places: &mut [Place<C>]) {
        if self.groups.is_none() {
            return;
        }
        let passes = self.density_passes();
        self.timed("light groups", places.len() as u64, |this| {
            for place in places {
                let Place { receiver, has_value, smoother, samples, counts, groups: Some(groups), .. } = place else {
                    continue;
                };
                let counted = counts.as_ref().map_or_else(Vec::new, |counts| counts.group_means(passes));
                let counted = match smoother {
                    Some(smoother) if !counted.is_empty() => {
                        let windows: Vec<usize> = groups.counted_windows.iter().map(|cell| cell.window).collect();
                        let mut fits = smoother.apply(&windows, &counted, groups.width, has_value);
                        let cells = fits.chunks_mut(groups.width).zip(&groups.counted_windows);
                        cells.for_each(|(row, cell)| row.iter_mut().for_each(|lux| *lux *= cell.restored));
                        fits
                    }
                    _ => counted,
                };
                let means = samples.as_ref().map_or_else(Vec::new, |samples| samples.group_means());
                groups.bounced = match smoother {
                    Some(smoother) if !groups.windows.is_empty() => {
                        smoother.apply(&groups.windows, &means, groups.width, has_value)
                    }
                    _ if samples.is_some() => means,
                    _ => vec![0.0; receiver.len() * groups.width],
                };
                let variance = |point: usize, group: usize| {
                    samples.as_ref().map_or(0.0, |samples| samples.group_variance(point, group))
                };
                let points = 0..if groups.variances > 0 { receiver.len() } else { 0 };
                groups.variance = points
                    .flat_map(|point| (0..groups.variances).map(move |group| (point, group)))
                    .map(|(p, g)| variance(p, g))
                    .collect();
                groups.bounced.iter_mut().zip(&counted).for_each(|(lux, counted)| *lux += counted);
                groups.add_densities(passes);
                groups.scale(&place.scaled);
                this.progress.advance(1);
            }
        });
    }
}

impl PlaceGroups {
    /// Multiplies the channels of some points, so that groups still add up where the whole was read again.
    fn scale<const C: usize>(&mut self, scaled: &[(usize, [f64; C])]) {
        for &(point, factors) in scaled {
            let row = &mut self.bounced[point * self.width..][..self.width];
            for (lux, factor) in row.iter_mut().zip(factors.iter().cycle()) {
                *lux = (f64::from(*lux) * factor) as f32;
            }
        }
    }

    /// Adds the densities that were chosen at each point; `passes` of them are in the sums.
    fn add_densities(&mut self, passes: f64) {
        let Self { width, variances, sharp, smooth, layout, sharp_scales, smooth_scales, bounced, variance, .. } = self;
        let (width, variances, stride) = (*width, *variances, layout.stride);
        for (sums, scales) in [(sharp, sharp_scales), (smooth, smooth_scales)] {
            if sums.is_empty() || scales.is_empty() {
                continue;
            }
            let of_point = sums.len() / scales.len();
            let chosen =
                |point: usize| sums[point * of_point + usize::from(scales[point]) * stride..][..stride].split_at(width);
            bounced.par_chunks_mut(width).enumerate().with_min_len(64).for_each(|(point, row)| {
                let sums = row.iter_mut().zip(chosen(point).0);
                sums.for_each(|(lux, sum)| *lux = (f64::from(*lux) + sum.value() / passes) as f32);
            });
            for (index, variance) in variance.iter_mut().enumerate() {
                let (point, group) = (index / variances, index % variances);
                *variance += chosen(point).1[group].value() / (passes * passes);
            }
        }
    }
}

impl<const C: usize> Place<C> {
    /// E of a light group at a point in each channel, lx; 0 where the point has no value.
    fn group_value(&self, point: usize, group: usize) -> [f64; C] {
        let Some(groups) = self.groups.as_ref().filter(|_| self.has_value[point]) else { return [0.0; C] };
        let direct = self.direct.as_ref().and_then(|light| light.groups.as_ref());
        let at = |rows: &[f32], c| rows.get(point * groups.width + group * C + c).map_or(0.0, |lux| f64::from(*lux));
        std::array::from_fn(|c| at(&groups.bounced, c) + direct.map_or(0.0, |direct| at(&direct.value, c)))
    }

    /// What a light group brings to a sensor.
    pub(super) fn group_reading(&self, point: usize, group: usize) -> GroupReading {
        let Some(groups) = self.groups.as_ref().filter(|_| self.has_value[point]) else {
            return GroupReading { illuminance: 0.0, standard_error: 0.0 };
        };
        let index = point * groups.variances + group;
        let direct = self.direct.as_ref().and_then(|light| light.groups.as_ref());
        let spread = direct.and_then(|direct| direct.variance.get(index)).map_or(0.0, |variance| f64::from(*variance));
        let variance = groups.variance.get(index).copied().unwrap_or(0.0) + spread;
        GroupReading {
            illuminance: photometric(self.group_value(point, group)),
            standard_error: variance.max(0.0).sqrt(),
        }
    }
}

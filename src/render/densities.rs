//! What photons say where they are measured, pass by pass, and what all passes say together.
//!
//! Light with edges (caustics; all that is direct, to `photons`) is counted in the cells of grids, and over discs of a
//! ladder of radii about single points: sums with fixed weights, so noise falls as 1/√(passes) and no photon is kept.
//! Light that met a diffuse surface is the density of the k nearest, in each pass anew.

use rayon::prelude::*;

use super::{Place, Rendering, Searches};
use crate::flux::photometric;
use crate::gather::bandwidth::{FIXED, SCALES, choose, of_ladder};
use crate::gather::density::{
    Estimate, EstimateSum, GroupSums, LADDER, Search, local_linear_in_groups, local_linear_within, paper,
};
use crate::gather::receiver::{Crossings, Photons};
use crate::photon_map::{NearestPhotons, PhotonMap};
use crate::render::groups::DensityRows;
use crate::render::plan::Method;
use crate::state::Sum;

use super::passes::ROUNDS;

/// Sums over the passes of what photons say at each point: rows of several estimates a point.
pub(super) struct Densities<const C: usize> {
    /// Sharp light over discs of the [`LADDER`]; empty on grids, whose cells count it.
    pub(super) sharp: Vec<EstimateSum<C>>,
    /// Smooth light by several k; see [`SCALES`].
    pub(super) smooth: Vec<EstimateSum<C>>,
}

impl<const C: usize> Densities<C> {
    /// None yet, of so many estimates.
    pub(super) fn new(sharp: usize, smooth: usize) -> Self {
        Self { sharp: vec![EstimateSum::NONE; sharp], smooth: vec![EstimateSum::NONE; smooth] }
    }
}

impl<const C: usize> Rendering<'_, C> {
    /// Adds the densities of one set of photons at every point.
    pub(super) fn gather<T: NearestPhotons>(
        &mut self,
        places: &mut [Place<C>],
        crossings: Vec<Crossings<C>>,
        landings: Photons<C>,
        searches: Searches,
    ) {
        let stored = |photons: &Photons<C>| photons.positions.len() as u64;
        let crossed: u64 = crossings.iter().map(|c| stored(&c.sharp) + stored(&c.smooth)).sum();
        let all = stored(&landings) + crossed;
        self.photons_stored += all;
        if all == 0 {
            return;
        }
        let (maps, surfaces) = self.timed("build trees", 1, |this| {
            let maps: Vec<[PhotonMap<T, C>; 2]> = this.maps(crossings);
            (maps, PhotonMap::<T, C>::build(landings.positions, landings.flux))
        });
        let points = places.iter().map(|place| place.receiver.len() as u64).sum();
        self.timed("gather", points, |this| {
            for (place, [sharp, smooth]) in places.iter_mut().zip(&maps).filter(|(place, _)| place.receiver.is_plane())
            {
                if this.plan.method == Method::Seed {
                    this.papers_densities(place, sharp, &surfaces, searches.smooth);
                } else {
                    this.add_discs(place, sharp);
                    this.add_smooth(place, smooth, searches.smooth);
                }
                this.progress.advance(place.receiver.len() as u64);
            }
        });
    }

    /// The photon maps of each receiver: sharp and smooth light apart; all in the first for `seed`, which knows no such
    /// difference.
    fn maps<T: NearestPhotons>(&self, crossings: Vec<Crossings<C>>) -> Vec<[PhotonMap<T, C>; 2]> {
        crossings
            .into_par_iter()
            .map(|Crossings { mut sharp, mut smooth, sources }| {
                if self.plan.method == Method::Seed {
                    sharp.append(&mut smooth);
                }
                let [first, second] = sources;
                [(sharp, first), (smooth, second)].map(|(photons, sources)| match &self.groups {
                    None => PhotonMap::build(photons.positions, photons.flux),
                    Some(groups) => {
                        let marks = sources.into_iter().map(|luminaire| groups.group(luminaire));
                        PhotonMap::build_marked(photons.positions, photons.flux, marks)
                    }
                })
            })
            .collect()
    }

    /// Adds one pass's estimates by the paper's estimator.
    fn papers_densities<T: NearestPhotons>(
        &self,
        place: &mut Place<C>,
        crossed: &PhotonMap<T, C>,
        surfaces: &PhotonMap<T, C>,
        search: Search,
    ) {
        let Place { receiver, on_surface, has_value, density, .. } = place;
        let fresh = || (crossed.scratch(), surfaces.scratch());
        let points = density.smooth.par_iter_mut().enumerate().with_min_len(64);
        points.filter(|(point, _)| has_value[*point]).for_each_init(fresh, |scratch, (point, sum)| {
            let [u, v] = receiver.points[point];
            sum.add(&if *on_surface {
                paper(surfaces, receiver.position(point).to_array(), search, &mut scratch.1)
            } else {
                paper(crossed, [u, v, 0.0], search, &mut scratch.0)
            });
        });
    }

    /// Adds what one set of photons says of sharp light over each point's discs.
    fn add_discs<T: NearestPhotons>(&self, place: &mut Place<C>, map: &PhotonMap<T, C>) {
        let Place { receiver, has_value, surroundings, density, groups, .. } = place;
        if map.is_empty() || density.sharp.is_empty() {
            return;
        }
        let widest = self.searches.sharp.radius;
        let groups = groups.as_mut().map(|groups| (&mut groups.sharp, groups.layout));
        add_rows(
            &mut density.sharp,
            LADDER,
            groups,
            || map.scratch(),
            |point, disc, scratch, groups| {
                if !has_value[point] {
                    return Estimate::DARK;
                }
                let radius = disc_radius(widest, disc).max(self.searches.sharp.floor);
                local_linear_within(map, receiver.points[point], radius, &surroundings[point], scratch, groups)
            },
        );
    }

    /// Adds what one set of photons says of smooth light with each k.
    fn add_smooth<T: NearestPhotons>(&self, place: &mut Place<C>, map: &PhotonMap<T, C>, search: Search) {
        let Place { receiver, has_value, surroundings, density, groups, .. } = place;
        if map.is_empty() || density.smooth.is_empty() {
            return;
        }
        let scales = self.scales();
        let groups = groups.as_mut().map(|groups| (&mut groups.smooth, groups.layout));
        add_rows(
            &mut density.smooth,
            scales.len(),
            groups,
            || map.scratch(),
            |point, scale, scratch, groups| {
                if !has_value[point] {
                    return Estimate::DARK;
                }
                let nearest = ((search.nearest as f64 * scales[scale]) as usize).max(2);
                let search = Search { nearest, ..search };
                local_linear_in_groups(map, receiver.points[point], search, &surroundings[point], scratch, groups)
            },
        );
    }

    /// Multiples of k that are tried; the paper knows one.
    pub(super) fn scales(&self) -> &'static [f64] {
        match self.plan.method {
            Method::Seed => &[1.0],
            _ if self.settings.nearest.is_some() => &FIXED,
            _ => &SCALES,
        }
    }

    /// Whether photons are counted in the cells of grids and over discs: where there may be light with edges among what
    /// passes find.
    pub(super) fn counts_sharp(&self) -> bool {
        let sharp = self.plan.caustics || self.plan.method == Method::Photons;
        self.plan.photons && self.plan.method != Method::Seed && sharp
    }

    /// Whether smooth light is a density of photons.
    pub(super) fn has_smooth_densities(&self) -> bool {
        self.plan.photons && !self.plan.method.sends_rays()
    }

    /// Sets of photons, each of the luminaires' whole flux, in the sums.
    pub(super) fn density_passes(&self) -> f64 {
        f64::from(self.done.len()) * if self.plan.method.sends_rays() { ROUNDS as f64 } else { 1.0 }
    }

    /// Flux of a photon, lm.
    fn photon(&self, passes: f64) -> f64 {
        let emitted = photometric(self.flux.mean(passes.max(1.0)).emitted);
        emitted * passes / self.photons_emitted.max(1) as f64
    }

    /// What the passes so far say of light that has bounced.
    pub(super) fn conclude(&mut self, places: &mut [Place<C>]) {
        self.timed("smooth", 1, |this| places.iter_mut().for_each(|place| this.conclude_at(place)));
    }

    fn conclude_at(&self, place: &mut Place<C>) {
        let passes = self.density_passes();
        let mut bounced = vec![Estimate::DARK; place.receiver.len()];
        let mut add = |found: Vec<Estimate<C>>| bounced.iter_mut().zip(found).for_each(|(sum, found)| sum.add(&found));
        add(self.smooth_light(place, passes));
        let sharp = self.sharp_light(place, passes);
        // What rays from the points do not find: on samples and about bodies photons may stand for all light.
        if place.samples.is_some() || place.receiver.is_plane() {
            place.rest.clone_from(&sharp);
        }
        add(sharp);
        let Place { has_value, smoother, samples, faint, groups, witness, doubt, contradiction, .. } = place;
        if let Some(samples) = samples {
            let mut windows = Vec::new();
            add(match smoother {
                Some(smoother) if self.settings.smooth => smoother.smooth(samples, has_value, &mut windows),
                _ => samples.alone(),
            });
            if let Some(witness) = witness {
                (*doubt, *contradiction) = witness.doubt(samples, self.photon(passes));
                add(doubt.iter().map(|&variance| Estimate { variance, ..Estimate::DARK }).collect());
            }
            groups.iter_mut().for_each(|groups| groups.windows = std::mem::take(&mut windows));
        }
        if let Some(faint) = faint {
            faint.light = match smoother {
                Some(smoother) => smoother.smooth(&faint.samples, has_value, &mut Vec::new()),
                None => faint.samples.alone(),
            };
        }
        // Sums over the passes may be below 0, light is not.
        bounced.iter_mut().for_each(|sum| sum.value.iter_mut().for_each(|value| *value = value.max(0.0)));
        place.bounced = bounced;
    }

    /// Light that met diffuse surfaces, where its photons' density tells it.
    fn smooth_light(&self, place: &mut Place<C>, passes: f64) -> Vec<Estimate<C>> {
        let Place { receiver, has_value, density, groups, .. } = place;
        if density.smooth.is_empty() {
            return Vec::new();
        }
        let (factors, scales) = (self.scales(), self.scales().len());
        let of = |scale: usize| density.smooth.chunks(scales).map(|sums| sums[scale].mean(passes)).collect();
        let fixed = self.settings.nearest.is_some() || self.plan.method == Method::Seed;
        let mut chosen = Vec::new();
        let found = choose((0..scales).map(of).collect(), factors, fixed, receiver.grid, has_value, |scale| {
            chosen.push(scale as u8)
        });
        groups.iter_mut().for_each(|groups| groups.smooth_scales = std::mem::take(&mut chosen));
        found
    }

    /// Light with edges: counted in cells, on samples and about bodies; over discs about single points.
    fn sharp_light(&self, place: &mut Place<C>, passes: f64) -> Vec<Estimate<C>> {
        let Place { receiver, has_value, smoother, density, counts, groups, surroundings, .. } = place;
        if let Some(counts) = counts {
            let raw: Vec<Estimate<C>> = (0..receiver.len()).map(|point| counts.estimate(point, passes)).collect();
            let Some(smoother) = smoother else { return raw };
            let photon = self.photon(passes) / passes;
            let quantum = |point: usize| photon / counts.area(point).max(f64::MIN_POSITIVE);
            let mut windows = Vec::new();
            let found = smoother.smooth_counts(&raw, quantum, has_value, &mut windows);
            groups.iter_mut().for_each(|groups| groups.counted_windows = std::mem::take(&mut windows));
            return found;
        }
        if density.sharp.is_empty() {
            return Vec::new();
        }
        let widest = f64::from(self.searches.sharp.radius);
        // The kernel's peak over its mean is 2.
        let quantum = 2.0 * self.photon(passes) / passes / (std::f64::consts::PI * widest * widest);
        let mut chosen = Vec::new();
        let found = density.sharp.chunks(LADDER).zip(surroundings.iter()).map(|(sums, around)| {
            let discs: Vec<Estimate<C>> = sums.iter().map(|sum| sum.mean(passes)).collect();
            // Where walls leave little of the disc, one photon would bring the more.
            let open = around.view(widest as f32).moments().one / std::f64::consts::FRAC_PI_2;
            let (disc, found) = of_ladder(&discs, quantum / open.max(SMALLEST_SHARE));
            chosen.push(disc as u8);
            found
        });
        let found = found.collect();
        groups.iter_mut().for_each(|groups| groups.sharp_scales = std::mem::take(&mut chosen));
        found
    }
}

/// Share of a disc that a point sees, at least: a plane may meet its room in no more than a point.
const SMALLEST_SHARE: f64 = 1e-6;

/// Radius of a disc of the ladder whose widest has `widest`, m.
fn disc_radius(widest: f32, disc: usize) -> f32 {
    widest * 0.5_f32.powi(disc as i32)
}

/// Adds an estimate to each sum of each point, `width` of them a point, and the groups' parts to their rows.
fn add_rows<S, const C: usize>(
    sums: &mut [EstimateSum<C>],
    width: usize,
    groups: Option<(&mut Vec<Sum>, DensityRows)>,
    scratch: impl Fn() -> S + Sync + Send,
    estimate: impl Fn(usize, usize, &mut S, Option<GroupSums<'_>>) -> Estimate<C> + Sync + Send,
) {
    let points = sums.par_chunks_mut(width);
    match groups {
        None => points.enumerate().with_min_len(8).for_each_init(scratch, |scratch, (point, sums)| {
            (0..).zip(sums).for_each(|(index, sum)| sum.add(&estimate(point, index, scratch, None)));
        }),
        Some((rows, layout)) => {
            let fresh = || (scratch(), vec![0.0; layout.stride]);
            let points = points.zip(rows.par_chunks_mut(width * layout.stride)).enumerate().with_min_len(8);
            points.for_each_init(fresh, |(scratch, row), (point, (sums, rows))| {
                let each = sums.iter_mut().zip(rows.chunks_mut(layout.stride));
                for (index, (sum, of_groups)) in each.enumerate() {
                    sum.add(&estimate(point, index, scratch, Some(layout.sums(row))));
                    of_groups.iter_mut().zip(&*row).for_each(|(sum, part)| sum.add(*part));
                }
            });
        }
    }
}

//! Passes: independent photons and rays, until the map is known well enough.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use rayon::prelude::*;

use super::results::Cell;
use super::{Densities, PURPOSE_PHOTONS, PURPOSE_SIGHT, Place, Rendering, SENSOR_RAYS, Searches};
use crate::embree::RayCaster;
use crate::gather::bandwidth::{FIXED, SCALES, choose};
use crate::gather::counts::{CountRecorder, Counts, Met, Watched};
use crate::gather::density::{Estimate, Search, local_linear, paper};
use crate::gather::patches::{PatchGrid, PatchLight, PatchRecorder};
use crate::gather::receiver::{CrossingRecorder, Crossings, Keep, LandingRecorder, Photons, Receiver};
use crate::gather::sight::{Records, Sight};
use crate::photon::flux::photometric;
use crate::photon::random::Seed;
use crate::photon::trace::{Tally, Tracer};
use crate::photon_map::{NearestPhotons, PhotonMap};
use crate::scene::plan::Method;

/// Parts of a pass with photons and rays of their own, so that even one pass knows its scatter.
const ROUNDS: u64 = 4;

/// A patch's size as a part of the mean distance that points look: as fine as their mean over a hemisphere needs.
const PATCH_SHARE: f64 = 1.0 / 10.0;

/// Radius of the disc about a body in which photons are counted, in largest search radii.
const DISC_SHARE: f32 = 0.2;

/// What rays of a point look at before patches are cut: tells how far they look.
const SCOUTS: u64 = 4096;

impl<const C: usize> Rendering<'_, C> {
    /// Passes until one of the limits is met.
    pub(super) fn passes<T: NearestPhotons>(&mut self, places: &mut [Place<C>], caster: &RayCaster) {
        let engine = Engine::new(self, places, caster);
        let mut next_check = 1;
        loop {
            let started = Instant::now();
            self.pass::<T>(&engine, places);
            self.passes += 1;
            let enough = self.settings.passes.is_some_and(|most| self.passes >= most);
            let taken = started.elapsed().as_secs_f64();
            let late = self.settings.time.is_some_and(|limit| self.started.elapsed().as_secs_f64() + taken > limit);
            let last = enough || late || self.progress.interrupted();
            let asked = self.settings.error.is_some() && self.passes >= next_check;
            if last || asked {
                self.conclude::<T>(places);
                let claim = worst_of(places, Cell::of);
                self.progress.pass(self.passes, 100.0 * claim);
                let Some(target) = self.settings.error.map(|percent| percent / 100.0) else { return };
                if last || claim <= target {
                    return;
                }
                let floor = worst_of(places, Cell::of_direct);
                if floor > target {
                    self.warnings.push(format!(
                        "--error {}: direct light at shadows' edges alone is uncertain by {:.3} %, and passes do not mend it",
                        100.0 * target,
                        100.0 * floor,
                    ));
                    return;
                }
                // The error falls as 1/√passes at best: no use in asking earlier. Asking costs as much as a pass or two.
                let passes = f64::from(self.passes);
                let needed = (passes * (claim / target).powi(2)).clamp(1.4 * passes, 2.0 * passes);
                next_check = self.passes.max(needed as u32 - 1) + 1;
            }
        }
    }

    /// One pass: trace, build, gather.
    fn pass<T: NearestPhotons>(&mut self, engine: &Engine<'_, C>, places: &mut [Place<C>]) {
        let pass = u64::from(self.passes);
        // What rays can't find, caustics, is left to all photons so far; other densities are a matter of one pass.
        let mut crossings = std::mem::take(&mut self.caustics);
        crossings.resize_with(places.len(), Crossings::default);
        let mut landings = Photons::default();
        let rounds = if self.plan.method.sends_rays() { ROUNDS } else { 1 };
        for round in pass * rounds..(pass + 1) * rounds {
            let mut light = None;
            if let Some(tracer) = &engine.tracer {
                let caught =
                    self.timed("trace photons", tracer.photons(), |this| this.trace(tracer, engine, places, round));
                for met in &caught.met {
                    if let Some(counts) = &mut places[met.receiver as usize].counts {
                        counts.add(met);
                    }
                }
                self.flux.add(&caught.flux);
                self.photons_emitted += tracer.photons();
                for (all, mut new) in crossings.iter_mut().zip(caught.crossings) {
                    all.sharp.append(&mut new.sharp);
                    all.smooth.append(&mut new.smooth);
                }
                landings = caught.landings;
                light = engine
                    .grid
                    .as_ref()
                    .map(|grid| self.timed("build records", 1, |_| PatchLight::new(grid, &caught.patches)));
            }
            if let Some(sight) = &engine.sight {
                let points = places.iter().map(|place| place.receiver.len() as u64).sum();
                let records = engine.grid.as_ref().zip(light.as_ref()).map(|(grid, light)| Records { grid, light });
                self.timed("gather rays", points, |this| {
                    for (index, place) in places.iter_mut().enumerate() {
                        this.look(sight, records, index, place, round);
                    }
                });
            }
        }
        if self.plan.method.sends_rays() {
            self.caustics = crossings;
        } else {
            let searches = self.searches.of_pass(self.passes);
            self.gather::<T>(places, crossings, landings, searches);
        }
    }

    /// What each receiver and surface caught of one round's photons.
    fn trace<'p>(
        &self,
        tracer: &Tracer<'_, C>,
        engine: &'p Engine<'_, C>,
        places: &[Place<C>],
        round: u64,
    ) -> Caught<'p, C> {
        let receivers: Vec<&Receiver> = places.iter().map(|place| &place.receiver).collect();
        let seed = Seed(self.settings.seed).branch(PURPOSE_PHOTONS);
        let advance = |photons| self.progress.advance(photons);
        let count = |keep| CountRecorder::new(&engine.watched, &self.scene.mesh, keep);
        let mut caught = Caught::default();
        match (self.plan.method, &engine.grid) {
            (Method::Gather, Some(grid)) => {
                let watched: &[&Receiver] = if self.plan.caustics { &receivers } else { &[] };
                let others = || (CrossingRecorder::new(watched, Keep::Caustics), count(Keep::Caustics));
                let record = || (PatchRecorder::new(grid), others());
                let (records, flux) = tracer.trace(seed, round, record, advance);
                let (patches, others): (_, Vec<_>) = records.into_iter().unzip();
                let (crossings, met) = others.into_iter().unzip();
                caught.met = CountRecorder::merge(met);
                (caught.patches, caught.crossings, caught.flux) = (patches, CrossingRecorder::merge(crossings), flux);
            }
            (Method::Seed, _) => {
                let others = || (LandingRecorder::new(), count(Keep::All));
                let record = || (CrossingRecorder::new(&receivers, Keep::All), others());
                let (records, flux) = tracer.trace(seed, round, record, advance);
                let (crossings, others): (_, Vec<_>) = records.into_iter().unzip();
                let (landings, met) = others.into_iter().unzip();
                caught.met = CountRecorder::merge(met);
                caught.crossings = CrossingRecorder::merge(crossings);
                (caught.landings, caught.flux) = (LandingRecorder::merge(landings), flux);
            }
            (method, _) => {
                let keep = if method == Method::Photons { Keep::All } else { Keep::Bounced };
                let record = || (CrossingRecorder::new(&receivers, keep), count(keep));
                let (records, flux) = tracer.trace(seed, round, record, advance);
                let (crossings, met) = records.into_iter().unzip();
                caught.met = CountRecorder::merge(met);
                (caught.crossings, caught.flux) = (CrossingRecorder::merge(crossings), flux);
            }
        }
        caught
    }

    /// One round's rays from every point of a receiver.
    fn look(
        &mut self,
        sight: &Sight<'_, C>,
        records: Option<Records<'_, C>>,
        index: usize,
        place: &mut Place<C>,
        round: u64,
    ) {
        let Place { receiver, has_value, samples: Some(samples), .. } = place else { return };
        let alone = if receiver.grid.is_some() { 1 } else { u64::from(SENSOR_RAYS) };
        let count = u64::from(self.settings.rays).div_ceil(ROUNDS) * alone;
        let seed = Seed(self.settings.seed).branch(PURPOSE_SIGHT).branch(index as u64).branch(round);
        let rays = AtomicU64::new(0);
        samples.add(round, count, |point| {
            let mut sum = [0.0; C];
            if !has_value[point] {
                return sum;
            }
            let mut stream = seed.stream(point as u64);
            let shift = stream.uniform_pair();
            let mut cast = 0;
            for ray in 0..count {
                let direction = receiver.direction(point, low_discrepancy(ray, shift));
                let found = sight.incoming(receiver.start(point), direction, records, &mut stream, &mut cast);
                (0..C).for_each(|c| sum[c] += found[c]);
            }
            rays.fetch_add(cast, Ordering::Relaxed);
            sum
        });
        self.gather_rays += rays.into_inner();
        self.progress.advance(receiver.len() as u64);
    }

    /// Adds one pass's densities at every point.
    fn gather<T: NearestPhotons>(
        &mut self,
        places: &mut [Place<C>],
        crossings: Vec<Crossings<C>>,
        landings: Photons<C>,
        searches: Searches,
    ) {
        let stored = |photons: &Photons<C>| photons.positions.len() as u64;
        self.photons_stored +=
            stored(&landings) + crossings.iter().map(|c| stored(&c.sharp) + stored(&c.smooth)).sum::<u64>();
        let (maps, surfaces) = self.timed("build trees", 1, |this| {
            let maps: Vec<[PhotonMap<T, C>; 2]> = this.maps(crossings);
            (maps, PhotonMap::<T, C>::build(landings.positions, landings.flux))
        });
        let points = places.iter().map(|place| place.receiver.len() as u64).sum();
        self.timed("gather", points, |this| {
            for (place, maps) in places.iter_mut().zip(&maps).filter(|(place, _)| place.receiver.is_plane()) {
                this.densities(place, maps, &surfaces, searches);
            }
        });
    }

    /// The photon maps of each receiver: sharp and smooth light apart; all in the first for `seed`, which knows no such
    /// difference.
    fn maps<T: NearestPhotons>(&self, crossings: Vec<Crossings<C>>) -> Vec<[PhotonMap<T, C>; 2]> {
        crossings
            .into_par_iter()
            .map(|Crossings { mut sharp, mut smooth }| {
                if self.plan.method == Method::Seed {
                    sharp.append(&mut smooth);
                }
                [PhotonMap::build(sharp.positions, sharp.flux), PhotonMap::build(smooth.positions, smooth.flux)]
            })
            .collect()
    }

    /// Adds one pass's estimates at every point of a receiver.
    fn densities<T: NearestPhotons>(
        &self,
        place: &mut Place<C>,
        [sharp, smooth]: &[PhotonMap<T, C>; 2],
        surfaces: &PhotonMap<T, C>,
        Searches { sharp: near, smooth: wide }: Searches,
    ) {
        let Place { receiver, on_surface, has_value, surroundings, density, .. } = place;
        let fresh = || (sharp.scratch(), smooth.scratch(), surfaces.scratch());
        let scales = self.scales();
        density.par_iter_mut().enumerate().with_min_len(64).for_each_init(fresh, |scratch, (point, sums)| {
            if !has_value[point] {
                return;
            }
            let [u, v] = receiver.points[point];
            if self.plan.method == Method::Seed {
                sums.smooth[0].add(&if *on_surface {
                    paper(surfaces, receiver.position(point).to_array(), wide, &mut scratch.2)
                } else {
                    paper(sharp, [u, v, 0.0], wide, &mut scratch.0)
                });
                return;
            }
            for (scale, &factor) in scales.iter().enumerate() {
                let scaled =
                    |search: Search| Search { nearest: ((search.nearest as f64 * factor) as usize).max(2), ..search };
                let around = &surroundings[point];
                if !sharp.is_empty() {
                    sums.sharp[scale].add(&local_linear(sharp, [u, v], scaled(near), around, &mut scratch.0));
                }
                if !smooth.is_empty() {
                    sums.smooth[scale].add(&local_linear(smooth, [u, v], scaled(wide), around, &mut scratch.1));
                }
            }
        });
        self.progress.advance(receiver.len() as u64);
    }

    /// Multiples of k that are tried; the paper knows one.
    fn scales(&self) -> &'static [f64] {
        match self.plan.method {
            Method::Seed => &[1.0],
            _ if self.settings.nearest.is_some() => &FIXED,
            _ => &SCALES,
        }
    }

    /// What the passes so far say of light that has bounced.
    fn conclude<T: NearestPhotons>(&mut self, places: &mut [Place<C>]) {
        let mut passes = f64::from(self.passes);
        if self.plan.method.sends_rays() && self.plan.photons && self.plan.caustics {
            // All photons so far make one map, of passes · ROUNDS times the flux.
            places.iter_mut().for_each(|place| place.density.fill(Default::default()));
            let searches = Searches::new(self.plan.method, self.settings, self.diagonal, self.photons_emitted as f64);
            self.photons_stored = 0;
            self.gather::<T>(places, self.caustics.clone(), Photons::default(), searches);
            passes *= ROUNDS as f64;
        }
        let (scales, fixed) =
            (self.scales().len(), self.settings.nearest.is_some() || self.plan.method == Method::Seed);
        self.timed("smooth", 1, |_| {
            for place in places {
                let Place { receiver, has_value, smoother, density, samples, counts, bounced, .. } = place;
                let mean = |sum: &Estimate<C>| Estimate {
                    value: sum.value.map(|value| value / passes),
                    variance: sum.variance / (passes * passes),
                };
                let best = |kind: fn(&Densities<C>) -> &[Estimate<C>; SCALES.len()]| {
                    let scale = |scale: usize| density.iter().map(|sums| mean(&kind(sums)[scale])).collect();
                    choose((0..scales).map(scale).collect(), fixed, receiver.grid, has_value)
                };
                *bounced = best(|sums| &sums.sharp);
                bounced.iter_mut().zip(best(|sums| &sums.smooth)).for_each(|(sum, found)| sum.add(&found));
                if let Some(counts) = counts {
                    (0..).zip(bounced.iter_mut()).for_each(|(point, sum)| sum.add(&counts.estimate(point, passes)));
                }
                let Some(samples) = samples else { continue };
                let found = match smoother {
                    Some(smoother) => smoother.smooth(samples, has_value),
                    None => samples.plain(),
                };
                bounced.iter_mut().zip(found).for_each(|(sum, found)| sum.add(&found));
            }
        });
    }
}

/// Claimed standard error of the worst map, plane or surface, relative to its mean; of the worst sensor where there is no
/// map.
fn worst_of<const C: usize>(places: &[Place<C>], cell: fn(&Place<C>, usize) -> Cell<C>) -> f64 {
    let of_points = |place: &Place<C>, points: &mut dyn Iterator<Item = usize>| {
        let (mut sum, mut variance, mut whole) = (0.0, 0.0, 0.0_f64);
        for point in points.filter(|&point| place.has_value[point]) {
            let (cell, weight) = (cell(place, point), place.areas.get(point).copied().unwrap_or(1.0));
            sum += weight * photometric(cell.value);
            variance += weight * cell.variance;
            whole += weight;
        }
        if sum > 0.0 { (variance * whole).sqrt() / sum } else { 0.0 }
    };
    let is_map = |place: &&Place<C>| place.receiver.grid.is_some() || !place.areas.is_empty();
    if places.iter().any(|place| is_map(&place)) {
        let maps = places.iter().filter(is_map);
        return maps.map(|place| of_points(place, &mut (0..place.receiver.len()))).fold(0.0, f64::max);
    }
    let sensors = places.iter().flat_map(|place| (0..place.receiver.len()).map(move |point| (place, point)));
    sensors.map(|(place, point)| of_points(place, &mut std::iter::once(point))).fold(0.0, f64::max)
}

/// Point `index` of the R₂ sequence (Roberts 2018), shifted about the unit square.
fn low_discrepancy(index: u64, [u, v]: [f32; 2]) -> [f32; 2] {
    let along = |shift: f32, step: f64| ((f64::from(shift) + index as f64 * step).fract() as f32).min(0.999_999_9);
    [along(u, 0.754_877_666_246_692_8), along(v, 0.569_840_290_998_053_3)]
}

/// What a run keeps from pass to pass.
struct Engine<'a, const C: usize> {
    tracer: Option<Tracer<'a, C>>,
    sight: Option<Sight<'a, C>>,
    grid: Option<PatchGrid>,
    /// What photons are counted for at each receiver.
    watched: Vec<Watched<'a>>,
}

impl<'a, const C: usize> Engine<'a, C> {
    fn new(run: &Rendering<'a, C>, places: &mut [Place<C>], caster: &'a RayCaster) -> Self {
        let (scene, method) = (run.scene, run.plan.method);
        let rounds = if method.sends_rays() { ROUNDS } else { 1 };
        let photons = run.settings.photons.div_ceil(rounds);
        let tracer = (method != Method::Path).then(|| Tracer::new(scene, caster, photons));
        let sight = method.sends_rays().then(|| Sight::new(scene, caster, method == Method::Path));
        let grid = (method == Method::Gather).then(|| {
            let size = PATCH_SHARE * mean_sight(run, places, caster);
            let height = (2e-4 * run.diagonal).min(2e-3);
            let useful = |material: u32| scene.materials[material as usize].reflectance.iter().any(|&part| part > 0.0);
            PatchGrid::new(&scene.mesh, useful, size as f32, height as f32)
        });
        Self { tracer, sight, grid, watched: watched(run, places, caster) }
    }
}

/// What photons are to be counted for at each receiver, with counts made ready for it.
fn watched<'a, const C: usize>(
    run: &Rendering<'a, C>,
    places: &mut [Place<C>],
    caster: &RayCaster,
) -> Vec<Watched<'a>> {
    let counted = run.plan.photons && (!run.plan.method.sends_rays() || run.plan.caustics);
    if !counted || places.iter().all(|place| place.receiver.is_plane()) {
        return Vec::new();
    }
    let first = places.len() - run.scene.surfaces.len();
    let of = |(index, place): (usize, &mut Place<C>)| {
        let watched = match (place.receiver.bodies(), index.checked_sub(first)) {
            ([], None) => return Watched::Nothing,
            ([], Some(surface)) => Watched::Surface(&run.scene.surfaces[surface]),
            _ => {
                let (radius, floor) = (DISC_SHARE * run.searches.smooth.radius, run.searches.smooth.floor);
                Watched::bodies(&place.receiver, radius, floor, caster)
            }
        };
        place.counts = Some(Counts::new(watched.areas()));
        watched
    };
    places.iter_mut().enumerate().map(of).collect()
}

/// Mean distance of what the points of all receivers look at, m; the scene's diagonal where they see nothing.
fn mean_sight<const C: usize>(run: &Rendering<'_, C>, places: &[Place<C>], caster: &RayCaster) -> f64 {
    let seed = Seed(run.settings.seed).branch(PURPOSE_SIGHT);
    let (mut sum, mut count) = (0.0, 0.0);
    for scout in 0..SCOUTS {
        let mut stream = seed.stream(scout);
        let place = &places[(scout % places.len() as u64) as usize];
        let point =
            ((f64::from(stream.uniform()) * place.receiver.len() as f64) as usize).min(place.receiver.len() - 1);
        let direction = place.receiver.direction(point, stream.uniform_pair());
        let hit = caster.closest_hit(place.receiver.start(point), direction, f32::INFINITY);
        if let (true, Some(hit)) = (place.has_value[point], hit) {
            sum += f64::from(hit.distance);
            count += 1.0;
        }
    }
    if count > 0.0 { sum / count } else { run.diagonal }
}

/// What one round's photons left.
struct Caught<'p, const C: usize> {
    crossings: Vec<Crossings<C>>,
    landings: Photons<C>,
    patches: Vec<PatchRecorder<'p, C>>,
    met: Vec<Met<C>>,
    flux: Tally<C>,
}

impl<const C: usize> Default for Caught<'_, C> {
    fn default() -> Self {
        Self {
            crossings: Vec::new(),
            landings: Photons::default(),
            patches: Vec::new(),
            met: Vec::new(),
            flux: Tally::default(),
        }
    }
}

//! Passes: independent photons and rays, until the map is known well enough.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use super::keeping::{self, Keeping, Schedule};
use super::results::Cell;
use super::team::Word;
use super::views::{Batch, View};
use super::{
    Faint, FaintLight, IMAGE_ERROR, PIXEL_RAYS, PURPOSE_BRIGHT, PURPOSE_FAINT, PURPOSE_PHOTONS, PURPOSE_SIGHT,
    PURPOSE_VIEWS, Place, Rendering, SENSOR_RAYS, Searches,
};
use crate::embree::RayCaster;
use crate::error::Error;
use crate::flux::photometric;
use crate::gather::camera::{Eye, first_surface};
use crate::gather::caustics::{CausticMap, Caustics};
use crate::gather::cell_counts::Cells;
use crate::gather::counts::{CountRecorder, Counts, Met, Watched};
use crate::gather::density::Search;
use crate::gather::patches::{PatchGrid, PatchGroups, PatchLight, PatchRecorder};
use crate::gather::receiver::{CrossingRecorder, Crossings, Keep, LandingRecorder, Photons, Receiver};
use crate::gather::sight::{Origins, Records, Sight, ToGroups};
use crate::photon::emit::triangle_area;
use crate::photon::trace::{Recorder, Tally, Tracer};
use crate::photon_map::NearestPhotons;
use crate::random::{Seed, Stream, low_discrepancy};
use crate::render::plan::Method;
use crate::results::CameraImage;
use crate::state::tape::Tape;
use crate::state::{PassRange, Passes};

/// Parts of a pass with photons and rays of their own, so that even one pass knows its scatter.
pub(super) const ROUNDS: u64 = 4;

/// Passes at least where an error is asked for and there are points without neighbours (sensors, samples of surfaces), or
/// nothing but pixels: their claims rest on the scatter of their own batches, and four passes of four rounds make 16.
const FEWEST_PASSES: u32 = 4;

/// A patch's size as a part of the mean distance that points look: as fine as their mean over a hemisphere needs.
const PATCH_SHARE: f64 = 1.0 / 10.0;

/// Radius of the disc about a body in which photons are counted, in largest search radii.
const DISC_SHARE: f32 = 0.2;

/// What rays of a point look at before patches are cut: tells how far they look.
const SCOUTS: u64 = 4096;

impl<const C: usize> Rendering<'_, C> {
    /// Passes until one of the limits is met; returns the images of the cameras.
    pub(super) fn passes<T: NearestPhotons>(
        &mut self,
        places: &mut [Place<C>],
        caster: &RayCaster,
        keeping: &Keeping<'_>,
    ) -> Result<Vec<CameraImage>, Error> {
        let engine = Engine::new(self, places, caster);
        let (scene, mut views) = (self.scene, Vec::new());
        if let (Some(sight), false) = (&engine.sight, scene.cameras.is_empty()) {
            let view = |camera| View::new(camera, scene.centre, sight, caster);
            views = self.timed("camera rays", 1, |_| scene.cameras.iter().map(view).collect());
        }
        self.repeat::<T>(&engine, places, &mut views, keeping)?;
        Ok(views.iter().map(|view| view.image(scene.centre)).collect())
    }

    /// Passes, each kept as soon as it is done, until the error is small enough or a limit is met.
    fn repeat<T: NearestPhotons>(
        &mut self,
        engine: &Engine<'_, C>,
        places: &mut [Place<C>],
        views: &mut [View<'_, C>],
        keeping: &Keeping<'_>,
    ) -> Result<(), Error> {
        let mut schedule = self.recall(places, views, keeping)?;
        if !self.done.is_empty() {
            self.list_stages();
        }
        let mut taken = 0.0;
        loop {
            let over = keeping.team.rank() == 0 && self.judge(places, views, &mut schedule, taken);
            let rest = views.iter().map(|view| view.rests).collect();
            let word = Word { over, done: self.done.len(), next_check: schedule.next_check, rest };
            let word = keeping.team.tell(word);
            if word.over {
                if schedule.closed {
                    self.save(places, views, &schedule, keeping);
                }
                if keeping.team.rank() == 0 && self.plan.bounces {
                    self.read_extremes(engine, places);
                }
                return Ok(());
            }
            schedule.next_check = word.next_check;
            if keeping.team.rank() > 0 {
                self.done = self.own_passes(word.done);
            }
            views.iter_mut().zip(word.rest).for_each(|(view, rests)| view.rests = rests);
            let started = Instant::now();
            self.share_passes::<T>(engine, places, views, &schedule, keeping)?;
            taken = started.elapsed().as_secs_f64();
            self.save(places, views, &schedule, keeping);
        }
    }

    /// Books the stages of passes even if none is left to run, so that a run that goes on lists what any run does.
    fn list_stages(&mut self) {
        let stages: &[&'static str] = match self.plan.method {
            Method::Gather => &["trace photons", "build records", "gather rays"],
            Method::Path => &["gather rays"],
            Method::Split | Method::Photons | Method::Seed => &["trace photons", "build trees", "gather"],
        };
        for stage in stages {
            if self.seconds.iter().all(|(known, _)| known != stage) {
                self.seconds.push((stage, 0.0));
            }
        }
    }

    /// The first `count` passes of this run.
    fn own_passes(&self, count: u32) -> Passes {
        Passes::of(PassRange { seed: self.settings.seed, first: self.settings.first_pass, count })
    }

    /// One pass for each process of the team, but none too many; what they found is the leader's in the end.
    fn share_passes<T: NearestPhotons>(
        &mut self,
        engine: &Engine<'_, C>,
        places: &mut [Place<C>],
        views: &mut [View<'_, C>],
        schedule: &Schedule,
        keeping: &Keeping<'_>,
    ) -> Result<(), Error> {
        let done = self.done.len();
        let most = self.settings.stop.passes().unwrap_or(u32::MAX);
        let until_check = if self.settings.stop.error().is_some() { schedule.next_check.min(most) } else { most };
        let count = until_check.saturating_sub(done).clamp(1, keeping.team.size());
        let first = self.settings.first_pass + done;
        let leads = keeping.team.rank() == 0;
        if !leads {
            self.exchange(places, views, &mut Tape::Clear).map_err(keeping::lost)?;
        }
        if keeping.team.rank() < count {
            self.pass::<T>(engine, places, views, first + keeping.team.rank());
        }
        let mut found = Vec::new();
        if !leads {
            self.exchange(places, views, &mut Tape::Out(&mut found)).map_err(keeping::lost)?;
        }
        let add = &mut |mut part: &[u8]| self.exchange(places, views, &mut Tape::In(&mut part));
        keeping.team.hand_in(&found, add).map_err(keeping::lost)?;
        self.done = self.own_passes(done + count);
        Ok(())
    }

    /// Whether the passes so far are enough. Where it is time to ask, what they say is worked out.
    fn judge(
        &mut self,
        places: &mut [Place<C>],
        views: &mut [View<'_, C>],
        schedule: &mut Schedule,
        taken: f64,
    ) -> bool {
        let done = self.done.len();
        if done == 0 {
            return schedule.closed;
        }
        let enough = self.settings.stop.passes().is_some_and(|most| done >= most);
        let late = self
            .settings
            .stop
            .time()
            .is_some_and(|limit| self.started.elapsed().as_secs_f64() + taken > limit.as_secs_f64());
        let last = enough || late || schedule.closed || self.progress.interrupted();
        if !last && (self.settings.stop.error().is_none() || done < schedule.next_check) {
            return false;
        }
        if self.plan.bounces {
            self.conclude(places);
        }
        let claim = match places {
            [] => views.iter().map(View::claim).fold(0.0, f64::max),
            _ => worst_of(places, Cell::of),
        };
        self.progress.pass(done, 100.0 * claim);
        let Some(percent) = self.settings.stop.error() else { return true };
        let target = percent / 100.0;
        let alone = self.plan.method.sends_rays() && places.iter().any(|place| place.receiver.grid.is_none());
        let fewest = if alone || places.is_empty() { FEWEST_PASSES } else { 1 };
        if last || (claim <= target && done >= fewest) || !(self.plan.bounces || places.is_empty()) {
            return true;
        }
        let floor = worst_of(places, Cell::of_direct);
        if floor > target {
            self.warnings.push(format!(
                "`error` {percent}: direct light at shadows' edges alone is uncertain by {:.3} %, and passes do \
                 not mend it",
                100.0 * floor,
            ));
            return true;
        }
        // An image that is good enough rests while maps and sensors ask for more.
        let goal = if places.is_empty() { target } else { IMAGE_ERROR / 100.0 };
        if self.settings.stop.passes().is_none() {
            views.iter_mut().for_each(|view| view.rests |= view.claim() <= goal);
        }
        if claim <= target {
            schedule.next_check = fewest;
            return false;
        }
        // The error falls as 1/√passes at best: no use in asking earlier. Asking costs as much as a pass or two.
        let passes = f64::from(done);
        let needed = (passes * (claim / target).powi(2)).clamp(1.4 * passes, 2.0 * passes);
        schedule.next_check = done.max(needed as u32 - 1) + 1;
        false
    }

    /// Parts of a pass with photons of their own.
    pub(super) fn rounds(&self) -> u64 {
        if self.plan.method.sends_rays() { ROUNDS } else { 1 }
    }

    /// One pass: trace, build, gather.
    fn pass<T: NearestPhotons>(
        &mut self,
        engine: &Engine<'_, C>,
        places: &mut [Place<C>],
        views: &mut [View<'_, C>],
        number: u32,
    ) {
        let resting: Vec<bool> = views.iter().map(|view| view.rests).collect();
        let pass = u64::from(number);
        let rounds = self.rounds();
        for round in pass * rounds..(pass + 1) * rounds {
            let (mut light, mut by_group) = (None, None);
            let mut caustics = None;
            if let Some(tracer) = &engine.tracer {
                let caught =
                    self.timed("trace photons", tracer.photons(), |this| this.trace(tracer, engine, places, round));
                self.count(places, &caught.met);
                self.flux.add(&caught.flux);
                self.photons_emitted += tracer.photons();
                for (place, crossings) in places.iter_mut().zip(&caught.witnessed) {
                    if let Some(witness) = &mut place.witness {
                        witness.add(&place.receiver, [&crossings.smooth, &crossings.sharp]);
                    }
                }
                self.gather::<T>(places, caught.crossings, caught.landings, self.searches.of_pass(number));
                let area = engine.area;
                caustics = caught.caustics.map(|caustics| self.caustic_map(caustics, rounds, round, area));
                if let Some(grid) = &engine.grid {
                    self.timed("build records", 1, |this| {
                        let patches = PatchLight::new(grid, &caught.patches);
                        let groups = this.groups.as_ref();
                        by_group = groups.map(|groups| PatchGroups::new(grid, &caught.patches, groups, &patches));
                        light = Some(patches);
                    });
                }
            }
            if let Some(sight) = &engine.sight {
                let caustics = caustics.as_ref();
                let patches = engine.grid.as_ref().zip(light.as_ref());
                let records = patches.map(|(grid, light)| Records { grid, light, caustics });
                if places.iter().any(|place| place.samples.is_some()) {
                    let points = places.iter().map(|place| place.receiver.len() as u64).sum();
                    self.timed("gather rays", points, |this| {
                        for (index, place) in places.iter_mut().enumerate() {
                            this.look(sight, records, by_group.as_ref(), index, place, round);
                        }
                    });
                }
                if !views.is_empty() {
                    let eye = Eye { sight, caster: engine.caster, records, caustics };
                    self.look_from_cameras(&eye, views, &resting, round, ROUNDS / rounds);
                }
            }
        }
    }

    /// Adds photons where they are counted.
    fn count(&mut self, places: &mut [Place<C>], met: &[Met<C>]) {
        self.photons_stored += met.len() as u64;
        let groups = self.groups.as_ref();
        for met in met {
            if let Some(counts) = &mut places[met.receiver as usize].counts {
                counts.add(met, groups);
            }
        }
    }

    /// The caustics of one of a pass's `rounds` rounds, ready for rays and cameras; `area` is that of all surfaces near, m².
    fn caustic_map(&self, caustics: Caustics<C>, rounds: u64, round: u64, area: f64) -> CausticMap<C> {
        let photons = self.settings.photons as f64 / rounds as f64;
        let search = Searches::new(self.plan.method, self.settings, self.diagonal, photons).of_pass(round as u32).sharp;
        // No wider than where the k nearest would be if all photons lay evenly on the surfaces: who finds fewer is in less
        // light than the mean, and to reach farther would smear what is bright there.
        let wide_enough = (search.nearest as f64 * area / (std::f64::consts::PI * photons)).sqrt() as f32;
        CausticMap::build(caustics, Search { radius: search.radius.min(wide_enough), ..search })
    }

    /// One round's rays of every camera that doesn't rest, in `batches` independent parts.
    fn look_from_cameras(
        &mut self,
        eye: &Eye<'_, C>,
        views: &mut [View<'_, C>],
        resting: &[bool],
        round: u64,
        batches: u64,
    ) {
        let rays = u64::from(self.settings.rays).div_ceil(ROUNDS) * u64::from(PIXEL_RAYS);
        let awake = || resting.iter().map(|resting| !resting);
        let pixels = views.iter().zip(awake()).map(|(view, awake)| if awake { view.len() as u64 } else { 0 }).sum();
        for batch in round * batches..(round + 1) * batches {
            self.timed("camera rays", pixels, |this| {
                for (index, (view, _)) in views.iter_mut().zip(awake()).enumerate().filter(|(_, (_, awake))| *awake) {
                    let seed = Seed(this.settings.seed).branch(PURPOSE_VIEWS).branch(index as u64).branch(batch);
                    let batch = Batch { eye, seed, rays };
                    this.gather_rays += view.look(&batch, |pixels| this.progress.advance(pixels));
                }
            });
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
        let sources = self.groups.is_some();
        let mesh = &self.scene.mesh;
        let count = |keep| CountRecorder::new(&engine.watched, &receivers, mesh, engine.caster, keep);
        let mut caught = Caught::default();
        match (self.plan.method, &engine.grid) {
            (Method::Gather, Some(grid)) => {
                let watched: &[&Receiver] = if self.plan.caustics { &receivers } else { &[] };
                let crossing = || CrossingRecorder::new(watched, Keep::Caustics);
                let caustics = || crossing().with_sources(sources);
                // One round of each pass is a witness: enough, and the others are spared the trouble.
                let testifies = round.is_multiple_of(ROUNDS);
                let witnesses: &[&Receiver] = if testifies { &receivers } else { &[] };
                let others =
                    || ((caustics(), CrossingRecorder::new(witnesses, Keep::FoundByRays)), count(Keep::Caustics));
                let record = || (PatchRecorder::new(grid).with_sources(sources), others());
                let records = self.record(tracer, round, record, &mut caught);
                let (patches, others): (_, Vec<_>) = records.into_iter().unzip();
                let (crossings, met): (Vec<_>, Vec<_>) = others.into_iter().unzip();
                let (crossings, witnessed) = crossings.into_iter().unzip();
                caught.met = CountRecorder::merge(met);
                caught.witnessed = if testifies { CrossingRecorder::merge(witnessed) } else { Vec::new() };
                (caught.patches, caught.crossings) = (patches, CrossingRecorder::merge(crossings));
            }
            (Method::Seed, _) => {
                let others = || (LandingRecorder::new(), count(Keep::All));
                let record = || (CrossingRecorder::new(&receivers, Keep::All), others());
                let records = self.record(tracer, round, record, &mut caught);
                let (crossings, others): (_, Vec<_>) = records.into_iter().unzip();
                let (landings, met) = others.into_iter().unzip();
                caught.met = CountRecorder::merge(met);
                (caught.crossings, caught.landings) =
                    (CrossingRecorder::merge(crossings), LandingRecorder::merge(landings));
            }
            (method, _) => {
                let keep = if method == Method::Photons { Keep::All } else { Keep::Bounced };
                let crossing = || CrossingRecorder::new(&receivers, keep);
                let record = || (crossing().with_sources(sources), count(keep));
                let (crossings, met) = self.record(tracer, round, record, &mut caught).into_iter().unzip();
                caught.met = CountRecorder::merge(met);
                caught.crossings = CrossingRecorder::merge(crossings);
            }
        }
        caught
    }

    /// Traces one round. What cameras and the balance ask for goes into `caught`, the records asked for are returned.
    fn record<R: Recorder<C>>(
        &self,
        tracer: &Tracer<'_, C>,
        round: u64,
        record: impl Fn() -> R + Sync,
        caught: &mut Caught<'_, C>,
    ) -> Vec<R> {
        let seed = Seed(self.settings.seed).branch(PURPOSE_PHOTONS);
        let advance = |photons| self.progress.advance(photons);
        let looked_at = self.asks_for_caustics();
        let record = || (record(), looked_at.then(Caustics::default));
        let (records, flux) = tracer.trace(seed, round, record, advance);
        let (records, caustics): (Vec<R>, Vec<Option<Caustics<C>>>) = records.into_iter().unzip();
        caught.caustics = looked_at.then(|| Caustics::merge(caustics.into_iter().flatten()));
        caught.flux = flux;
        records
    }

    /// Whether caustics are asked for where rays or cameras meet surfaces.
    fn asks_for_caustics(&self) -> bool {
        self.plan.caustics && (self.plan.method == Method::Gather || !self.scene.cameras.is_empty())
    }

    /// One round's rays from every point of a receiver.
    fn look(
        &mut self,
        sight: &Sight<'_, C>,
        records: Option<Records<'_, C>>,
        patches: Option<&PatchGroups<C>>,
        index: usize,
        place: &mut Place<C>,
        round: u64,
    ) {
        let Place { receiver, has_value, samples: Some(samples), faint, groups: told_apart, .. } = place else {
            return;
        };
        let alone = if receiver.grid.is_some() { 1 } else { u64::from(SENSOR_RAYS) };
        let count = u64::from(self.settings.rays).div_ceil(ROUNDS) * alone;
        let seed = Seed(self.settings.seed).branch(PURPOSE_SIGHT).branch(index as u64).branch(round);
        let look = Look { sight, records, receiver, has_value, seed, count, rays: AtomicU64::new(0) };
        match (&self.groups, told_apart) {
            (Some(groups), Some(_)) => samples
                .add_in_groups(round, count, |point, row| look.from(point, &mut ToGroups { groups, patches, row })),
            _ => samples.add(round, count, |point| look.from(point, &mut ())),
        }
        self.gather_rays += look.rays.into_inner();
        if let Some(FaintLight { luminaires, samples, .. }) = faint {
            let seed = Seed(self.settings.seed).branch(PURPOSE_FAINT).branch(index as u64).branch(round);
            let rays = AtomicU64::new(0);
            samples.add(round, count, |point| {
                if !has_value[point] {
                    return [0.0; C];
                }
                let stream = &mut seed.stream(point as u64);
                let (sum, cast) = faint_light(luminaires, receiver, point, count, sight.caster(), stream);
                rays.fetch_add(cast, Ordering::Relaxed);
                sum
            });
            self.gather_rays += rays.into_inner();
        }
        self.progress.advance(receiver.len() as u64);
    }
}

/// What `count` rays to the faint luminaires of a point find, their sum, and the rays that took.
pub(super) fn faint_light<const C: usize>(
    luminaires: &Faint<C>,
    receiver: &Receiver,
    point: usize,
    count: u64,
    caster: &RayCaster,
    stream: &mut Stream,
) -> ([f64; C], u64) {
    let (mut sum, mut cast) = ([0.0; C], 0);
    let (start, normal) = (receiver.start(point), receiver.normal_at(point));
    let shift = stream.uniform();
    for ray in 0..count {
        let share = ((ray as f32 + shift) / count as f32).min(0.999_999_9);
        let (found, rays) = luminaires.sample(point, share, start, normal, caster, stream);
        (0..C).for_each(|c| sum[c] += found[c]);
        cast += rays;
    }
    (sum, cast)
}

/// One round's rays from the points of a receiver.
pub(super) struct Look<'a, const C: usize> {
    pub(super) sight: &'a Sight<'a, C>,
    pub(super) records: Option<Records<'a, C>>,
    pub(super) receiver: &'a Receiver,
    pub(super) has_value: &'a [bool],
    pub(super) seed: Seed,
    /// Rays from each point.
    pub(super) count: u64,
    /// Rays cast, those onward from where they end included.
    pub(super) rays: AtomicU64,
}

impl<const C: usize> Look<'_, C> {
    /// Sum of what the rays from a point find, lx; `origins` hears where it comes from.
    pub(super) fn from(&self, point: usize, origins: &mut impl Origins<C>) -> [f64; C] {
        let mut sum = [0.0; C];
        if !self.has_value[point] {
            return sum;
        }
        let start = self.receiver.start(point);
        let mut stream = self.seed.stream(point as u64);
        let shift = stream.uniform_pair();
        let mut cast = 0;
        for ray in 0..self.count {
            let direction = self.receiver.direction(point, low_discrepancy(ray, shift));
            let found = self.sight.incoming_from(start, direction, self.records, &mut stream, &mut cast, origins);
            (0..C).for_each(|c| sum[c] += found[c]);
        }
        self.rays.fetch_add(cast, Ordering::Relaxed);
        sum
    }
}

/// Claimed standard error of the worst map, plane or surface, relative to its mean; of the worst sensor where there is no
/// map.
pub(super) fn worst_of<const C: usize>(places: &[Place<C>], cell: fn(&Place<C>, usize) -> Cell<C>) -> f64 {
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

/// What a run keeps from pass to pass.
pub(super) struct Engine<'a, const C: usize> {
    pub(super) caster: &'a RayCaster,
    /// Of all surfaces that are near, m².
    area: f64,
    tracer: Option<Tracer<'a, C>>,
    pub(super) sight: Option<Sight<'a, C>>,
    grid: Option<PatchGrid>,
    /// What photons are counted for at each receiver.
    watched: Vec<Watched<'a>>,
}

impl<'a, const C: usize> Engine<'a, C> {
    fn new(run: &Rendering<'a, C>, places: &mut [Place<C>], caster: &'a RayCaster) -> Self {
        let (scene, method) = (run.scene, run.plan.method);
        let rounds = run.rounds();
        let photons = run.settings.photons.div_ceil(rounds);
        let tracer = run.plan.photons.then(|| {
            let most_bounces = run.trial.most_bounces();
            Tracer::new(scene, caster, photons).with_most_bounces(most_bounces)
        });
        let looks = method.sends_rays() || !scene.cameras.is_empty();
        let sight = looks.then(|| Sight::new(scene, caster, method == Method::Path));
        let mut grid = (method == Method::Gather && run.plan.photons).then(|| {
            let size = PATCH_SHARE * mean_sight(run, places, sight.as_ref(), caster);
            let height = (2e-4 * run.diagonal).min(2e-3);
            let useful = |material: u32| scene.materials[material as usize].is_diffuse();
            PatchGrid::new(&scene.mesh, useful, size as f32, (&scene.near, PATCH_SHARE), height as f32)
        });
        if let (Some(grid), Some(tracer)) = (&mut grid, &tracer) {
            // A fact of the scene, as whether light can arrive somewhere.
            let seed = Seed(0).branch(PURPOSE_BRIGHT);
            let (records, _) = tracer.trace(seed, 0, || PatchRecorder::new(grid), |_| ());
            let light: PatchLight<C> = PatchLight::new(grid, &records);
            drop(records);
            grid.note_bright(&light);
        }
        let looked_at = if run.asks_for_caustics() { scene.mesh.triangles.len() } else { 0 };
        let corners = (0..looked_at).map(|triangle| scene.mesh.corners(triangle));
        let near = corners.filter(|corners| scene.near.distance(*corners) <= scene.near.horizon());
        let area = near.map(|corners| triangle_area(&corners)).sum();
        Self { caster, area, tracer, sight, grid, watched: watched(run, places, caster) }
    }
}

/// What photons are to be counted for at each receiver, with counts made ready for it.
fn watched<'a, const C: usize>(
    run: &Rendering<'a, C>,
    places: &mut [Place<C>],
    caster: &RayCaster,
) -> Vec<Watched<'a>> {
    let is_apart = |place: &Place<C>| !place.receiver.is_plane() || place.receiver.cells_count;
    if !run.plan.counts_photons() || !places.iter().any(is_apart) {
        return Vec::new();
    }
    let first = places.len() - run.scene.surfaces.len();
    let of = |(index, place): (usize, &mut Place<C>)| {
        let watched = match (place.receiver.bodies(), index.checked_sub(first)) {
            ([], None) if place.receiver.cells_count => {
                Watched::Cells(Cells::look(&place.receiver, &place.has_value, caster))
            }
            ([], None) => return Watched::Nothing,
            ([], Some(surface)) => Watched::Surface(&run.scene.surfaces[surface]),
            _ => {
                let (radius, floor) = (DISC_SHARE * run.searches.smooth.radius, run.searches.smooth.floor);
                Watched::bodies(&place.receiver, radius, floor, caster)
            }
        };
        let width =
            if place.groups.is_some() { run.groups.as_ref().map_or(0, |groups| groups.width::<C>()) } else { 0 };
        place.counts = Some(Counts::new(watched.areas(), width));
        watched
    };
    places.iter_mut().enumerate().map(of).collect()
}

/// Mean distance of what the points of all receivers, and those that cameras see, look at, m; the scene's diagonal where
/// they see nothing. What is far counts as near: a glimpse of ground 10 km off must not make the patches of the room coarse.
fn mean_sight<const C: usize>(
    run: &Rendering<'_, C>,
    places: &[Place<C>],
    sight: Option<&Sight<'_, C>>,
    caster: &RayCaster,
) -> f64 {
    let seed = Seed(run.settings.seed).branch(PURPOSE_SIGHT);
    let cameras = &run.scene.cameras;
    let (mut sum, mut count) = (0.0, 0.0);
    for scout in 0..SCOUTS {
        let mut stream = seed.stream(scout);
        let from = (scout % (places.len() + cameras.len()) as u64) as usize;
        let start = if let Some(place) = places.get(from) {
            let points = place.receiver.len();
            let point = ((f64::from(stream.uniform()) * points as f64) as usize).min(points - 1);
            let direction = place.receiver.direction(point, stream.uniform_pair());
            place.has_value[point].then(|| (place.receiver.start(point), direction))
        } else {
            let camera = &cameras[from - places.len()];
            let at = [0, 1].map(|axis| f64::from(stream.uniform()) * camera.pixels[axis] as f64);
            let (eye, direction) = (camera.eye.as_vec3(), camera.direction(at).as_vec3());
            sight.and_then(|sight| first_surface(sight, caster, eye, direction)).map(|(hit, direction)| {
                let normal = if direction.dot(hit.normal) < 0.0 { hit.normal } else { -hit.normal };
                (hit.leave(normal), stream.cosine_about(normal))
            })
        };
        let hit = start.and_then(|(start, direction)| caster.closest_hit(start, direction, f32::INFINITY));
        if let Some(hit) = hit {
            sum += f64::from(hit.distance).min(run.scene.near.horizon());
            count += 1.0;
        }
    }
    if count > 0.0 { sum / count } else { run.diagonal }
}

/// What one round's photons left.
struct Caught<'p, const C: usize> {
    crossings: Vec<Crossings<C>>,
    /// Diffused light that crossed receivers, of a round that is a witness.
    witnessed: Vec<Crossings<C>>,
    landings: Photons<C>,
    caustics: Option<Caustics<C>>,
    patches: Vec<PatchRecorder<'p, C>>,
    met: Vec<Met<C>>,
    flux: Tally<C>,
}

impl<const C: usize> Default for Caught<'_, C> {
    fn default() -> Self {
        Self {
            crossings: Vec::new(),
            witnessed: Vec::new(),
            landings: Photons::default(),
            caustics: None,
            patches: Vec::new(),
            met: Vec::new(),
            flux: Tally::default(),
        }
    }
}

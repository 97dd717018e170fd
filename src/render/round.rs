//! One pass: photons and rays, round by round, handed to the parts of the light.

use rayon::prelude::*;

use super::composition::{Density, ROUNDS};
use super::engine::Engine;
use super::method::Searches;
use super::place::Place;
use super::views::{Batch, View};
use super::{PIXEL_RAYS, PURPOSE_PHOTONS, PURPOSE_VIEWS, Rendering};
use crate::flux::Flux;
use crate::gather::camera::Eye;
use crate::gather::caustics::{CausticMap, Caustics};
use crate::gather::counts::{CountRecorder, Met};
use crate::gather::density::SearchLimits;
use crate::gather::parts::{Arrived, PhotonRound, RayRound};
use crate::gather::patches::{PatchGroups, PatchLight, PatchRecorder};
use crate::gather::receiver::{CrossingRecorder, Crossings, Keep, LandingRecorder, Photons, Receiver};
use crate::gather::sight::Records;
use crate::luminaire::LightGroups;
use crate::photon::trace::{Flight, Recorder, Tally, Tracer};
use crate::photon_map::ChosenMap;
use crate::random::Seed;

/// What photons are kept for, on one thread: whatever the method asks for.
struct PhotonRecorder<'r, 'g, const C: usize> {
    crossings: Option<CrossingRecorder<'r, C>>,
    /// Diffused light that crosses receivers, of a round that is a witness.
    witnessed: Option<CrossingRecorder<'r, C>>,
    met: Option<CountRecorder<'r, C>>,
    landings: Option<LandingRecorder<C>>,
    patches: Option<PatchRecorder<'g, C>>,
    caustics: Option<Caustics<C>>,
}

impl<const C: usize> Recorder<C> for PhotonRecorder<'_, '_, C> {
    #[inline]
    fn record(&mut self, flight: &Flight<'_>, flux: Flux<C>) {
        self.patches.record(flight, flux);
        self.crossings.record(flight, flux);
        self.witnessed.record(flight, flux);
        self.met.record(flight, flux);
        self.landings.record(flight, flux);
        self.caustics.record(flight, flux);
    }
}

/// What one round's photons left.
struct Caught<'g, const C: usize> {
    /// At each receiver; empty where the method asks for none.
    crossings: Vec<Crossings<C>>,
    witnessed: Vec<Crossings<C>>,
    met: Vec<Met<C>>,
    landings: Photons<C>,
    patches: Vec<PatchRecorder<'g, C>>,
    caustics: Option<Caustics<C>>,
    flux: Tally<C>,
}

impl<'g, const C: usize> Caught<'g, C> {
    /// Out of the records of many threads, in order.
    fn merge(records: Vec<PhotonRecorder<'_, 'g, C>>, flux: Tally<C>) -> Self {
        let (mut crossings, mut witnessed, mut met) = (Vec::new(), Vec::new(), Vec::new());
        let (mut landings, mut patches, mut caustics) = (Vec::new(), Vec::new(), Vec::new());
        for record in records {
            crossings.extend(record.crossings);
            witnessed.extend(record.witnessed);
            met.extend(record.met);
            landings.extend(record.landings);
            patches.extend(record.patches);
            caustics.extend(record.caustics);
        }
        Self {
            crossings: CrossingRecorder::merge(crossings),
            witnessed: CrossingRecorder::merge(witnessed),
            met: CountRecorder::merge(met),
            landings: LandingRecorder::merge(landings),
            patches,
            caustics: (!caustics.is_empty()).then(|| Caustics::merge(caustics)),
            flux,
        }
    }
}

impl<const C: usize> Rendering<'_, C> {
    /// Parts of a pass with photons of their own.
    pub(super) fn rounds(&self) -> u64 {
        self.composition.rounds
    }

    /// Rays from each point of a grid in a round.
    fn rays_a_round(&self) -> u64 {
        u64::from(self.settings.rays).div_ceil(ROUNDS)
    }

    /// One pass: trace, build, gather.
    pub(super) fn pass(
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
                let receivers: Vec<&Receiver> = places.iter().map(|place| &place.site.receiver).collect();
                let caught =
                    self.timed("trace photons", tracer.photons(), |this| this.trace(tracer, engine, &receivers, round));
                self.record.book_photons(tracer.photons(), &caught.flux);
                let Caught { crossings, witnessed, met, landings, patches, caustics: by_mirrors, .. } = caught;
                self.add_photons(places, Left { crossings, witnessed, met, landings }, number);
                caustics = by_mirrors.map(|caustics| self.caustic_map(caustics, rounds, round, engine.area));
                if let Some(grid) = &engine.grid {
                    self.timed("build records", 1, |this| {
                        let found = PatchLight::new(grid, &patches);
                        let groups = this.groups.as_ref();
                        by_group = groups.map(|groups| PatchGroups::new(grid, &patches, groups, &found));
                        light = Some(found);
                    });
                }
            }
            let Some(sight) = &engine.sight else { continue };
            let caustics = caustics.as_ref();
            let patches = engine.grid.as_ref().zip(light.as_ref());
            let records = patches.map(|(grid, light)| Records { grid, light, caustics });
            if self.composition.rays.is_some() && !places.is_empty() {
                let rays = self.rays_a_round();
                let patches = by_group.as_ref();
                let points = places.iter().map(|place| place.len() as u64).sum();
                self.timed("gather rays", points, |this| {
                    let round = RayRound { number: round, rays, sight, records, patches, groups: this.groups.as_ref() };
                    for Place { site, parts, .. } in places.iter_mut() {
                        this.record.gather_rays +=
                            parts.iter_mut().map(|part| part.add_rays(&round, site)).sum::<u64>();
                        this.progress.advance(site.receiver.len() as u64);
                    }
                });
            }
            if !views.is_empty() {
                let eye = Eye { sight, caster: engine.caster, records, caustics };
                self.look_from_cameras(&eye, views, &resting, round, ROUNDS / rounds);
            }
        }
    }

    /// Shows every part of the light what a round's photons left at its receiver, in trees where densities ask for
    /// them.
    fn add_photons(&mut self, places: &mut [Place<C>], left: Left<C>, pass: u32) {
        let Left { mut crossings, witnessed, met, landings } = left;
        let count = |photons: &Photons<C>| photons.positions.len() as u64;
        let in_trees = count(&landings) + crossings.iter().map(|c| count(&c.sharp) + count(&c.smooth)).sum::<u64>();
        self.record.photons_stored += met.len() as u64 + in_trees;
        let search = self.searches.of_pass(pass).smooth;
        let mut arrived: Vec<Arrived<C>> = Vec::new();
        let mut landed = ChosenMap::empty();
        let (mut witnessed, mut met_at) =
            (witnessed.into_iter(), places.iter().map(|_| Vec::new()).collect::<Vec<_>>());
        met.into_iter().for_each(|met| met_at[met.receiver as usize].push(met));
        let maps: Vec<[ChosenMap<C>; 2]> = if in_trees > 0 {
            self.timed("build trees", 1, |this| {
                landed = ChosenMap::build(this.settings.tree, landings.positions, landings.flux, NO_MARKS);
                crossings.par_drain(..).map(|crossings| this.maps(crossings)).collect()
            })
        } else {
            Vec::new()
        };
        let mut maps = maps.into_iter();
        for met in met_at {
            let maps = maps.next().unwrap_or_else(|| [ChosenMap::empty(), ChosenMap::empty()]);
            arrived.push(Arrived { maps, met, witnessed: witnessed.next() });
        }
        let points = places.iter().map(|place| place.len() as u64).sum();
        let mut add = |this: &mut Self| {
            for (Place { site, parts, .. }, arrived) in places.iter_mut().zip(&arrived) {
                let round = PhotonRound { arrived, landed: &landed, search, groups: this.groups.as_ref() };
                parts.iter_mut().for_each(|part| part.add_photons(&round, site));
                if in_trees > 0 && site.receiver.is_plane() {
                    this.progress.advance(site.receiver.len() as u64);
                }
            }
        };
        if in_trees > 0 {
            self.timed("gather", points, add);
        } else {
            add(self);
        }
    }

    /// The photon maps of a receiver: light with edges and smooth light apart; all in the first for the paper's
    /// estimator.
    fn maps(&self, crossings: Crossings<C>) -> [ChosenMap<C>; 2] {
        let Crossings { mut sharp, mut smooth, sources } = crossings;
        if self.composition.density == Some(Density::Paper) {
            sharp.append(&mut smooth);
        }
        let [first, second] = sources;
        [(sharp, first), (smooth, second)].map(|(photons, sources)| {
            let marks = |groups: &LightGroups| -> Vec<u32> { sources.iter().map(|&lamp| groups.group(lamp)).collect() };
            let marks = self.groups.as_ref().map(|groups| marks(groups).into_iter());
            ChosenMap::build(self.settings.tree, photons.positions, photons.flux, marks)
        })
    }

    /// The caustics of one of a pass's `rounds` rounds, ready for rays and cameras; `area` is that of all surfaces
    /// near, m².
    fn caustic_map(&self, caustics: Caustics<C>, rounds: u64, round: u64, area: f64) -> CausticMap<C> {
        let photons = self.settings.photons as f64 / rounds as f64;
        let search =
            Searches::new(self.composition.density, self.settings, self.diagonal, photons).of_pass(round as u32).sharp;
        // No wider than where the k nearest would be if all photons lay evenly on the surfaces: who finds fewer is in
        // less light than the mean, and to reach farther would smear what is bright there.
        let wide_enough = (search.nearest as f64 * area / (std::f64::consts::PI * photons)).sqrt() as f32;
        CausticMap::build(caustics, SearchLimits { radius: search.radius.min(wide_enough), ..search })
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
        let rays = self.rays_a_round() * u64::from(PIXEL_RAYS);
        let awake = || resting.iter().map(|resting| !resting);
        let pixels = views.iter().zip(awake()).map(|(view, awake)| if awake { view.len() as u64 } else { 0 }).sum();
        for batch in round * batches..(round + 1) * batches {
            self.timed("camera rays", pixels, |this| {
                for (index, (view, _)) in views.iter_mut().zip(awake()).enumerate().filter(|(_, (_, awake))| *awake) {
                    let seed = Seed(this.settings.seed).branch(PURPOSE_VIEWS).branch(index as u64).branch(batch);
                    let batch = Batch { eye, seed, rays };
                    this.record.gather_rays += view.look(&batch, |pixels| this.progress.advance(pixels));
                }
            });
        }
    }

    /// Traces one round and keeps what the method asks for.
    fn trace<'g>(
        &self,
        tracer: &Tracer<'_, C>,
        engine: &'g Engine<'_, C>,
        receivers: &[&Receiver],
        round: u64,
    ) -> Caught<'g, C> {
        let composition = &self.composition;
        let sources = self.groups.is_some();
        let mesh = &self.scene.mesh;
        // One round of each pass is a witness: enough, and the others are spared the trouble.
        let testifies = composition.patches && round.is_multiple_of(ROUNDS);
        let crossing = |keep| CrossingRecorder::new(receivers, keep);
        let record = || PhotonRecorder {
            crossings: composition.crossings.map(|keep| crossing(keep).with_sources(sources)),
            witnessed: testifies.then(|| crossing(Keep::FoundByRays)),
            met: composition
                .counted
                .map(|keep| CountRecorder::new(&engine.watched, receivers, mesh, engine.caster, keep)),
            landings: composition.landings.then(LandingRecorder::new),
            patches: engine.grid.as_ref().map(|grid| PatchRecorder::new(grid).with_sources(sources)),
            caustics: composition.caustic_maps.then(Caustics::default),
        };
        let seed = Seed(self.settings.seed).branch(PURPOSE_PHOTONS);
        let (records, flux) = tracer.trace(seed, round, record, |photons| self.progress.advance(photons));
        Caught::merge(records, flux)
    }
}

/// What one round's photons left at receivers.
struct Left<const C: usize> {
    crossings: Vec<Crossings<C>>,
    witnessed: Vec<Crossings<C>>,
    met: Vec<Met<C>>,
    landings: Photons<C>,
}

/// Photons of no light group.
const NO_MARKS: Option<std::iter::Empty<u32>> = None;

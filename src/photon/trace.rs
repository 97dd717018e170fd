//! A photon's life: emit, fly, land, then survive or end.
//!
//! The photons of a luminaire carry equal luminous flux and end by Russian roulette only, so a room of ρ = 0.999 is as
//! right as one of ρ = 0.2; a safety cap on bounces ends what a loss-free room would trap for ever, and reports the
//! flux it cut off.

use std::io;

use glam::Vec3;
use rayon::prelude::*;

use super::media::Media;
use super::surface::{PhotonFate, SurfaceOptics, pass_glass};
use crate::embree::{Hit, RayCaster};
use crate::flux::{Flux, accumulate};
use crate::luminaire::Luminaire;
use crate::photon::emit::Emission;
use crate::random::{Seed, Stream};
use crate::scene::Scene;
use crate::state::Sum;
use crate::state::tape::Tape;

/// Photons traced as one piece of work; small enough to balance threads, large enough to hide the hand-over.
const CHUNK: u64 = 8192;

/// Bounces after which a photon is cut off, and its flux reported. A closed room of ρ = 0.999 cuts off 4·10⁻⁴⁴ of the
/// flux, one of ρ = 0.9999 5·10⁻⁵.
pub const BOUNCE_CAP: u32 = 100_000;

/// What a photon has met since it left its luminaire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum History {
    /// Nothing: direct light.
    Direct,
    /// Rough mirrors only, none of them nearly perfect: light that rays find as they find diffused light.
    Glossy,
    /// Mirrors, nearly perfect ones too, or glass, and no diffuse surface: a caustic where it lands.
    Specular,
    /// At least one diffuse surface.
    Diffused,
}

/// One straight flight of a photon.
pub struct Flight<'a> {
    /// Where it starts, m.
    pub origin: Vec3,
    /// Unit vector.
    pub direction: Vec3,
    /// Where it ends; `None` if it leaves the scene.
    pub hit: Option<&'a Hit>,
    /// Whether what it meets is opaque, a surface where light lands.
    pub lands: bool,
    /// What it has met before.
    pub history: History,
    /// Number of the luminaire that sent it.
    pub luminaire: u32,
}

/// Keeps what some query can reach of the photons' flights.
pub trait Recorder<const C: usize>: Send {
    /// Called for every flight of every photon, in the photons' order.
    fn record(&mut self, flight: &Flight<'_>, flux: Flux<C>);
}

/// A record that is kept only if it is wanted.
impl<const C: usize, R: Recorder<C>> Recorder<C> for Option<R> {
    #[inline]
    fn record(&mut self, flight: &Flight<'_>, flux: Flux<C>) {
        if let Some(recorder) = self {
            recorder.record(flight, flux);
        }
    }
}

/// Where the flux went, and how many rays that took. Sums in double precision: 10⁸ photons of 10⁻⁵ lm add up to 256 lm
/// instead of 1000 in single.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tally<const C: usize> {
    /// Flux emitted, lm.
    pub emitted: [f64; C],
    /// Flux absorbed by surfaces and in glass, lm.
    pub absorbed: [f64; C],
    /// Flux that left the scene, lm.
    pub escaped: [f64; C],
    /// Flux under way at the bounce cap, lm.
    pub cut_off: [f64; C],
    /// Rays cast.
    pub rays: u64,
}

/// Tallies of several passes together, in any order.
#[derive(Clone, Copy, Debug)]
pub struct TallySum<const C: usize> {
    flux: [[Sum; C]; 4],
    rays: u64,
}

impl<const C: usize> Default for TallySum<C> {
    fn default() -> Self {
        Self { flux: [[Sum::ZERO; C]; 4], rays: 0 }
    }
}

impl<const C: usize> TallySum<C> {
    /// Adds a tally.
    pub fn add(&mut self, tally: &Tally<C>) {
        let parts = [tally.emitted, tally.absorbed, tally.escaped, tally.cut_off];
        self.flux.as_flattened_mut().iter_mut().zip(parts.as_flattened()).for_each(|(sum, part)| sum.add(*part));
        self.rays += tally.rays;
    }

    /// All rays, and the flux of each kind divided by `count`.
    pub fn mean(&self, count: f64) -> Tally<C> {
        let [emitted, absorbed, escaped, cut_off] = self.flux.map(|sums| sums.map(|sum| sum.value() / count));
        Tally { emitted, absorbed, escaped, cut_off, rays: self.rays }
    }

    /// Writes its sums to `tape`, or reads them from it.
    pub fn exchange(&mut self, tape: &mut Tape<'_>) -> io::Result<()> {
        tape.sums(self.flux.as_flattened_mut())?;
        tape.count(&mut self.rays)
    }
}

impl<const C: usize> Default for Tally<C> {
    fn default() -> Self {
        Self { emitted: [0.0; C], absorbed: [0.0; C], escaped: [0.0; C], cut_off: [0.0; C], rays: 0 }
    }
}

impl<const C: usize> Tally<C> {
    /// Adds what another piece of work found.
    pub fn add(&mut self, other: &Self) {
        for c in 0..C {
            self.emitted[c] += other.emitted[c];
            self.absorbed[c] += other.absorbed[c];
            self.escaped[c] += other.escaped[c];
            self.cut_off[c] += other.cut_off[c];
        }
        self.rays += other.rays;
    }

    /// Books what a photon that lives on left behind; in one channel it leaves nothing, the roulette's losers do.
    #[inline]
    fn lose(&mut self, before: Flux<C>, left: Flux<C>) {
        if C > 1 {
            accumulate(&mut self.absorbed, before, 1.0);
            accumulate(&mut self.absorbed, left, -1.0);
        }
    }
}

/// Traces photons through a scene.
pub struct Tracer<'a, const C: usize> {
    caster: &'a RayCaster,
    surfaces: Vec<SurfaceOptics<C>>,
    emission: Emission<'a, C>,
    /// The glass that each luminaire is in; empty where there is no glass about any.
    starts: Vec<Media>,
    photons: u64,
    most_bounces: u32,
}

impl<'a, const C: usize> Tracer<'a, C> {
    /// Prepares passes of `photons` photons each through `scene`, whose mesh `caster` holds.
    pub fn new(scene: &'a Scene, caster: &'a RayCaster, photons: u64) -> Self {
        let surfaces: Vec<SurfaceOptics<C>> = scene.materials.iter().map(SurfaceOptics::from).collect();
        let around = |luminaire: &Luminaire| Media::around(luminaire.opening.middle().as_vec3(), caster, &surfaces);
        let mut starts: Vec<Media> = scene.luminaires.par_iter().map(around).collect();
        if starts.iter().all(|media| *media == Media::AIR) {
            starts.clear();
        }
        let emission = Emission::new(&scene.luminaires, photons, caster);
        Self { caster, surfaces, emission, starts, photons, most_bounces: BOUNCE_CAP }
    }

    /// The same with another cap on bounces.
    pub fn with_most_bounces(self, most_bounces: u32) -> Self {
        Self { most_bounces, ..self }
    }

    /// Photons of a pass.
    pub fn photons(&self) -> u64 {
        self.photons
    }

    /// Traces one pass. Returns the recorders of consecutive photons, in order, and the flux balance: the same bits
    /// for any number of threads. `progress` is called with the number of photons that have ended since its last call.
    pub fn trace<R: Recorder<C>>(
        &self,
        seed: Seed,
        pass: u64,
        recorder: impl Fn() -> R + Sync,
        progress: impl Fn(u64) + Sync,
    ) -> (Vec<R>, Tally<C>) {
        let offset = f64::from(seed.branch(pass).stream(u64::MAX).uniform());
        let chunks: Vec<(R, Tally<C>)> = (0..self.photons.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let (mut recorder, mut tally) = (recorder(), Tally::default());
                let photons = chunk * CHUNK..((chunk + 1) * CHUNK).min(self.photons);
                let count = photons.end - photons.start;
                for photon in photons {
                    let mut stream = seed.stream(pass.wrapping_mul(self.photons).wrapping_add(photon));
                    self.follow((photon as f64 + offset) / self.photons as f64, &mut stream, &mut recorder, &mut tally);
                }
                progress(count);
                (recorder, tally)
            })
            .collect();
        let mut total = Tally::default();
        let recorders = chunks
            .into_iter()
            .map(|(recorder, tally)| {
                total.add(&tally);
                recorder
            })
            .collect();
        (recorders, total)
    }

    /// Follows photon number `photon` of a pass by itself.
    pub(super) fn life<R: Recorder<C> + Default>(&self, seed: Seed, photon: u64) -> (R, Tally<C>) {
        let (mut recorder, mut tally) = (R::default(), Tally::default());
        let place = (photon as f64 + 0.5) / self.photons as f64;
        self.follow(place, &mut seed.stream(photon), &mut recorder, &mut tally);
        (recorder, tally)
    }

    /// Follows one photon from its luminaire to its end.
    #[inline]
    fn follow(&self, place: f64, stream: &mut Stream, recorder: &mut impl Recorder<C>, tally: &mut Tally<C>) {
        // Emit.
        let photon = self.emission.photon(place, stream);
        let (mut origin, mut direction, mut flux) = (photon.origin, photon.direction, photon.flux);
        let luminaire = photon.luminaire;
        let mut media = self.starts.get(luminaire as usize).copied().unwrap_or(Media::AIR);
        let (mut history, mut glass) = (History::Direct, media.absorption(&self.surfaces));
        accumulate(&mut tally.emitted, flux, 1.0);
        for _ in 0..self.most_bounces {
            // Fly.
            tally.rays += 1;
            let hit = self.caster.closest_hit(origin, direction, f32::INFINITY);
            let surface = hit.as_ref().map(|hit| &self.surfaces[hit.material as usize]);
            let lands = surface.is_some_and(SurfaceOptics::is_landed_on);
            if let Some(hit) = &hit
                && glass.iter().any(|&per_metre| per_metre > 0.0)
            {
                let Some(left) = pass_glass(flux, glass, hit.distance, stream) else {
                    accumulate(&mut tally.absorbed, flux, 1.0);
                    return;
                };
                tally.lose(flux, left);
                flux = left;
            }
            // Land, and leave a record.
            recorder.record(&Flight { origin, direction, hit: hit.as_ref(), lands, history, luminaire }, flux);
            let (Some(hit), Some(surface)) = (&hit, surface) else {
                accumulate(&mut tally.escaped, flux, 1.0);
                return;
            };
            // Survive or end.
            let ratio = |entering| media.ratio(&self.surfaces, hit.material, entering);
            match surface.meet(direction, hit.normal, flux, ratio, stream) {
                PhotonFate::Absorbed => {
                    accumulate(&mut tally.absorbed, flux, 1.0);
                    return;
                }
                PhotonFate::Diffused(onward, left) => {
                    tally.lose(flux, left);
                    (direction, flux, history) = (onward, left, History::Diffused);
                }
                PhotonFate::Glossed(onward, left) => {
                    tally.lose(flux, left);
                    (direction, flux, history) = (onward, left, history.after_gloss());
                }
                PhotonFate::Mirrored(onward, left) => {
                    tally.lose(flux, left);
                    (direction, flux, history) = (onward, left, history.after_specular());
                }
                PhotonFate::Passed(left) => {
                    tally.lose(flux, left);
                    flux = left;
                }
                PhotonFate::Refracted(onward, entering) => {
                    media = media.beyond(hit.material, entering);
                    (direction, glass) = (onward, media.absorption(&self.surfaces));
                    history = history.after_specular();
                }
            }
            origin = hit.leave(direction);
        }
        accumulate(&mut tally.cut_off, flux, 1.0);
    }
}

impl History {
    fn after_specular(self) -> Self {
        if self == Self::Diffused { self } else { Self::Specular }
    }

    fn after_gloss(self) -> Self {
        if self == Self::Direct { Self::Glossy } else { self }
    }
}

//! A few photons sent ahead: does this scene's light come to an end?
//!
//! Where some surface absorbs next to nothing, light may be caught for ever: in a closed room of ρ = 1, which has no
//! illuminance to settle at, or by total reflection in clear glass, where it lights nothing but takes time.

use rayon::prelude::*;

use super::trace::{BOUNCE_CAP, Flight, Recorder, Tally, Tracer};
use crate::flux::{Flux, photometric};
use crate::random::Seed;
use crate::scene::Scene;

/// Photons sent ahead: half a minute of them at most, where all are caught, on one thread.
const PHOTONS: u64 = 128;
/// Of this many flights at the end of a photon that was cut off, none ends on an opaque surface if glass has caught it.
const LAST: u32 = BOUNCE_CAP / 10;
/// Fewest bounces before light in glass counts as caught.
const MIN_BOUNCES: u32 = 1000;
/// A surface that absorbs less than this part of some channel might keep light for longer than photons may fly.
const NEXT_TO_NOTHING: f64 = 5e-5;

/// What became of the photons sent ahead.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhotonTrial {
    /// Photons sent.
    pub photons: u64,
    /// Part of their flux that still went from surface to surface when they were cut off.
    pub endless: f64,
    /// Part of their flux that clear glass has caught.
    pub in_glass: f64,
    /// Most bounces of those that came to an end.
    pub longest: u32,
}

impl PhotonTrial {
    /// Whether any of a scene's surfaces absorbs so little that a trial is called for; `size` (m) is the scene's.
    pub fn is_called_for(scene: &Scene, size: f64) -> bool {
        scene.materials.iter().any(|material| {
            let kept = |c: usize| match &material.glazing {
                Some(pane) => pane.transmittance[c] + pane.reflectance[c],
                None => material.reflectance[c] + material.specular[c] + material.transmittance[c],
            };
            let back = material
                .back
                .as_ref()
                .is_some_and(|back| (0..3).any(|c| back.reflectance[c] + back.specular[c] > 1.0 - NEXT_TO_NOTHING));
            match material.dielectric {
                Some(glass) => glass.absorption.iter().any(|per_metre| per_metre * size < NEXT_TO_NOTHING),
                None => back || (0..3).any(|c| kept(c) > 1.0 - NEXT_TO_NOTHING),
            }
        })
    }

    /// Sends photons through a scene. Cost: 0.1 s where light comes to an end, 1 s on two threads where all is caught.
    pub fn of<const C: usize>(scene: &Scene, caster: &crate::embree::RayCaster, seed: Seed) -> Self {
        let tracer = Tracer::<C>::new(scene, caster, PHOTONS);
        let lives: Vec<(Life, Tally<C>)> =
            (0..PHOTONS).into_par_iter().map(|photon| tracer.life(seed, photon)).collect();
        let mut trial = Self { photons: PHOTONS, ..Self::default() };
        let emitted: f64 = lives.iter().map(|(_, tally)| photometric(tally.emitted)).sum();
        for (life, tally) in &lives {
            let cut_off = photometric(tally.cut_off) / emitted;
            if cut_off <= 0.0 {
                trial.longest = trial.longest.max(life.flights);
            } else if life.last_landing + LAST < life.flights {
                trial.in_glass += cut_off;
            } else {
                trial.endless += cut_off;
            }
        }
        trial
    }

    /// Bounces that photons may make: fewer than [`BOUNCE_CAP`] where all that would get so far is caught in glass.
    pub fn most_bounces(&self) -> u32 {
        if self.in_glass > 0.0 && self.endless <= 0.0 {
            (4 * self.longest).clamp(MIN_BOUNCES, BOUNCE_CAP)
        } else {
            BOUNCE_CAP
        }
    }
}

/// How long a photon flew.
#[derive(Clone, Copy, Default)]
pub(super) struct Life {
    flights: u32,
    /// The last flight that ended on an opaque surface.
    last_landing: u32,
}

impl<const C: usize> Recorder<C> for Life {
    fn record(&mut self, flight: &Flight<'_>, _: Flux<C>) {
        self.flights += 1;
        if flight.lands {
            self.last_landing = self.flights;
        }
    }
}

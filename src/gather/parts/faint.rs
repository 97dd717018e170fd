//! Direct light of luminaires that are faint at a point: sampled by rays in every round, smoothed by neighbours.

use std::io;
use std::sync::atomic::{AtomicU64, Ordering};

use super::{LightOrigin, LightPart, PhotonTotal, RayRound, Site};
use crate::embree::RayCaster;
use crate::gather::density::Estimate;
use crate::gather::direct::faint::Faint;
use crate::gather::receiver::Receiver;
use crate::gather::smooth::{MAP_BATCHES, Samples};
use crate::random::{Seed, Stream};
use crate::state::tape::Tape;

/// Bytes that a point takes, by channels.
pub fn bytes_per_point(channels: u64) -> u64 {
    128 * channels + 8 * channels + 8
}

/// The faint luminaires of every point of a grid, and what is known of their light.
pub struct FaintLight<const C: usize> {
    luminaires: Faint<C>,
    /// What rays to them found at each point.
    samples: Samples<C>,
    /// What that comes to; nothing before the first pass is over.
    light: Vec<Estimate<C>>,
    seed: Seed,
}

impl<const C: usize> FaintLight<C> {
    /// Nothing known yet of these luminaires at `points` points; `seed` is this receiver's own.
    pub fn new(luminaires: Faint<C>, points: usize, seed: Seed) -> Self {
        Self { luminaires, samples: Samples::new(points, MAP_BATCHES), light: Vec::new(), seed }
    }
}

/// What `count` rays to the faint luminaires of a point find, their sum, and the rays that took.
fn sample<const C: usize>(
    luminaires: &Faint<C>,
    point: usize,
    count: u64,
    receiver: &Receiver,
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

impl<const C: usize> LightPart<C> for FaintLight<C> {
    fn source(&self) -> LightOrigin {
        LightOrigin::Luminaires
    }

    fn add_rays(&mut self, round: &RayRound<'_, C>, site: &Site) -> u64 {
        let (seed, rays) = (self.seed.branch(round.number), AtomicU64::new(0));
        let (luminaires, caster) = (&self.luminaires, round.sight.caster());
        self.samples.add(round.number, round.rays, |point| {
            if !site.has_value[point] {
                return [0.0; C];
            }
            let stream = &mut seed.stream(point as u64);
            let (sum, cast) = sample(luminaires, point, round.rays, &site.receiver, caster, stream);
            rays.fetch_add(cast, Ordering::Relaxed);
            sum
        });
        rays.into_inner()
    }

    fn conclude(&mut self, _: PhotonTotal, site: &Site) -> Vec<Estimate<C>> {
        self.light = match &site.smoother {
            Some(smoother) => smoother.smooth(&self.samples, &site.has_value, &mut Vec::new()),
            None => self.samples.alone(),
        };
        Vec::new()
    }

    fn straight(&self, point: usize) -> Estimate<C> {
        self.light.get(point).copied().unwrap_or(Estimate::DARK)
    }

    fn exchange(&mut self, tape: &mut Tape<'_>) -> io::Result<()> {
        self.samples.exchange(tape)
    }

    fn variance_of_sum(&self, weighted: &[(usize, f64)]) -> Option<f64> {
        Some(self.samples.variance_of_sum(weighted))
    }

    fn can_sample_again(&self) -> bool {
        true
    }

    fn sample_again(&self, point: usize, count: u64, site: &Site, caster: &RayCaster, seed: Seed) -> ([f64; C], u64) {
        let stream = &mut seed.branch(1).stream(point as u64);
        sample(&self.luminaires, point, count, &site.receiver, caster, stream)
    }

    fn replace_straight(&mut self, point: usize, light: Estimate<C>) {
        if let Some(known) = self.light.get_mut(point) {
            *known = light;
        }
    }
}

//! Faint luminaires: in a large room most of them bring a point next to nothing each, and hide behind ever more
//! furniture.
//!
//! To cut every shadow of every one of hundreds out exactly would take nearly all of a run's time, for a share of the
//! light that is smaller than what is known of the rest. So what remains after the strong ones is left to rays: each
//! draws one faint luminaire by what it can bring at most, and a point on it. That has no bias, its noise is in the
//! samples' scatter, falls from pass to pass, and neighbours smooth it.

use glam::Vec3;

use super::emitter::{EmittingPiece, LightSource, OpeningLight};
use super::sample::Target;
use crate::embree::RayCaster;
use crate::random::Stream;

/// A luminaire is faint where it brings no more than this part of what the brightest point of the block has got already
/// …
pub(super) const FAINT: f64 = 0.02;
/// … and more triangles than this may be in its way.
pub(super) const MAX_BLOCKERS_IF_STRONG: usize = 64;

/// The faint luminaires of every point of a receiver.
pub struct Faint<const C: usize> {
    pub(super) emitters: Vec<EmittingPiece<C>>,
    /// Where the faint ones of each point's block lie.
    pub(super) of_point: Vec<[u32; 2]>,
    /// Numbers of emitters, and the running sum of what they can bring at most, lx: starts anew with each block.
    pub(super) drawn: Vec<(u32, f64)>,
}

impl<const C: usize> Faint<C> {
    /// Whether no point has any.
    pub fn is_empty(&self) -> bool {
        self.drawn.is_empty()
    }

    /// An estimate without bias of what the faint luminaires bring to a point, lx, and the rays that took; `share` (0 …
    /// 1, uniform) chooses the luminaire that stands for them. Cost: one shadow ray, where there is a faint one at all.
    pub fn sample(
        &self,
        point: usize,
        share: f32,
        start: Vec3,
        normal: Vec3,
        caster: &RayCaster,
        stream: &mut Stream,
    ) -> ([f64; C], u64) {
        let [first, end] = self.of_point[point];
        let drawn = &self.drawn[first as usize..end as usize];
        let Some(&(_, whole)) = drawn.last() else { return ([0.0; C], 0) };
        let at = f64::from(share) * whole;
        let index = drawn.partition_point(|&(_, upto)| upto <= at).min(drawn.len() - 1);
        let most = drawn[index].1 - if index > 0 { drawn[index - 1].1 } else { 0.0 };
        let emitter = &self.emitters[drawn[index].0 as usize];
        let LightSource::Polygon(polygon) = &emitter.source else { return ([0.0; C], 0) };
        let ray = Target::Flat(polygon).aim(stream.uniform_pair(), start, normal, caster);
        if !(ray.weight > 0.0 && ray.weight.is_finite()) {
            return ([0.0; C], 0);
        }
        let lux = match &polygon.light {
            OpeningLight::Lambertian(luminance) => luminance * polygon.area * ray.weight,
            OpeningLight::Web(_) => ray.weight,
        };
        let seen = lux * whole / most;
        let passed = caster.transmittance(start, ray.direction, ray.distance);
        (emitter.tinted(passed.map(|passed| f64::from(passed) * seen)), 1)
    }
}

//! Direct light at any point by one shadow ray: for paths, which ask at millions of points and need no more.

use glam::Vec3;

use crate::embree::RayCaster;
use crate::luminaire::emit::{Front, triangle_area};
use crate::luminaire::{Distribution, Luminaire, Opening};
use crate::photon::flux::channels;
use crate::photon::random::Stream;

/// Points on luminaires that are weighed against each other before one shadow ray is cast: all luminaires of a small
/// scene have their turn, and in a large one the near ones still win.
const CANDIDATES: usize = 12;

/// Squared distance (m²) within which points of a luminaire are left to rays that happen to meet it: next to a shining
/// wall, a point drawn on it brings 1/d² times the mean, and the variance has no bound. At the radius of a disc of the
/// opening's area, drawing never brings more than the opening could.
pub fn near_squared(luminaire: &Luminaire) -> f32 {
    let area = match &luminaire.opening {
        Opening::Point { .. } => 0.0,
        Opening::Rectangle { half_width, half_depth, .. } => 4.0 * half_width.cross(*half_depth).length(),
        Opening::Disc { radius, .. } => std::f64::consts::PI * radius * radius,
        Opening::Triangles(triangles) => triangles.iter().map(triangle_area).sum(),
    };
    (area / std::f64::consts::PI) as f32
}

/// The luminaires of a scene, ready to be asked for direct light.
pub struct Lamps<'a, const C: usize> {
    caster: &'a RayCaster,
    lamps: Vec<Lamp<C>>,
    /// Running sum of the luminaires' shares of the flux; the last is 1.
    shares: Vec<f32>,
    /// Flux of all, lm.
    flux: f32,
    candidates: usize,
}

struct Lamp<const C: usize> {
    front: Front,
    /// Squared distance, m², within which rays find it better.
    near_squared: f32,
    distribution: Distribution,
    colour: [f32; C],
}

impl<'a, const C: usize> Lamps<'a, C> {
    /// Prepares the luminaires of a scene whose mesh `caster` holds.
    pub fn new(luminaires: &[Luminaire], caster: &'a RayCaster) -> Self {
        let flux: f64 = luminaires.iter().map(|luminaire| luminaire.flux.0).sum();
        let shares = luminaires.iter().scan(0.0, |sum, luminaire| {
            *sum += luminaire.flux.0 / flux;
            Some(*sum as f32)
        });
        let lamp = |luminaire: &Luminaire| Lamp {
            front: Front::new(&luminaire.opening),
            near_squared: near_squared(luminaire),
            distribution: luminaire.distribution,
            colour: channels::<C>(luminaire.colour).map(|channel| channel as f32),
        };
        Self {
            caster,
            lamps: luminaires.iter().map(lamp).collect(),
            shares: shares.collect(),
            flux: flux as f32,
            candidates: CANDIDATES.min(luminaires.len()),
        }
    }

    /// An estimate without bias of the direct illuminance (lx) at a point `from` (m) just off a surface with unit normal
    /// `normal`, from what of the luminaires is not nearer than [`near_squared`].
    ///
    /// Points of the luminaires are drawn by flux, equally spaced among it; one of them is then chosen by what it would
    /// bring unobstructed, and stands for all (resampled importance sampling, Talbot et al. 2005). Cost: one shadow ray
    /// and some 10 ns a candidate.
    pub fn direct(&self, from: Vec3, normal: Vec3, stream: &mut Stream) -> [f32; C] {
        self.direct_from(stream.uniform(), from, normal, stream)
    }

    /// The same with the places of the points drawn among the flux chosen by `offset` (0 … 1, uniform): several calls for one
    /// point spread theirs evenly.
    pub fn direct_from(&self, offset: f32, from: Vec3, normal: Vec3, stream: &mut Stream) -> [f32; C] {
        let (mut whole, mut chosen) = (0.0_f32, None);
        for candidate in 0..self.candidates {
            let share = (candidate as f32 + offset) / self.candidates as f32;
            let which = self.shares.partition_point(|&upto| upto <= share).min(self.lamps.len() - 1);
            let lamp = &self.lamps[which];
            let at = if lamp.front.is_point() { [0.0; 2] } else { stream.uniform_pair() };
            let choice = stream.uniform();
            let (target, facing) = lamp.front.point_off(choice, at, from, self.caster);
            let to = target - from;
            let distance = to.length();
            let direction = to / distance;
            let leaving = match lamp.distribution {
                Distribution::Isotropic => 0.25,
                Distribution::Lambertian => (-direction.dot(facing)).max(0.0),
            };
            let weight = leaving * direction.dot(normal).max(0.0) / (distance * distance);
            if weight > 0.0 && weight.is_finite() && distance * distance >= lamp.near_squared {
                whole += weight;
                if stream.uniform() * whole < weight {
                    chosen = Some((lamp, direction, distance));
                }
            }
        }
        let Some((lamp, direction, distance)) = chosen else { return [0.0; C] };
        let reach = if lamp.front.is_point() { distance * (1.0 - 1e-5) } else { distance };
        if self.caster.is_occluded(from, direction, reach) {
            return [0.0; C];
        }
        let lux = self.flux * std::f32::consts::FRAC_1_PI * whole / self.candidates as f32;
        lamp.colour.map(|channel| channel * lux)
    }
}

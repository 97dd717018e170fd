//! Photons leave the luminaires, shared among them by their flux.

use glam::{DVec3, Vec3};

use super::{Distribution, Luminaire, Opening};
use crate::embree::RayCaster;
use crate::photon::flux::{Flux, channels};
use crate::photon::random::Stream;

/// All luminaires of a scene, ready to emit the photons of one pass.
pub struct Emission<'a, const C: usize> {
    luminaires: &'a [Luminaire],
    /// Running sum of the luminaires' shares of the flux; the last is 1.
    shares: Vec<f64>,
    /// What one photon of each luminaire carries.
    flux: Vec<Flux<C>>,
    /// Running sums of triangle areas as shares, for openings made of triangles.
    areas: Vec<Vec<f64>>,
    caster: &'a RayCaster,
}

/// A photon as it leaves its luminaire.
pub struct Emitted<const C: usize> {
    /// Start of its ray, m.
    pub origin: Vec3,
    /// Unit vector.
    pub direction: Vec3,
    /// What it carries.
    pub flux: Flux<C>,
}

impl<'a, const C: usize> Emission<'a, C> {
    /// Prepares `photons` photons that carry equal luminous flux, to fly through what `caster` holds.
    pub fn new(luminaires: &'a [Luminaire], photons: u64, caster: &'a RayCaster) -> Self {
        let total: f64 = luminaires.iter().map(|luminaire| luminaire.flux.0).sum();
        let running = |sum: &mut f64, part: f64| {
            *sum += part;
            Some(*sum)
        };
        let shares = luminaires.iter().map(|luminaire| luminaire.flux.0 / total).scan(0.0, running).collect();
        let each = total / photons as f64;
        let flux = luminaires
            .iter()
            .map(|luminaire| Flux(channels::<C>(luminaire.colour).map(|channel| (channel * each) as f32)))
            .collect();
        let areas = luminaires
            .iter()
            .map(|luminaire| match &luminaire.opening {
                Opening::Triangles(triangles) => {
                    let whole: f64 = triangles.iter().map(triangle_area).sum();
                    triangles.iter().map(|triangle| triangle_area(triangle) / whole).scan(0.0, running).collect()
                }
                _ => Vec::new(),
            })
            .collect();
        Self { luminaires, shares, flux, areas, caster }
    }

    /// The photon whose place in the pass is `place` (0 ≤ place < 1): luminaires follow each other along it, each with
    /// its share of the flux. Equally spaced places so make a stratified choice, and rays that start together stay
    /// together in memory.
    #[inline]
    pub fn photon(&self, place: f64, stream: &mut Stream) -> Emitted<C> {
        let which = self.shares.partition_point(|&share| share <= place).min(self.luminaires.len() - 1);
        let luminaire = &self.luminaires[which];
        let (origin, direction) = match &luminaire.opening {
            Opening::Point { position, aim } => {
                let direction = match luminaire.distribution {
                    Distribution::Isotropic => stream.on_sphere(),
                    Distribution::Lambertian => stream.cosine_about(aim.as_vec3()),
                };
                (position.as_vec3(), direction)
            }
            opening => {
                let choice = if self.areas[which].is_empty() { 0.0 } else { stream.uniform() };
                let [u, v] = stream.uniform_pair();
                let (point, normal) =
                    opening.point(&self.areas[which], f64::from(choice), [f64::from(u), f64::from(v)]);
                let (point, normal) = (point.as_vec3(), normal.as_vec3());
                (self.caster.step_off(point, normal), stream.cosine_about(normal))
            }
        };
        Emitted { origin, direction, flux: self.flux[which] }
    }

    /// Flux of the whole pass in each channel, lm.
    pub fn total(&self) -> [f64; C] {
        let mut total = [0.0; C];
        for luminaire in self.luminaires {
            for (sum, share) in total.iter_mut().zip(channels::<C>(luminaire.colour)) {
                *sum += share * luminaire.flux.0;
            }
        }
        total
    }
}

impl Opening {
    /// A point of the opening and its unit normal there: equal areas of the unit square `at` give equal areas of the
    /// opening. `choice` (0 … 1) picks a triangle by the running shares `areas`; other openings ignore both.
    pub fn point(&self, areas: &[f64], choice: f64, at: [f64; 2]) -> (DVec3, DVec3) {
        let [u, v] = at;
        match self {
            Self::Point { position, aim } => (*position, *aim),
            Self::Rectangle { centre, half_width, half_depth } => (
                *centre + *half_width * (2.0 * u - 1.0) + *half_depth * (2.0 * v - 1.0),
                half_width.cross(*half_depth).normalize(),
            ),
            Self::Disc { centre, aim, radius } => {
                let (x, y) = aim.any_orthonormal_pair();
                let [a, b] = concentric_disc([u, v]);
                (*centre + (x * a + y * b) * *radius, *aim)
            }
            Self::Triangles(triangles) => {
                let which = areas.partition_point(|&share| share <= choice).min(triangles.len() - 1);
                let [a, b, c] = triangles[which];
                let root = u.sqrt();
                (a + (b - a) * (root * (1.0 - v)) + (c - a) * (root * v), (b - a).cross(c - a).normalize())
            }
        }
    }
}

/// Area of a triangle, m².
pub fn triangle_area(&[a, b, c]: &[DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// The unit square onto the unit disc: equal areas stay equal, squares about the middle become circles
/// (Shirley & Chiu 1997).
fn concentric_disc([u, v]: [f64; 2]) -> [f64; 2] {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return [0.0; 2];
    }
    let quarter = std::f64::consts::FRAC_PI_4;
    let (radius, angle) =
        if a.abs() > b.abs() { (a, quarter * (b / a)) } else { (b, 2.0 * quarter - quarter * (a / b)) };
    [radius * angle.cos(), radius * angle.sin()]
}

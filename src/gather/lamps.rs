//! Direct light at any point by one shadow ray: for paths, which need it at millions of points and no more exactly.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};

use super::JUST_BEFORE;
use crate::embree::RayCaster;
use crate::flux::channels;
use crate::geometry::body::Body;
use crate::luminaire::{Distribution, Luminaire, Opening, drawn_shares};
use crate::photon::emit::{Front, off_body, triangle_area};
use crate::random::Stream;

/// Points on luminaires that are weighed against each other before one shadow ray is cast: all luminaires of a small
/// scene are taken, and in a large one the near ones still are.
const CANDIDATES: usize = 12;

/// Squared distance (m²) within which points of a luminaire are left to rays that happen to meet it: next to a shining
/// wall, a point drawn on it brings 1/d² times the mean, and the variance has no bound. At the radius of a disc of the
/// opening's area, drawing never brings more than the opening could. (Of a body a quarter of its surface, the area seen
/// in the mean.)
pub fn near_squared(luminaire: &Luminaire) -> f32 {
    let area = match &luminaire.opening {
        Opening::Point { .. } => 0.0,
        Opening::Rectangle { half_width, half_depth, .. } => 4.0 * half_width.cross(*half_depth).length(),
        Opening::Ellipse { half_width, half_depth, .. } => {
            std::f64::consts::PI * half_width.cross(*half_depth).length()
        }
        Opening::Disc { radius, .. } => std::f64::consts::PI * radius * radius,
        Opening::Body(body) => body.surface() / 4.0,
        Opening::Triangles(triangles) => triangles.iter().map(triangle_area).sum(),
    };
    (area / std::f64::consts::PI) as f32
}

/// Area (m²) of each luminaire that stands for one of the points drawn on them all: its own over its share of the
/// points.
pub fn spreads(luminaires: &[Luminaire]) -> Vec<f32> {
    let points = CANDIDATES.min(luminaires.len()) as f64;
    let drawn = luminaires.iter().zip(drawn_shares(luminaires));
    drawn.map(|(luminaire, (share, _))| PI * near_squared(luminaire) / (points * share) as f32).collect()
}

/// A point drawn on a luminaire, as the point lit sees it.
pub struct Aim {
    /// Unit vector to it.
    pub direction: Vec3,
    /// Whether it is nearer than [`near_squared`].
    pub near: bool,
    /// What it stands for, sr: one over the density with which such points are drawn; 0 for a luminaire without extent.
    pub solid_angle: f32,
}

/// The luminaire that was chosen to stand for all.
pub struct Aimed<const C: usize> {
    /// Unit vector to its point.
    pub direction: Vec3,
    /// What all bring, lx.
    pub lux: [f32; C],
    /// Its number.
    pub luminaire: u32,
}

/// The luminaires of a scene, prepared for samples of their direct light.
pub struct LampSampler<'a, const C: usize> {
    caster: &'a RayCaster,
    lamps: Vec<DrawnLamp<C>>,
    /// Running sum of the luminaires' shares of the points drawn; the last is 1.
    shares: Vec<f32>,
    /// Flux of all, lm.
    flux: f32,
    candidates: usize,
    /// Whether some luminaire is far fainter than the others: then those that are hidden must not stand for it.
    uneven: bool,
}

struct DrawnLamp<const C: usize> {
    /// What a point drawn on it is to be multiplied by; see [`drawn_shares`].
    times: f32,
    front: Front,
    /// Squared distance, m², within which rays find it better.
    near_squared: f32,
    /// See [`spreads`].
    spread: f32,
    distribution: Distribution,
    /// Where the opening is a body.
    body: Option<Body>,
    colour: [f32; C],
}

/// How much more of a luminaire a point stands for towards where it is seen from than it was drawn for.
enum Times<'a> {
    Once,
    /// Drawn by the area seen from afar in a direction; facet's normal and the body.
    Body {
        drawn_for: DVec3,
        normal: DVec3,
        body: &'a Body,
    },
}

impl Times<'_> {
    fn of(&self, direction: DVec3) -> f32 {
        match self {
            Self::Once => 1.0,
            Self::Body { drawn_for, normal, body } => {
                let seen = normal.dot(direction).max(0.0) / body.projected_area(direction);
                (seen * body.projected_area(*drawn_for) / normal.dot(*drawn_for)) as f32
            }
        }
    }
}

impl<const C: usize> DrawnLamp<C> {
    /// A point of the luminaire and its normal.
    ///
    /// Flat openings, and Lambertian ones: equal shares by area. Of a measured body the points that face `from` are
    /// drawn, by the area seen from its distance: all that `from` sees may be drawn, as a facet that faces a point
    /// faces away from the body's middle, too.
    fn point(&self, from: Vec3, stream: &mut Stream, caster: &RayCaster) -> ((Vec3, Vec3), Times<'_>) {
        if let (Some(body), Distribution::Measured(_)) = (&self.body, &self.distribution) {
            let drawn_for = (from.as_dvec3() - body.centre).normalize_or(DVec3::Z);
            let (point, normal) = off_body(body, body.point_seen(drawn_for, stream), from, caster);
            return ((point, normal.as_vec3()), Times::Body { drawn_for, normal, body });
        }
        let at = if self.front.is_point() { [0.0; 2] } else { stream.uniform_pair() };
        let choice = stream.uniform();
        (self.front.point_seen(choice, at, from, caster), Times::Once)
    }
}

impl<'a, const C: usize> LampSampler<'a, C> {
    /// Prepares the luminaires of a scene whose mesh `caster` holds.
    pub fn new(luminaires: &[Luminaire], caster: &'a RayCaster) -> Self {
        let flux: f64 = luminaires.iter().map(|luminaire| luminaire.flux.0).sum();
        let drawn = drawn_shares(luminaires);
        let shares = drawn.iter().scan(0.0, |sum, (share, _)| {
            *sum += share;
            Some(*sum as f32)
        });
        let lamp = |((luminaire, spread), (_, times)): ((&Luminaire, f32), &(f64, f64))| DrawnLamp {
            times: *times as f32,
            front: Front::of(luminaire),
            near_squared: near_squared(luminaire),
            spread,
            distribution: luminaire.distribution.clone(),
            body: match luminaire.opening {
                Opening::Body(body) => Some(body),
                _ => None,
            },
            colour: channels::<C>(luminaire.colour).map(|channel| channel as f32),
        };
        Self {
            caster,
            lamps: luminaires.iter().zip(spreads(luminaires)).zip(&drawn).map(lamp).collect(),
            shares: shares.collect(),
            flux: flux as f32,
            candidates: CANDIDATES.min(luminaires.len()),
            uneven: drawn.iter().any(|(_, times)| *times != 1.0),
        }
    }

    /// An estimate without bias of the direct illuminance (lx) at a point `from` (m) just off a surface with unit
    /// normal `normal`, from what of the luminaires is not nearer than [`near_squared`]; and the luminaire that stands
    /// for all.
    pub fn direct(&self, from: Vec3, normal: Vec3, stream: &mut Stream) -> ([f32; C], u32) {
        self.direct_from(stream.uniform(), from, normal, stream)
    }

    /// The same with the places of the points drawn among the flux chosen by `offset` (0 … 1, uniform): several calls
    /// for one point spread theirs evenly.
    pub fn direct_from(&self, offset: f32, from: Vec3, normal: Vec3, stream: &mut Stream) -> ([f32; C], u32) {
        let cosine = |aim: &Aim| if aim.near { 0.0 } else { aim.direction.dot(normal).max(0.0) };
        self.aimed_from(offset, from, cosine, stream).map_or(([0.0; C], 0), |aimed| (aimed.lux, aimed.luminaire))
    }

    /// The same where `receive` gives the weight of light from each direction, instead of its cosine; also returns the
    /// direction that the light comes from, for a weight that `receive` only approximates.
    ///
    /// Points of the luminaires are drawn by flux, equally spaced among it; one of them is then chosen by what it would
    /// bring unobstructed, and stands for all (resampled importance sampling, Talbot et al. 2005). Cost: one shadow ray
    /// and some 10 ns a candidate; a shadow ray each where luminaires are very unlike, as a bright one behind a wall
    /// would nearly always stand for the faint one before it, and bring nothing.
    pub fn aimed(&self, from: Vec3, receive: impl Fn(&Aim) -> f32, stream: &mut Stream) -> Option<Aimed<C>> {
        self.aimed_from(stream.uniform(), from, receive, stream)
    }

    /// The same with the places of the points drawn among the flux chosen by `offset` (0 … 1, uniform): several calls
    /// for one point spread theirs evenly.
    fn aimed_from(
        &self,
        offset: f32,
        from: Vec3,
        receive: impl Fn(&Aim) -> f32,
        stream: &mut Stream,
    ) -> Option<Aimed<C>> {
        let (mut whole, mut chosen) = (0.0_f32, None);
        for candidate in 0..self.candidates {
            let share = (candidate as f32 + offset) / self.candidates as f32;
            let which = self.shares.partition_point(|&upto| upto <= share).min(self.lamps.len() - 1);
            let lamp = &self.lamps[which];
            let (target, times) = lamp.point(from, stream, self.caster);
            let to = target.0 - from;
            let distance = to.length();
            let direction = to / distance;
            let leaving = match &lamp.distribution {
                Distribution::Isotropic => 0.25,
                Distribution::Lambertian => (-direction.dot(target.1)).max(0.0),
                Distribution::Measured(measured) => {
                    let direction = -direction.as_dvec3();
                    PI * measured.at(direction) as f32 * times.of(direction)
                }
            };
            let cosine = if let Times::Body { .. } = times { 1.0 } else { direction.dot(target.1).abs() };
            let solid_angle = lamp.spread * cosine / (distance * distance);
            let aim = Aim { direction, near: distance * distance < lamp.near_squared, solid_angle };
            let weight = lamp.times * leaving * receive(&aim) / (distance * distance);
            if weight > 0.0 && weight.is_finite() {
                let reach = if lamp.front.is_point() { distance * JUST_BEFORE as f32 } else { distance };
                if self.uneven && self.caster.transmittance(from, direction, reach) == [0.0; 3] {
                    continue;
                }
                whole += weight;
                if stream.uniform() * whole < weight {
                    chosen = Some((which, direction, reach));
                }
            }
        }
        let (which, direction, reach) = chosen?;
        let lamp = &self.lamps[which];
        let passed = self.caster.transmittance(from, direction, reach);
        if passed == [0.0; 3] {
            return None;
        }
        let lux = self.flux * std::f32::consts::FRAC_1_PI * whole / self.candidates as f32;
        let mut lux = lamp.colour.map(|channel| channel * lux);
        if passed != [1.0; 3] {
            let passed = channels::<C>(passed.map(f64::from));
            (0..C).for_each(|c| lux[c] *= passed[c] as f32);
        }
        Some(Aimed { direction, lux, luminaire: which as u32 })
    }
}

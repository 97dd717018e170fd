//! What a camera sees along a ray: the light that arrives at the first opaque surface, and the luminance that leaves it
//! towards the eye.
//!
//! The layers of an image show the first opaque surface, which glass before it lets through bent, but not dimmed.
//! Luminance follows the light as it goes: glass reflects and refracts, mirrors show what stands before them,
//! luminaires shine. Light is gathered only at the surfaces so found: direct light by shadow rays, what has bounced by
//! rays that end where photons recorded the light (see `sight.rs`), and caustics from the photons that landed nearby
//! (`caustics.rs`).

use std::f64::consts::FRAC_1_PI;

use glam::Vec3;

use super::caustics::{CausticMap, CausticScratch};
use super::sight::{Last, Records, SURVIVAL, Sight, cross_glass, cross_pane};
use crate::embree::{Hit, RayCaster};
use crate::flux::Flux;
use crate::photon::media::Media;
use crate::photon::optics::{mirror, refract};
use crate::photon::surface::{Gloss, Layers, SurfaceOptics};
use crate::random::Stream;

/// Mirrors and panes one behind the other that a ray may meet before it is given up: light between two mirrors
/// ends by roulette, a ray trapped in glass by this.
const MAX_MEETINGS: u32 = 1000;

/// Computes what rays of a camera see.
pub struct Eye<'a, const C: usize> {
    /// Follows light backwards from the surfaces seen.
    pub sight: &'a Sight<'a, C>,
    /// The scene.
    pub caster: &'a RayCaster,
    /// Light that photons recorded, if they did.
    pub records: Option<Records<'a, C>>,
    /// The caustics, if there are any.
    pub caustics: Option<&'a CausticMap<C>>,
}

/// What one ray of a camera saw.
#[derive(Clone, Copy, Debug)]
pub struct CameraSample<const C: usize> {
    /// The first opaque surface; `None` where there is none.
    pub surface: Option<SeenSurface<C>>,
    /// Luminance towards the eye, cd/m².
    pub luminance: [f64; C],
}

/// What is known of the first opaque surface that a ray meets.
#[derive(Clone, Copy, Debug)]
pub struct SeenSurface<const C: usize> {
    /// Light that arrives at the side seen.
    pub light: Arriving<C>,
    /// Diffuse reflectance.
    pub albedo: [f32; C],
    /// Unit normal of the side seen.
    pub normal: Vec3,
}

/// Illuminance, lx.
#[derive(Clone, Copy, Debug)]
pub struct Arriving<const C: usize> {
    /// Straight from luminaires.
    pub direct: [f64; C],
    /// All other.
    pub indirect: [f64; C],
}

/// What a ray may draw on.
pub struct Draw<'s> {
    /// Point of the unit square that chooses the direction of the first ray from the surface.
    pub at: [f32; 2],
    /// Number (0 … 1) that chooses the luminaires of the direct light there.
    pub lamps: f32,
    /// How often caustics count in this ray: they are computed once a pixel, and counted for all its rays.
    pub caustics: f64,
    /// Memory for the photons.
    pub scratch: Option<&'s mut CausticScratch>,
    /// Random numbers.
    pub stream: &'s mut Stream,
    /// Counts rays.
    pub rays: &'s mut u64,
}

impl<const C: usize> Eye<'_, C> {
    /// What a ray from `origin` (m) along the unit vector `direction` sees: an estimate without bias but for what
    /// photons blur. Cost: some 1 to 2 µs where the ray ends on a diffuse surface.
    pub fn observe(&self, origin: Vec3, direction: Vec3, draw: &mut Draw<'_>) -> CameraSample<C> {
        *draw.rays += 1;
        let Some(first) = self.caster.closest_hit(origin, direction, f32::INFINITY) else {
            return CameraSample { surface: None, luminance: [0.0; C] };
        };
        let behind = through_glass(self.sight, self.caster, first, direction, draw.rays);
        let surface = behind.map(|(hit, direction)| {
            let normal = facing(&hit, direction);
            let albedo = seen_layers(self.sight.surface(&hit), &hit, direction).diffuse;
            SeenSurface { light: self.arriving(&hit, normal, draw), albedo, normal }
        });
        // Without glass in between, the light at that surface serves both.
        let known = surface.filter(|_| self.sight.surface(&first).is_landed_on());
        CameraSample { surface, luminance: self.luminance(first, direction, known.map(|surface| surface.light), draw) }
    }

    /// Light that arrives at a surface on the side of its unit normal `normal`.
    fn arriving(&self, hit: &Hit, normal: Vec3, draw: &mut Draw<'_>) -> Arriving<C> {
        let start = hit.leave(normal);
        *draw.rays += 1;
        let mut direct = self.sight.direct(draw.lamps, start, normal, draw.stream).map(f64::from);
        let direction = Stream::cosine_at(normal, draw.at);
        let mut indirect =
            self.sight.incoming_beside_direct(start, direction, self.records, &mut direct, draw.stream, draw.rays);
        if let (true, Some(caustics), Some(scratch)) = (draw.caustics > 0.0, self.caustics, draw.scratch.as_mut()) {
            let found = caustics.illuminance(hit.position, start, normal, self.caster, draw.stream, scratch);
            (0..C).for_each(|c| indirect[c] += draw.caustics * found[c]);
        }
        Arriving { direct, indirect }
    }

    /// Luminance (cd/m²) towards the eye of what a ray along `direction` met; `known` is the light there, if it is
    /// known.
    fn luminance(&self, hit: Hit, direction: Vec3, mut known: Option<Arriving<C>>, draw: &mut Draw<'_>) -> [f64; C] {
        let (mut hit, mut direction) = (hit, direction);
        let mut luminance = [0.0; C];
        let (mut weight, mut absorption) = (Flux([1.0; C]), [0.0; C]);
        let (mut media, mut last) = (Media::AIR, Last::Mirror);
        // Distance flown before panes that the ray passed since it left anything else, m.
        let mut before_panes = 0.0;
        for _ in 0..MAX_MEETINGS {
            weight = weight.filtered(absorption.map(|per_metre: f32| (-per_metre * hit.distance).exp()));
            hit.distance += before_panes;
            before_panes = 0.0;
            let normal = facing(&hit, direction);
            match self.sight.surface(&hit) {
                SurfaceOptics::Pane(curves) => match cross_pane(curves, direction, normal, weight, draw.stream) {
                    Some((true, left)) => (weight, before_panes) = (left, hit.distance),
                    Some((false, left)) => {
                        (weight, direction, last) = (left, mirror(direction, normal), Last::Mirror);
                    }
                    None => break,
                },
                SurfaceOptics::Glass { .. } => {
                    let surfaces = self.sight.surfaces();
                    direction = cross_glass(surfaces, &hit, direction, normal, &mut media, draw.stream);
                    absorption = media.absorption(surfaces);
                    last = Last::Mirror;
                }
                surface => {
                    let Layers { diffuse, transmitted, specular, rough, .. } = seen_layers(surface, &hit, direction);
                    let emitted = self.sight.emitted(&hit, direction, last);
                    let mut add = |weight: Flux<C>, cd: [f64; C]| {
                        (0..C).for_each(|c| luminance[c] += f64::from(weight.0[c]) * cd[c]);
                    };
                    add(weight, emitted);
                    let known = known.take();
                    for (shares, side) in [(diffuse, normal), (transmitted, -normal)] {
                        if shares.iter().all(|&share| share <= 0.0) {
                            continue;
                        }
                        let light = match known {
                            Some(light) if side == normal => light,
                            _ => {
                                (draw.at, draw.lamps) = (draw.stream.uniform_pair(), draw.stream.uniform());
                                self.arriving(&hit, side, draw)
                            }
                        };
                        let lux: [f64; C] = std::array::from_fn(|c| light.direct[c] + light.indirect[c]);
                        add(weight.filtered(shares), lux.map(|lux| lux * FRAC_1_PI));
                    }
                    weight = weight.filtered(specular);
                    let chance = (SURVIVAL * weight.brightest()).min(1.0);
                    if chance < 1.0 {
                        if draw.stream.uniform() >= chance {
                            break;
                        }
                        weight = weight.scaled(1.0 / chance);
                    }
                    (direction, last) = match rough {
                        None => (mirror(direction, normal), Last::Mirror),
                        Some(Gloss { facets, .. }) => {
                            *draw.rays += 1;
                            let at = hit.leave(normal);
                            let (lux, _) = self.sight.glossed(facets, at, -direction, normal, draw.stream);
                            add(weight, lux.map(|lux| f64::from(lux) * FRAC_1_PI));
                            let onward = facets.reflect(direction, normal, draw.stream);
                            (onward, Last::Gloss(facets.lobe(-direction, onward, normal)))
                        }
                    };
                }
            }
            *draw.rays += 1;
            match self.caster.closest_hit(hit.leave(direction), direction, f32::INFINITY) {
                Some(next) => hit = next,
                None => break,
            }
        }
        luminance
    }
}

/// What a surface does with light on the side that a ray along `direction` met.
fn seen_layers<const C: usize>(surface: &SurfaceOptics<C>, hit: &Hit, direction: Vec3) -> Layers<C> {
    surface.layers(direction.dot(hit.normal) < 0.0)
}

/// The first opaque surface met from `origin` (m) along the unit vector `direction`, through glass, and the direction
/// in which it is met.
pub fn first_surface<const C: usize>(
    sight: &Sight<'_, C>,
    caster: &RayCaster,
    origin: Vec3,
    direction: Vec3,
) -> Option<(Hit, Vec3)> {
    let hit = caster.closest_hit(origin, direction, f32::INFINITY)?;
    through_glass(sight, caster, hit, direction, &mut 0)
}

/// What a ray along `direction` that met `hit` meets behind all glass; itself, where it met none.
fn through_glass<const C: usize>(
    sight: &Sight<'_, C>,
    caster: &RayCaster,
    mut hit: Hit,
    mut direction: Vec3,
    rays: &mut u64,
) -> Option<(Hit, Vec3)> {
    let mut media = Media::AIR;
    for _ in 0..MAX_MEETINGS {
        let (front, normal) = (direction.dot(hit.normal) < 0.0, facing(&hit, direction));
        direction = match sight.surface(&hit) {
            SurfaceOptics::Pane(_) => direction,
            SurfaceOptics::Glass { .. } => {
                match refract(direction, normal, media.ratio(sight.surfaces(), hit.material, front)) {
                    Some((onward, _)) => {
                        media = media.beyond(hit.material, front);
                        onward
                    }
                    None => mirror(direction, normal),
                }
            }
            _ => return Some((hit, direction)),
        };
        *rays += 1;
        hit = caster.closest_hit(hit.leave(direction), direction, f32::INFINITY)?;
    }
    None
}

/// Unit normal of the side that a ray along `direction` met.
fn facing(hit: &Hit, direction: Vec3) -> Vec3 {
    if direction.dot(hit.normal) < 0.0 { hit.normal } else { -hit.normal }
}

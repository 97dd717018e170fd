//! What a point sees: light followed backwards from the measuring points, along rays.
//!
//! A ray in a direction of density cos θ/π brings E = π L, so illuminance is the mean over rays. Two methods ask this
//! way. `path` goes on from surface to surface and asks for direct light at each: unbiased, whatever the photons say.
//! `gather` ends at the first surface whose illuminance the photons know (see `patches.rs`), and goes on as a path where
//! they don't: next to the point, on fine furniture, in contacts. Direct light that reaches the point itself is counted
//! elsewhere (`direct.rs`).

use std::f32::consts::PI;

use glam::Vec3;

use super::lamps::{Aim, Lamps, near_squared, spreads};
use super::patches::{PatchGrid, PatchLight};
use crate::embree::{Hit, RayCaster};
use crate::luminaire::Luminaire;
use crate::luminaire::emit::triangle_area;
use crate::photon::flux::{Flux, channels, photometric};
use crate::photon::random::Stream;
use crate::photon::rough::Microsurface;
use crate::photon::surface::{Gloss, Layers, Surface, mirror, refract};
use crate::photon::trace::BOUNCE_CAP;
use crate::scene::Scene;

/// A path goes on with this many times the chance that what it still brings is worth: 1.6 to 2 times as efficient as
/// once, in an office.
const RELUCTANCE: f32 = 4.0;

/// Ready to follow light backwards through a scene.
pub struct Sight<'a, const C: usize> {
    caster: &'a RayCaster,
    surfaces: Vec<Surface<C>>,
    lamps: Lamps<'a, C>,
    /// The triangles that shine, in order.
    glow: Vec<Glow<C>>,
    /// Whether light of luminaires by way of mirrors and glass is counted where it reaches the point itself.
    caustics: bool,
}

/// A triangle that shines.
struct Glow<const C: usize> {
    triangle: u32,
    /// Exitance of its front, lx.
    exitance: [f32; C],
    /// Squared distance within which a ray from a surface counts it, m²; beyond, [`Lamps`] do.
    near_squared: f32,
    /// See [`spreads`].
    spread: f32,
}

/// What a ray left last: tells which part of the light of a luminaire that it meets was not drawn there.
#[derive(Clone, Copy)]
enum Last {
    /// The point that asks: luminaires it sees are counted elsewhere.
    Point,
    /// A mirror or glass: nothing was drawn.
    Mirror,
    /// A diffuse surface: all but what is near.
    Diffuse,
    /// A rough mirror, with this density (1/sr): what this way is the less likely to find.
    Gloss(f32),
}

/// Photons' answer where a ray ends.
#[derive(Clone, Copy)]
pub struct Records<'a, const C: usize> {
    /// The patches.
    pub grid: &'a PatchGrid,
    /// Their illuminance.
    pub light: &'a PatchLight<C>,
}

impl<'a, const C: usize> Sight<'a, C> {
    /// Prepares a scene whose mesh `caster` holds.
    pub fn new(scene: &Scene, caster: &'a RayCaster, caustics: bool) -> Self {
        let of_luminaire = |(luminaire, spread): (&Luminaire, f32)| {
            let corners = |&triangle: &u32| triangle_area(&scene.mesh.corners(triangle as usize));
            let area: f64 = luminaire.body.iter().map(corners).sum();
            let exitance = channels::<C>(luminaire.colour).map(|c| (c * luminaire.flux.0 / area) as f32);
            let near_squared = near_squared(luminaire);
            let body = luminaire.body.clone().into_iter();
            body.map(move |triangle| Glow { triangle, exitance, near_squared, spread })
        };
        let mut glow: Vec<Glow<C>> =
            scene.luminaires.iter().zip(spreads(&scene.luminaires)).flat_map(of_luminaire).collect();
        glow.sort_unstable_by_key(|glow| glow.triangle);
        let surfaces = scene.materials.iter().map(Surface::from).collect();
        Self { caster, surfaces, lamps: Lamps::new(&scene.luminaires, caster), glow, caustics }
    }

    /// π times the radiance (lx) that arrives at `origin` (m) against `direction`, an estimate; the light that comes
    /// straight from a luminaire is left out. Counts its rays in `rays`.
    pub fn incoming(
        &self,
        origin: Vec3,
        direction: Vec3,
        records: Option<Records<'_, C>>,
        stream: &mut Stream,
        rays: &mut u64,
    ) -> [f64; C] {
        let (mut origin, mut direction) = (origin, direction);
        let mut found = [0.0; C];
        let mut weight = Flux([1.0; C]);
        let (mut absorption, mut last) = ([0.0; C], Last::Point);
        // Whether light of luminaires counts where the ray meets it, and is asked for: not once the way from the point
        // is one that photons take as a caustic, until it meets a diffuse surface.
        let (mut bounced, mut caustic) = (false, false);
        let mut add = |weight: Flux<C>, lux: [f32; C]| {
            (0..C).for_each(|c| found[c] += f64::from(weight.0[c]) * f64::from(lux[c]));
        };
        for _ in 0..BOUNCE_CAP {
            *rays += 1;
            let Some(hit) = self.caster.closest_hit(origin, direction, f32::INFINITY) else { break };
            if absorption.iter().any(|&per_metre| per_metre > 0.0) {
                weight = weight.filtered(absorption.map(|per_metre| (-per_metre * hit.distance).exp()));
            }
            let front = direction.dot(hit.normal) < 0.0;
            let facing = if front { hit.normal } else { -hit.normal };
            match self.surfaces[hit.material as usize] {
                Surface::Glass { ior, absorption: inside } => {
                    let ratio = if front { 1.0 / ior } else { ior };
                    direction = match refract(direction, facing, ratio) {
                        Some((onward, reflected)) if stream.uniform() >= reflected => {
                            absorption = if front { inside } else { [0.0; C] };
                            onward
                        }
                        _ => mirror(direction, facing),
                    };
                    (last, caustic) = (Last::Mirror, true);
                }
                surface => {
                    let Layers { diffuse, transmitted, specular, rough, one_sided } = surface.layers();
                    if front
                        && (bounced || !caustic || self.caustics)
                        && let Some(glow) = self.glow(hit.triangle)
                    {
                        add(weight.scaled(glow.left_to(last, direction, &hit)), glow.exitance);
                    }
                    if one_sided && !front {
                        break;
                    }
                    let (diffused, mirrored) = (weight.filtered(diffuse), weight.filtered(specular));
                    let passed = weight.filtered(transmitted);
                    let (to_diffuse, to_mirror, to_other) =
                        (diffused.brightest(), mirrored.brightest(), passed.brightest());
                    let any = to_diffuse + to_mirror + to_other;
                    if any <= 0.0 {
                        break;
                    }
                    if to_mirror > 0.0 && stream.uniform() * any < to_mirror {
                        weight = mirrored.scaled(any / to_mirror);
                        caustic |= rough.is_none_or(|gloss| gloss.sharp);
                        if let Some(Gloss { facets, .. }) = rough {
                            if bounced || !caustic || self.caustics {
                                *rays += 1;
                                add(weight, self.glossed(facets, hit.leave(facing), -direction, facing, stream));
                            }
                            let onward = facets.reflect(direction, facing, stream);
                            last = Last::Gloss(facets.lobe(-direction, onward, facing));
                            direction = onward;
                        } else {
                            direction = mirror(direction, facing);
                            last = Last::Mirror;
                        }
                    } else {
                        let scale = any / (to_diffuse + to_other);
                        let (mut here, there) = (diffused.scaled(scale), passed.scaled(scale));
                        if let Some(Records { grid, light }) = records
                            && let Some(patch) = grid.patch(&hit, direction, self.caster)
                        {
                            if to_other <= 0.0 {
                                add(here, light.illuminance(patch));
                                break;
                            }
                            if let Some(behind) = grid.patch(&hit, -direction, self.caster) {
                                add(here, light.illuminance(patch));
                                add(there, light.illuminance(behind));
                                break;
                            }
                        }
                        if to_diffuse > 0.0 {
                            *rays += 1;
                            add(here, self.lamps.direct(hit.leave(facing), facing, stream));
                        }
                        let mut side = facing;
                        if to_other > 0.0 {
                            *rays += 1;
                            add(there, self.lamps.direct(hit.leave(-facing), -facing, stream));
                            let chance = to_other / (to_diffuse + to_other);
                            if stream.uniform() < chance {
                                (here, side) = (there.scaled(1.0 / chance), -facing);
                            } else {
                                here = here.scaled(1.0 / (1.0 - chance));
                            }
                        }
                        weight = here;
                        direction = stream.cosine_about(side);
                        (last, bounced) = (Last::Diffuse, true);
                    }
                    let chance = (RELUCTANCE * weight.brightest()).min(1.0);
                    if chance < 1.0 {
                        if stream.uniform() >= chance {
                            break;
                        }
                        weight = weight.scaled(1.0 / chance);
                    }
                }
            }
            origin = hit.leave(direction);
        }
        debug_assert!(photometric(found).is_finite());
        found
    }

    /// π times the radiance (lx) that a lossless rough mirror sends to `eye` of what luminaires bring it, an estimate: the
    /// part that [`Glow::left_to`] does not leave to rays (multiple importance sampling, Veach & Guibas 1995).
    fn glossed(&self, facets: Microsurface, at: Vec3, eye: Vec3, facing: Vec3, stream: &mut Stream) -> [f32; C] {
        let worth = |aim: &Aim| {
            let density = facets.lobe(eye, aim.direction, facing);
            PI * density / (1.0 + density * aim.solid_angle)
        };
        let Some((direction, lux)) = self.lamps.aimed(at, worth, stream) else { return [0.0; C] };
        let true_worth = facets.scattered(eye, direction, facing, stream) / facets.lobe(eye, direction, facing);
        lux.map(|channel| channel * true_worth)
    }

    fn glow(&self, triangle: u32) -> Option<&Glow<C>> {
        self.glow.binary_search_by_key(&triangle, |glow| glow.triangle).ok().map(|index| &self.glow[index])
    }
}

impl<const C: usize> Glow<C> {
    /// The part of its light that is left to a ray that meets it along `direction`.
    fn left_to(&self, last: Last, direction: Vec3, hit: &Hit) -> f32 {
        let squared = hit.distance * hit.distance;
        match last {
            Last::Point => 0.0,
            Last::Mirror => 1.0,
            Last::Diffuse => f32::from(u8::from(squared < self.near_squared)),
            Last::Gloss(density) => {
                let expected = density * self.spread * -direction.dot(hit.normal);
                expected / (expected + squared)
            }
        }
    }
}

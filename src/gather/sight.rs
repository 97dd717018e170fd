//! What a point sees: light followed backwards from the measuring points, along rays.
//!
//! A ray in a direction of density cos θ/π brings E = π L, so illuminance is the mean over rays. Two methods ask this
//! way. `path` goes on from surface to surface and asks for direct light at each: unbiased, whatever the photons say.
//! `gather` ends at the first surface whose illuminance the photons know (see `patches.rs`), and goes on as a path where
//! they don't: next to the point, on fine furniture, in contacts. Direct light that reaches the point itself is counted
//! elsewhere (`direct.rs`).

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use super::lamps::{Lamps, near_squared};
use super::patches::{PatchGrid, PatchLight};
use crate::embree::{Hit, RayCaster};
use crate::luminaire::Luminaire;
use crate::luminaire::emit::triangle_area;
use crate::photon::flux::{Flux, channels, photometric};
use crate::photon::random::Stream;
use crate::photon::surface::{Surface, mirror, refract};
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
        let of_luminaire = |luminaire: &Luminaire| {
            let corners = |&triangle: &u32| triangle_area(&scene.mesh.corners(triangle as usize));
            let area: f64 = luminaire.body.iter().map(corners).sum();
            let exitance = channels::<C>(luminaire.colour).map(|c| (c * luminaire.flux.0 / area) as f32);
            let near_squared = near_squared(luminaire);
            let body = luminaire.body.clone().into_iter();
            body.map(move |triangle| Glow { triangle, exitance, near_squared })
        };
        let mut glow: Vec<Glow<C>> = scene.luminaires.iter().flat_map(of_luminaire).collect();
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
        self.follow(origin, direction, records, None, stream, rays)
    }

    /// The same for a surface that asks [`Sight::direct`] for the light straight from luminaires: what that leaves to rays,
    /// luminaires nearer than [`near_squared`], is added to `near`.
    pub fn incoming_beside_direct(
        &self,
        origin: Vec3,
        direction: Vec3,
        records: Option<Records<'_, C>>,
        near: &mut [f64; C],
        stream: &mut Stream,
        rays: &mut u64,
    ) -> [f64; C] {
        self.follow(origin, direction, records, Some(near), stream, rays)
    }

    /// Direct illuminance (lx) at a point `from` (m) just off a surface with unit normal `normal`; see
    /// [`Lamps::direct_from`].
    pub fn direct(&self, offset: f32, from: Vec3, normal: Vec3, stream: &mut Stream) -> [f32; C] {
        self.lamps.direct_from(offset, from, normal, stream)
    }

    /// What a hit surface does with light.
    pub(super) fn surface(&self, hit: &Hit) -> Surface<C> {
        self.surfaces[hit.material as usize]
    }

    /// Luminance (cd/m²) of the luminaire that a ray along `direction` met; 0 for any other surface.
    pub(super) fn emitted(&self, hit: &Hit, direction: Vec3) -> [f32; C] {
        match self.glow(hit.triangle) {
            Some(glow) if direction.dot(hit.normal) < 0.0 => glow.exitance.map(|lux| lux * FRAC_1_PI),
            _ => [0.0; C],
        }
    }

    fn follow(
        &self,
        origin: Vec3,
        direction: Vec3,
        records: Option<Records<'_, C>>,
        mut near: Option<&mut [f64; C]>,
        stream: &mut Stream,
        rays: &mut u64,
    ) -> [f64; C] {
        let (mut origin, mut direction) = (origin, direction);
        let mut found = [0.0; C];
        let mut weight = Flux([1.0; C]);
        let (mut absorption, mut by_mirror) = (0.0, false);
        let (mut bounced, mut glow_counts) = (false, self.caustics);
        let mut add = |weight: Flux<C>, lux: [f32; C]| {
            (0..C).for_each(|c| found[c] += f64::from(weight.0[c]) * f64::from(lux[c]));
        };
        for _ in 0..BOUNCE_CAP {
            *rays += 1;
            let Some(hit) = self.caster.closest_hit(origin, direction, f32::INFINITY) else { break };
            if absorption > 0.0 {
                weight = weight.scaled((-absorption * hit.distance).exp());
            }
            let front = direction.dot(hit.normal) < 0.0;
            let facing = if front { hit.normal } else { -hit.normal };
            match self.surfaces[hit.material as usize] {
                Surface::Glass { ior, absorption: inside } => {
                    let ratio = if front { 1.0 / ior } else { ior };
                    direction = match refract(direction, facing, ratio) {
                        Some((onward, reflected)) if stream.uniform() >= reflected => {
                            absorption = if front { inside } else { 0.0 };
                            onward
                        }
                        _ => mirror(direction, facing),
                    };
                    by_mirror = true;
                }
                Surface::Opaque { diffuse, specular } => {
                    if front
                        && (glow_counts || near.is_some())
                        && let Some(glow) = self.glow(hit.triangle)
                    {
                        // By way of mirrors and glass all of it; straight from a surface, what was not drawn there.
                        let is_near = hit.distance * hit.distance < glow.near_squared;
                        if if by_mirror { glow_counts } else { bounced && is_near } {
                            add(weight, glow.exitance);
                        } else if let (false, false, true, Some(near)) = (by_mirror, bounced, is_near, near.as_mut()) {
                            (0..C).for_each(|c| near[c] += f64::from(weight.0[c]) * f64::from(glow.exitance[c]));
                        }
                    }
                    let (diffused, mirrored) = (weight.filtered(diffuse), weight.filtered(specular));
                    let (to_diffuse, to_mirror) = (diffused.brightest(), mirrored.brightest());
                    let either = to_diffuse + to_mirror;
                    if either <= 0.0 {
                        break;
                    }
                    if to_mirror > 0.0 && stream.uniform() * either < to_mirror {
                        weight = mirrored.scaled(either / to_mirror);
                        direction = mirror(direction, facing);
                        by_mirror = true;
                    } else {
                        weight = diffused.scaled(either / to_diffuse);
                        if let Some(records) = records
                            && let Some(patch) = records.grid.patch(&hit, direction, self.caster)
                        {
                            add(weight, records.light.illuminance(patch));
                            break;
                        }
                        *rays += 1;
                        add(weight, self.lamps.direct(hit.leave(facing), facing, stream));
                        direction = stream.cosine_about(facing);
                        (by_mirror, bounced, glow_counts) = (false, true, true);
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

    fn glow(&self, triangle: u32) -> Option<&Glow<C>> {
        self.glow.binary_search_by_key(&triangle, |glow| glow.triangle).ok().map(|index| &self.glow[index])
    }
}

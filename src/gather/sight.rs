//! What a point sees: light followed backwards from the measuring points, along rays.
//!
//! A ray in a direction of density cos θ/π brings E = π L, so illuminance is the mean over rays. Two methods ask this
//! way. `path` goes on from surface to surface and asks for direct light at each: unbiased, whatever the photons say.
//! `gather` ends at the first surface whose illuminance the photons know (see `patches.rs`), and goes on as a path where
//! they don't: next to the point, on fine furniture, in contacts. Direct light that reaches the point itself is counted
//! elsewhere (`direct.rs`).

use glam::{DVec3, Vec3};

use super::lamps::{Lamps, near_squared};
use super::patches::{PatchGrid, PatchLight};
use crate::embree::RayCaster;
use crate::luminaire::body::Body;
use crate::luminaire::emit::triangle_area;
use crate::luminaire::web::Measured;
use crate::luminaire::{Luminaire, Opening};
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
    webs: Vec<GlowWeb>,
    /// Whether light of luminaires by way of mirrors and glass is counted where it reaches the point itself.
    caustics: bool,
}

/// A triangle that shines.
struct Glow<const C: usize> {
    triangle: u32,
    /// Exitance of its front, lx; of a measured luminaire its flux, lm.
    exitance: [f32; C],
    /// The measured luminaire it belongs to.
    web: Option<u32>,
    /// Squared distance within which a ray from a surface counts it, m²; beyond, [`Lamps`] do.
    near_squared: f32,
}

/// A measured luminaire as rays meet it.
struct GlowWeb {
    measured: Measured,
    seen: SeenArea,
}

enum SeenArea {
    /// Area and normal.
    Flat(f64, DVec3),
    Body(Body),
}

/// A flat opening that is seen under a smaller cosine than this counts as seen under it: intensity measured there is of
/// something that is not flat, and flat it would be infinitely bright.
const FLATTEST: f64 = 1e-3;

impl GlowWeb {
    fn of(luminaire: &Luminaire) -> Option<Self> {
        let measured = luminaire.measured()?.clone();
        let seen = match (&luminaire.opening, luminaire.opening.flat()) {
            (_, Some((area, normal))) => SeenArea::Flat(area, normal),
            (Opening::Body(body), _) => SeenArea::Body(*body),
            _ => return None,
        };
        Some(Self { measured, seen })
    }

    /// π times the luminance towards the unit vector `direction`, lx/lm.
    fn per_lumen(&self, direction: DVec3, front: bool) -> Option<f32> {
        let area = match &self.seen {
            SeenArea::Flat(area, normal) => area * normal.dot(direction).abs().max(FLATTEST),
            SeenArea::Body(_) if !front => return None,
            SeenArea::Body(body) => body.projected_area(direction),
        };
        Some((std::f64::consts::PI * self.measured.at(direction) / area) as f32)
    }
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
        let mut webs = Vec::new();
        let of_luminaire = |luminaire: &Luminaire| {
            let corners = |&triangle: &u32| triangle_area(&scene.mesh.corners(triangle as usize));
            let web = GlowWeb::of(luminaire).map(|web| {
                webs.push(web);
                webs.len() as u32 - 1
            });
            // What a measured luminaire sends out is multiplied by its intensity over area, per lumen.
            let area: f64 = if web.is_some() { 1.0 } else { luminaire.body.iter().map(corners).sum() };
            let exitance = channels::<C>(luminaire.colour).map(|c| (c * luminaire.flux.0 / area) as f32);
            let near_squared = near_squared(luminaire);
            let body = luminaire.body.clone().into_iter();
            body.map(move |triangle| Glow { triangle, exitance, web, near_squared })
        };
        let mut glow: Vec<Glow<C>> = scene.luminaires.iter().flat_map(of_luminaire).collect();
        glow.sort_unstable_by_key(|glow| glow.triangle);
        let surfaces = scene.materials.iter().map(Surface::from).collect();
        Self { caster, surfaces, lamps: Lamps::new(&scene.luminaires, caster), glow, webs, caustics }
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
                    if glow_counts
                        && let Some(glow) = self.glow(hit.triangle)
                        && let Some(times) = self.brightness(glow, direction, front)
                    {
                        // By way of mirrors and glass all of it; straight from a surface, what was not drawn there.
                        if by_mirror || (bounced && hit.distance * hit.distance < glow.near_squared) {
                            add(weight, glow.exitance.map(|channel| channel * times));
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

    /// What a triangle's exitance is to be multiplied by for a ray along `direction` that meets its front or back; nothing
    /// where that doesn't shine.
    fn brightness(&self, glow: &Glow<C>, direction: Vec3, front: bool) -> Option<f32> {
        match glow.web {
            None => front.then_some(1.0),
            Some(web) => self.webs[web as usize].per_lumen(-direction.as_dvec3(), front),
        }
    }

    fn glow(&self, triangle: u32) -> Option<&Glow<C>> {
        self.glow.binary_search_by_key(&triangle, |glow| glow.triangle).ok().map(|index| &self.glow[index])
    }
}

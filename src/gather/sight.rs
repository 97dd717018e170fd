//! What a point sees: light followed backwards from the measuring points, along rays.
//!
//! A ray in a direction of density cos θ/π brings E = π L, so illuminance is the mean over rays. Two methods work this
//! way. `path` goes on from surface to surface and adds direct light at each: unbiased, without photons. `gather` ends
//! at the first surface whose illuminance photons recorded (see `patches.rs`), and goes on as a path elsewhere:
//! next to the point, on fine furniture, in contacts. Direct light that reaches the point itself is counted elsewhere
//! (`direct/`).

mod path;

use std::f32::consts::PI;
use std::f64::consts::FRAC_1_PI;

use glam::{DVec3, Vec3};

use self::path::Path;
pub(super) use self::path::SURVIVAL;
use super::caustics::CausticMap;
use super::direct::FLATTEST;
use super::lamps::{Aim, Aimed, LampSampler, near_squared, spreads};
use super::patches::{PatchGrid, PatchGroups, PatchLight};
use crate::embree::{Hit, RayCaster};
use crate::flux::{Flux, channels};
use crate::geometry::body::Body;
use crate::luminaire::web::Measured;
use crate::luminaire::{LightGroups, Luminaire, Opening};
use crate::photon::emit::triangle_area;
use crate::photon::media::Media;
use crate::photon::optics::{mirror, refract};
use crate::photon::rough::Microsurface;
use crate::photon::surface::{SurfaceOptics, pane_shares};
use crate::random::Stream;
use crate::scene::Scene;
use crate::scene::glazing::Curves;

/// Ready to follow light backwards through a scene.
pub struct Sight<'a, const C: usize> {
    caster: &'a RayCaster,
    surfaces: Vec<SurfaceOptics<C>>,
    lamps: LampSampler<'a, C>,
    /// The triangles that shine, in order.
    glow: Vec<Glow<C>>,
    webs: Vec<GlowWeb>,
    /// Whether light of luminaires by way of mirrors and glass is counted where it reaches the point itself.
    caustics: bool,
}

/// A triangle that shines.
struct Glow<const C: usize> {
    triangle: u32,
    luminaire: u32,
    /// Exitance of its front, lx; of a measured luminaire its flux, lm.
    exitance: [f32; C],
    /// The measured luminaire it belongs to.
    web: Option<u32>,
    /// Squared distance within which a ray from a surface counts it, m²; beyond, [`LampSampler`] do.
    near_squared: f32,
    /// See [`spreads`].
    spread: f32,
}

/// What a ray left last: decides which part of the light of a luminaire that it meets was not drawn there.
#[derive(Clone, Copy)]
pub(super) enum Last {
    /// The measuring point: luminaires it sees are counted elsewhere.
    Point,
    /// A mirror or glass: nothing was drawn.
    Mirror,
    /// A diffuse surface: all but what is near.
    Diffuse,
    /// A rough mirror, with this density (1/sr): the part that drawing would miss is left to the ray.
    Gloss(f32),
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

/// Illuminance that photons recorded, where rays end.
#[derive(Clone, Copy)]
pub struct Records<'a, const C: usize> {
    /// The patches.
    pub grid: &'a PatchGrid,
    /// Their illuminance.
    pub light: &'a PatchLight<C>,
    /// Light that came by mirrors and glass, where there may be some: rays that go on from a surface would meet its
    /// luminaire rarely, and find it bright: that is noise.
    pub caustics: Option<&'a CausticMap<C>>,
}

/// Receives where the light of rays comes from.
pub trait Origins<const C: usize> {
    /// Adds `lux` (lx) from a luminaire.
    fn luminaire(&mut self, luminaire: u32, lux: [f64; C]);
    /// Adds `weight` times the illuminance of a patch.
    fn patch(&mut self, patch: usize, weight: Flux<C>);
}

/// Origins are not wanted.
impl<const C: usize> Origins<C> for () {
    #[inline(always)]
    fn luminaire(&mut self, _: u32, _: [f64; C]) {}
    #[inline(always)]
    fn patch(&mut self, _: usize, _: Flux<C>) {}
}

/// Adds up the light of each group.
pub struct ToGroups<'a, const C: usize> {
    /// The groups.
    pub groups: &'a LightGroups,
    /// Their light on the patches where rays end.
    pub patches: Option<&'a PatchGroups<C>>,
    /// A row of sums, lx.
    pub row: &'a mut [f64],
}

impl<const C: usize> Origins<C> for ToGroups<'_, C> {
    #[inline]
    fn luminaire(&mut self, luminaire: u32, lux: [f64; C]) {
        let sums = &mut self.row[self.groups.group(luminaire) as usize * C..][..C];
        sums.iter_mut().zip(lux).for_each(|(sum, lux)| *sum += lux);
    }

    #[inline]
    fn patch(&mut self, patch: usize, weight: Flux<C>) {
        let Some(patches) = self.patches else { return };
        for (group, lux) in patches.parts(patch) {
            let sums = &mut self.row[*group as usize * C..][..C];
            (0..C).for_each(|c| sums[c] += f64::from(weight.0[c]) * f64::from(lux[c]));
        }
    }
}

impl<'a, const C: usize> Sight<'a, C> {
    /// What holds the scene's mesh.
    pub fn caster(&self) -> &'a RayCaster {
        self.caster
    }

    /// Prepares a scene whose mesh `caster` holds.
    pub fn new(scene: &Scene, caster: &'a RayCaster, caustics: bool) -> Self {
        let mut webs = Vec::new();
        let of_luminaire = |(number, (luminaire, spread)): (usize, (&Luminaire, f32))| {
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
            let number = number as u32;
            body.map(move |triangle| Glow { triangle, luminaire: number, exitance, web, near_squared, spread })
        };
        let spread = scene.luminaires.iter().zip(spreads(&scene.luminaires));
        let mut glow: Vec<Glow<C>> = spread.enumerate().flat_map(of_luminaire).collect();
        glow.sort_unstable_by_key(|glow| glow.triangle);
        let surfaces = scene.materials.iter().map(SurfaceOptics::from).collect();
        Self { caster, surfaces, lamps: LampSampler::new(&scene.luminaires, caster), glow, webs, caustics }
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
        Path::new(self, (origin, direction), records, stream, rays).follow(None, &mut ())
    }

    /// The same; `origins` receives where it comes from.
    pub fn incoming_from(
        &self,
        origin: Vec3,
        direction: Vec3,
        records: Option<Records<'_, C>>,
        stream: &mut Stream,
        rays: &mut u64,
        origins: &mut impl Origins<C>,
    ) -> [f64; C] {
        Path::new(self, (origin, direction), records, stream, rays).follow(None, origins)
    }

    /// The same for a surface whose light straight from luminaires [`Sight::direct`] gives: what that leaves to rays,
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
        Path::new(self, (origin, direction), records, stream, rays).follow(Some(near), &mut ())
    }

    /// Direct illuminance (lx) at a point `from` (m) just off a surface with unit normal `normal`; see
    /// [`LampSampler::direct_from`].
    pub fn direct(&self, offset: f32, from: Vec3, normal: Vec3, stream: &mut Stream) -> [f32; C] {
        self.lamps.direct_from(offset, from, normal, stream).0
    }

    /// All surfaces, by material.
    pub(super) fn surfaces(&self) -> &[SurfaceOptics<C>] {
        &self.surfaces
    }

    /// What a hit surface does with light.
    pub(super) fn surface(&self, hit: &Hit) -> &SurfaceOptics<C> {
        &self.surfaces[hit.material as usize]
    }

    /// Luminance (cd/m²) of the luminaire that a ray along `direction` met, as far as it is left to rays; 0 for any
    /// other surface.
    pub(super) fn emitted(&self, hit: &Hit, direction: Vec3, last: Last) -> [f64; C] {
        let front = direction.dot(hit.normal) < 0.0;
        let shining = self.glow(hit.triangle).and_then(|glow| Some((glow, self.brightness(glow, direction, front)?)));
        match shining {
            Some((glow, times)) => {
                let share = f64::from(times * self.left_to(glow, last, direction, hit)) * FRAC_1_PI;
                glow.exitance.map(|lux| f64::from(lux) * share)
            }
            None => [0.0; C],
        }
    }

    /// π times the radiance (lx) that a lossless rough mirror sends to `eye` of what luminaires bring it, an estimate:
    /// the part that [`Sight::left_to`] does not leave to rays (multiple importance sampling, Veach & Guibas 1995).
    pub(super) fn glossed(
        &self,
        facets: Microsurface,
        at: Vec3,
        eye: Vec3,
        facing: Vec3,
        stream: &mut Stream,
    ) -> ([f32; C], u32) {
        let worth = |aim: &Aim| {
            let density = facets.lobe(eye, aim.direction, facing);
            PI * density / (1.0 + density * aim.solid_angle)
        };
        let Some(Aimed { direction, lux, luminaire }) = self.lamps.aimed(at, worth, stream) else {
            return ([0.0; C], 0);
        };
        let true_worth = facets.scattered(eye, direction, facing, stream) / facets.lobe(eye, direction, facing);
        (lux.map(|channel| channel * true_worth), luminaire)
    }

    /// What a triangle's exitance is to be multiplied by for a ray along `direction` that meets its front or back;
    /// nothing where that doesn't shine.
    fn brightness(&self, glow: &Glow<C>, direction: Vec3, front: bool) -> Option<f32> {
        match glow.web {
            None => front.then_some(1.0),
            Some(web) => self.webs[web as usize].per_lumen(-direction.as_dvec3(), front),
        }
    }

    /// The part of a luminaire's light that is left to a ray that meets it along `direction`.
    fn left_to(&self, glow: &Glow<C>, last: Last, direction: Vec3, hit: &Hit) -> f32 {
        let squared = hit.distance * hit.distance;
        match last {
            Last::Point => 0.0,
            Last::Mirror => 1.0,
            Last::Diffuse => f32::from(u8::from(squared < glow.near_squared)),
            Last::Gloss(density) => {
                // As in `LampSampler::aimed`: of a measured body points are drawn by the area seen.
                let drawn_as_seen =
                    glow.web.is_some_and(|web| matches!(self.webs[web as usize].seen, SeenArea::Body(_)));
                let cosine = if drawn_as_seen { 1.0 } else { direction.dot(hit.normal).abs() };
                let expected = density * glow.spread * cosine;
                expected / (expected + squared)
            }
        }
    }

    fn glow(&self, triangle: u32) -> Option<&Glow<C>> {
        self.glow.binary_search_by_key(&triangle, |glow| glow.triangle).ok().map(|index| &self.glow[index])
    }
}

/// Whether a ray that meets a pane passes it or is mirrored, by what either way still brings, and its weight from there
/// on; nothing where neither brings anything.
#[inline]
pub(super) fn cross_pane<const C: usize>(
    curves: &Curves,
    direction: Vec3,
    normal: Vec3,
    weight: Flux<C>,
    stream: &mut Stream,
) -> Option<(bool, Flux<C>)> {
    let [passed, mirrored] = pane_shares::<C>(curves, direction, normal).map(|shares| weight.filtered(shares));
    let (to_pass, to_mirror) = (passed.brightest(), mirrored.brightest());
    let any = to_pass + to_mirror;
    if any <= 0.0 {
        return None;
    }
    let passes = stream.uniform() * any < to_pass;
    let (left, share) = if passes { (passed, to_pass) } else { (mirrored, to_mirror) };
    Some((passes, left.scaled(any / share)))
}

/// Where a ray goes on that meets glass, refracted or mirrored by Fresnel's shares, and the glass that it is in from
/// there on; `facing` is the unit normal against `direction`.
#[inline]
pub(super) fn cross_glass<const C: usize>(
    surfaces: &[SurfaceOptics<C>],
    hit: &Hit,
    direction: Vec3,
    facing: Vec3,
    media: &mut Media,
    stream: &mut Stream,
) -> Vec3 {
    let front = direction.dot(hit.normal) < 0.0;
    match refract(direction, facing, media.ratio(surfaces, hit.material, front)) {
        Some((onward, reflected)) if stream.uniform() >= reflected => {
            *media = media.beyond(hit.material, front);
            onward
        }
        _ => mirror(direction, facing),
    }
}

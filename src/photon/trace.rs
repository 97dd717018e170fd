//! A photon's life: emit, fly, land, then survive or end.
//!
//! Photons carry equal luminous flux and die by Russian roulette only, so a room of ρ = 0.999 is as right as one of
//! ρ = 0.2; a safety cap on bounces ends what a loss-free room would trap for ever, and reports the flux it cut off.

use glam::Vec3;
use rayon::prelude::*;

use super::flux::{Flux, accumulate, channels};
use super::random::{Seed, Stream};
use crate::embree::{Hit, RayCaster};
use crate::luminaire::emit::Emission;
use crate::scene::{Material, Scene};

/// Photons traced as one piece of work; small enough to balance threads, large enough to hide the hand-over.
const CHUNK: u64 = 8192;

/// Bounces after which a photon is cut off, and its flux reported. A closed room of ρ = 0.999 cuts off 4·10⁻⁴⁴ of the
/// flux, one of ρ = 0.9999 5·10⁻⁵.
pub const BOUNCE_CAP: u32 = 100_000;

/// What a photon has met since it left its luminaire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum History {
    /// Nothing: direct light.
    Direct,
    /// Mirrors and glass only: a caustic where it lands.
    Specular,
    /// At least one diffuse surface.
    Diffused,
}

/// One straight flight of a photon.
pub struct Flight<'a> {
    /// Where it starts, m.
    pub origin: Vec3,
    /// Unit vector.
    pub direction: Vec3,
    /// Where it ends; `None` if it leaves the scene.
    pub hit: Option<&'a Hit>,
    /// Whether what it meets is opaque, a surface where light lands.
    pub lands: bool,
    /// What it has met before.
    pub history: History,
}

/// Keeps what some query can reach of the photons' flights.
pub trait Recorder<const C: usize>: Send {
    /// Called for every flight of every photon, in the photons' order.
    fn record(&mut self, flight: &Flight<'_>, flux: Flux<C>);
}

/// Where the flux went, and how many rays that took. Sums in double precision: 10⁸ photons of 10⁻⁵ lm add up to 256 lm
/// instead of 1000 in single.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tally<const C: usize> {
    /// Flux emitted, lm.
    pub emitted: [f64; C],
    /// Flux absorbed by surfaces and in glass, lm.
    pub absorbed: [f64; C],
    /// Flux that left the scene, lm.
    pub escaped: [f64; C],
    /// Flux under way at the bounce cap, lm.
    pub cut_off: [f64; C],
    /// Rays cast.
    pub rays: u64,
}

impl<const C: usize> Default for Tally<C> {
    fn default() -> Self {
        Self { emitted: [0.0; C], absorbed: [0.0; C], escaped: [0.0; C], cut_off: [0.0; C], rays: 0 }
    }
}

impl<const C: usize> Tally<C> {
    /// Adds what another piece of work found.
    pub fn add(&mut self, other: &Self) {
        for c in 0..C {
            self.emitted[c] += other.emitted[c];
            self.absorbed[c] += other.absorbed[c];
            self.escaped[c] += other.escaped[c];
            self.cut_off[c] += other.cut_off[c];
        }
        self.rays += other.rays;
    }

    /// Books what a photon that lives on left behind; in one channel it leaves nothing, the roulette's losers do.
    #[inline]
    fn lose(&mut self, before: Flux<C>, left: Flux<C>) {
        if C > 1 {
            accumulate(&mut self.absorbed, before, 1.0);
            accumulate(&mut self.absorbed, left, -1.0);
        }
    }
}

/// What a surface does with a photon, in the channels of this run.
#[derive(Clone, Copy, Debug)]
enum Surface<const C: usize> {
    Opaque { diffuse: [f32; C], specular: [f32; C] },
    Glass { ior: f32, absorption: f32 },
}

impl<const C: usize> From<&Material> for Surface<C> {
    fn from(material: &Material) -> Self {
        let shares = |rgb| channels::<C>(rgb).map(|share| share as f32);
        match material.dielectric {
            Some(glass) => Self::Glass { ior: glass.ior as f32, absorption: glass.absorption as f32 },
            None => Self::Opaque { diffuse: shares(material.reflectance), specular: shares(material.specular) },
        }
    }
}

/// How a photon goes on after a hit.
enum Fate<const C: usize> {
    Absorbed,
    Diffused(Vec3, Flux<C>),
    Mirrored(Vec3, Flux<C>),
    Refracted(Vec3, f32),
}

/// Traces photons through a scene.
pub struct Tracer<'a, const C: usize> {
    caster: &'a RayCaster,
    surfaces: Vec<Surface<C>>,
    emission: Emission<'a, C>,
    photons: u64,
}

impl<'a, const C: usize> Tracer<'a, C> {
    /// Prepares passes of `photons` photons each through `scene`, whose mesh `caster` holds.
    pub fn new(scene: &'a Scene, caster: &'a RayCaster, photons: u64) -> Self {
        Self {
            caster,
            surfaces: scene.materials.iter().map(Surface::from).collect(),
            emission: Emission::new(&scene.luminaires, photons, caster),
            photons,
        }
    }

    /// Traces one pass. Returns the recorders of consecutive photons, in order, and the flux balance: the same bits
    /// for any number of threads. `progress` hears how many photons have ended since its last call.
    pub fn trace<R: Recorder<C>>(
        &self,
        seed: Seed,
        pass: u64,
        recorder: impl Fn() -> R + Sync,
        progress: impl Fn(u64) + Sync,
    ) -> (Vec<R>, Tally<C>) {
        let offset = f64::from(seed.branch(pass).stream(u64::MAX).uniform());
        let chunks: Vec<(R, Tally<C>)> = (0..self.photons.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let (mut recorder, mut tally) = (recorder(), Tally::default());
                let photons = chunk * CHUNK..((chunk + 1) * CHUNK).min(self.photons);
                let count = photons.end - photons.start;
                for photon in photons {
                    let mut stream = seed.stream(pass.wrapping_mul(self.photons).wrapping_add(photon));
                    self.follow((photon as f64 + offset) / self.photons as f64, &mut stream, &mut recorder, &mut tally);
                }
                progress(count);
                (recorder, tally)
            })
            .collect();
        let mut total = Tally::default();
        let recorders = chunks
            .into_iter()
            .map(|(recorder, tally)| {
                total.add(&tally);
                recorder
            })
            .collect();
        (recorders, total)
    }

    /// Follows one photon from its luminaire to its end.
    #[inline]
    fn follow(&self, place: f64, stream: &mut Stream, recorder: &mut impl Recorder<C>, tally: &mut Tally<C>) {
        // Emit.
        let photon = self.emission.photon(place, stream);
        let (mut origin, mut direction, mut flux) = (photon.origin, photon.direction, photon.flux);
        let (mut history, mut glass) = (History::Direct, 0.0_f32);
        accumulate(&mut tally.emitted, flux, 1.0);
        for _ in 0..BOUNCE_CAP {
            // Fly.
            tally.rays += 1;
            let hit = self.caster.closest_hit(origin, direction, f32::INFINITY);
            let surface = hit.as_ref().map(|hit| &self.surfaces[hit.material as usize]);
            let lands = matches!(surface, Some(Surface::Opaque { .. }));
            let survives_glass = match &hit {
                Some(hit) if glass > 0.0 => stream.uniform() < (-glass * hit.distance).exp(),
                _ => true,
            };
            if !survives_glass {
                accumulate(&mut tally.absorbed, flux, 1.0);
                return;
            }
            // Land, and leave a record.
            recorder.record(&Flight { origin, direction, hit: hit.as_ref(), lands, history }, flux);
            let (Some(hit), Some(surface)) = (&hit, surface) else {
                accumulate(&mut tally.escaped, flux, 1.0);
                return;
            };
            // Survive or end.
            match surface.meet(direction, hit.normal, flux, stream) {
                Fate::Absorbed => {
                    accumulate(&mut tally.absorbed, flux, 1.0);
                    return;
                }
                Fate::Diffused(onward, left) => {
                    tally.lose(flux, left);
                    (direction, flux, history) = (onward, left, History::Diffused);
                }
                Fate::Mirrored(onward, left) => {
                    tally.lose(flux, left);
                    (direction, flux, history) = (onward, left, history.after_specular());
                }
                Fate::Refracted(onward, absorption) => {
                    (direction, glass, history) = (onward, absorption, history.after_specular());
                }
            }
            origin = hit.leave(direction);
        }
        accumulate(&mut tally.cut_off, flux, 1.0);
    }
}

impl History {
    fn after_specular(self) -> Self {
        if self == Self::Diffused { self } else { Self::Specular }
    }
}

impl<const C: usize> Surface<C> {
    /// Decides by roulette what becomes of a photon; `normal` is the geometric one.
    #[inline]
    fn meet(&self, direction: Vec3, normal: Vec3, flux: Flux<C>, stream: &mut Stream) -> Fate<C> {
        match *self {
            Self::Opaque { diffuse, specular } => {
                let (diffused, mirrored) = (flux.filtered(diffuse), flux.filtered(specular));
                let chance = |part: Flux<C>, shares: [f32; C]| {
                    if C == 1 { shares[0] } else { part.brightest() / flux.brightest() }
                };
                let (mut to_diffuse, mut to_mirror) = (chance(diffused, diffuse), chance(mirrored, specular));
                let both = to_diffuse + to_mirror;
                if both > 1.0 {
                    (to_diffuse, to_mirror) = (to_diffuse / both, to_mirror / both);
                }
                let choice = stream.uniform();
                let facing = if direction.dot(normal) < 0.0 { normal } else { -normal };
                if choice < to_diffuse {
                    Fate::Diffused(stream.cosine_about(facing), survivor(flux, diffused, to_diffuse))
                } else if choice < to_diffuse + to_mirror {
                    Fate::Mirrored(mirror(direction, facing), survivor(flux, mirrored, to_mirror))
                } else {
                    Fate::Absorbed
                }
            }
            Self::Glass { ior, absorption } => {
                let entering = direction.dot(normal) < 0.0;
                let (facing, ratio) = if entering { (normal, 1.0 / ior) } else { (-normal, ior) };
                match refract(direction, facing, ratio) {
                    Some((onward, reflected)) if stream.uniform() >= reflected => {
                        Fate::Refracted(onward, if entering { absorption } else { 0.0 })
                    }
                    _ => Fate::Mirrored(mirror(direction, facing), flux),
                }
            }
        }
    }
}

/// Flux after winning a roulette of probability `chance`; in one channel that is the flux before, to the bit.
#[inline]
fn survivor<const C: usize>(before: Flux<C>, reflected: Flux<C>, chance: f32) -> Flux<C> {
    if C == 1 { before } else { reflected.scaled(1.0 / chance) }
}

/// Mirror direction about the unit normal.
#[inline]
fn mirror(direction: Vec3, normal: Vec3) -> Vec3 {
    (direction - normal * (2.0 * direction.dot(normal))).normalize()
}

/// Direction of the refracted ray by Snell's law and the unpolarised Fresnel reflectance; `None` at total reflection.
///
/// `facing` is the unit normal against `direction`, `ratio` = n₁/n₂.
#[inline]
fn refract(direction: Vec3, facing: Vec3, ratio: f32) -> Option<(Vec3, f32)> {
    let cos_in = (-direction.dot(facing)).clamp(0.0, 1.0);
    let sin2_out = ratio * ratio * (1.0 - cos_in * cos_in);
    if sin2_out >= 1.0 {
        return None;
    }
    let cos_out = (1.0 - sin2_out).sqrt();
    let onward = (direction * ratio + facing * (ratio * cos_in - cos_out)).normalize();
    let across = (ratio * cos_in - cos_out) / (ratio * cos_in + cos_out);
    let along = (cos_in - ratio * cos_out) / (cos_in + ratio * cos_out);
    Some((onward, 0.5 * (across * across + along * along)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Snell: n₁ sin θ₁ = n₂ sin θ₂; Fresnel at normal incidence: ((n − 1)/(n + 1))²; no p-reflection at Brewster's
    /// angle, where the unpolarised reflectance is half of ((n² − 1)/(n² + 1))².
    #[test]
    fn glass_follows_snell_and_fresnel() {
        let (n, up) = (1.5_f32, Vec3::Z);
        let at = |angle: f32| refract(Vec3::new(angle.sin(), 0.0, -angle.cos()), up, 1.0 / n).expect("enters");
        for degrees in [0.0_f32, 10.0, 45.0, 80.0, 89.0] {
            let angle = degrees.to_radians();
            let (onward, _) = at(angle);
            assert!((onward.x * n - angle.sin()).abs() < 1e-6, "Snell at {degrees}°: {onward}");
        }
        assert!((at(0.0).1 - 0.04).abs() < 1e-6);
        let expected = 0.5 * ((n * n - 1.0) / (n * n + 1.0)).powi(2);
        assert!((at(n.atan()).1 - expected).abs() < 1e-6);
        // From inside, total reflection begins at sin θ = 1/n.
        let inside = |sin: f32| refract(Vec3::new(sin, 0.0, -(1.0 - sin * sin).sqrt()), up, n);
        assert!(inside(0.99 / n).is_some() && inside(1.01 / n).is_none());
    }

    /// Reciprocity of Fresnel: the same share is reflected from either side of the surface along the same path.
    #[test]
    fn fresnel_reflectance_is_the_same_from_both_sides() {
        for degrees in [0.0_f32, 20.0, 50.0, 75.0, 88.0] {
            let angle = degrees.to_radians();
            let (onward, outside) =
                refract(Vec3::new(angle.sin(), 0.0, -angle.cos()), Vec3::Z, 1.0 / 1.5).expect("enters");
            let (_, inside) = refract(-onward, -Vec3::Z, 1.5).expect("leaves");
            assert!((outside - inside).abs() < 1e-5, "{degrees}°: {outside} against {inside}");
        }
    }
}

//! Whether light can arrive at a point at all.
//!
//! A grid point inside a table leg has no illuminance: it is no place. Which points are such is asked of light itself,
//! not of normals that meshes rarely keep in order: a point counts as a place if light could travel from some luminaire
//! to it by any number of bounces, whatever the surfaces reflect.

use glam::Vec3;

use super::receiver::Receiver;
use crate::embree::RayCaster;
use crate::luminaire::{Luminaire, Opening};
use crate::photon::random::{Seed, Stream};
use crate::scene::{Material, Scene};

/// Random walks from a point before it is given up, and the most bounces of each.
const WALKS: u32 = 24;
const BOUNCES: u32 = 24;
/// Walks from the luminaires that decide whether the scene is open, and how many of them must get out: more than can
/// slip through cracks.
const OUTWARD_WALKS: u64 = 2048;
const OPEN_WALKS: u64 = 8;

/// Tells places from the insides of things.
pub struct Reach<'a> {
    caster: &'a RayCaster,
    luminaires: &'a [Luminaire],
    /// Light passes.
    clear: Vec<bool>,
    material_of: &'a [u32],
    seed: Seed,
    /// Whether light gets out of the scene, so that what else is outside may meet it.
    open: bool,
}

impl<'a> Reach<'a> {
    /// Prepares the question for a scene; casts about 10⁵ rays.
    pub fn new(scene: &'a Scene, caster: &'a RayCaster, seed: Seed) -> Self {
        let clear = scene.materials.iter().map(|material: &Material| material.dielectric.is_some()).collect();
        let mut reach = Self {
            caster,
            luminaires: &scene.luminaires,
            clear,
            material_of: &scene.mesh.material_of,
            seed,
            open: false,
        };
        reach.open = reach.light_gets_out();
        reach
    }

    /// Whether light can arrive at a point of a receiver, on its measured side.
    pub fn light_can_arrive(&self, receiver: &Receiver, point: usize) -> bool {
        let mut stream = self.seed.stream(point as u64);
        let start = receiver.start(point);
        let sees_one = |luminaire: &Luminaire| self.sees(start, luminaire, [0.5; 2]);
        self.luminaires.iter().any(sees_one)
            || (0..WALKS).any(|_| self.walk_arrives(start, receiver.normal, &mut stream))
    }

    /// One walk from a point: it arrives if it comes to see a luminaire, or gets out where light gets out.
    fn walk_arrives(&self, start: Vec3, normal: Vec3, stream: &mut Stream) -> bool {
        let (mut origin, mut direction) = (start, stream.cosine_about(normal));
        for _ in 0..BOUNCES {
            let choice = (stream.uniform() * self.luminaires.len() as f32) as usize;
            let luminaire = &self.luminaires[choice.min(self.luminaires.len() - 1)];
            if self.sees(origin, luminaire, stream.uniform_pair()) {
                return true;
            }
            match self.bounce(origin, direction, stream) {
                Some(next) => (origin, direction) = next,
                None => return self.open,
            }
        }
        false
    }

    fn light_gets_out(&self) -> bool {
        let out = |walk: &u64| {
            let mut stream = self.seed.branch(1).stream(*walk);
            let luminaire = &self.luminaires[(*walk % self.luminaires.len() as u64) as usize];
            let (point, normal) = front(luminaire, stream.uniform_pair());
            let (mut origin, mut direction) = match luminaire.opening {
                Opening::Point { .. } => (point, stream.on_sphere()),
                _ => (self.caster.step_off(point, normal), stream.cosine_about(normal)),
            };
            for _ in 0..BOUNCES {
                match self.bounce(origin, direction, &mut stream) {
                    Some(next) => (origin, direction) = next,
                    None => return true,
                }
            }
            false
        };
        (0..OUTWARD_WALKS).filter(out).count() as u64 >= OPEN_WALKS
    }

    /// The next leg of a walk that no surface absorbs; `None` if it leaves the scene.
    fn bounce(&self, origin: Vec3, direction: Vec3, stream: &mut Stream) -> Option<(Vec3, Vec3)> {
        let hit = self.caster.closest_hit(origin, direction, f32::INFINITY)?;
        let onward = if self.clear[self.material_of[hit.triangle as usize] as usize] {
            direction
        } else {
            stream.cosine_about(if direction.dot(hit.normal) < 0.0 { hit.normal } else { -hit.normal })
        };
        Some((hit.leave(onward), onward))
    }

    /// Whether the straight way to a point of a luminaire's front is free.
    fn sees(&self, from: Vec3, luminaire: &Luminaire, at: [f32; 2]) -> bool {
        let (point, normal) = front(luminaire, at);
        let is_point = matches!(luminaire.opening, Opening::Point { .. });
        let target = if is_point { point } else { self.caster.step_off(point, normal) };
        let to = target - from;
        let distance = to.length();
        let from_front = is_point || to.dot(normal) < 0.0;
        let reach = if is_point { distance * (1.0 - 1e-5) } else { distance };
        distance > 0.0 && from_front && !self.caster.is_occluded(from, to / distance, reach)
    }
}

/// A point of a luminaire's opening and its normal; of a mesh, its first triangle stands for all.
fn front(luminaire: &Luminaire, at: [f32; 2]) -> (Vec3, Vec3) {
    let (point, normal) = luminaire.opening.point(&[1.0], 0.0, at.map(f64::from));
    (point.as_vec3(), normal.as_vec3())
}

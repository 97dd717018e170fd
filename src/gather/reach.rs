//! Whether light can arrive at a point at all.
//!
//! A grid point inside a table leg has no illuminance: it is no place. Which points are such is asked of light itself,
//! not of normals that meshes rarely keep in order: a point counts as a place if light could travel from some luminaire
//! to it by any number of bounces, whatever the surfaces reflect.

use glam::Vec3;

use super::receiver::Receiver;
use crate::embree::RayCaster;
use crate::luminaire::emit::Front;
use crate::photon::random::{Seed, Stream};
use crate::scene::{Material, Scene};

/// Random walks from a point before it is given up, and the most bounces of each.
const WALKS: u32 = 16;
const BOUNCES: u32 = 16;
/// Walks from the luminaires that decide whether the scene is open, and how many of them must get out: more than can
/// slip through cracks.
const OUTWARD_WALKS: u64 = 2048;
const OPEN_WALKS: u64 = 8;

/// Tells places from the insides of things.
pub struct Reach<'a> {
    caster: &'a RayCaster,
    fronts: Vec<Front>,
    /// Light passes straight.
    clear: Vec<bool>,
    /// Light passes and is scattered.
    translucent: Vec<bool>,
    seed: Seed,
    /// Whether light gets out of the scene, so that what else is outside may meet it.
    open: bool,
}

impl<'a> Reach<'a> {
    /// Prepares the question for a scene; casts about 3·10⁴ rays.
    pub fn new(scene: &'a Scene, caster: &'a RayCaster, seed: Seed) -> Self {
        let clear = scene.materials.iter().map(Material::is_clear).collect();
        let mut reach = Self {
            caster,
            fronts: scene.luminaires.iter().map(Front::of).collect(),
            clear,
            translucent: scene.materials.iter().map(Material::is_translucent).collect(),
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
        self.fronts.iter().any(|front| self.sees(start, front, 0.0, [0.5; 2]))
            || (0..WALKS).any(|_| {
                let direction = receiver.direction(point, stream.uniform_pair());
                self.walk_arrives(start, direction, &mut stream)
            })
    }

    /// One walk from a point, at first along `towards`: it arrives if it comes to see a luminaire, or gets out where light gets out.
    fn walk_arrives(&self, start: Vec3, towards: Vec3, stream: &mut Stream) -> bool {
        let (mut origin, mut direction) = (start, towards);
        for _ in 0..BOUNCES {
            let choice = (stream.uniform() * self.fronts.len() as f32) as usize;
            let front = &self.fronts[choice.min(self.fronts.len() - 1)];
            if self.sees(origin, front, stream.uniform(), stream.uniform_pair()) {
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
            let front = &self.fronts[(*walk % self.fronts.len() as u64) as usize];
            let (mut origin, normal) =
                front.point_off(stream.uniform(), stream.uniform_pair(), Vec3::ZERO, self.caster);
            let mut direction = if front.is_point() { stream.on_sphere() } else { stream.cosine_about(normal) };
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
        let onward = if self.clear[hit.material as usize] {
            direction
        } else {
            let through = self.translucent[hit.material as usize] && stream.uniform() < 0.5;
            let to_front = (direction.dot(hit.normal) < 0.0) != through;
            stream.cosine_about(if to_front { hit.normal } else { -hit.normal })
        };
        Some((hit.leave(onward), onward))
    }

    /// Whether nothing but glass stands between a point and one of a luminaire's front; walks alone would hardly ever hit
    /// on a lamp in a bulb.
    fn sees(&self, from: Vec3, front: &Front, choice: f32, at: [f32; 2]) -> bool {
        let (target, normal) = front.point_seen(choice, at, from, self.caster);
        let to = target - from;
        let distance = to.length();
        let from_front = front.is_point() || to.dot(normal) < 0.0;
        let reach = if front.is_point() { distance * (1.0 - 1e-5) } else { distance };
        distance > 0.0 && from_front && self.passes(from, to / distance, reach)
    }

    /// Whether a straight way of `reach` (m) is free but for glass.
    fn passes(&self, mut from: Vec3, direction: Vec3, mut reach: f32) -> bool {
        for _ in 0..BOUNCES {
            match self.caster.closest_hit(from, direction, reach) {
                None => return true,
                Some(hit) if self.clear[hit.material as usize] => {
                    reach -= hit.distance;
                    from = hit.leave(direction);
                }
                Some(_) => return false,
            }
        }
        false
    }
}

//! Random walks through free space: from the luminaires, and back to them.

use glam::Vec3;
use rayon::prelude::*;

use super::{LightReach, SpacePart};
use crate::gather::JUST_BEFORE;
use crate::gather::receiver::Receiver;
use crate::photon::emit::Front;
use crate::random::Stream;

/// Walks from the luminaires, the most bounces of each, and how many of them must get out for the scene to be open:
/// more than can slip through cracks.
const OUTWARD_WALKS: u64 = 2048;
const OUTWARD: u32 = 16;
const OPEN_WALKS: usize = 8;
/// Sheets of glass that a straight way may pass.
const MAX_GLASS: u32 = 16;
/// Walks that measure a cavity, and their legs.
const PILOTS: u32 = 16;
const PILOT_LEGS: u32 = 16;
/// Points of a luminaire where its light starts, for the question which bodies hold it: more for one of many pieces.
const LAMP_POINTS: usize = 4;
const MAX_LAMP_POINTS: usize = 1024;

impl LightReach<'_> {
    /// Sends walks from the luminaires: the points they reach are lit, and they show whether light gets out.
    pub(super) fn send_out(&mut self) {
        if self.fronts.is_empty() {
            return;
        }
        let walk = |walk: u64| {
            let mut stream = self.seed.branch(1).stream(walk);
            let front = &self.fronts[(walk % self.fronts.len() as u64) as usize];
            let (mut origin, normal) =
                front.point_off(stream.uniform(), stream.uniform_pair(), Vec3::ZERO, self.caster);
            let mut direction = if front.is_point() { stream.on_sphere() } else { stream.cosine_about(normal) };
            let mut met = Vec::new();
            for _ in 0..OUTWARD {
                match self.bounce(origin, direction, &mut stream) {
                    Some(next) => (origin, direction) = next,
                    None => return (met, true),
                }
                met.push(origin);
            }
            (met, false)
        };
        let walks: Vec<(Vec<Vec3>, bool)> = (0..OUTWARD_WALKS).into_par_iter().map(walk).collect();
        self.open = walks.iter().filter(|(_, out)| *out).count() >= OPEN_WALKS;
        self.lit = walks.into_iter().flat_map(|(met, _)| met).collect();
    }

    /// Points of all luminaires where their light starts.
    pub(super) fn lamp_points(&self) -> Vec<Vec3> {
        let of = |front: &Front| {
            let count = front.pieces().clamp(LAMP_POINTS, MAX_LAMP_POINTS);
            let at = |i: usize| {
                let choice = (i as f32 + 0.5) / count as f32;
                let [u, v] = [0.618_034, 0.754_877_7].map(|step: f32| (0.5 + i as f32 * step).fract());
                front.point_off(choice, [u, v], Vec3::ZERO, self.caster).0
            };
            (0..if front.is_point() { 1 } else { count }).map(at).collect::<Vec<_>>()
        };
        self.fronts.iter().flat_map(of).collect()
    }

    /// One walk from a point of a receiver: it arrives if it comes to see light, or gets out where light gets out.
    pub(super) fn walk_from(&self, receiver: &Receiver, point: usize, bounces: u32, stream: &mut Stream) -> bool {
        let mut origin = receiver.start(point);
        let mut direction = receiver.direction(point, stream.uniform_pair());
        for bounce in 0..bounces {
            match self.bounce(origin, direction, stream) {
                Some(next) => (origin, direction) = next,
                None => return self.open,
            }
            if self.sees_light(origin, bounce, stream) {
                return true;
            }
        }
        false
    }

    /// Root mean square of the legs of some walks from a part of space, m: how large it is.
    pub(super) fn cavity(&self, receiver: &Receiver, part: &SpacePart) -> f64 {
        let mut stream = self.stream_of(part, 3);
        let (mut sum, mut legs) = (0.0, 0.0_f64);
        for walk in 0..PILOTS {
            let point = part.points[walk as usize % part.points.len()] as usize;
            let mut origin = receiver.start(point);
            let mut direction = receiver.direction(point, stream.uniform_pair());
            for _ in 0..PILOT_LEGS {
                let Some((next, onward)) = self.bounce(origin, direction, &mut stream) else { break };
                sum += f64::from(origin.distance_squared(next));
                legs += 1.0;
                (origin, direction) = (next, onward);
            }
        }
        (sum / legs.max(1.0)).sqrt()
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

    /// One attempt to see light from a point: some luminaire, or some place that light has come to.
    pub(super) fn sees_light(&self, from: Vec3, attempt: u32, stream: &mut Stream) -> bool {
        let pick = |count: usize, stream: &mut Stream| ((stream.uniform() * count as f32) as usize).min(count - 1);
        if self.fronts.is_empty() {
            return false;
        }
        if attempt.is_multiple_of(2) || self.lit.is_empty() {
            let front = &self.fronts[pick(self.fronts.len(), stream)];
            return self.sees(from, front, stream.uniform(), stream.uniform_pair());
        }
        let narrow = !self.through_gaps.is_empty() && attempt % 4 == 1;
        let places = if narrow { &self.through_gaps } else { &self.lit };
        self.is_free(from, places[pick(places.len(), stream)])
    }

    /// Whether a point sees one point of some luminaire.
    pub(super) fn sees_lamp(&self, from: Vec3, stream: &mut Stream) -> bool {
        self.fronts.iter().any(|front| self.sees(from, front, stream.uniform(), stream.uniform_pair()))
    }

    /// Whether nothing but glass stands between a point and one of a luminaire's front.
    fn sees(&self, from: Vec3, front: &Front, choice: f32, at: [f32; 2]) -> bool {
        let (target, normal) = front.point_seen(choice, at, from, self.caster);
        let to = target - from;
        let distance = to.length();
        let from_front = front.is_point() || to.dot(normal) < 0.0;
        let reach = if front.is_point() { distance * JUST_BEFORE as f32 } else { distance };
        distance > 0.0 && from_front && self.passes(from, to / distance, reach)
    }

    /// Whether the straight way between two points in the air is free but for glass.
    pub(super) fn is_free(&self, from: Vec3, to: Vec3) -> bool {
        let distance = from.distance(to);
        distance == 0.0 || self.passes(from, (to - from) / distance, distance)
    }

    /// Whether a straight way of `reach` (m) is free but for glass.
    pub(super) fn passes(&self, mut from: Vec3, direction: Vec3, mut reach: f32) -> bool {
        for _ in 0..MAX_GLASS {
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

    /// Where a ray from a point ends, just off what it met beyond glass; `None` if it leaves the scene.
    pub(super) fn landing(&self, mut from: Vec3, direction: Vec3) -> Option<Vec3> {
        for _ in 0..MAX_GLASS {
            let hit = self.caster.closest_hit(from, direction, f32::INFINITY)?;
            if !self.clear[hit.material as usize] {
                return Some(hit.leave(-direction));
            }
            from = hit.leave(direction);
        }
        Some(from)
    }
}

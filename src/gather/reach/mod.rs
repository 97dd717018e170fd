//! Whether light can arrive at a point at all.
//!
//! A grid point inside a table leg has no illuminance: it is no place. Which points are such is decided by space, not
//! by normals, which meshes rarely keep in order, and not by chance: points of one receiver that see each other are one
//! part of space, and share one answer. A part is a place if anything in it sees a luminaire or a point that light has
//! come to (`walks.rs`, `probes.rs`), by any number of bounces, whatever the surfaces reflect. It is none if a closed
//! body stands between it and all luminaires (`shells.rs`), or if neither the rims of openings nor as many walks as a
//! hole of three millimetres takes to be found show a way.

mod flood;
mod probes;
mod shells;
mod walks;

use glam::Vec3;
use rayon::prelude::*;

use super::receiver::Receiver;
use crate::embree::RayCaster;
use crate::photon::emit::Front;
use crate::random::{Seed, Stream};
use crate::scene::{Material, Scene};
use shells::Shells;

/// What is nearer in front of a point than this part of its spacing covers it.
const COVERS: f32 = 0.01;
/// A luminaire covers a point behind it from ten times as far: a panel hangs a little below its ceiling.
const LAMP_COVERS: f32 = 10.0;
/// Ways towards light that are tried from each point, and from each part of space that these leave.
const POINT_TRIES: u32 = 4;
const PART_TRIES: u32 = 64;
/// Walks that are tried before anything is proved, and the most bounces of each.
const SHORT_WALKS: u32 = 16;
const SHORT: u32 = 16;
/// Bounces of the long walks.
const LONG: u32 = 512;
/// The hole that long walks shall find, m, and how often they should have met it; smaller ones are found at their rims.
const HOLE: f64 = 3e-3;
const MEETINGS: f64 = 4.0;
/// Bounces spent on one part at least and at most, and on all.
const MIN_BOUNCES: f64 = 2e3;
const MAX_BOUNCES: f64 = 4e6;
const MAX_BOUNCES_IN_ALL: f64 = 1e7;
/// Parts of that which are spent one after the other, and points that are kept of what they reach.
const SHARES: [f64; 2] = [0.02, 1.0];
const KEPT: usize = 64;
/// Long walks that have to arrive: in narrow cavities rounding lets one of some millions of rays slip through a corner.
const ARRIVALS: usize = 2;

/// Why a point has a value, or none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Standing {
    /// Light can arrive: it has a value, which may be 0.
    #[default]
    Place,
    /// Something opaque lies on it, nearer than a hundredth of the spacing of points.
    Covered,
    /// A closed body stands between it and every luminaire: it is inside, or the luminaires are.
    Inside,
    /// No closed body is known, but no way for light was found.
    Dark,
}

impl Standing {
    /// The reasons for having no value, in the order of reports.
    pub const WITHOUT_VALUE: [Self; 3] = [Self::Inside, Self::Covered, Self::Dark];

    /// Whether it has a value.
    pub fn is_place(self) -> bool {
        self == Self::Place
    }

    /// The reason in words.
    pub fn reason(self) -> &'static str {
        match self {
            Self::Place => "light can arrive",
            Self::Covered => "covered",
            Self::Inside => "shut off by a closed body",
            Self::Dark => "no way for light found",
        }
    }
}

/// Points to be decided.
pub struct Points<'a> {
    /// The receiver.
    pub receiver: &'a Receiver,
    /// Areas of the points, m², of a measured surface; else empty.
    pub areas: &'a [f64],
}

impl Points<'_> {
    /// How near something has to be in front of a point to cover it, m.
    fn covered_within(&self, point: usize) -> f32 {
        let [width, height] = self.receiver.cell; // 0 where there is no grid
        COVERS * self.areas.get(point).map_or(width.min(height), |area| area.sqrt() as f32)
    }
}

/// Points of one receiver between which light can pass.
struct SpacePart {
    receiver: usize,
    points: Vec<u32>,
}

/// Sets the standing of the points in those parts of space that are decided; returns the others.
fn settle(parts: Vec<SpacePart>, decided: &[bool], standing: Standing, found: &mut [Vec<Standing>]) -> Vec<SpacePart> {
    let mut left = Vec::new();
    for (part, decided) in parts.into_iter().zip(decided) {
        if *decided {
            part.points.iter().for_each(|&point| found[part.receiver][point as usize] = standing);
        } else {
            left.push(part);
        }
    }
    left
}

/// Decides which points light can reach.
pub struct LightReach<'a> {
    scene: &'a Scene,
    caster: &'a RayCaster,
    fronts: Vec<Front>,
    /// Triangles of luminaires' openings, in order.
    openings: Vec<u32>,
    /// Light passes straight.
    clear: Vec<bool>,
    /// Light passes and is scattered.
    translucent: Vec<bool>,
    seed: Seed,
    /// Whether light gets out of the scene, so that what else is outside may meet it.
    open: bool,
    /// Points in the air just off surfaces to which light has come.
    lit: Vec<Vec3>,
    /// The same of light that came through narrow openings.
    through_gaps: Vec<Vec3>,
}

impl<'a> LightReach<'a> {
    /// Prepares the question for a scene; casts about 3·10⁴ rays.
    pub fn new(scene: &'a Scene, caster: &'a RayCaster, seed: Seed) -> Self {
        let mut openings: Vec<u32> =
            scene.luminaires.iter().flat_map(|luminaire| luminaire.body.iter().copied()).collect();
        openings.sort_unstable();
        let mut reach = Self {
            scene,
            openings,
            caster,
            fronts: scene.luminaires.iter().map(Front::of).collect(),
            clear: scene.materials.iter().map(Material::is_clear).collect(),
            translucent: scene.materials.iter().map(Material::is_translucent).collect(),
            seed,
            open: false,
            lit: Vec::new(),
            through_gaps: Vec::new(),
        };
        reach.send_out();
        reach
    }

    /// What every point of some receivers is. Where neither walks nor proofs decide, a part of space is a place if one
    /// of its points `is_lit`, by receiver and point. Cost: one or two rays a point where light comes straight.
    pub fn standings(
        &mut self,
        asked: &[Points<'_>],
        is_lit: impl Fn(usize, usize) -> bool + Sync,
    ) -> Vec<Vec<Standing>> {
        let mut found: Vec<Vec<Standing>> = asked.iter().map(|asked| self.first_pass(asked)).collect();
        let mut parts: Vec<SpacePart> = Vec::new();
        for (receiver, asked) in asked.iter().enumerate() {
            parts.extend(self.flood(receiver, asked.receiver, &mut found[receiver]));
        }
        // The largest first: they have most of what may be spent. (The order of equals is kept.)
        parts.sort_by_key(|part| std::cmp::Reverse(part.points.len()));
        let of = |part: &SpacePart| asked[part.receiver].receiver;
        let near = self.all(&parts, |part| self.is_near_light(of(part), part));
        let parts = settle(parts, &near, Standing::Place, &mut found);
        if parts.is_empty() {
            return found;
        }
        let scene = self.scene;
        let shells = Shells::of(&scene.mesh, |material| !self.clear[material] && !self.translucent[material]);
        let lamps = self.lamp_points();
        let shut = self.all(&parts, |part| shells.shut_off(of(part).start(part.points[0] as usize), &lamps));
        let parts = settle(parts, &shut, Standing::Inside, &mut found);
        if parts.is_empty() {
            return found;
        }
        self.follow_gaps(&shells);
        let arrive = self.walk_long(asked, &parts);
        let parts = settle(parts, &arrive, Standing::Place, &mut found);
        let is_lit = |part: &SpacePart| part.points.iter().any(|&point| is_lit(part.receiver, point as usize));
        let lit = self.all(&parts, is_lit);
        settle(parts, &lit, Standing::Place, &mut found);
        found
    }

    /// An answer for each part of space.
    fn all(&self, parts: &[SpacePart], verdict: impl Fn(&SpacePart) -> bool + Sync + Send) -> Vec<bool> {
        parts.par_iter().map(verdict).collect()
    }

    /// Whether a luminaire's opening is what comes first within `reach` (m), from either side.
    fn meets_lamp(&self, from: Vec3, direction: Vec3, reach: f32) -> bool {
        let hit = self.caster.closest_hit(from, direction, reach);
        hit.is_some_and(|hit| self.openings.binary_search(&hit.triangle).is_ok())
    }

    /// Which points are covered, and which see light at once; the others are dark as yet.
    fn first_pass(&self, asked: &Points<'_>) -> Vec<Standing> {
        let receiver = asked.receiver;
        let standing = |point: usize| {
            let start = receiver.start(point);
            let within = asked.covered_within(point);
            let mut stream = self.seed.stream(point as u64);
            let normal = receiver.normal_at(point);
            let covered = within > 0.0
                && receiver.bodies().is_empty()
                && (!self.passes(start, normal, within) || self.meets_lamp(start, normal, LAMP_COVERS * within))
                && !self.sees_lamp(start, &mut stream); // what covers it may be a lamp that lights it
            if covered {
                return Standing::Covered;
            }
            let seen = (0..POINT_TRIES).any(|attempt| self.sees_light(start, attempt, &mut stream));
            if seen { Standing::Place } else { Standing::Dark }
        };
        (0..receiver.len()).into_par_iter().with_min_len(64).map(standing).collect()
    }

    /// Whether some ways and short walks from a part's points meet light.
    fn is_near_light(&self, receiver: &Receiver, part: &SpacePart) -> bool {
        let mut stream = self.stream_of(part, 2);
        let point = |attempt: u32| part.points[attempt as usize % part.points.len()] as usize;
        (0..PART_TRIES).any(|attempt| self.sees_light(receiver.start(point(attempt)), attempt, &mut stream))
            || (0..SHORT_WALKS).any(|walk| self.walk_from(receiver, point(walk), SHORT, &mut stream))
    }

    /// Which parts are reached by walks that find a [`HOLE`], as far as that takes no longer than is reasonable. Short
    /// walks come first; what they reach is lit for the others.
    fn walk_long(&mut self, asked: &[Points<'_>], parts: &[SpacePart]) -> Vec<bool> {
        let of = |part: &SpacePart| asked[part.receiver].receiver;
        let wanted = |part: &SpacePart| MEETINGS * (self.cavity(of(part), part) / HOLE).powi(2);
        let wanted: Vec<f64> = parts.iter().map(wanted).collect();
        let mut arrived = vec![false; parts.len()];
        let (mut left, mut round) = (MAX_BOUNCES_IN_ALL, 0);
        for share in SHARES {
            let mut goes_on = true;
            while goes_on {
                goes_on = false;
                for (index, part) in parts.iter().enumerate() {
                    if arrived[index] {
                        continue;
                    }
                    let bounces = (share * wanted[index]).clamp(MIN_BOUNCES, MAX_BOUNCES).min(left.max(MIN_BOUNCES));
                    arrived[index] = self.walks_arrive(of(part), part, bounces, round);
                    if arrived[index] {
                        let points = part.points.iter().take(KEPT);
                        self.through_gaps.extend(points.map(|&point| of(part).start(point as usize)));
                        goes_on = true;
                    } else {
                        left -= bounces;
                    }
                }
                round += 1;
            }
        }
        arrived
    }

    /// Whether [`ARRIVALS`] of some walks from a part's points arrive.
    fn walks_arrive(&self, receiver: &Receiver, part: &SpacePart, bounces: f64, round: u64) -> bool {
        let walks = (bounces / f64::from(LONG)).ceil() as usize;
        let arrives = |walk: &usize| {
            let mut stream = self.stream_of(part, 6 + (round << 32) + *walk as u64);
            self.walk_from(receiver, part.points[*walk % part.points.len()] as usize, LONG, &mut stream)
        };
        (0..walks).into_par_iter().filter(arrives).count() >= ARRIVALS
    }

    /// Random numbers for a part of space.
    fn stream_of(&self, part: &SpacePart, purpose: u64) -> Stream {
        self.seed.branch(purpose).branch(part.receiver as u64).stream(u64::from(part.points[0]))
    }
}

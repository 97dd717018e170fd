//! Direct light: Lambert's formula, or a sum over measured intensities, for what is seen of each opening.
//!
//! What a Lambertian polygon sends to a point is known exactly, and so is what a flat triangle hides of it from there:
//! a search finds all triangles that may stand between a block of points and an opening ([`blockers`]), each point cuts
//! their shadows out of the opening, and the formula adds up the pieces left over ([`polygon`]). Nothing is sampled,
//! and nothing missed. Measured luminaires have no formula, but their sum over the same pieces converges fast (`web`).
//! Shadow rays take over, with a variance, only where finely tessellated things stand in the way, and for far
//! luminaires that hardly matter.
//!
//! Every surface hides what lies behind it, solids of glass too: what they refract or what comes by mirrors arrives
//! with the photons. Panes let their share of the light pass straight (`panes`).

mod blocker;
pub mod blockers;
mod blocks;
pub mod bodies;
pub(crate) mod emitter;
pub mod faint;
mod panes;
pub mod polygon;
mod sample;
mod view;
mod visit;
mod web;

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

use self::blocker::Blocker;
use self::blockers::{AxisBox, Blockers, Shaft};
use self::blocks::PointBlock;
use self::emitter::{EmittingPiece, LightSource, emitters};
use self::faint::{FAINT, Faint, MAX_BLOCKERS_IF_STRONG};
use self::view::OpeningView;
use self::visit::Visit;
pub(super) use self::web::FLATTEST;
use super::receiver::Receiver;
use crate::flux::photometric;
use crate::luminaire::{LightGroups, Luminaire};
use crate::random::Seed;

/// Luminaires that together can add no more than this part of a point's direct light are left out there.
pub const MAX_LEFT_OUT: f64 = 1e-4;
/// Above this many triangles in the way of a part, points search on their own; above it for a point, rays sample.
const MAX_BLOCKERS: usize = 192;
/// Cuts for one point and opening before rays take over.
const MAX_CUTS: usize = 600;
/// Direct light at the points of a receiver.
#[derive(Clone, Debug)]
pub struct DirectLight<const C: usize> {
    /// E of each point in each channel, lx.
    pub value: Vec<[f64; C]>,
    /// Variance of the photometric E of each point, lx²: what shadow rays sampled, 0 where all was cut exactly.
    pub variance: Vec<f64>,
    /// What the luminaires left out at each point can add at most, lx: ≤ [`MAX_LEFT_OUT`] · E.
    pub left_out: Vec<f64>,
    /// Shadow rays cast.
    pub rays: u64,
    /// The part of each light group, where wanted.
    pub groups: Option<DirectGroups>,
}

/// Direct light by group; adds up to the whole but for rounding.
#[derive(Clone, Debug)]
pub struct DirectGroups {
    /// E, lx: a row for each point, as [`LightGroups`] lays them out.
    pub value: Vec<f32>,
    /// Variance of the photometric E, lx²: for each point, of each group; none on a grid.
    pub variance: Vec<f32>,
}

impl<const C: usize> DirectLight<C> {
    /// Mean and largest share of the points' light that may have been left out, all points in the dark aside.
    pub fn left_out_share(&self) -> [f64; 2] {
        let lit = self.value.iter().zip(&self.left_out).map(|(value, left)| (photometric(*value), left));
        let shares: Vec<f64> = lit.filter(|(lux, _)| *lux > 0.0).map(|(lux, left)| left / lux).collect();
        let mean = shares.iter().sum::<f64>() / shares.len().max(1) as f64;
        [mean, shares.iter().copied().fold(0.0, f64::max)]
    }
}

/// Direct illuminance of every point of `receiver` by all luminaires. `progress` is called with steps that add up to
/// one for each luminaire.
///
/// Error: that of the points' coordinates (single precision, and some 1e-6 of the scene's size off surfaces) where
/// fewer than 192 triangles are in the way of a flat opening. What is sampled instead is in [`DirectLight::variance`]:
/// openings behind more triangles, emitting meshes of more than 256 triangles, and luminaires that matter little (at
/// most 0.1 % of E, one standard deviation, together). On top, E is too low by [`DirectLight::left_out`] at most. Cost
/// for a point and luminaire, measured in the seed office: 0.4 µs on the floor under desks, 0.1 µs at 0.75 m.
pub fn direct_light<const C: usize>(
    luminaires: &[Luminaire],
    receiver: &Receiver,
    blockers: &Blockers<'_>,
    seed: Seed,
    progress: impl Fn(u64) + Sync,
) -> DirectLight<C> {
    direct_light_for(luminaires, receiver, blockers, seed, progress, Request::default()).0
}

/// What is wanted besides the light of all luminaires together.
#[derive(Clone, Copy, Default)]
pub struct Request<'a> {
    /// The part of each of these light groups: some ns a point and luminaire more.
    pub groups: Option<&'a LightGroups>,
    /// Luminaires that are faint where much stands in their way are returned as [`Faint`] instead of summed up.
    pub faint: bool,
}

/// The same, and what else `request` wants: the light lacks that of the faint luminaires returned.
pub fn direct_light_for<const C: usize>(
    luminaires: &[Luminaire],
    receiver: &Receiver,
    blockers: &Blockers<'_>,
    seed: Seed,
    progress: impl Fn(u64) + Sync,
    asked: Request<'_>,
) -> (DirectLight<C>, Faint<C>) {
    let emitters = emitters::<C>(luminaires);
    let Request { groups, faint } = asked;
    let gather = |up: Vec3| Gather { receiver, up: up.as_dvec3(), blockers, emitters: &emitters, seed, groups, faint };
    let (steps, done) = (luminaires.len() as u64, AtomicU64::new(0));
    let advance = |points: usize| {
        let before = done.fetch_add(points as u64, Ordering::Relaxed);
        let step = |points: u64| (u128::from(points) * u128::from(steps) / receiver.len().max(1) as u128) as u64;
        progress(step(before + points as u64) - step(before));
    };
    let found: Vec<LitBlock<C>> = gather(receiver.normal)
        .blocks()
        .into_par_iter()
        .map_init(DirectScratch::default, |scratch, block| {
            scratch.rays = 0;
            let gather = gather(receiver.normal_at(block.points[0]));
            let mut by_group = gather.rows(block.points.len());
            let mut faint = Vec::new();
            let sums = gather.block(&block, &mut by_group, &mut faint, scratch);
            advance(block.points.len());
            LitBlock { points: block.points, sums, by_group: by_group.map(f64_to_f32), faint, rays: scratch.rays }
        })
        .collect();
    let points = receiver.len();
    let mut light = DirectLight {
        value: vec![[0.0; C]; points],
        variance: vec![0.0; points],
        left_out: vec![0.0; points],
        rays: 0,
        groups: groups.map(|_| {
            let [value, variance] = gather(receiver.normal).rows(points).map(f64_to_f32);
            DirectGroups { value, variance }
        }),
    };
    let mut of_point = vec![[0; 2]; if faint { points } else { 0 }];
    let mut drawn = Vec::new();
    for LitBlock { points, sums, by_group, faint, rays } in found {
        if !faint.is_empty() {
            let range = [drawn.len() as u32, (drawn.len() + faint.len()) as u32];
            points.iter().for_each(|&point| of_point[point] = range);
            drawn.extend(faint);
        }
        if let Some(DirectGroups { value, variance }) = &mut light.groups {
            for (from, to) in by_group.iter().zip([value, variance]) {
                let width = from.len() / points.len();
                points.iter().enumerate().for_each(|(row, &point)| {
                    to[point * width..][..width].copy_from_slice(&from[row * width..][..width]);
                });
            }
        }
        for (point, sum) in points.into_iter().zip(sums) {
            light.value[point] = sum.value;
            light.variance[point] = sum.variance;
            light.left_out[point] = sum.left_out;
        }
        light.rays += rays;
    }
    (light, Faint { emitters, of_point, drawn })
}

/// The light summed up at the points of a block.
struct LitBlock<const C: usize> {
    points: Vec<usize>,
    sums: Vec<PointSum<C>>,
    /// Rows of E and of variances by light group.
    by_group: [Vec<f32>; 2],
    /// Emitters that are left to rays, and the running sum of what they can bring at most, lx.
    faint: Vec<(u32, f64)>,
    rays: u64,
}

/// Rows of sums in single precision.
fn f64_to_f32(rows: Vec<f64>) -> Vec<f32> {
    rows.into_iter().map(|sum| sum as f32).collect()
}

/// The light summed up at a point so far.
#[derive(Clone, Copy)]
struct PointSum<const C: usize> {
    value: [f64; C],
    variance: f64,
    /// Photometric value, lx.
    lux: f64,
    left_out: f64,
    /// The part of the variance that comes from luminaires decided by a single ray.
    glimpsed: f64,
    /// Whether more luminaires matter.
    open: bool,
}

impl<const C: usize> PointSum<C> {
    /// Adds what arrives of an emitter as so much red, green and blue light (lx) if it were white, and the variance of
    /// its photometric value.
    fn add(&mut self, emitter: &EmittingPiece<C>, (lux, variance): ([f64; 3], f64)) {
        let tinted = emitter.tinted(lux);
        (0..C).for_each(|c| self.value[c] += tinted[c]);
        self.lux += if lux == [lux[0]; 3] { lux[0] * emitter.brightness } else { photometric(tinted) };
        self.variance += variance * emitter.brightness * emitter.brightness;
    }
}

/// Memory reused from block to block.
#[derive(Default)]
struct DirectScratch {
    block: Vec<Blocker>,
    part: Vec<Blocker>,
    point: Vec<Blocker>,
    suspects: Vec<Blocker>,
    view: OpeningView,
    shares: Vec<f64>,
    rays: u64,
}

/// What may stand in the way.
#[derive(Clone, Copy, PartialEq)]
enum InTheWay {
    Nothing,
    Few,
    Many,
}

struct Gather<'a, const C: usize> {
    receiver: &'a Receiver,
    up: DVec3,
    blockers: &'a Blockers<'a>,
    emitters: &'a [EmittingPiece<C>],
    seed: Seed,
    groups: Option<&'a LightGroups>,
    faint: bool,
}

impl<const C: usize> Gather<'_, C> {
    /// Where shadows are cut from: just off the surface, as rays start.
    fn eye(&self, point: usize) -> DVec3 {
        self.receiver.start(point).as_dvec3()
    }

    /// Where light is measured, exactly: what a low lamp brings to a large floor depends on micrometres.
    fn place(&self, point: usize) -> DVec3 {
        self.receiver.place(point)
    }

    fn bounds(&self, points: &[usize]) -> AxisBox {
        AxisBox::around(points.iter().map(|&point| self.receiver.start(point)))
            .with(AxisBox::around_exact(points.iter().map(|&point| self.place(point))))
    }

    /// The light of all luminaires at the points of a block. The strongest (by what they could bring at most) come
    /// first, until those left over can't matter any more.
    fn block(
        &self,
        block: &PointBlock,
        by_group: &mut [Vec<f64>; 2],
        faint: &mut Vec<(u32, f64)>,
        scratch: &mut DirectScratch,
    ) -> Vec<PointSum<C>> {
        let bounds = self.bounds(&block.points);
        let mut order: Vec<(f64, usize)> =
            self.emitters.iter().enumerate().map(|(i, emitter)| (emitter.most(&bounds, self.up), i)).collect();
        order.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut rest: Vec<f64> = order.iter().map(|(most, _)| *most).collect();
        for i in (1..rest.len()).rev() {
            rest[i - 1] += rest[i];
        }
        let none = PointSum { value: [0.0; C], variance: 0.0, lux: 0.0, left_out: 0.0, glimpsed: 0.0, open: true };
        let mut sums = vec![none; block.points.len()];
        let mut before = Vec::new();
        for ((most, emitter), rest) in order.into_iter().zip(rest) {
            for sum in sums.iter_mut().filter(|sum| sum.open && rest <= MAX_LEFT_OUT * sum.lux) {
                (sum.left_out, sum.open) = (rest, false);
            }
            if !sums.iter().any(|sum| sum.open) {
                break;
            }
            if self.is_faint(emitter, most, &bounds, &sums, scratch) {
                faint.push((emitter as u32, faint.last().map_or(0.0, |(_, sum)| *sum) + most));
                continue;
            }
            if self.groups.is_some() {
                before.clear();
                before.extend(sums.iter().map(|sum| (sum.value, sum.variance)));
            }
            let visit =
                Visit { gather: self, number: emitter, emitter: &self.emitters[emitter], most, bounds: &bounds };
            visit.add_to(block, &mut sums, scratch);
            if let Some(groups) = self.groups {
                let group = groups.group(self.emitters[emitter].luminaire) as usize;
                let [value, variance] = &mut *by_group;
                let [width, number] = [value.len() / sums.len(), variance.len() / sums.len()];
                for (point, (sum, before)) in sums.iter().zip(&before).enumerate() {
                    (0..C).for_each(|c| value[point * width + group * C + c] += sum.value[c] - before.0[c]);
                    if number > 0 {
                        variance[point * number + group] += sum.variance - before.1;
                    }
                }
            }
        }
        sums
    }

    /// Whether an emitter, which brings `most` lx at most, is left to rays at the points of a block.
    fn is_faint(
        &self,
        emitter: usize,
        most: f64,
        bounds: &AxisBox,
        sums: &[PointSum<C>],
        scratch: &mut DirectScratch,
    ) -> bool {
        let emitter = &self.emitters[emitter];
        let brightest = || sums.iter().fold(0.0_f64, |brightest, sum| brightest.max(sum.lux));
        self.faint
            && matches!(emitter.source, LightSource::Polygon(_))
            && most > 0.0
            && most <= FAINT * brightest()
            && self.search(emitter, bounds, MAX_BLOCKERS_IF_STRONG, &mut scratch.block) == InTheWay::Many
    }

    /// Rows of E and of variances by group for some points: none without light groups, no variances on a grid.
    fn rows(&self, points: usize) -> [Vec<f64>; 2] {
        let groups = self.groups.map_or([0; 2], |groups| {
            [groups.width::<C>(), if self.receiver.grid.is_some() { 0 } else { groups.len() }]
        });
        groups.map(|width| vec![0.0; points * width])
    }

    fn shaft(&self, emitter: &EmittingPiece<C>, points: &AxisBox) -> Shaft {
        let mut shaft = Shaft::between(points, &emitter.bounds);
        shaft.in_front_of(self.up, points.along(self.up)[0]);
        if let Some((normal, front)) = self.ahead(emitter, points) {
            shaft.in_front_of(normal, front);
        }
        shaft
    }

    /// The plane just in front of a flat opening.
    fn ahead(&self, emitter: &EmittingPiece<C>, points: &AxisBox) -> Option<(DVec3, f64)> {
        match &emitter.source {
            LightSource::Polygon(polygon) => Some((polygon.normal, self.front(emitter, polygon.normal, points))),
            _ => None,
        }
    }

    /// Height of the plane just in front of an opening: what lies behind it, the luminaire's own body for one, hides
    /// nothing.
    fn front(&self, emitter: &EmittingPiece<C>, normal: DVec3, points: &AxisBox) -> f64 {
        let largest = points.largest_coordinate().max(emitter.bounds.largest_coordinate());
        let step = self.blockers.caster.step_off(Vec3::ZERO, Vec3::X, largest).x;
        emitter.height(normal) + f64::from(step)
    }

    /// Finds what may stand between some points and an emitter, the largest first.
    fn search(&self, emitter: &EmittingPiece<C>, points: &AxisBox, most: usize, found: &mut Vec<Blocker>) -> InTheWay {
        found.clear();
        let ahead = self.ahead(emitter, points);
        let shaft = self.shaft(emitter, points);
        self.blockers.search(&shaft, |number, triangle| {
            let before = found.len();
            emitter.source.blockers(ahead, number, triangle, found);
            if let Some(pane) = self.blockers.pane(number) {
                found[before..].iter_mut().for_each(|blocker| blocker.pane = Some(pane));
            }
            found.len() <= most
        });
        if found.len() > most {
            return InTheWay::Many;
        }
        found.sort_by(|a, b| b.area.total_cmp(&a.area));
        if found.is_empty() { InTheWay::Nothing } else { InTheWay::Few }
    }
}

#[cfg(test)]
mod tests;

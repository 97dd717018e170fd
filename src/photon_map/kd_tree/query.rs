//! Asks the tree.
//!
//! No closure here works on vectors: closures are compiled without the instruction set (see [`SimdWork`]).

use super::select::{Bracket, kth_smallest};
use super::simd::{LANES, LaneRows, Lanes, Mask, SimdWork};
use super::{CHILDREN, KdTree, LEAF, Leaf, Node, VECTORS};
use crate::photon_map::NearestSum;

/// Squared distances count up to this, m²: photons farther away are found by no radius.
const FARTHEST: f32 = f32::MAX;

/// Memory of a thread's queries.
#[derive(Default)]
pub struct Scratch {
    /// Nodes, then leaves, that the search radius reaches.
    reached: Vec<u32>,
    next: Vec<u32>,
    /// Squared distances of the photons of those leaves.
    distances: Vec<LaneRows<VECTORS>>,
    /// Of the slow but bounded search: squared distance and place of the photons found, and what is still to be
    /// visited.
    found: Vec<(f32, u32)>,
    pending: Vec<Pending>,
}

/// A node or leaf yet to be visited.
#[derive(Clone, Copy)]
struct Pending {
    distance_squared: f32,
    /// Levels above the leaves.
    height: u32,
    index: u32,
}

/// How the nearest photons were found.
enum NearestFound {
    /// They are those of the leaves reached that lie within this squared distance.
    Within { farthest: f32, count: usize },
    /// They are listed in `Scratch::found`.
    Listed,
}

/// Three vectors: a point, in all lanes.
type Point<L> = [<L as Lanes>::Vector; 3];

#[inline(always)]
fn splat<L: Lanes>(lanes: L, at: [f32; 3]) -> Point<L> {
    [lanes.splat(at[0]), lanes.splat(at[1]), lanes.splat(at[2])]
}

/// Squared distances from a point to a node's boxes. Never more than those computed for the photons inside: the same
/// steps in the same order round the same way.
#[inline(always)]
fn to_boxes<L: Lanes>(lanes: L, node: &Node, at: Point<L>) -> L::Vector {
    let gaps = [gap(lanes, node, 0, at[0]), gap(lanes, node, 1, at[1]), gap(lanes, node, 2, at[2])];
    squared(lanes, gaps)
}

/// Along one axis.
#[inline(always)]
fn gap<L: Lanes>(lanes: L, node: &Node, axis: usize, at: L::Vector) -> L::Vector {
    let below = lanes.sub(lanes.load(&node.low[axis]), at);
    let above = lanes.sub(at, lanes.load(&node.high[axis]));
    lanes.max(lanes.max(below, above), lanes.splat(0.0))
}

/// From a point to sixteen photons of a leaf.
#[inline(always)]
fn offsets<L: Lanes>(lanes: L, leaf: &Leaf, vector: usize, at: Point<L>) -> Point<L> {
    let [x, y, z] = [&leaf.0[vector], &leaf.0[VECTORS + vector], &leaf.0[2 * VECTORS + vector]];
    [lanes.sub(lanes.load(x), at[0]), lanes.sub(lanes.load(y), at[1]), lanes.sub(lanes.load(z), at[2])]
}

#[inline(always)]
fn squared<L: Lanes>(lanes: L, [x, y, z]: Point<L>) -> L::Vector {
    lanes.add(lanes.add(lanes.mul(x, x), lanes.mul(y, y)), lanes.mul(z, z))
}

impl KdTree {
    /// The node of a level.
    #[inline(always)]
    fn node(&self, height: usize, index: u32) -> &Node {
        &self.nodes[(self.levels[height].first + index) as usize]
    }

    /// How many nodes the highest level has.
    #[inline(always)]
    fn tops(&self) -> u32 {
        self.levels.last().map_or(0, |level| level.children.div_ceil(CHILDREN as u32))
    }

    /// Lists the leaves whose boxes come within the radius, in their order. Gives up, and says so, where there are more
    /// than `most` of them or of the nodes above.
    #[inline(always)]
    fn reach<L: Lanes>(&self, lanes: L, at: Point<L>, radius_squared: f32, most: usize, scratch: &mut Scratch) -> bool {
        let Scratch { reached, next, .. } = scratch;
        let limit = lanes.splat(radius_squared);
        reached.clear();
        reached.extend(0..self.tops());
        for (height, level) in self.levels.iter().enumerate().rev() {
            let room = (reached.len() * CHILDREN).min(level.children as usize) + LANES;
            if next.len() < room {
                next.resize(room, 0);
            }
            let mut count = 0;
            for &index in &*reached {
                let mask = lanes.at_most(to_boxes(lanes, self.node(height, index), at), limit);
                if let Some(free) = next[count..].first_chunk_mut() {
                    lanes.numbers(mask, index * CHILDREN as u32, free);
                }
                count += mask.count_ones() as usize;
            }
            next.truncate(count);
            std::mem::swap(reached, next);
            if count > most {
                return false;
            }
        }
        true
    }
}

/// The k nearest photons within a radius (m).
pub(super) struct Nearest<'a> {
    pub(super) tree: &'a KdTree,
    pub(super) at: [f32; 3],
    pub(super) k: usize,
    pub(super) radius: f32,
}

impl Nearest<'_> {
    /// Guesses a radius, counts the photons in it, and enlarges it until it holds k; then finds the k-th of them. Where
    /// photons crowd (too many leaves) or thin out (too many tries), searches leaf by leaf instead. `None` if there is
    /// nothing to be found.
    #[inline(always)]
    fn find<L: Lanes>(&self, lanes: L, scratch: &mut Scratch) -> Option<NearestFound> {
        let Self { tree, at, radius, .. } = *self;
        let k = self.k.min(tree.count);
        let limit = (radius * radius).min(FARTHEST);
        if k == 0 {
            return None;
        }
        let point = splat(lanes, at);
        let (base, growth) = tree.guess(lanes, point, k);
        let most_leaves = 64 + k / 4;
        let mut spread = growth;
        for _ in 0..4 {
            let radius_squared = if k == tree.count { limit } else { (base + spread).min(limit) };
            if !tree.reach(lanes, point, radius_squared, most_leaves, scratch) {
                break;
            }
            let count = tree.measure(lanes, point, radius_squared, scratch);
            if count >= k || radius_squared >= limit {
                let k = k.min(count);
                if k == 0 {
                    return None;
                }
                let bracket = Bracket { low: 0.0_f32.next_down(), below: 0, high: radius_squared, upto: count };
                let distances = LaneRows::blocks(&scratch.distances[..scratch.reached.len()]);
                let kth = kth_smallest(lanes, distances, k, bracket);
                if kth.upto > k {
                    break; // photons equally far: only some of them are wanted
                }
                return Some(NearestFound::Within { farthest: kth.value, count: k });
            }
            spread *= (1.5 * k as f32 / count as f32).clamp(1.6, 16.0);
        }
        tree.search(lanes, point, k, limit, scratch);
        Some(NearestFound::Listed)
    }
}

impl KdTree {
    /// Squared distance to the photons' boxes and squared radius, from there, of a disc that ought to hold a few more
    /// than k photons, by the density in the smallest node of at least k photons nearest to the point.
    #[inline(always)]
    fn guess<L: Lanes>(&self, lanes: L, at: Point<L>, k: usize) -> (f32, f32) {
        let (mut index, mut base) = (0, f32::INFINITY);
        let mut height = self.levels.len() - 1;
        let mut nodes = 0..self.tops();
        while height > 0 && (LEAF * CHILDREN) << (4 * (height - 1)) >= k {
            base = f32::INFINITY;
            for node in nodes {
                let distances = to_boxes(lanes, self.node(height, node), at);
                let nearest = lanes.smallest(distances);
                if nearest < base {
                    let lane = lanes.at_most(distances, lanes.splat(nearest)).trailing_zeros();
                    (base, index) = (nearest, node * CHILDREN as u32 + lane);
                }
            }
            nodes = index..index + 1;
            height -= 1;
        }
        let base = if base < f32::INFINITY { base } else { 0.0 };
        let k = k as f32;
        let wanted = 1.05 * k + 3.0 * k.sqrt() + 2.0;
        (base, self.node(height, index).per_photon * wanted * std::f32::consts::FRAC_1_PI)
    }

    /// Squared distances of the photons of the leaves reached, and how many are within the radius.
    #[inline(always)]
    fn measure<L: Lanes>(&self, lanes: L, at: Point<L>, radius_squared: f32, scratch: &mut Scratch) -> usize {
        let Scratch { reached, distances, .. } = scratch;
        let limit = lanes.splat(radius_squared);
        if distances.len() < reached.len() {
            distances.resize(reached.len(), LaneRows([[0.0; LANES]; VECTORS]));
        }
        let mut count = 0;
        for (&leaf, distances) in reached.iter().zip(distances) {
            let leaf = &self.leaves[leaf as usize];
            for (vector, distances) in distances.0.iter_mut().enumerate() {
                let squared = squared(lanes, offsets(lanes, leaf, vector, at));
                lanes.store(squared, distances);
                count += lanes.at_most(squared, limit).count_ones() as usize;
            }
        }
        count
    }

    /// Lists the k nearest photons within the radius: nearest boxes first, and none that can't hold a nearer photon
    /// than the k-th so far. Of photons equally far those in the boxes visited first are taken, so that any number of
    /// them costs no more than k.
    #[inline(always)]
    fn search<L: Lanes>(&self, lanes: L, at: Point<L>, k: usize, radius_squared: f32, scratch: &mut Scratch) {
        let Scratch { found, pending, .. } = scratch;
        let mut limit = radius_squared;
        let mut room = k;
        found.clear();
        pending.clear();
        let height = self.levels.len() as u32;
        pending.extend((0..self.tops()).map(|index| Pending { distance_squared: 0.0, height, index }));
        while let Some(Pending { distance_squared, height, index }) = pending.pop() {
            if distance_squared > limit {
                continue;
            }
            let mut distances = [0.0; LANES];
            if height == 0 {
                for vector in 0..VECTORS {
                    let squared = squared(lanes, offsets(lanes, &self.leaves[index as usize], vector, at));
                    lanes.store(squared, &mut distances);
                    let place = |lane: usize| index * LEAF as u32 + (vector * LANES + lane) as u32;
                    each(lanes.at_most(squared, lanes.splat(limit)), |lane| found.push((distances[lane], place(lane))));
                }
                if found.len() >= room {
                    let (_, &mut (farthest, _), _) = found.select_nth_unstable_by(k - 1, |a, b| a.0.total_cmp(&b.0));
                    found.truncate(k);
                    limit = farthest.next_down();
                    room = k + k / 2 + LEAF;
                }
            } else {
                let vector = to_boxes(lanes, self.node(height as usize - 1, index), at);
                lanes.store(vector, &mut distances);
                let first = pending.len();
                each(lanes.at_most(vector, lanes.splat(limit)), |lane| {
                    let index = index * CHILDREN as u32 + lane as u32;
                    pending.push(Pending { distance_squared: distances[lane], height: height - 1, index });
                });
                pending[first..].sort_by(|a, b| b.distance_squared.total_cmp(&a.distance_squared));
            }
        }
        if found.len() > k {
            found.select_nth_unstable_by(k - 1, |a, b| a.0.total_cmp(&b.0));
            found.truncate(k);
        }
    }
}

/// Calls `visit` with each lane in `mask`.
#[inline(always)]
fn each(mut mask: Mask, mut visit: impl FnMut(usize)) {
    while mask != 0 {
        visit(mask.trailing_zeros() as usize);
        mask &= mask - 1;
    }
}

/// Visits (index, squared distance) of the nearest.
pub(super) struct VisitNearest<'a, F> {
    pub(super) nearest: Nearest<'a>,
    pub(super) scratch: &'a mut Scratch,
    pub(super) visit: F,
}

impl<F: FnMut(usize, f32)> SimdWork for VisitNearest<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let Self { nearest, scratch, mut visit } = self;
        let photons = &nearest.tree.photons;
        match nearest.find(lanes, scratch) {
            None => {}
            Some(NearestFound::Listed) => {
                scratch.found.iter().for_each(|&(distance, place)| visit(photons[place as usize] as usize, distance));
            }
            Some(NearestFound::Within { farthest, .. }) => {
                let farthest = lanes.splat(farthest);
                for (&leaf, distances) in scratch.reached.iter().zip(&scratch.distances) {
                    let photons = &photons[leaf as usize * LEAF..][..LEAF];
                    for (photons, distances) in photons.as_chunks::<LANES>().0.iter().zip(&distances.0) {
                        let mask = lanes.at_most(lanes.load(distances), farthest);
                        each(mask, |lane| visit(photons[lane] as usize, distances[lane]));
                    }
                }
            }
        }
    }
}

/// Adds the flux of the nearest, in the order of the leaves.
pub(super) struct SumNearest<'a, const C: usize> {
    pub(super) nearest: Nearest<'a>,
    pub(super) flux: &'a [LaneRows<C>],
    pub(super) scratch: &'a mut Scratch,
}

impl<const C: usize> SimdWork for SumNearest<'_, C> {
    type Output = NearestSum<C>;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> NearestSum<C> {
        let Self { nearest, flux, scratch } = self;
        let mut sum = NearestSum { count: 0, flux: [0.0; C], radius_squared: 0.0 };
        match nearest.find(lanes, scratch) {
            None => {}
            Some(NearestFound::Listed) => {
                sum.count = scratch.found.len();
                for &(distance, place) in &scratch.found {
                    sum.radius_squared = sum.radius_squared.max(distance);
                    let (block, lane) = (place as usize / LANES, place as usize % LANES);
                    (0..C).for_each(|channel| sum.flux[channel] += f64::from(flux[block].0[channel][lane]));
                }
            }
            Some(NearestFound::Within { farthest, count }) => {
                let limit = lanes.splat(farthest);
                let mut sums = [lanes.zero(); C];
                for (&leaf, distances) in scratch.reached.iter().zip(&scratch.distances) {
                    let flux = &flux[leaf as usize * VECTORS..][..VECTORS];
                    for (flux, distances) in flux.iter().zip(&distances.0) {
                        let distances = lanes.load(distances);
                        for (sum, flux) in sums.iter_mut().zip(&flux.0) {
                            *sum = lanes.accumulate(*sum, lanes.keep_at_most(lanes.load(flux), distances, limit));
                        }
                    }
                }
                (sum.count, sum.radius_squared) = (count, farthest);
                for (total, sum) in sum.flux.iter_mut().zip(sums) {
                    *total = total_of(lanes.lanes(sum));
                }
            }
        }
        sum
    }
}

/// The sum of the lanes, halved again and again.
#[inline(always)]
fn total_of(lanes: [f64; LANES]) -> f64 {
    let eight: [f64; 8] = std::array::from_fn(|lane| lanes[lane] + lanes[lane + 8]);
    let four: [f64; 4] = std::array::from_fn(|lane| eight[lane] + eight[lane + 4]);
    (four[0] + four[2]) + (four[1] + four[3])
}

/// Visits the photons within a radius (m), sixteen places of a leaf at a time. Those without any are left out.
pub(super) struct VisitWithin<'a, V> {
    pub(super) tree: &'a KdTree,
    pub(super) at: [f32; 3],
    pub(super) radius: f32,
    pub(super) scratch: &'a mut Scratch,
    pub(super) sixteen: &'a mut V,
}

/// Hears of sixteen places: which sixteen, offsets from the point, squared distances, and which of them are within.
/// `visit` has to be `#[inline(always)]`.
pub(super) trait VisitSixteen {
    fn visit(&mut self, place: usize, offset: &[[f32; LANES]; 3], distance_squared: &[f32; LANES], within: Mask);
}

impl<V: VisitSixteen> SimdWork for VisitWithin<'_, V> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let Self { tree, at, radius, scratch, sixteen } = self;
        let radius_squared = (radius * radius).min(FARTHEST);
        let (point, limit) = (splat(lanes, at), lanes.splat(radius_squared));
        tree.reach(lanes, point, radius_squared, usize::MAX, scratch);
        let (mut offset, mut distances) = (LaneRows([[0.0; LANES]; 3]), LaneRows([[0.0; LANES]]));
        for part in 0..scratch.reached.len() * VECTORS {
            let (leaf, vector) = (scratch.reached[part / VECTORS] as usize, part % VECTORS);
            let offsets = offsets(lanes, &tree.leaves[leaf], vector, point);
            let squared = squared(lanes, offsets);
            let mask = lanes.at_most(squared, limit);
            if mask == 0 {
                continue;
            }
            for (offset, offsets) in offset.0.iter_mut().zip(offsets) {
                lanes.store(offsets, offset);
            }
            lanes.store(squared, &mut distances.0[0]);
            sixteen.visit(leaf * VECTORS + vector, &offset.0, &distances.0[0], mask);
        }
    }
}

//! luxmap's own tree, made for density estimation: how much flux lies around a point, and how far its k nearest photons
//! reach. Lists and their order are not what it is for.
//!
//! **Layout.** A leaf holds 32 photons: their x, then y, then z, sixteen to a cache line, the last leaf filled up with
//! +∞. Sixteen leaves make a node, sixteen nodes the next, and so on without a pointer, until at most four are left. A
//! node holds the *tight* boxes of its children side by side, so sixteen distances cost six loads. Flux lies beside the
//! leaves in the same order: sums run over contiguous memory. 17 bytes a photon beside its flux, the caller's index
//! included.
//!
//! **Split rule.** Photons are halved at a whole number of nodes along the longest side of their tight box. The median
//! is found by counting ([`select`]), then one pass parts all columns ([`build`]), 16 at a time. Photons equal on the
//! cut are parted along the second longest side: a wall's photons share a coordinate, and would otherwise fall into
//! overlapping boxes.
//!
//! **The k nearest.** The density about the point, read off the node of about k photons there, gives a radius that
//! ought to hold a few more than k; the leaves it reaches are listed level by level without a branch on single boxes,
//! their distances stored, and counted. Too few, and the radius grows; else the k-th distance is found by counting, and
//! the photons up to it are the answer. No heap, no sorting, and the guess never shows in the result. Where photons
//! crowd (more leaves than k explains) or share the k-th distance, a search leaf by leaf takes over that stops at k: of
//! a million photons in one place a hundred are found no later than of as many spread over a floor.
//!
//! **Measured** (300,000 photons on the surfaces of the seed office or of an empty room of its size, one thread,
//! AVX-512):
//! - Leaves of 16 instead of 32: a third slower for k = 500, a fifth longer to build; of 64: a tenth faster or slower
//!   here and there.
//! - One node at the top instead of up to four: k = 10 a twentieth to a tenth slower, one dependent step more.
//! - Density by the mean of the leaves' boxes instead of their median: boxes that span floor and ceiling count for the
//!   floor's, and a quarter of the queries near random photons reached far too many leaves.
//! - Vectors kept on cache lines of their own, and the four nodes at the top: together a third off k = 100.
//! - AVX2 takes 1.4 to 1.8 times as long as AVX-512, plain Rust 2 to 8 times; to build, 2 and 4 times.
//! - Radius for k photons and three standard deviations more: 1 to 9 % of the queries have to try again (k = 10 to
//!   500).
//!
//! Same photons, same bits: whatever thread builds or asks, and whatever vector instructions the processor has
//! ([`simd`]).

mod build;
mod query;
mod select;
pub(crate) mod simd;

use rayon::prelude::*;

pub use self::query::Scratch;
use self::query::{Nearest, SumNearest, VisitNearest, VisitSixteen, VisitWithin};
use self::simd::{LANES, LaneRows, Mask, dispatch};
use super::{BlockVisitor, Carried, NearestPhotons, NearestSum, PhotonBlock};
use crate::flux::Flux;

/// Photons of a leaf.
const LEAF: usize = 32;
/// Vectors of a leaf.
const VECTORS: usize = LEAF / LANES;
/// Children of a node.
const CHILDREN: usize = LANES;
/// Most nodes of the highest level: looking at these costs less than one level more.
const TOPS: usize = 4;

/// Coordinates of a leaf's photons, m: all x, all y, all z; +∞ where there is none.
type Leaf = LaneRows<{ 3 * VECTORS }>;

/// The boxes of a node's children, m: from `low` to `high` along each axis, empty (+∞ to −∞) where there is none.
#[repr(align(64))]
struct Node {
    low: [[f32; CHILDREN]; 3],
    high: [[f32; CHILDREN]; 3],
    /// Area of a photon, m²: of the leaves' boxes, so that gaps between them don't count.
    per_photon: f32,
}

/// The nodes that are equally far from the leaves.
#[derive(Clone, Copy)]
struct NodeLevel {
    /// Where they begin.
    first: u32,
    /// How many children they have together.
    children: u32,
}

/// Hand-written kd-tree: blocked leaves, wide nodes, tight boxes; sums without a list.
pub struct KdTree {
    count: usize,
    leaves: Vec<Leaf>,
    /// The caller's index of each place in the leaves; of no meaning where there is none.
    photons: Vec<u32>,
    /// Level by level, the leaves' parents first.
    nodes: Vec<Node>,
    levels: Vec<NodeLevel>,
}

impl NearestPhotons for KdTree {
    type Scratch = Scratch;

    fn build(positions: &[[f32; 3]]) -> Self {
        build::build(positions)
    }

    fn scratch(&self) -> Scratch {
        Scratch::default()
    }

    fn memory(&self) -> usize {
        size_of_val(&*self.leaves) + size_of_val(&*self.photons) + size_of_val(&*self.nodes)
    }

    fn visit_nearest(&self, at: [f32; 3], k: usize, radius: f32, scratch: &mut Scratch, visit: impl FnMut(usize, f32)) {
        dispatch(VisitNearest { nearest: Nearest { tree: self, at, k, radius }, scratch, visit });
    }

    fn visit_within(&self, at: [f32; 3], radius: f32, scratch: &mut Scratch, visit: impl FnMut(usize, f32)) {
        dispatch(VisitWithin {
            tree: self,
            at,
            radius,
            scratch,
            sixteen: &mut OneByOne { photons: &self.photons, visit },
        });
    }

    fn carry<const C: usize>(&self, _: Vec<[f32; 3]>, flux: Vec<Flux<C>>) -> Carried<C> {
        let blocks = self.photons.par_chunks(LANES).with_min_len(256).map(|photons| {
            let mut block = LaneRows([[0.0; LANES]; C]);
            for (lane, &photon) in photons.iter().enumerate() {
                let Some(flux) = flux.get(photon as usize) else { continue };
                block.0.iter_mut().zip(flux.0).for_each(|(lanes, channel)| lanes[lane] = channel);
            }
            block
        });
        Carried { positions: Vec::new(), flux: blocks.collect() }
    }

    fn sum_nearest<const C: usize>(
        &self,
        carried: &Carried<C>,
        at: [f32; 3],
        k: usize,
        radius: f32,
        scratch: &mut Scratch,
    ) -> NearestSum<C> {
        dispatch(SumNearest { nearest: Nearest { tree: self, at, k, radius }, flux: &carried.flux, scratch })
    }

    fn visit_blocks<const C: usize>(
        &self,
        carried: &Carried<C>,
        at: [f32; 3],
        radius: f32,
        scratch: &mut Scratch,
        visitor: &mut impl BlockVisitor<C>,
    ) {
        dispatch(VisitWithin {
            tree: self,
            at,
            radius,
            scratch,
            sixteen: &mut WithFlux { flux: &carried.flux, visitor },
        });
    }
}

/// Calls back for each photon.
struct OneByOne<'a, F> {
    photons: &'a [u32],
    visit: F,
}

impl<F: FnMut(usize, f32)> VisitSixteen for OneByOne<'_, F> {
    #[inline(always)]
    fn visit(&mut self, place: usize, _: &[[f32; LANES]; 3], distance_squared: &[f32; LANES], mut mask: Mask) {
        while mask != 0 {
            let lane = mask.trailing_zeros() as usize;
            (self.visit)(self.photons[place * LANES + lane] as usize, distance_squared[lane]);
            mask &= mask - 1;
        }
    }
}

/// Shows them with their flux.
struct WithFlux<'a, V, const C: usize> {
    flux: &'a [LaneRows<C>],
    visitor: &'a mut V,
}

impl<V: BlockVisitor<C>, const C: usize> VisitSixteen for WithFlux<'_, V, C> {
    #[inline(always)]
    fn visit(&mut self, place: usize, offset: &[[f32; LANES]; 3], distance_squared: &[f32; LANES], _: Mask) {
        self.visitor.visit(&PhotonBlock { offset, distance_squared, flux: &self.flux[place].0 });
    }
}

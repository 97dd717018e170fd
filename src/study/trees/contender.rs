//! A tree with photons in it, whichever it is.

use std::hint::black_box;

use rayon::prelude::*;

use crate::flux::Flux;
use crate::photon_map::Tree;
use crate::photon_map::{
    BlockVisitor, BruteForce, KdTree, Kiddo, LANES, NearestPhotons, NearestSum, Paper, PhotonBlock, PhotonMap,
};

/// What a tree is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Call {
    /// (count, Σ flux, R²) of the k nearest within the search radius.
    Sum(usize),
    /// A visit of the k nearest within the search radius.
    Visit(usize),
    /// Σ φ (1 − d²/r²) within this radius r, m.
    Within(f32),
}

/// What the comparison needs of a tree.
pub(super) trait Contender: Send + Sync {
    /// Which tree.
    fn tree(&self) -> Tree;

    /// Memory beside the flux, bytes.
    fn memory(&self) -> usize;

    /// Answers a question at every point, on all threads of the current pool, and forgets the answers. `reach`: search
    /// radius of the k nearest, m.
    fn answer(&self, call: Call, reach: f32, points: &[[f32; 3]]);

    /// Squared distances of the `k` nearest within `reach` (m) as visited, m², sorted.
    fn distances(&self, at: [f32; 3], k: usize, reach: f32) -> Vec<f32>;

    /// The answer to [`Call::Sum`].
    fn sum(&self, at: [f32; 3], k: usize, reach: f32) -> NearestSum<1>;

    /// The answer to [`Call::Within`].
    fn kernel_sum(&self, at: [f32; 3], radius: f32) -> f64;
}

/// Builds a tree over photons.
pub(super) fn hold(tree: Tree, positions: Vec<[f32; 3]>, flux: Vec<Flux<1>>) -> Box<dyn Contender> {
    match tree {
        Tree::Kd => Box::new(Holding::<KdTree>::new(tree, positions, flux)),
        Tree::Kiddo => Box::new(Holding::<Kiddo>::new(tree, positions, flux)),
        Tree::Paper => Box::new(Holding::<Paper>::new(tree, positions, flux)),
        Tree::Brute => Box::new(Holding::<BruteForce>::new(tree, positions, flux)),
    }
}

/// A photon map and its tree's name.
pub(super) struct Holding<T> {
    tree: Tree,
    map: PhotonMap<T, 1>,
}

impl<T: NearestPhotons> Holding<T> {
    pub(super) fn new(tree: Tree, positions: Vec<[f32; 3]>, flux: Vec<Flux<1>>) -> Self {
        Self { tree, map: PhotonMap::build(positions, flux) }
    }

    fn within(&self, at: [f32; 3], radius: f32, scratch: &mut T::Scratch) -> f64 {
        kernel_sum(&self.map, at, radius, scratch)
    }
}

/// Σ φ (1 − d²/r²) of the photons within `radius` r (m) of a point, lm.
pub fn kernel_sum<T: NearestPhotons>(
    map: &PhotonMap<T, 1>,
    at: [f32; 3],
    radius: f32,
    scratch: &mut T::Scratch,
) -> f64 {
    let mut sum = KernelSum { per_area: 1.0 / (radius * radius), lanes: [0.0; LANES] };
    map.visit_blocks(at, radius, scratch, &mut sum);
    sum.lanes.iter().sum()
}

/// Σ φ (1 − d²/r²), by lanes.
struct KernelSum {
    per_area: f32,
    lanes: [f64; LANES],
}

impl BlockVisitor<1> for KernelSum {
    #[inline(always)]
    fn visit(&mut self, block: &PhotonBlock<'_, 1>) {
        for lane in 0..LANES {
            let kernel = (1.0 - block.distance_squared[lane] * self.per_area).max(0.0);
            self.lanes[lane] += f64::from(block.flux[0][lane] * kernel);
        }
    }
}

impl<T: NearestPhotons> Contender for Holding<T> {
    fn tree(&self) -> Tree {
        self.tree
    }

    fn memory(&self) -> usize {
        self.map.tree().memory()
    }

    fn answer(&self, call: Call, reach: f32, points: &[[f32; 3]]) {
        let piece = points.len().div_ceil(16 * rayon::current_num_threads()).max(64);
        points.par_chunks(piece).for_each(|points| {
            let mut scratch = self.map.scratch();
            for &at in points {
                match call {
                    Call::Sum(k) => drop(black_box(self.map.sum_nearest(at, k, reach, &mut scratch))),
                    Call::Visit(k) => self.map.tree().visit_nearest(at, k, reach, &mut scratch, |photon, distance| {
                        black_box((photon, distance));
                    }),
                    Call::Within(radius) => drop(black_box(self.within(at, radius, &mut scratch))),
                }
            }
        });
    }

    fn distances(&self, at: [f32; 3], k: usize, reach: f32) -> Vec<f32> {
        let mut found = Vec::new();
        self.map.tree().visit_nearest(at, k, reach, &mut self.map.scratch(), |_, distance| found.push(distance));
        found.sort_by(f32::total_cmp);
        found
    }

    fn sum(&self, at: [f32; 3], k: usize, reach: f32) -> NearestSum<1> {
        self.map.sum_nearest(at, k, reach, &mut self.map.scratch())
    }

    fn kernel_sum(&self, at: [f32; 3], radius: f32) -> f64 {
        self.within(at, radius, &mut self.map.scratch())
    }
}

//! The photon map: photons in a kd-tree, asked for the nearest of them.
//!
//! Three trees stand behind one trait, and callers never know which: [`Kiddo`] (the library's immutable tree), [`Paper`]
//! (the tree of the paper luxmap follows, kept to repeat its figures) and [`BruteForce`] (the oracle of the tests).
//! Density estimation needs more than a sorted list, so the trait offers visits without one, and [`PhotonMap`] reduces
//! them to (count, Σ flux, R²).

mod brute_force;
mod kiddo;
mod paper;

pub use brute_force::BruteForce;
pub use kiddo::Kiddo;
pub use paper::Paper;

use crate::photon::flux::{Flux, accumulate};

/// A search structure over photon positions.
pub trait NearestPhotons: Send + Sync + Sized {
    /// Memory a thread reuses from query to query.
    type Scratch: Send;

    /// Builds the structure over finite positions (m). Photon i keeps its index i.
    fn build(positions: &[[f32; 3]]) -> Self;

    /// Fresh memory for queries.
    fn scratch(&self) -> Self::Scratch;

    /// Visits (index, squared distance in m²) of the `k` photons nearest to `at` and no farther than `radius` (m), in no
    /// particular order. Which of several photons at equal distance are taken is up to the tree.
    fn visit_nearest(
        &self,
        at: [f32; 3],
        k: usize,
        radius: f32,
        scratch: &mut Self::Scratch,
        visit: impl FnMut(usize, f32),
    );

    /// Visits (index, squared distance in m²) of every photon no farther than `radius` (m), in no particular order.
    fn visit_within(&self, at: [f32; 3], radius: f32, scratch: &mut Self::Scratch, visit: impl FnMut(usize, f32));
}

/// What the k nearest photons add up to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestSum<const C: usize> {
    /// Photons found: k, or fewer where the radius holds fewer.
    pub count: usize,
    /// Their flux, lm.
    pub flux: [f64; C],
    /// Squared distance of the farthest, m².
    pub radius_squared: f32,
}

/// Photons in a tree, with what they carry.
pub struct PhotonMap<T, const C: usize> {
    tree: T,
    positions: Vec<[f32; 3]>,
    flux: Vec<Flux<C>>,
}

impl<T: NearestPhotons, const C: usize> PhotonMap<T, C> {
    /// Builds the tree over photons at `positions` (m, finite) that carry `flux` (lm); equal lengths.
    pub fn build(positions: Vec<[f32; 3]>, flux: Vec<Flux<C>>) -> Self {
        assert_eq!(positions.len(), flux.len(), "each photon has a position and a flux");
        Self { tree: T::build(&positions), positions, flux }
    }

    /// Number of photons.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether no photon is stored.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Fresh memory for queries, one for each thread.
    pub fn scratch(&self) -> T::Scratch {
        self.tree.scratch()
    }

    /// Position of a photon, m.
    #[inline]
    pub fn position(&self, photon: usize) -> [f32; 3] {
        self.positions[photon]
    }

    /// What a photon carries, lm.
    #[inline]
    pub fn flux(&self, photon: usize) -> Flux<C> {
        self.flux[photon]
    }

    /// The search structure itself.
    pub fn tree(&self) -> &T {
        &self.tree
    }

    /// (count, Σ flux, R²) of the `k` photons nearest to `at` within `radius` (m).
    pub fn sum_nearest(&self, at: [f32; 3], k: usize, radius: f32, scratch: &mut T::Scratch) -> NearestSum<C> {
        let mut sum = NearestSum { count: 0, flux: [0.0; C], radius_squared: 0.0 };
        self.tree.visit_nearest(at, k, radius, scratch, |photon, distance_squared| {
            sum.count += 1;
            sum.radius_squared = sum.radius_squared.max(distance_squared);
            accumulate(&mut sum.flux, self.flux[photon], 1.0);
        });
        sum
    }
}

/// Squared distance of two points, m².
#[inline]
fn distance_squared(a: [f32; 3], b: [f32; 3]) -> f32 {
    let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
}

//! The photon map: photons in a kd-tree, asked for the nearest of them.
//!
//! Four trees stand behind one trait, and callers never know which: [`KdTree`] (ours), [`Kiddo`] (the library's
//! immutable tree), [`Paper`] (the tree of the paper luxmap follows, kept to repeat its figures) and [`BruteForce`]
//! (the oracle of the tests). Density estimation needs more than a sorted list, so [`NearestPhotons`] offers visits
//! without one, sums of the k nearest (count, Σ flux, R²), and visits of all photons within a radius, sixteen at a
//! time.

mod brute_force;
mod kd_tree;
mod kiddo;
mod paper;
mod tree;

pub use brute_force::BruteForce;
pub use kd_tree::{KdTree, Scratch};
pub use kiddo::Kiddo;
pub use paper::Paper;
pub(crate) use tree::with_tree;
pub use tree::{ChosenMap, Tree};

pub use kd_tree::simd::LANES;
use kd_tree::simd::LaneRows;

pub use crate::flux::Flux;
use crate::flux::accumulate;

/// A search structure over photon positions.
///
/// The photons' flux lies beside the tree, as [`Carried`], in the order in which the tree reads it: sums over it are
/// the tree's to do. Trees without an order of their own have them from the visits.
pub trait NearestPhotons: Send + Sync + Sized {
    /// Memory a thread reuses from query to query. What it held before never changes a result.
    type Scratch: Send;

    /// Builds the structure over finite positions (m). Photon i keeps its index i.
    fn build(positions: &[[f32; 3]]) -> Self;

    /// Fresh memory for queries.
    fn scratch(&self) -> Self::Scratch;

    /// Memory of the structure, bytes.
    fn memory(&self) -> usize;

    /// Visits (index, squared distance in m²) of the `k` photons nearest to `at` and no farther than `radius` (m), in
    /// no particular order. Which of several photons at equal distance are taken is up to the tree.
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

    /// Lays out what the photons carry for the sums below. `positions` are those the tree was built over.
    fn carry<const C: usize>(&self, positions: Vec<[f32; 3]>, flux: Vec<Flux<C>>) -> Carried<C> {
        Carried::in_order(positions, &flux)
    }

    /// (count, Σ flux, R²) of the `k` photons nearest to `at` within `radius` (m).
    fn sum_nearest<const C: usize>(
        &self,
        carried: &Carried<C>,
        at: [f32; 3],
        k: usize,
        radius: f32,
        scratch: &mut Self::Scratch,
    ) -> NearestSum<C> {
        let mut sum = NearestSum { count: 0, flux: [0.0; C], radius_squared: 0.0 };
        self.visit_nearest(at, k, radius, scratch, |photon, distance_squared| {
            sum.count += 1;
            sum.radius_squared = sum.radius_squared.max(distance_squared);
            accumulate(&mut sum.flux, carried.flux(photon), 1.0);
        });
        sum
    }

    /// Shows the photons no farther than `radius` (m) to `visitor`, sixteen at a time.
    fn visit_blocks<const C: usize>(
        &self,
        carried: &Carried<C>,
        at: [f32; 3],
        radius: f32,
        scratch: &mut Self::Scratch,
        visitor: &mut impl BlockVisitor<C>,
    ) {
        let (mut offset, mut distances, mut flux) = ([[0.0; LANES]; 3], [f32::INFINITY; LANES], [[0.0; LANES]; C]);
        let mut count = 0;
        self.visit_within(at, radius, scratch, |photon, distance_squared| {
            let position = carried.positions[photon];
            (0..3).for_each(|axis| offset[axis][count] = position[axis] - at[axis]);
            (0..C).for_each(|channel| flux[channel][count] = carried.flux(photon).0[channel]);
            distances[count] = distance_squared;
            count += 1;
            if count == LANES {
                visitor.visit(&PhotonBlock { offset: &offset, distance_squared: &distances, flux: &flux });
                count = 0;
            }
        });
        if count > 0 {
            offset.iter_mut().chain([&mut distances]).for_each(|lanes| lanes[count..].fill(f32::INFINITY));
            flux.iter_mut().for_each(|lanes| lanes[count..].fill(0.0));
            visitor.visit(&PhotonBlock { offset: &offset, distance_squared: &distances, flux: &flux });
        }
    }
}

/// What the photons of a tree carry, in the order in which the tree reads it.
pub struct Carried<const C: usize> {
    /// Positions, m, for trees that don't hold them where they sum.
    positions: Vec<[f32; 3]>,
    /// Flux, lm, by channel and sixteen photons at a time.
    flux: Vec<LaneRows<C>>,
}

impl<const C: usize> Carried<C> {
    /// In the caller's order.
    fn in_order(positions: Vec<[f32; 3]>, flux: &[Flux<C>]) -> Self {
        let of =
            |photons: &[Flux<C>], channel: usize, lane: usize| photons.get(lane).map_or(0.0, |flux| flux.0[channel]);
        let block =
            |photons| LaneRows(std::array::from_fn(|channel| std::array::from_fn(|lane| of(photons, channel, lane))));
        Self { positions, flux: flux.chunks(LANES).map(block).collect() }
    }

    /// Of the photon at a place of the order.
    #[inline]
    fn flux(&self, place: usize) -> Flux<C> {
        let block = &self.flux[place / LANES].0;
        Flux(std::array::from_fn(|channel| block[channel][place % LANES]))
    }
}

/// Sixteen places for photons near a point. Where `distance_squared` is more than the squared radius there is none to
/// be counted, and `offset` may be infinite.
pub struct PhotonBlock<'a, const C: usize> {
    /// From the point to the photons along x, y and z, m.
    pub offset: &'a [[f32; LANES]; 3],
    /// Squared distances, m².
    pub distance_squared: &'a [f32; LANES],
    /// Flux by channel, lm.
    pub flux: &'a [[f32; LANES]; C],
}

/// Sums over photons near a point, sixteen at a time.
pub trait BlockVisitor<const C: usize> {
    /// Takes in a block. Where this is `#[inline(always)]` and loops over the lanes, our tree has it compiled for the
    /// vector instructions it found.
    fn visit(&mut self, block: &PhotonBlock<'_, C>);
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
    carried: Carried<C>,
    /// The same with a mark for each photon, if it has one: flux in the first channels, the mark in the last.
    marked: Option<Carried<MARKED>>,
    len: usize,
}

/// Channels of photons with marks: up to three of flux, and the mark.
pub const MARKED: usize = 4;

/// A photon that lies nowhere: NaN, infinite, or so far away that squared distances overflow.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("photon {photon}: found position {position:?}, expected finite coordinates up to {LARGEST_COORDINATE:e} m")]
pub struct Misplaced {
    /// Its index.
    pub photon: usize,
    /// Where it claims to be, m.
    pub position: [f32; 3],
}

/// Coordinates of photons are no larger, m.
const LARGEST_COORDINATE: f32 = 1e18;

impl<T: NearestPhotons, const C: usize> PhotonMap<T, C> {
    /// As [`Self::build`], for photons of unknown origin: looks at every position first.
    pub fn checked(positions: Vec<[f32; 3]>, flux: Vec<Flux<C>>) -> Result<Self, Misplaced> {
        let is_good = |position: &[f32; 3]| position.iter().all(|along| along.abs() <= LARGEST_COORDINATE);
        match positions.iter().position(|position| !is_good(position)) {
            Some(photon) => Err(Misplaced { photon, position: positions[photon] }),
            None => Ok(Self::build(positions, flux)),
        }
    }

    /// Builds the tree over photons at `positions` (m, finite, as those of the recorders are) that carry `flux` (lm);
    /// equal lengths.
    pub fn build(positions: Vec<[f32; 3]>, flux: Vec<Flux<C>>) -> Self {
        assert_eq!(positions.len(), flux.len(), "each photon has a position and a flux");
        let (tree, len) = (T::build(&positions), positions.len());
        Self { carried: tree.carry(positions, flux), marked: None, tree, len }
    }

    /// As [`Self::build`], each photon with a whole number below 2²⁴ that [`Self::visit_marked`] shows.
    pub fn build_marked(positions: Vec<[f32; 3]>, flux: Vec<Flux<C>>, marks: impl Iterator<Item = u32>) -> Self {
        let with_mark = |(flux, mark): (&Flux<C>, u32)| {
            let mut all = [0.0; MARKED];
            all[..C].copy_from_slice(&flux.0);
            all[MARKED - 1] = mark as f32;
            Flux(all)
        };
        let marked: Vec<Flux<MARKED>> = flux.iter().zip(marks).map(with_mark).collect();
        assert_eq!(marked.len(), flux.len(), "each photon has a mark");
        let map = Self::build(positions.clone(), flux);
        Self { marked: Some(map.tree.carry(positions, marked)), ..map }
    }

    /// Number of photons.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether no photon is stored.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Memory beside the flux itself, bytes.
    pub fn memory(&self) -> usize {
        self.tree.memory() + size_of_val(&*self.carried.positions)
    }

    /// Fresh memory for queries, one for each thread.
    pub fn scratch(&self) -> T::Scratch {
        self.tree.scratch()
    }

    /// The search structure itself.
    pub fn tree(&self) -> &T {
        &self.tree
    }

    /// (count, Σ flux, R²) of the `k` photons nearest to `at` within `radius` (m).
    pub fn sum_nearest(&self, at: [f32; 3], k: usize, radius: f32, scratch: &mut T::Scratch) -> NearestSum<C> {
        self.tree.sum_nearest(&self.carried, at, k, radius, scratch)
    }

    /// Shows the photons no farther than `radius` (m) from `at` to `visitor`, sixteen at a time.
    pub fn visit_blocks(
        &self,
        at: [f32; 3],
        radius: f32,
        scratch: &mut T::Scratch,
        visitor: &mut impl BlockVisitor<C>,
    ) {
        self.tree.visit_blocks(&self.carried, at, radius, scratch, visitor);
    }

    /// The same photons in the same order with their marks, in the last of [`MARKED`] channels; none if they have no
    /// marks.
    pub fn visit_marked(
        &self,
        at: [f32; 3],
        radius: f32,
        scratch: &mut T::Scratch,
        visitor: &mut impl BlockVisitor<MARKED>,
    ) {
        if let Some(marked) = &self.marked {
            self.tree.visit_blocks(marked, at, radius, scratch, visitor);
        }
    }
}

/// Squared distance of two points, m².
#[inline]
fn distance_squared(a: [f32; 3], b: [f32; 3]) -> f32 {
    let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
}
